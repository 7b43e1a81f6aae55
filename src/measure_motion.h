// What happened between two stored instants: displacements and rotations of the grains, strain of the cells, how
// rotations of neighbours go together, and what is left of a velocity field beside its affine part. (M28)-(M32).
#ifndef TAL_MEASURE_MOTION_H
#define TAL_MEASURE_MOTION_H

#include "measure_snapshot.h"

// Of an earlier instant, what motion needs.
typedef struct tal_earlier {
  size_t count;
  int64_t *id;               // owned; ascending
  double *x, *y, *theta;     // owned; [count] [m], [rad]
  double time, axial_strain; //
} tal_earlier;
tal_earlier tal_earlier_of(const tal_snapshot *snapshot);
// As tal_snapshot_read.
tal_status tal_earlier_read(tal_earlier *earlier, const char *path, tal_error *err);
void tal_earlier_clear(tal_earlier *earlier);

// From the earlier instant to that of the part, for the grains that both have.
typedef struct tal_motion {
  double *dx, *dy, *dtheta; // owned; [grains of the snapshot] [m], [rad]; 0 where not known
  bool *matched;            // owned; [grains of the snapshot] there in the earlier instant
  bool *known;              // owned; and in the part
  double *shear, *dilation; // owned; [cells of the snapshot] principal strain difference, area strain (M28)
  bool *cell;               // owned; [cells of the snapshot] those have a meaning
  double *grain_shear;      // owned; [grains of the snapshot] area-weighted mean of shear over the cells around
  size_t known_count;
  double mean_shear, mean_dilation; // weighted by area
  // Rotations with their sign. Those beyond the size that 98 % stay below count as that: a grain that carries nothing
  // spins as it likes.
  double *turn;                                        // owned; [grains of the snapshot] [rad]
  double mean_rotation, median_rotation, rms_rotation; // [rad] of it; of its size
} tal_motion;
void tal_motion_find(tal_motion *motion, const tal_part *part, const tal_earlier *earlier);
void tal_motion_clear(tal_motion *motion);

// Correlation of rotations over distance (M30), in bins half a mean diameter wide: signed, less the mean; and
// magnitude, less its mean. The length is that of amplitude exp(-r/length) fitted to the magnitude's, 0 where there is
// none.
enum { TAL_CORRELATION_BINS = 24 };
typedef struct tal_rotation_correlation {
  double width;                       // [m] of a bin
  size_t pairs[TAL_CORRELATION_BINS]; // centres between k width and (k + 1) width apart
  double rotation[TAL_CORRELATION_BINS], magnitude[TAL_CORRELATION_BINS];
  double length, length_error, amplitude; // [m]
} tal_rotation_correlation;
tal_rotation_correlation tal_rotation_correlate(const tal_part *part, const tal_motion *motion);

// Takes the affine field fitted by least squares out of u, v [count] at x, y (six numbers; fewer where the points do
// not tell them). Returns the root mean square of what is left.
double tal_affine_remove(size_t count, const double *x, const double *y, double *u, double *v);

#endif
