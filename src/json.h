// A strict JSON writer: commas, indent and escapes. NaN and infinities become null (JSON has none); text that is no
// UTF-8 gets U+FFFD for what is not. Writing only; `talus` reads its own JSON with libyaml. Reference: RFC 8259.
#ifndef TAL_JSON_H
#define TAL_JSON_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

typedef struct tal_json {
  FILE *out; // borrowed
  int depth;
  bool first; // nothing written yet at this depth
} tal_json;

// key is NULL inside a list and for the outermost value.
void tal_json_open(tal_json *json, const char *key, char bracket);      // '{' or '['
void tal_json_close(tal_json *json, char bracket);                      // '}' or ']'
void tal_json_text(tal_json *json, const char *key, const char *value); // NULL: null
void tal_json_number(tal_json *json, const char *key, double value);
void tal_json_integer(tal_json *json, const char *key, int64_t value);
// A value that is JSON already: true, null, 12.
void tal_json_literal(tal_json *json, const char *key, const char *value);

#endif
