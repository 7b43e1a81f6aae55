// The same bits whatever the number of threads, the other simulations in the process and the units of length, time and
// mass.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "engine.h"
#include "forces.h"
#include <omp.h>

// ---- units ----

// Units of length, time and mass as powers of two; lengths even powers, so that the square root in Hertz' law is exact.
typedef struct units {
  int length, time, mass;
} units;

// Factor of a unit as it is written in the series' header.
static double factor(const char *unit, units u) {
  int force = u.mass + u.length - 2 * u.time;
  const struct {
    const char *name;
    int power;
  } known[] = {{"", 0},
               {"s", u.time},
               {"m", u.length},
               {"N", force},
               {"Pa", force - 2 * u.length},
               {"J", force + u.length},
               {"W", force + u.length - u.time},
               {"1/s", -u.time},
               {"m/s", u.length - u.time},
               {"m/s^2", u.length - 2 * u.time},
               {"kg/m^3", u.mass - 3 * u.length},
               {"N/m", force - u.length},
               {"N s/m", force - u.length + u.time},
               {"kg", u.mass},
               {"kg m^2", u.mass + 2 * u.length}};
  for (size_t k = 0; k < sizeof known / sizeof *known; k++)
    if (strcmp(known[k].name, unit) == 0)
      return ldexp(1, known[k].power);
  fail_msg("unit %s", unit);
  return 0;
}

// Writes `key: value` with the value, given in `unit`, turned into the new units.
static void put(FILE *to, units u, const char *key, double value, const char *unit) {
  fprintf(to, "%s: %.17g", key, value * factor(unit, u));
}

typedef struct quantity {
  const char *key;
  double value;
  const char *unit;
} quantity;

// {a: 1, b: 2, ...} up to the entry without a key; `more` comes last inside the braces.
static void put_map(FILE *to, units u, const quantity *of, const char *more) {
  fputs("{", to);
  for (; of->key; of++) {
    put(to, u, of->key, of->value, of->unit);
    fputs(of[1].key ? ", " : "", to);
  }
  fprintf(to, "%s}", more);
}
#define MAP(to, u, more, ...) put_map(to, u, (const quantity[]){__VA_ARGS__, {NULL, 0, NULL}}, more)

static void put_vector(FILE *to, units u, const char *key, double x, double y, const char *unit) {
  fprintf(to, "%s: [%.17g, %.17g]", key, x * factor(unit, u), y * factor(unit, u));
}

// Drop-and-roll, confinement with its own friction and step, compression.
static void biaxial(FILE *to, units u, const char *tangential, const char *boundary) {
  fputs("grains: {count: 120, ", to);
  put(to, u, "thickness", 1.5e-3, "m");
  fputs(", radius: ", to);
  MAP(to, u, ", law: uniform", {"min", 0.5e-3, "m"}, {"max", 1e-3, "m"});
  fputs("}\nmaterial: ", to);
  MAP(to, u, ", poisson: 0.3, friction: 0.45", {"young", 30e9, "Pa"}, {"density", 2675, "kg/m^3"},
      {"damping", 2e-3, "s"});
  fprintf(to, "\nmass_scaling: 1e5\ncontact: {tangential: %s}\npack: ", tangential);
  MAP(to, u, ", method: drop_and_roll", {"width", 14e-3, "m"});
  fputs("\ncontinuum: {refresh: 50}\nintegrator: ", to);
  MAP(to, u, "", {"dt", 1e-5, "s"});
  fputs("\nstages:\n  - ", to);
  char more[120];
  snprintf(more, sizeof more, ", kind: confine, friction: 0.1, tolerance: 0.4, unbalanced: 1, integrator: {dt: %.17g}",
           2e-5 * factor("s", u));
  MAP(to, u, more, {"pressure", 1e5, "Pa"}, {"ramp", 0.04, "s"});
  fputs("\n  - ", to);
  snprintf(more, sizeof more, ", kind: compress, strain: 0.003, boundary: %s", boundary);
  MAP(to, u, more, {"rate", 0.1, "1/s"});
  fputs("\n", to);
}

static void biaxial_regularised(FILE *to, units u) {
  biaxial(to, u, "regularised", "pressure");
}

static void biaxial_spring(FILE *to, units u) {
  biaxial(to, u, "spring", "pressure");
}

static void biaxial_exact(FILE *to, units u) {
  biaxial(to, u, "spring", "minimal, order: 2");
}

static void biaxial_penalty(FILE *to, units u) {
  biaxial(to, u, "regularised", "minimal, method: penalty");
}

// Listed grains, spheres, linear law with restitution, springs, walls, gravity, a fixed grain, own mass and inertia.
static void listed(FILE *to, units u) {
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  fputs("grains:\n  shape: sphere\n  list:\n", to);
  for (int k = 0; k < 36; k++) {
    fputs("  - ", to);
    MAP(to, u, k == 14 ? ", fixed: true" : "", {"x", 2.2 * (k % 6 + 0.5), "m"}, {"y", 2.2 * (k / 6 + 0.5), "m"},
        {"r", uniform(random, 0.5, 1), "m"}, {"vx", k == 14 ? 0.1 : uniform(random, -3, 3), "m/s"},
        {"vy", k == 14 ? 0 : uniform(random, -3, 3), "m/s"}, {"omega", uniform(random, -3, 3), "1/s"},
        {"mass", uniform(random, 1, 3), "kg"}, {"inertia", uniform(random, 0.3, 0.6), "kg m^2"});
    fputs("\n", to);
  }
  gsl_rng_free(random);
  fputs("contact: ", to);
  MAP(to, u, ", normal: linear, restitution: 0.6, tangential: spring", {"stiffness", 3e4, "N/m"});
  fputs("\nmaterial: {friction: 0.5}\n", to);
  put_vector(to, u, "gravity", 1, -9.81, "m/s^2");
  fputs("\nwalls:\n  - {", to);
  put_vector(to, u, "from", -3, 0, "m");
  fputs(", ", to);
  put_vector(to, u, "to", 20, 0, "m");
  fputs("}\n  - {", to);
  put_vector(to, u, "from", 13.2, -1, "m");
  fputs(", ", to);
  put_vector(to, u, "to", 13.2, 20, "m");
  fputs(", ", to);
  put_vector(to, u, "velocity", -0.7, 0.1, "m/s");
  fputs(", ", to);
  put(to, u, "from_time", 0.1, "s");
  fputs("}\nintegrator: ", to);
  MAP(to, u, "", {"dt", 1e-3, "s"});
  fputs("\nstages: [", to);
  MAP(to, u, ", kind: free", {"duration", 2, "s"});
  fputs("]\n", to);
}

static void assert_scaled_row(const tal_row *a, const tal_row *b, units u) {
#define X(name, unit, meaning)                                                                                         \
  if (!(b->name == a->name * factor(unit, u) || (isnan(a->name) && isnan(b->name))))                                   \
    fail_msg(#name " is %.17g and %.17g at step %g", a->name, b->name / factor(unit, u), a->step);
  TAL_SERIES_FIELDS(X)
#undef X
}

typedef void writer(FILE *to, units u);

static engine *start(writer *write, units u) {
  draft *d = draft_begin();
  write(d->to, u);
  return engine_start(d);
}

enum { ROWS = 40 };

// Runs to the end with about ROWS rows on the way; the number of rows and the steps between them are the same in all
// units.
static size_t run_rows(engine *e, tal_row rows[ROWS]) {
  size_t count = 0;
  while (!tal_sim_done(e->sim)) {
    engine_step(e);
    if (e->sim->run.step % 250 == 0 || tal_sim_done(e->sim)) {
      assert_true(count < ROWS);
      rows[count++] = engine_row(e);
    }
  }
  return count;
}

// EXACT: other units of length (powers of four), time and mass (powers of two) change no bit but the exponents.
static void other_units(void **state) {
  (void)state;
  static writer *const scenes[] = {biaxial_regularised, biaxial_spring, biaxial_exact, biaxial_penalty, listed};
  static const units to[] = {{2, 0, 0}, {-4, 3, 5}, {10, -7, -3}};
  for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
    tal_row plain[ROWS], scaled[ROWS];
    engine *e = start(scenes[s], (units){0, 0, 0});
    size_t count = run_rows(e, plain);
    assert_true(count > 6);
    for (size_t k = 0; k < sizeof to / sizeof *to; k++) {
      engine *f = start(scenes[s], to[k]);
      assert_int_equal(run_rows(f, scaled), count);
      for (size_t row = 0; row < count; row++)
        assert_scaled_row(&plain[row], &scaled[row], to[k]);
      for (size_t i = 0; i < e->sim->grains.count; i++) {
        assert_true(f->sim->grains.x[i] == ldexp(e->sim->grains.x[i], to[k].length));
        assert_true(f->sim->grains.theta[i] == e->sim->grains.theta[i]);
      }
      engine_end(f);
    }
    engine_end(e);
  }
}

// ---- threads ----

// 3,000 grains on a dense jittered grid, so that every loop is shared out among the threads.
static engine *crowd(const char *tangential) {
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  draft *d = draft_begin();
  fputs("grains:\n  thickness: 1\n  list:\n", d->to);
  for (int k = 0; k < 3000; k++)
    fprintf(d->to, "  - {x: %.17g, y: %.17g, r: %.17g, vx: %.17g, vy: %.17g}\n",
            1.6 * (k % 60 + 0.5) + uniform(random, -0.1, 0.1), 1.6 * (k / 60 + 0.5) + uniform(random, -0.1, 0.1),
            uniform(random, 0.6, 1), uniform(random, -5, 5), uniform(random, -5, 5));
  fprintf(d->to,
          "material: {young: 1e5, density: 1, friction: 0.5, damping: 2e-3}\ncontact: {tangential: %s}\n"
          "walls: [{from: [-1, -0.5], to: [103, -0.5]}, {from: [-0.5, 0], to: [-0.5, 90]}]\ngravity: [-2, -9]\n"
          "limits: {overlap: 0.9}\nintegrator: {dt: 1e-3}\nstages: [{kind: free, duration: 0.2}]\n",
          tangential);
  gsl_rng_free(random);
  return engine_start(d);
}

// EXACT: 1, 2, 3 and 4 threads: the motion and every column of the series.
static void threads(void **state) {
  (void)state;
  static const char *const laws[] = {"regularised, vR: 0.01", "spring"};
  for (int k = 0; k < 2; k++) {
    engine *one = NULL;
    tal_row first = {0};
    for (int count = 1; count <= 4; count++) {
      omp_set_num_threads(count);
      engine *e = crowd(laws[k]);
      assert_true(e->sim->pairs.count > 3000);
      engine_finish(e);
      tal_row row = engine_row(e);
      omp_set_num_threads(1);
      if (!one) {
        one = e;
        first = row;
        continue;
      }
      assert_same_motion(one, e);
      assert_memory_equal(&first, &row, sizeof row);
      engine_end(e);
    }
    assert_true(first.dissipated_friction > 1);
    engine_end(one);
  }
}

// ---- two in one process ----

static const units si = {0, 0, 0};

// EXACT: a simulation alone, the same one step by step in turn with two others, and again after them. Looking at one
// between its steps changes nothing either.
static void two_at_once(void **state) {
  (void)state;
  engine *alone = start(biaxial_spring, si), *e = start(biaxial_spring, si), *other = start(listed, si), *third = NULL;
  engine_steps(alone, 2500);
  for (int s = 0; s < 2500; s++) {
    engine_step(e);
    if (!tal_sim_done(other->sim))
      engine_step(other);
    if (s == 500)
      third = start(biaxial_regularised, si);
    if (third)
      engine_step(third);
    if (s % 7 == 0 && s < 2499) {
      engine_row(e);
      tal_sim_observe(e->sim); // the row of this very instant would now be of other forces
    }
  }
  assert_same_motion(alone, e);
  tal_row a = engine_row(alone), b = engine_row(e);
  assert_memory_equal(&a, &b, sizeof a);
  engine_end(alone);
  engine_end(other);
  engine_end(third);
  engine *again = start(biaxial_spring, si);
  engine_steps(again, 2500);
  assert_same_motion(again, e);
  engine_end(again);
  engine_end(e);
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(other_units),
      cmocka_unit_test(threads),
      cmocka_unit_test(two_at_once),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
