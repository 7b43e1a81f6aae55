// Canonical text: the schema table walked over the struct, every key in the table's order with its resolved value. A
// key whose value is "not given" (NAN, NULL, a count below its range) or that does not exist with the choices made is
// left out, so the text loads to the same scene.
#include "scene_schema.h"
#include "scene_value.h"
#include "scene_walk.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static size_t count_of(const tal_key *key, const char *base) {
  size_t count;
  memcpy(&count, base + key->count_offset, sizeof count);
  return count;
}

static const void *array_of(const tal_key *key, const char *base) {
  const void *array;
  memcpy(&array, base + key->offset, sizeof array);
  return array;
}

static bool is_set(const tal_key *key, const char *base);

// An optional group is there when one of its required keys is; when it has none, when one of its keys is.
static bool group_is_set(const tal_key *key, const char *base) {
  bool any_required = false, any_set = false;
  if (!key->optional)
    return true;
  for (const tal_key *inner = key->keys; inner->name; inner++) {
    if (!tal_walk_exists(inner, key->keys, NULL, base))
      continue;
    bool set = is_set(inner, base);
    if (set && inner->required)
      return true;
    any_required = any_required || inner->required;
    any_set = any_set || set;
  }
  return !any_required && any_set;
}

static bool is_set(const tal_key *key, const char *base) {
  const char *place = base + key->offset;
  switch (key->type) {
  case TAL_KEY_REAL:
  case TAL_KEY_VECTOR:
    return !isnan(*(const double *)place);
  case TAL_KEY_WHOLE:
    return key->keys || (double)*(const int64_t *)place >= key->low;
  case TAL_KEY_TEXT:
    return array_of(key, base) != NULL;
  case TAL_KEY_CHOICE:
    return key->size && tal_walk_chosen(key, place);
  case TAL_KEY_LIST:
  case TAL_KEY_PAIRS:
    return (double)count_of(key, base) >= key->low;
  case TAL_KEY_GROUP:
    return group_is_set(key, place);
  case TAL_KEY_BOOL:
  case TAL_KEY_WHOLES:
  case TAL_KEY_FORCED:
    return true;
  case TAL_KEY_TREE:
    return false;
  }
  return false;
}

static void write_real(FILE *out, double value) {
  char text[40];
  tal_print_real(value, text, sizeof text);
  fputs(text, out);
}

static void write_pair(FILE *out, const double *pair) {
  fputc('[', out);
  write_real(out, pair[0]);
  fputs(", ", out);
  write_real(out, pair[1]);
  fputc(']', out);
}

static void write_quoted(FILE *out, const char *text) {
  fputc('\'', out);
  for (; *text; text++)
    fputs(*text == '\'' ? "''" : (char[]){*text, '\0'}, out);
  fputc('\'', out);
}

static void write_wholes(FILE *out, const tal_key *key, const char *base) {
  const int64_t *values = array_of(key, base);
  fputc('[', out);
  for (size_t i = 0; i < count_of(key, base); i++)
    fprintf(out, "%s%lld", i ? ", " : "", (long long)values[i]);
  fputc(']', out);
}

static void write_pairs(FILE *out, const tal_key *key, const char *base) {
  const double(*values)[2] = array_of(key, base);
  fputc('[', out);
  for (size_t i = 0; i < count_of(key, base); i++) {
    if (i)
      fputs(", ", out);
    write_pair(out, values[i]);
  }
  fputc(']', out);
}

static void write_forced(FILE *out, const tal_scene_forced *forced) {
  if (forced->random) {
    fprintf(out, "{random: %lld, margin: ", (long long)forced->random);
    write_real(out, forced->margin);
    fputc('}', out);
  } else if (!forced->count) {
    fputs("nearest", out);
  } else {
    fputs(forced->many ? "[" : "", out);
    for (size_t k = 0; k < forced->count; k++)
      fprintf(out, "%s%lld", k ? ", " : "", (long long)forced->ids[k]);
    fputs(forced->many ? "]" : "", out);
  }
}

static void write_scalar(FILE *out, const tal_key *key, const char *base) {
  const char *place = base + key->offset;
  if (key->type == TAL_KEY_REAL)
    write_real(out, *(const double *)place);
  if (key->type == TAL_KEY_WHOLE)
    fprintf(out, "%lld", (long long)*(const int64_t *)place);
  if (key->type == TAL_KEY_BOOL)
    fputs(*(const bool *)place ? "true" : "false", out);
  if (key->type == TAL_KEY_TEXT)
    write_quoted(out, array_of(key, base));
  if (key->type == TAL_KEY_CHOICE)
    fputs(tal_walk_chosen(key, place), out);
  if (key->type == TAL_KEY_VECTOR)
    write_pair(out, (const double *)place);
  if (key->type == TAL_KEY_WHOLES)
    write_wholes(out, key, base);
  if (key->type == TAL_KEY_PAIRS)
    write_pairs(out, key, base);
  if (key->type == TAL_KEY_FORCED)
    write_forced(out, (const tal_scene_forced *)place);
}

// `bullet`: the first line carries the "- " of a list item, two columns to the left of `indent`.
static void write_group(FILE *out, const tal_key *keys, const char *base, int indent, bool bullet);

static void write_list(FILE *out, const tal_key *key, const char *base, int indent) {
  const char *items = array_of(key, base);
  size_t count = count_of(key, base);
  fputs(count ? "\n" : " []\n", out);
  for (size_t i = 0; i < count; i++)
    write_group(out, key->keys, items + i * key->item_size, indent + 4, true);
}

static void write_key(FILE *out, const tal_key *key, const char *base, int indent) {
  if (key->type == TAL_KEY_LIST) {
    write_list(out, key, base, indent);
  } else if (key->type == TAL_KEY_GROUP) {
    fputc('\n', out);
    write_group(out, key->keys, base + key->offset, indent + 2, false);
  } else if (key->keys && *(const int64_t *)(base + key->offset) == 0) {
    fputc('\n', out);
    write_group(out, key->keys, base, indent + 2, false);
  } else {
    fputc(' ', out);
    write_scalar(out, key, base);
    fputc('\n', out);
  }
}

static void write_group(FILE *out, const tal_key *keys, const char *base, int indent, bool bullet) {
  for (const tal_key *key = keys; key->name; key++) {
    if (!tal_walk_exists(key, keys, NULL, base) || !is_set(key, base))
      continue;
    fprintf(out, "%*s%s%s:", bullet ? indent - 2 : indent, "", bullet ? "- " : "", key->name);
    bullet = false;
    write_key(out, key, base, indent);
  }
}

char *tal_scene_text(const tal_scene *scene) {
  char *text = NULL;
  size_t size = 0;
  FILE *out = tal_text_begin(&text, &size);
  locale_t plain = newlocale(LC_NUMERIC_MASK, "C", (locale_t)0), before = uselocale(plain);
  write_group(out, tal_schema(), (const char *)scene, 0, false);
  uselocale(before);
  freelocale(plain);
  tal_text_end(out);
  return text;
}
