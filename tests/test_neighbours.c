// The neighbour list: complete at every step against a search over all pairs and walls, in the right order, and without
// any influence on the motion: three skins give the same bits.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "engine.h"
#include "forces.h"
#include <omp.h>

static const double skins[] = {0.005, 0.02, 0.3};
enum { SKINS = 3 };

// ---- the search over everything ----

// The slot of (i, j) in a list that must ascend; fails when it is not there.
static size_t slot_of(const tal_contacts *slots, int32_t i, int32_t j, size_t *from, const char *what) {
  while (*from < slots->count && (slots->i[*from] < i || (slots->i[*from] == i && slots->j[*from] < j)))
    (*from)++;
  if (*from == slots->count || slots->i[*from] != i || slots->j[*from] != j)
    fail_msg("%s %d and %d touch and are not listed", what, i, j);
  return *from;
}

static size_t touching_slots(const tal_contacts *slots) {
  size_t count = 0;
  for (size_t c = 0; c < slots->count; c++) {
    if (c > 0)
      assert_true(slots->i[c - 1] < slots->i[c] || (slots->i[c - 1] == slots->i[c] && slots->j[c - 1] < slots->j[c]));
    count += slots->overlap[c] > 0;
  }
  return count;
}

static size_t check_pairs(const tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  size_t found = 0, from = 0;
  for (int32_t i = 0; i < (int32_t)g->count; i++)
    for (int32_t j = i + 1; j < (int32_t)g->count; j++) {
      double dx = g->x[i] - g->x[j], dy = g->y[i] - g->y[j];
      double overlap = g->r[i] + g->r[j] - sqrt(dx * dx + dy * dy);
      if (overlap <= 0)
        continue;
      size_t c = slot_of(&sim->pairs, i, j, &from, "grains");
      assert_true(sim->pairs.overlap[c] == overlap);
      found++;
    }
  assert_int_equal(touching_slots(&sim->pairs), found);
  return found;
}

// Distance of a centre from a wall, worked out in another way than the engine's: by the angles at the ends.
static double distance_to(const tal_wall *wall, double x, double y) {
  if (wall->plate != 0)
    return wall->plate * (y - wall->y0);
  double ax = x - wall->x0, ay = y - wall->y0, bx = x - wall->x1, by = y - wall->y1;
  double ex = wall->x1 - wall->x0, ey = wall->y1 - wall->y0;
  if (ax * ex + ay * ey <= 0)
    return hypot(ax, ay);
  if (bx * ex + by * ey >= 0)
    return hypot(bx, by);
  return fabs(ax * ey - ay * ex) / hypot(ex, ey);
}

static size_t check_walls(const tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  size_t found = 0, from = 0;
  for (int32_t i = 0; i < (int32_t)g->count; i++)
    for (int32_t w = 0; w < (int32_t)sim->walls.count; w++) {
      const tal_wall *wall = &sim->walls.wall[w];
      bool there = sim->run.time >= wall->from_time && sim->run.time < wall->until_time;
      double overlap = g->r[i] - distance_to(wall, g->x[i], g->y[i]), doubt = 1e-12 * g->r[i];
      if (!there || overlap < -doubt)
        continue;
      if (overlap < doubt) { // round-off decides
        for (size_t c = 0; c < sim->wall_contacts.count; c++)
          found += sim->wall_contacts.i[c] == i && sim->wall_contacts.j[c] == w && sim->wall_contacts.overlap[c] > 0;
        continue;
      }
      size_t c = slot_of(&sim->wall_contacts, i, w, &from, "grain and wall");
      assert_true(fabs(sim->wall_contacts.overlap[c] - overlap) < doubt);
      found++;
    }
  assert_int_equal(touching_slots(&sim->wall_contacts), found);
  return found;
}

// Each grain's slots in the order of its partners.
static void check_incidences(const tal_sim *sim) {
  const tal_neighbours *n = &sim->neighbours;
  size_t seen = 0;
  for (int32_t i = 0; i < (int32_t)sim->grains.count; i++) {
    int32_t last = -1;
    for (int32_t k = n->first[i]; k < n->first[i + 1]; k++, seen++) {
      int32_t c = n->slot[k] < 0 ? ~n->slot[k] : n->slot[k];
      assert_int_equal(n->slot[k] < 0 ? sim->pairs.j[c] : sim->pairs.i[c], i);
      int32_t partner = n->slot[k] < 0 ? sim->pairs.i[c] : sim->pairs.j[c];
      assert_true(partner > last);
      last = partner;
    }
    for (int32_t c = n->wall_first[i]; c < n->wall_first[i + 1]; c++)
      assert_int_equal(sim->wall_contacts.i[c], i);
  }
  assert_int_equal(seen, 2 * sim->pairs.count);
}

// ---- scenes ----

typedef void writer(FILE *to);

// Runs the scene with every skin side by side, checking the lists and comparing the motion at every step.
static void run_all(writer *write, int steps, size_t least_pairs, size_t least_walls) {
  engine *e[SKINS];
  size_t pairs = 0, walls = 0;
  for (int k = 0; k < SKINS; k++) {
    draft *d = draft_begin();
    write(d->to);
    fprintf(d->to, "neighbours: {skin: %.17g}\n", skins[k]);
    e[k] = engine_start(d);
  }
  for (int s = 0; s < steps && !tal_sim_done(e[0]->sim); s++)
    for (int k = 0; k < SKINS; k++) {
      engine_step(e[k]);
      tal_forces_expand(e[k]->sim);
      pairs += check_pairs(e[k]->sim);
      walls += check_walls(e[k]->sim);
      check_incidences(e[k]->sim);
      if (k > 0)
        assert_same_motion(e[0], e[k]);
    }
  if (pairs < least_pairs || walls < least_walls)
    fail_msg("too little happens: %zu pairs, %zu walls at step %lld", pairs, walls, (long long)e[0]->sim->run.step);
  assert_true(e[0]->sim->neighbours.rebuilds > e[2]->sim->neighbours.rebuilds); // the skins did differ
  for (int k = 0; k < SKINS; k++)
    engine_end(e[k]);
}

// Grains on a loose grid with random velocities; every eleventh is `ratio` times the smallest.
static void put_grains(FILE *to, int side, double pitch, double small, double large, double speed) {
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  fprintf(to, "grains:\n  thickness: 1\n  list:\n");
  for (int k = 0; k < side * side; k++) {
    double r = k % 11 == 5 ? large : uniform(random, small, 2 * small);
    fprintf(to, "  - {x: %.17g, y: %.17g, r: %.17g, vx: %.17g, vy: %.17g, omega: %.17g}\n", pitch * (k % side + 1),
            pitch * (k / side + 1), r, uniform(random, -speed, speed), uniform(random, -speed, speed),
            uniform(random, -1, 1));
  }
  gsl_rng_free(random);
}

static void put_box(FILE *to, double size) {
  fprintf(to,
          "walls:\n  - {from: [0, 0], to: [%g, 0]}\n  - {from: [%g, 0], to: [%g, %g]}\n"
          "  - {from: [0, %g], to: [%g, %g]}\n  - {from: [0, 0], to: [0, %g]}\n",
          size, size, size, size, size, size, size, size);
}

// A step moves a grain by several of the small skins.
static void fast(FILE *to) {
  put_grains(to, 8, 2.2, 0.4, 1.0, 30);
  put_box(to, 19.8);
  fprintf(to, "material: {density: 1, friction: 0.4}\ncontact: {normal: linear, stiffness: 4e4, damping: 2, "
              "tangential: spring}\nintegrator: {dt: 2e-3}\nstages: [{kind: free, duration: 2}]\n");
}

static void ratio_20(FILE *to) {
  put_grains(to, 8, 1.2, 0.05, 1.0, 3);
  put_box(to, 10.8);
  fprintf(to, "material: {young: 1e7, density: 1, friction: 0.4, damping: 2e-4}\ncontact: {tangential: spring}\n"
              "gravity: [1, -15]\nintegrator: {dt: 4e-5}\nstages: [{kind: free, duration: 2}]\n");
}

// A box that shrinks from two sides, a fast bar, a gate that goes and one that comes (where there is room), one more
// that comes and goes in the midst of the grains.
static void moving_walls(FILE *to) {
  put_grains(to, 8, 2.4, 0.4, 1.0, 2);
  put_box(to, 21.6);
  fprintf(to,
          "  - {from: [-9, 1], to: [-2, 1], velocity: [25, 0.5]}\n"
          "  - {from: [30, 2], to: [30, 15], velocity: [-16, 0]}\n"
          "  - {from: [4, -5], to: [9, -3], velocity: [0, 10], friction: 0}\n"
          "  - {from: [10.8, 0], to: [10.8, 21.6], until_time: 0.3}\n"
          "  - {from: [0, 4.8], to: [21.6, 4.8], from_time: 0.5, until_time: 0.7, velocity: [0, 1]}\n"
          "material: {density: 1, friction: 0.4}\ncontact: {normal: linear, stiffness: 2e4, damping: 20, vR: 1e-3}\n"
          "limits: {overlap: 1}\nintegrator: {dt: 1e-3}\nstages: [{kind: free, duration: 1.2}]\n");
}

static void biaxial(FILE *to) {
  fprintf(to, "grains: {count: 40, radius: {law: uniform, min: 0.3e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
              "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\n"
              "mass_scaling: 1e5\npack: {method: drop_and_roll, width: 8e-3}\ncontinuum: {refresh: 50}\n"
              "integrator: {dt: 2e-5}\nstages: [{kind: confine, pressure: 100e3, ramp: 0.05, friction: 0.1, "
              "tolerance: 0.5, unbalanced: 10}, {kind: compress, rate: 0.2, strain: 0.005}]\n");
}

// EXACT: touching pairs, walls and their overlaps against brute force; the motion for three skins.
static void fast_grains(void **state) {
  (void)state;
  run_all(fast, 1000, 3000, 1000);
}

static void size_ratio_20(void **state) {
  (void)state;
  run_all(ratio_20, 12000, 3000, 3000);
}

static void walls_that_move_come_and_go(void **state) {
  (void)state;
  run_all(moving_walls, 1200, 3000, 1000);
}

static void plates_and_pressure(void **state) {
  (void)state;
  run_all(biaxial, 6000, 3000, 1000);
}

// EXACT: what is listed against all pairs, grains moved between lists by a little each time, once by much, once
// swollen.
static void lists_from_a_farther_one(void **state) {
  (void)state;
  enum { COUNT = 600, LISTS = 60 };
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  draft *d = draft_begin();
  fputs("grains:\n  thickness: 1\n  list:\n", d->to);
  for (int k = 0; k < COUNT; k++)
    fprintf(d->to, "  - {x: %d, y: %d, r: %.17g}\n", 2 * (k % 25), 2 * (k / 25), 0.7 + 0.35 * gsl_rng_uniform(random));
  fputs("material: {young: 1e5, density: 1, friction: 0.5}\nlimits: {overlap: 1}\nintegrator: {dt: 1e-4}\n"
        "contact: {tangential: none}\nstages: [{kind: free, duration: 1}]\n",
        d->to);
  engine *e = engine_start(d);
  tal_grains *g = &e->sim->grains;
  size_t searches = 0, listed = 0;
  for (int m = 0; m < LISTS; m++) {
    const double step = m == 40 ? 3 : 0.02;
    for (size_t i = 0; i < g->count; i++) {
      g->x[i] += step * (gsl_rng_uniform(random) - 0.5);
      g->y[i] += step * (gsl_rng_uniform(random) - 0.5);
      g->r[i] *= m == 20 ? 1.2 : 1;
    }
    tal_neighbours_rebuild(e->sim);
    searches += e->sim->neighbours.far_moved == 0;
    size_t c = 0;
    for (int32_t i = 0; i < COUNT; i++)
      for (int32_t j = i + 1; j < COUNT; j++) {
        const double dx = g->x[i] - g->x[j], dy = g->y[i] - g->y[j], near = g->r[i] + g->r[j] + e->sim->constants.skin;
        if (!(dx * dx + dy * dy < near * near))
          continue;
        assert_true(c < e->sim->pairs.count && e->sim->pairs.i[c] == i && e->sim->pairs.j[c] == j);
        c++;
      }
    assert_int_equal(c, e->sim->pairs.count);
    listed += c;
  }
  assert_true(searches > 5 && searches < LISTS / 2 && listed > LISTS * COUNT / 4);
  engine_end(e);
  gsl_rng_free(random);
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(fast_grains),
      cmocka_unit_test(size_ratio_20),
      cmocka_unit_test(walls_that_move_come_and_go),
      cmocka_unit_test(plates_and_pressure),
      cmocka_unit_test(lists_from_a_farther_one),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
