// Which frames are measured: --window keeps those of a range of axial strain, --at names those that get maps and lists.
#ifndef TAL_MEASURE_SELECT_H
#define TAL_MEASURE_SELECT_H

#include "figures_frames.h"
#include <stdbool.h>

typedef struct tal_frame_choice {
  tal_frame_list frames; // all of the run
  bool *in;              // owned; [frames.count] in the window
  bool *detail;          // owned; [frames.count] named by --at
  size_t in_count;
} tal_frame_choice;

// window: "A:B" axial strains, an end left out is open; NULL: all frames. at: comma-separated list of an axial strain,
// t=TIME, frame=NUMBER, first, last, peak (largest stress ratio in series.csv), all; NULL: last. Each takes the nearest
// frame of the window. TAL_BAD_INPUT when `dir` has no frames, when the window or `at` is none or holds no frame;
// TAL_IO.
tal_status tal_frame_choose(tal_frame_choice *choice, const char *dir, const char *window, const char *at,
                            tal_error *err);
void tal_frame_choice_clear(tal_frame_choice *choice);
// The frame of the window whose axial strain is nearest to `strain`; the earlier of two.
size_t tal_frame_nearest(const tal_frame_choice *choice, double strain);

#endif
