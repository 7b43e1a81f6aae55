// Runs the program itself ($TALUS, else build/talus) in a temporary folder, for the tests of the command line: what it
// prints, its exit code, and what it leaves on disk.
#ifndef TAL_TEST_PROGRAM_H
#define TAL_TEST_PROGRAM_H

#include <errno.h>
#include <fcntl.h>
#include <fts.h>
#include <signal.h>
#include <spawn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <xxhash.h>

typedef struct program {
  char file[4096];   // absolute path of the program
  char folder[4096]; // it works there; removed at the end
  pid_t running;     // started and not waited for, else 0; ended at the end
} program;

typedef struct outcome {
  int code; // exit code, -1 when a signal ended it
  char out[16384], err[16384];
} outcome;

typedef struct process {
  pid_t id;
  program *of;
  int out, err; // memory files
} process;

// Set-up and tear-down of a test case: *state is the program.
static inline int program_begin(void **state) {
  program *p = calloc(1, sizeof *p);
  const char *file = getenv("TALUS"), *base = getenv("TMPDIR");
  char folder[400];
  snprintf(folder, sizeof folder, "%.300s/talus-cli-XXXXXX", base && *base ? base : "/tmp");
  *state = p;
  if (realpath(file && *file ? file : "build/talus", p->file) && mkdtemp(folder) && realpath(folder, p->folder))
    return 0;
  fprintf(stderr, "no program to test (TALUS: its path) or no folder to test in (TMPDIR)\n");
  return -1;
}

// Path of an entry of the folder, valid until the next call.
static inline const char *program_path(program *p, const char *name) {
  static char path[4400];
  snprintf(path, sizeof path, "%s/%s", p->folder, name);
  return path;
}

static inline int by_name(const FTSENT **a, const FTSENT **b) {
  return strcmp((*a)->fts_name, (*b)->fts_name);
}

static inline FTS *walk_begin(const char *folder) {
  FTS *walk = fts_open((char *[]){(char *)(uintptr_t)folder, NULL}, FTS_PHYSICAL | FTS_NOCHDIR, by_name);
  assert_non_null(walk);
  return walk;
}

static inline int program_end(void **state) {
  program *p = *state;
  if (p->running) {
    kill(p->running, SIGKILL);
    waitpid(p->running, NULL, 0);
  }
  FTS *walk = walk_begin(p->folder);
  for (FTSENT *entry; (entry = fts_read(walk));) {
    if (entry->fts_info != FTS_D)
      remove(entry->fts_accpath);
  }
  fts_close(walk);
  free(p);
  return 0;
}

#define program_test(function) cmocka_unit_test_setup_teardown(function, program_begin, program_end)

// Hash of a file's content; 0 for what is no file.
static inline uint64_t content_hash(const char *path) {
  XXH3_state_t *hash = XXH3_createState();
  XXH3_64bits_reset(hash);
  char block[65536];
  int fd = open(path, O_RDONLY | O_CLOEXEC);
  for (ssize_t length; fd >= 0 && (length = read(fd, block, sizeof block)) > 0;)
    XXH3_64bits_update(hash, block, (size_t)length);
  uint64_t value = XXH3_64bits_digest(hash);
  XXH3_freeState(hash);
  if (fd >= 0)
    close(fd);
  return value;
}

// Every entry below the folder with its kind, size and content. Owned by the caller.
static inline char *program_listing(program *p) {
  char *text = NULL;
  size_t size = 0;
  FILE *out = open_memstream(&text, &size);
  FTS *walk = walk_begin(p->folder);
  for (FTSENT *entry; (entry = fts_read(walk));) {
    const struct stat *info = entry->fts_statp;
    if (entry->fts_info == FTS_DP)
      continue;
    bool file = entry->fts_info == FTS_F;
    fprintf(out, "%s mode %o, %lld bytes, hash %016llx\n", entry->fts_path, info->st_mode,
            file ? (long long)info->st_size : 0, file ? (unsigned long long)content_hash(entry->fts_accpath) : 0);
  }
  fts_close(walk);
  fclose(out);
  return text;
}

static inline void program_write(program *p, const char *name, const char *text) {
  FILE *file = fopen(program_path(p, name), "w");
  assert_non_null(file);
  fputs(text, file);
  assert_int_equal(fclose(file), 0);
}

// The content of a file of the folder, ended by a NUL; NULL when there is none. Owned by the caller.
static inline char *program_read(program *p, const char *name, size_t *size) {
  FILE *file = fopen(program_path(p, name), "r");
  if (!file)
    return NULL;
  char *text = NULL;
  FILE *copy = open_memstream(&text, size);
  for (int c; (c = getc(file)) != EOF;)
    putc(c, copy);
  fclose(copy);
  fclose(file);
  return text;
}

extern char **environ;

// Starts the program with the words (ended by NULL); stdout goes to `file` where that is given.
static inline process program_start(program *p, const char *const *words, const char *file) {
  char *argv[24] = {p->file};
  for (int k = 0; words[k]; k++) {
    assert_true(k < 22);
    argv[k + 1] = (char *)(uintptr_t)words[k];
  }
  process child = {.of = p, .out = memfd_create("out", MFD_CLOEXEC), .err = memfd_create("err", MFD_CLOEXEC)};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, p->folder);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, child.out, 1);
  posix_spawn_file_actions_adddup2(&actions, child.err, 2);
  if (file)
    posix_spawn_file_actions_addopen(&actions, 1, file, O_WRONLY, 0);
  assert_int_equal(posix_spawn(&child.id, p->file, &actions, NULL, argv, environ), 0);
  posix_spawn_file_actions_destroy(&actions);
  p->running = child.id;
  return child;
}

static inline void take_text(int fd, char *text, size_t size) {
  ssize_t length = pread(fd, text, size - 1, 0);
  assert_true(length >= 0);
  text[length] = '\0';
  close(fd);
}

static inline void process_wait(process *child, outcome *got) {
  int status;
  assert_int_equal(waitpid(child->id, &status, 0), child->id);
  child->of->running = 0;
  got->code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  take_text(child->out, got->out, sizeof got->out);
  take_text(child->err, got->err, sizeof got->err);
}

static inline void program_run(program *p, const char *const *words, outcome *got) {
  process child = program_start(p, words, NULL);
  process_wait(&child, got);
}

#define WORDS(...) ((const char *const[]){__VA_ARGS__, NULL})

// One line of scene per entry of this table: messages name lines.
static const char *const scene_lines[] = {
    "name: small",
    "seed: 3",
    "grains: {count: 40, radius: {law: uniform, min: 0.5e-3, max: 1e-3}, thickness: 1.5e-3}",
    "material: {young: 1e7, poisson: 0.3, density: 2000, friction: 0.5}",
    "contact: {normal: hertz, tangential: spring}",
    "gravity: [0.5, -9.81]",
    "pack: {method: drop_and_roll, width: 10e-3}",
    "walls: [{from: [-1, 0], to: [1, 0], young: .inf}]",
    "integrator: {scheme: verlet, dt: 1e-6}",
    "stages: [{kind: free, duration: 0.02}]",
    "output: {series_every: 1e-4, fields_every: 1e-2, checkpoint_every: 1e-2}",
};

enum { LINES = sizeof scene_lines / sizeof *scene_lines };

// A grain sinks into another: after some 900 steps the overlap passes its limit.
static const char two_grains[] =
    "name: two\n"
    "grains: {list: [{x: 0, y: 0, r: 1e-3, fixed: true}, {x: 0, y: 1.99e-3, r: 1e-3, vy: -1}]}\n"
    "material: {young: 1e3, poisson: 0.3, density: 2000, friction: 0, damping: 0}\n"
    "contact: {normal: hertz, tangential: none}\n"
    "pack: {method: none}\n"
    "integrator: {scheme: verlet, dt: 1e-6}\n"
    "stages: [{kind: free, duration: 1e-2}]\n"
    "output: {series_every: 1e-4, checkpoint_every: 1e-4}\n";

// Writes the scene as s.yaml, with line `line` (from 1) replaced; 0 for none.
static inline void write_scene(program *p, int line, const char *text) {
  char scene[4096] = "";
  for (int k = 0; k < LINES; k++) {
    strcat(scene, k + 1 == line ? text : scene_lines[k]);
    strcat(scene, "\n");
  }
  program_write(p, "s.yaml", scene);
}

static inline int count_lines(const char *text) {
  int lines = 0;
  for (; *text; text++)
    lines += *text == '\n';
  return lines;
}

static inline void assert_outcome(const char *what, const outcome *got, int code, const char *fragment) {
  if (got->code != code || !strstr(got->err, fragment))
    fail_msg("%s: exit %d, expected %d with '%s' on stderr; stderr:\n%s", what, got->code, code, fragment, got->err);
}

// Refused: the exit code, the message alone on stderr, nothing on stdout, no entry of the folder touched.
static inline void assert_refused(program *p, const char *what, const char *const *words, int code,
                                  const char *fragment) {
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

#endif
