// Fits of force distributions against samples drawn from known ones; shares, participation, friction of known sets.
#include <stdarg.h>
#include <stddef.h>

#include <setjmp.h>

#include <stdint.h>

#include <cmocka.h>

#include "measure_forces.h"
#include "snapshots.h"
#include <gsl/gsl_randist.h>
#include <gsl/gsl_rng.h>

static void assert_near(double value, double wanted, double tolerance) {
  if (!(fabs(value - wanted) <= tolerance))
    fail_msg("%.17g is not %.17g within %g", value, wanted, tolerance);
}

enum { SAMPLES = 2000, SIZE = 80 };

// MODEL: the 95 % intervals of 2000 drawn samples hold the true rate in 95 % of them, and the test rejects a true
// exponential at 5 % in 5 % of them, both within 3 s.e.; it sees a wrong one (a gamma of shape 2) nearly always.
static void test_rates_of_drawn_samples(void **state) {
  (void)state;
  const double rate = 1.4, sd = 3 * sqrt(0.05 * 0.95 / SAMPLES);
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  double inside = 0, rejected = 0, seen = 0, value[SIZE];
  for (int k = 0; k < SAMPLES; k++) {
    for (int i = 0; i < SIZE; i++)
      value[i] = gsl_ran_exponential(random, 1 / rate);
    const tal_rate_fit fit = tal_rate_fit_of(value, SIZE);
    inside += fit.low <= rate && rate <= fit.high;
    rejected += fit.p < 0.05;
    for (int i = 0; i < SIZE; i++)
      value[i] = gsl_ran_gamma(random, 2, 1);
    seen += tal_rate_fit_of(value, SIZE).p < 0.05;
  }
  gsl_rng_free(random);
  assert_near(inside / SAMPLES, 0.95, sd);
  assert_near(rejected / SAMPLES, 0.05, sd + 0.005); // the published formula is good to half a percent there
  assert_true(seen > 0.99 * SAMPLES);
}

// MODEL: forces drawn as the model says, x^alpha below the mean and exp(-beta x) above it, with the share and the two
// parts' means such that the mean is 1: both exponents come back within their intervals, the tests accept them.
static void test_both_laws_of_one_sample(void **state) {
  (void)state;
  // A share w below with mean (1 + alpha)/(2 + alpha), the rest above with mean 1 + 1/beta: overall mean 1.
  enum { N = 20000 };
  const double alpha = -0.2, beta = 1.5;
  const double below = 1 - (1 + alpha) / (2 + alpha), above = 1 / beta, w = above / (below + above);
  static double force[N];
  gsl_rng *random = gsl_rng_alloc(gsl_rng_taus2);
  for (int k = 0; k < N; k++)
    force[k] = 0.4 * (gsl_rng_uniform(random) < w ? pow(gsl_rng_uniform_pos(random), 1 / (1 + alpha))
                                                  : 1 + gsl_ran_exponential(random, 1 / beta));
  gsl_rng_free(random);
  const tal_force_law law = tal_force_law_of(force, N);
  assert_near(law.mean, 0.4, 0.4 * 3 * law.deviation / sqrt(N));
  assert_near(law.below_mean, w, 3 * sqrt(w * (1 - w) / N) + 0.01); // and the sample's mean is not quite the model's
  assert_true(law.tail.low < beta && beta < law.tail.high && law.tail.p > 0.01);
  assert_true(law.power.low < 1 + alpha && 1 + alpha < law.power.high);
  assert_near((law.tail.high - law.tail.low) / beta, 2 * 1.96 / sqrt((1 - w) * N), 0.03 * 2 * 1.96 / sqrt((1 - w) * N));
}

// ROUND: a known set of four forces, sign ignored, a zero left out.
static void test_known_forces(void **state) {
  (void)state;
  const double force[] = {1, -2, 0, 3, 6};
  const tal_force_law law = tal_force_law_of(force, 5);
  assert_int_equal(law.contacts, 4);
  assert_near(law.mean, 3, 1e-15);
  assert_near(law.below_mean, 0.5, 0);
  assert_near(law.largest, 2, 1e-15);
  assert_near(law.participation, 144.0 / (4 * 50), 1e-15);
  assert_near(law.deviation, sqrt(50.0 / 36 - 1), 1e-15);
  assert_int_equal(law.tail.count, 1);
  assert_near(law.tail.rate, 1, 1e-15); // one value one mean above
  assert_near(law.power.rate, 2 / (log(3) + log(1.5)), 1e-14);
}

// EXACT: equal forces are neither below nor above their mean; nothing gives nothing, never NaN.
static void test_degenerate(void **state) {
  (void)state;
  const double equal[] = {0.1, 0.1, 0.1, 0.1, 0.1, 0.1}, none[] = {0, 0};
  tal_force_law law = tal_force_law_of(equal, 6);
  assert_int_equal(law.tail.count + law.power.count, 0);
  assert_near(law.below_mean + law.tail.rate + law.power.rate, 0, 0);
  assert_near(law.participation, 1, 1e-15);
  law = tal_force_law_of(none, 2);
  assert_int_equal(law.contacts, 0);
  assert_near(law.mean + law.deviation + law.largest + law.participation, 0, 0);
  tal_force_bin bin[TAL_FORCE_BINS];
  tal_force_histogram(none, 2, bin);
  for (size_t k = 0; k < TAL_FORCE_BINS; k++)
    assert_near(bin[k].density, 0, 0);
}

// ROUND: bins join, hold what belongs to them, and densities integrate to 1.
static void test_histogram(void **state) {
  (void)state;
  const double force[] = {0.5, 0.5, 1, 1.1, 1.9, 1, 1, 1, 1, 1}; // mean 1
  tal_force_bin bin[TAL_FORCE_BINS];
  tal_force_histogram(force, 10, bin);
  double sum = 0;
  size_t count = 0;
  for (size_t k = 0; k < TAL_FORCE_BINS; k++) {
    if (k)
      assert_near(bin[k].low, bin[k - 1].high, 0);
    sum += bin[k].density * (bin[k].high - bin[k].low);
    count += bin[k].count;
    if (bin[k].low <= 0.5 && 0.5 < bin[k].high)
      assert_int_equal(bin[k].count, 2);
  }
  assert_int_equal(count, 10);
  assert_near(sum, 1, 1e-14);
  assert_near(bin[0].low, 1e-3, 1e-18);
  assert_near(bin[TAL_FORCE_BINS - 1].high, 10, 1e-14);
}

// ROUND: three contacts of known |ft| / fn.
static void test_friction_use(void **state) {
  (void)state;
  tal_snapshot s = snapshot_lattice(4, 1, 1, false);
  snapshot_join(&s, 0, 1, 2, 1);
  snapshot_join(&s, 1, 2, 4, -1);
  snapshot_join(&s, 2, 3, 0, 0); // holds nothing, counts for nothing
  tal_part part = snapshot_all(&s);
  tal_forces f = tal_forces_measure(&part, 0.5);
  assert_near(f.friction.ratio, 0.375, 1e-15);
  assert_near(f.friction.mean, 0.75, 1e-15);
  assert_near(f.friction.at_limit, 0.5, 0);
  f = tal_forces_measure(&part, 0);
  assert_near(f.friction.mean + f.friction.at_limit, 0, 0);
  snapshot_end(&s, &part);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_rates_of_drawn_samples),
      cmocka_unit_test(test_both_laws_of_one_sample),
      cmocka_unit_test(test_known_forces),
      cmocka_unit_test(test_degenerate),
      cmocka_unit_test(test_histogram),
      cmocka_unit_test(test_friction_use),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
