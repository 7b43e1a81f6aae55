// Linear spring and dashpot, eq (4) of docs/method.md: fn = k d + c d', clipped at zero. Because of the clipping the
// contact ends while the grains still overlap, and the speed ratio is eq (5), not the textbook exp(-pi ...).
#ifndef TAL_LAW_LINEAR_H
#define TAL_LAW_LINEAR_H

#include "effects.h"

// Delivered speed ratio for the damping ratio zeta = c / (2 sqrt(k m)) >= 0, force clipped at zero.
double tal_linear_restitution(double damping_ratio);
// The damping ratio that delivers the speed ratio e in (0, 1]; inverse of the above by GSL's root finder.
double tal_linear_damping_ratio(double restitution);

TAL_KERNEL double tal_linear_elastic(double stiffness, double overlap) {
  return stiffness * overlap;
}
TAL_KERNEL double tal_linear_viscous(double damping, double approach) {
  return damping * approach;
}
TAL_KERNEL double tal_linear_energy(double stiffness, double overlap) {
  return 0.5 * stiffness * overlap * overlap;
}

#endif
