#include "json.h"

#include <math.h>
#include <string.h>

// Length of the well-formed UTF-8 character at `text`, 0 when there is none (Unicode 15, table 3-7).
static int utf8_length(const unsigned char *text) {
  const unsigned char a = text[0], b = a ? text[1] : 0;
  if (a < 0x80)
    return 1;
  if (a < 0xc2 || a > 0xf4 || (b & 0xc0) != 0x80)
    return 0;
  if ((a == 0xe0 && b < 0xa0) || (a == 0xed && b > 0x9f) || (a == 0xf0 && b < 0x90) || (a == 0xf4 && b > 0x8f))
    return 0;
  const int length = a < 0xe0 ? 2 : a < 0xf0 ? 3 : 4;
  for (int k = 2; k < length; k++) {
    if ((text[k] & 0xc0) != 0x80)
      return 0;
  }
  return length;
}

static void put_text(FILE *out, const char *text) {
  fputc('"', out);
  for (const unsigned char *c = (const unsigned char *)text; *c;) {
    int length = utf8_length(c);
    if (length == 0) {
      fputs("\\ufffd", out);
      length = 1;
    } else if (*c == '"' || *c == '\\') {
      fprintf(out, "\\%c", *c);
    } else if (*c == '\n') {
      fputs("\\n", out);
    } else if (*c < 0x20) {
      fprintf(out, "\\u%04x", *c);
    } else {
      fwrite(c, 1, (size_t)length, out);
    }
    c += length;
  }
  fputc('"', out);
}

static void begin_value(tal_json *json, const char *key) {
  if (json->depth > 0) {
    if (!json->first)
      fputc(',', json->out);
    fprintf(json->out, "\n%*s", 2 * json->depth, "");
  }
  json->first = false;
  if (!key)
    return;
  put_text(json->out, key);
  fputs(": ", json->out);
}

void tal_json_open(tal_json *json, const char *key, char bracket) {
  begin_value(json, key);
  fputc(bracket, json->out);
  json->depth++;
  json->first = true;
}

void tal_json_close(tal_json *json, char bracket) {
  json->depth--;
  if (!json->first)
    fprintf(json->out, "\n%*s", 2 * json->depth, "");
  fputc(bracket, json->out);
  json->first = false;
  if (json->depth == 0)
    fputc('\n', json->out);
}

void tal_json_literal(tal_json *json, const char *key, const char *value) {
  begin_value(json, key);
  fputs(value, json->out);
}

void tal_json_text(tal_json *json, const char *key, const char *value) {
  if (!value) {
    tal_json_literal(json, key, "null");
    return;
  }
  begin_value(json, key);
  put_text(json->out, value);
}

void tal_json_number(tal_json *json, const char *key, double value) {
  char text[40];
  snprintf(text, sizeof text, "%.17g", value);
  tal_json_literal(json, key, isfinite(value) ? text : "null");
}

void tal_json_integer(tal_json *json, const char *key, int64_t value) {
  char text[24];
  snprintf(text, sizeof text, "%lld", (long long)value);
  tal_json_literal(json, key, text);
}
