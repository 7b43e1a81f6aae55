// What a run is asked to do: stages and the times of the series, free flight, listed grains, and runs that go bad.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "checkpoint.h"
#include "engine.h"
#include "inspect.h"
#include "run.h"
#include "small_run.h"
#include "step.h"
#include <float.h>
#include <omp.h>

// One grain on its way; stages and output follow.
#define FLIGHT                                                                                                         \
  "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1, vx: 1}]}\nmaterial: {young: 1e6, density: 1}\n"                    \
  "integrator: {dt: 1e-3}\n"

static engine *start(const char *text) {
  draft *d = draft_begin();
  fputs(text, d->to);
  return engine_start(d);
}

// ---- stages ----

// EXACT: the plates of a confinement that rests under stresses that differ are smooth for a window, in every contact
// from the very next step on, and rough again after it.
static void smooth_for_a_window(void **state) {
  (void)state;
  static const char *const schemes[] = {"verlet", "implicit_friction"};
  for (int s = 0; s < 2; s++) {
    draft *d = draft_begin();
    fprintf(d->to,
            "grains: {count: 16, radius: {law: uniform, min: 0.5e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
            "material: {young: 30e9, density: 2675, friction: 0.45, damping: 0.002}\nmass_scaling: 1e5\n"
            "contact: {vR: 1e-4}\npack: {method: drop_and_roll, width: 6e-3}\n"
            "integrator: {scheme: %s, dt: 1e-5}\nstages: [{kind: confine, pressure: 100e3, ramp: 1e-3, "
            "friction: 0.1, tolerance: 0.9, unbalanced: 100}]\n",
            schemes[s]);
    engine *e = engine_start(d);
    int smooth = 0, rough = 0;
    for (int64_t released = 0; !tal_sim_done(e->sim); released = e->sim->run.released) {
      engine_step(e);
      const tal_contacts *slots = &e->sim->wall_contacts;
      for (size_t c = 0; c < slots->count; c++) {
        const bool slides = slots->friction[c] == 0 && slots->ft[c] == 0;
        assert_true(released ? slides : slots->friction[c] == 0.1);
        *(released ? &smooth : &rough) += slots->overlap[c] > 0;
      }
    }
    assert_true(smooth > 10 && rough > 100);
    engine_end(e);
  }
}

// EXACT: a free stage takes round(duration/dt) steps, and its time is the start plus that many steps.
static void number_of_steps(void **state) {
  (void)state;
  static const struct {
    double duration, dt;
    int64_t steps;
  } cases[] = {{1e-2, 1e-4, 100}, {0.3, 0.1, 3},   {12.4e-3, 1e-3, 12}, {12.6e-3, 1e-3, 13}, {0.7, 0.1, 7},
               {1e-3, 1e-3, 1},   {6e-4, 1e-3, 1}, {1, 1.0 / 3, 3},     {4e-4, 1e-3, 0}};
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
    draft *d = draft_begin();
    fprintf(d->to,
            "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1, vx: 1}]}\nmaterial: {young: 1, density: 1}\n"
            "integrator: {dt: %.17g}\nstages: [{kind: free, duration: %.17g}]\n",
            cases[k].dt, cases[k].duration);
    engine *e = engine_start(d);
    engine_finish(e);
    assert_int_equal(e->sim->run.step, cases[k].steps);
    assert_true(e->sim->run.time == (double)cases[k].steps * cases[k].dt);
    engine_end(e);
  }
}

// EXACT: stages one after the other, each with its own step; empty ones are passed over wherever they stand.
static void stage_after_stage(void **state) {
  (void)state;
  engine *e = start(FLIGHT "stages: [{kind: free, duration: 1e-9}, {kind: free, duration: 0.01}, "
                           "{kind: free, duration: 1e-9}, {kind: free, duration: 1e-9}, "
                           "{kind: free, duration: 0.01, integrator: {dt: 2.5e-4}}, {kind: free, duration: 1e-9}]\n");
  assert_int_equal(e->sim->run.step, 0);
  int64_t in_stage[6] = {0};
  double last = 0;
  while (!tal_sim_done(e->sim)) {
    int64_t before = e->sim->run.step;
    engine_step(e);
    if (e->sim->run.step == before)
      continue;
    in_stage[e->sim->run.stage]++;
    assert_true(e->sim->run.time > last);
    last = e->sim->run.time;
  }
  static const int64_t expected[6] = {0, 10, 0, 0, 40, 0};
  assert_memory_equal(in_stage, expected, sizeof expected);
  assert_true(last == 10 * 1e-3 + 40 * 2.5e-4);
  assert_int_equal(e->sim->run.stage, 5);
  assert_true(fabs(e->sim->grains.x[0] - 0.02) < 1e-16);
  tal_error err;
  assert_int_equal(tal_sim_step(e->sim, &err), TAL_OK); // done: nothing happens
  assert_int_equal(e->sim->run.step, 50);
  engine_end(e);
}

// ---- the series of a whole run ----

typedef struct folder {
  char path[TAL_PATH_SIZE], scene[TAL_PATH_SIZE], dir[TAL_PATH_SIZE];
} folder;

static folder folder_create(const char *text) {
  folder f;
  const char *base = getenv("TMPDIR");
  snprintf(f.path, sizeof f.path, "%s/talus-stages-XXXXXX", base && *base ? base : "/tmp");
  assert_non_null(mkdtemp(f.path));
  tal_file_path(f.scene, f.path, "scene.yaml");
  tal_file_path(f.dir, f.path, "run");
  overwrite(f.scene, text, strlen(text));
  return f;
}

static void folder_remove(folder *f) {
  nftw(f->path, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
}

static tal_status run(const folder *f, bool resume, tal_run_result *result, tal_error *err) {
  tal_scene scene;
  tal_scene_errors errors = {0};
  if (tal_scene_load(&scene, f->scene, NULL, 0, &errors) != TAL_OK)
    fail_msg("%s", errors.item[0].text);
  tal_run_options options = {.dir = f->dir, .threads = 1, .resume = resume, .quiet = true};
  tal_status status = tal_run_scene(&scene, &options, result, err);
  tal_scene_clear(&scene);
  return status;
}

// Steps of the rows of series.csv in order, times checked to ascend; returns their number.
static int series_steps(const folder *f, int64_t *steps, int capacity) {
  char path[TAL_PATH_SIZE], line[8192];
  tal_file_path(path, f->dir, "series.csv");
  FILE *file = fopen(path, "r");
  assert_non_null(file);
  assert_non_null(fgets(line, sizeof line, file));
  int count = 0;
  double last = -1;
  for (; fgets(line, sizeof line, file); count++) {
    double time;
    long long step;
    assert_int_equal(sscanf(line, "%lf,%lld", &time, &step), 2);
    assert_true(time > last && count < capacity);
    last = time;
    steps[count] = step;
  }
  fclose(file);
  return count;
}

static void assert_steps(const char *rest, const int64_t *expected, int count) {
  char text[1000];
  int64_t steps[200];
  snprintf(text, sizeof text, "%s%s", FLIGHT, rest);
  folder f = folder_create(text);
  tal_run_result result;
  tal_error err;
  assert_int_equal(run(&f, false, &result, &err), TAL_OK);
  assert_int_equal(series_steps(&f, steps, 200), count);
  for (int k = 0; k < count; k++)
    assert_int_equal(steps[k], expected[k]);
  assert_int_equal(run(&f, true, &result, &err), TAL_OK);
  assert_true(result.already_done);
  folder_remove(&f);
}

// EXACT: rows at the start, every whole number of steps nearest to series_every from the start of each stage, at the
// end of each stage; every step where series_every is at or below dt; no time twice.
static void rows_of_the_series(void **state) {
  (void)state;
#define ROWS(rest, ...)                                                                                                \
  assert_steps(rest, (const int64_t[]){__VA_ARGS__}, sizeof((const int64_t[]){__VA_ARGS__}) / sizeof(int64_t))
  ROWS("stages: [{kind: free, duration: 5e-3}]\noutput: {series_every: 1e-3}\n", 0, 1, 2, 3, 4, 5);
  ROWS("stages: [{kind: free, duration: 5e-3}]\noutput: {series_every: 0}\n", 0, 1, 2, 3, 4, 5);
  ROWS("stages: [{kind: free, duration: 5e-3}]\noutput: {series_every: 1e-9}\n", 0, 1, 2, 3, 4, 5);
  ROWS("stages: [{kind: free, duration: 7e-3}]\noutput: {series_every: 2.6e-3}\n", 0, 3, 6, 7);
  ROWS("stages: [{kind: free, duration: 7e-3}]\noutput: {series_every: .inf}\n", 0, 7);
  ROWS("stages: [{kind: free, duration: 5e-3}, {kind: free, duration: 5e-3}]\noutput: {series_every: 3e-3}\n", 0, 3, 5,
       8, 10);
  ROWS("stages: [{kind: free, duration: 2e-3}, {kind: free, duration: 1e-3, integrator: {dt: 2.5e-4}}]\n"
       "output: {series_every: 5e-4, fields_every: 1e-3}\n",
       0, 1, 2, 4, 6);
  ROWS("stages: [{kind: free, duration: 1e-9}, {kind: free, duration: 2e-3}, {kind: free, duration: 1e-9}]\n"
       "output: {series_every: 1e-3}\n",
       0, 1, 2);
  ROWS("stages: [{kind: free, duration: 1e-9}]\n", 0);
  ROWS("stages: []\n", 0);
#undef ROWS
}

// ---- free flight and listed grains ----

// ROUND: under a constant force velocity Verlet is exact: a throw to k eps after k steps; spin and fixed grains
// likewise. Mass has no say in it, mass_scaling neither.
static void ballistic_flight(void **state) {
  (void)state;
  engine *e = start("grains: {thickness: 1, list: [{x: 1, y: 2, r: 0.1, vx: 3, vy: 4, omega: 5}, "
                    "{x: -1, y: 2, r: 0.1, vx: -3, vy: 4, omega: -5, mass: 7, inertia: 11}, "
                    "{x: 1, y: -20, r: 0.1, vx: 2, vy: -1, omega: 3, fixed: true}]}\n"
                    "material: {young: 1e6, density: 1}\nmass_scaling: 100\ngravity: [0.5, -9.81]\n"
                    "integrator: {dt: 1e-3}\nstages: [{kind: free, duration: 1}]\n");
  const tal_grains *g = &e->sim->grains;
  static const double start_x[] = {1, -1}, start_vx[] = {3, -3}, spin[] = {5, -5};
  for (int k = 1; !tal_sim_done(e->sim); k++) {
    engine_step(e);
    double t = e->sim->run.time, eps = 40 * k * DBL_EPSILON; // 10: size of the numbers, 4 operations a step
    for (int i = 0; i < 2; i++) {
      assert_true(fabs(g->x[i] - (start_x[i] + start_vx[i] * t + 0.25 * t * t)) < eps);
      assert_true(fabs(g->y[i] - (2 + 4 * t - 0.5 * 9.81 * t * t)) < eps);
      assert_true(fabs(g->vx[i] - (start_vx[i] + 0.5 * t)) < eps && fabs(g->vy[i] - (4 - 9.81 * t)) < eps);
      assert_true(g->omega[i] == spin[i] && fabs(g->theta[i] - spin[i] * t) < eps);
    }
    assert_true(g->vx[2] == 2 && g->vy[2] == -1 && g->omega[2] == 3 && fabs(g->x[2] - 1 - 2 * t) < eps);
  }
  assert_true(g->mass[0] == 100 * TAL_PI * 0.1 * 0.1 && g->mass[1] == 7 && g->inertia[1] == 11);
  engine_end(e);
}

// ROUND: two grains in a linear contact: the acceleration is the force over the grain's own mass, the turning the
// torque over its own inertia; with rotation: false the spins stay to the bit, though friction acts.
static void own_mass_and_inertia(void **state) {
  (void)state;
  for (int held = 0; held < 2; held++) {
    draft *d = draft_begin();
    fprintf(d->to,
            "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1, mass: 2, inertia: 5, omega: 1}, "
            "{x: 1.9, y: 0, r: 1, vy: 3, mass: 8, inertia: 0.5, omega: -2}]}\n"
            "contact: {normal: linear, stiffness: 100, tangential: regularised, vR: 1, exponent: 1}\n"
            "material: {friction: 0.1}\nrotation: %s\nintegrator: {dt: 1e-4}\nstages: [{kind: free, duration: 0.01}]\n",
            held ? "false" : "true");
    engine *e = engine_start(d);
    const tal_grains *g = &e->sim->grains;
    // slip of 0 against 1 along t = (0, -1): the contact's normal into 0 is (-1, 0)
    double overlap = 2 - 1.9, fn = 100 * overlap, arm = 1 - overlap / 2;
    double slip = (0 - 3) * -1 - arm * 1 - arm * -2, ft = -0.1 * fn * slip;
    double fx[] = {-fn, fn}, fy[] = {-ft, ft}, torque = -arm * ft, k = 16 * DBL_EPSILON * fn;
    for (int i = 0; i < 2; i++)
      assert_true(fabs(g->fx[i] - fx[i]) < k && fabs(g->fy[i] - fy[i]) < k && fabs(g->torque[i] - torque) < k);
    engine_step(e);
    double dt = 1e-4, mass[] = {2, 8}, inertia[] = {5, 0.5}, spin[] = {1, -2}, place[] = {0, 1.9};
    for (int i = 0; i < 2; i++) {
      assert_true(fabs(g->x[i] - (place[i] + 0.5 * dt * dt * fx[i] / mass[i])) < 4 * DBL_EPSILON);
      double turn = held ? 0 : 0.5 * dt * dt * torque / inertia[i];
      assert_true(fabs(g->theta[i] - (dt * spin[i] + turn)) < 4 * DBL_EPSILON);
    }
    engine_finish(e);
    assert_true((g->omega[0] == 1 && g->omega[1] == -2) == (held == 1));
    engine_end(e);
  }
}

// ---- runs gone bad ----

// Three grains in a row, squeezed by a wall until something gives.
#define PRESS                                                                                                          \
  "grains: {thickness: 1, list: [{x: 1, y: 1, r: 1}, {x: 3, y: 1, r: 1}, {x: 5, y: 1, r: 1}]}\n"                       \
  "walls: [{from: [0, -9], to: [0, 9]}, {from: [6.5, -9], to: [6.5, 9], velocity: [-1, 0]}]\n"

// The checkpoint holds a state from before anything went wrong.
static void assert_good_checkpoint(const folder *f, const char *path) {
  tal_scene scene;
  tal_scene_errors errors = {0};
  tal_sim *sim;
  tal_error err = {""};
  tal_run_files files;
  assert_int_equal(tal_scene_load(&scene, f->scene, NULL, 0, &errors), TAL_OK);
  assert_int_equal(tal_sim_create(&sim, &scene, &err), TAL_OK);
  char *text = tal_scene_text(&scene);
  assert_int_equal(tal_checkpoint_read(path, sim, text, &files, &err), TAL_OK);
  tal_sim_restored(sim);
  assert_int_equal(tal_inspect(sim, &err), TAL_OK);
  assert_true(sim->run.step > 0 && !tal_sim_done(sim));
  free(text);
  tal_run_files_clear(&files);
  tal_sim_free(sim);
  tal_scene_clear(&scene);
}

static void assert_invalid(const char *text, const char *reason) {
  folder f = folder_create(text);
  char path[TAL_PATH_SIZE];
  tal_run_result result;
  tal_error err = {""}, again = {""};
  assert_int_equal(run(&f, false, &result, &err), TAL_INVALID);
  if (!strstr(err.text, reason))
    fail_msg("\"%s\" in place of \"...%s...\"", err.text, reason);
  size_t size, size_again;
  tal_file_path(path, f.dir, "run.json");
  unsigned char *report = contents(path, &size);
  assert_true(memmem(report, size, "\"invalid\"", 9) && memmem(report, size, reason, strlen(reason)));
  free(report);
  // The last checkpoint is whole; going on from it ends in the same way and leaves it alone.
  assert_true(result.checkpoint);
  tal_file_path(path, f.dir, "checkpoint.h5");
  assert_good_checkpoint(&f, path);
  unsigned char *before = contents(path, &size);
  assert_int_equal(run(&f, true, &result, &again), TAL_INVALID);
  assert_string_equal(again.text, err.text);
  unsigned char *after = contents(path, &size_again);
  assert_true(size == size_again && memcmp(before, after, size) == 0);
  free(before);
  free(after);
  folder_remove(&f);
}

// EXACT: an overlap beyond the limit, a step above the critical one, numbers that are none: the reason is given, the
// last good checkpoint stays.
static void invalid_runs(void **state) {
  (void)state;
  assert_invalid(PRESS "contact: {normal: linear, stiffness: 1e4, damping: 10, vR: 1e-3}\n"
                       "material: {density: 1, friction: 0.3}\nintegrator: {dt: 1e-3}\nlimits: {overlap: 0.2}\n"
                       "stages: [{kind: free, duration: 9}]\noutput: {checkpoint_every: 0.1, series_every: 0.1}\n",
                 "(limits.overlap: 0.2)");
  assert_invalid(PRESS "material: {young: 3e4, density: 1}\nintegrator: {dt: 2e-3}\nlimits: {overlap: 1}\n"
                       "mass_scaling: 1e-2\n"
                       "stages: [{kind: free, duration: 9}]\noutput: {checkpoint_every: 0.1, series_every: 0.1}\n",
                 "is above the critical step");
  assert_invalid(FLIGHT
                 "gravity: [1e150, 0]\nlimits: {stride: .inf, world: .inf}\nstages: [{kind: free, duration: 9}]\n"
                 "output: {checkpoint_every: 0.1, series_every: 0.1}\n",
                 "no finite position or velocity");
}

static void assert_refused(const char *text, tal_status expected, const char *reason) {
  draft *d = draft_begin();
  fputs(text, d->to);
  tal_scene scene;
  draft_load(d, &scene);
  tal_sim *sim;
  tal_error err = {""};
  assert_int_equal(tal_sim_create(&sim, &scene, &err), expected);
  assert_null(sim);
  if (!strstr(err.text, reason))
    fail_msg("\"%s\" in place of \"...%s...\"", err.text, reason);
  tal_scene_clear(&scene);
}

// EXACT: what the scene alone proves is bad input; what the packing shows is an invalid run; force: true runs.
static void refused_at_the_start(void **state) {
  (void)state;
#define TOUCHING                                                                                                       \
  "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1}, {x: 1.5, y: 0, r: 1}]}\nmaterial: {density: 1, young: 1e6}\n"
  assert_refused(TOUCHING "contact: {normal: linear, stiffness: 1e4}\nintegrator: {dt: 1}\n"
                          "stages: [{kind: free, duration: 9}]\n",
                 TAL_BAD_INPUT, "integrator.dt: 1 s is above the critical step");
  assert_refused(TOUCHING "integrator: {dt: 1}\nstages: [{kind: free, duration: 9}]\n", TAL_INVALID,
                 "is above the critical step");
  assert_refused(TOUCHING "limits: {overlap: 0.4}\nintegrator: {dt: 1e-5}\nstages: [{kind: free, duration: 9}]\n",
                 TAL_INVALID, "(limits.overlap: 0.4)");
  engine_end(start(TOUCHING "integrator: {dt: 1, force: true}\nstages: [{kind: free, duration: 9}]\n"));
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(number_of_steps),      cmocka_unit_test(stage_after_stage),
      cmocka_unit_test(rows_of_the_series),   cmocka_unit_test(ballistic_flight),
      cmocka_unit_test(own_mass_and_inertia), cmocka_unit_test(invalid_runs),
      cmocka_unit_test(refused_at_the_start), cmocka_unit_test(smooth_for_a_window),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
