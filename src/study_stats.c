// See study_stats.h. Welch-Satterthwaite: B. L. Welch, Biometrika 34 (1947) 28.
#include "study_stats.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>

tal_estimate tal_estimate_of(const double *value, size_t n) {
  tal_estimate e = {n, (double)NAN, (double)NAN};
  if (n > 0)
    e.mean = gsl_stats_mean(value, 1, n);
  if (n > 1)
    e.error = gsl_stats_sd(value, 1, n) / sqrt((double)n);
  return e;
}

double tal_student(double confidence, double freedom) {
  return freedom > 0 ? gsl_cdf_tdist_Pinv(0.5 + confidence / 2, freedom) : (double)NAN;
}

// Differences at the common seeds; returns their number.
static size_t pair(tal_samples a, tal_samples b, double *difference) {
  size_t n = 0;
  for (size_t i = 0, j = 0; i < a.count && j < b.count;) {
    if (a.seed[i] == b.seed[j])
      difference[n++] = a.value[i++] - b.value[j++];
    else if (a.seed[i] < b.seed[j])
      i++;
    else
      j++;
  }
  return n;
}

static void fill_unpaired(tal_difference *d, tal_samples setting, tal_samples reference) {
  const tal_estimate a = tal_estimate_of(setting.value, setting.count);
  const tal_estimate b = tal_estimate_of(reference.value, reference.count);
  const double va = a.error * a.error, vb = b.error * b.error;
  d->n = a.n < b.n ? a.n : b.n;
  d->mean = a.mean - b.mean;
  d->error = sqrt(va + vb);
  d->freedom = va + vb > 0 ? (va + vb) * (va + vb) / (va * va / (double)(a.n - 1) + vb * vb / (double)(b.n - 1))
                           : (double)(a.n + b.n) - 2;
}

tal_difference tal_difference_of(tal_samples setting, tal_samples reference, double confidence) {
  tal_difference d = {0};
  double *difference = tal_alloc(setting.count + 1, sizeof *difference);
  const size_t common = pair(setting, reference, difference);
  d.paired = common > 1 || (common == 1 && (setting.count < 2 || reference.count < 2));
  if (d.paired) {
    const tal_estimate e = tal_estimate_of(difference, common);
    d.n = e.n;
    d.mean = e.mean;
    d.error = e.error;
    d.freedom = (double)common - 1;
  } else {
    fill_unpaired(&d, setting, reference);
  }
  // No scatter at all excludes every bias but the one seen.
  d.half = d.error == 0 ? 0 : tal_student(confidence, d.freedom) * d.error;
  d.bound = fabs(d.mean) + d.half;
  free(difference);
  return d;
}

void tal_frontier(const double *cost, const double *distance, size_t n, bool *on) {
  for (size_t k = 0; k < n; k++) {
    on[k] = isfinite(cost[k]) && isfinite(distance[k]);
    for (size_t j = 0; on[k] && j < n; j++)
      if (cost[j] <= cost[k] && distance[j] <= distance[k] && (cost[j] < cost[k] || distance[j] < distance[k]))
        on[k] = false;
  }
}

double tal_median(double *value, size_t n) {
  if (!n)
    return (double)NAN;
  gsl_sort(value, 1, n);
  return gsl_stats_median_from_sorted_data(value, 1, n);
}
