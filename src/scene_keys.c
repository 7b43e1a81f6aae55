// `talus keys` in text and Markdown, and the words for completion: one walk over the schema table, several printers.
#include "scene_keys.h"

#include "scene_schema.h"
#include "scene_value.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

typedef struct visit {
  void (*row)(struct visit *v, const char *path, const tal_key *key);
  FILE *out;
  const char *what; // rows asked for, "" all
  size_t seen;
  size_t width[4]; // of the columns key, type, unit, range
  bool measuring;
  int best; // nearest: distance so far
  char *near;
  size_t near_size;
} visit;

static void walk(visit *v, const tal_key *keys, const char *above) {
  for (const tal_key *key = keys; key->name; key++) {
    char path[128];
    snprintf(path, sizeof path, "%.80s%s%.40s", above, *above ? "." : "", key->name);
    v->row(v, path, key);
    if (key->keys)
      walk(v, key->keys, path);
  }
}

// "stages[1].rate" and "stages.1.rate" mean "stages.rate".
static void without_indices(const char *what, char *out, size_t size) {
  size_t used = 0;
  while (*what && used + 1 < size) {
    bool start = *what == '.' || *what == '[';
    size_t digits = start ? strspn(what + 1, "0123456789") : 0;
    char after = digits ? what[1 + digits] : 'x';
    if (*what == '[' && digits && after == ']')
      what += digits + 2;
    else if (*what == '.' && digits && (after == '.' || !after))
      what += digits + 1;
    else
      out[used++] = *what++;
  }
  out[used] = '\0';
}

// Is the row asked for: itself, inside the group asked for, or of the variant asked for (GROUP.VALUE)?
static bool asked(const visit *v, const char *path, const tal_key *key) {
  size_t length = strlen(v->what);
  if (!length || strcmp(path, v->what) == 0)
    return true;
  if (strncmp(path, v->what, length) == 0 && path[length] == '.')
    return true;
  const char *value = strrchr(v->what, '.'), *name = strrchr(path, '.');
  if (!key->selector || !value || !name)
    return false;
  size_t group = (size_t)(value - v->what);
  return group == (size_t)(name - path) && strncmp(path, v->what, group) == 0 && tal_word_among(value + 1, key->only);
}

static const char *type_name(const tal_key *key) {
  static const char *const names[] = {"number", "whole",    "bool",    "text", "choice", "[x, y]",
                                      "wholes", "[[a, b]]", "mapping", "list", "grains", "any"};
  return names[key->type];
}

static const char *default_of(const tal_key *key) {
  if (key->required)
    return "required";
  return key->fallback ? key->fallback : key->note ? key->note : "";
}

static void range_of(const tal_key *key, char *out, size_t size) {
  char range[60];
  tal_key_range(key, range, sizeof range);
  snprintf(out, size, "%s%s", range, key->infinite ? (*range ? ", .inf" : ".inf") : "");
}

// Meaning, choices and the variant a row belongs to, in one line.
static void meaning_of(const tal_key *key, char *out, size_t size) {
  char names[160] = "", only[120] = "";
  if (key->choices)
    tal_key_choice_names(key, " | ", names, sizeof names);
  if (key->selector) {
    snprintf(only, sizeof only, "; only with %s: %s", key->selector, key->only);
  }
  snprintf(out, size, "%s%s%s%s", key->help, *names ? ": " : "", names, only);
}

static size_t larger(size_t a, size_t b) {
  return a > b ? a : b;
}

static void text_row(visit *v, const char *path, const tal_key *key) {
  char range[80], meaning[400];
  const char *unit = key->unit ? key->unit : "";
  if (!asked(v, path, key))
    return;
  range_of(key, range, sizeof range);
  v->seen++;
  if (v->measuring) {
    const char *column[] = {path, type_name(key), unit, range};
    for (size_t i = 0; i < 4; i++)
      v->width[i] = larger(v->width[i], strlen(column[i]));
    return;
  }
  meaning_of(key, meaning, sizeof meaning);
  const int *w = (const int[]){(int)v->width[0], (int)v->width[1], (int)v->width[2], (int)v->width[3]};
  fprintf(v->out, "%-*s  %-*s  %-*s  %-*s  %s\n", w[0], path, w[1], type_name(key), w[2], unit, w[3], range,
          default_of(key));
  fprintf(v->out, "    %s\n", meaning);
  if (!key->choices || strcmp(v->what, path) != 0)
    return;
  tal_choice list[TAL_CHOICES];
  size_t count = key->choices(list, TAL_CHOICES);
  for (size_t i = 0; i < count; i++)
    fprintf(v->out, "      %-14s %s\n", list[i].name, list[i].help);
}

bool tal_keys_print(FILE *out, const char *what) {
  char plain[200];
  without_indices(what ? what : "", plain, sizeof plain);
  visit v = {.row = text_row, .out = out, .what = plain, .width = {3, 4, 4, 5}, .measuring = true};
  walk(&v, tal_schema(), "");
  if (!v.seen)
    return false;
  v.measuring = false;
  fprintf(out, "%-*s  %-*s  %-*s  %-*s  %s\n", (int)v.width[0], "KEY", (int)v.width[1], "TYPE", (int)v.width[2], "UNIT",
          (int)v.width[3], "RANGE", "DEFAULT");
  walk(&v, tal_schema(), "");
  return true;
}

static void put_cell(FILE *out, const char *text) {
  for (; *text; text++)
    fprintf(out, *text == '|' ? "\\%c" : "%c", *text);
  fputs(" | ", out);
}

static void markdown_row(visit *v, const char *path, const tal_key *key) {
  char range[80], meaning[400];
  range_of(key, range, sizeof range);
  meaning_of(key, meaning, sizeof meaning);
  fprintf(v->out, "| `%s` | %s | ", path, type_name(key));
  put_cell(v->out, key->unit ? key->unit : "");
  put_cell(v->out, range);
  put_cell(v->out, default_of(key));
  put_cell(v->out, meaning);
  fputc('\n', v->out);
}

void tal_keys_markdown(FILE *out) {
  visit v = {.row = markdown_row, .out = out, .what = ""};
  fputs("| key | type | unit | range | default | meaning |\n|---|---|---|---|---|---|\n", out);
  walk(&v, tal_schema(), "");
}

static void print_words(FILE *out, const tal_key *keys, const char *above) {
  for (const tal_key *key = keys; key->name; key++) {
    char path[128];
    if (tal_schema_row(keys, key->name, NULL) != key)
      continue;
    snprintf(path, sizeof path, "%.80s%s%.40s", above, *above ? "." : "", key->name);
    if (key->type != TAL_KEY_GROUP)
      fprintf(out, "%s\n", path);
    if (key->type != TAL_KEY_LIST && key->keys)
      print_words(out, key->keys, path);
    for (int i = 0; key->type == TAL_KEY_LIST && i < 4; i++) {
      char item[140];
      snprintf(item, sizeof item, "%.120s.%d", path, i);
      print_words(out, key->keys, item);
    }
  }
}

void tal_keys_words(FILE *out) {
  print_words(out, tal_schema(), "");
}

static void near_row(visit *v, const char *path, const tal_key *key) {
  int distance = tal_edit_distance(v->what, path), name = tal_edit_distance(v->what, key->name);
  if (name < distance)
    distance = name;
  if (distance >= v->best || distance * 2 > (int)strlen(v->what))
    return;
  v->best = distance;
  snprintf(v->near, v->near_size, "%s", path);
}

void tal_keys_nearest(const char *what, char *out, size_t size) {
  char plain[200];
  *out = '\0';
  without_indices(what, plain, sizeof plain);
  visit v = {.row = near_row, .what = plain, .best = 4, .near = out, .near_size = size};
  walk(&v, tal_schema(), "");
}
