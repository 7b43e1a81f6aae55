// The program from outside: exit codes, messages, what is written and what is not; interrupted and resumed runs.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "program.h"
#include <time.h>

#define WORDS(...) ((const char *const[]){__VA_ARGS__, NULL})

// One line of scene per entry of this table: messages name lines.
static const char *const scene_lines[] = {
    "name: small",
    "seed: 3",
    "grains: {count: 40, radius: {law: uniform, min: 0.5e-3, max: 1e-3}, thickness: 1.5e-3}",
    "material: {young: 1e7, poisson: 0.3, density: 2000, friction: 0.5, damping: 1e-4}",
    "contact: {normal: hertz, tangential: spring}",
    "gravity: [0.5, -9.81]",
    "pack: {method: drop_and_roll, width: 10e-3}",
    "walls: [{from: [-1, 0], to: [1, 0], young: .inf}]",
    "integrator: {scheme: verlet, dt: 1e-6}",
    "stages: [{kind: free, duration: 0.02}]",
    "output: {series_every: 1e-4, fields_every: 1e-2, checkpoint_every: 5e-3}",
};

enum { LINES = sizeof scene_lines / sizeof *scene_lines };

// Writes the scene as s.yaml, with line `line` (from 1) replaced; 0 for none.
static void write_scene(program *p, int line, const char *text) {
  char scene[4096] = "";
  for (int k = 0; k < LINES; k++) {
    strcat(scene, k + 1 == line ? text : scene_lines[k]);
    strcat(scene, "\n");
  }
  program_write(p, "s.yaml", scene);
}

static int count_lines(const char *text) {
  int lines = 0;
  for (; *text; text++)
    lines += *text == '\n';
  return lines;
}

static void assert_outcome(const char *what, const outcome *got, int code, const char *fragment) {
  if (got->code != code || !strstr(got->err, fragment))
    fail_msg("%s: exit %d, expected %d with '%s' on stderr; stderr:\n%s", what, got->code, code, fragment, got->err);
}

// Refused: the exit code, the message alone on stderr, nothing on stdout, no entry of the folder touched.
static void assert_refused(program *p, const char *what, const char *const *words, int code, const char *fragment) {
  char *before = program_listing(p);
  outcome got;
  program_run(p, words, &got);
  assert_outcome(what, &got, code, fragment);
  if (count_lines(got.err) != 1 || got.err[strlen(got.err) - 1] != '\n')
    fail_msg("%s: expected one line on stderr, got:\n%s", what, got.err);
  if (*got.out)
    fail_msg("%s: expected nothing on stdout, got:\n%s", what, got.out);
  char *after = program_listing(p);
  if (strcmp(before, after) != 0)
    fail_msg("%s: files changed; before:\n%safter:\n%s", what, before, after);
  free(before);
  free(after);
}

static void run_to_the_end(program *p, const char *dir) {
  outcome got;
  program_run(p, WORDS("run", "s.yaml", "-o", dir, "-t", "1", "-q", "--no-figures"), &got);
  assert_outcome(dir, &got, 0, "");
  assert_string_equal(got.err, "");
}

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
    {"unknown stage", 10, "stages: [{kind: squeeze, duration: 1}]", 2, ":10: stages.0.kind: "},
    {"key twice", 2, "name: again", 2, ":2: name: "},
    {"not YAML", 5, "contact: {normal: [hertz, tangential: spring}", 2, ":5: "},
    {"dt above critical, by the scene alone", 5,
     "contact: {normal: linear, stiffness: 1e8, damping: 0, tangential: none}", 2,
     ":9: integrator.dt: 1e-06 s is above the critical step"},
};

// EXACT: each kind of bad scene gets exit 2 and one line FILE:LINE: key: what, from `run` and `check`; nothing written.
static void test_bad_scenes(void **state) {
  (void)state;
  program p;
  program_begin(&p);
  for (size_t k = 0; k < sizeof bad_scenes / sizeof *bad_scenes; k++) {
    const bad_scene *bad = &bad_scenes[k];
    char message[200];
    snprintf(message, sizeof message, "s.yaml%s", bad->message);
    write_scene(&p, bad->line, bad->text);
    assert_refused(&p, bad->what, WORDS("run", "s.yaml", "-o", "out"), bad->code, message);
    assert_refused(&p, bad->what, WORDS("check", "s.yaml"), bad->code, message);
  }
  program_end(&p);
}

// EXACT: a step that only the packed grains show to be above critical is exit 3, and nothing is written either.
static void test_step_above_critical_of_the_packing(void **state) {
  (void)state;
  program p;
  program_begin(&p);
  write_scene(&p, 3, "grains: {list: [{x: 0, y: 1e-3, r: 1e-3}, {x: 1.9e-3, y: 1e-3, r: 1e-3}]}");
  assert_refused(&p, "dt above critical", WORDS("run", "s.yaml", "-o", "out", "--set", "integrator.dt=1e-2"), 3,
                 "integrator.dt = 0.01 s is above the critical step");
  program_end(&p);
}

typedef struct bad_line {
  const char *words[8]; // ended by NULL
  int code;
  const char *message;
} bad_line;

static const bad_line bad_lines[] = {
    {{"fly"}, 2, "talus: fly: unknown command; accepted: run, check, plot, verify, keys"},
    {{"--fly"}, 2, "talus: --fly: unknown option"},
    {{"run"}, 2, "talus run: SCENE.yaml: is missing"},
    {{"check"}, 2, "talus check: SCENE.yaml: is missing"},
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
    {{"plot", "none"}, 2, "none"},
    {{"verify", "none"}, 2, "none: holds no run"},
    {{"keys", "material.fiction"}, 2, "talus keys: material.fiction: no such key; did you mean material.friction?"},
    {{"keys", "--fast"}, 2, "talus keys: --fast: is not an option here"},
    {{"keys", "name", "seed"}, 2, "talus keys: seed: is one word too many"},
};

// EXACT: each kind of bad command line gets its exit code and one line that names the word; nothing written.
static void test_bad_lines(void **state) {
  (void)state;
  program p;
  program_begin(&p);
  write_scene(&p, 0, NULL);
  for (size_t k = 0; k < sizeof bad_lines / sizeof *bad_lines; k++) {
    const bad_line *bad = &bad_lines[k];
    assert_refused(&p, bad->message, bad->words, bad->code, bad->message);
  }
  outcome got;
  program_run(&p, (const char *const[]){NULL}, &got);
  assert_outcome("no command", &got, 2, "usage: talus COMMAND");
  assert_string_equal(got.out, "");
  program_end(&p);
}

// EXACT: what asks a question is answered on stdout with exit 0, nothing on stderr, nothing written; a full stdout
// is 4.
static void test_questions(void **state) {
  (void)state;
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
  program p;
  program_begin(&p);
  write_scene(&p, 0, NULL);
  char *before = program_listing(&p);
  for (size_t k = 0; k < sizeof questions / sizeof *questions; k++) {
    outcome got;
    program_run(&p, questions[k].words, &got);
    if (got.code != 0 || *got.err || !strstr(got.out, questions[k].answer))
      fail_msg("%s: exit %d, expected '%s', got:\n%s%s", questions[k].words[0], got.code, questions[k].answer, got.out,
               got.err);
  }
  process child = program_start(&p, WORDS("keys"), "/dev/full");
  outcome got;
  process_wait(&child, &got);
  assert_outcome("keys > /dev/full", &got, 4, "standard output: cannot be written");
  char *after = program_listing(&p);
  assert_string_equal(before, after);
  free(before);
  free(after);
  program_end(&p);
}

// Where: bytes from the start, or from the end when negative.
static void damage(program *p, const char *name, long where) {
  FILE *file = fopen(program_path(p, name), "r+");
  assert_non_null(file);
  fseek(file, where, where < 0 ? SEEK_END : SEEK_SET);
  int c = getc(file);
  fseek(file, -1, SEEK_CUR);
  putc(c ^ 16, file);
  assert_int_equal(fclose(file), 0);
}

// EXACT: a folder with a run is refused to a new one; a finished one has nothing to resume, with exit 0; a foreign and
// a damaged checkpoint are refused with exit 2; all without a touch.
static void test_folder_with_a_run(void **state) {
  (void)state;
  program p;
  program_begin(&p);
  write_scene(&p, 0, NULL);
  run_to_the_end(&p, "out");
  assert_refused(&p, "second run", WORDS("run", "s.yaml", "-o", "out"), 2, "out already holds a run");
  char *before = program_listing(&p);
  outcome got;
  program_run(&p, WORDS("run", "s.yaml", "-o", "out", "--resume"), &got);
  assert_outcome("finished run", &got, 0, "");
  assert_non_null(strstr(got.out, "the run is complete, nothing to resume"));
  char *after = program_listing(&p);
  assert_string_equal(before, after);
  free(before);
  free(after);
  assert_refused(&p, "foreign checkpoint", WORDS("run", "s.yaml", "-o", "out", "--resume", "--set", "seed=4"), 2,
                 "out/checkpoint.h5 belongs to another scene: line 2 of the resolved scene is \"seed: 3\" there");
  const char *const resume[] = {"run", "s.yaml", "-o", "out", "--resume", NULL};
  damage(&p, "out/checkpoint.h5", 2000);
  assert_refused(&p, "damaged checkpoint", resume, 2, "out/checkpoint.h5 is damaged");
  assert_refused(&p, "the one before", resume, 2, "checkpoint.prev.h5 is intact: move it to checkpoint.h5");
  damage(&p, "out/checkpoint.prev.h5", -3);
  assert_refused(&p, "both damaged", resume, 2, "there is no intact checkpoint.prev.h5");
  assert_int_equal(truncate(program_path(&p, "out/checkpoint.h5"), 0), 0);
  assert_refused(&p, "empty checkpoint", resume, 2, "out/checkpoint.h5 is damaged");
  program_end(&p);
}

// EXACT: verify finds a sound run sound (exit 0) and names a damaged frame (exit 4); plot draws and names the files.
static void test_verify_and_plot(void **state) {
  (void)state;
  program p;
  program_begin(&p);
  write_scene(&p, 9, "integrator: {scheme: verlet, dt: 1e-5}");
  run_to_the_end(&p, "out");
  outcome got;
  program_run(&p, WORDS("verify", "out"), &got);
  assert_outcome("sound run", &got, 0, "");
  assert_non_null(strstr(got.out, " 0 damaged"));
  program_run(&p, WORDS("plot", "out"), &got);
  assert_outcome("plot", &got, 0, "");
  assert_non_null(strstr(got.out, "out/figures/"));
  assert_int_equal(access(program_path(&p, "out/figures/grains.png"), R_OK), 0);
  damage(&p, "out/fields/000001.h5", 3000);
  program_run(&p, WORDS("verify", "out"), &got);
  assert_outcome("damaged frame", &got, 4, "");
  assert_non_null(strstr(got.out, "fields/000001.h5"));
  program_end(&p);
}

// EXACT: a run that goes bad is exit 3 and one line that names the last good checkpoint, which is there and sound.
static void test_invalid_run(void **state) {
  (void)state;
  program p;
  program_begin(&p);
  write_scene(&p, 9, "integrator: {scheme: verlet, dt: 2e-3, force: true}");
  outcome got;
  program_run(&p,
              WORDS("run", "s.yaml", "-o", "out", "-q", "--set", "stages.0.duration=20", "--set",
                    "output.checkpoint_every=2e-3"),
              &got);
  assert_outcome("invalid", &got, 3, "; last good checkpoint: out/checkpoint.h5\n");
  assert_int_equal(count_lines(got.err), 1);
  assert_string_equal(got.out, "");
  program_run(&p, WORDS("verify", "out"), &got);
  assert_outcome("verify after it", &got, 0, "");
  program_end(&p);
}

// Starts a run and waits until its series holds `rows` rows.
static process start_and_wait(program *p, const char *dir, int rows) {
  char name[64];
  snprintf(name, sizeof name, "%s/series.csv", dir);
  process child = program_start(p, WORDS("run", "s.yaml", "-o", dir, "-t", "1", "--no-figures"), NULL);
  for (int tries = 0; tries < 60000; tries++) {
    size_t size;
    char *series = program_read(p, name, &size);
    bool enough = series && count_lines(series) > rows;
    free(series);
    siginfo_t ended = {0};
    waitid(P_PID, (id_t)child.id, &ended, WEXITED | WNOHANG | WNOWAIT);
    if (enough || ended.si_pid)
      return child;
    nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
  }
  fail_msg("%s: no row in a minute", dir);
  return child;
}

// Every row stands at a multiple of the 100 steps of series_every: a row written on the way out would not.
static void assert_no_extra_row(program *p, const char *name) {
  size_t size;
  char *series = program_read(p, name, &size);
  assert_non_null(series);
  assert_true(size > 0 && series[size - 1] == '\n');
  const char *row = strchr(series, '\n') + 1;
  for (double step = 0; *row; row = strchr(row, '\n') + 1, step += 100)
    assert_true(strtod(strchr(row, ',') + 1, NULL) == step);
  free(series);
}

static void assert_same_file(program *p, const char *a, const char *b) {
  size_t a_size = 0, b_size = 0;
  char *a_text = program_read(p, a, &a_size), *b_text = program_read(p, b, &b_size);
  assert_true(a_text && b_text && a_size == b_size);
  assert_memory_equal(a_text, b_text, a_size);
  free(a_text);
  free(b_text);
}

// Interrupts a run by `signal` on its way; the machine may be so busy that it is over before: then once more.
static void interrupt(program *p, const char *dir, int signal, outcome *got) {
  for (int tries = 0; tries < 10; tries++) {
    process child = start_and_wait(p, dir, 5);
    kill(child.id, signal);
    process_wait(&child, got);
    if (got->code != 0)
      return;
    char finished[64];
    snprintf(finished, sizeof finished, "%s-%d", dir, tries);
    char *from = strdup(program_path(p, dir));
    assert_int_equal(rename(from, program_path(p, finished)), 0);
    free(from);
  }
  fail_msg("the run is always over before the signal reaches it");
}

// EXACT: SIGTERM, SIGINT and SIGUSR1 end a run with 75, a line that names --resume and no extra row; resumed, on
// another number of threads, the series has the bytes of an unbroken run.
static void test_interrupt_and_resume(void **state) {
  (void)state;
  static const struct {
    int signal;
    const char *dir, *series;
  } ways[] = {
      {SIGTERM, "term", "term/series.csv"}, {SIGINT, "int", "int/series.csv"}, {SIGUSR1, "usr1", "usr1/series.csv"}};
  program p;
  program_begin(&p);
  write_scene(&p, 10, "stages: [{kind: free, duration: 0.05}]");
  run_to_the_end(&p, "whole");
  for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
    outcome got;
    char hint[100];
    interrupt(&p, ways[k].dir, ways[k].signal, &got);
    snprintf(hint, sizeof hint, "talus run s.yaml -o %s --resume", ways[k].dir);
    assert_outcome(ways[k].dir, &got, 75, hint);
    assert_int_equal(count_lines(got.err), 1);
    assert_string_equal(got.out, "");
    assert_no_extra_row(&p, ways[k].series);
    program_run(&p, WORDS("run", "s.yaml", "-o", ways[k].dir, "-t", "2", "-q", "--no-figures", "--resume"), &got);
    assert_outcome("resumed", &got, 0, "");
    assert_same_file(&p, "whole/series.csv", ways[k].series);
    program_run(&p, WORDS("verify", ways[k].dir), &got);
    assert_outcome("verified", &got, 0, "");
  }
  program_end(&p);
}

// EXACT: while a run is at work in a folder a second one is refused, new or resumed, with exit 2; the first goes on.
static void test_two_runs_in_one_folder(void **state) {
  (void)state;
  program p;
  program_begin(&p);
  write_scene(&p, 10, "stages: [{kind: free, duration: 100}]");
  process first = start_and_wait(&p, "out", 3);
  outcome got;
  program_run(&p, WORDS("run", "s.yaml", "-o", "out"), &got);
  assert_outcome("new beside it", &got, 2, "a run is at work in out");
  assert_string_equal(got.out, "");
  program_run(&p, WORDS("run", "s.yaml", "-o", "out", "--resume"), &got);
  assert_outcome("resumed beside it", &got, 2, "out");
  assert_string_equal(got.out, "");
  kill(first.id, SIGTERM);
  process_wait(&first, &got);
  assert_outcome("first", &got, 75, "--resume");
  program_run(&p, WORDS("verify", "out"), &got);
  assert_outcome("verified", &got, 0, "");
  program_end(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_bad_scenes),
      cmocka_unit_test(test_step_above_critical_of_the_packing),
      cmocka_unit_test(test_bad_lines),
      cmocka_unit_test(test_questions),
      cmocka_unit_test(test_folder_with_a_run),
      cmocka_unit_test(test_verify_and_plot),
      cmocka_unit_test(test_invalid_run),
      cmocka_unit_test(test_interrupt_and_resume),
      cmocka_unit_test(test_two_runs_in_one_folder),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
