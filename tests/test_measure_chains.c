// Force chains of made-up networks whose chains are known, their lives and buckling in made-up sequences, clusters.
#include <stdarg.h>
#include <stddef.h>

#include <setjmp.h>

#include <stdint.h>

#include <cmocka.h>

#include "measure_chain_lives.h"
#include "snapshots.h"

static const double degree = TAL_PI / 180;

static void assert_near(double value, double wanted, double tolerance) {
  if (!(fabs(value - wanted) <= tolerance))
    fail_msg("%.17g is not %.17g within %g", value, wanted, tolerance);
}

static void load(tal_snapshot *s, size_t k, double major, double angle) {
  const double c = cos(angle), d = sin(angle);
  s->stress_xx[k] = major * c * c;
  s->stress_xy[k] = s->stress_yx[k] = major * c * d;
  s->stress_yy[k] = major * d * d;
}

// A square lattice of unit grains under weak load, all touching; grain (column, row) has index row * 10 + column.
static tal_snapshot grid(void) {
  tal_snapshot s = snapshot_lattice(10, 10, 1, false);
  snapshot_join_all(&s, 0, 1);
  for (size_t k = 0; k < 100; k++)
    load(&s, k, 1, 0);
  return s;
}

static tal_chains find(const tal_snapshot *s, double angle) {
  tal_chains chains;
  tal_part part = snapshot_all(s);
  tal_chains_find(&chains, &part, angle);
  tal_part_clear(&part);
  return chains;
}

// EXACT / ROUND: two columns of loaded grains are the two chains, in order from the lower index; loaded pairs, and
// loaded grains whose load points across, are none.
static void test_columns_are_chains(void **state) {
  (void)state;
  tal_snapshot s = grid();
  for (size_t row = 2; row < 8; row++)
    load(&s, row * 10 + 3, 10, 90 * degree);
  for (size_t row = 0; row < 3; row++)
    load(&s, row * 10 + 6, 10, 80 * degree);
  load(&s, 50 + 8, 10, 90 * degree); // a pair
  load(&s, 60 + 8, 10, 90 * degree);
  for (size_t row = 0; row < 4; row++)
    load(&s, row * 10 + 9, 10, 30 * degree); // across: 60 degrees off the branch up, 30 off nothing that is loaded
  tal_chains chains = find(&s, 45 * degree);
  assert_int_equal(chains.count, 2);
  assert_int_equal(chains.bearing, 100);
  assert_int_equal(chains.strong, 6 + 3 + 2 + 4);
  assert_int_equal(chains.chain[1].count, 6);
  assert_int_equal(chains.chain[0].count, 3);
  for (int k = 0; k < 6; k++) {
    assert_int_equal(chains.grain[chains.chain[1].first + (size_t)k], (k + 2) * 10 + 3);
    assert_int_equal(chains.of[(k + 2) * 10 + 3], 1);
  }
  assert_int_equal(chains.of[58], -1);
  assert_near(chains.chain[1].length, 10, 1e-12);
  assert_near(chains.chain[1].span, 10, 1e-12);
  assert_near(chains.chain[1].angle, 90 * degree, 1e-12);
  assert_near(chains.chain[1].stress, 10, 1e-12);
  assert_near(chains.chain[1].mean_fn, 1, 1e-12);
  assert_int_equal(chains.link_count, 5 + 2);
  assert_int_equal(chains.grain_count, 9);
  assert_near(chains.mean_major, (85 + 15 * 10) / 100.0, 1e-12);
  tal_chains_clear(&chains);
  tal_snapshot_clear(&s);
}

// A line of `n` grains that turns by `turn` at the middle one, each loaded along the mean of its branches.
static tal_snapshot bent(int n, double turn) {
  double grain[32][3], x = 0, y = 0;
  for (int k = 0; k < n; k++) {
    memcpy(grain[k], (double[3]){x, y, 1.0001}, sizeof *grain);
    x += 2 * cos(k < n / 2 ? 0 : turn);
    y += 2 * sin(k < n / 2 ? 0 : turn);
  }
  memcpy(grain[n], (double[3]){100, 100, 1}, sizeof *grain); // without load the mean would be that of the chain
  memcpy(grain[n + 1], (double[3]){101.9, 100, 1}, sizeof *grain);
  tal_snapshot s = snapshot_of((size_t)n + 2, (const double(*)[3])grain);
  snapshot_join_all(&s, 1e-6, 1);
  for (int k = 0; k < n; k++)
    load(&s, (size_t)k, 10, k < n / 2 ? 0 : turn);
  load(&s, (size_t)n, 1, 0);
  load(&s, (size_t)n + 1, 1, 0);
  return s;
}

// EXACT: a chain goes round a bend up to the stated angle and breaks beyond it.
static void test_angle_rule(void **state) {
  (void)state;
  const struct {
    double turn, angle;
    size_t chains, longest;
  } bends[] = {{40, 45, 1, 9}, {44.9, 45, 1, 9}, {45.1, 45, 2, 5}, {40, 30, 2, 5}, {29, 30, 1, 9}};
  for (size_t k = 0; k < sizeof bends / sizeof *bends; k++) {
    tal_snapshot s = bent(9, bends[k].turn * degree);
    tal_chains chains = find(&s, bends[k].angle * degree);
    size_t longest = 0;
    for (size_t c = 0; c < chains.count; c++)
      longest = chains.chain[c].count > longest ? chains.chain[c].count : longest;
    assert_int_equal(chains.count, bends[k].chains);
    assert_int_equal(longest, bends[k].longest);
    tal_chains_clear(&chains);
    tal_snapshot_clear(&s);
  }
}

// EXACT: where two grains offer themselves the straighter one is taken: below a line of four, one at 0 degrees, one at
// 30. And a ring of grains, each loaded along it, becomes one chain of all of them: links never close a ring.
static void test_forks_and_rings(void **state) {
  (void)state;
  double fork[8][3] = {{0, 0, 1}, {2, 0, 1}, {4, 0, 1}, {6, 0, 1}, {0, 0, 1}, {0, 0, 1}, {50, 50, 1}, {52, 50, 1}};
  fork[4][0] = 6 + 2 * cos(30 * degree), fork[4][1] = 2 * sin(30 * degree);
  fork[5][0] = 6 + 2 * cos(-35 * degree), fork[5][1] = 2 * sin(-35 * degree);
  tal_snapshot s = snapshot_of(8, (const double(*)[3])fork);
  for (size_t k = 0; k < 8; k++)
    s.r[k] *= 1 + 1e-6;
  snapshot_join_all(&s, 0, 1);
  for (size_t k = 0; k < 8; k++)
    load(&s, k, k < 6 ? 10 : 1, 0);
  tal_chains chains = find(&s, 45 * degree);
  assert_int_equal(chains.count, 1);
  assert_int_equal(chains.chain[0].count, 5);
  assert_int_equal(chains.of[4], 0);
  assert_int_equal(chains.of[5], -1);
  tal_chains_clear(&chains);
  tal_snapshot_clear(&s);
  enum { RING = 24 };
  double ring[RING + 2][3] = {{0}};
  for (int k = 0; k < RING; k++)
    memcpy(ring[k], (double[3]){cos(2 * TAL_PI * k / RING), sin(2 * TAL_PI * k / RING), 1.001 * sin(TAL_PI / RING)},
           sizeof *ring);
  memcpy(ring[RING], (double[3]){9, 9, 1}, sizeof *ring);
  memcpy(ring[RING + 1], (double[3]){10.9, 9, 1}, sizeof *ring);
  s = snapshot_of(RING + 2, (const double(*)[3])ring);
  snapshot_join_all(&s, 0, 1);
  for (int k = 0; k < RING + 2; k++)
    load(&s, (size_t)k, k < RING ? 10 : 1, 2 * TAL_PI * k / RING + TAL_PI / 2);
  chains = find(&s, 45 * degree);
  assert_int_equal(chains.count, 1);
  assert_int_equal(chains.chain[0].count, RING);
  assert_int_equal(chains.link_count, RING - 1);
  tal_chains_clear(&chains);
  tal_snapshot_clear(&s);
}

// EXACT: strong clusters of a square lattice: a full row spans x, a column that stops short does not span y.
static void test_clusters(void **state) {
  (void)state;
  tal_snapshot s = grid();
  for (size_t c = 0; c < s.contacts.count; c++) {
    const int32_t i = s.contacts.i[c], j = s.contacts.j[c];
    const bool row = i / 10 == 5 && j / 10 == 5, column = i % 10 == 2 && j % 10 == 2 && j / 10 < 4;
    s.contacts.fn[c] = row || column ? 5 : 1;
  }
  tal_part part = snapshot_all(&s);
  tal_clusters clusters = tal_clusters_find(&part);
  assert_int_equal(clusters.count, 2);
  assert_int_equal(clusters.largest, 10);
  assert_near(clusters.share, 10.0 / 14, 1e-15);
  assert_true(clusters.spans_x);
  assert_false(clusters.spans_y);
  snapshot_end(&s, &part);
}

// ---- in time ----

static void add(tal_chain_tracker *tracker, const tal_snapshot *s, size_t frame) {
  tal_chains chains = find(s, 45 * degree);
  tal_chain_tracker_add(tracker, &chains, s, frame);
  assert_null(chains.grain); // it moved
}

static tal_snapshot column(size_t from, size_t to, double strain) {
  tal_snapshot s = grid();
  s.axial_strain = s.time = strain;
  for (size_t row = from; row < to; row++)
    load(&s, row * 10 + 4, 10, 90 * degree);
  return s;
}

// EXACT: a chain that slides along keeps its name while it shares half of the shorter one; then it dies and another is
// born; the lives have the right frames and say where they were cut off.
static void test_lives(void **state) {
  (void)state;
  const size_t rows[][2] = {{0, 6}, {1, 7}, {2, 6}, {5, 10}, {5, 9}};
  tal_chain_tracker tracker = {0};
  for (size_t k = 0; k < 5; k++) {
    tal_snapshot s = column(rows[k][0], rows[k][1], 0.1 * (double)k);
    add(&tracker, &s, 10 + k);
    assert_int_equal(tracker.before.count, 1);
    assert_int_equal(tracker.id[0], k < 3 ? 0 : 1);
    assert_int_equal(tracker.born, k == 0 || k == 3);
    assert_int_equal(tracker.ended, k == 3);
    tal_snapshot_clear(&s);
  }
  tal_chain_tracker_end(&tracker);
  assert_int_equal(tracker.life_count, 2);
  const tal_chain_life *first = &tracker.life[0], *second = &tracker.life[1];
  assert_int_equal(first->born, 10);
  assert_int_equal(first->last, 12);
  assert_int_equal(first->frames, 3);
  assert_int_equal(first->longest, 6);
  assert_true(first->from_start && !first->to_end);
  assert_near(second->born_strain, 0.3, 1e-15);
  assert_near(second->last_strain, 0.4, 1e-15);
  assert_true(!second->from_start && second->to_end);
  tal_chain_tracker_clear(&tracker);
}

// EXACT / ROUND: a straight triple whose middle grain moves aside so that the angle closes by 2 theta: an event beyond
// the threshold of 2 x 1 degree when its load fell, none otherwise.
static void test_buckling(void **state) {
  (void)state;
  const struct {
    double half_closing, load;
    size_t events;
  } cases[] = {{1.2, 5, 1}, {0.9, 5, 0}, {1.2, 12, 0}};
  for (size_t k = 0; k < 3; k++) {
    tal_chain_tracker tracker = {0};
    tal_snapshot s = column(3, 6, 0);
    add(&tracker, &s, 0);
    s.x[44] += 2 * tan(cases[k].half_closing * degree);
    load(&s, 44, cases[k].load, 90 * degree);
    add(&tracker, &s, 1);
    assert_int_equal(tracker.segments, 1);
    assert_int_equal(tracker.event_count, cases[k].events);
    if (tracker.event_count) {
      assert_int_equal(tracker.event[0].grain[1], 44);
      assert_near(tracker.event[0].before, TAL_PI, 1e-12);
      assert_near(tracker.event[0].after, TAL_PI - 2 * 1.2 * degree, 1e-12);
      assert_near(tracker.event[0].lost, 0.5, 1e-12);
      assert_int_equal(tracker.life[0].buckled, 1);
    }
    tal_snapshot_clear(&s);
    tal_chain_tracker_clear(&tracker);
  }
}

// EXACT: no contacts, no grains, and frames of different grains: no chains, lives that start afresh.
static void test_little(void **state) {
  (void)state;
  tal_chain_tracker tracker = {0};
  const double grain[2][3] = {{0, 0, 1}, {5, 0, 1}};
  for (size_t n = 0; n <= 2; n++) {
    tal_snapshot s = snapshot_of(n, grain);
    for (size_t k = 0; k < n; k++)
      load(&s, k, 1e-12, 0); // hairs
    tal_part part = snapshot_all(&s);
    const tal_clusters clusters = tal_clusters_find(&part);
    assert_int_equal(clusters.count, 0);
    tal_chains chains = find(&s, TAL_CHAIN_ANGLE);
    assert_int_equal(chains.count + chains.bearing + chains.strong, 0);
    tal_chain_tracker_add(&tracker, &chains, &s, n);
    snapshot_end(&s, &part);
  }
  tal_snapshot s = column(0, 6, 0);
  add(&tracker, &s, 3);
  assert_int_equal(tracker.born, 1);
  tal_snapshot_clear(&s);
  tal_chain_tracker_clear(&tracker);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_columns_are_chains),
      cmocka_unit_test(test_angle_rule),
      cmocka_unit_test(test_forks_and_rings),
      cmocka_unit_test(test_clusters),
      cmocka_unit_test(test_lives),
      cmocka_unit_test(test_buckling),
      cmocka_unit_test(test_little),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
