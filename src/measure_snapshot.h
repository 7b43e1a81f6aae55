// One stored instant of a run, DIR/fields/NNNNNN.h5, with all that the measurements read, and the part of it that a
// region selects. The seal is checked before a byte is trusted; every index is checked.
#ifndef TAL_MEASURE_SNAPSHOT_H
#define TAL_MEASURE_SNAPSHOT_H

#include "base.h"
#include <stdbool.h>

// Columns by name: X(name, unit). All [count] doubles, owned.
#define TAL_SNAPSHOT_GRAINS(X)                                                                                         \
  X(x, "m")                                                                                                            \
  X(y, "m")                                                                                                            \
  X(r, "m")                                                                                                            \
  X(theta, "rad")                                                                                                      \
  X(vx, "m/s")                                                                                                         \
  X(vy, "m/s")                                                                                                         \
  X(omega, "rad/s")                                                                                                    \
  X(stress_xx, "Pa")                                                                                                   \
  X(stress_xy, "Pa")                                                                                                   \
  X(stress_yx, "Pa")                                                                                                   \
  X(stress_yy, "Pa")

#define TAL_SNAPSHOT_CONTACTS(X)                                                                                       \
  X(fn, "N")                                                                                                           \
  X(ft, "N")                                                                                                           \
  X(nx, "1")                                                                                                           \
  X(ny, "1")                                                                                                           \
  X(overlap, "m")

// Touching pairs. Hairs are left out: an overlap that is round-off of the coordinates (a packing that rests on nothing
// but geometry) has no force that means anything.
typedef struct tal_snapshot_contacts {
  size_t count;
  int32_t *i, *j; // owned; grains, j of a wall contact is the wall
#define X(name, unit) double *name;
  TAL_SNAPSHOT_CONTACTS(X) // the force on i is fn n + ft t, n = (nx, ny) into i, t = (-ny, nx)
#undef X
} tal_snapshot_contacts;

typedef struct tal_snapshot {
  double time, axial_strain; // [s], [-]
  int64_t step, stage;
  size_t grain_count;
  int64_t *id; // owned; ascending
#define X(name, unit) double *name;
  TAL_SNAPSHOT_GRAINS(X)
#undef X
  tal_snapshot_contacts contacts, walls;
  size_t cell_count;
  int32_t (*corner)[3]; // owned; grains, counter-clockwise
  double *cell_area;    // owned; [cell_count] [m^2]
} tal_snapshot;

// TAL_IO when the file cannot be read; TAL_BAD_INPUT when its seal is broken or it contradicts itself. Empty then.
tal_status tal_snapshot_read(tal_snapshot *snapshot, const char *path, tal_error *err);
void tal_snapshot_clear(tal_snapshot *snapshot);

// Where to measure: everywhere, in a rectangle or in a disc.
typedef enum tal_region_kind { TAL_REGION_ALL, TAL_REGION_BOX, TAL_REGION_DISC } tal_region_kind;
typedef struct tal_region {
  tal_region_kind kind;
  double a, b, c, d; // [m] box: x0 x1 y0 y1; disc: x y radius
} tal_region;

// "x0:x1,y0:y1" (an end left out is open) or "disc:x,y,r". TAL_BAD_INPUT with what is accepted.
tal_status tal_region_parse(tal_region *region, const char *text, tal_error *err);
bool tal_region_has(const tal_region *region, double x, double y);

// What of a snapshot lies in a region: grains by centre, contacts by contact point, cells by centroid.
typedef struct tal_part {
  const tal_snapshot *of; // borrowed
  tal_region region;
  bool *grain; // owned; [grain_count]
  size_t grain_count, contact_count, cell_count;
  int32_t *contact;     // owned; [contact_count] indices, ascending
  int32_t *cell;        // owned; [cell_count] indices, ascending
  double area;          // [m^2] of its cells
  double mean_fn;       // [N] over its contacts, 0 when there are none
  double mean_diameter; // [m] over its grains, 0 when there are none
} tal_part;

void tal_part_select(tal_part *part, const tal_snapshot *snapshot, const tal_region *region);
void tal_part_clear(tal_part *part);

#endif
