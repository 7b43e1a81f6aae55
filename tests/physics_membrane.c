// The membrane and the plates beside it: what it must carry (statics of a chain under pressure), the ledger, the same
// bits after a resume and for any number of threads, and what must stop a run.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "checkpoint.h"
#include "engine.h"
#include "forces.h"
#include "physics.h"
#include "small_run.h"

// Soft disks between plates, then compressed in a membrane; `more` closes the compress stage.
static draft *sample(const char *scheme, const char *more) {
  draft *d = draft_begin();
  fprintf(d->to,
          "seed: 5\ngrains: {count: 150, radius: {law: uniform, min: 0.5e-3, max: 1e-3}, thickness: 1.5e-3}\n"
          "material: {young: 1e8, density: 2675, friction: 0.4, damping: 1e-3}\nmass_scaling: 1e4\n"
          "contact: {exponent: 10, vR: 1e-3}\npack: {width: 16e-3}\ncontinuum: {refresh: 20}\n"
          "integrator: {scheme: %s, dt: 2e-5}\nstages:\n"
          "  - {kind: confine, pressure: 1e5, ramp: 0.05, tolerance: 0.1, unbalanced: 0.1, friction: 0.1}\n"
          "  - {kind: compress, boundary: membrane, rate: 0.2, strain: 0.02%s}\n",
          scheme, more);
  return d;
}

static engine *to_membrane(const char *scheme, const char *more) {
  engine *e = engine_start(sample(scheme, more));
  while (e->sim->run.stage < 1)
    engine_step(e);
  return e;
}

// ROUND: a chain at rest carries p h times its height into the sample, whatever its stiffness, prestress and beads:
// nothing else acts on it along x. Vertically the plates hold its ends.
static void carries_the_pressure(void **state) {
  (void)state;
  static const char *const kinds[] = {"", ", membrane: {stiffness: 3e3, radius: 1.2e-3}",
                                      ", membrane: {prestress: 0.3}",
                                      ", membrane: {stiffness: 1e5, damping: 0.5, mass: 1e-2}"};
  for (int k = 0; k < 4; k++) {
    engine *e = engine_start(sample("verlet", kinds[k]));
    while (!(e->sim->run.stage == 0 && e->sim->run.stage_done))
      engine_step(e);
    const tal_grains *g = &e->sim->grains;
    double height = tal_walls_plate(&e->sim->walls, -1)->y0 - tal_walls_plate(&e->sim->walls, +1)->y0;
    e->sim->run.pressure = 1e5;
    assert_true(tal_membrane_lay(e->sim, &e->scene.stages[1].membrane));
    tal_membrane *m = &e->sim->membrane;
    double sum[2] = {0, 0};
    for (size_t c = 0; c < m->contact_count; c++) {
      const tal_bead_contact *contact = &m->contact[c];
      sum[m->side[contact->bead] > 0] -= contact->fe * contact->nx;
      if (contact->overlap > 0) // the geometry is that of the centres
        assert_near(contact->overlap,
                    m->r[contact->bead] + g->r[contact->grain] -
                        hypot(m->x[contact->bead] - g->x[contact->grain], m->y[contact->bead] - g->y[contact->grain]),
                    1e-9, 1e-3);
    }
    const double expected = 1e5 * 1.5e-3 * height;
    assert_near(sum[0], expected, 5e-3, expected); // forces left over: 1e-4 of a link's, on some thirty links
    assert_near(sum[1], -expected, 5e-3, expected);
    double least = 1e9;
    for (size_t b = 0; b < m->count; b++)
      if (m->rest[b] > 0)
        least = fmin(least, m->tension[b]);
    assert_true(k != 2 || least > 0.25); // prestressed: nowhere slack
    engine_end(e);
  }
}

// ROUND: the boundary stress xx of a sample at rest in its membrane is the pressure, the ledger closes through laying,
// compression and taking away, no grain escapes; friction on the plates is what the key says.
static void compression(void **state) {
  (void)state;
  static const char *const schemes[] = {"verlet", "implicit_friction"};
  for (int k = 0; k < 2; k++) {
    draft *d = sample(schemes[k], k ? ", plate_friction: 0" : "");
    fputs("  - {kind: free, duration: 1e-3}\n", d->to);
    engine *e = engine_start(d);
    while (!(e->sim->run.stage == 1 && e->sim->run.stage_done))
      engine_step(e);
    tal_row row = engine_row(e);
    assert_near(row.axial_strain, 0.02, 1e-9, 1);
    assert_near(row.energy_residual, 0, 2e-3, 1);
    assert_true(row.sigma_xx_boundary > 0.8e5 && row.sigma_xx_boundary < 1.6e5 && row.sigma_yy > row.sigma_xx);
    assert_true(row.work_membrane > 0 && row.membrane_tension > 0);
    assert_true(k ? row.plate_top_shear == 0 && row.plate_bottom_shear == 0 : row.plate_top_shear != 0);
    engine_finish(e);
    tal_row after = engine_row(e);
    assert_int_equal(e->sim->membrane.count, 0);
    assert_near(after.energy_residual, 0, 2e-3, 1);
    assert_true(isnan(after.membrane_tension) && after.work_membrane < row.work_membrane);
    engine_end(e);
  }
}

// EXACT: through a checkpoint, and with 1, 2 and 3 threads.
static void same_bits(void **state) {
  (void)state;
  engine *e = to_membrane("implicit_friction", "");
  engine_steps(e, 37);
  char folder[TAL_PATH_SIZE], path[TAL_PATH_SIZE];
  const char *base = getenv("TMPDIR");
  snprintf(folder, sizeof folder, "%s/talus-bounds-XXXXXX", base && *base ? base : "/tmp");
  assert_non_null(mkdtemp(folder));
  tal_file_path(path, folder, "checkpoint.h5");
  tal_run_files files = {0};
  tal_error err = {""};
  char *text = tal_scene_text(&e->scene);
  tal_forces_expand(e->sim);
  assert_int_equal(tal_checkpoint_write(path, NULL, e->sim, text, &files, &err), TAL_OK);
  draft *d = draft_begin();
  fputs(text, d->to);
  engine *f = engine_start(d);
  if (tal_checkpoint_read(path, f->sim, text, &files, &err) != TAL_OK)
    fail_msg("%s", err.text);
  tal_sim_restored(f->sim);
  tal_run_files_clear(&files);
  free(text);
  nftw(folder, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
  engine_steps(e, 120);
  engine_steps(f, 120);
  assert_same_motion(e, f);
  assert_memory_equal(e->sim->membrane.x, f->sim->membrane.x, e->sim->membrane.count * sizeof(double));
  tal_row a = engine_row(e), b = engine_row(f);
  assert_memory_equal(&a, &b, sizeof a);
  engine_end(f);
  omp_set_num_threads(3);
  f = to_membrane("implicit_friction", "");
  engine_steps(f, 157);
  omp_set_num_threads(1);
  assert_same_motion(e, f);
  engine_end(f);
  engine_end(e);
}

static void assert_stops(engine *e, const char *reason) {
  tal_error err = {""};
  tal_status status = TAL_OK;
  while (status == TAL_OK && !tal_sim_done(e->sim))
    status = tal_sim_step(e->sim, &err);
  assert_int_equal(status, TAL_INVALID);
  if (!strstr(err.text, reason))
    fail_msg("\"%s\" in place of \"...%s...\"", err.text, reason);
  engine_end(e);
}

// EXACT: softer than the pressure can be held by; torn by a bead pulled away; crossed; a grain on the outside.
static void what_stops_a_run(void **state) {
  (void)state;
  assert_stops(engine_start(sample("verlet", ", membrane: {stiffness: 1}")), "membrane");
  engine *e = to_membrane("verlet", "");
  tal_membrane *m = &e->sim->membrane;
  for (size_t b = 5; b < m->count / 2; b++)
    m->y[b] += 3e-3;
  assert_stops(e, "the membrane is torn at");
  e = to_membrane("verlet", "");
  m = &e->sim->membrane;
  static const double loop_of_beads[3][2] = {{0.5e-3, 2e-3}, {-0.7e-3, 1.2e-3}, {1.2e-3, 1e-3}}; // 5-6 crosses 3-4
  for (size_t b = 0; b < 3; b++) {
    m->x[4 + b] = m->x[3] + loop_of_beads[b][0];
    m->y[4 + b] = m->y[3] + loop_of_beads[b][1];
  }
  assert_stops(e, "the membrane crosses itself at");
  e = to_membrane("verlet", "");
  const geo_loop *loop = &e->sim->graph.loop;
  size_t out = 0;
  for (size_t k = 0; k < loop->count; k++) // the grain furthest left
    if (e->sim->grains.x[loop->node[k]] < e->sim->grains.x[loop->node[out]])
      out = k;
  e->sim->grains.x[loop->node[out]] -= 6e-3;
  assert_stops(e, "escaped through the left membrane");
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(carries_the_pressure),
      cmocka_unit_test(compression),
      cmocka_unit_test(same_bits),
      cmocka_unit_test(what_stops_a_run),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
