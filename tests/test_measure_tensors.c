// Fabric, anisotropies and the stress-force-fabric relation against closed forms and drawn distributions; regions.
#include <stdarg.h>
#include <stddef.h>

#include <setjmp.h>

#include <stdint.h>

#include <cmocka.h>

#include "measure_tensors.h"
#include "snapshots.h"
#include <gsl/gsl_rng.h>

static const double degree = TAL_PI / 180;

static void assert_near(double value, double wanted, double tolerance) {
  if (!(fabs(value - wanted) <= tolerance))
    fail_msg("%.17g is not %.17g within %g", value, wanted, tolerance);
}

// Pairs of grains far from each other, one per direction: contact k has the direction theta[k].
static tal_snapshot pairs_of(size_t count, const double *theta) {
  double(*grain)[3] = tal_alloc(2 * count, sizeof *grain);
  for (size_t k = 0; k < count; k++) {
    const double x = 10 * (double)k;
    memcpy(grain[2 * k], (double[3]){x + 0.9 * cos(theta[k]), 0.9 * sin(theta[k]), 1}, sizeof *grain);
    memcpy(grain[2 * k + 1], (double[3]){x - 0.9 * cos(theta[k]), -0.9 * sin(theta[k]), 1}, sizeof *grain);
  }
  tal_snapshot s = snapshot_of(2 * count, (const double(*)[3])grain);
  free(grain);
  return s;
}

// ROUND: a triangular lattice with equal forces is isotropic, and its stress is that of its unit cell: three contacts
// per 2 sqrt(3) r^2 give p = sqrt(3) f / (2 r h). An inner region, so that the rim does not count.
static void test_triangular_lattice(void **state) {
  (void)state;
  const double eps = 80 * 1e-15, /* coordinates reach 80 radii */ r = 1e-3, force = 0.7, h = 2e-3;
  tal_snapshot s = snapshot_lattice(40, 40, r, true);
  snapshot_join_all(&s, 0, force);
  tal_part part = snapshot_all(&s);
  const tal_fabric all = tal_fabric_measure(&part, TAL_NETWORK_ALL, h);
  // 39 x 39 rhombi; the sides of the block carry 39 more contacts along each of its two axes.
  assert_int_equal(all.contacts, 39 * 40 * 2 + 39 * 39);
  tal_part_clear(&part);
  // A band that whole unit cells fill: contact points every r/2 in y, rows sqrt(3) r apart.
  const tal_region inner = {TAL_REGION_BOX, 34.6 * r, 74.6 * r, 10.2 * sqrt(3) * r, 30.2 * sqrt(3) * r};
  tal_part_select(&part, &s, &inner);
  const tal_fabric f = tal_fabric_measure(&part, TAL_NETWORK_ALL, h);
  assert_near(f.contact.xx, 0.5, eps);
  assert_near(f.contact.yy, 0.5, eps);
  assert_near(f.contact.xy, 0, eps);
  assert_near(f.a_c.size, 0, eps);
  assert_near(f.a_n.size, 0, eps);
  assert_near(f.a_l.size, 0, eps);
  assert_near(f.a_t.size, 0, eps);
  assert_near(f.relation_full_error, 0, eps);
  // 20 x 20 cells of 2 r by sqrt(3) r, and the triangles by centroid: the same area.
  assert_near(part.area, 400 * 2 * sqrt(3) * r * r, 1e-12 * part.area);
  assert_int_equal(f.contacts, 1200);
  const double p = sqrt(3) * force / (2 * r * h);
  assert_near(f.stress.xx, p, 2e-6 * p);
  assert_near(f.stress.yy, p, 2e-6 * p);
  snapshot_end(&s, &part);
}

// ROUND: equally spaced directions whose forces follow the harmonics exactly: every anisotropy comes back, the full
// relation is the measured stress, the short one its first-order part.
static void test_harmonics_come_back(void **state) {
  (void)state;
  enum { N = 90 };
  double theta[N];
  for (int k = 0; k < N; k++)
    theta[k] = TAL_PI * k / N;
  tal_snapshot s = pairs_of(N, theta);
  for (int k = 0; k < N; k++)
    snapshot_join(&s, 2 * k, 2 * k + 1, 3 * (1 + 0.4 * cos(2 * (theta[k] - 70 * degree))),
                  -3 * 0.15 * sin(2 * (theta[k] - 110 * degree)));
  tal_part part = snapshot_all(&s);
  const tal_fabric f = tal_fabric_measure(&part, TAL_NETWORK_ALL, 1);
  assert_near(f.a_c.size, 0, 1e-14);
  assert_near(f.a_n.size, 0.4, 1e-13);
  assert_near(f.a_n.angle, 70 * degree, 1e-13);
  assert_near(f.a_t.size, 0.15, 1e-13);
  assert_near(f.a_t.angle, 110 * degree, 1e-13);
  assert_near(f.relation_full_error, 0, 1e-13);
  assert_near(f.relation_full_ratio, f.stress_ratio, 1e-13);
  assert_near(f.relation_ratio, f.stress_ratio, 1e-13); // a_c = 0: no products
  assert_near(f.mean_fn, 3, 1e-13);
  assert_near(f.mean_branch, 1.8, 1e-13);
  snapshot_end(&s, &part);
}

// MODEL: directions drawn from 1 + a cos 2(theta - theta_0), sd of the estimate sqrt(2/n) per component; the forces
// follow a harmonic of their own and come back to round-off, however uneven the directions.
static void test_drawn_directions(void **state) {
  (void)state;
  enum { N = 4000 };
  const double a = 0.5, at = 25 * degree, sd = sqrt(2.0 / N);
  static double theta[N];
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  for (size_t k = 0; k < N;) {
    const double angle = TAL_PI * gsl_rng_uniform(random);
    if (gsl_rng_uniform(random) * (1 + a) < 1 + a * cos(2 * (angle - at)))
      theta[k++] = angle;
  }
  gsl_rng_free(random);
  tal_snapshot s = pairs_of(N, theta);
  for (int k = 0; k < N; k++)
    snapshot_join(&s, 2 * k, 2 * k + 1, 2 + 0.6 * cos(2 * (theta[k] - 100 * degree)),
                  -0.2 * sin(2 * (theta[k] - 100 * degree)));
  tal_part part = snapshot_all(&s);
  const tal_fabric f = tal_fabric_measure(&part, TAL_NETWORK_ALL, 1);
  assert_near(f.a_c.size * cos(2 * f.a_c.angle), a * cos(2 * at), 3 * sd);
  assert_near(f.a_c.size * sin(2 * f.a_c.angle), a * sin(2 * at), 3 * sd);
  assert_near(f.a_n.size, 0.3, 1e-12);
  assert_near(f.a_n.angle, 100 * degree, 1e-12);
  assert_near(f.a_t.size, 0.1, 1e-12);
  assert_near(f.relation_full_error, 0, 3 * sd);
  snapshot_end(&s, &part);
}

// EXACT / ROUND: strong and weak contacts make up the whole, and so do their stresses.
static void test_networks_add_up(void **state) {
  (void)state;
  tal_snapshot s = snapshot_lattice(8, 9, 1e-3, false);
  snapshot_join_all(&s, 0, 1);
  for (size_t c = 0; c < s.contacts.count; c++) {
    s.contacts.fn[c] = 1 + (double)(c % 7);
    s.contacts.ft[c] = 0.1 * (double)(c % 5) - 0.2;
  }
  tal_part part = snapshot_all(&s);
  const tal_fabric all = tal_fabric_measure(&part, TAL_NETWORK_ALL, 1e-3),
                   strong = tal_fabric_measure(&part, TAL_NETWORK_STRONG, 1e-3),
                   weak = tal_fabric_measure(&part, TAL_NETWORK_WEAK, 1e-3);
  assert_int_equal(strong.contacts + weak.contacts, all.contacts);
  assert_near(strong.stress.xx + weak.stress.xx, all.stress.xx, 1e-13 * all.stress.xx);
  assert_near(strong.stress.yx + weak.stress.yx, all.stress.yx, 1e-13 * all.stress.xx);
  assert_true(strong.mean_fn > all.mean_fn && weak.mean_fn <= all.mean_fn);
  snapshot_end(&s, &part);
}

// EXACT: parallel contacts do not say how force depends on direction; none say nothing. All numbers stay finite.
static void test_little_to_measure(void **state) {
  (void)state;
  const double grain[2][3] = {{0, 0, 1}, {1.9, 0, 1}};
  for (size_t grains = 0; grains <= 2; grains++) {
    tal_snapshot s = snapshot_of(grains, grain);
    if (grains == 2)
      snapshot_join(&s, 0, 1, 5, 1);
    tal_part part = snapshot_all(&s);
    const tal_fabric f = tal_fabric_measure(&part, TAL_NETWORK_ALL, 1);
    assert_int_equal(f.contacts, grains == 2);
    assert_near(f.a_n.size + f.a_t.size + f.a_l.size, 0, 0);
    assert_near(f.a_c.size, grains == 2 ? 2 : 0, 1e-15);
    assert_near(f.stress.xx, 0, 0); // no cells, no area
    assert_true(isfinite(f.stress_ratio) && isfinite(f.relation_ratio) && isfinite(f.relation_full_error));
    assert_int_equal(tal_fabric_measure(&part, TAL_NETWORK_STRONG, 1).contacts, 0);
    snapshot_end(&s, &part);
  }
}

// ROUND: eigenvalues and direction of a known tensor.
static void test_principal(void **state) {
  (void)state;
  for (int k = 0; k < 18; k++) {
    const double angle = k * 10 * degree, c = cos(angle), s = sin(angle);
    const tal_principal p =
        tal_principal_of((geo_tensor){5 * c * c + 2 * s * s, 3 * c * s + 1, 3 * c * s - 1, 5 * s * s + 2 * c * c});
    assert_near(p.major, 5, 1e-14);
    assert_near(p.minor, 2, 1e-14);
    assert_near(remainder(p.angle - angle, TAL_PI), 0, 1e-14);
    assert_true(p.angle >= 0 && p.angle < TAL_PI);
  }
}

// EXACT: regions as text, and what is none.
static void test_regions(void **state) {
  (void)state;
  tal_region region;
  tal_error err;
  assert_int_equal(tal_region_parse(&region, "0:1e-2,:2e-2", &err), TAL_OK);
  assert_true(tal_region_has(&region, 0, -5) && tal_region_has(&region, 9.9e-3, 1e-2));
  assert_false(tal_region_has(&region, 1e-2, 0) || tal_region_has(&region, 5e-3, 2e-2));
  assert_int_equal(tal_region_parse(&region, "disc:1,2,0.5", &err), TAL_OK);
  assert_true(tal_region_has(&region, 1.3, 2.3));
  assert_false(tal_region_has(&region, 1.4, 2.4));
  const char *const none[] = {"",        "1",        "0:1",         "1:0,0:1",  "0:1,0:1x",
                              "a:b,c:d", "disc:1,2", "disc:1,2,-1", "disc:,,1", "nan:1,0:1"};
  for (size_t k = 0; k < sizeof none / sizeof *none; k++)
    assert_int_equal(tal_region_parse(&region, none[k], &err), TAL_BAD_INPUT);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_triangular_lattice),
      cmocka_unit_test(test_harmonics_come_back),
      cmocka_unit_test(test_drawn_directions),
      cmocka_unit_test(test_networks_add_up),
      cmocka_unit_test(test_little_to_measure),
      cmocka_unit_test(test_principal),
      cmocka_unit_test(test_regions),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
