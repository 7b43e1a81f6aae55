// Threads x resume point x output cadence x variant: stopped anywhere and resumed on another number of threads, every
// scene gives the bits of its unbroken run. The variants are those of the registries. Short: each variant once, the
// rest in rotation; long: the whole product, with so many grains that threads share the loops.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "faults.h"
#include "variants.h"

static const char *const cadences[] = {
    "--set=output={series_every: 1e-5, fields_every: 3e-4, checkpoint_every: 4e-4, tracks: [1]}", // rows at every step
    "--set=output={series_every: 3e-4, fields_every: 7e-4, checkpoint_every: 5e-4, tracks: [1, 2]}",
    "--set=output={series_every: 2e-4, fields_every: .inf, checkpoint_every: .inf}"};
static const double points[] = {0, 0.35, 0.65, 0.95}; // shares of the run's calls of write
static const char *const threads[][2] = {{"1", "2"}, {"2", "1"}, {"3", "1"}};

#define COUNT(list) (sizeof(list) / sizeof *(list))

// EXACT: the scene of every variant loads and holds it. A variant that was registered and has none fails here.
static void every_variant_has_a_scene(void **state) {
  program *p = *state;
  variant list[VARIANTS_MOST];
  const size_t count = variants_list(list);
  char path[4400];
  assert_true(count > 30 && count < VARIANTS_MOST);
  program_write(p, "s.yaml", variants_scene);
  program_write(p, "grains.csv", variants_grains);
  snprintf(path, sizeof path, "%s", program_path(p, "s.yaml"));
  for (size_t k = 0; k < count; k++) {
    const char *sets[VARIANT_SETS];
    size_t set_count = 0;
    for (; list[k].sets[set_count]; set_count++)
      sets[set_count] = list[k].sets[set_count] + strlen("--set=");
    tal_scene scene;
    tal_scene_errors errors;
    if (tal_scene_load(&scene, path, sets, set_count, &errors) != TAL_OK)
      fail_msg("%s: %s has no scene in the matrix: add a line to `needs` in variants.h (%s)", list[k].path,
               list[k].choice, errors.item[0].text);
    if (!variant_held(tal_schema(), (const char *)&scene, list[k].path, list[k].choice))
      fail_msg("%s: %s is not in the scene made for it: mend its line of `needs` in variants.h", list[k].path,
               list[k].choice);
    tal_scene_clear(&scene);
  }
  faults_held("registered variants with a scene", (long)count, "each is in its scene");
}

typedef struct cell {
  const char *sets[2 * VARIANT_SETS + 2];
  const char *print; // of the unbroken run
  long writes;       // that it made
  char what[200];
} cell;

static void begin_cell(program *p, cell *c, const variant *v, size_t cadence, bool large) {
  size_t count = 0;
  for (size_t k = 0; v->sets[k]; k++)
    c->sets[count++] = v->sets[k];
  for (size_t k = 0; large && v->large[k]; k++)
    c->sets[count++] = v->large[k];
  c->sets[count++] = cadences[cadence];
  c->sets[count] = NULL;
  snprintf(c->what, sizeof c->what, "%.80s: %.60s, cadence %zu", v->path, v->choice, cadence);
  outcome got;
  faults_remove(p, "whole");
  faults_plan(p, "write", 0, "count");
  faults_do(p, &(faults_run){"whole", "1", c->sets, false}, &got);
  if (got.code != 0 || *got.err)
    fail_msg("%s: exit %d\n%s", c->what, got.code, got.err);
  c->writes = faults_count(p);
  c->print = faults_print(p, "whole");
}

static void stop_and_resume(program *p, const cell *c, double point, const char *const on[2]) {
  char what[300];
  outcome got;
  snprintf(what, sizeof what, "%s, stopped at %g, %s then %s threads", c->what, point, on[0], on[1]);
  faults_remove(p, "parts");
  faults_plan(p, "write", 1 + (long)(point * (double)(c->writes - 1)), "s15");
  faults_do(p, &(faults_run){"parts", on[0], c->sets, false}, &got);
  const bool stopped = got.code == 75 && strstr(got.err, "--resume") && count_lines(got.err) == 1;
  if (!faults_struck(p) || !(stopped || (got.code == 0 && point > 0.9)))
    fail_msg("%s: exit %d\n%s", what, got.code, got.err);
  faults_done(p, &(faults_run){"parts", on[1], c->sets, true});
  assert_printed(p, "parts", c->print, what);
}

// EXACT: every cell of the matrix: stopped, resumed, the same bits.
static void matrix(void **state) {
  program *p = *state;
  variant list[VARIANTS_MOST];
  const size_t count = variants_list(list);
  long trials = 0;
  program_write(p, "s.yaml", variants_scene);
  program_write(p, "grains.csv", variants_grains);
  for (size_t k = 0; k < count; k++) {
    for (size_t cadence = 0; cadence < COUNT(cadences); cadence++) {
      if (!faults_long() && cadence != k % COUNT(cadences))
        continue;
      cell c;
      begin_cell(p, &c, &list[k], cadence, faults_long());
      for (size_t at = 0; at < COUNT(points); at++)
        for (size_t t = 0; t < COUNT(threads); t++) {
          if (!faults_long() && (at != k / 3 % COUNT(points) || t != k % COUNT(threads)))
            continue;
          stop_and_resume(p, &c, points[at], threads[t]);
          trials++;
        }
      free((void *)(uintptr_t)c.print);
    }
  }
  faults_held("threads x resume point x cadence x variant", trials, "resumed to the bits of the unbroken run");
}

int main(int argc, char **argv) {
  if (argc > 1)
    cmocka_set_test_filter(argv[1]);
  const struct CMUnitTest tests[] = {
      faults_test(every_variant_has_a_scene),
      faults_test(matrix),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
