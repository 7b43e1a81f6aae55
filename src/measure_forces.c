// See measure_forces.h. Anderson-Darling with fitted rate: R. B. D'Agostino and M. A. Stephens, Goodness-of-Fit
// Techniques (1986), table 4.14.
#include "measure_forces.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>

// ---- rates ----

static double p_of_anderson(double a) {
  if (a < 0.26)
    return 1 - exp(-12.2204 + 67.459 * a - 110.3 * a * a);
  if (a < 0.51)
    return 1 - exp(-6.1327 + 20.218 * a - 18.663 * a * a);
  if (a < 0.95)
    return exp(0.9209 - 3.353 * a + 0.3 * a * a);
  return a < 10 ? exp(0.731 - 3.009 * a + 0.15 * a * a) : 0;
}

// Quantile of chi-square over its degrees of freedom. GSL's search does not converge for a million of them; there the
// cube root is normal to 6e-7 (E. B. Wilson, M. M. Hilferty, PNAS 17 (1931) 684).
static double chi_square_share(double p, double freedom) {
  if (freedom < 2000)
    return gsl_cdf_chisq_Pinv(p, freedom) / freedom;
  const double variance = 2 / (9 * freedom);
  return pow(1 - variance + gsl_cdf_ugaussian_Pinv(p) * sqrt(variance), 3);
}

static void judge(tal_rate_fit *fit, const double *sorted) {
  const double n = (double)fit->count;
  double anderson = 0;
  for (size_t k = 0; k < fit->count; k++) {
    const double z = fmax(fit->rate * sorted[k], 1e-300), below = -expm1(-z);
    fit->distance = fmax(fit->distance, fmax(below - (double)k / n, ((double)k + 1) / n - below));
    // The k-th smallest enters by ln F with weight 2k + 1 and by ln(1 - F) = -z with the mirrored one.
    anderson -= ((2 * (double)k + 1) * log(below) - (2 * (n - (double)k) - 1) * z) / n;
  }
  anderson -= n;
  fit->p = fmax(0, fmin(1, p_of_anderson(anderson * (1 + 0.6 / n))));
}

tal_rate_fit tal_rate_fit_of(double *value, size_t count) {
  tal_rate_fit fit = {.count = count};
  const double mean = count ? gsl_stats_mean(value, 1, count) : 0;
  if (!(mean > 0))
    return fit;
  const double freedom = 2 * (double)count;
  fit.rate = 1 / mean;
  fit.low = fit.rate * chi_square_share(0.025, freedom);
  fit.high = fit.rate * chi_square_share(0.975, freedom);
  gsl_sort(value, 1, count);
  judge(&fit, value);
  return fit;
}

// ---- laws ----

// Sizes of the forces that are not 0; returns how many.
static size_t take_sizes(const double *force, size_t count, double *size) {
  size_t n = 0;
  for (size_t k = 0; k < count; k++)
    if (force[k] != 0)
      size[n++] = fabs(force[k]);
  return n;
}

// Equal forces are neither below nor above their mean, whatever its last digit.
static void fit_both(tal_force_law *law, const double *size, double *work) {
  const double hair = 1e-9 * law->mean;
  size_t below = 0, above = 0;
  for (size_t k = 0; k < law->contacts; k++)
    if (size[k] < law->mean - hair)
      work[below++] = -log(size[k] / law->mean);
  law->power = tal_rate_fit_of(work, below);
  law->below_mean = (double)below / (double)law->contacts;
  for (size_t k = 0; k < law->contacts; k++)
    if (size[k] > law->mean + hair)
      work[above++] = size[k] / law->mean - 1;
  law->tail = tal_rate_fit_of(work, above);
}

tal_force_law tal_force_law_of(const double *force, size_t count) {
  tal_force_law law = {0};
  double *size = tal_alloc(count, sizeof *size), *work = tal_alloc(count, sizeof *work), squares = 0;
  law.contacts = take_sizes(force, count, size);
  if (law.contacts) {
    const double n = (double)law.contacts;
    law.mean = gsl_stats_mean(size, 1, law.contacts);
    for (size_t k = 0; k < law.contacts; k++)
      squares += size[k] / law.mean * (size[k] / law.mean);
    law.deviation = sqrt(fmax(0, squares / n - 1));
    law.participation = n / squares;
    law.largest = gsl_stats_max(size, 1, law.contacts) / law.mean;
    fit_both(&law, size, work);
  }
  free(size);
  free(work);
  return law;
}

// ---- histogram ----

static double edge_of(size_t k) {
  return k <= 30 ? pow(10, (double)k / 10 - 3) : 1 + 0.25 * ((double)k - 30);
}

static size_t bin_of(double x) {
  if (x < 1)
    return (size_t)fmax(0, floor((log10(x) + 3) * 10));
  return 30 + (size_t)floor((x - 1) / 0.25);
}

void tal_force_histogram(const double *force, size_t count, tal_force_bin bin[TAL_FORCE_BINS]) {
  double *size = tal_alloc(count, sizeof *size);
  const size_t n = take_sizes(force, count, size);
  const double mean = n ? gsl_stats_mean(size, 1, n) : 1;
  for (size_t k = 0; k < TAL_FORCE_BINS; k++)
    bin[k] = (tal_force_bin){.low = edge_of(k), .high = edge_of(k + 1)};
  for (size_t k = 0; k < n; k++) {
    const double x = size[k] / mean;
    const size_t at = bin_of(x);
    if (x >= bin[0].low && at < TAL_FORCE_BINS)
      bin[at].count++;
  }
  for (size_t k = 0; k < TAL_FORCE_BINS && n; k++)
    bin[k].density = (double)bin[k].count / ((double)n * (bin[k].high - bin[k].low));
  free(size);
}

// ---- of a part ----

double *tal_part_forces(const tal_part *part, const double *column) {
  double *force = tal_alloc(part->contact_count, sizeof *force);
  for (size_t k = 0; k < part->contact_count; k++)
    force[k] = column[part->contact[k]];
  return force;
}

static tal_friction_use friction_use(const double *fn, const double *ft, size_t count, double friction) {
  tal_friction_use use = {0};
  size_t n = 0;
  for (size_t k = 0; k < count; k++) {
    if (!(fn[k] > 0))
      continue;
    const double ratio = fabs(ft[k]) / fn[k];
    n++;
    use.ratio += ratio;
    use.at_limit += friction > 0 && ratio >= 0.99 * friction;
  }
  if (!n)
    return use;
  use.ratio /= (double)n;
  use.at_limit /= (double)n;
  use.mean = friction > 0 ? use.ratio / friction : 0;
  return use;
}

tal_forces tal_forces_measure(const tal_part *part, double friction) {
  double *fn = tal_part_forces(part, part->of->contacts.fn), *ft = tal_part_forces(part, part->of->contacts.ft);
  const size_t n = part->contact_count;
  const tal_forces forces = {tal_force_law_of(fn, n), tal_force_law_of(ft, n), friction_use(fn, ft, n, friction)};
  free(fn);
  free(ft);
  return forces;
}
