// Displacements relative to an affine field with uniform strain [P fig. 2.6, 3.7]: u_x = a_x + e_xx x, u_y = a_y + e_yy
// y. e_yy is what the plates impose; e_xx and the rigid translation are fitted by least squares over the grains. No
// shear and no rigid rotation is taken out.
#ifndef TAL_FIGURES_AFFINE_H
#define TAL_FIGURES_AFFINE_H

#include "base.h"

typedef struct tal_affine {
  double ax, ay;   // [m]
  double exx, eyy; // [-] extension positive
} tal_affine;

// Fits to displacements dx, dy [n] of points x, y [n]. All zero for n = 0; exx = 0 when all x are the same.
tal_affine tal_affine_fit(size_t n, const double *x, const double *y, const double *dx, const double *dy, double eyy);
// Takes the field out of dx, dy [n].
void tal_affine_subtract(tal_affine affine, size_t n, const double *x, const double *y, double *dx, double *dy);

#endif
