// The program from outside: bad scenes and bad command lines are refused with the right code and message, and nothing
// is written; what asks a question is answered. Runs are in test_cli_run.c.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "program.h"

#include <math.h>

typedef struct bad_scene {
  const char *what;
  int line; // of the scene, replaced by:
  const char *text;
  int code;
  const char *message; // on stderr, after "s.yaml"
} bad_scene;

static const bad_scene bad_scenes[] = {
    {"unknown key", 4, "material: {young: 1e7, poisson: 0.3, density: 2000, frictoin: 0.5}", 2,
     ":4: material.frictoin: unknown key; did you mean 'friction'?"},
    {"unknown key at the top", 11, "outputs: {series_every: 1e-4}", 2, ":11: outputs: unknown key"},
    {"wrong type: word for a number", 4, "material: {young: soft, poisson: 0.3, density: 2000, friction: 0.5}", 2,
     ":4: material.young: 'soft' is not a number; accepted: a number in Pa > 0"},
    {"wrong type: number for a group", 4, "material: 7", 2, ":4: material: "},
    {"wrong type: list for a number", 2, "seed: [1, 2]", 2, ":2: seed: "},
    {"unit slip", 4, "material: {young: 100kPa, poisson: 0.3, density: 2000, friction: 0.5}", 2,
     ":4: material.young: '100kPa' is not a number"},
    {"1e4 for a count", 3, "grains: {count: 1e4, radius: {law: uniform, min: 1e-3, max: 1e-3}}", 2,
     ":3: grains.count: '1e4' is not a whole number"},
    {"negative radius", 3, "grains: {count: 40, radius: {law: uniform, min: -1e-3, max: 1e-3}}", 2,
     ":3: grains.radius.min: '-1e-3' is out of range; accepted: a number in m > 0"},
    {"largest radius below the smallest", 3, "grains: {count: 40, radius: {law: uniform, min: 2e-3, max: 1e-3}}", 2,
     ":3: grains.radius"},
    {"zero count", 3, "grains: {count: 0, radius: {law: uniform, min: 1e-3, max: 1e-3}}", 2,
     ":3: grains.count: '0' is out of range"},
    {"too small a box", 7, "pack: {method: drop_and_roll, width: 1e-3}", 2, ":7: pack.width: 0.001 m is too narrow"},
    {"friction below 0", 4, "material: {young: 1e7, poisson: 0.3, density: 2000, friction: -0.5}", 2,
     ":4: material.friction: '-0.5' is out of range"},
    {"missing key", 4, "material: {poisson: 0.3, density: 2000, friction: 0.5}", 2, ":4: material.young: is missing"},
    {"unknown choice", 5, "contact: {normal: hurtz, tangential: spring}", 2, ":5: contact.normal: "},
    {"unknown stage", 10, "stages: [{kind: squeeze, duration: 1}]", 2, ":10: stages[0].kind: 'squeeze' is not known"},
    {"key twice", 2, "name: again", 2, ":2: the key 'name' is given twice"},
    {"not YAML", 5, "contact: {normal: [hertz, tangential: spring}", 2, ":5: "},
    {"restitution without a speed", 5, "contact: {normal: hertz, tangential: spring, restitution: 0.5}", 2,
     ":5: contact.restitution_speed: is missing, and neither contact.vR nor a stage with a rate gives one"},
    {"restitution zero", 5, "contact: {restitution: 0, restitution_speed: 1, tangential: spring}", 2,
     ":5: contact.restitution: '0' is out of range; accepted: a number in (0, 1]"},
    {"dt above critical, by the scene alone", 5,
     "contact: {normal: linear, stiffness: 1e8, damping: 0, tangential: none}", 2,
     ":9: integrator.dt: 1e-06 s is above the critical step"},
};

// EXACT: each kind of bad scene gets exit 2 and one line FILE:LINE: key: what, from `run` and `check`; nothing written.
static void test_bad_scenes(void **state) {
  program *p = *state;
  for (size_t k = 0; k < sizeof bad_scenes / sizeof *bad_scenes; k++) {
    const bad_scene *bad = &bad_scenes[k];
    char message[200];
    snprintf(message, sizeof message, "s.yaml%s", bad->message);
    write_scene(p, bad->line, bad->text);
    assert_refused(p, bad->what, WORDS("run", "s.yaml", "-o", "out"), bad->code, message);
    assert_refused(p, bad->what, WORDS("check", "s.yaml"), bad->code, message);
  }
}

// EXACT: a step that only the packed grains show to be above critical is exit 3, and nothing is written either.
static void test_step_above_critical_of_the_packing(void **state) {
  program *p = *state;
  program_write(p, "s.yaml", two_grains);
  assert_refused(p, "dt above critical", WORDS("run", "s.yaml", "-o", "out", "--set", "integrator.dt=1"), 3,
                 "integrator.dt = 1 s is above the critical step");
}

typedef struct bad_line {
  const char *words[8]; // ended by NULL
  int code;
  const char *message;
} bad_line;

static const bad_line bad_lines[] = {
    {{"fly"},
     2,
     "talus: fly: unknown command; accepted: run, check, impact, measure, plot, study, rotation, verify, keys"},
    {{"--fly"}, 2, "talus: --fly: unknown option"},
    {{"run"}, 2, "talus run: SCENE.yaml: is missing"},
    {{"check"}, 2, "talus check: SCENE.yaml: is missing"},
    {{"impact"}, 2, "talus impact: SCENE.yaml: is missing"},
    {{"impact", "s.yaml", "-o", "out"}, 2, "s.yaml: contact.vR: is missing, and neither a stage with a rate nor"},
    {{"impact", "s.yaml", "-o", "s.yaml", "--set", "contact={normal: linear, stiffness: 1e3, tangential: spring}"},
     4,
     "cannot make the folder"},
    {{"impact", "none.yaml"}, 2, "none.yaml: cannot be read"},
    {{"plot"}, 2, "talus plot: DIR: is missing"},
    {{"verify"}, 2, "talus verify: DIR: is missing"},
    {{"run", "s.yaml", "t.yaml", "-o", "out"}, 2, "talus run: t.yaml: is one word too many"},
    {{"run", "s.yaml", "--fast"}, 2, "talus run: --fast: is not an option here"},
    {{"run", "s.yaml", "-x"}, 2, "talus run: -x: is not an option here"},
    {{"check", "s.yaml", "--resume"}, 2, "talus check: --resume: is not an option here"},
    {{"run", "s.yaml", "-o"}, 2, "talus run: -o: needs a value"},
    {{"run", "s.yaml", "-o", ""}, 2, "talus run: -o: names no folder"},
    {{"run", "s.yaml", "-o", "out", "-t", "0"}, 2, "talus run: -t: '0' is no number of threads"},
    {{"run", "s.yaml", "-o", "out", "-t", "two"}, 2, "talus run: -t: 'two' is no number of threads"},
    {{"run", "s.yaml", "-o", "out", "--set", "seed"}, 2, "--set seed: "},
    {{"run", "s.yaml", "-o", "out", "--set", "seed=x"}, 2, "--set seed=x: seed: 'x' is not a whole number"},
    {{"run", "s.yaml", "-o", "out", "--set", "material.fiction=1"}, 2, "--set material.fiction=1: material.fiction: "},
    {{"run", "s.yaml", "-o", "out", "--set", "stages.5.duration=1"}, 2, "--set stages.5.duration=1: "},
    {{"check", "s.yaml", "--set", "material.young=-1"}, 2, "--set material.young=-1: material.young: '-1' is out of"},
    {{"run", "none.yaml", "-o", "out"}, 2, "none.yaml: cannot be read: No such file or directory"},
    {{"run", ".", "-o", "out"}, 2, ".: "},
    {{"run", "s.yaml", "-o", "s.yaml/out"}, 4, "s.yaml/out: cannot make the folder: Not a directory"},
    {{"run", "s.yaml", "-o", "s.yaml"}, 4, "s.yaml: cannot make the folder"},
    {{"run", "s.yaml", "-o", "none", "--resume"}, 2, "none holds no run to resume"},
    {{"plot", "none"}, 2, "none: holds no run"},
    {{"verify", "none"}, 2, "none holds no run"},
    {{"keys", "material.fiction"}, 2, "talus keys: material.fiction: no such key; did you mean material.friction?"},
    {{"keys", "--fast"}, 2, "talus keys: --fast: is not an option here"},
    {{"keys", "name", "seed"}, 2, "talus keys: seed: is one word too many"},
};

// EXACT: each kind of bad command line gets its exit code and one line that names the word; nothing written.
static void test_bad_lines(void **state) {
  program *p = *state;
  write_scene(p, 0, NULL);
  for (size_t k = 0; k < sizeof bad_lines / sizeof *bad_lines; k++) {
    const bad_line *bad = &bad_lines[k];
    assert_refused(p, bad->message, bad->words, bad->code, bad->message);
  }
  outcome got;
  program_run(p, (const char *const[]){NULL}, &got);
  assert_outcome("no command", &got, 2, "usage: talus COMMAND");
  assert_string_equal(got.out, "");
}

// EXACT: what asks a question is answered on stdout with exit 0, nothing on stderr, nothing written; a full stdout
// is 4.
static void test_questions(void **state) {
  static const struct {
    const char *words[4], *answer;
  } questions[] = {
      {{"--version"}, "talus "},
      {{"--help"}, "usage: talus COMMAND"},
      {{"run", "--help"}, "--no-figures"},
      {{"keys", "--help"}, "usage: talus keys"},
      {{"keys"}, "material.young"},
      {{"keys", "material.young"}, "Young's modulus"},
      {{"keys", "--json"}, "\"$schema\""},
      {{"keys", "--markdown"}, "material.young"},
      {{"keys", "--bash"}, "complete -F _talus talus"},
      {{"check", "s.yaml"}, "dt/dt_crit"},
      {{"check", "s.yaml"}, "s.yaml: valid"},
  };
  program *p = *state;
  write_scene(p, 0, NULL);
  char *before = program_listing(p);
  for (size_t k = 0; k < sizeof questions / sizeof *questions; k++) {
    outcome got;
    program_run(p, questions[k].words, &got);
    if (got.code != 0 || *got.err || !strstr(got.out, questions[k].answer))
      fail_msg("%s: exit %d, expected '%s', got:\n%s%s", questions[k].words[0], got.code, questions[k].answer, got.out,
               got.err);
  }
  process child = program_start(p, WORDS("keys"), "/dev/full");
  outcome got;
  process_wait(&child, &got);
  assert_outcome("keys > /dev/full", &got, 4, "standard output: cannot be written");
  char *after = program_listing(p);
  assert_string_equal(before, after);
  free(before);
  free(after);
}

// Value of a column (from 0) in line `line` (from 0: the head) of a CSV text.
static double csv_value(const char *text, int line, int column) {
  for (; line > 0; line--)
    text = strchr(text, '\n') + 1;
  for (; column > 0; column--)
    text = strchr(text, ',') + 1;
  return strtod(text, NULL);
}

// MODEL: `impact` leaves a table that falls in restitution and contact time with damping, and a picture; the scene's
// own values, which `check` prints, lie on it: e = 0.4 at its restitution_speed.
static void test_impact(void **state) {
  program *p = *state;
  outcome got;
  write_scene(p, 5, "contact: {restitution: 0.4, restitution_speed: 0.2, tangential: spring}");
  program_run(p, WORDS("impact", "s.yaml", "-o", "out"), &got);
  assert_outcome("impact", &got, 0, "");
  assert_string_equal(got.out, "out/impact.csv\nout/impact.png\n");
  assert_int_equal(access(program_path(p, "out/impact.png"), R_OK), 0);
  char text[40000] = "";
  FILE *file = fopen(program_path(p, "out/impact.csv"), "r");
  assert_non_null(file);
  assert_true(fread(text, 1, sizeof text - 1, file) > 1000);
  fclose(file);
  assert_int_equal(strncmp(text, "damping_number,damping[s],restitution,contact_time[s],contact_time_over_t0\n", 75),
                   0);
  const int lines = count_lines(text);
  assert_true(lines > 100 && csv_value(text, 1, 2) > 0.998 && csv_value(text, lines - 1, 2) < 0.01);
  for (int line = 2; line < lines; line++) {
    assert_true(csv_value(text, line, 1) > csv_value(text, line - 1, 1));
    assert_true(csv_value(text, line, 2) < csv_value(text, line - 1, 2));
    assert_true(csv_value(text, line, 3) < csv_value(text, line - 1, 3));
  }
  program_run(p, WORDS("check", "s.yaml"), &got);
  assert_outcome("check", &got, 0, "");
  assert_non_null(strstr(got.out, "at restitution_speed = 0.2 m/s: e 0.4, contact "));
  program_run(p,
              WORDS("check", "s.yaml", "--set",
                    "contact={normal: linear, stiffness: 1e3, restitution: 0.7, tangential: spring}"),
              &got);
  assert_outcome("check linear", &got, 0, "");
  assert_non_null(strstr(got.out, "at any speed: e 0.7, contact "));
}

static bool file_has(program *p, const char *name, const char *words) {
  char text[20000] = "";
  FILE *file = fopen(program_path(p, name), "r");
  assert_non_null(file);
  assert_true(fread(text, 1, sizeof text - 1, file) > 0);
  fclose(file);
  return strstr(text, words) != NULL;
}

// MODEL: a compression that is too fast for its masses is named by `check`, with the mass_scaling that would still do,
// and by the run's warnings; at that mass_scaling neither complains.
static void test_quasistatic(void **state) {
  program *p = *state;
  outcome got;
  const char *scaling = NULL;
  char set[80], warned[40], answer[sizeof got.out];
  write_scene(p, 10, "stages: [{kind: compress, pressure: 100, rate: 0.5, strain: 1e-3}]");
  for (int slow = 0; slow < 2; slow++) {
    snprintf(set, sizeof set, "mass_scaling=%g", slow ? 0.9 * strtod(scaling, NULL) : 1e5);
    program_run(p, WORDS("check", "s.yaml", "--set", set), &got);
    assert_outcome("check", &got, 0, "");
    assert_int_equal(strstr(got.out, "is not quasi-static: phi above 0.001") != NULL, !slow);
    memcpy(answer, got.out, sizeof answer);
    scaling = strstr(answer, "phi is 0.001 at mass_scaling ");
    assert_non_null(scaling);
    scaling += strlen("phi is 0.001 at mass_scaling ");
    double bound = strtod(scaling, NULL);
    snprintf(warned, sizeof warned, "%s", slow ? "still" : "heavy");
    program_run(p, WORDS("run", "s.yaml", "-o", warned, "-q", "--no-figures", "--set", set), &got);
    assert_outcome("run", &got, 0, "");
    strcat(warned, "/run.json");
    assert_int_equal(file_has(p, warned, "phi reached "), !slow);
    assert_true(bound > 0 && (slow ? bound > strtod(set + strlen("mass_scaling="), NULL) : bound < 1e5));
  }
}

// ROUND: `check` says what each effect of the scene costs: what the rungs add comes to what the whole takes, as
// printed.
static void test_costs(void **state) {
  program *p = *state;
  outcome got;
  write_scene(p, 0, NULL);
  program_run(p, WORDS("check", "s.yaml"), &got);
  assert_outcome("check", &got, 0, "");
  double all = 0, sum = 0, part;
  int used = 0;
  const char *costs = strstr(got.out, "costs "), *last = NULL;
  assert_non_null(costs);
  assert_int_equal(
      sscanf(costs, "costs %lf ns per grain and step on one core: hertz contacts and motion %lf%n", &all, &sum, &used),
      2);
  const char *const effects[] = {"spring friction, rotation", "gravity", "walls or plates"};
  for (size_t k = 0; k < 3; k++) {
    last = strstr(costs + used, effects[k]);
    assert_non_null(last);
    assert_int_equal(sscanf(last + strlen(effects[k]), "%lf", &part), 1);
    sum += part;
  }
  assert_true(all > 0);
  assert_true(fabs(sum - all) < 0.05 * all + 1); // printed with two and three digits
}

int main(void) {
  const struct CMUnitTest tests[] = {
      program_test(test_bad_scenes), program_test(test_step_above_critical_of_the_packing),
      program_test(test_bad_lines),  program_test(test_questions),
      program_test(test_impact),     program_test(test_quasistatic),
      program_test(test_costs),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
