// Hertz contact with stiffness-proportional viscosity, eqs (1)-(3) of docs/method.md [P 2.16, 3.A1]:
// fn = K d^1.5 + T K d^0.5 d', clipped at zero. K = 4/3 Ebar sqrt(Reff).
#ifndef TAL_LAW_HERTZ_H
#define TAL_LAW_HERTZ_H

#include "effects.h"
#include <math.h>

// K [N/m^1.5] from the plane-strain moduli E/(1 - nu^2) [Pa] of both sides (INFINITY: rigid) and the reduced radius
// [m].
static inline double tal_hertz_stiffness(double modulus_i, double modulus_j, double reduced_radius) {
  double modulus = 1 / (1 / modulus_i + 1 / modulus_j);
  return 4.0 / 3 * modulus * sqrt(reduced_radius);
}

// overlap d >= 0 [m]; root = sqrt(d).
TAL_KERNEL double tal_hertz_elastic(double stiffness, double overlap, double root) {
  return stiffness * overlap * root;
}
TAL_KERNEL double tal_hertz_viscous(double damping, double root, double approach) {
  return damping * root * approach;
}
// Slope of the elastic force [N/m].
TAL_KERNEL double tal_hertz_slope(double stiffness, double root) {
  return 1.5 * stiffness * root;
}
// Stored energy [J].
TAL_KERNEL double tal_hertz_energy(double stiffness, double overlap) {
  return 0.4 * stiffness * overlap * overlap * sqrt(overlap);
}

#endif
