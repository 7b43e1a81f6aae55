// The directional tensor of the force network seen from one grain [P 4.1-4.2], eqs (R2)-(R5): which way its strong
// chains run, out from the grain or across. Pure functions of centres and contacts; nothing here knows of motion.
#ifndef TAL_DIRECTIONAL_H
#define TAL_DIRECTIONAL_H

#include "vec.h"
#include <stddef.h>
#include <stdint.h>

// Segments of the force network: contact c joins the centres of grains i[c] and j[c]. All borrowed.
typedef struct tal_network {
  const double *x, *y;  // [grains] centres [m]
  const int64_t *i, *j; // [contacts] grain indices
  const double *f;      // [contacts] force carried [N], >= 0
  size_t contacts;
  double mean_force; // <f> over all contacts of the assembly [N]
  double diameter;   // mean diameter of the grains [m]: the unit of |s|
} tal_network;

// (R2): T over the segments whose middle lies within `reach` mean diameters of `from`. *segments (may be NULL): how
// many. All zero where there is none or <f> is not positive.
geo_tensor tal_directional_tensor(const tal_network *network, geo_vec from, double reach, size_t *segments);
// Eigenvalues of Sym(T), the larger first, and unit eigenvectors with x > 0 (or x = 0, y > 0).
void tal_directional_axes(geo_tensor tensor, double value[2], geo_vec axis[2]);
// (R4), (R5) summed per sector of the direction of s: `count` equal sectors counter-clockwise from angle 0.
// along[count]: W; across[count] (may be NULL): what segments that carry more than <f> contribute across that
// direction.
void tal_directional_rose(const tal_network *network, geo_vec from, double reach, size_t count, double *along,
                          double *across);
// Sector of the direction (x, y).
size_t tal_directional_sector(double x, double y, size_t count);

#endif
