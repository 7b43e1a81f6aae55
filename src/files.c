// See files.h. Plain POSIX calls: stdio hides which write failed.
#include "files.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

static const char seal_name[8] = {'T', 'A', 'L', 'U', 'S', 'E', 'A', 'L'};

void tal_file_path(char path[TAL_PATH_SIZE], const char *folder, const char *name) {
  snprintf(path, TAL_PATH_SIZE, "%s/%s", folder, name);
}

bool tal_file_exists(const char *path) {
  struct stat info;
  return lstat(path, &info) == 0;
}

static bool is_folder(const char *path) {
  struct stat info;
  return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

tal_status tal_program_path(char *path, size_t size, tal_error *err) {
  const ssize_t length = readlink("/proc/self/exe", path, size - 1);
  if (length <= 0)
    return tal_fail(err, TAL_IO, "/proc/self/exe: the program cannot be found");
  path[length] = '\0';
  return TAL_OK;
}

tal_status tal_folder_create(const char *path, tal_error *err) {
  char part[TAL_PATH_SIZE];
  snprintf(part, sizeof part, "%s", path);
  for (char *end = part; *end;) {
    end += strspn(end, "/");
    end += strcspn(end, "/");
    char rest = *end;
    *end = '\0';
    int why = mkdir(part, 0777) == 0 ? 0 : errno;
    if (why && !is_folder(part))
      return tal_fail(err, TAL_IO, "%s: cannot make the folder: %s", path, strerror(why == EEXIST ? ENOTDIR : why));
    *end = rest;
  }
  return is_folder(path) ? TAL_OK : tal_fail(err, TAL_IO, "%s: cannot make the folder", path);
}

tal_status tal_file_put(int fd, const char *path, const void *data, size_t size, tal_error *err) {
  const unsigned char *from = data;
  while (size > 0) {
    ssize_t written = write(fd, from, size);
    if (written < 0 && errno == EINTR)
      continue;
    if (written <= 0) {
      return tal_fail(err, TAL_IO, "%s: writing failed: %s", path, strerror(written < 0 ? errno : ENOSPC));
    }
    from += written;
    size -= (size_t)written;
  }
  return TAL_OK;
}

// The renames in the folder of `path` are on disk only after this.
static tal_status sync_folder(const char *path, tal_error *err) {
  char folder[TAL_PATH_SIZE];
  snprintf(folder, sizeof folder, "%s", path);
  char *slash = strrchr(folder, '/');
  if (slash)
    slash[slash == folder] = '\0';
  int fd = open(slash ? folder : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  // Some file systems refuse fsync on folders (EINVAL); they have no such step.
  bool well = fd >= 0 && (fsync(fd) == 0 || errno == EINVAL);
  tal_status status = well ? TAL_OK : tal_fail(err, TAL_IO, "%s: syncing its folder failed: %s", path, strerror(errno));
  if (fd >= 0)
    close(fd);
  return status;
}

static tal_status write_temporary(const char *path, const void *data, size_t size, tal_error *err) {
  int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0)
    return tal_fail(err, TAL_IO, "%s: cannot be made: %s", path, strerror(errno));
  tal_status status = tal_file_put(fd, path, data, size, err);
  if (status == TAL_OK && fsync(fd) != 0) {
    status = tal_fail(err, TAL_IO, "%s: syncing failed: %s", path, strerror(errno));
  }
  if (close(fd) != 0 && status == TAL_OK) {
    status = tal_fail(err, TAL_IO, "%s: closing failed: %s", path, strerror(errno));
  }
  if (status != TAL_OK)
    unlink(path);
  return status;
}

// Gives the file a second name in place of what has that name. Where the file system has no hard links it is renamed.
static tal_status keep_as(const char *previous, const char *path, tal_error *err) {
  char second[TAL_PATH_SIZE + 4];
  snprintf(second, sizeof second, "%s.tmp", previous);
  unlink(second); // of a run that was killed just here
  bool kept = link(path, second) == 0 && rename(second, previous) == 0;
  if (!kept)
    kept = !tal_file_exists(path) || rename(path, previous) == 0;
  const int why = errno;
  unlink(second); // rename leaves both where they are names of one file
  return kept ? TAL_OK : tal_fail(err, TAL_IO, "%s: cannot be kept as %s: %s", path, previous, strerror(why));
}

tal_status tal_file_replace(const char *path, const char *previous, const void *data, size_t size, tal_error *err) {
  char temporary[TAL_PATH_SIZE + 4];
  snprintf(temporary, sizeof temporary, "%s.tmp", path);
  tal_status status = write_temporary(temporary, data, size, err);
  if (status != TAL_OK)
    return status;
  if (previous)
    status = keep_as(previous, path, err);
  if (status == TAL_OK && rename(temporary, path) != 0) {
    status = tal_fail(err, TAL_IO, "%s: cannot be renamed to %s: %s", temporary, path, strerror(errno));
  }
  if (status != TAL_OK) {
    unlink(temporary);
    return status;
  }
  return sync_folder(path, err);
}

// Reads up to `size` bytes; fewer only at the end of the file. -1 on failure.
static ssize_t read_all(int fd, unsigned char *data, size_t size) {
  size_t got = 0;
  while (got < size) {
    ssize_t part = read(fd, data + got, size - got);
    if (part < 0 && errno == EINTR)
      continue;
    if (part < 0)
      return -1;
    if (part == 0)
      break;
    got += (size_t)part;
  }
  return (ssize_t)got;
}

tal_status tal_file_read(const char *path, unsigned char **data, size_t *size, tal_error *err) {
  *data = NULL;
  *size = 0;
  struct stat info;
  int fd = open(path, O_RDONLY | O_CLOEXEC);
  bool opened = fd >= 0 && fstat(fd, &info) == 0;
  if (opened && !S_ISREG(info.st_mode)) {
    opened = false;
    errno = EINVAL;
  }
  ssize_t got = -1;
  if (opened) {
    *data = tal_alloc((size_t)info.st_size + 1, 1);
    got = read_all(fd, *data, (size_t)info.st_size);
  }
  tal_status status = got >= 0 ? TAL_OK : tal_fail(err, TAL_IO, "%s: cannot be read: %s", path, strerror(errno));
  if (fd >= 0)
    close(fd);
  if (status == TAL_OK) {
    *size = (size_t)got;
  } else {
    free(*data);
    *data = NULL;
  }
  return status;
}

static void put_length(unsigned char out[8], uint64_t length) {
  for (int k = 0; k < 8; k++)
    out[k] = (unsigned char)(length >> (8 * k));
}

void tal_seal_make(unsigned char seal[TAL_SEAL_SIZE], const void *data, size_t size) {
  XXH128_canonical_t digest;
  XXH128_canonicalFromHash(&digest, XXH3_128bits(data, size));
  memcpy(seal, seal_name, sizeof seal_name);
  put_length(seal + 8, size);
  memcpy(seal + 16, digest.digest, sizeof digest.digest);
}

bool tal_seal_check(const unsigned char *data, size_t size) {
  if (size < TAL_SEAL_SIZE)
    return false;
  unsigned char seal[TAL_SEAL_SIZE];
  tal_seal_make(seal, data, size - TAL_SEAL_SIZE);
  return memcmp(seal, data + size - TAL_SEAL_SIZE, TAL_SEAL_SIZE) == 0;
}

uint64_t tal_hash(const void *data, size_t size) {
  return XXH3_64bits(data, size);
}
