#include "base.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

tal_status tal_fail(tal_error *err, tal_status status, const char *format, ...) {
  if (!err)
    return status;
  va_list args;
  va_start(args, format);
  vsnprintf(err->text, sizeof err->text, format, args);
  va_end(args);
  return status;
}

_Noreturn static void end_without_memory(size_t count, size_t size) {
  fprintf(stderr, "talus: out of memory (%zu elements of %zu bytes)\n", count, size);
  exit(TAL_IO);
}

void *tal_alloc(size_t count, size_t size) {
  const size_t align = 64;
  void *memory = NULL;
  if (size == 0 || count <= (SIZE_MAX - align) / size) {
    size_t bytes = (count * size + align - 1) / align * align;
    memory = aligned_alloc(align, bytes ? bytes : align);
    if (memory)
      memset(memory, 0, bytes ? bytes : align);
  }
  if (!memory)
    end_without_memory(count, size);
  return memory;
}

void *tal_grow(void *old, size_t old_count, size_t count, size_t size) {
  void *memory = tal_alloc(count, size);
  if (old)
    memcpy(memory, old, (old_count < count ? old_count : count) * size);
  free(old);
  return memory;
}

char *tal_strdup(const char *text) {
  size_t size = strlen(text) + 1;
  return memcpy(tal_alloc(size, 1), text, size);
}

FILE *tal_text_begin(char **text, size_t *size) {
  *text = NULL;
  *size = 0;
  FILE *stream = open_memstream(text, size);
  if (!stream)
    end_without_memory(1, sizeof *stream);
  return stream;
}

void tal_text_end(FILE *stream) {
  const bool whole = !ferror(stream);
  if (fclose(stream) != 0 || !whole)
    end_without_memory(1, 1);
}
