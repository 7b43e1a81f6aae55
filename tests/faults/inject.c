// Linked into a second build of the program (Makefile: tests/faults/talus), whose own calls for files and memory pass
// through here: the linker's --wrap turns each into __wrap_CALL. One of them fails or never returns, as TALUS_FAULT
// says:
//   CALL:N:HOW[:MARK]
// CALL: a name of the list below, or `files`, `memory` for any of these kinds, counted together. N: which one, from 1.
// HOW: an error number the call fails with, followed by + when all later ones fail too; `s` and a signal number: raised
// before the call; `torn`: killed after half of a write; `count`: nothing happens, the number of calls stands in MARK
// in the end. MARK: made (an empty file) when the fault has struck. Libraries' own calls do not pass through here: HDF5
// touches no file of ours, and its memory is its own affair.
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

typedef struct fault {
  char call[24], mark[4096];
  long at;
  atomic_long seen;
  int error, signal;
  bool stays, torn, counts;
} fault;

static fault plan;

// Memory is asked for before any constructor of ours has run: those calls are let through.
__attribute__((constructor)) static void read_plan(void) {
  const char *text = getenv("TALUS_FAULT");
  char how[16] = "";
  int read = 0;
  if (!text || sscanf(text, "%23[^:]:%ld:%15[^:]%n", plan.call, &plan.at, how, &read) != 3)
    return;
  if (text[read] == ':')
    snprintf(plan.mark, sizeof plan.mark, "%s", text + read + 1);
  plan.torn = strcmp(how, "torn") == 0;
  plan.signal = *how == 's' ? atoi(how + 1) : plan.torn ? SIGKILL : 0;
  plan.error = *how == 's' || plan.torn ? 0 : atoi(how);
  plan.counts = strcmp(how, "count") == 0;
  plan.stays = strchr(how, '+') != NULL;
}

static void leave_mark(void) {
  if (*plan.mark)
    syscall(SYS_close, (int)syscall(SYS_open, plan.mark, O_WRONLY | O_CREAT | O_CLOEXEC, 0666));
}

__attribute__((destructor)) static void write_count(void) {
  const long seen = atomic_load(&plan.seen); // this opening counts too
  FILE *file = plan.counts ? fopen(plan.mark, "w") : NULL;
  if (!file)
    return;
  fprintf(file, "%ld\n", seen);
  fclose(file);
}

// True when this call is to fail, errno set. A signal is raised here, once.
static bool strikes(const char *call, const char *kind) {
  if (strcmp(plan.call, call) != 0 && strcmp(plan.call, kind) != 0)
    return false;
  const long now = atomic_fetch_add(&plan.seen, 1) + 1;
  if (now != plan.at && !(plan.stays && now > plan.at))
    return false;
  if (now == plan.at)
    leave_mark();
  if (plan.signal && !plan.torn)
    raise(plan.signal);
  errno = plan.error;
  return plan.error != 0 || plan.torn;
}

#define WRAP(type, call, kind, failure, parameters, ...)                                                               \
  type __real_##call parameters;                                                                                       \
  type __wrap_##call parameters;                                                                                       \
  type __wrap_##call parameters {                                                                                      \
    return strikes(#call, kind) ? failure : __real_##call(__VA_ARGS__);                                                \
  }

WRAP(int, fsync, "files", -1, (int fd), fd)
WRAP(int, rename, "files", -1, (const char *from, const char *to), from, to)
WRAP(int, link, "files", -1, (const char *from, const char *to), from, to)
WRAP(int, unlink, "files", -1, (const char *path), path)
WRAP(int, mkdir, "files", -1, (const char *path, mode_t mode), path, mode)
WRAP(int, ftruncate, "files", -1, (int fd, off_t length), fd, length)
WRAP(int, flock, "files", -1, (int fd, int operation), fd, operation)
WRAP(int, fstat, "files", -1, (int fd, struct stat *info), fd, info)
WRAP(ssize_t, read, "files", -1, (int fd, void *data, size_t size), fd, data, size)
WRAP(DIR *, opendir, "files", NULL, (const char *path), path)
WRAP(FILE *, fopen, "files", NULL, (const char *path, const char *mode), path, mode)

WRAP(void *, malloc, "memory", NULL, (size_t size), size)
WRAP(void *, calloc, "memory", NULL, (size_t count, size_t size), count, size)
WRAP(void *, realloc, "memory", NULL, (void *old, size_t size), old, size)
WRAP(void *, aligned_alloc, "memory", NULL, (size_t align, size_t size), align, size)
WRAP(FILE *, open_memstream, "memory", NULL, (char **text, size_t *size), text, size)

int __real_open(const char *path, int flags, ...);
int __wrap_open(const char *path, int flags, ...);
int __wrap_open(const char *path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = flags & O_CREAT ? va_arg(more, mode_t) : 0;
  va_end(more);
  return strikes("open", "files") ? -1 : __real_open(path, flags, mode);
}

// The file is closed all the same, as the system does it.
int __real_close(int fd);
int __wrap_close(int fd);
int __wrap_close(int fd) {
  const bool failed = strikes("close", "files");
  const int error = errno, result = __real_close(fd);
  errno = error;
  return failed ? -1 : result;
}

// What is on a full disk: half of the data still fits, the rest does not.
ssize_t __real_write(int fd, const void *data, size_t size);
ssize_t __wrap_write(int fd, const void *data, size_t size);
ssize_t __wrap_write(int fd, const void *data, size_t size) {
  if (!strikes("write", "files"))
    return __real_write(fd, data, size);
  const bool first = atomic_load(&plan.seen) == plan.at;
  if (plan.torn || (plan.stays && first && size > 1)) {
    const ssize_t written = __real_write(fd, data, size / 2);
    if (plan.torn)
      raise(SIGKILL);
    return written;
  }
  errno = plan.error;
  return -1;
}
