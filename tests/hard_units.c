// What must not depend on where a sample lies, how it is turned, how fast it travels, and in which units it is written.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "engine.h"
#include "hard.h"
#include "physics.h"
#include <omp.h>

// ---- units ----

// A whole test of 60 grains in units where a length is `L` and a mass `M` as long and heavy as in SI; a second is one.
static engine *whole_test(const char *law, const char *scheme, const char *compress, double L, double M) {
  draft *d = draft_begin();
  const double stress = M / L;
  fprintf(d->to,
          "seed: 7\ngrains: {count: 60, radius: {law: uniform, min: %.17g, max: %.17g}, thickness: %.17g}\n"
          "material: {young: %.17g, density: %.17g, friction: 0.5, damping: 2e-3}\nmass_scaling: 4\n"
          "contact: {tangential: %s}\npack: {width: %.17g}\ncontinuum: {refresh: 50}\n"
          "integrator: {scheme: %s, dt: 1e-3}\nstages:\n"
          "  - {kind: confine, pressure: %.17g, ramp: 0.5, tolerance: 0.2, unbalanced: 0.1, friction: 0.1}\n"
          "  - {kind: compress, rate: 0.1, strain: 0.01%s",
          0.5 * L, 1.0 * L, 1.5 * L, 1e5 * stress, 1.0 * M / (L * L * L), law, 12.0 * L, scheme, 100 * stress,
          compress);
  if (strstr(compress, "membrane"))
    fprintf(d->to, ", membrane: {stiffness: %.17g, mass: %.17g}", 2000 * M, 8.0 * M);
  fputs("}\n", d->to);
  return engine_start(d);
}

static void assert_scaled(const double *value, const double *base, size_t count, double scale) {
  for (size_t k = 0; k < count; k++)
    if (value[k] != scale * base[k])
      fail_msg("value %zu: %.17g is not %g times %.17g", k, value[k], scale, base[k]);
}

static const struct {
  const char *law, *scheme, *compress;
} tests_of_units[] = {
    {"regularised", "verlet", ""},
    {"spring", "verlet", ", boundary: minimal, order: 1"},
    {"regularised", "implicit_friction", ", boundary: membrane"},
};

// EXACT: lengths times 2^-20 (grains of micrometres) or 2^10 (kilometres), masses times the square of it: every
// quantity is a power of two times what it was, so every bit of the result is the same.
static void test_units(void **state) {
  (void)state;
  static const double lengths[] = {0x1p-20, 0x1p10};
  int64_t steps = 0;
  for (size_t k = 0; k < sizeof tests_of_units / sizeof *tests_of_units; k++) {
    const char *law = tests_of_units[k].law, *scheme = tests_of_units[k].scheme, *plan = tests_of_units[k].compress;
    engine *base = whole_test(law, scheme, plan, 1, 1);
    engine_finish(base);
    steps += base->sim->run.step;
    for (int s = 0; s < 2; s++) {
      const double L = lengths[s], M = L * L;
      engine *e = whole_test(law, scheme, plan, L, M);
      engine_finish(e);
      const tal_grains *g = &e->sim->grains, *h = &base->sim->grains;
      assert_int_equal(e->sim->run.step, base->sim->run.step);
      assert_scaled(g->x, h->x, g->count, L);
      assert_scaled(g->y, h->y, g->count, L);
      assert_scaled(g->vx, h->vx, g->count, L);
      assert_scaled(g->omega, h->omega, g->count, 1);
      const tal_row row = engine_row(e), same = engine_row(base);
      assert_scaled(&row.sigma_yy, &same.sigma_yy, 1, M / L);
      assert_scaled(&row.volumetric_strain, &same.volumetric_strain, 1, 1);
      assert_scaled(&row.elastic, &same.elastic, 1, M * L * L);
      assert_scaled(&row.energy_residual, &same.energy_residual, 1, 1);
      engine_end(e);
    }
    engine_end(base);
  }
  hard_report(&(hard_row){
      "micrometre and kilometre units", "lengths times 2^-20 and 2^10, masses their square",
      "dimensional identity: every bit the same, times a power of two",
      hard_text("exact: pack, confine, compress with pressure, minimal, membrane; %lld steps", (long long)steps),
      "none found", "the range of doubles"});
}

// ---- far away, turned, travelling ----

enum { CROWD = 19 };

// A hexagon of 19 grains that fly at each other, `turn` radians about the origin, then moved and set in motion.
static engine *crowd(const char *law, const char *scheme, double turn, const double at[2], const double with[2]) {
  draft *d = draft_begin();
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  const double c = cos(turn), s = sin(turn);
  fputs("grains:\n  thickness: 1\n  list:\n", d->to);
  for (int i = -2; i <= 2; i++)
    for (int j = -2; j <= 2; j++) {
      if (abs(i + j) > 2)
        continue;
      const double x = 2.125 * (i + 0.5 * j), y = 2.125 * 0.866 * j, u = uniform(random, -1, 1) - x;
      const double v = uniform(random, -1, 1) - y;
      fprintf(d->to, "  - {x: %.17g, y: %.17g, r: 1, vx: %.17g, vy: %.17g, omega: %.17g}\n", at[0] + c * x - s * y,
              at[1] + s * x + c * y, with[0] + c * u - s * v, with[1] + s * u + c * v, uniform(random, -1, 1));
    }
  gsl_rng_free(random);
  fprintf(d->to,
          "material: {young: 1e5, density: 1, friction: 0.5, damping: 1e-3}\ncontact: {tangential: %s}\n"
          "limits: {stride: .inf}\nintegrator: {scheme: %s, dt: 2e-4}\nstages: [{kind: free, duration: 0.25}]\n",
          law, scheme);
  return engine_start(d);
}

// Largest difference of the velocities of `e`, turned and slowed back, from those of `base`.
static double difference(const engine *e, const engine *base, double turn, const double with[2]) {
  const tal_grains *g = &e->sim->grains, *h = &base->sim->grains;
  const double c = cos(turn), s = sin(turn);
  double largest = 0;
  for (size_t i = 0; i < g->count; i++) // ids are in the order of the list; places in memory need not be
    for (size_t j = 0; j < h->count; j++) {
      if (g->id[i] != h->id[j])
        continue;
      const double u = g->vx[i] - with[0], v = g->vy[i] - with[1];
      largest = fmax(largest, hypot(c * u + s * v - h->vx[j], c * v - s * u - h->vy[j]));
    }
  return largest;
}

static double moved(const char *law, const char *scheme, double turn, const double at[2], const double with[2]) {
  static const double none[2] = {0, 0};
  engine *base = crowd(law, scheme, 0, none, none), *e = crowd(law, scheme, turn, at, with);
  engine_finish(base);
  engine_finish(e);
  const double off = difference(e, base, turn, with);
  engine_end(base);
  engine_end(e);
  return off;
}

static const char *const laws[] = {"spring", "regularised, vR: 0.1"};
static const char *const schemes[] = {"verlet", "implicit_friction, sweeps: 100"};

// ROUND: turned by any angle, or travelling, the crowd scatters in the same way; what differs is round-off, enlarged by
// some twenty collisions. Few sweeps of implicit friction leave more: the order of the neighbour list.
static void test_objective(void **state) {
  (void)state;
  static const double none[2] = {0, 0}, boost[2] = {3, -5};
  double turned = 0, boosted = 0;
  for (int k = 0; k < 4; k++) {
    for (double turn = 0.5; turn < 6; turn += 1.1)
      turned = fmax(turned, moved(laws[k / 2], schemes[k % 2], turn, none, none));
    boosted = fmax(boosted, moved(laws[k / 2], schemes[k % 2], 0, none, boost));
  }
  const double unfinished = moved(laws[1], "implicit_friction, sweeps: 2", 0, none, boost);
  assert_true(turned < 1e-9 && boosted < 1e-8 && unfinished < 1e-2);
  hard_report(&(hard_row){"rotation and translation of the whole",
                          "five angles; a boost of 6 m/s; both laws and schemes", "the same motion, turned or shifted",
                          hard_text("velocities of 1 m/s differ by %.0e turned, %.0e boosted", turned, boosted),
                          "implicit_friction before its sweeps converge: their order is that of the neighbour list",
                          hard_text("two sweeps: %.0e, the error that sweeps leave anyway", unfinished)});
}

// ROUND: shifted by D radii the crowd scatters the same but for the digits that D takes from the coordinates, a part in
// 1e12 per radius; beyond limits.world the run is refused.
static void test_far_away(void **state) {
  (void)state;
  static const double none[2] = {0, 0}, where[] = {0x1p10, 0x1p16, 0x1p20, 0x1p24};
  double off[4];
  for (int k = 0; k < 4; k++) {
    const double at[2] = {where[k], -where[k]};
    off[k] = 0;
    for (int s = 0; s < 2; s++)
      off[k] = fmax(off[k], moved("spring", schemes[s], 0, at, none));
    assert_true(off[k] < 1e-11 * where[k]);
  }
  draft *d = draft_begin();
  fputs("grains: {thickness: 1, list: [{x: 3e7, y: 0, r: 1}]}\nmaterial: {young: 1, density: 1}\n"
        "integrator: {dt: 1}\nstages: [{kind: free, duration: 1}]\n",
        d->to);
  tal_scene scene;
  tal_sim *sim;
  tal_error err = {""};
  draft_load(d, &scene);
  assert_int_equal(tal_sim_create(&sim, &scene, &err), TAL_INVALID);
  assert_non_null(strstr(err.text, "outside the world"));
  tal_scene_clear(&scene);
  hard_report(&(hard_row){
      "coordinates far from the origin", "a crowd 1e3 to 1.7e7 radii away", "the same motion but for the digits lost",
      hard_text("velocities differ by %.0e at 1e3, %.0e at 1e6, %.0e at 1.7e7 radii", off[0], off[2], off[3]),
      "limits.world: 1e7 mean diameters", "exit 3: outside the world"});
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_units),
      cmocka_unit_test(test_objective),
      cmocka_unit_test(test_far_away),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
