// Radius laws against their closed forms: distribution (Kolmogorov-Smirnov), moments, the sieve curve; refusals.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "radius.h"
#include "random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DRAWS = 100000 };

static double *draw(const tal_radius *law, tal_shape shape, uint64_t seed, size_t n) {
  double *r = tal_alloc(n, sizeof *r);
  gsl_rng *rng = tal_random_stream(seed, TAL_STREAM_RADIUS);
  tal_radius_draw(law, shape, rng, r, n);
  gsl_rng_free(rng);
  return r;
}

static void moments(const double *r, size_t n, double *mean, double *variance) {
  double sum = 0, squares = 0;
  for (size_t i = 0; i < n; i++)
    sum += r[i] / (double)n;
  for (size_t i = 0; i < n; i++)
    squares += (r[i] - sum) * (r[i] - sum) / (double)(n - 1);
  *mean = sum;
  *variance = squares;
}

static int ascending(const void *a, const void *b) {
  double left = *(const double *)a, right = *(const double *)b;
  return (left > right) - (left < right);
}

// Distribution functions, from erf() alone.
static double below(const tal_radius *law, double r) {
  if (law->law == TAL_RADIUS_UNIFORM)
    return (r - law->min) / (law->max - law->min);
  double scale = 1 / (law->sigma * sqrt(2.0)), z = log(r / law->median) * scale;
  double low = log(law->min / law->median) * scale, high = log(law->max / law->median) * scale;
  if (low > 0)
    return (erfc(low) - erfc(z)) / (erfc(low) - erfc(high));
  return (erf(z) - erf(low)) / (erf(high) - erf(low));
}

// Kolmogorov-Smirnov distance times sqrt(n); sorts r.
static double distance(const tal_radius *law, double *r, size_t n) {
  qsort(r, n, sizeof *r, ascending);
  double worst = 0;
  for (size_t i = 0; i < n; i++) {
    double p = below(law, r[i]);
    worst = fmax(worst, fmax(fabs(p - (double)i / (double)n), fabs(p - (double)(i + 1) / (double)n)));
  }
  return worst * sqrt((double)n);
}

static const tal_radius laws[] = {
    {.law = TAL_RADIUS_UNIFORM, .min = 0.5e-3, .max = 1e-3},
    {.law = TAL_RADIUS_LOGNORMAL, .median = 1e-3, .sigma = 0.4, .min = 0, .max = (double)INFINITY},
    {.law = TAL_RADIUS_LOGNORMAL, .median = 1e-3, .sigma = 0.5, .min = 0.7e-3, .max = 2e-3},
    {.law = TAL_RADIUS_LOGNORMAL, .median = 1e-3, .sigma = 0.1, .min = 1.7e-3, .max = 2e-3}, // 5 to 7 sigma above
    {.law = TAL_RADIUS_LOGNORMAL, .median = 1e-3, .sigma = 0.1, .min = 0, .max = 0.6e-3},    // 5 sigma below
};
enum { LAWS = sizeof laws / sizeof *laws };

// MODEL: the drawn radii follow the law's distribution function (1.95: passed by 99.9 % of true samples), stay inside
// its bounds, and shift visibly when the law shifts.
static void follows_distribution(void **state) {
  (void)state;
  for (size_t k = 0; k < LAWS; k++) {
    double *r = draw(&laws[k], TAL_DISK, 7 + k, DRAWS);
    assert_true(distance(&laws[k], r, DRAWS) < 1.95);
    assert_true(r[0] >= laws[k].min && r[DRAWS - 1] <= laws[k].max);
    tal_radius other = laws[k];
    other.min *= 0.98;
    other.max *= 0.98;
    other.median *= 0.98;
    assert_true(distance(&other, r, DRAWS) > 1.95);
    free(r);
  }
}

// Simpson's rule of f(r) = r^power times the density, over the law's window (10 sigma where it is open).
static double moment_by_quadrature(const tal_radius *law, int power) {
  double low = fmax(log(law->min / law->median) / law->sigma, -10.0);
  double high = fmin(log(law->max / law->median) / law->sigma, 10.0), sum = 0, norm = 0;
  const int n = 20000;
  for (int k = 0; k <= n; k++) {
    double z = low + (high - low) * k / n, weight = (k == 0 || k == n ? 1 : k % 2 ? 4 : 2) * exp(-0.5 * z * z);
    norm += weight;
    sum += weight * pow(law->median * exp(law->sigma * z), power);
  }
  return sum / norm;
}

// MODEL: mean and variance of the draws against the closed form (uniform) and quadrature (lognormal), 3 s.e.
// ROUND: tal_radius_mean against the same to 1e-9.
static void has_moments(void **state) {
  (void)state;
  for (size_t k = 0; k < LAWS; k++) {
    const tal_radius *law = &laws[k];
    bool uniform = law->law == TAL_RADIUS_UNIFORM;
    double span = law->max - law->min;
    double mean = uniform ? 0.75e-3 : moment_by_quadrature(law, 1);
    double variance = uniform ? span * span / 12 : moment_by_quadrature(law, 2) - mean * mean;
    double *r = draw(law, TAL_DISK, 100 + k, DRAWS), drawn_mean, drawn_variance, fourth = 0;
    moments(r, DRAWS, &drawn_mean, &drawn_variance);
    for (size_t i = 0; i < DRAWS; i++)
      fourth += pow(r[i] - drawn_mean, 4) / DRAWS;
    assert_true(fabs(drawn_mean - mean) < 3 * sqrt(variance / DRAWS));
    assert_true(fabs(drawn_variance - variance) < 3 * sqrt((fourth - variance * variance) / DRAWS));
    assert_true(fabs(tal_radius_mean(law, TAL_DISK) - mean) < 1e-9 * mean);
    free(r);
  }
}

// One straight piece in percent against ln D: every percentile is in closed form.
static double straight[2][2] = {{0.2e-3, 0}, {3.2e-3, 100}};
// A real-looking grading with a step (gap grading) and an open lower end.
static double graded[][2] = {{0.1e-3, 4}, {0.2e-3, 30}, {0.4e-3, 30}, {0.8e-3, 75}, {2e-3, 100}};

// ROUND: sizes sit at the percentiles (2k - 1)/(2M) of the curve; numbers go with D^-2 (disks), D^-3 (spheres).
static void sieve_sizes_closed_form(void **state) {
  (void)state;
  tal_radius law = {.law = TAL_RADIUS_SIEVE, .passing = straight, .passing_count = 2, .sizes = 8};
  double diameter[8], probability[8];
  for (int shape = TAL_DISK; shape <= TAL_SPHERE; shape++) {
    int power = shape == TAL_SPHERE ? 3 : 2;
    tal_radius_sieve_sizes(&law, (tal_shape)shape, diameter, probability);
    double sum = 0, mean = 0;
    for (int k = 0; k < 8; k++)
      sum += pow(diameter[k], -power);
    for (int k = 0; k < 8; k++) {
      double expected = 0.2e-3 * exp(log(16.0) * (2 * k + 1) / 16);
      assert_true(fabs(diameter[k] - expected) < 1e-14 * expected * 16);
      assert_true(fabs(probability[k] - pow(diameter[k], -power) / sum) < 1e-14);
      mean += 0.5 * expected * probability[k];
    }
    assert_true(fabs(tal_radius_mean(&law, (tal_shape)shape) - mean) < 1e-14 * mean * 16);
  }
}

// Percent passing of the curve, straight in ln D between sieves.
static double percent_passing(double d) {
  if (d < graded[0][0])
    return 0;
  for (size_t k = 1; k < 5; k++)
    if (d < graded[k][0])
      return graded[k - 1][1] +
             (graded[k][1] - graded[k - 1][1]) * log(d / graded[k - 1][0]) / log(graded[k][0] / graded[k - 1][0]);
  return 100;
}

// MODEL: the mass of the drawn grains reproduces the sieve curve: within half a size class (50/M percent) plus 3 s.e.
static void sieve_reproduces_curve(void **state) {
  (void)state;
  tal_radius law = {.law = TAL_RADIUS_SIEVE, .passing = graded, .passing_count = 5, .sizes = 50};
  for (int shape = TAL_DISK; shape <= TAL_SPHERE; shape++) {
    double *r = draw(&law, (tal_shape)shape, 5, DRAWS);
    int power = shape == TAL_SPHERE ? 3 : 2;
    for (double d = 0.09e-3; d < 2.2e-3; d *= 1.2345) {
      double total = 0, finer = 0, spread = 0;
      for (size_t i = 0; i < DRAWS; i++)
        total += pow(r[i], power);
      for (size_t i = 0; i < DRAWS; i++)
        finer += 2 * r[i] < d ? pow(r[i], power) / total : 0;
      for (size_t i = 0; i < DRAWS; i++) {
        double part = pow(r[i], power) / total * ((2 * r[i] < d) - finer);
        spread += part * part;
      }
      assert_true(fabs(100 * finer - percent_passing(d)) < 50.0 / 50 + 300 * sqrt(spread) + 1e-9);
    }
    free(r);
  }
}

// EXACT: lengths times four give radii times four, and the seed alone decides; 64-bit seeds and streams all differ.
static void same_bits(void **state) {
  (void)state;
  double scaled[5][2];
  for (size_t k = 0; k < 5; k++) {
    scaled[k][0] = 4 * graded[k][0];
    scaled[k][1] = graded[k][1];
  }
  for (size_t k = 0; k <= LAWS; k++) {
    tal_radius law = {.law = TAL_RADIUS_SIEVE, .passing = graded, .passing_count = 5, .sizes = 10};
    if (k < LAWS)
      law = laws[k];
    tal_radius larger = law;
    larger.min *= 4;
    larger.max *= 4;
    larger.median *= 4;
    if (k == LAWS)
      larger.passing = scaled;
    double *r = draw(&law, TAL_DISK, 3, 1000), *again = draw(&law, TAL_DISK, 3, 1000);
    double *big = draw(&larger, TAL_DISK, 3, 1000), *other = draw(&law, TAL_DISK, 3 + (1ull << 40), 1000);
    assert_memory_equal(r, again, 1000 * sizeof *r);
    assert_memory_not_equal(r, other, 1000 * sizeof *r);
    for (size_t i = 0; i < 1000; i++)
      assert_true(big[i] == 4 * r[i]);
    free(r);
    free(again);
    free(big);
    free(other);
  }
  gsl_rng *radius = tal_random_stream(3, TAL_STREAM_RADIUS), *drop = tal_random_stream(3, TAL_STREAM_DROP);
  assert_true(gsl_rng_get(radius) != gsl_rng_get(drop));
  gsl_rng_free(radius);
  gsl_rng_free(drop);
}

// EXACT: what cannot be drawn from is refused, with the number in the sentence.
static void refuses(void **state) {
  (void)state;
  double descending[2][2] = {{1e-3, 50}, {0.5e-3, 100}}, over[1][2] = {{1e-3, 101}};
  const struct {
    tal_radius law;
    const char *says;
  } bad[] = {
      {{.law = TAL_RADIUS_UNIFORM, .min = 0, .max = 1e-3}, "above 0"},
      {{.law = TAL_RADIUS_UNIFORM, .min = -1e-3, .max = 1e-3}, "-0.001"},
      {{.law = TAL_RADIUS_UNIFORM, .min = 2e-3, .max = 1e-3}, "at most max"},
      {{.law = TAL_RADIUS_UNIFORM, .min = 1e-3, .max = (double)INFINITY}, "finite"},
      {{.law = TAL_RADIUS_UNIFORM, .min = (double)NAN, .max = 1}, "nan"},
      {{.law = TAL_RADIUS_LOGNORMAL, .median = 0, .sigma = 1, .max = 1}, "median 0"},
      {{.law = TAL_RADIUS_LOGNORMAL, .median = 1, .sigma = -1, .max = 1}, "sigma -1"},
      {{.law = TAL_RADIUS_LOGNORMAL, .median = 3, .sigma = 0, .max = 1}, "median 3 lies outside"},
      {{.law = TAL_RADIUS_SIEVE, .passing = descending, .passing_count = 2, .sizes = 5}, "0.0005"},
      {{.law = TAL_RADIUS_SIEVE, .passing = over, .passing_count = 1, .sizes = 5}, "101"},
      {{.law = TAL_RADIUS_SIEVE, .passing = straight, .passing_count = 2, .sizes = 0}, "at least one"},
  };
  for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
    tal_error err = {{0}};
    assert_int_equal(tal_radius_check(&bad[k].law, &err), TAL_BAD_INPUT);
    assert_non_null(strstr(err.text, bad[k].says));
  }
  for (size_t k = 0; k < LAWS; k++)
    assert_int_equal(tal_radius_check(&laws[k], NULL), TAL_OK);
}

// EXACT: a law with one size says so, any other has none.
static void single_size(void **state) {
  (void)state;
  tal_radius uniform = {.law = TAL_RADIUS_UNIFORM, .min = 2e-3, .max = 2e-3};
  tal_radius lognormal = {.law = TAL_RADIUS_LOGNORMAL, .median = 2e-3, .sigma = 0, .max = 1};
  double passing[1][2] = {{4e-3, 100}};
  tal_radius sieve = {.law = TAL_RADIUS_SIEVE, .passing = passing, .passing_count = 1, .sizes = 1};
  const tal_radius *all[] = {&uniform, &lognormal, &sieve};
  for (size_t k = 0; k < 3; k++) {
    double *r = draw(all[k], TAL_DISK, 1, 10);
    for (size_t i = 0; i < 10; i++)
      assert_true(r[i] == 2e-3);
    assert_true(tal_radius_single(all[k]) == 2e-3 && tal_radius_mean(all[k], TAL_DISK) == 2e-3);
    free(r);
  }
  for (size_t k = 0; k < LAWS; k++)
    assert_true(isnan(tal_radius_single(&laws[k])));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(follows_distribution),
      cmocka_unit_test(has_moments),
      cmocka_unit_test(sieve_sizes_closed_form),
      cmocka_unit_test(sieve_reproduces_curve),
      cmocka_unit_test(same_bits),
      cmocka_unit_test(refuses),
      cmocka_unit_test(single_size),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
