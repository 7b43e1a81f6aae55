// Hard cases of the spin stage: a million steps of holding, a spin that throws contacts open, rattlers, the rim, an
// assembly smaller than the cutoff; state across checkpoints.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "engine.h"
#include "forced.h"
#include "hard.h"
#include "physics.h"
#include <float.h>

// A hexagonal patch of touching grains, cut from a triangular lattice, under pressure from the start.
static engine *patch(double radius, const char *more, const char *stages) {
  draft *d = draft_begin();
  fprintf(d->to,
          "grains: {radius: {law: uniform, min: 1e-3, max: 1e-3}, thickness: 2e-3}\n"
          "material: {young: 1e8, poisson: 0.3, density: 2e5, friction: 0.4, damping: 1e-4}\n"
          "contact: {vR: 1e-4, exponent: 10}\n"
          "pack: {method: lattice, columns: 12, rows: 11, gap: -1e-7, cut: {shape: circle, radius: %.17g}}\n"
          "%sstages: [%s]\n",
          radius, more, stages);
  return engine_start(d);
}

static const char explicit_step[] = "integrator: {dt: 2e-6}\n";
static const char implicit_step[] = "integrator: {scheme: implicit_friction, dt: 2e-5}\n";

// Mean angle [rad] by which grains have moved around their common centre since they were at x0, y0.
static double turned(const engine *e, const double *x0, const double *y0) {
  const tal_grains *g = &e->sim->grains;
  double cx = 0, cy = 0, ax = 0, ay = 0, moment = 0, arm = 0;
  for (size_t i = 0; i < g->count; i++) {
    cx += x0[i] / (double)g->count;
    cy += y0[i] / (double)g->count;
    ax += g->x[i] / (double)g->count;
    ay += g->y[i] / (double)g->count;
  }
  for (size_t i = 0; i < g->count; i++) {
    double x = x0[i] - cx, y = y0[i] - cy;
    moment += x * (g->y[i] - ay - y) - y * (g->x[i] - ax - x);
    arm += x * x + y * y;
  }
  return moment / arm;
}

static double mean(const double *value, size_t count) {
  double sum = 0;
  for (size_t i = 0; i < count; i++)
    sum += value[i] / (double)count;
  return sum;
}

// ROUND: a million steps of slip at six contacts: the grain turns to the last digits of omega t, the patch neither
// turns (its rim is held exactly; what is left is the inner grains' share of 1e-6 of the forced turn) nor wanders, and
// the ledger closes with the holder's work, all of which friction loses in the end.
static void held_for_a_million_steps(void **state) {
  (void)state;
  engine *e = patch(4.1e-3, explicit_step, "{kind: spin, pressure: 1e4, omega: 3, ramp: 0.01, hold: 1.99}");
  const size_t n = e->sim->grains.count;
  assert_true(n > 10);
  double *x0 = tal_alloc(n, sizeof *x0), *y0 = tal_alloc(n, sizeof *y0);
  engine_steps(e, 20000);
  memcpy(x0, e->sim->grains.x, n * sizeof *x0);
  memcpy(y0, e->sim->grains.y, n * sizeof *y0);
  tal_row early = engine_row(e);
  engine_finish(e);
  tal_row row = engine_row(e);
  const size_t forced = (size_t)e->sim->run.forced - 1;
  assert_int_equal(e->sim->run.step, 1000000);
  assert_near(e->sim->grains.theta[forced], 3 * 0.005 + 3 * 1.99, 1e-9, 6);
  const double angle = turned(e, x0, y0), travelled = 3 * 1.96;
  if (!(fabs(angle) < 1e-6 * travelled))
    fail_msg("the patch turned by %g", angle);
  assert_true(fabs(mean(e->sim->grains.x, n) - mean(x0, n)) < 1e-14);
  assert_true(fabs(row.energy_residual) < 1e-7);
  assert_relative(row.work_held - early.work_held, row.dissipated_friction - early.dissipated_friction, 1e-5);
  assert_true(fabs(row.multiplier_spin) > 0);
  hard_report(
      &(hard_row){"a forced spin held for a million steps", "slip at six contacts of a patch",
                  "turned by omega t; the patch does not turn with it; work of the holder = loss",
                  hard_text("patch turned by %.0e of it; residual %.0e", fabs(angle) / travelled, row.energy_residual),
                  "none found", "-"});
  free(x0);
  free(y0);
  engine_end(e);
}

static int least_touching(engine *e) {
  int *touching = tal_alloc(e->sim->grains.count, sizeof *touching), least = 6;
  tal_error err = {""};
  tal_status status = TAL_OK;
  while (!tal_sim_done(e->sim) && (status = tal_sim_step(e->sim, &err)) == TAL_OK) {
    tal_sim_driving(e->sim);
    tal_forced_contacts(e->sim, touching);
    const int now = touching[e->sim->run.forced - 1];
    least = now < least ? now : least;
  }
  assert_true(status == TAL_OK || (status == TAL_INVALID && *err.text));
  free(touching);
  return least;
}

// ORDER: a spin fast enough to shake its neighbours off: contacts of the forced grain open, the run goes on or stops
// with a reason, and never with a number that is none; in the midst of it what is left of the ledger falls with the
// square of the step.
static void contacts_open(void **state) {
  (void)state;
  static const char *const schemes[] = {"{dt: %g}", "{scheme: implicit_friction, dt: %g}"};
  static const double longest[] = {2e-6, 2e-5}, residual[] = {1e-6, 2e-4};
  for (int k = 0; k < 2; k++)
    for (int shorter = 1; shorter <= 4; shorter *= 2) {
      char scheme[80], step[100];
      snprintf(scheme, sizeof scheme, schemes[k], longest[k] / shorter);
      snprintf(step, sizeof step, "integrator: %s\n", scheme);
      engine *e = patch(5.1e-3, step, "{kind: spin, pressure: 1e3, omega: 5e4, ramp: 0.01, hold: 0.05}");
      assert_true(least_touching(e) < 6);
      const tal_row row = engine_row(e);
      assert_true(isfinite(row.kinetic));
      if (!(fabs(row.energy_residual) < residual[k] / (shorter * shorter)))
        fail_msg("%s: residual %g", scheme, row.energy_residual);
      engine_end(e);
    }
}

static void assert_warning(const engine *e, const char *fragment) {
  char text[200];
  tal_forced_warning(e->sim, text, sizeof text);
  if (*fragment ? !strstr(text, fragment) : *text)
    fail_msg("'%s' lacks '%s'", text, fragment);
}

// EXACT: the middle of a patch needs no warning; a grain of the rim and a rattler are turned, with one. A rattler turns
// nobody.
static void rim_and_rattler(void **state) {
  (void)state;
  engine *e = patch(4.1e-3, implicit_step, "{kind: spin, pressure: 1e4, omega: 3, ramp: 1e-3, hold: 0}");
  assert_warning(e, "");
  engine_end(e);
  e = patch(4.1e-3, implicit_step, "{kind: spin, grain: 0, pressure: 1e4, omega: 3, ramp: 1e-3, hold: 0}");
  engine_finish(e);
  assert_warning(e, "rim");
  engine_end(e);
  draft *d = draft_begin();
  fputs("grains: {thickness: 1, list: [", d->to);
  for (int k = 0; k < 6; k++)
    fprintf(d->to, "{x: %.17g, y: %.17g, r: 1}, ", 1.999 * cos(k * TAL_PI / 3), 1.999 * sin(k * TAL_PI / 3));
  fputs("{x: 0.1, y: 0, r: 0.5}]}\nmaterial: {young: 1e6, density: 1000, friction: 0.5, damping: 1e-3}\n"
        "contact: {vR: 1e-3}\nintegrator: {scheme: implicit_friction, dt: 1e-4}\n"
        "stages: [{kind: spin, grain: 6, pressure: 10, omega: 1, ramp: 0.01, hold: 0.1}]\n",
        d->to);
  e = engine_start(d);
  engine_finish(e);
  assert_warning(e, "rattler");
  assert_true(e->sim->grains.omega[6] == 1);
  for (int k = 0; k < 6; k++)
    assert_near(e->sim->grains.omega[k], 0, 1e-12, 1);
  engine_end(e);
}

static int64_t drawn(uint64_t seed, int64_t wanted, double margin, tal_status expected) {
  char more[200], stage[200];
  snprintf(more, sizeof more, "%sseed: %llu\n", implicit_step, (unsigned long long)seed);
  snprintf(stage, sizeof stage,
           "{kind: spin, pressure: 1e4, omega: 3, ramp: 1e-3, hold: 0, grain: {random: %lld, margin: %g}}",
           (long long)wanted, margin);
  engine *e = patch(9.1e-3, more, stage);
  int64_t *ids, sum = 0;
  size_t count;
  tal_error err;
  tal_status status = tal_forced_draw(e->sim, &e->scene.stages[0], &ids, &count, &err);
  assert_int_equal(status, expected);
  if (status) {
    assert_non_null(strstr(err.text, "stages[0].grain: only"));
  } else {
    assert_int_equal(count, wanted);
    for (size_t k = 0; k < count; k++) {
      assert_true(k == 0 || ids[k] > ids[k - 1]);
      sum = 31 * sum + ids[k];
    }
    free(ids);
  }
  engine_end(e);
  return sum;
}

// EXACT: grains are drawn without return, the same for the same seed, others for another, none nearer to the rim than
// asked; where there are too few the message says how many.
static void grains_are_drawn(void **state) {
  (void)state;
  assert_int_equal(drawn(1, 5, 1, TAL_OK), drawn(1, 5, 1, TAL_OK));
  assert_true(drawn(1, 5, 1, TAL_OK) != drawn(2, 5, 1, TAL_OK));
  drawn(1, 1, 3.4, TAL_OK);
  drawn(1, 20, 3.4, TAL_BAD_INPUT);
  drawn(1, 1, 10, TAL_BAD_INPUT);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(held_for_a_million_steps),
      cmocka_unit_test(contacts_open),
      cmocka_unit_test(rim_and_rattler),
      cmocka_unit_test(grains_are_drawn),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
