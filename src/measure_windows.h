// Strain windows: which frame each measured motion starts from, and the material boxes that windows are compared on.
#ifndef TAL_MEASURE_WINDOWS_H
#define TAL_MEASURE_WINDOWS_H

#include "measure_bands.h"
#include "measure_motion.h"
#include "measure_select.h"

typedef struct tal_window_plan {
  size_t *from; // owned; [frames] the frame a motion that ends here starts from; SIZE_MAX: none ends here
  bool *end;    // owned; [frames] end of one of the windows that follow each other
  size_t first; // frame where the first of these begins
  double step;  // axial strain of a window; 0 when the run has none: then each frame ends one
} tal_window_plan;
// Windows of `step` follow each other from the last frame without axial strain on; the frames of --at end one each too.
void tal_window_plan_make(tal_window_plan *plan, const tal_frame_choice *choice, double step);
void tal_window_plan_clear(tal_window_plan *plan);

// Square boxes of the material, laid over the grains of one instant.
typedef struct tal_boxes {
  size_t count, grains;
  int64_t *id;  // owned; [grains]
  int32_t *box; // owned; [grains]
} tal_boxes;
void tal_boxes_lay(tal_boxes *boxes, const tal_earlier *instant, double side);
void tal_boxes_clear(tal_boxes *boxes);
// mean[count] of value over the known grains of each box, NAN where there are fewer than three.
void tal_boxes_mean(const tal_boxes *boxes, const tal_snapshot *snapshot, const tal_motion *motion, const double *value,
                    double *mean);

#endif
