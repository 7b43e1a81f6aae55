// Forced grains through the program: bad input, a stage begun from another run's end, an ensemble stopped and resumed,
// and what `talus rotation` makes of it.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "program.h"

static const char patch[] = "name: patch\n"
                            "grains: {radius: {law: uniform, min: 1e-3, max: 1e-3}, thickness: 2e-3}\n"
                            "material: {young: 1e8, poisson: 0.3, density: 2e5, friction: 0.4, damping: 1e-4}\n"
                            "contact: {vR: 1e-4}\n"
                            "pack: {method: lattice, columns: 14, rows: 13, gap: -1e-7, cut: {shape: circle, radius: "
                            "11e-3}}\n"
                            "integrator: {scheme: implicit_friction, dt: 2e-5}\n"
                            "stages:\n"
                            "  - {kind: spin, grain: 20, pressure: 1e4, omega: 1, ramp: 2e-3, hold: 1e-3}\n"
                            "  - {kind: spin, pressure: 1e4, omega: -3, ramp: 2e-3, hold: 2e-3}\n"
                            "output: {series_every: 5e-4, checkpoint_every: 1e-3}\n";

static char *text_of(program *p, const char *name) {
  size_t size;
  char *text = program_read(p, name, &size);
  if (!text)
    fail_msg("%s is not there", name);
  return text;
}

static void assert_holds(const char *text, const char *fragment) {
  if (!strstr(text, fragment))
    fail_msg("'%s' is not in:\n%s", fragment, text);
}

static const char *last_line(const char *text) {
  const char *end = text + strlen(text) - 1;
  while (end > text && end[-1] != '\n')
    end--;
  return end;
}

// EXACT: every wrong choice of grains names its line or option and what would do.
static void bad_input(void **state) {
  program *p = *state;
  static const struct {
    const char *set, *fragment;
  } bad[] = {
      {"stages.1.grain=9999", "stages[1].grain: 9999 is no grain; accepted: ids from 0 to"},
      {"stages.1.grain=-1", "stages[1].grain"},
      {"stages.1.grain=middle", "accepted: nearest, a grain's id, a list of ids, or {random:"},
      {"stages.1.grain=[3, 3]", "is listed already; accepted: each grain once"},
      {"stages.1.grain=[]", "is no choice of grains; accepted: nearest"},
      {"stages.1.grain={random: 0}", "random: '0' is out of range"},
      {"stages.1.grain={margin: 2}", "random: is missing"},
      {"stages.1.grain={random: 2, among: 3}", "unknown key; accepted: random, margin"},
      {"stages.0.grain=[3, 4]", "accepted: in the last stage only"},
      {"stages.1.omega=0", "omega: is zero"},
      {"stages.1.ramp=0", "ramp: '0' is out of range"},
      {"stages.1.hold=-1", "hold: '-1' is out of range"},
      {"stages.1.method=exact", "has no effect with kind: spin"},
      {"stages.1.grain=[3, 12345]", "stages[1].grain: 12345 is no grain; accepted: ids from 0 to"},
  };
  program_write(p, "s.yaml", patch);
  for (size_t k = 0; k < sizeof bad / sizeof *bad; k++)
    assert_refused(p, bad[k].set, WORDS("run", "s.yaml", "-o", "out", "--set", bad[k].set), 2, bad[k].fragment);
  outcome got;
  program_run(p, WORDS("run", "s.yaml", "-o", "out", "--set", "rotation=false"), &got); // both stages say so
  assert_outcome("rotation", &got, 2, "spin has no effect with rotation: false; accepted: rotation: true");
  program_write(p, "fixed.yaml",
                "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1}, {x: 1.9, y: 0, r: 1, fixed: true}]}\n"
                "material: {young: 1e6, density: 1000, friction: 0.5}\ncontact: {vR: 1e-3}\nintegrator: {dt: 1e-4}\n"
                "stages: [{kind: spin, grain: 1, omega: 1}]\n");
  assert_refused(p, "fixed", WORDS("run", "fixed.yaml", "-o", "out"), 2,
                 "fixed.yaml:5: stages[0].grain: 1 is a fixed grain: it keeps its spin");
}

// EXACT: the end of one run is the start of another: the same bits as in one go. A run that is not finished, whose
// scene differs or leaves nothing to do is refused, and so is a folder without one.
static void from_another_run(void **state) {
  program *p = *state;
  outcome got;
  program_write(p, "s.yaml", patch);
  char *first = strdup(patch), *second = strstr(first, "  - {kind: spin, pressure");
  char *rest = strstr(second, "output:");
  memmove(second, rest, strlen(rest) + 1);
  program_write(p, "first.yaml", first);
  free(first);
  program_run(p, WORDS("run", "s.yaml", "-o", "whole", "-q", "--no-figures"), &got);
  assert_int_equal(got.code, 0);
  program_run(p, WORDS("run", "first.yaml", "-o", "first", "-q", "--no-figures"), &got);
  assert_int_equal(got.code, 0);
  program_run(p, WORDS("run", "s.yaml", "-o", "second", "--from", "first", "-q", "--no-figures"), &got);
  assert_int_equal(got.code, 0);
  char *whole = text_of(p, "whole/series.csv"), *later = text_of(p, "second/series.csv");
  assert_string_equal(last_line(whole), last_line(later));
  free(whole);
  free(later);
  assert_refused(p, "scene", WORDS("run", "s.yaml", "-o", "x", "--from", "first", "--set", "material.friction=0.3"), 2,
                 "belongs to another scene");
  assert_refused(p, "nothing to do", WORDS("run", "first.yaml", "-o", "x", "--from", "first"), 2,
                 "no stage beyond the 1 of that run");
  assert_refused(p, "no run", WORDS("run", "s.yaml", "-o", "x", "--from", "nowhere"), 4, "nowhere");
}

// EXACT: a forced run that goes bad stops with its reason, in the file too.
static void gone_bad(void **state) {
  program *p = *state;
  outcome got;
  program_write(p, "s.yaml", patch);
  program_run(p,
              WORDS("run", "s.yaml", "-o", "bad", "-q", "--no-figures", "--set", "limits={stride: 1e-4}", "--set",
                    "integrator={scheme: verlet, dt: 1e-6, force: true}", "--set", "output={series_every: 5e-3}",
                    "--set", "stages=[{kind: spin, pressure: 1e3, omega: 5e4, ramp: 0.01, hold: 0.05}]"),
              &got);
  assert_outcome("gone bad", &got, 3, "limits.stride"); // long after the last look
  char *report = text_of(p, "bad/run.json");
  assert_holds(report, "invalid");
  free(report);
}

#define ENSEMBLE "run", "s.yaml", "-o", "e", "-t", "2", "-q", "--no-figures", "--set"

// EXACT: an ensemble is a run to the common state and a run for each grain; a grain's run is the scene with that grain;
// a second call needs --resume and finds everything done; a run that is taken away is made again, the same.
static void ensemble(void **state) {
  program *p = *state;
  outcome got;
  static const char many[] = "stages.1.grain={random: 3, margin: 2}";
  program_write(p, "s.yaml", patch);
  program_run(p, WORDS(ENSEMBLE, many), &got);
  assert_outcome("ensemble", &got, 0, "");
  assert_holds(got.out, "e/runs: 3 of 3 forced grains done");
  char *plan = text_of(p, "e/plan.csv"), name[40], path[80];
  assert_int_equal(count_lines(plan), 4);
  snprintf(name, sizeof name, "%.*s", (int)strcspn(last_line(plan), ","), last_line(plan));
  free(plan);
  snprintf(path, sizeof path, "e/runs/%s/series.csv", name);
  char *series = text_of(p, path), set[60];
  snprintf(set, sizeof set, "stages.1.grain=%s", name + strlen("grain-"));
  program_run(p, WORDS("run", "s.yaml", "-o", "alone", "-q", "--no-figures", "--set", set), &got);
  assert_int_equal(got.code, 0);
  char *alone = text_of(p, "alone/series.csv");
  assert_string_equal(last_line(series), last_line(alone));
  free(alone);
  program_run(p, WORDS(ENSEMBLE, many), &got);
  assert_outcome("again", &got, 2, "--resume");
  snprintf(path, sizeof path, "e/runs/%s", name);
  char from[4400];
  snprintf(from, sizeof from, "%s", program_path(p, path));
  assert_int_equal(rename(from, program_path(p, "gone")), 0);
  program_run(p, WORDS(ENSEMBLE, many, "--resume"), &got);
  assert_outcome("resumed", &got, 0, "");
  snprintf(path, sizeof path, "e/runs/%s/series.csv", name);
  char *redone = text_of(p, path);
  assert_string_equal(series, redone);
  free(series);
  free(redone);
  program_run(p, WORDS(ENSEMBLE, "stages.1.grain={random: 400}", "--resume"), &got);
  assert_outcome("too many", &got, 2, "stages[1].grain: only 0 grains bear and lie at least 10 mean diameters");
}

// EXACT: the tables of a single run and of an ensemble, the warning where the cutoff reaches beyond the rim, and
// refusals. A run in which no grain is forced can be looked at from any grain.
static void rotation(void **state) {
  program *p = *state;
  outcome got;
  program_write(p, "s.yaml", patch);
  program_run(p, WORDS(ENSEMBLE, "stages.1.grain={random: 3, margin: 2}"), &got);
  assert_int_equal(got.code, 0);
  program_run(p, WORDS("rotation", "e", "--no-figures", "--reach", "4"), &got);
  assert_outcome("rotation", &got, 0, "");
  assert_holds(got.out, "3 forced grains in 1 samples, cutoff 4 mean diameters"); // not the run that they began from
  char *table = text_of(p, "e/rotation/sectors.csv");
  assert_int_equal(count_lines(table), 1 + 3 * 12);
  free(table);
  table = text_of(p, "e/rotation/forced.csv");
  assert_int_equal(count_lines(table), 1 + 3);
  free(table);
  program_run(p, WORDS("rotation", "e", "--no-figures", "--grain", "30"), &got);
  assert_outcome("one", &got, 0, "");
  assert_holds(got.out, "e: grain 30 at");
  assert_holds(got.out, "the cutoff reaches beyond the rim");
  free(text_of(p, "e/rotation/points.csv"));
  assert_refused(p, "grain", WORDS("rotation", "e", "--grain", "5000"), 2, "5000 is no grain of that run");
  assert_refused(p, "frame", WORDS("rotation", "e", "--grain", "3", "--frame", "77"), 2, "no field frame 77");
  assert_refused(p, "reach", WORDS("rotation", "e", "--reach", "0"), 2, "--reach: is no distance");
  assert_refused(p, "nothing", WORDS("rotation", "e/logs"), 2, "no run of a forced grain there or below");
}

int main(void) {
  const struct CMUnitTest tests[] = {
      program_test(bad_input), program_test(from_another_run), program_test(gone_bad),
      program_test(ensemble),  program_test(rotation),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
