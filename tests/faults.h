// What the programs of `make faults` share: the program whose calls fail on demand (tests/faults/inject.c), runs of a
// scene with it, what two runs have in common bit by bit, and the table of what held. Each has a short form, a part of
// `make test`, and a long one (FAULTS=long).
#ifndef TAL_TEST_FAULTS_H
#define TAL_TEST_FAULTS_H

#include "program.h"
#include "verify.h"
#include <time.h>

static inline bool faults_long(void) {
  const char *form = getenv("FAULTS");
  return form && strcmp(form, "long") == 0;
}

// A line of the table, where FAULTS_TABLE names a file for it.
static inline void faults_held(const char *what, long trials, const char *held) {
  const char *path = getenv("FAULTS_TABLE");
  FILE *table = path ? fopen(path, "a") : NULL;
  if (!table)
    return;
  fprintf(table, "%-44s %9ld  %s\n", what, trials, held);
  fclose(table);
}

// Set-up of a test case, as program_begin: p->file is the faulty program, $TALUS/../tests/faults/talus. The folder is
// in memory where there is such a place, unless TMPDIR says where: thousands of fsyncs would only test the disk.
static inline int faults_begin(void **state) {
  if (!getenv("TMPDIR") && access("/dev/shm", W_OK) == 0)
    setenv("TMPDIR", "/dev/shm", 1);
  if (program_begin(state) != 0)
    return -1;
  program *p = *state;
  char *slash = strrchr(p->file, '/');
  snprintf(slash, sizeof p->file - (size_t)(slash - p->file), "/tests/faults/talus");
  if (access(p->file, X_OK) == 0)
    return 0;
  fprintf(stderr, "%s is not there: make tests/faults/talus in the build folder\n", p->file);
  return -1;
}

#define faults_test(function) cmocka_unit_test_setup_teardown(function, faults_begin, program_end)

// The next processes meet this fault; call NULL: none any more.
static inline void faults_plan(program *p, const char *call, long at, const char *how) {
  char plan[4600];
  if (!call) {
    unsetenv("TALUS_FAULT");
    return;
  }
  snprintf(plan, sizeof plan, "%s:%ld:%s:%s", call, at, how, program_path(p, "mark"));
  setenv("TALUS_FAULT", plan, 1);
}

// Has the fault struck since the last question?
static inline bool faults_struck(program *p) {
  return unlink(program_path(p, "mark")) == 0;
}

// How many calls of that kind the process before made; its plan was `count`.
static inline long faults_count(program *p) {
  size_t size;
  char *text = program_read(p, "mark", &size);
  assert_non_null(text);
  const long count = strtol(text, NULL, 10);
  free(text);
  assert_true(faults_struck(p));
  return count;
}

// A run of s.yaml: where to, threads, words of --set=KEY=VALUE (ended by NULL).
typedef struct faults_run {
  const char *dir, *threads;
  const char *const *sets;
  bool resume;
} faults_run;

static inline process faults_start(program *p, const faults_run *run) {
  const char *words[22] = {"run", "s.yaml", "-o", run->dir, "-t", run->threads ? run->threads : "1", "-q"};
  size_t count = 7;
  words[count++] = "--no-figures";
  if (run->resume)
    words[count++] = "--resume";
  for (size_t k = 0; run->sets && run->sets[k]; k++) {
    assert_true(count < 21);
    words[count++] = run->sets[k];
  }
  return program_start(p, words, NULL);
}

static inline void faults_do(program *p, const faults_run *run, outcome *got) {
  process child = faults_start(p, run);
  process_wait(&child, got);
}

static inline void faults_done(program *p, const faults_run *run) {
  outcome got;
  faults_plan(p, NULL, 0, NULL);
  faults_do(p, run, &got);
  if (got.code != 0 || *got.err)
    fail_msg("%s%s: exit %d\n%s", run->dir, run->resume ? " --resume" : "", got.code, got.err);
}

static inline void faults_remove(program *p, const char *dir) {
  char path[4400];
  snprintf(path, sizeof path, "%s/%s", p->folder, dir);
  if (access(path, F_OK) != 0)
    return;
  FTS *walk = walk_begin(path);
  for (FTSENT *entry; (entry = fts_read(walk));) {
    if (entry->fts_info != FTS_D)
      remove(entry->fts_accpath);
  }
  fts_close(walk);
}

// Files that differ between equal runs: clocks in run.json, which checkpoint came before the last, the lock.
static inline bool differs_by_right(const char *name) {
  return !strcmp(name, "run.json") || !strcmp(name, "checkpoint.prev.h5") || !strcmp(name, ".lock");
}

// Name, length and hash of each file that equal runs have in common. Owned by the caller.
static inline char *faults_print(program *p, const char *dir) {
  char folder[4400], *text = NULL;
  size_t size = 0;
  snprintf(folder, sizeof folder, "%s/%s", p->folder, dir);
  FILE *out = open_memstream(&text, &size);
  FTS *walk = walk_begin(folder);
  for (FTSENT *entry; (entry = fts_read(walk));) {
    if (entry->fts_info == FTS_F && !differs_by_right(entry->fts_name))
      fprintf(out, "%s %lld %016llx\n", entry->fts_path + strlen(folder) + 1, (long long)entry->fts_statp->st_size,
              (unsigned long long)content_hash(entry->fts_accpath));
  }
  fts_close(walk);
  fclose(out);
  return text;
}

// The files of `dir` have the bits of the print.
static inline void assert_printed(program *p, const char *dir, const char *print, const char *what) {
  char *now = faults_print(p, dir);
  const char *a = print, *b = now;
  while (*a && strncmp(a, b, strcspn(a, "\n") + 1) == 0) {
    a += strcspn(a, "\n") + 1;
    b += strcspn(b, "\n") + 1;
  }
  if (*a || *b)
    fail_msg("%s: not the bits of the unbroken run: it has\n%.*s\nand this one\n%.*s", what, (int)strcspn(a, "\n"), a,
             (int)strcspn(b, "\n"), b);
  free(now);
}

static inline void fail_on_damage(void *what, bool damage, const char *sentence) {
  if (damage)
    fail_msg("%s: verify: %s", (const char *)what, sentence);
}

// What `talus verify` looks at shows no damage.
static inline void assert_sound(program *p, const char *dir, const char *what) {
  tal_verify_counts counts;
  tal_error err;
  char path[4400];
  snprintf(path, sizeof path, "%s/%s", p->folder, dir);
  if (tal_verify(path, fail_on_damage, (void *)(uintptr_t)what, &counts, &err) != TAL_OK)
    fail_msg("%s: verify: %s", what, err.text);
}

static inline bool faults_checkpoint_there(program *p, const char *dir) {
  char name[300];
  snprintf(name, sizeof name, "%s/checkpoint.h5", dir);
  if (access(program_path(p, name), F_OK) == 0)
    return true;
  snprintf(name, sizeof name, "%s/checkpoint.prev.h5", dir);
  return access(program_path(p, name), F_OK) == 0;
}

// Goes on after whatever happened: with --resume, or, where no checkpoint was written yet, as the program says: from an
// empty folder. Nothing is lost: in the end the bits are those of the unbroken run.
static inline void faults_recover(program *p, const faults_run *run, const char *print, const char *what) {
  outcome got;
  faults_plan(p, NULL, 0, NULL);
  faults_run again = *run;
  again.resume = true;
  const bool there = faults_checkpoint_there(p, run->dir);
  faults_do(p, &again, &got);
  if (!there) {
    if (got.code != 2 || !(strstr(got.err, "remove the folder and start again") || strstr(got.err, "holds no run")))
      fail_msg("%s: no checkpoint yet, exit %d\n%s", what, got.code, got.err);
    faults_remove(p, run->dir);
    again.resume = false;
    faults_do(p, &again, &got);
  }
  if (got.code != 0 || *got.err)
    fail_msg("%s: resumed: exit %d\n%s", what, got.code, got.err);
  assert_printed(p, run->dir, print, what);
}

static inline double faults_clock(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline void faults_sleep(double seconds) {
  nanosleep(&(struct timespec){(time_t)seconds, (long)(1e9 * (seconds - (double)(time_t)seconds))}, NULL);
}

#endif
