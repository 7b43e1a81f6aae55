// The bed of resting disks in a box, bucketed so that a falling or rolling disk looks only at the disks beside it.
// One bucket grid per power of two in radius: the buckets of small disks stay small whatever the largest disk is.
#ifndef TAL_PACK_BED_H
#define TAL_PACK_BED_H

#include "base.h"

enum { TAL_BED_LEVELS = 10 };

typedef struct tal_bed_level {
  double reach;             // [m] no disk of the level is larger in radius
  double cell;              // [m] edge of a bucket, >= 2 reach
  size_t columns, capacity; // buckets across, rows allocated
  size_t rows;              // rows in use
  int32_t *first;           // owned; [capacity][columns] first disk of each bucket, -1 empty
} tal_bed_level;

typedef struct tal_bed {
  const double *x, *y, *r; // [count] [m] the caller's; radii all known, centres of the disks added so far
  size_t count;            // disks in all
  size_t added;            // disks at rest
  double width;            // [m]
  double largest;          // [m] largest radius
  int32_t *next;           // owned; [count] next disk of the same bucket, -1 last
  int32_t *near;           // owned; [near_capacity] answer of tal_bed_near
  size_t near_capacity;
  tal_bed_level level[TAL_BED_LEVELS];
} tal_bed;

void tal_bed_init(tal_bed *bed, const double *x, const double *y, const double *r, size_t count, double width);
void tal_bed_clear(tal_bed *bed);
// Adds disk i, whose centre is now x[i], y[i] (inside the box).
void tal_bed_add(tal_bed *bed, int32_t i);

// First meeting of a disk of radius r that falls straight down at x from height `from` (its centre; may be infinite):
// the disk it lands on, or -1 for the floor, and the height of its centre there. Disks whose centre is not below
// `from` are passed, so also the one it has just rolled off at its own height.
int32_t tal_bed_landing(const tal_bed *bed, double x, double r, double from, double *height);
// Disks whose bounding square meets the box [x0, x1] x [y0, y1]: their number; ids in bed->near.
size_t tal_bed_near(tal_bed *bed, double x0, double x1, double y0, double y1);

#endif
