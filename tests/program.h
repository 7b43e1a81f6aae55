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

typedef struct program {
  char file[4096];   // absolute path of the program
  char folder[4096]; // it works there; removed at the end
} program;

typedef struct outcome {
  int code; // exit code, -1 when a signal ended it
  char out[16384], err[16384];
} outcome;

typedef struct process {
  pid_t id;
  int out, err; // memory files
} process;

static inline void program_begin(program *p) {
  const char *file = getenv("TALUS"), *base = getenv("TMPDIR");
  if (!realpath(file && *file ? file : "build/talus", p->file))
    fail_msg("there is no program to test: set TALUS to its path");
  char folder[400];
  snprintf(folder, sizeof folder, "%.300s/talus-cli-XXXXXX", base && *base ? base : "/tmp");
  assert_non_null(mkdtemp(folder));
  assert_non_null(realpath(folder, p->folder));
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

static inline void program_end(program *p) {
  FTS *walk = walk_begin(p->folder);
  for (FTSENT *entry; (entry = fts_read(walk));) {
    if (entry->fts_info != FTS_D)
      assert_int_equal(remove(entry->fts_accpath), 0);
  }
  fts_close(walk);
}

// Every entry below the folder with its kind, size and the time it was last written. Owned by the caller.
static inline char *program_listing(program *p) {
  char *text = NULL;
  size_t size = 0;
  FILE *out = open_memstream(&text, &size);
  FTS *walk = walk_begin(p->folder);
  for (FTSENT *entry; (entry = fts_read(walk));) {
    const struct stat *info = entry->fts_statp;
    if (entry->fts_info != FTS_DP)
      fprintf(out, "%s mode %o, %lld bytes, written %lld.%09ld\n", entry->fts_path, info->st_mode,
              (long long)info->st_size, (long long)info->st_mtim.tv_sec, info->st_mtim.tv_nsec);
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
  process child = {.out = memfd_create("out", MFD_CLOEXEC), .err = memfd_create("err", MFD_CLOEXEC)};
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
  got->code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  take_text(child->out, got->out, sizeof got->out);
  take_text(child->err, got->err, sizeof got->err);
}

static inline void program_run(program *p, const char *const *words, outcome *got) {
  process child = program_start(p, words, NULL);
  process_wait(&child, got);
}

#endif
