// Bucket grid: the same pairs as brute force, whatever the sizes and the extent.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "cells.h"

typedef struct discs {
  size_t n;
  double *x, *y, *r;
} discs;

static uint64_t random_bits(uint64_t *state) {
  uint64_t z = *state += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}

static double random_unit(uint64_t *state) {
  return (double)(random_bits(state) >> 11) * 0x1p-53;
}

static discs make_discs(size_t n) {
  return (discs){n, malloc((n + 1) * sizeof(double)), malloc((n + 1) * sizeof(double)),
                 malloc((n + 1) * sizeof(double))};
}

static void free_discs(discs *d) {
  free(d->x);
  free(d->y);
  free(d->r);
}

// Uniform in a box, log-uniform radii between r0 and r0 * ratio.
static discs random_discs(size_t n, double width, double height, double r0, double ratio, uint64_t *seed) {
  discs d = make_discs(n);
  for (size_t i = 0; i < n; i++) {
    d.x[i] = width * (random_unit(seed) - 0.3);
    d.y[i] = height * (random_unit(seed) - 0.3);
    d.r[i] = r0 * pow(ratio, random_unit(seed));
  }
  return d;
}

static bool is_pair(const discs *d, size_t i, size_t j, double margin) {
  double dx = d->x[i] - d->x[j], dy = d->y[i] - d->y[j], near = d->r[i] + d->r[j] + margin;
  return near > 0 && dx * dx + dy * dy < near * near;
}

// EXACT: the list is brute force's, in its order. Returns its length.
static size_t check_by_brute_force(const discs *d, double margin, geo_pairs *pairs) {
  size_t count = 0;
  assert_int_equal(geo_cells_pairs(d->x, d->y, d->r, d->n, margin, pairs), 0);
  for (size_t i = 0; i < d->n; i++)
    for (size_t j = i + 1; j < d->n; j++) {
      if (!is_pair(d, i, j, margin))
        continue;
      assert_true(count < pairs->count);
      assert_int_equal(pairs->pair[count][0], i);
      assert_int_equal(pairs->pair[count][1], j);
      count++;
    }
  assert_int_equal(count, pairs->count);
  return count;
}

static int by_x(const void *a, const void *b, void *x) {
  const double *p = x;
  double left = p[*(const int32_t *)a], right = p[*(const int32_t *)b];
  return (left > right) - (left < right);
}

// EXACT, for many discs: a sweep along x finds as many pairs, and each pair of the list is one and follows its
// predecessor.
static size_t check_by_sweep(const discs *d, double margin, geo_pairs *pairs) {
  assert_int_equal(geo_cells_pairs(d->x, d->y, d->r, d->n, margin, pairs), 0);
  int32_t *order = malloc(d->n * sizeof *order);
  double widest = 0;
  for (size_t i = 0; i < d->n; i++) {
    order[i] = (int32_t)i;
    widest = fmax(widest, d->r[i]);
  }
  qsort_r(order, d->n, sizeof *order, by_x, d->x);
  size_t count = 0;
  for (size_t a = 0; a < d->n; a++) {
    size_t i = (size_t)order[a];
    for (size_t b = a + 1; b < d->n && d->x[order[b]] - d->x[i] < (d->r[i] + widest + margin) * 1.000001; b++)
      count += is_pair(d, i, (size_t)order[b], margin);
  }
  free(order);
  assert_int_equal(count, pairs->count);
  for (size_t c = 0; c < pairs->count; c++) {
    const int32_t *p = pairs->pair[c], *q = c ? pairs->pair[c - 1] : p;
    assert_true(p[0] < p[1] && is_pair(d, (size_t)p[0], (size_t)p[1], margin));
    assert_true(c == 0 || q[0] < p[0] || (q[0] == p[0] && q[1] < p[1]));
  }
  return count;
}

// EXACT against brute force: sizes alike, margins from overlaps only to wide.
static void like_sizes(void **state) {
  (void)state;
  geo_pairs pairs;
  geo_pairs_init(&pairs);
  uint64_t seed = 1;
  const double margin[] = {-1.9, -1, -0.1, 0, 0.1, 2, 50};
  for (int trial = 0; trial < 40; trial++) {
    discs d = random_discs(5 + 15 * (size_t)trial, 40, 40, 0.5, 2, &seed);
    for (size_t m = 0; m < sizeof margin / sizeof *margin; m++)
      check_by_brute_force(&d, margin[m], &pairs);
    free_discs(&d);
  }
  geo_pairs_clear(&pairs);
}

// EXACT against brute force: size ratios up to a million, points without radius among them.
static void unlike_sizes(void **state) {
  (void)state;
  geo_pairs pairs;
  geo_pairs_init(&pairs);
  uint64_t seed = 2;
  const double ratio[] = {2, 10, 100, 1e4, 1e6};
  size_t found = 0;
  for (size_t k = 0; k < sizeof ratio / sizeof *ratio; k++)
    for (int trial = 0; trial < 8; trial++) {
      discs d = random_discs(500, 1, 1, 0.1 / ratio[k], ratio[k], &seed);
      for (size_t i = 0; i < d.n; i += 7)
        d.r[i] = 0;
      found += check_by_brute_force(&d, 0, &pairs);
      check_by_brute_force(&d, 1e-3, &pairs);
      check_by_brute_force(&d, -1e-3, &pairs);
      free_discs(&d);
    }
  assert_true(found > 10000);
  geo_pairs_clear(&pairs);
}

// EXACT against brute force: lines of any slope, clusters and single discs out to 1e300, where a plain grid would need
// more memory than there is.
static void far_flung(void **state) {
  (void)state;
  geo_pairs pairs;
  geo_pairs_init(&pairs);
  uint64_t seed = 3;
  const double far[] = {1e3, 1e9, 1e15, 1e18, 1e25, 1e300};
  for (size_t k = 0; k < sizeof far / sizeof *far; k++) {
    discs d = random_discs(400, 20, 20, 0.2, 8, &seed);
    for (size_t i = 0; i < d.n; i += 40)
      d.x[i] = far[k] * (random_unit(&seed) - 0.5);
    for (size_t i = 1; i < d.n; i += 50)
      d.y[i] = far[k];
    for (size_t i = 2; i + 1 < d.n; i += 60) {
      d.x[i] = d.y[i] = -far[k];
      d.x[i + 1] = nextafter(-far[k], 0);
      d.y[i + 1] = -far[k];
    }
    assert_true(check_by_brute_force(&d, 0.1, &pairs) > 0);
    free_discs(&d);
    discs line = random_discs(600, 1, 1, 0.5, 2, &seed);
    for (size_t i = 0; i < line.n; i++) {
      line.x[i] = (double)i * (k % 2 ? 1 : -1);
      line.y[i] = (double)i * (k < 3 ? 1 : 0) + (k == 4 ? far[k] : 0);
    }
    assert_true(check_by_brute_force(&line, 0.2, &pairs) > 0);
    free_discs(&line);
  }
  geo_pairs_clear(&pairs);
}

// EXACT: touching at exactly the margin is no pair; a square lattice has as many pairs as sides and diagonals.
static void lattice(void **state) {
  (void)state;
  enum { SIDE = 40 };
  geo_pairs pairs;
  geo_pairs_init(&pairs);
  discs d = make_discs(SIDE * SIDE);
  for (size_t i = 0; i < d.n; i++) {
    d.x[i] = (double)(i % SIDE);
    d.y[i] = (double)(i / SIDE);
    d.r[i] = 0.25;
  }
  assert_int_equal(check_by_brute_force(&d, 0.5, &pairs), 0);
  assert_int_equal(check_by_brute_force(&d, 0.5 + 0x1p-40, &pairs), 2 * SIDE * (SIDE - 1));
  assert_int_equal(check_by_brute_force(&d, 1, &pairs), 2 * SIDE * (SIDE - 1) + 2 * (SIDE - 1) * (SIDE - 1));
  free_discs(&d);
  geo_pairs_clear(&pairs);
}

// EXACT: a hundred thousand discs against a sweep: alike, ratio 100, scattered over 1e9, and points beside one giant.
// None of these ends within the time of a test if the cost is quadratic.
static void many(void **state) {
  (void)state;
  enum { N = 100000 };
  geo_pairs pairs;
  geo_pairs_init(&pairs);
  uint64_t seed = 5;
  discs d = random_discs(N, 320, 320, 0.4, 1.3, &seed);
  assert_true(check_by_sweep(&d, 0.05, &pairs) > N);
  for (size_t i = 0; i < N; i++)
    d.r[i] = i % 1000 ? 0.1 : 10;
  assert_true(check_by_sweep(&d, 0.05, &pairs) > N / 10);
  for (size_t i = 0; i < N; i++)
    d.r[i] = 0.4;
  for (size_t i = 0; i < N; i += 10)
    d.x[i] *= 1e7;
  check_by_sweep(&d, 0.05, &pairs);
  for (size_t i = 0; i < N; i++) {
    d.x[i] = d.y[i] = (double)i;
    d.r[i] = i ? 0.75 : 1000;
  }
  check_by_sweep(&d, 0, &pairs);
  for (size_t i = 1; i < N; i++)
    d.r[i] = 0;
  assert_int_equal(geo_cells_pairs(d.x, d.y, d.r, N, 0, &pairs), 0);
  assert_int_equal(pairs.count, 707);
  free_discs(&d);
  geo_pairs_clear(&pairs);
}

// EXACT: none, one and two discs; what is not finite is refused and leaves no pairs.
static void edge_cases(void **state) {
  (void)state;
  geo_pairs pairs;
  geo_pairs_init(&pairs);
  double x[2] = {0, 0}, y[2] = {0, 0}, r[2] = {1, 1};
  for (size_t n = 0; n <= 2; n++) {
    assert_int_equal(geo_cells_pairs(x, y, r, n, 0, &pairs), 0);
    assert_int_equal(pairs.count, n == 2);
  }
  double *value[3] = {&x[1], &y[0], &r[1]};
  for (int k = 0; k < 3; k++) {
    double kept = *value[k];
    *value[k] = k == 1 ? (double)INFINITY : (double)NAN;
    assert_int_equal(geo_cells_pairs(x, y, r, 2, 0, &pairs), -1);
    assert_int_equal(pairs.count, 0);
    *value[k] = kept;
  }
  assert_int_equal(geo_cells_pairs(x, y, r, 2, (double)NAN, &pairs), -1);
  geo_pairs_clear(&pairs);
  assert_null(pairs.pair);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(like_sizes), cmocka_unit_test(unlike_sizes), cmocka_unit_test(far_flung),
      cmocka_unit_test(lattice),    cmocka_unit_test(many),         cmocka_unit_test(edge_cases),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
