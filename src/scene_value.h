// Strict reading of one scalar: whole numbers, reals, booleans, and what to say when a text is not one. Also used for
// numbers on the command line. Does not know the schema.
#ifndef TAL_SCENE_VALUE_H
#define TAL_SCENE_VALUE_H

#include "base.h"
#include <stdbool.h>

typedef enum tal_number {
  TAL_NUMBER_OK,
  TAL_NUMBER_NOT,       // not a number of this kind
  TAL_NUMBER_TOO_LARGE, // beyond the type
  TAL_NUMBER_TOO_SMALL  // nonzero digits that round to zero
} tal_number;

// Decimal digits with an optional sign, nothing else.
tal_number tal_read_whole(const char *text, int64_t *value);
// Decimal number with optional sign, point and exponent over the whole text; also .inf, -.inf, .nan. Hexadecimal,
// "inf", trailing text: refused. Reads in the current numeric locale's point only if that is '.' (the loader sees to
// it).
tal_number tal_read_real(const char *text, double *value);
// "true" or "false".
bool tal_read_bool(const char *text, bool *value);

// If `text` is a number with a unit or prefix behind it (100kPa, 0.5 mm, 20%) or a decimal comma, writes the number the
// user probably means in units of `unit` (NULL: dimensionless), e.g. "100e3"; else "".
void tal_guess_real(const char *text, const char *unit, char *out, size_t size);
// If `text` is a real number of whole value (1e4, 10.0), writes it in digits; else "".
void tal_guess_whole(const char *text, char *out, size_t size);
// Shortest of %.15g, %.16g, %.17g that reads back the same; .inf, -.inf, .nan.
void tal_print_real(double value, char *out, size_t size);
// Number of single-character edits (insert, delete, replace, swap neighbours) between two words; 99 beyond 40
// characters.
int tal_edit_distance(const char *a, const char *b);
// Copies at most `most` bytes of `text` for a message: cut at a character, control characters replaced, "..." when cut.
void tal_quote(const char *text, size_t most, char *out, size_t size);

#endif
