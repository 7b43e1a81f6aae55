// Memory for geom: never NULL. Without memory the program says so in one line and ends with 4, as everywhere else.
#ifndef GEO_MEMORY_H
#define GEO_MEMORY_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

static inline void *geo_checked(void *memory, size_t count, size_t size) {
  if (memory)
    return memory;
  fprintf(stderr, "talus: out of memory (%zu elements of %zu bytes)\n", count, size);
  exit(4);
}

// Resizes `old` (NULL for a fresh block) to count elements; new contents are not set. Free with free().
static inline void *geo_resize(void *old, size_t count, size_t size) {
  if (count == 0)
    count = 1;
  return geo_checked(count <= PTRDIFF_MAX / size ? realloc(old, count * size) : NULL, count, size);
}

// Zeroed block of count elements.
static inline void *geo_zeroed(size_t count, size_t size) {
  if (count == 0)
    count = 1;
  return geo_checked(calloc(count, size), count, size);
}

// Capacity of a growing array that must hold `count`.
static inline size_t geo_capacity(size_t capacity, size_t count) {
  return count <= capacity ? capacity : count + count / 2 + 16;
}

#endif
