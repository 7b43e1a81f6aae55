// What the tables of bands (measure_report_bands.c) and their figures (measure_figures_bands.c) share. Private to them.
#ifndef TAL_MEASURE_REPORT_BANDS_H
#define TAL_MEASURE_REPORT_BANDS_H

#include "measure_map.h"
#include "measure_windows.h"

// Velocity at the instant and displacement over the window less their affine parts.
typedef struct tal_fluctuations {
  size_t count;
  double *x, *y, *vx, *vy, *ux, *uy; // x owned, the others within it; [count] [m], [m/s], [m]
  int32_t *grain;                    // owned; [count]
  double velocity, displacement;     // [m/s], [m] root mean squares
} tal_fluctuations;
tal_fluctuations tal_fluctuations_of(const tal_part *part, const tal_motion *motion);

// Shear of the cells; size of the rotation of the grains.
tal_field tal_shear_field(const tal_part *part, const tal_motion *motion);
tal_field tal_rotation_field(const tal_part *part, const tal_motion *motion);

// Maps of shear with its band and of displacement fluctuations, and profiles across the band. field, band: shear,
// rotation.
void tal_bands_draw(tal_measuring *run, const tal_part *part, double from_strain, const tal_motion *motion,
                    const tal_field field[2], const tal_band band[2], const tal_fluctuations *fluctuations);
void tal_persistence_draw(tal_measuring *run, const tal_windows windows[2], double step);

#endif
