// Runs of the program from outside: folders that hold a run, damaged and foreign checkpoints, runs gone bad,
// interrupted and resumed runs, two runs in one folder.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "program.h"
#include <time.h>

static void run_to_the_end(program *p, const char *dir) {
  outcome got;
  program_run(p, WORDS("run", "s.yaml", "-o", dir, "-t", "1", "-q", "--no-figures"), &got);
  assert_outcome(dir, &got, 0, "");
  assert_string_equal(got.err, "");
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
  program *p = *state;
  write_scene(p, 0, NULL);
  run_to_the_end(p, "out");
  assert_refused(p, "second run", WORDS("run", "s.yaml", "-o", "out"), 2, "out already holds a run");
  char *before = program_listing(p);
  outcome got;
  program_run(p, WORDS("run", "s.yaml", "-o", "out", "--resume"), &got);
  assert_outcome("finished run", &got, 0, "");
  assert_non_null(strstr(got.out, "the run is complete, nothing to resume"));
  char *after = program_listing(p);
  assert_string_equal(before, after);
  free(before);
  free(after);
  assert_refused(p, "foreign checkpoint", WORDS("run", "s.yaml", "-o", "out", "--resume", "--set", "seed=4"), 2,
                 "out/checkpoint.h5 belongs to another scene: line 2 of the resolved scene is \"seed: 3\" there");
  const char *const resume[] = {"run", "s.yaml", "-o", "out", "--resume", NULL};
  damage(p, "out/checkpoint.h5", 2000);
  assert_refused(p, "damaged checkpoint", resume, 2, "out/checkpoint.h5 is damaged");
  assert_refused(p, "the one before", resume, 2, "checkpoint.prev.h5 is intact: move it to checkpoint.h5");
  damage(p, "out/checkpoint.prev.h5", -3);
  assert_refused(p, "both damaged", resume, 2, "there is no intact checkpoint.prev.h5");
  assert_int_equal(truncate(program_path(p, "out/checkpoint.h5"), 0), 0);
  assert_refused(p, "empty checkpoint", resume, 2, "out/checkpoint.h5 is damaged");
}

// EXACT: verify finds a sound run sound (exit 0) and names a damaged frame (exit 4); plot draws and names the files.
static void test_verify_and_plot(void **state) {
  program *p = *state;
  write_scene(p, 9, "integrator: {scheme: verlet, dt: 1e-5}");
  run_to_the_end(p, "out");
  outcome got;
  program_run(p, WORDS("verify", "out"), &got);
  assert_outcome("sound run", &got, 0, "");
  assert_non_null(strstr(got.out, " 0 damaged"));
  program_run(p, WORDS("plot", "out"), &got);
  assert_outcome("plot", &got, 0, "");
  assert_non_null(strstr(got.out, "out/figures/"));
  assert_int_equal(access(program_path(p, "out/figures/grains.png"), R_OK), 0);
  damage(p, "out/fields/000001.h5", 3000);
  program_run(p, WORDS("verify", "out"), &got);
  assert_outcome("damaged frame", &got, 4, "");
  assert_non_null(strstr(got.out, "fields/000001.h5"));
}

// EXACT: a run that goes bad is exit 3 and one line that names the last good checkpoint, which is there and sound.
static void test_invalid_run(void **state) {
  program *p = *state;
  program_write(p, "s.yaml", two_grains);
  outcome got;
  program_run(p, WORDS("run", "s.yaml", "-o", "out"), &got);
  assert_outcome("invalid", &got, 3, "; last good checkpoint: out/checkpoint.h5\n");
  assert_int_equal(count_lines(got.err), 1);
  assert_string_equal(got.out, "");
  program_run(p, WORDS("verify", "out"), &got);
  assert_outcome("verify after it", &got, 0, "");
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
  static const struct {
    int signal;
    const char *dir, *series;
  } ways[] = {
      {SIGTERM, "term", "term/series.csv"}, {SIGINT, "int", "int/series.csv"}, {SIGUSR1, "usr1", "usr1/series.csv"}};
  program *p = *state;
  write_scene(p, 10, "stages: [{kind: free, duration: 0.05}]");
  run_to_the_end(p, "whole");
  for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
    outcome got;
    char hint[100];
    interrupt(p, ways[k].dir, ways[k].signal, &got);
    snprintf(hint, sizeof hint, "talus run s.yaml -o %s --resume", ways[k].dir);
    assert_outcome(ways[k].dir, &got, 75, hint);
    assert_int_equal(count_lines(got.err), 1);
    assert_string_equal(got.out, "");
    assert_no_extra_row(p, ways[k].series);
    program_run(p, WORDS("run", "s.yaml", "-o", ways[k].dir, "-t", "2", "-q", "--no-figures", "--resume"), &got);
    assert_outcome("resumed", &got, 0, "");
    assert_same_file(p, "whole/series.csv", ways[k].series);
    program_run(p, WORDS("verify", ways[k].dir), &got);
    assert_outcome("verified", &got, 0, "");
  }
}

// EXACT: while a run is at work in a folder a second one is refused, new or resumed, with exit 2; the first goes on.
static void test_two_runs_in_one_folder(void **state) {
  program *p = *state;
  write_scene(p, 10, "stages: [{kind: free, duration: 100}]");
  process first = start_and_wait(p, "out", 3);
  outcome got;
  program_run(p, WORDS("run", "s.yaml", "-o", "out"), &got);
  assert_outcome("new beside it", &got, 2, "a run is at work in out");
  assert_string_equal(got.out, "");
  program_run(p, WORDS("run", "s.yaml", "-o", "out", "--resume"), &got);
  assert_outcome("resumed beside it", &got, 2, "out");
  assert_string_equal(got.out, "");
  kill(first.id, SIGTERM);
  process_wait(&first, &got);
  assert_outcome("first", &got, 75, "--resume");
  program_run(p, WORDS("verify", "out"), &got);
  assert_outcome("verified", &got, 0, "");
}

int main(void) {
  const struct CMUnitTest tests[] = {
      program_test(test_folder_with_a_run),
      program_test(test_verify_and_plot),
      program_test(test_invalid_run),
      program_test(test_interrupt_and_resume),
      program_test(test_two_runs_in_one_folder),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
