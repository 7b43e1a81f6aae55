// Measuring a run from its stored fields: what `talus measure DIR` does. One pass over the frames; while one is
// measured the next is read.
// The measurements themselves are functions of a part of a snapshot (measure_snapshot.h): measure_tensors.h,
// measure_forces.h, measure_chains.h, measure_voids.h, measure_bands.h. Tables and figures: docs/formats.md.
#ifndef TAL_MEASURE_H
#define TAL_MEASURE_H

#include "base.h"
#include "measure_bands.h"
#include "measure_chain_lives.h"
#include "measure_chains.h"
#include "measure_export.h"
#include "measure_forces.h"
#include "measure_motion.h"
#include "measure_snapshot.h"
#include "measure_tensors.h"
#include "measure_voids.h"
#include <stdbool.h>

typedef struct tal_measure_options {
  const char *at, *window;    // as in tal_frame_choose; NULL: the default
  tal_region region;          // zero: everywhere
  double angle;               // [rad] of force chains, 0: 45 degrees
  double over;                // axial strain over which displacements are taken, 0: 0.02
  const char *const *exports; // fields to write as CSV, "contacts" or "contacts/fn"
  size_t export_count;
  bool figures;
  void (*progress)(void *user, size_t done, size_t of); // NULL: none; after each frame
  void (*made)(void *user, const char *path);           // NULL: none; each file written
  bool (*stop)(void *user);                             // NULL: never; asked after each frame
  void *user;
} tal_measure_options;

typedef struct tal_measure_counts {
  size_t frames, grains, contacts; // measured; grains and contacts of the last frame's part
} tal_measure_counts;

// Writes tables and figures into the folder `out` (made when it is missing). TAL_BAD_INPUT when `dir` has no frames or
// an option is wrong (nothing is written then) or a frame is damaged; TAL_IO; TAL_INTERRUPTED, without tables when
// frames were left.
tal_status tal_measure(const char *dir, const char *out, const tal_measure_options *options, tal_measure_counts *counts,
                       tal_error *err);

#endif
