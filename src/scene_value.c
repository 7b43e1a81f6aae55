// Strict scalars. strtod alone would take 0x10, inf, nan and leave trailing text to the caller; YAML libraries take
// yes/no, octal and 1e4 for a count. Here the grammar is checked first, by hand.
#include "scene_value.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static size_t digits(const char *text) {
  return strspn(text, "0123456789");
}

tal_number tal_read_whole(const char *text, int64_t *value) {
  size_t sign = *text == '+' || *text == '-';
  size_t length = digits(text + sign);
  if (!length || text[sign + length])
    return TAL_NUMBER_NOT;
  errno = 0;
  long long read = strtoll(text, NULL, 10);
  if (errno == ERANGE)
    return TAL_NUMBER_TOO_LARGE;
  *value = read;
  return TAL_NUMBER_OK;
}

// Length of the decimal number at the start of text, 0 if there is none.
static size_t real_length(const char *text) {
  size_t at = *text == '+' || *text == '-';
  size_t whole = digits(text + at), part = 0;
  at += whole;
  if (text[at] == '.') {
    part = digits(text + at + 1);
    at += 1 + part;
  }
  if (!whole && !part)
    return 0;
  if (text[at] != 'e' && text[at] != 'E')
    return at;
  size_t sign = text[at + 1] == '+' || text[at + 1] == '-';
  size_t exponent = digits(text + at + 1 + sign);
  return exponent ? at + 1 + sign + exponent : at;
}

tal_number tal_read_real(const char *text, double *value) {
  const char *bare = text + (*text == '+' || *text == '-');
  if (strcmp(bare, ".inf") == 0) {
    *value = *text == '-' ? -HUGE_VAL : HUGE_VAL;
    return TAL_NUMBER_OK;
  }
  if (strcmp(text, ".nan") == 0) {
    *value = nan("");
    return TAL_NUMBER_OK;
  }
  size_t length = real_length(text);
  if (!length || text[length])
    return TAL_NUMBER_NOT;
  errno = 0;
  double read = strtod(text, NULL);
  if (errno == ERANGE && isinf(read))
    return TAL_NUMBER_TOO_LARGE;
  if (errno == ERANGE && read == 0)
    return TAL_NUMBER_TOO_SMALL;
  *value = read;
  return TAL_NUMBER_OK;
}

bool tal_read_bool(const char *text, bool *value) {
  *value = strcmp(text, "true") == 0;
  return *value || strcmp(text, "false") == 0;
}

static int prefix_power(const char *rest, size_t *length) {
  static const struct {
    const char *text;
    int power;
  } prefixes[] = {{"G", 9}, {"M", 6}, {"k", 3}, {"c", -2}, {"m", -3}, {"\xc2\xb5", -6}, {"u", -6}, {"n", -9}};
  for (size_t i = 0; i < sizeof prefixes / sizeof *prefixes; i++) {
    *length = strlen(prefixes[i].text);
    if (strncmp(rest, prefixes[i].text, *length) == 0)
      return prefixes[i].power;
  }
  *length = 0;
  return 0;
}

// Power of ten that the unit text stands for next to `unit`; false when it is another unit.
static bool unit_power(const char *rest, const char *unit, int *power) {
  size_t length;
  *power = 0;
  if (!unit) {
    *power = -2;
    return strcmp(rest, "%") == 0;
  }
  if (strcmp(rest, unit) == 0)
    return true;
  *power = prefix_power(rest, &length);
  return length && (!rest[length] || strcmp(rest + length, unit) == 0);
}

void tal_guess_real(const char *text, const char *unit, char *out, size_t size) {
  *out = '\0';
  size_t length = real_length(text);
  if (!length || length > 30)
    return;
  const char *rest = text + length;
  if (*rest == ',' && digits(rest + 1) == strlen(rest + 1) && !strpbrk(text, ".eE")) {
    snprintf(out, size, "%.*s.%s", (int)length, text, rest + 1);
    return;
  }
  int power;
  rest += strspn(rest, " ");
  if (strlen(rest) > 12 || !unit_power(rest, unit, &power))
    return;
  bool has_exponent = memchr(text, 'e', length) || memchr(text, 'E', length);
  if (has_exponent && power)
    snprintf(out, size, "%g", strtod(text, NULL) * pow(10, power));
  else if (power)
    snprintf(out, size, "%.*se%d", (int)length, text, power);
  else
    snprintf(out, size, "%.*s", (int)length, text);
}

void tal_guess_whole(const char *text, char *out, size_t size) {
  double value;
  *out = '\0';
  if (tal_read_real(text, &value) != TAL_NUMBER_OK || !(fabs(value) < 1e15) || value != floor(value))
    return;
  snprintf(out, size, "%.0f", value);
}

void tal_print_real(double value, char *out, size_t size) {
  if (isnan(value))
    snprintf(out, size, ".nan");
  else if (isinf(value))
    snprintf(out, size, value > 0 ? ".inf" : "-.inf");
  else
    for (int precision = 15; precision <= 17; precision++) {
      snprintf(out, size, "%.*g", precision, value);
      if (strtod(out, NULL) == value)
        return;
    }
}

#define WORD 40

int tal_edit_distance(const char *a, const char *b) {
  int cost[WORD + 1][WORD + 1];
  size_t n = strlen(a), m = strlen(b);
  if (n > WORD || m > WORD)
    return 99;
  for (size_t i = 0; i <= n; i++)
    cost[i][0] = (int)i;
  for (size_t j = 0; j <= m; j++)
    cost[0][j] = (int)j;
  for (size_t i = 1; i <= n; i++)
    for (size_t j = 1; j <= m; j++) {
      int best = cost[i - 1][j - 1] + (tolower((unsigned char)a[i - 1]) != tolower((unsigned char)b[j - 1]));
      if (cost[i - 1][j] + 1 < best)
        best = cost[i - 1][j] + 1;
      if (cost[i][j - 1] + 1 < best)
        best = cost[i][j - 1] + 1;
      bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped && cost[i - 2][j - 2] + 1 < best)
        best = cost[i - 2][j - 2] + 1;
      cost[i][j] = best;
    }
  return cost[n][m];
}

void tal_quote(const char *text, size_t most, char *out, size_t size) {
  size_t length = strlen(text);
  bool cut = length > most;
  if (cut)
    for (length = most; length && ((unsigned char)text[length] & 0xC0) == 0x80;)
      length--;
  if (length > size - 4)
    length = size - 4;
  for (size_t i = 0; i < length; i++)
    out[i] = iscntrl((unsigned char)text[i]) ? '?' : text[i];
  strcpy(out + length, cut ? "..." : "");
}
