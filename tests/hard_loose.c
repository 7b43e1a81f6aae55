// Loose matter: rattlers, a sample that falls apart when nothing holds it any more; and long runs without a trend.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "engine.h"
#include "hard.h"
#include "physics.h"
#include <float.h>
#include <omp.h>

// ---- rattlers ----

// Cages of six touching grains, `held` or not, each with a smaller grain in it that flies about.
static engine *cages(int count, const char *held, double damping, const char *scheme, const char *stages) {
  draft *d = draft_begin();
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  fputs("grains:\n  thickness: 1\n  list:\n", d->to);
  for (int c = 0; c < count; c++) {
    const double x = 7.0 * c;
    for (int k = 0; k < 6; k++)
      fprintf(d->to, "  - {x: %.17g, y: %.17g, r: 1, fixed: %s}\n", x + 1.999 * cos(k * TAL_PI / 3),
              1.999 * sin(k * TAL_PI / 3), held);
    fprintf(d->to, "  - {x: %.17g, y: 0.1, r: 0.4, vx: %.17g, vy: %.17g}\n", x, uniform(random, 0.2, 1),
            uniform(random, 0.2, 1));
  }
  gsl_rng_free(random);
  fprintf(d->to,
          "material: {young: 1e5, density: 1, friction: 0.3, damping: %g}\ncontact: {tangential: spring}\n"
          "integrator: {scheme: %s, dt: 2e-4}\nstages: [%s]\n",
          damping, scheme, stages);
  return engine_start(d);
}

// ROUND: rattlers in cages that lose nothing fly for ever: the ledger closes, their energy has no trend; they count as
// rattlers: the bearing grains have two contacts each in a ring.
static void test_rattlers(void **state) {
  (void)state;
  const int64_t steps = hard_size(50000, 2000000, 20000000);
  char stage[80];
  snprintf(stage, sizeof stage, "{kind: free, duration: %.17g}", 2e-4 * (double)steps);
  engine *e = cages(3, "true", 0, "verlet", stage);
  e->sim->friction = 0; // smooth: nothing is lost
  const double start = e->sim->run.kinetic0;
  engine_finish(e);
  const tal_row row = engine_row(e);
  const double kept = (row.kinetic + row.elastic - e->sim->run.elastic0) / start - 1;
  assert_true(fabs(kept) < 1e-3 && row.coordination_bearing == 2 && row.dissipated_friction == 0);
  hard_report(&(hard_row){
      "rattlers", hard_text("three in smooth cages, %.0e steps of flight", (double)steps),
      "energy kept; a ring's grains bear on two contacts each, rattlers on none",
      hard_text("energy to %.0e; coordination without rattlers exactly %g", fabs(kept), row.coordination_bearing),
      "none found", "-"});
  engine_end(e);
}

// ---- nothing holds ----

typedef struct apart {
  double momentum, residual, coordination, kinetic; // kinetic: over the elastic energy at the start, losses added
} apart;

#define PRESSED                                                                                                        \
  "grains: {radius: {law: uniform, min: 1, max: 1}, thickness: 1}\n"                                                   \
  "material: {young: 1e6, density: 1, friction: 0.3, damping: 1e-4}\n"                                                 \
  "pack: {method: lattice, columns: 9, rows: 9, gap: -0.02}\ncontact: {tangential: spring}\n"

static apart let_go(const char *scheme) {
  draft *d = draft_begin();
  fprintf(d->to, PRESSED "integrator: {scheme: %s, dt: 5e-4}\nstages: [{kind: free, duration: 5}]\n", scheme);
  engine *e = engine_start(d);
  engine_finish(e);
  const tal_row row = engine_row(e);
  const tal_grains *g = &e->sim->grains;
  double px = 0, py = 0, scale = 0;
  for (size_t i = 0; i < g->count; i++) {
    px += g->mass[i] * g->vx[i];
    py += g->mass[i] * g->vy[i];
    scale += g->mass[i] * hypot(g->vx[i], g->vy[i]);
  }
  const double lost = row.dissipated_damping + row.dissipated_friction;
  const apart result = {hypot(px, py) / scale, row.energy_residual, row.coordination,
                        (row.kinetic + lost) / e->sim->run.elastic0};
  engine_end(e);
  return result;
}

// ROUND: a sample that was pressed together and is let go flies apart: its elastic energy becomes kinetic or is lost,
// momentum stays none, no contact is left. A boundary that needs an assembly says so.
static void test_falling_apart(void **state) {
  (void)state;
  const apart by[] = {let_go("verlet"), let_go("implicit_friction")};
  for (int s = 0; s < 2; s++)
    assert_true(by[s].momentum < 1e-13 && fabs(by[s].kinetic - 1) < 1e-3 && by[s].coordination == 0);
  draft *d = draft_begin();
  fputs(PRESSED "integrator: {dt: 5e-4}\nstages: [{kind: shear, pressure: 1e-9, rate: 0.01, strain: 0.5}]\n", d->to);
  engine *e = engine_start(d);
  tal_error err = {""};
  tal_status status = TAL_OK;
  while (!tal_sim_done(e->sim) && status == TAL_OK)
    status = tal_sim_step(e->sim, &err);
  assert_int_equal(status, TAL_INVALID);
  assert_non_null(strstr(err.text, "the assembly falls apart"));
  engine_end(e);
  hard_report(&(hard_row){"falling apart at zero pressure", "81 grains pressed together and let go; both schemes",
                          "elastic energy becomes kinetic or is lost; no momentum; no contact left",
                          hard_text("energy to %.0e, momentum %.0e", fabs(by[0].kinetic - 1), by[0].momentum),
                          "limits.outside, where a boundary needs an assembly", "exit 3: the assembly falls apart"});
}

// ---- long ----

static bool in_flight(const engine *e) {
  const tal_grains *g = &e->sim->grains;
  return fabs(g->y[0] - g->y[1]) > 2 && fmin(g->y[0], g->y[1]) > 1;
}

enum { PARTS = 40 };

// Energy in flight over what it was to begin with, less 1, at the end of each part of the run.
static void energies(engine *e, int64_t steps, double out[PARTS]) {
  const double begun = engine_row(e).gravity;
  for (int p = 0; p < PARTS; p++) {
    for (int64_t n = 0; n < steps / PARTS; n++)
      engine_step(e);
    while (!in_flight(e))
      engine_step(e);
    const tal_row row = engine_row(e);
    out[p] = (row.kinetic + row.gravity) / begun - 1;
  }
}

// MODEL: two grains that bounce on the floor and on each other for ever, losing nothing. An impact begins and ends in
// the midst of a step, so each takes or gives a little; what they take and give has no trend: its mean over the parts
// of the run is nil within 3 standard errors.
static void test_long(void **state) {
  (void)state;
  const int64_t steps = hard_size(200000, 10000000, 100000000);
  draft *d = draft_begin();
  fprintf(d->to,
          "grains: {thickness: 1, list: [{x: 0, y: 1.5, r: 1}, {x: 0, y: 3.6, r: 1}]}\n"
          "material: {young: 1e4, density: 1}\ngravity: [0, -1]\nwalls: [{from: [-9, 0], to: [9, 0]}]\n"
          "integrator: {dt: 5e-4}\nstages: [{kind: free, duration: %.17g}]\n",
          1e-3 * (double)steps);
  engine *e = engine_start(d);
  double at[PARTS], square = 0, largest = 0;
  energies(e, steps, at);
  engine_end(e);
  for (int p = 0; p < PARTS; p++) {
    const double change = at[p] - (p ? at[p - 1] : 0);
    square += change * change / PARTS;
    largest = fmax(largest, fabs(at[p]));
  }
  const double trend = at[PARTS - 1] / PARTS, error = sqrt(square / PARTS);
  if (!(fabs(trend) < 3 * error && largest < 2e-4))
    fail_msg("energy changes by %g +- %g in each part, by %g at most", trend, error, largest);
  hard_report(
      &(hard_row){hard_text("%.0e steps of a small case", (double)steps),
                  "two grains bouncing on a floor and on each other, nothing lost", "energy in flight has no trend",
                  hard_text("off by %.0e at most; %.1f standard errors of a trend", largest, fabs(trend) / error),
                  "none found", "-"});
}

// A gas of smooth grains in a box, speeds uniformly drawn.
static engine *gas(int across, double steps) {
  draft *d = draft_begin();
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  fputs("grains:\n  thickness: 1\n  list:\n", d->to);
  for (int k = 0; k < across * across; k++)
    fprintf(d->to, "  - {x: %.17g, y: %.17g, r: 1, vx: %.17g, vy: %.17g}\n", 2.6 * (k % across) + 1.3,
            2.6 * floor((double)k / across) + 1.3, uniform(random, -1, 1), uniform(random, -1, 1));
  gsl_rng_free(random);
  const double side = 2.6 * across;
  fprintf(d->to,
          "material: {young: 3e4, density: 1}\nneighbours: {skin: 0.2}\nwalls: [{from: [0, 0], to: [%.17g, 0]}, {from: "
          "[0, %.17g], to: [%.17g, %.17g]}, {from: [0, 0], to: [0, %.17g]}, {from: [%.17g, 0], to: [%.17g, %.17g]}]\n"
          "integrator: {dt: 1e-3}\nstages: [{kind: free, duration: %.17g}]\n",
          side, side, side, side, side, side, side, side, 1e-3 * steps);
  return engine_start(d);
}

// MODEL: a gas of grains that lose nothing keeps its energy and comes to Maxwell's distribution of speeds:
// <v^4> = 2 <v^2>^2 in the plane (1.4 to begin with), one temperature in both directions.
static void test_gas(void **state) {
  (void)state;
  const int across = (int)hard_size(16, 50, 100);
  const double n = across * across, steps = (double)hard_size(20000, 80000, 1000000);
  engine *e = gas(across, steps);
  engine_finish(e);
  const tal_row row = engine_row(e);
  const tal_grains *g = &e->sim->grains;
  double xx = 0, yy = 0, fourth = 0;
  for (size_t i = 0; i < g->count; i++) {
    const double square = g->vx[i] * g->vx[i] + g->vy[i] * g->vy[i];
    xx += g->vx[i] * g->vx[i] / n;
    yy += g->vy[i] * g->vy[i] / n;
    fourth += square * square / n;
  }
  const double shape = fourth / ((xx + yy) * (xx + yy)), ratio = xx / yy;
  engine_end(e);
  printf("%g %g %g\n", shape, ratio, row.energy_residual);
  assert_true(fabs(shape - 2) < 3 * sqrt(20 / n) && fabs(ratio - 1) < 3 * sqrt(4 / n) &&
              fabs(row.energy_residual) < 1e-3);
  hard_report(&(hard_row){hard_text("%.0e grain-steps", n * steps), hard_text("gas of %.0f smooth grains in a box", n),
                          "energy kept; Maxwell's speeds: <v^4>/<v^2>^2 = 2, one temperature",
                          hard_text("residual %.0e; %.3f +- %.3f; ratio %.3f +- %.3f", row.energy_residual, shape,
                                    sqrt(20 / n), ratio, sqrt(4 / n)),
                          "none found", "-"});
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_rattlers),
      cmocka_unit_test(test_falling_apart),
      cmocka_unit_test(test_long),
      cmocka_unit_test(test_gas),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
