// What a metric takes from the files of one run. Private to study*.c and their tests.
#ifndef TAL_STUDY_METRICS_H
#define TAL_STUDY_METRICS_H

#include "figures_data.h"
#include "study.h"

// A number from series.csv. Between rows the column is a straight line; a window's mean is the mean of that line (S1).
// Rows before the strain begins do not count. TAL_BAD_INPUT with the reason when the table does not hold it.
tal_status tal_metric_of_series(const tal_study_metric *metric, const tal_table *series, double *value, tal_error *why);

// Displacement fluctuations of the grains between two frames: displacement less the affine field fitted to it (least
// squares, four gradients and a translation), of the grains that are corners of cells in both frames (of all grains
// where there are no cells).
typedef struct tal_fluctuation {
  size_t count;
  int64_t *id;    // owned; [count] ascending
  uint64_t start; // hash of their places at the begin: equal for runs from the same state
  double *u, *v;  // owned; [count] [m]
} tal_fluctuation;

// Frames nearest to the metric's from and to in `dir`. Not further off than a twentieth of the window.
tal_status tal_fluctuation_read(tal_fluctuation *out, const tal_study_metric *metric, const char *dir, tal_error *why);
// The fluctuation itself: positions x, y at the begin and displacements dx, dy [n], which become it. Fewer than four
// points: zero.
void tal_fluctuation_of(const double *x, const double *y, double *dx, double *dy, size_t n);
void tal_fluctuation_clear(tal_fluctuation *fluctuation);
// (S6): sum a.b / sqrt(sum a.a sum b.b) over the grains in both: 1 for the same field, 0 in the mean for independent
// ones; NAN when they share fewer than two grains or a field is zero.
double tal_fluctuation_correlation(const tal_fluctuation *a, const tal_fluctuation *b);

#endif
