// The directional tensor against closed forms on lattices and its symmetries; decay and sector statistics against the
// values they were drawn from.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base.h"
#include "directional.h"
#include "transmission.h"

#include <float.h>
#include <gsl/gsl_randist.h>
#include <gsl/gsl_rng.h>
#include <math.h>
#include <stdlib.h>

enum { MOST = 4000 };

// A network put together segment by segment, each with two ends of its own.
typedef struct sketch {
  double x[2 * MOST], y[2 * MOST], f[MOST];
  int64_t i[MOST], j[MOST];
  tal_network network;
} sketch;

static sketch *sketch_begin(double diameter) {
  sketch *s = tal_alloc(1, sizeof *s);
  s->network = (tal_network){s->x, s->y, s->i, s->j, s->f, 0, 1, diameter};
  return s;
}

static void segment(sketch *s, double x0, double y0, double x1, double y1, double f) {
  const size_t c = s->network.contacts++;
  assert_true(c < MOST);
  s->x[2 * c] = x0;
  s->y[2 * c] = y0;
  s->x[2 * c + 1] = x1;
  s->y[2 * c + 1] = y1;
  s->i[c] = (int64_t)(2 * c);
  s->j[c] = (int64_t)(2 * c + 1);
  s->f[c] = f;
}

// A segment of length 1 about the point at polar (r, angle), at `tilt` to the radius.
static void about(sketch *s, double r, double angle, double tilt, double f) {
  double x = r * cos(angle), y = r * sin(angle), bx = 0.5 * cos(angle + tilt), by = 0.5 * sin(angle + tilt);
  segment(s, x - bx, y - by, x + bx, y + by, f);
}

static geo_tensor turned(geo_tensor t, double angle) {
  const double c = cos(angle), s = sin(angle);
  return (geo_tensor){
      c * c * t.xx - c * s * (t.xy + t.yx) + s * s * t.yy, c * c * t.xy + c * s * (t.xx - t.yy) - s * s * t.yx,
      c * c * t.yx + c * s * (t.xx - t.yy) - s * s * t.xy, s * s * t.xx + c * s * (t.xy + t.yx) + c * c * t.yy};
}

static void assert_tensor(geo_tensor a, geo_tensor b, double eps) {
  if (fmax(fmax(fabs(a.xx - b.xx), fabs(a.xy - b.xy)), fmax(fabs(a.yx - b.yx), fabs(a.yy - b.yy))) > eps)
    fail_msg("[%.17g %.17g; %.17g %.17g] is not [%.17g %.17g; %.17g %.17g]", a.xx, a.xy, a.yx, a.yy, b.xx, b.xy, b.yx,
             b.yy);
}

static const geo_vec origin = {0, 0};

// ROUND: segments along the rays of a cross make T diagonal in the cross's frame, with the sums of f / |s| on its arms;
// the eigenvectors of Sym(T) are those arms. The sense in which a segment is stored does not matter.
static void all_radial(void **state) {
  (void)state;
  const double angle = 0.7;
  sketch *s = sketch_begin(1);
  double along = 0, across = 0;
  for (int k = 1; k <= 8; k++) {
    about(s, k, angle, k % 2 ? TAL_PI : 0, 2.0 + k);
    about(s, k + 0.5, angle + TAL_PI, 0, 3.0);
    about(s, k, angle + TAL_PI / 2, 0, 1.0);
    along += (2.0 + k) / k + 3 / (k + 0.5);
    across += 1.0 / k;
  }
  size_t segments;
  geo_tensor t = tal_directional_tensor(&s->network, origin, 10, &segments);
  assert_int_equal(segments, 24);
  assert_tensor(turned(t, -angle), (geo_tensor){along, 0, 0, across}, 1e-13 * along);
  double value[2];
  geo_vec axis[2];
  tal_directional_axes(t, value, axis);
  assert_true(fabs(value[0] - along) < 1e-13 * along && fabs(value[1] - across) < 1e-13 * along);
  assert_true(fabs(axis[0].x - cos(angle)) < 1e-13 && fabs(axis[0].y - sin(angle)) < 1e-13);
  assert_true(fabs(axis[1].x - sin(angle)) < 1e-13 && fabs(axis[1].y + cos(angle)) < 1e-13);
  // out of reach: the outer ones, whose weight is known
  t = tal_directional_tensor(&s->network, origin, 7.75, &segments);
  assert_int_equal(segments, 21);
  free(s);
}

// ROUND: tangential segments are ties: b points counter-clockwise, whichever way round they are stored. A ring of them
// makes T antisymmetric, purely off-diagonal: N f / (2 r) there; their W is nil, all they carry lies across.
static void all_tangential(void **state) {
  (void)state;
  sketch *s = sketch_begin(1);
  for (int k = 0; k < 12; k++)
    about(s, 4, 2 * TAL_PI * k / 12 + 0.1, k % 3 ? TAL_PI / 2 : -TAL_PI / 2, 5);
  geo_tensor t = tal_directional_tensor(&s->network, origin, 10, NULL);
  const double off = 12 * 5 / 4.0 / 2;
  assert_tensor(t, (geo_tensor){0, off, -off, 0}, 1e-13 * off);
  double along[4], across[4];
  tal_directional_rose(&s->network, origin, 10, 4, along, across);
  for (int k = 0; k < 4; k++) {
    assert_true(fabs(along[k]) < 1e-13);
    assert_true(fabs(across[k] - 3 * 5 / 4.0) < 1e-12);
  }
  free(s);
}

// ROUND: the square lattice in closed form: within 0.6 diameters the four contacts of the grain, each f / (1/2); within
// 1.2 also the eight around, middles at (1/2, 1): 4 . (1/2) / (5/4) on either diagonal place. The triangular one: six
// contacts, 2 sum n (x) n = 6 I. Lattice constant and diameter 3.
static void lattices(void **state) {
  (void)state;
  sketch *s = sketch_begin(3);
  for (int x = -4; x <= 4; x++)
    for (int y = -4; y <= 4; y++) {
      segment(s, 3 * x, 3 * y, 3 * (x + 1), 3 * y, 1);
      segment(s, 3 * x, 3 * y, 3 * x, 3 * (y + 1), 1);
    }
  assert_tensor(tal_directional_tensor(&s->network, origin, 0.6, NULL), (geo_tensor){4, 0, 0, 4}, 1e-14);
  assert_tensor(tal_directional_tensor(&s->network, origin, 1.2, NULL), (geo_tensor){5.6, 0, 0, 5.6}, 1e-13);
  for (size_t c = 1; c < s->network.contacts; c += 2) // no load in y
    s->f[c] = 0;
  assert_tensor(tal_directional_tensor(&s->network, origin, 1.2, NULL), (geo_tensor){5.6, 0, 0, 0}, 1e-13);
  s->network.contacts = 0;
  for (int k = 0; k < 6; k++)
    segment(s, 3 * cos(k * TAL_PI / 3), 3 * sin(k * TAL_PI / 3), 0, 0, 1);
  assert_tensor(tal_directional_tensor(&s->network, origin, 0.6, NULL), (geo_tensor){6, 0, 0, 6}, 1e-14);
  free(s);
}

static void scatter(sketch *s, uint64_t seed, double angle) {
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  gsl_rng_set(random, seed);
  s->network.contacts = 0;
  for (int k = 0; k < 300; k++) {
    double r = 0.3 + 12 * gsl_rng_uniform(random), at = 7 * gsl_rng_uniform(random), f = gsl_ran_exponential(random, 1);
    double tilt = k % 10 ? 7 * gsl_rng_uniform(random) : TAL_PI / 2; // ties among them
    about(s, r, at + angle, tilt, f);
  }
  gsl_rng_free(random);
}

// ROUND: a sample turned by any angle turns its tensor, ties included, and with it the rose by whole sectors; the trace
// is the sum of the rose; scaled forces and their mean, lengths and diameter change nothing.
static void rotation_and_scale(void **state) {
  (void)state;
  sketch *s = sketch_begin(1.3);
  double rose[12], other[12];
  scatter(s, 5, 0);
  geo_tensor t = tal_directional_tensor(&s->network, origin, 8, NULL);
  tal_directional_rose(&s->network, origin, 8, 12, rose, NULL);
  double sum = 0;
  for (int k = 0; k < 12; k++)
    sum += rose[k];
  assert_true(fabs(sum - t.xx - t.yy) < 1e-12 * sum);
  for (int k = 1; k < 12; k++) {
    scatter(s, 5, k * TAL_PI / 6);
    assert_tensor(tal_directional_tensor(&s->network, origin, 8, NULL), turned(t, k * TAL_PI / 6), 1e-11);
    tal_directional_rose(&s->network, origin, 8, 12, other, NULL);
    for (int j = 0; j < 12; j++)
      assert_true(fabs(other[(j + k) % 12] - rose[j]) < 1e-11);
  }
  scatter(s, 5, 0);
  for (size_t c = 0; c < s->network.contacts; c++) {
    s->f[c] *= 8;
    for (size_t e = 2 * c; e < 2 * c + 2; e++) {
      s->x[e] *= 4;
      s->y[e] *= 4;
    }
  }
  s->network.mean_force *= 8;
  s->network.diameter *= 4;
  assert_tensor(tal_directional_tensor(&s->network, origin, 8, NULL), t, 0);
  free(s);
}

// EXACT: no segments, no force, a middle at the grain itself: zero, not NAN.
static void nothing_there(void **state) {
  (void)state;
  sketch *s = sketch_begin(1);
  assert_tensor(tal_directional_tensor(&s->network, origin, 10, NULL), (geo_tensor){0, 0, 0, 0}, 0);
  segment(s, -1, 0, 1, 0, 3);
  assert_tensor(tal_directional_tensor(&s->network, origin, 10, NULL), (geo_tensor){0, 0, 0, 0}, 0);
  segment(s, 1, 0, 2, 0, 0);
  s->network.mean_force = 0;
  assert_tensor(tal_directional_tensor(&s->network, origin, 10, NULL), (geo_tensor){0, 0, 0, 0}, 0);
  assert_int_equal(tal_directional_sector(1, -1e-300, 12), 0);
  assert_int_equal(tal_directional_sector(1, -1e-3, 12), 11);
  free(s);
}

// ROUND: data on a curve gives the curve and no error. EXACT: what does not decay has no fit.
static void decay_of_a_curve(void **state) {
  (void)state;
  double r[40], u[40];
  for (int k = 0; k < 40; k++) {
    r[k] = 0.8 + 0.2 * k;
    u[k] = 0.7 * exp(-r[k] / 2.4);
  }
  tal_decay fit;
  assert_true(tal_decay_fit(r, u, 40, &fit));
  assert_true(fabs(fit.length - 2.4) < 1e-9 && fabs(fit.amplitude - 0.7) < 1e-9 && fit.length_error < 1e-8);
  assert_true(tal_influence_radius(r, u, 40) == r[27]); // 0.7 exp(-6.2/2.4) = 0.0529, the next is 0.0486
  assert_false(tal_decay_fit(r, u, 4, &fit));
  assert_true(isnan(fit.length) && fit.points == 0);
  for (int k = 0; k < 40; k++)
    u[k] = 1 + 0.1 * r[k];
  assert_false(tal_decay_fit(r, u, 40, &fit));
  for (int k = 0; k < 40; k++)
    u[k] = 0;
  assert_false(tal_decay_fit(r, u, 40, &fit));
  assert_true(tal_influence_radius(r, u, 40) == 0);
}

// MODEL: ratios drawn about A exp(-r/l) with a scatter as large as the mean, as rotations have: the fitted lengths'
// mean is l within 3 s.e. (and the 1 % bias of a curved model), and their errors are right: 2 of them hold l in 95 % of
// the draws, 3 s.e. of 1000 draws being 2 %.
static void decay_of_draws(void **state) {
  (void)state;
  enum { DRAWS = 1000, POINTS = 300 };
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  double r[POINTS], u[POINTS], sum = 0, squares = 0;
  int held = 0;
  for (int d = 0; d < DRAWS; d++) {
    for (int k = 0; k < POINTS; k++) {
      r[k] = 10 * sqrt(gsl_rng_uniform(random));
      u[k] = 0.9 * exp(-r[k] / 2.1) * gsl_ran_exponential(random, 1);
    }
    tal_decay fit;
    assert_true(tal_decay_fit(r, u, POINTS, &fit));
    sum += fit.length;
    squares += fit.length * fit.length;
    held += fabs(fit.length - 2.1) < 1.96 * fit.length_error;
  }
  const double mean = sum / DRAWS, error = sqrt((squares / DRAWS - mean * mean) / DRAWS);
  assert_true(fabs(mean - 2.1) < 3 * error + 0.021);
  if (!(held > 0.90 * DRAWS && held < 0.98 * DRAWS))
    fail_msg("%d of %d intervals hold the length", held, DRAWS);
  gsl_rng_free(random);
}

// Sectors of `grains` grains in 5 samples: transmission a (across - 1) + w (along - 1) and scatter, part of it shared
// by a grain; along and across correlate.
static void draw_sectors(gsl_rng *random, tal_sector *sector, size_t grains, double a, double w) {
  for (size_t g = 0; g < grains; g++) {
    const double shared = gsl_ran_gaussian(random, 0.1);
    for (size_t k = 0; k < 12; k++) {
      const double common = gsl_ran_gaussian(random, 0.3), across = 1 + common + gsl_ran_gaussian(random, 0.3);
      const double along = 1 + common + gsl_ran_gaussian(random, 0.3);
      sector[12 * g + k] =
          (tal_sector){g / (grains / 5), g,
                       1 + a * (across - 1) + w * (along - 1) + shared + gsl_ran_gaussian(random, 0.4), along, across};
    }
  }
}

// MODEL: the statistics find what was put in: with an effect of `across` alone its slope is negative and that of
// `along` nil, though both correlate; nine in ten of the 90 % intervals hold the drawn slopes (100 draws: 3 s.e. 9 %).
static void sectors_of_draws(void **state) {
  (void)state;
  enum { GRAINS = 100, DRAWS = 60 };
  tal_sector *sector = tal_alloc(12 * GRAINS, sizeof *sector);
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  tal_sector_statistics s;
  int held = 0, nil = 0;
  // variances: across, along 0.18 each, covariance 0.09; of the transmission with a = -0.5: 0.045 + 0.01 + 0.16
  const double slope = -0.5 * sqrt(0.18 / 0.215);
  for (int d = 0; d < DRAWS; d++) {
    draw_sectors(random, sector, GRAINS, -0.5, 0);
    tal_sector_statistics_of(sector, 12 * GRAINS, 0.9, (uint64_t)d, &s);
    assert_int_equal(s.grains, GRAINS);
    assert_int_equal(s.samples, 5);
    assert_true(s.across_slope.high < 0 && s.along.value < 0);
    assert_true(s.open.value > 1 && s.blocked.value < 1);
    held += s.across_slope.low < slope && slope < s.across_slope.high;
    nil += s.along_slope.low < 0 && 0 < s.along_slope.high;
  }
  // five samples drawn with return: such intervals are a little narrow
  assert_true(held > 0.75 * DRAWS && nil > 0.75 * DRAWS);
  gsl_rng_free(random);
  free(sector);
}

// ROUND: transmission of sectors against its definition; EXACT: an empty sector has none.
static void transmission_of_sectors(void **state) {
  (void)state;
  const tal_decay decay = {.amplitude = 0.8, .length = 2, .points = 9};
  const double r[] = {1, 2, 1}, u[] = {0.3, 0.1, 0.5};
  const size_t sector[] = {0, 0, 2};
  double t[3];
  size_t used[3];
  tal_sector_transmission(&decay, r, u, sector, 3, 3, t, used);
  assert_true(fabs(t[0] - 0.4 / (0.8 * (exp(-0.5) + exp(-1)))) < 1e-15);
  assert_true(isnan(t[1]));
  assert_true(fabs(t[2] - 0.5 / (0.8 * exp(-0.5))) < 1e-15);
  assert_true(used[0] == 2 && used[1] == 0 && used[2] == 1);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(all_radial),
      cmocka_unit_test(all_tangential),
      cmocka_unit_test(lattices),
      cmocka_unit_test(rotation_and_scale),
      cmocka_unit_test(nothing_there),
      cmocka_unit_test(decay_of_a_curve),
      cmocka_unit_test(decay_of_draws),
      cmocka_unit_test(sectors_of_draws),
      cmocka_unit_test(transmission_of_sectors),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
