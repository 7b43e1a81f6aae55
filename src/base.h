// What every module shares: status codes, one error text, memory.
#ifndef TAL_BASE_H
#define TAL_BASE_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

// Also the program's exit codes.
typedef enum tal_status {
  TAL_OK = 0,
  TAL_BAD_INPUT = 2,   // the user's input
  TAL_INVALID = 3,     // a run gone bad
  TAL_IO = 4,          // files
  TAL_INTERRUPTED = 75 // stopped on request, resumable
} tal_status;

// One readable sentence for the user.
typedef struct tal_error {
  char text[1024];
} tal_error;

// Writes the sentence (err may be NULL) and returns `status`.
tal_status tal_fail(tal_error *err, tal_status status, const char *format, ...) __attribute__((format(printf, 3, 4)));

// Zeroed memory, 64-byte aligned, never NULL: without memory the program says so and ends with 4. Free with free().
void *tal_alloc(size_t count, size_t size);
// Grows `old` (old_count elements) to `count`, keeping the contents, zeroing the rest. Same rules.
void *tal_grow(void *old, size_t old_count, size_t count, size_t size);
char *tal_strdup(const char *text);
// A stream that writes into memory of its own: *text[*size], ended by a NUL, is whole and the caller's to free after
// tal_text_end. Same rules: a text is never cut short.
FILE *tal_text_begin(char **text, size_t *size);
void tal_text_end(FILE *stream);

#define TAL_PI 3.14159265358979323846

#endif
