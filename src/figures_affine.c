// The affine part of a displacement field [P 2.9, fig. 2.6].
#include "figures_affine.h"

static double mean(size_t n, const double *value) {
  double sum = 0;
  for (size_t k = 0; k < n; k++)
    sum += value[k];
  return n ? sum / (double)n : 0;
}

tal_affine tal_affine_fit(size_t n, const double *x, const double *y, const double *dx, const double *dy, double eyy) {
  double mx = mean(n, x), my = mean(n, y), mdx = mean(n, dx), mdy = mean(n, dy);
  double cross = 0, square = 0;
  for (size_t k = 0; k < n; k++) {
    cross += (x[k] - mx) * (dx[k] - mdx);
    square += (x[k] - mx) * (x[k] - mx);
  }
  tal_affine affine = {.exx = square > 0 ? cross / square : 0, .eyy = eyy};
  affine.ax = mdx - affine.exx * mx;
  affine.ay = mdy - eyy * my;
  return affine;
}

void tal_affine_subtract(tal_affine affine, size_t n, const double *x, const double *y, double *dx, double *dy) {
  for (size_t k = 0; k < n; k++) {
    dx[k] -= affine.ax + affine.exx * x[k];
    dy[k] -= affine.ay + affine.eyy * y[k];
  }
}
