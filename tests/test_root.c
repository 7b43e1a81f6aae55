// x^(1/c) of the regularised friction law against powl, over the whole range of doubles it is meant for.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "root.h"

#include <float.h>
#include <math.h>

static const double exponents[] = {1, 1.5, 2, 2.718281828459045, 3, 5, 7.7, 10, 20, 50, 100, 1000, 1e6};
enum { EXPONENTS = sizeof exponents / sizeof *exponents };

// Relative error of one value, in parts of the tolerance that root.h states: (4 + 1.7 |ln x|/c) eps.
static double share(double x, double inverse) {
  long double exact = powl((long double)x, (long double)inverse);
  long double error = fabsl((long double)tal_root(x, inverse) - exact) / exact;
  return (double)(error / (4 + 1.7L * fabsl(logl((long double)x)) * (long double)inverse)) / DBL_EPSILON;
}

static void assert_within(double x, double c) {
  double part = share(x, 1 / c);
  if (!(part <= 1))
    fail_msg("x = %.17g, c = %g: error is %.3g of the stated tolerance", x, c, part);
}

// ROUND: 600 decades at random-looking mantissas; the largest results (above 2^1023.5 at c = 1) lie outside.
static void test_over_all_decades(void **state) {
  (void)state;
  for (int e = 0; e < EXPONENTS; e++) {
    double mantissa = 1;
    for (int decade = -299; decade <= 307; decade++) {
      for (int k = 0; k < 20; k++) {
        mantissa = 1 + fmod(mantissa * 7.236067977 + 0.618033988, 9);
        double x = mantissa * pow(10, decade);
        if (x < 1e307)
          assert_within(x, exponents[e]);
      }
    }
  }
}

// ROUND: the slips over vR that runs see, densely; x^(1/c) is then close to 1, where only the 4 eps are left.
static void test_over_usual_slips(void **state) {
  (void)state;
  for (int e = 0; e < EXPONENTS; e++)
    for (int k = 0; k < 20000; k++)
      assert_within(exp(-30 + 45.0 * k / 20000), exponents[e]);
}

// ROUND: the neighbours of the places where the reduction changes over: sqrt(1/2) 2^k for the logarithm, 2^((n + 1/2)
// c) for the exponential, and 1.
static void test_at_the_seams(void **state) {
  (void)state;
  for (int e = 0; e < EXPONENTS; e++) {
    for (int k = -900; k <= 900; k += 25) {
      double seams[] = {ldexp(sqrt(0.5), k), ldexp(1, k), pow(2, (k / 25 + 0.5) * exponents[e])};
      for (int s = 0; s < 3; s++) {
        double x = seams[s] < 1e-290 || seams[s] > 1e290 ? 1 : seams[s];
        for (int n = 0; n < 8; n++)
          x = nextafter(x, 0);
        for (int n = 0; n < 16; n++, x = nextafter(x, HUGE_VAL))
          assert_within(x, exponents[e]);
      }
    }
  }
}

// EXACT: no slip, no friction; the smallest slips count as none; a slip of vR gives 1.
static void test_special_values(void **state) {
  (void)state;
  for (int e = 0; e < EXPONENTS; e++) {
    double inverse = 1 / exponents[e];
    assert_true(tal_root(0, inverse) == 0);
    assert_true(tal_root(DBL_TRUE_MIN, inverse) == 0);
    assert_true(tal_root(DBL_MIN, inverse) == 0);
    assert_true(tal_root(nextafter(1e-300, 0), inverse) == 0);
    assert_true(tal_root(1e-300, inverse) > 0);
    assert_true(tal_root(1, inverse) == 1);
  }
}

// ROUND: rises wherever x^(1/c) rises by more than the tolerances of both values: in factors of 1.37 over all decades,
// in steps of 1e-6 about 1.
static void test_monotone(void **state) {
  (void)state;
  for (int e = 0; e < EXPONENTS; e++) {
    double inverse = 1 / exponents[e], before = 0;
    for (double x = 1e-299; x < 1e299; x *= 1.37) {
      double now = tal_root(x, inverse), bound = 2 * (4 + 1.7 * fabs(log(x)) * inverse) * DBL_EPSILON;
      if (1.37 > 1 + 2 * bound / inverse)
        assert_true(now > before);
      before = now;
    }
    before = 0;
    for (double x = 0.7; x < 1.5; x += 1e-6) {
      double now = tal_root(x, inverse);
      assert_true(now > before);
      before = now;
    }
  }
}

// EXACT: the same bits from a loop of vectors as from one value at a time.
static void test_vector_bits(void **state) {
  (void)state;
  enum { COUNT = 4099 };
  static double x[COUNT], together[COUNT];
  for (int e = 0; e < EXPONENTS; e++) {
    double inverse = 1 / exponents[e];
    for (int k = 0; k < COUNT; k++)
      x[k] = k % 7 ? exp(-600 + 1200.0 * k / COUNT) : 0;
#pragma omp simd
    for (int k = 0; k < COUNT; k++)
      together[k] = tal_root(x[k], inverse);
    for (int k = 0; k < COUNT; k++) {
      volatile double alone = x[k];
      assert_true(tal_bits(tal_root(alone, inverse)) == tal_bits(together[k]));
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_over_all_decades), cmocka_unit_test(test_over_usual_slips),
                                     cmocka_unit_test(test_at_the_seams),     cmocka_unit_test(test_special_values),
                                     cmocka_unit_test(test_monotone),         cmocka_unit_test(test_vector_bits)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
