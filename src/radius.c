// Draws from the radius laws; what they mean is in the header.
#include "radius.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_randist.h>
#include <math.h>
#include <stdlib.h>

static tal_status check_sieve(const tal_radius *law, tal_error *err) {
  if (law->passing_count < 1 || law->sizes < 1)
    return tal_fail(err, TAL_BAD_INPUT, "a sieve curve needs at least one [diameter, percent] and one size");
  for (size_t k = 0; k < law->passing_count; k++) {
    double diameter = law->passing[k][0], percent = law->passing[k][1];
    if (!(diameter > 0 && isfinite(diameter)) || !(percent >= 0 && percent <= 100))
      return tal_fail(err, TAL_BAD_INPUT, "[%g, %g] in passing: diameters are above 0, percent lies in 0..100",
                      diameter, percent);
    if (k > 0 && !(diameter > law->passing[k - 1][0] && percent >= law->passing[k - 1][1]))
      return tal_fail(err, TAL_BAD_INPUT, "[%g, %g] in passing: diameters must ascend and percent must not descend",
                      diameter, percent);
  }
  return TAL_OK;
}

tal_status tal_radius_check(const tal_radius *law, tal_error *err) {
  if (law->law == TAL_RADIUS_SIEVE)
    return check_sieve(law, err);
  if (!(law->min >= 0 && law->max >= law->min) || (law->law == TAL_RADIUS_UNIFORM && !(law->min > 0)))
    return tal_fail(err, TAL_BAD_INPUT, "min %g and max %g: radii are above 0 and min is at most max", law->min,
                    law->max);
  if (law->law == TAL_RADIUS_UNIFORM)
    return isfinite(law->max) ? TAL_OK : tal_fail(err, TAL_BAD_INPUT, "max %g must be finite", law->max);
  if (!(law->median > 0 && isfinite(law->median)) || !(law->sigma >= 0 && isfinite(law->sigma)))
    return tal_fail(err, TAL_BAD_INPUT, "median %g and sigma %g: median is above 0, sigma is 0 or more", law->median,
                    law->sigma);
  if (law->sigma == 0 && !(law->min <= law->median && law->median <= law->max))
    return tal_fail(err, TAL_BAD_INPUT, "median %g lies outside min %g and max %g", law->median, law->min, law->max);
  return TAL_OK;
}

static void draw_uniform(const tal_radius *law, gsl_rng *rng, double *r, size_t n) {
  for (size_t i = 0; i < n; i++)
    r[i] = law->min + gsl_rng_uniform(rng) * (law->max - law->min);
}

// The cut-offs as values z of the standard normal variable, mirrored into the lower tail (sign -1) where both lie in
// the upper one: there the distribution function keeps its digits.
typedef struct normal_window {
  double sign, low, high; // z in [low, high]; ln(r / median) = sign sigma z
} normal_window;

static normal_window window_of(const tal_radius *law) {
  double low = log(law->min / law->median) / law->sigma, high = log(law->max / law->median) / law->sigma;
  return low > 0 ? (normal_window){-1, -high, -low} : (normal_window){1, low, high};
}

static void draw_lognormal(const tal_radius *law, gsl_rng *rng, double *r, size_t n) {
  if (law->sigma == 0) {
    for (size_t i = 0; i < n; i++)
      r[i] = law->median;
    return;
  }
  normal_window window = window_of(law);
  double p_low = gsl_cdf_ugaussian_P(window.low), p_high = gsl_cdf_ugaussian_P(window.high);
  for (size_t i = 0; i < n; i++) {
    double p = p_low + gsl_rng_uniform_pos(rng) * (p_high - p_low);
    // A window below the smallest probability a number can hold is all at its upper edge.
    double z = p > 0 ? fmin(fmax(gsl_cdf_ugaussian_Pinv(p), window.low), window.high) : window.high;
    r[i] = fmin(fmax(law->median * exp(window.sign * law->sigma * z), law->min), law->max);
  }
}

// Diameter below which `percent` of the mass passes.
static double sieve_diameter(const tal_radius *law, double percent) {
  size_t k = 0;
  while (k < law->passing_count && law->passing[k][1] < percent)
    k++;
  if (k == 0)
    return law->passing[0][0];
  if (k == law->passing_count)
    return law->passing[k - 1][0];
  const double *fine = law->passing[k - 1], *coarse = law->passing[k];
  return fine[0] * pow(coarse[0] / fine[0], (percent - fine[1]) / (coarse[1] - fine[1]));
}

void tal_radius_sieve_sizes(const tal_radius *law, tal_shape shape, double *diameter, double *probability) {
  double size_count = (double)law->sizes, sum = 0;
  for (int64_t k = 0; k < law->sizes; k++) {
    diameter[k] = sieve_diameter(law, 100 * ((double)(2 * k + 1) / (2 * size_count)));
    double ratio = diameter[0] / diameter[k];
    probability[k] = shape == TAL_SPHERE ? ratio * ratio * ratio : ratio * ratio;
    sum += probability[k];
  }
  for (int64_t k = 0; k < law->sizes; k++)
    probability[k] /= sum;
}

static void draw_sieve(const tal_radius *law, tal_shape shape, gsl_rng *rng, double *r, size_t n) {
  size_t sizes = (size_t)law->sizes;
  double *diameter = tal_alloc(sizes, sizeof *diameter), *probability = tal_alloc(sizes, sizeof *probability);
  tal_radius_sieve_sizes(law, shape, diameter, probability);
  gsl_ran_discrete_t *table = gsl_ran_discrete_preproc(sizes, probability);
  for (size_t i = 0; i < n; i++)
    r[i] = 0.5 * diameter[gsl_ran_discrete(rng, table)];
  gsl_ran_discrete_free(table);
  free(probability);
  free(diameter);
}

void tal_radius_draw(const tal_radius *law, tal_shape shape, gsl_rng *rng, double *r, size_t n) {
  if (law->law == TAL_RADIUS_UNIFORM)
    draw_uniform(law, rng, r, n);
  if (law->law == TAL_RADIUS_LOGNORMAL)
    draw_lognormal(law, rng, r, n);
  if (law->law == TAL_RADIUS_SIEVE)
    draw_sieve(law, shape, rng, r, n);
}

static double mean_lognormal(const tal_radius *law) {
  if (law->sigma == 0)
    return law->median;
  normal_window window = window_of(law);
  double shift = window.sign * law->sigma;
  double part = gsl_cdf_ugaussian_P(window.high - shift) - gsl_cdf_ugaussian_P(window.low - shift);
  double whole = gsl_cdf_ugaussian_P(window.high) - gsl_cdf_ugaussian_P(window.low);
  double mean = law->median * exp(0.5 * law->sigma * law->sigma) * (part / whole);
  return whole > 0 ? fmin(fmax(mean, law->min), law->max) : (window.sign > 0 ? law->max : law->min);
}

static double mean_sieve(const tal_radius *law, tal_shape shape) {
  size_t sizes = (size_t)law->sizes;
  double *diameter = tal_alloc(sizes, sizeof *diameter), *probability = tal_alloc(sizes, sizeof *probability);
  tal_radius_sieve_sizes(law, shape, diameter, probability);
  double mean = 0;
  for (size_t k = 0; k < sizes; k++)
    mean += 0.5 * diameter[k] * probability[k];
  free(probability);
  free(diameter);
  return mean;
}

double tal_radius_mean(const tal_radius *law, tal_shape shape) {
  if (law->law == TAL_RADIUS_UNIFORM)
    return 0.5 * (law->min + law->max);
  return law->law == TAL_RADIUS_SIEVE ? mean_sieve(law, shape) : mean_lognormal(law);
}

double tal_radius_single(const tal_radius *law) {
  if (law->law != TAL_RADIUS_SIEVE && law->min == law->max)
    return law->min;
  if (law->law == TAL_RADIUS_LOGNORMAL && law->sigma == 0)
    return law->median;
  if (law->law == TAL_RADIUS_SIEVE && law->sizes == 1)
    return 0.5 * sieve_diameter(law, 50);
  return (double)NAN;
}
