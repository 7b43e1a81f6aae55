// Boundaries where it is hard to stay right: stopping and going on, threads, units, grains that leave, necks, large
// strains, cycles, samples too small.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "checkpoint.h"
#include "engine.h"
#include "forces.h"
#include "hard.h"
#include "physics.h"
#include "small_run.h"

// A packed sample of soft disks, confined roughly, then `stages`.
static engine *sample(int count, const char *shape, const char *integrator, const char *stages) {
  draft *d = draft_begin();
  fprintf(
      d->to,
      "seed: 5\ngrains: {count: %d, radius: {law: uniform, min: 0.5e-3, max: 1e-3}, thickness: 1.5e-3}\n"
      "material: {young: 1e8, density: 2675, friction: 0.4, damping: 1e-3}\nmass_scaling: 1e4\n"
      "contact: {exponent: 10, vR: 1e-3}\npack: {width: %g%s}\ncontinuum: {refresh: 20}\nintegrator: {%s}\nstages:\n"
      "  - {kind: confine, pressure: 1e5, ramp: 0.05, tolerance: 0.5, unbalanced: 1, friction: 0.1}\n%s",
      count, 1.35e-3 * sqrt(count), shape, integrator, stages);
  return engine_start(d);
}

#define IMPLICIT "scheme: implicit_friction, dt: 2e-5"
#define CIRCLE   ", cut: {shape: circle, radius: 8e-3}"

static void to_stage(engine *e, int stage) {
  while (e->sim->run.stage < stage)
    engine_step(e);
}

// ---- the same bits ----

// The sim as a checkpoint file keeps it, put into a new one.
static engine *through_a_file(engine *e) {
  char folder[TAL_PATH_SIZE], path[TAL_PATH_SIZE];
  const char *base = getenv("TMPDIR");
  snprintf(folder, sizeof folder, "%s/talus-bounds-XXXXXX", base && *base ? base : "/tmp");
  assert_non_null(mkdtemp(folder));
  tal_file_path(path, folder, "checkpoint.h5");
  tal_run_files files = {0};
  tal_error err = {""};
  char *text = tal_scene_text(&e->scene);
  tal_forces_expand(e->sim); // as a run does: which slots touch
  assert_int_equal(tal_checkpoint_write(path, NULL, e->sim, text, &files, &err), TAL_OK);
  draft *d = draft_begin();
  fputs(text, d->to);
  engine *other = engine_start(d);
  if (tal_checkpoint_read(path, other->sim, text, &files, &err) != TAL_OK)
    fail_msg("%s", err.text);
  tal_sim_restored(other->sim);
  tal_run_files_clear(&files);
  free(text);
  nftw(folder, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
  return other;
}

static const struct {
  const char *integrator, *stages;
} resumed[] = {
    {"dt: 2e-5", "  - {kind: compress, boundary: minimal, method: exact, rate: 0.2, strain: 2e-3}\n"},
    {"dt: 2e-5", "  - {kind: compress, boundary: minimal, method: penalty, rate: 0.2, strain: 2e-3}\n"},
    {IMPLICIT, "  - {kind: shear, order: 3, rate: -0.2, strain: 2e-3}\n"},
    {IMPLICIT, "  - {kind: deform, rates: {xx: 0.1, yy: -0.1}, order: 2, duration: 0.01}\n"},
};

// EXACT: written to a checkpoint at any step (a refresh just before, or not) and read back, the run goes on bit for
// bit.
static void resume(void **state) {
  (void)state;
  for (size_t k = 0; k < sizeof resumed / sizeof *resumed; k++) {
    engine *e = sample(150, "", resumed[k].integrator, resumed[k].stages);
    to_stage(e, 1);
    engine_steps(e, 13 + 7 * (int)k);
    engine *f = through_a_file(e);
    for (int part = 0; part < 2; part++) {
      engine_steps(e, 60);
      engine_steps(f, 60);
      assert_same_motion(e, f);
      tal_row a = engine_row(e), b = engine_row(f);
      assert_memory_equal(&a, &b, sizeof a);
    }
    engine_end(f);
    engine_end(e);
  }
}

// EXACT: 1, 2 and 3 threads.
static void threads(void **state) {
  (void)state;
  for (size_t k = 1; k < sizeof resumed / sizeof *resumed; k++) {
    engine *one = NULL;
    tal_row first = {0};
    for (int count = 1; count <= (hard_form() ? 3 : 2); count++) {
      omp_set_num_threads(count);
      engine *e = sample(1000, "", resumed[k].integrator, "  - {kind: shear, order: 2, rate: 0.2, strain: 6e-4}\n");
      to_stage(e, 1);
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
    engine_end(one);
    if (k == (hard_form() ? 2 : 1))
      break;
  }
}

// ---- grains that leave, necks, few grains ----

// Moves a grain away from the centre of the assembly and gives it a speed in that direction.
static void shoot(engine *e, int32_t i, double distance, double speed) {
  tal_grains *g = &e->sim->grains;
  double cx = 0, cy = 0;
  for (size_t k = 0; k < g->count; k++) {
    cx += g->x[k] / (double)g->count;
    cy += g->y[k] / (double)g->count;
  }
  double away = hypot(g->x[i] - cx, g->y[i] - cy), ux = (g->x[i] - cx) / away, uy = (g->y[i] - cy) / away;
  g->x[i] += distance * ux;
  g->y[i] += distance * uy;
  g->vx[i] = speed * ux;
  g->vy[i] = speed * uy;
}

// EXACT: a grain shot out through the loop is counted outside, the rest is held as before; with limits.outside: 0 the
// run stops and says so.
static void expelled_grain(void **state) {
  (void)state;
  for (int strict = 0; strict < 2; strict++) {
    engine *e = sample(200, CIRCLE, IMPLICIT, "  - {kind: shear, rate: 0.1, strain: 0.02}\n");
    e->scene.outside_limit = strict ? 0 : 0.05;
    to_stage(e, 1);
    tal_grains *g = &e->sim->grains;
    int32_t out = e->sim->graph.loop.node[3];
    shoot(e, out, 0, 4);
    tal_error err = {""};
    tal_status status = TAL_OK;
    while (status == TAL_OK && !tal_sim_done(e->sim))
      status = tal_sim_step(e->sim, &err);
    if (strict) {
      assert_int_equal(status, TAL_INVALID);
      assert_non_null(strstr(err.text, "1 of "));
      assert_non_null(strstr(err.text, "lie outside the loop"));
    } else {
      assert_int_equal(status, TAL_OK);
      tal_row row = engine_row(e);
      assert_true(row.outside >= 1 && g->bx[out] == 0 && g->by[out] == 0);
      assert_true(fabs(row.strain_rate_error_xy) < 1e-13);
    }
    engine_end(e);
  }
}

static bool is_outside(const engine *e, int32_t i) {
  return e->sim->graph.place[i] == TAL_PLACE_OUTSIDE;
}

// EXACT: a grain on its way back flies free of any force until a refresh finds it near enough; then it is counted
// outside no longer, carries its share of the boundary again, and the rows are met with it. At any order.
static void grain_that_returns(void **state) {
  (void)state;
  for (int order = 0; order < 4; order += 3) {
    char stage[120];
    snprintf(stage, sizeof stage, "  - {kind: shear, order: %d, rate: 0.1, strain: 0.02}\n", order);
    engine *e = sample(200, CIRCLE, IMPLICIT, stage);
    to_stage(e, 1);
    tal_grains *g = &e->sim->grains;
    int32_t out = e->sim->graph.loop.node[3];
    shoot(e, out, 3e-3, 0);
    while (!is_outside(e, out))
      engine_step(e);
    double most = engine_row(e).outside;
    assert_true(most >= 1);
    shoot(e, out, 0, -0.05); // slower than what the pressure stops on the way out again
    engine_step(e);          // what is left of the last forces on it
    double vx = g->vx[out], vy = g->vy[out];
    int flown = 0;
    for (engine_step(e); is_outside(e, out); engine_step(e), flown++)
      assert_true(g->vx[out] == vx && g->vy[out] == vy && g->bx[out] == 0 && g->by[out] == 0);
    assert_true(flown > 20); // longer than from one refresh to the next
    assert_true(engine_row(e).outside == most - 1);
    engine_step(e); // the first one with forces of the new loop
    assert_true(hypot(g->bx[out], g->by[out]) > 0);
    engine_finish(e);
    tal_row row = engine_row(e);
    assert_true(row.outside == 0 && !is_outside(e, out));
    assert_true(fabs(row.strain_rate_error_xy) < 1e-13);
    assert_near(row.shear_strain, 0.02, 1e-12, 1);
    engine_end(e);
  }
}

// EXACT: two clumps joined by one grain: the loop goes round both through the neck, the rows are met, nothing crashes.
static void neck(void **state) {
  (void)state;
  draft *d = draft_begin();
  fputs("grains:\n  thickness: 1\n  list:\n", d->to);
  for (int side = -1; side <= 1; side += 2)
    for (int k = 0; k < 16; k++)
      fprintf(d->to, "  - {x: %.17g, y: %.17g, r: 1}\n", side * (3.5 + 1.9 * (k % 4)), 1.9 * (k / 4 - 1.5));
  fputs("  - {x: 0, y: 0.1, r: 1}\n  - {x: -1.75, y: -0.2, r: 1}\n  - {x: 1.75, y: -0.2, r: 1}\n"
        "material: {young: 1e5, density: 1, friction: 0.2, damping: 1e-3}\ncontact: {vR: 0.1}\n"
        "continuum: {refresh: 5, peel: 0.2}\nintegrator: {dt: 1e-4}\n"
        "stages: [{kind: shear, pressure: 300, rate: 0.5, strain: 0.05, order: 3}]\n",
        d->to);
  engine *e = engine_start(d);
  bool at_neck = false;
  while (!tal_sim_done(e->sim)) {
    engine_step(e);
    tal_row row = engine_row(e);
    assert_true(fabs(row.strain_rate_error_xy) < 1e-12);
    for (size_t k = 0; k < e->sim->graph.loop.count; k++) // the grain in the middle: reached from one side at least
      at_neck = at_neck || e->sim->graph.loop.node[k] == 32;
    assert_int_equal(e->sim->graph.loop.outside_count, 0);
  }
  assert_true(at_neck);
  engine_end(e);
  hard_report(&(hard_row){"a loop that pinches at a neck", "two clumps joined by one grain, sheared by 5 %",
                          "one simple loop round both; strain rate as imposed", "to 1e-12 1/s, at every step",
                          "none found", "-"});
}

static tal_status outcome(const char *text, tal_error *err) {
  draft *d = draft_begin();
  fputs(text, d->to);
  tal_scene scene;
  tal_sim *sim;
  draft_load(d, &scene);
  tal_status status = tal_sim_create(&sim, &scene, err);
  while (status == TAL_OK && !tal_sim_done(sim))
    status = tal_sim_step(sim, err);
  tal_sim_free(sim);
  tal_scene_clear(&scene);
  return status;
}

// EXACT: one grain, two grains, grains in a row have no loop, a loop of fixed grains cannot move: stopped with the
// reason. Three grains are enough, at any order.
static void few_grains(void **state) {
  (void)state;
#define FEW                                                                                                            \
  "material: {young: 1e5, density: 1}\nintegrator: {dt: 1e-4}\n"                                                       \
  "stages: [{kind: deform, pressure: 100, duration: 0.01, rates: {yy: -0.1}, order: 3}]\n"
  tal_error err = {""};
  assert_int_equal(outcome(FEW "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1}]}\n", &err), TAL_INVALID);
  assert_non_null(strstr(err.text, "no Delaunay graph"));
  assert_int_equal(outcome(FEW "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1}, {x: 1.9, y: 0, r: 1}]}\n", &err),
                   TAL_INVALID);
  assert_int_equal(outcome(FEW "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1}, {x: 1.9, y: 0, r: 1}, "
                               "{x: 3.8, y: 0, r: 1}]}\n",
                           &err),
                   TAL_INVALID);
  assert_int_equal(outcome(FEW "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1}, {x: 9, y: 0, r: 1}, "
                               "{x: 0, y: 9, r: 1}]}\n",
                           &err),
                   TAL_INVALID);
  assert_non_null(strstr(err.text, "no assembly is left"));
  assert_int_equal(outcome(FEW "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1, fixed: true}, "
                               "{x: 1.95, y: 0, r: 1, fixed: true}, {x: 1, y: 1.7, r: 1, fixed: true}]}\n",
                           &err),
                   TAL_INVALID);
  assert_non_null(strstr(err.text, "cannot be imposed"));
  assert_int_equal(outcome(FEW "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1}, {x: 1.95, y: 0, r: 1}, "
                               "{x: 1, y: 1.7, r: 1}]}\n",
                           &err),
                   TAL_OK);
}

// ---- far and often ----

// ROUND: 40 % of compression and 40 % of shear of a small sample: as imposed to the last digits, the ledger closes.
static void large_strain(void **state) {
  (void)state;
  const int more = (int)hard_size(1, 4, 16);
  engine *e =
      sample(180 * more, "", IMPLICIT, "  - {kind: compress, boundary: minimal, rate: 1, strain: 0.4, order: 1}\n");
  engine_finish(e);
  tal_row row = engine_row(e);
  assert_near(row.axial_strain, 0.4, 1e-11, 1);
  assert_near(row.energy_residual, 0, 5e-3, 1);
  assert_true(row.solid_fraction > 0.6 && row.solid_fraction < 0.95 && row.sigma_yy > row.sigma_xx);
  const double ledger = row.energy_residual;
  engine_end(e);
  e = sample(220, CIRCLE, IMPLICIT, "  - {kind: shear, rate: 1, strain: 0.4}\n");
  engine_finish(e);
  row = engine_row(e);
  assert_near(row.shear_strain, 0.4, 1e-11, 1);
  assert_near(row.energy_residual, 0, 5e-3, 1);
  assert_true(row.solid_fraction > 0.6 && row.solid_fraction < 0.95 && row.multiplier_xy < 0);
  engine_end(e);
  hard_report(&(hard_row){"40 % strain", hard_text("compression of %d grains, shear of 220", 180 * more),
                          "strain as imposed; ledger closes; solid fraction stays one of a packing",
                          hard_text("to 1e-11; residual %.0e, %.0e", ledger, row.energy_residual), "none found", "-"});
}

// ROUND: ten cycles of shear of +-1 %: back to no strain, work put in every time, the ledger closes.
static void ten_cycles(void **state) {
  (void)state;
  char stages[4000] = "";
  size_t used = 0;
  for (int k = 0; k < 10; k++)
    used += (size_t)snprintf(stages + used, sizeof stages - used,
                             "  - {kind: shear, rate: 1, strain: 0.01, order: 1}\n"
                             "  - {kind: shear, rate: -1, strain: 0.02, order: 1}\n"
                             "  - {kind: shear, rate: 1, strain: 0.01, order: 1}\n");
  engine *e = sample(160, CIRCLE, IMPLICIT, stages);
  double work = 0, residual = 0;
  for (int cycle = 1; cycle <= 10; cycle++) {
    while (!tal_sim_done(e->sim) && !(e->sim->run.stage == 3 * cycle && e->sim->run.stage_done))
      engine_step(e);
    tal_row row = engine_row(e);
    assert_near(row.shear_strain, 0, 1e-12, 1);
    assert_true(row.work_minimal > work);
    work = row.work_minimal;
    assert_near(row.energy_residual, 0, 5e-3, 1);
    residual = fmax(residual, fabs(row.energy_residual));
  }
  engine_end(e);
  hard_report(&(hard_row){"shear reversal, a packed sample", "ten cycles of +-1 %, 160 grains",
                          "back to no strain; work is put in every time; ledger closes",
                          hard_text("strain to 1e-12; residual %.0e", residual), "none found", "-"});
}

// EXACT: plates after minimal conditions take over the strain so far; minimal after plates goes on from theirs. Plates
// that go leave a ledger that closes.
static void plates_and_back(void **state) {
  (void)state;
  engine *e = sample(150, "", IMPLICIT,
                     "  - {kind: compress, rate: 0.5, strain: 0.01}\n"
                     "  - {kind: compress, boundary: minimal, rate: 0.5, strain: 0.01}\n"
                     "  - {kind: compress, rate: 0.5, strain: 0.01}\n  - {kind: free, duration: 1e-3}\n");
  for (int stage = 1; stage <= 3; stage++) {
    while (!(e->sim->run.stage == stage && e->sim->run.stage_done))
      engine_step(e);
    tal_row row = engine_row(e);
    assert_near(row.axial_strain, 0.01 * stage, 1e-9, 1);
    assert_near(row.energy_residual, 0, 5e-3, 1);
    assert_true(isnan(row.plate_top) == (stage == 2) && isnan(row.multiplier_yy) == (stage != 2));
  }
  engine_finish(e);
  engine_end(e);
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(resume),
      cmocka_unit_test(threads),
      cmocka_unit_test(expelled_grain),
      cmocka_unit_test(grain_that_returns),
      cmocka_unit_test(neck),
      cmocka_unit_test(few_grains),
      cmocka_unit_test(large_strain),
      cmocka_unit_test(ten_cycles),
      cmocka_unit_test(plates_and_back),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
