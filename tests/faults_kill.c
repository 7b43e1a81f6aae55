// kill -9: at random moments of short runs with every boundary, law and integrator and every output on, and at every
// single call that touches a file, half-written ones among them. Nothing is lost: --resume gives the bits of the
// unbroken run. Short: a score of kills; long: a thousand, and every call.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "faults.h"
#include "variants.h"
#include <gsl/gsl_rng.h>

// Every kind of output, often; and long enough that a random moment lies in the run and not in the loader.
static const char output[] =
    "--set=output={series_every: 1e-5, fields_every: 3e-4, checkpoint_every: 2e-4, tracks: [0, 1, 2]}";

// Does the variant change how grains move? The others change where they start.
static bool moves(const variant *v) {
  return strncmp(v->path, "stages.", 7) == 0 || strncmp(v->path, "contact.", 8) == 0 ||
         strcmp(v->path, "pack.cut.shape") == 0;
}

typedef struct target {
  const char *sets[2 * VARIANT_SETS + 2];
  char *print;    // of the unbroken run
  double seconds; // that it took
  char what[200];
} target;

enum { TARGETS_MOST = 200 };

// Every variant that moves grains with every integrator.
static size_t list_targets(const variant *list, size_t count, target *targets) {
  size_t found = 0;
  for (size_t k = 0; k < count; k++) {
    for (size_t i = 0; i < count && moves(&list[k]); i++) {
      if (strcmp(list[i].path, "integrator.scheme") != 0)
        continue;
      assert_true(found < TARGETS_MOST);
      target *t = &targets[found++];
      *t = (target){.print = NULL};
      size_t sets = 0;
      for (size_t s = 0; list[i].sets[s]; s++)
        t->sets[sets++] = list[i].sets[s];
      for (size_t s = 0; list[k].sets[s]; s++)
        t->sets[sets++] = list[k].sets[s];
      t->sets[sets] = output;
      snprintf(t->what, sizeof t->what, "%.80s: %.40s, %.40s", list[k].path, list[k].choice, list[i].choice);
    }
  }
  return found;
}

static void run_whole(program *p, target *t) {
  const faults_run whole = {"whole", "1", t->sets, false};
  outcome got;
  faults_remove(p, "whole");
  const double began = faults_clock();
  faults_do(p, &whole, &got);
  t->seconds = faults_clock() - began;
  if (got.code != 0 || *got.err)
    fail_msg("%s: exit %d\n%s", t->what, got.code, got.err);
  t->print = faults_print(p, "whole");
}

// Starts or goes on and kills after the time; true when the process was still at work.
static bool kill_after(program *p, const target *t, double seconds) {
  const bool resume = faults_checkpoint_there(p, "parts");
  if (!resume) // killed before the first one
    faults_remove(p, "parts");
  outcome got;
  process child = faults_start(p, &(faults_run){"parts", "1", t->sets, resume});
  faults_sleep(seconds);
  kill(child.id, SIGKILL);
  process_wait(&child, &got);
  if (got.code != -1 && (got.code != 0 || *got.err))
    fail_msg("%s: exit %d\n%s", t->what, got.code, got.err);
  return got.code == -1;
}

// EXACT: killed at random moments, several times before a run is done, resumed to the bits of the unbroken one.
static void random_moments(void **state) {
  program *p = *state;
  static variant list[VARIANTS_MOST];
  static target targets[TARGETS_MOST];
  const size_t count = list_targets(list, variants_list(list), targets);
  const long wanted = faults_long() ? 1000 : 20;
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  gsl_rng_set(random, (unsigned long)time(NULL));
  program_write(p, "s.yaml", variants_scene);
  long kills = 0, runs = 0;
  while (kills < wanted) {
    target *t = &targets[faults_long() ? (size_t)runs % count : gsl_rng_uniform_int(random, count)];
    if (!t->print)
      run_whole(p, t);
    faults_remove(p, "parts");
    for (int k = 0; k < 5 && kills < wanted; k++)
      kills += kill_after(p, t, t->seconds * gsl_rng_uniform(random));
    if (faults_checkpoint_there(p, "parts"))
      assert_sound(p, "parts", t->what);
    faults_recover(p, &(faults_run){"parts", "2", t->sets, false}, t->print, t->what);
    runs++;
  }
  for (size_t k = 0; k < count; k++)
    free(targets[k].print);
  gsl_rng_free(random);
  faults_held("kill -9 at random moments", kills, "resumed to the bits of the unbroken run");
}

static void assert_reported_done(program *p, const char *what) {
  size_t size;
  char *report = program_read(p, "parts/run.json", &size);
  if (!report || !strstr(report, "\"status\": \"done\""))
    fail_msg("%s: run.json does not say that the run is done", what);
  free(report);
}

// EXACT: killed before the n-th call that touches a file, and after half of the n-th write, for every n.
static void every_call(void **state) {
  program *p = *state;
  static const char *const ways[][2] = {{"files", "s9"}, {"write", "torn"}};
  target t = {.sets = {"--set=output={series_every: 3e-4, fields_every: 8e-4, checkpoint_every: 8e-4, tracks: [1]}"},
              .what = "every call"};
  const long stride = faults_long() ? 1 : 23;
  long kills = 0;
  program_write(p, "s.yaml", variants_scene);
  run_whole(p, &t);
  for (size_t w = 0; w < 2; w++) {
    for (long n = 1;; n += stride) {
      outcome got;
      char what[80];
      snprintf(what, sizeof what, "%s %ld: %s", ways[w][0], n, ways[w][1]);
      faults_remove(p, "parts");
      faults_plan(p, ways[w][0], n, ways[w][1]);
      faults_do(p, &(faults_run){"parts", "1", t.sets, false}, &got);
      if (!faults_struck(p))
        break;
      assert_int_equal(got.code, -1);
      faults_plan(p, NULL, 0, NULL);
      if (faults_checkpoint_there(p, "parts"))
        assert_sound(p, "parts", what);
      faults_recover(p, &(faults_run){"parts", "1", t.sets, false}, t.print, what);
      assert_reported_done(p, what);
      kills++;
    }
  }
  free(t.print);
  assert_true(kills > (faults_long() ? 200 : 10));
  faults_held("kill -9 at every call on a file, half writes", kills, "resumed to the bits of the unbroken run");
}

int main(int argc, char **argv) {
  if (argc > 1)
    cmocka_set_test_filter(argv[1]);
  const struct CMUnitTest tests[] = {
      faults_test(random_moments),
      faults_test(every_call),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
