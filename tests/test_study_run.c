// Studies through the program: a small one from plan to figures, a failing setting, stop and kill and go on, a batch
// run of the plan, two studies in one folder.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "program.h"
#include <time.h>

// Four settings of forty falling grains, some ten thousand steps in all.
static const char study_lines[] = "name: fall\n"
                                  "scene: s.yaml\n"
                                  "set: {stages.0.duration: 0.01, output.fields_every: 0.005}\n"
                                  "dials:\n"
                                  "  - {key: integrator.dt, values: [2e-5, 1e-5, 5e-6]}\n"
                                  "seeds: 2\n"
                                  "reference: 5e-6\n"
                                  "metrics:\n"
                                  "  - {take: value, column: kinetic, along: time, at: 0.01, within: 50%}\n"
                                  "  - {take: correlation, along: time}\n";

static void write_study(program *p, const char *from, const char *to) {
  char text[sizeof study_lines + 200];
  const char *at = strstr(study_lines, from);
  assert_non_null(at);
  snprintf(text, sizeof text, "%.*s%s%s", (int)(at - study_lines), study_lines, to, at + strlen(from));
  write_scene(p, 0, NULL);
  program_write(p, "study.yaml", text);
}

static char *text_of(program *p, const char *name) {
  size_t size;
  char *text = program_read(p, name, &size);
  if (!text)
    fail_msg("%s is not there", name);
  return text;
}

static void assert_same_text(program *p, const char *a, const char *b) {
  char *x = text_of(p, a), *y = text_of(p, b);
  assert_string_equal(x, y);
  free(x);
  free(y);
}

static void assert_holds(program *p, const char *name, const char *fragment) {
  char *text = text_of(p, name);
  if (!strstr(text, fragment))
    fail_msg("%s lacks '%s':\n%s", name, fragment, text);
  free(text);
}

// EXACT: a study leaves plan, runs, tables, figures and the sentence; its runs are ordinary ones; a second call finds
// everything done, changes no run, and writes the same tables.
static void test_whole_study(void **state) {
  program *p = *state;
  outcome got;
  write_study(p, "fall", "fall");
  program_run(p, WORDS("study", "study.yaml", "-o", "out", "-t", "2"), &got);
  assert_outcome("study", &got, 0, "");
  assert_string_equal(got.err, "");
  assert_non_null(strstr(got.out, "fall: 6 of 6 runs done, 0 failed"));
  assert_non_null(strstr(got.out, "the reference"));
  assert_holds(p, "out/study.txt", "fall: 6 of 6 runs done");
  assert_int_equal(access(program_path(p, "out/figures/error_kinetic_at_0.01.png"), R_OK), 0);
  assert_int_equal(access(program_path(p, "out/figures/error_correlation.png"), R_OK), 0);
  assert_holds(p, "out/study.csv", "dt=5e-6,5e-6,correlation,yes,2,1,0,0,0,0,paired,2,1,0,");
  // Both settings fall from the same places; with a window that begins later they do not.
  assert_null(strstr(got.out, "another state"));
  program_run(p, WORDS("verify", "out/runs/dt-1e-5_s2"), &got);
  assert_outcome("a run of it", &got, 0, "");
  const uint64_t runs = content_hash(program_path(p, "out/runs.csv")),
                 series = content_hash(program_path(p, "out/runs/dt-1e-5_s2/series.csv"));
  program_run(p, WORDS("study", "study.yaml", "-o", "out", "-q", "--no-figures"), &got);
  assert_outcome("again", &got, 0, "");
  assert_int_equal(count_lines(got.out), 1);
  assert_true(runs == content_hash(program_path(p, "out/runs.csv")));
  assert_true(series == content_hash(program_path(p, "out/runs/dt-1e-5_s2/series.csv")));
  program_run(p, WORDS("study", "study.yaml", "-o", "out", "--merge", "--no-figures", "--set", "metrics.1.from=0.005"),
              &got);
  assert_outcome("later window", &got, 0, "");
  assert_non_null(strstr(got.out, "note       dt-1e-5_s2: correlation_from_0.005: the run starts from another state"));
}

// EXACT: --plan runs nothing; its commands, run by a shell, leave what the study leaves; --merge before and after
// tells.
static void test_batch(void **state) {
  program *p = *state;
  outcome got;
  char command[9000];
  write_study(p, "seeds: 2", "seeds: 1");
  program_run(p, WORDS("study", "study.yaml", "-o", "out", "--plan"), &got);
  assert_outcome("plan", &got, 0, "");
  assert_non_null(strstr(got.out, "fall: 3 runs of 3 settings planned: out/plan.csv"));
  assert_int_not_equal(access(program_path(p, "out/study.csv"), F_OK), 0);
  assert_int_equal(symlink(p->file, program_path(p, "talus")), 0);
  snprintf(command, sizeof command, "cd '%s' && PATH=\"$PWD:$PATH\" && head -n 2 out/commands.txt | sh", p->folder);
  assert_int_equal(system(command), 0);
  program_run(p, WORDS("study", "study.yaml", "-o", "out", "--merge", "--no-figures"), &got);
  assert_outcome("merge", &got, 0, "talus: 1 of 3 runs are missing or unfinished: see out/runs.csv\n");
  assert_holds(p, "out/runs.csv", "\ndt-5e-6_s1,dt=5e-6,5e-6,1,missing,");
  program_run(p, WORDS("study", "study.yaml", "-o", "out", "-q", "--no-figures"), &got);
  assert_outcome("the rest", &got, 0, "");
  program_run(p, WORDS("study", "study.yaml", "-o", "two", "-q", "--no-figures"), &got);
  assert_outcome("all at once", &got, 0, "");
  assert_same_text(p, "out/runs/dt-2e-5_s1/series.csv", "two/runs/dt-2e-5_s1/series.csv");
  assert_same_text(p, "out/runs/dt-5e-6_s1/series.csv", "two/runs/dt-5e-6_s1/series.csv");
}

// EXACT: a setting whose runs become invalid is exit 3 with its reason in both tables and on stderr; the others are
// whole; a second call does not try it again.
static void test_failing_runs(void **state) {
  program *p = *state;
  outcome got;
  write_study(p, "{key: integrator.dt, values: [2e-5, 1e-5, 5e-6]}\n",
              "{key: limits.overlap, values: [0.5, 0.4, 1e-9]}\n");
  program_run(p,
              WORDS("study", "study.yaml", "-o", "out", "--set", "reference=0.5", "--set", "integrator.dt=2e-5",
                    "--no-figures"),
              &got);
  assert_outcome("study", &got, 3, "talus: run overlap-1e-9_s1 failed: ");
  assert_outcome("study", &got, 3, "talus: run overlap-1e-9_s2 failed: ");
  assert_int_equal(count_lines(got.err), 2);
  assert_non_null(strstr(got.out, "fall: 4 of 6 runs done, 2 failed, 0 unfinished"));
  assert_holds(p, "out/runs.csv", "\noverlap-1e-9_s1,overlap=1e-9,1e-9,1,failed,nan,nan,nan,nan,\"");
  assert_holds(p, "out/study.csv", "\noverlap=0.4,0.4,kinetic_at_0.01,no,2,");
  const uint64_t log = content_hash(program_path(p, "out/logs/overlap-1e-9_s1.log"));
  assert_true(log != 0);
  struct stat before, after;
  assert_int_equal(stat(program_path(p, "out/logs/overlap-1e-9_s1.log"), &before), 0);
  program_run(p,
              WORDS("study", "study.yaml", "-o", "out", "--set", "reference=0.5", "--set", "integrator.dt=2e-5",
                    "--merge", "-q", "--no-figures"),
              &got);
  assert_outcome("merge", &got, 3, "failed: ");
  assert_int_equal(stat(program_path(p, "out/logs/overlap-1e-9_s1.log"), &after), 0);
  assert_int_equal(before.st_mtim.tv_nsec, after.st_mtim.tv_nsec);
}

// Waits until both runs of the slowest setting have a checkpoint beyond their first.
static void wait_for_checkpoints(program *p) {
  for (int tries = 0; tries < 60000; tries++) {
    if (access(program_path(p, "out/runs/dt-1e-6_s1/checkpoint.prev.h5"), F_OK) == 0 &&
        access(program_path(p, "out/runs/dt-1e-6_s2/checkpoint.prev.h5"), F_OK) == 0)
      return;
    nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
  }
  fail_msg("no checkpoint in a minute");
}

static const char *const slow[] = {"study", "study.yaml", "-o", "out", "-t", "2", "-q", "--no-figures", NULL};

// Runs of some tenths of a second with thirty checkpoints.
static void write_slow_study(program *p) {
  write_study(p,
              "set: {stages.0.duration: 0.01, output.fields_every: 0.005}\n"
              "dials:\n"
              "  - {key: integrator.dt, values: [2e-5, 1e-5, 5e-6]}\n",
              "set: {stages.0.duration: 0.03, output: {fields_every: 0.005, checkpoint_every: 1e-3}}\n"
              "dials:\n"
              "  - {key: integrator.dt, values: [2e-5, 5e-6, 1e-6]}\n");
}

static void stop_and_go_on(program *p, int signal_number, int code) {
  outcome got;
  write_slow_study(p);
  process child = program_start(p, slow, NULL);
  wait_for_checkpoints(p);
  kill(child.id, signal_number);
  process_wait(&child, &got);
  assert_int_equal(got.code, code);
  if (code == 75) {
    assert_outcome("stopped", &got, 75, "talus: interrupted; the same command goes on\n");
    assert_holds(p, "out/runs/dt-1e-6_s1/run.json", "\"status\": \"interrupted\"");
  }
  program_run(p, slow, &got);
  assert_outcome("gone on", &got, 0, "");
  program_run(p,
              WORDS("run", "s.yaml", "-o", "unbroken", "-t", "1", "-q", "--no-figures", "--set",
                    "stages.0.duration=0.03", "--set",
                    "output={series_every: 1e-4, fields_every: 0.005, checkpoint_every: 1e-3}", "--set",
                    "integrator.dt=1e-6", "--set", "seed=2"),
              &got);
  assert_outcome("unbroken", &got, 0, "");
  assert_same_text(p, "out/runs/dt-1e-6_s2/series.csv", "unbroken/series.csv");
  program_run(p, WORDS("verify", "out/runs/dt-1e-6_s1"), &got);
  assert_outcome("verify", &got, 0, "");
}

// EXACT: SIGTERM: the runs write checkpoints, exit 75; the same command goes on to the bits of unbroken runs.
static void test_stop(void **state) {
  stop_and_go_on(*state, SIGTERM, 75);
}

// EXACT: the same after the study was killed: its runs end by themselves.
static void test_kill(void **state) {
  stop_and_go_on(*state, SIGKILL, -1);
}

// EXACT: a run killed by itself is a failed one, named with its signal; the next call takes it up again.
static void test_killed_run(void **state) {
  program *p = *state;
  outcome got;
  char list[64], command[200];
  write_slow_study(p);
  process child = program_start(p, slow, NULL);
  wait_for_checkpoints(p);
  snprintf(list, sizeof list, "/proc/%d/task/%d/children", (int)child.id, (int)child.id);
  snprintf(command, sizeof command, "kill -KILL $(cut -d' ' -f1 %s)", list);
  assert_int_equal(system(command), 0);
  process_wait(&child, &got);
  assert_outcome("study", &got, 3, "failed: ended by signal 9 (Killed)\n");
  assert_int_equal(count_lines(got.err), 1);
  program_run(p, slow, &got);
  assert_outcome("gone on", &got, 0, "");
}

// EXACT: a run killed before its first checkpoint is begun anew; a second study in the folder is refused.
static void test_rubble_and_lock(void **state) {
  program *p = *state;
  outcome got;
  write_slow_study(p);
  const char *const rubble[] = {"out", "out/runs", "out/runs/dt-2e-5_s1", "out/runs/dt-2e-5_s1/fields"};
  for (size_t k = 0; k < 4; k++)
    assert_int_equal(mkdir(program_path(p, rubble[k]), 0777), 0);
  program_write(p, "out/runs/dt-2e-5_s1/series.csv", "time[s],step\n0,");
  process child = program_start(p, slow, NULL);
  wait_for_checkpoints(p);
  process second = program_start(p, slow, NULL);
  process_wait(&second, &got);
  assert_outcome("second study", &got, 2, "a study is at work in out\n");
  p->running = child.id;
  process_wait(&child, &got);
  assert_outcome("study", &got, 0, "");
  assert_holds(p, "out/runs.csv", "\ndt-2e-5_s1,dt=2e-5,2e-5,1,done,");
}

// EXACT: a wrong study is exit 2 and one line, with nothing written; so is a plan whose scene has changed.
static void test_refused(void **state) {
  program *p = *state;
  outcome got;
  write_study(p, "integrator.dt", "integrator.dr");
  assert_refused(p, "unknown dial", WORDS("study", "study.yaml", "-o", "out"), 2,
                 "study.yaml:5: integrator.dr: unknown key; did you mean 'dt'?");
  write_study(p, "seeds: 2", "seeds: 0");
  assert_refused(p, "no seeds", WORDS("study", "study.yaml", "-o", "out"), 2, "study.yaml:6: seeds: gives no seeds");
  assert_refused(p, "no study", WORDS("study", "none.yaml", "-o", "out"), 2, "none.yaml: cannot be read");
  assert_refused(p, "option", WORDS("study", "study.yaml", "--resume"), 2, "--resume: is not an option here");
  assert_refused(p, "nothing to merge", WORDS("study", "study.yaml", "-o", "out", "--merge", "--set", "seeds=2"), 2,
                 "--merge: out holds no plan.csv");
  write_study(p, "fall", "fall");
  program_run(p, WORDS("study", "study.yaml", "-o", "out", "--plan"), &got);
  assert_outcome("plan", &got, 0, "");
  assert_refused(p, "changed", WORDS("study", "study.yaml", "-o", "out", "--set", "material.friction=0.1"), 2,
                 "out/plan.csv: run dt-2e-5_s1 was planned with another scene");
}

int main(void) {
  const struct CMUnitTest tests[] = {
      program_test(test_whole_study), program_test(test_batch),      program_test(test_failing_runs),
      program_test(test_stop),        program_test(test_kill),       program_test(test_rubble_and_lock),
      program_test(test_refused),     program_test(test_killed_run),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
