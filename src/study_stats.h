// The statistics of a study: means over seeds, differences from the reference, what they exclude, the frontier. Plain
// numbers; GSL's mean, deviation and Student's t. Equations (S2)-(S5).
#ifndef TAL_STUDY_STATS_H
#define TAL_STUDY_STATS_H

#include "base.h"
#include <stdbool.h>

// Mean over samples (S2); NAN where n is too small.
typedef struct tal_estimate {
  size_t n;
  double mean, error; // standard error sd / sqrt(n)
} tal_estimate;

tal_estimate tal_estimate_of(const double *value, size_t n);

// A setting against the reference (S3), (S4).
typedef struct tal_difference {
  bool paired;    // over the seeds common to both
  size_t n;       // common seeds, else the smaller number
  double mean;    // setting - reference
  double error;   // standard error
  double freedom; // degrees of freedom: n - 1, or Welch's for unpaired samples
  double half;    // half width of the confidence interval: t(confidence, freedom) error
  double bound;   // |mean| + half: a larger bias is excluded (S5)
} tal_difference;

// Paired over seeds[] that both have (ascending, no value NAN), if there are at least two; else difference of means.
typedef struct tal_samples {
  const int64_t *seed;
  const double *value;
  size_t count;
} tal_samples;
tal_difference tal_difference_of(tal_samples setting, tal_samples reference, double confidence);
// Two-sided quantile of Student's t; NAN for freedom <= 0.
double tal_student(double confidence, double freedom);

// on[k]: no other point is both cheaper and nearer (or as cheap and nearer, or cheaper and as near). Points with NAN
// are never on it.
void tal_frontier(const double *cost, const double *distance, size_t n, bool *on);
// Median of value[n], which is sorted by it; NAN for none.
double tal_median(double *value, size_t n);

#endif
