// Coordination, cells and void polygons of lattices, with contacts taken away by hand, against their closed forms.
#include <stdarg.h>
#include <stddef.h>

#include <setjmp.h>

#include <stdint.h>

#include <cmocka.h>

#include "measure_voids.h"
#include "snapshots.h"

static void assert_near(double value, double wanted, double tolerance) {
  if (!(fabs(value - wanted) <= tolerance))
    fail_msg("%.17g is not %.17g within %g", value, wanted, tolerance);
}

static void remove_contact(tal_snapshot *s, int32_t i, int32_t j) {
  tal_snapshot_contacts *k = &s->contacts;
  for (size_t c = 0; c < k->count; c++) {
    if (k->i[c] != i || k->j[c] != j)
      continue;
    k->count--;
    k->i[c] = k->i[k->count];
    k->j[c] = k->j[k->count];
    return;
  }
  fail_msg("no contact %d %d", i, j);
}

// EXACT / ROUND: a square lattice of 6 by 5: 20 squares, each a void of four sides and two cells, solid fraction pi/4.
static void test_square_lattice(void **state) {
  (void)state;
  tal_snapshot s = snapshot_lattice(6, 5, 1e-3, false);
  snapshot_join_all(&s, 0, 1);
  tal_part part = snapshot_all(&s);
  tal_voids voids;
  tal_voids_find(&voids, &part);
  assert_int_equal(voids.count, 20);
  assert_int_equal(voids.closed, 20);
  assert_int_equal(voids.with[4], 20);
  assert_near(voids.mean_sides, 4, 0);
  assert_near(voids.mean_area, 4e-6, 1e-18);
  assert_near(voids.mean_aspect, 1, 1e-7);
  for (size_t k = 0; k < 20; k++) {
    const tal_void *v = &voids.item[k];
    assert_int_equal(v->cells, 2);
    assert_near(v->solid / v->area, TAL_PI / 4, 3e-6); // radii are a millionth larger
    assert_near(fmod(v->x, 2e-3), 1e-3, 1e-15);
  }
  tal_voids_clear(&voids);
  const tal_coordination z = tal_coordination_measure(&part);
  assert_near(z.mean, 2.0 * (5 * 5 + 6 * 4) / 30, 1e-14);
  assert_near(z.bearing, z.mean, 0);
  assert_int_equal(z.with[2], 4);
  assert_int_equal(z.with[3], 2 * 4 + 2 * 3);
  assert_int_equal(z.with[4], 4 * 3);
  snapshot_end(&s, &part);
}

// EXACT / ROUND: a triangular lattice: every cell is a void of three sides, coordination 6 inside, solid fraction
// pi / sqrt(12).
static void test_triangular_lattice(void **state) {
  (void)state;
  tal_snapshot s = snapshot_lattice(7, 6, 1, true);
  snapshot_join_all(&s, 0, 1);
  tal_part part = snapshot_all(&s);
  tal_voids voids;
  tal_voids_find(&voids, &part);
  assert_int_equal(voids.closed, 2 * 6 * 5);
  assert_int_equal(voids.with[3], voids.closed);
  assert_int_equal(tal_coordination_measure(&part).with[6], 5 * 4);
  for (size_t t = 0; t < s.cell_count; t++)
    assert_near(tal_cell_solid(&s, t) / s.cell_area[t], TAL_PI / sqrt(12), 3e-6);
  tal_voids_clear(&voids);
  snapshot_end(&s, &part);
}

// EXACT / ROUND: one contact opened joins two squares to a void of six sides and aspect 1/2; a grain that loses all its
// contacts, or all but one, is a rattler inside a void of eight sides; an open rim edge opens a void to the outside.
static void test_opened_contacts(void **state) {
  (void)state;
  tal_snapshot s = snapshot_lattice(8, 8, 1, false);
  snapshot_join_all(&s, 0, 1);
  remove_contact(&s, 1 * 8 + 1, 1 * 8 + 2); // a horizontal edge between the squares below and above it
  remove_contact(&s, 5 * 8 + 4, 5 * 8 + 5);
  remove_contact(&s, 5 * 8 + 5, 5 * 8 + 6);
  remove_contact(&s, 4 * 8 + 5, 5 * 8 + 5); // grain (5, 5) keeps one
  remove_contact(&s, 3, 4);                 // on the rim
  tal_part part = snapshot_all(&s);
  tal_voids voids;
  tal_voids_find(&voids, &part);
  assert_int_equal(voids.count, 49 - 1 - 3);
  assert_int_equal(voids.closed, voids.count - 1);
  assert_int_equal(voids.with[6], 1);
  assert_int_equal(voids.with[8], 1);
  assert_int_equal(voids.with[4], voids.closed - 2);
  for (size_t k = 0; k < voids.count; k++) {
    const tal_void *v = &voids.item[k];
    if (v->sides == 6) {
      assert_near(v->area, 8, 1e-12);
      assert_near(v->aspect, 0.5, 1e-12);
      assert_near(v->angle, TAL_PI / 2, 1e-12);
      assert_near(v->x, 3, 1e-12);
      assert_near(v->y, 2, 1e-12);
    }
    if (v->sides == 8)
      assert_near(v->area, 16, 1e-12);
    if (v->open)
      assert_int_equal(v->sides, 3);
  }
  const tal_coordination z = tal_coordination_measure(&part);
  assert_int_equal(z.rattlers, 1);
  assert_near(z.mean, 2 * (112 - 5) / 64.0, 1e-14);
  assert_near(z.bearing, 2 * (112 - 6) / 63.0, 1e-14);
  tal_voids_clear(&voids);
  snapshot_end(&s, &part);
}

// EXACT: rattlers go one after the other, and a wall holds: a tail of three grains hangs on a square of four.
static void test_rattlers(void **state) {
  (void)state;
  const double grain[7][3] = {{0, 0, 1}, {2, 0, 1}, {0, 2, 1}, {2, 2, 1}, {4, 0, 1}, {6, 0, 1}, {8, 0, 1}};
  for (int wall = 0; wall < 2; wall++) {
    tal_snapshot s = snapshot_of(7, grain);
    snapshot_join_all(&s, 1e-9, 1);
    if (wall) {
      s.walls.i = tal_alloc(1, sizeof(int32_t));
      s.walls.i[0] = 6;
      s.walls.count = 1;
    }
    bool *rattler = tal_rattlers_find(&s);
    for (int k = 0; k < 7; k++)
      assert_int_equal(rattler[k], !wall && k >= 4);
    free(rattler);
    tal_snapshot_clear(&s);
  }
}

// EXACT: nothing to measure is zero, never NaN.
static void test_nothing(void **state) {
  (void)state;
  const double grain[1][3] = {{0, 0, 1}};
  for (size_t n = 0; n < 2; n++) {
    tal_snapshot s = snapshot_of(n, grain);
    tal_part part = snapshot_all(&s);
    tal_voids voids;
    tal_voids_find(&voids, &part);
    const tal_coordination z = tal_coordination_measure(&part);
    assert_int_equal(voids.count + voids.closed, 0);
    assert_near(voids.mean_sides + voids.mean_area + voids.mean_aspect + z.mean + z.bearing, 0, 0);
    assert_int_equal(z.rattlers, n);
    tal_voids_clear(&voids);
    snapshot_end(&s, &part);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_square_lattice),  cmocka_unit_test(test_triangular_lattice),
      cmocka_unit_test(test_opened_contacts), cmocka_unit_test(test_rattlers),
      cmocka_unit_test(test_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
