// Files written whole or not at all, and sealed so that damage shows before anyone trusts the content.
// The seal is a trailer of 32 bytes: "TALUSEAL", the length of the content (uint64, little-endian) and its 128-bit XXH3
// (canonical, big-endian). HDF5 ignores what follows its own end of file, so sealed .h5 files stay plain .h5 files.
// References: xxHash, https://xxhash.com; rename(2) and fsync(2) for the atomic replacement.
#ifndef TAL_FILES_H
#define TAL_FILES_H

#include "base.h"
#include <stdbool.h>

#define TAL_PATH_SIZE 4096
#define TAL_SEAL_SIZE 32

// Joins folder and name into path. A path too long for the system is cut, and opening it then fails.
void tal_file_path(char path[TAL_PATH_SIZE], const char *folder, const char *name);
bool tal_file_exists(const char *path);
// Path of the program that is running. TAL_IO.
tal_status tal_program_path(char *path, size_t size, tal_error *err);
// Makes a folder with its parents; fine when it is there already. TAL_IO with the reason.
tal_status tal_folder_create(const char *path, tal_error *err);

// Writes `size` bytes of `data` to the open file; a short write is carried on, a signal is waited out. TAL_IO.
tal_status tal_file_put(int fd, const char *path, const void *data, size_t size, tal_error *err);
// Replaces the file `path` by size bytes: temporary name path.tmp, fsync, rename, fsync of the folder. Killed at any
// moment, the old or the new file is there, whole. previous, when not NULL: the name the old file is kept under; on a
// file system without hard links a kill may leave only `previous`. On failure (TAL_IO) the old file is there, whole.
tal_status tal_file_replace(const char *path, const char *previous, const void *data, size_t size, tal_error *err);
// Reads a whole file; *data is the caller's to free, NULL on failure (TAL_IO).
tal_status tal_file_read(const char *path, unsigned char **data, size_t *size, tal_error *err);

// Seal of data[size].
void tal_seal_make(unsigned char seal[TAL_SEAL_SIZE], const void *data, size_t size);
// Checks content + seal, data[size]; true: the content is its first size - TAL_SEAL_SIZE bytes.
bool tal_seal_check(const unsigned char *data, size_t size);
// XXH3, 64 bit.
uint64_t tal_hash(const void *data, size_t size);

#endif
