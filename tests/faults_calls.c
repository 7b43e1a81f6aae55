// Every n-th call for a file or for memory fails, once or from then on, in a run and in a resumed one: one clear line,
// the right exit code, nothing corrupt, nothing short, and from the last checkpoint on the bits of the unbroken run.
// Short: a few n of each; long: n = 1, 2, 3, ... until the run passes untouched.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "faults.h"
#include "files.h"
#include "variants.h"

typedef struct way {
  const char *what; // line of the table
  const char *call;
  int error;
  bool stays;
} way;

static const way ways[] = {
    {"a write fails once", "write", EIO, false},
    {"the disk is full from a write on", "write", ENOSPC, true},
    {"an fsync fails", "fsync", EIO, false},
    {"a close fails", "close", EDQUOT, false},
    {"a rename fails", "rename", EACCES, false},
    {"a link fails: no hard links here", "link", EPERM, false},
    {"no links and no renames from one on", "rename", EROFS, true},
    {"an open fails", "open", EMFILE, false},
    {"read-only from a call on", "open", EROFS, true},
    {"an unlink fails", "unlink", EBUSY, false},
    {"a mkdir fails", "mkdir", ENOSPC, false},
    {"an ftruncate fails", "ftruncate", EIO, false},
    {"a lock fails", "flock", ENOLCK, false},
    {"a read fails", "read", EIO, false},
    {"an fstat fails", "fstat", EIO, false},
    {"an opendir fails", "opendir", EMFILE, false},
    {"an fopen fails", "fopen", EMFILE, false},
    {"every call on a file fails from one on", "files", EIO, true},
};

static const char *const sets[] = {
    "--set=output={series_every: 3e-4, fields_every: 8e-4, checkpoint_every: 8e-4, tracks: [1]}", NULL};

// What a process said and did that met the fault.
static void check_failure(const outcome *got, const way *w, const char *what) {
  if (got->code == 0) {
    if (*got->err)
      fail_msg("%s: exit 0, and yet\n%s", what, got->err);
    return;
  }
  // Input that cannot be read is bad input.
  const bool input = got->code == 2 && strncmp(got->err, "s.yaml: ", 8) == 0;
  if (got->code != 4 && !input)
    fail_msg("%s: exit %d\n%s", what, got->code, got->err);
  const size_t length = strlen(got->err);
  if (count_lines(got->err) != 1 || got->err[length - 1] != '\n' || *got->out)
    fail_msg("%s: not one clear line:\n%s%s", what, got->err, got->out);
  if (!strstr(got->err, w->error == ENOMEM ? "memory" : strerror(w->error)))
    fail_msg("%s: '%s' is not in: %s", what, strerror(w->error), got->err);
}

typedef struct bench {
  char *print;  // of the unbroken run
  bool resumed; // the process that fails is one that goes on from half
} bench;

static void begin_bench(program *p, bench *b) {
  outcome got;
  program_write(p, "s.yaml", variants_scene);
  faults_done(p, &(faults_run){"whole", "1", sets, false});
  b->print = faults_print(p, "whole");
  if (!b->resumed)
    return;
  faults_plan(p, "write", 20, "s15");
  faults_do(p, &(faults_run){"half", "1", sets, false}, &got);
  assert_int_equal(got.code, 75);
  assert_true(faults_struck(p));
}

static void copy_file(const char *from, const char *to) {
  unsigned char *data;
  size_t size;
  tal_error err;
  assert_int_equal(tal_file_read(from, &data, &size, &err), TAL_OK);
  const int fd = open(to, O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  assert_int_equal(tal_file_put(fd, to, data, size, &err), TAL_OK);
  close(fd);
  free(data);
}

// Folder work as the process that is to fail finds it: a copy of half, or none.
static void begin_work(program *p, const bench *b) {
  char from[4400], to[9000];
  faults_remove(p, "work");
  if (!b->resumed)
    return;
  snprintf(from, sizeof from, "%s/half", p->folder);
  FTS *walk = walk_begin(from);
  for (FTSENT *entry; (entry = fts_read(walk));) {
    snprintf(to, sizeof to, "%s/work%s", p->folder, entry->fts_path + strlen(from));
    if (entry->fts_info == FTS_D)
      assert_int_equal(mkdir(to, 0777), 0);
    if (entry->fts_info == FTS_F)
      copy_file(entry->fts_path, to);
  }
  fts_close(walk);
}

// The n-th call fails; false when there is no n-th.
static bool fail_nth(program *p, const bench *b, const way *w, long n) {
  const faults_run run = {"work", "1", sets, b->resumed};
  char how[16], what[120];
  outcome got;
  snprintf(how, sizeof how, "%d%s", w->error, w->stays ? "+" : "");
  snprintf(what, sizeof what, "%s: %s %ld%s", w->what, w->call, n, b->resumed ? ", resumed" : "");
  begin_work(p, b);
  faults_plan(p, w->call, n, how);
  faults_do(p, &run, &got);
  if (!faults_struck(p))
    return false;
  check_failure(&got, w, what);
  faults_plan(p, NULL, 0, NULL);
  if (got.code == 0)
    assert_printed(p, "work", b->print, what);
  else
    faults_recover(p, &run, b->print, what);
  assert_sound(p, "work", what);
  return true;
}

// Number of calls of that kind in a process that meets no fault.
static long calls(program *p, const bench *b, const char *call) {
  outcome got;
  begin_work(p, b);
  faults_plan(p, call, 0, "count");
  faults_do(p, &(faults_run){"work", "1", sets, b->resumed}, &got);
  assert_int_equal(got.code, 0);
  faults_plan(p, NULL, 0, NULL);
  return faults_count(p);
}

static void fail_all(program *p, bool resumed) {
  bench b = {.resumed = resumed};
  begin_bench(p, &b);
  for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
    if (resumed && !faults_long() && k % 3)
      continue;
    const long all = calls(p, &b, ways[k].call);
    const long stride = faults_long() ? 1 : all + 1;
    long trials = 0;
    char what[80];
    for (long n = faults_long() ? 1 : 1 + (long)(7 * k) % (all ? all : 1); fail_nth(p, &b, &ways[k], n); n += stride)
      trials++;
    assert_int_equal(trials, all ? (faults_long() ? all : 1) : 0);
    snprintf(what, sizeof what, "%s%s", ways[k].what, resumed ? ", resumed" : "");
    if (trials)
      faults_held(what, trials, "one line, exit 4 or no harm; resumed to the same bits");
  }
  free(b.print);
}

// EXACT: calls on files, in a run from the start.
static void files_of_a_run(void **state) {
  fail_all(*state, false);
}

// EXACT: the same in a run that goes on from a checkpoint.
static void files_of_a_resumed_run(void **state) {
  fail_all(*state, true);
}

// EXACT: memory that the program itself asks for.
static void memory(void **state) {
  program *p = *state;
  static const way none = {"no memory", "memory", ENOMEM, false};
  long trials = 0;
  for (int resumed = 0; resumed < 2; resumed++) {
    bench b = {.resumed = resumed};
    begin_bench(p, &b);
    const long all = calls(p, &b, none.call), first = faults_long() ? 100 : 2;
    const long stride = 1 + (all - first) / (faults_long() ? 150 : 4);
    for (long n = 1; fail_nth(p, &b, &none, n); n += n < first ? 1 : stride)
      trials++;
    free(b.print);
    faults_remove(p, "whole");
  }
  faults_held("an allocation fails", trials, "one line, exit 4; resumed to the same bits");
}

int main(int argc, char **argv) {
  if (argc > 1)
    cmocka_set_test_filter(argv[1]);
  const struct CMUnitTest tests[] = {
      faults_test(files_of_a_run),
      faults_test(files_of_a_resumed_run),
      faults_test(memory),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
