// Stopping and going on: a run that was interrupted or killed at any moment and resumed leaves the same files, byte for
// byte, as one that was not.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "checkpoint.h"
#include "engine.h"
#include "run.h"
#include "small_run.h"
#include <dirent.h>
#include <omp.h>
#include <pthread.h>
#include <signal.h>

// ---- a folder with a scene file and runs beside it ----

typedef struct place {
  char folder[TAL_PATH_SIZE], scene[TAL_PATH_SIZE];
} place;

static place place_create(const char *text) {
  place p;
  const char *base = getenv("TMPDIR");
  snprintf(p.folder, sizeof p.folder, "%s/talus-resume-XXXXXX", base && *base ? base : "/tmp");
  assert_non_null(mkdtemp(p.folder));
  tal_file_path(p.scene, p.folder, "scene.yaml");
  overwrite(p.scene, text, strlen(text));
  return p;
}

static void place_remove(place *p) {
  nftw(p->folder, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
}

static off_t size_of(const char *folder, const char *name) {
  char path[TAL_PATH_SIZE];
  struct stat info;
  tal_file_path(path, folder, name);
  return stat(path, &info) == 0 ? info.st_size : -1;
}

// ---- runs in a process of their own ----

typedef struct stopper {
  const char *dir;
  off_t bytes;
  int signal;
} stopper;

// Sends the signal as soon as series.csv is that long.
static void *stop_later(void *argument) {
  const stopper *s = argument;
  while (size_of(s->dir, "series.csv") < s->bytes)
    usleep(100);
  kill(getpid(), s->signal);
  return NULL;
}

static pid_t run_begin(const place *p, const char *dir, int threads, bool resume, const stopper *stop) {
  fflush(NULL);
  pid_t child = fork();
  if (child != 0)
    return child;
  tal_scene scene;
  tal_scene_errors errors;
  if (tal_scene_load(&scene, p->scene, NULL, 0, &errors) != TAL_OK)
    _exit(99);
  pthread_t thread;
  if (stop)
    pthread_create(&thread, NULL, stop_later, (void *)(uintptr_t)stop);
  tal_run_options options = {.dir = dir, .threads = threads, .resume = resume, .quiet = true};
  tal_run_result result;
  tal_error err = {""};
  tal_status status = tal_run_scene(&scene, &options, &result, &err);
  if (status != TAL_OK && status != TAL_INTERRUPTED)
    fprintf(stderr, "run: %s\n", err.text);
  _exit((int)status);
}

static int run(const place *p, const char *dir, int threads, bool resume, const stopper *stop) {
  return wait_for(run_begin(p, dir, threads, resume, stop));
}

static void assert_same_runs(const char *a, const char *b) {
  static const char *const names[] = {"series.csv", "tracks.csv", "checkpoint.h5", "fields.h5", "fields.xdmf"};
  char of_a[TAL_PATH_SIZE], of_b[TAL_PATH_SIZE], frames_a[TAL_PATH_SIZE], frames_b[TAL_PATH_SIZE];
  for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
    tal_file_path(of_a, a, names[k]);
    tal_file_path(of_b, b, names[k]);
    assert_same_files(of_a, of_b);
  }
  tal_file_path(frames_a, a, "fields");
  tal_file_path(frames_b, b, "fields");
  int frames[2] = {0, 0};
  for (int k = 0; k < 2; k++) {
    DIR *folder = opendir(k ? frames_b : frames_a);
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder));) {
      if (entry->d_name[0] == '.')
        continue;
      frames[k]++;
      tal_file_path(of_a, frames_a, entry->d_name);
      tal_file_path(of_b, frames_b, entry->d_name);
      assert_same_files(of_a, of_b);
    }
    closedir(folder);
  }
  assert_true(frames[0] == frames[1] && frames[0] > 4);
}

// ---- scenes ----

// %d grains, %g m wide, %s: tangential law, %g: ramp, %g: strain.
static const char biaxial[] =
    "grains: {count: %d, radius: {law: uniform, min: 0.5e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
    "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\nmass_scaling: 1e5\n"
    "contact: {tangential: %s}\npack: {method: drop_and_roll, width: %g}\ncontinuum: {refresh: 70}\n"
    "integrator: {dt: 1e-5}\n"
    "stages:\n  - {kind: confine, pressure: 100e3, ramp: %g, friction: 0.1, tolerance: 0.9, unbalanced: 100, "
    "integrator: {dt: 1.25e-5}}\n"
    "  - {kind: compress, rate: 0.1, strain: %g}\n"
    "output: {series_every: 2e-4, fields_every: 4e-3, checkpoint_every: 3e-3, tracks: [3, 5]}\n";

// Runs the scene whole on one thread, and again interrupted at the given shares of its series, each time by another
// signal and on another number of threads.
static void compare_interrupted(const char *text, const double *shares, int count) {
  static const int signals[] = {SIGUSR1, SIGTERM, SIGINT}, threads[] = {2, 1, 2};
  char whole[TAL_PATH_SIZE], parts[TAL_PATH_SIZE];
  place p = place_create(text);
  tal_file_path(whole, p.folder, "whole");
  tal_file_path(parts, p.folder, "parts");
  assert_int_equal(run(&p, whole, 1, false, NULL), TAL_OK);
  off_t bytes = size_of(whole, "series.csv");
  for (int k = 0; k < count; k++) {
    stopper stop = {parts, (off_t)(shares[k] * (double)bytes), signals[k]};
    assert_int_equal(run(&p, parts, threads[k], k > 0, &stop), TAL_INTERRUPTED);
    assert_true(size_of(parts, "series.csv") < bytes);
  }
  assert_int_equal(run(&p, parts, 1, true, NULL), TAL_OK);
  assert_same_runs(whole, parts);
  assert_int_equal(run(&p, parts, 2, true, NULL), TAL_OK); // already done: nothing changes
  assert_same_runs(whole, parts);
  place_remove(&p);
}

// EXACT: interrupted in the confinement, near its end and in the compression, for both kinds of friction.
static void interrupted_and_resumed(void **state) {
  (void)state;
  static const char *const laws[] = {"regularised", "spring"};
  for (int law = 0; law < 2; law++) {
    char text[2000];
    snprintf(text, sizeof text, biaxial, 100, laws[law], 13e-3, 0.04, 0.004);
    compare_interrupted(text, (const double[]){0.2, 0.45, 0.7}, 3);
  }
}

// EXACT: confined by one scheme and compressed by another, interrupted in each.
static void schemes_in_turn(void **state) {
  (void)state;
  static const char *const schemes[][2] = {{"implicit_friction", "verlet"}, {"verlet", "implicit_friction"}};
  for (int k = 0; k < 2; k++) {
    char text[2000], *at;
    snprintf(text, sizeof text, biaxial, 100, k ? "regularised" : "spring", 13e-3, 0.04, 0.004);
    for (int stage = 0; stage < 2; stage++) {
      char rest[2000];
      at = strstr(text, stage ? "strain: 0.004" : "dt: 1.25e-5");
      assert_non_null(at);
      snprintf(rest, sizeof rest, "%s", at + strlen(stage ? "strain: 0.004" : "dt: 1.25e-5"));
      snprintf(at, sizeof text - (size_t)(at - text),
               stage ? "strain: 0.004, integrator: {scheme: %s}%s" : "dt: 1.25e-5, scheme: %s%s", schemes[k][stage],
               rest);
    }
    compare_interrupted(text, (const double[]){0.3, 0.6, 0.8}, 3);
  }
}

// EXACT: so many grains that the loops are shared out among the threads.
static void other_number_of_threads(void **state) {
  (void)state;
  compare_interrupted("grains: {radius: {law: uniform, min: 1e-3, max: 1e-3}, thickness: 2e-3}\n"
                      "material: {young: 1e7, density: 2000, friction: 0.5, damping: 1e-4}\n"
                      "contact: {tangential: spring}\ngravity: [3, -9]\nwalls: [{from: [-1, 0], to: [1, 0]}]\n"
                      "pack: {method: lattice, columns: 26, rows: 20, gap: -1e-6}\nintegrator: {dt: 1e-5}\n"
                      "stages: [{kind: free, duration: 4e-3}]\n"
                      "output: {series_every: 4e-5, fields_every: 8e-4, checkpoint_every: 1e-3, tracks: [7]}\n",
                      (const double[]){0.3}, 1);
}

// Kills the child once series.csv is that long and a moment has passed; exit code of a child that was done before, -1.
static int kill_at(pid_t child, const char *dir, off_t bytes, double moment) {
  int status;
  while (size_of(dir, "series.csv") < bytes) {
    if (waitpid(child, &status, WNOHANG) == child)
      return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    usleep(100);
  }
  usleep((useconds_t)(1e6 * moment));
  kill(child, SIGKILL);
  return wait_for(child);
}

// EXACT: killed at random moments, some of them while files are being written, and resumed until it is done.
static void killed_and_resumed(void **state) {
  (void)state;
  const int kills = 9;
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  char text[2000], whole[TAL_PATH_SIZE], parts[TAL_PATH_SIZE];
  snprintf(text, sizeof text, biaxial, 60, "regularised", 10e-3, 0.04, 0.003);
  place p = place_create(text);
  tal_file_path(whole, p.folder, "whole");
  tal_file_path(parts, p.folder, "parts");
  assert_int_equal(run(&p, whole, 1, false, NULL), TAL_OK);
  off_t bytes = size_of(whole, "series.csv");
  for (int k = 0; k <= kills; k++) {
    bool resume = size_of(parts, "checkpoint.h5") >= 0 || size_of(parts, "checkpoint.prev.h5") >= 0;
    if (!resume) // none yet, or killed before the first checkpoint
      nftw(parts, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
    pid_t child = run_begin(&p, parts, 1, resume, NULL);
    off_t at = (off_t)((k + uniform(random, 0.1, 0.9)) / (kills + 1) * 0.85 * (double)bytes);
    if (k < kills)
      assert_int_equal(kill_at(child, parts, at, uniform(random, 0, 3e-3)), -1);
    else
      assert_int_equal(wait_for(child), TAL_OK);
  }
  assert_same_runs(whole, parts);
  place_remove(&p);
  gsl_rng_free(random);
}

// ---- restored at any step ----

// Everything that lives on in a run: free flight among walls that come and go, a fixed grain that moves, confinement,
// compression, a free stage with the strain going on, compression again.
static const char stages[] =
    "grains: {count: 50, radius: {law: uniform, min: 0.4e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
    "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\nmass_scaling: 1e5\n"
    "contact: {tangential: %s}\npack: {method: drop_and_roll, width: 9e-3}\ncontinuum: {refresh: %s}\n"
    "gravity: [0, -0.05]\nintegrator: {dt: 5e-6}\n"
    "walls: [{from: [-1, 0], to: [1, 0], until_time: 0.00301}, {from: [0, -1], to: [0, 1], until_time: 0.00201, "
    "velocity: [0.01, 0]}, {from: [9e-3, -1], to: [9e-3, 1], friction: 0, from_time: 0.00105, until_time: 0.003}]\n"
    "stages:\n  - {kind: free, duration: 0.003}\n"
    "  - {kind: confine, pressure: 100e3, ramp: 0.01, friction: 0.1, tolerance: 0.8, unbalanced: 100, "
    "integrator: {dt: 1e-5}}\n"
    "  - {kind: compress, rate: 0.5, strain: 0.002}\n  - {kind: free, duration: 0.001}\n"
    "  - {kind: compress, rate: 1, strain: 0.004, pressure: 2e5}\n";

static void assert_same_run(const engine *a, const engine *b) {
  assert_same_motion(a, b);
  const tal_run *r = &a->sim->run, *s = &b->sim->run;
#define X(type, name, unit, meaning)                                                                                   \
  if (memcmp(&r->name, &s->name, sizeof r->name) != 0)                                                                 \
    fail_msg(#name " is %.17g and %.17g at step %lld", (double)r->name, (double)s->name, (long long)r->step);
  TAL_RUN_FIELDS(X)
#undef X
}

static void assert_same_rows(engine *a, engine *b) {
  tal_row of_a = engine_row(a), of_b = engine_row(b);
#define X(name, unit, meaning)                                                                                         \
  if (memcmp(&of_a.name, &of_b.name, sizeof of_a.name) != 0)                                                           \
    fail_msg(#name " is %.17g and %.17g at step %g", of_a.name, of_b.name, of_a.step);
  TAL_SERIES_FIELDS(X)
#undef X
}

static engine *restored(const engine *from, const char *text, const char *path) {
  tal_run_files files = {.series_step = -1};
  tal_error err;
  if (tal_checkpoint_write(path, NULL, from->sim, "scene", &files, &err) != TAL_OK)
    fail_msg("%s", err.text);
  draft *d = draft_begin();
  fputs(text, d->to);
  engine *e = engine_start(d);
  if (tal_checkpoint_read(path, e->sim, "scene", &files, &err) != TAL_OK)
    fail_msg("%s", err.text);
  tal_run_files_clear(&files);
  tal_sim_restored(e->sim);
  return e;
}

// Steps on which a checkpoint is tried: all about the ends of stages and where walls come and go, else every 61st.
static bool tried(const engine *e) {
  const tal_run *run = &e->sim->run;
  bool edge = run->stage_done || run->stage_step < 2 || run->step == 209 || run->step == 210 || run->step == 401 ||
              run->step == 402;
  return edge || run->step % 61 == 0;
}

static void restore_at_any_step(const char *text, int stage_count, int least_points) {
  char path[TAL_PATH_SIZE];
  place p = place_create(text);
  tal_file_path(path, p.folder, "checkpoint.h5");
  draft *d = draft_begin();
  fputs(text, d->to);
  engine *e = engine_start(d);
  int64_t seen = 0;
  int points = 0;
  for (; !tal_sim_done(e->sim); points++) {
    engine *f = restored(e, text, path);
    do {
      engine_step(e);
      engine_step(f);
      assert_same_run(e, f);
    } while (!tried(e));
    assert_same_rows(e, f);
    seen |= 1 << e->sim->run.stage;
    engine_end(f);
  }
  assert_int_equal(seen, (1 << stage_count) - 1);
  assert_true(points > least_points);
  engine_end(e);
  place_remove(&p);
}

// EXACT: written, read into a fresh simulation and carried on, from any step: the same motion, accounts and rows.
static void restored_at_any_step(void **state) {
  (void)state;
  static const char *const laws[] = {"regularised", "spring"};
  static const char *const refresh[] = {"50", "{displacement: 0.002}"};
  for (int law = 0; law < 2; law++) {
    char text[2000];
    snprintf(text, sizeof text, stages, laws[law], refresh[law]);
    restore_at_any_step(text, 5, 40);
  }
}

// Friction that ends with a stage and comes back with the next, solved implicitly; nothing moves far in between.
static const char off_and_on[] =
    "grains: {count: 50, radius: {law: uniform, min: 0.4e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
    "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\nmass_scaling: 1e5\n"
    "contact: {tangential: %s}\npack: {method: drop_and_roll, width: 9e-3}\ncontinuum: {refresh: 50}\n"
    "neighbours: {skin: 0.5}\nintegrator: {scheme: implicit_friction, dt: 1e-5}\n"
    "stages:\n  - {kind: confine, pressure: 100e3, ramp: 0.02, tolerance: 0.8, unbalanced: 100}\n"
    "  - {kind: compress, rate: 0.5, strain: 0.004}\n"
    "  - {kind: confine, pressure: 100e3, ramp: 0.001, friction: 0, tolerance: 0.9, unbalanced: 100}\n"
    "  - {kind: compress, rate: 0.5, strain: 0.006}\n";

// EXACT.
static void friction_that_comes_back(void **state) {
  (void)state;
  static const char *const laws[] = {"regularised", "spring"};
  for (int law = 0; law < 2; law++) {
    char text[2000];
    snprintf(text, sizeof text, off_and_on, laws[law]);
    restore_at_any_step(text, 4, 10);
  }
}

// A stage without a boundary after one that presses.
static const char pressed_and_free[] =
    "grains: {count: 50, radius: {law: uniform, min: 0.4e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
    "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\nmass_scaling: 1e5\n"
    "pack: {method: drop_and_roll, width: 9e-3}\ncontinuum: {refresh: 50}\nintegrator: {dt: 1e-5}\n"
    "stages:\n  - {kind: compress, pressure: 100e3, rate: 0.5, strain: 0.001}\n"
    "  - {kind: free, duration: 0.006}\n";

// EXACT: nothing is left of the pressure that a new simulation of the scene begins with.
static void pressure_that_ends(void **state) {
  (void)state;
  restore_at_any_step(pressed_and_free, 2, 8);
}

int main(int argc, char **argv) {
  if (argc > 1)
    cmocka_set_test_filter(argv[1]);
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(interrupted_and_resumed), cmocka_unit_test(schemes_in_turn),
      cmocka_unit_test(other_number_of_threads), cmocka_unit_test(killed_and_resumed),
      cmocka_unit_test(restored_at_any_step),    cmocka_unit_test(friction_that_comes_back),
      cmocka_unit_test(pressure_that_ends),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
