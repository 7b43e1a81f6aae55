// What the schema's rows say in words: ranges, choices, what is accepted.
#include "scene_schema.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

bool tal_word_among(const char *word, const char *words) {
  size_t length = strlen(word);
  for (const char *at = words; *at;) {
    size_t span = strcspn(at, " ");
    if (span == length && strncmp(at, word, span) == 0)
      return true;
    at += span;
    at += strspn(at, " ");
  }
  return false;
}

bool tal_key_exists_with(const tal_key *key, const char *value) {
  return !key->selector || !value || tal_word_among(value, key->only);
}

int tal_key_choice(const tal_key *key, const char *name, const char **found) {
  tal_choice list[TAL_CHOICES];
  size_t count = key->choices(list, TAL_CHOICES);
  for (size_t i = 0; i < count; i++) {
    if (strcmp(list[i].name, name) != 0)
      continue;
    if (found)
      *found = list[i].name;
    return (int)i;
  }
  return -1;
}

static void add(char *out, size_t size, const char *text) {
  size_t used = strlen(out);
  snprintf(out + used, size - used, "%s", text);
}

void tal_key_choice_names(const tal_key *key, const char *separator, char *out, size_t size) {
  tal_choice list[TAL_CHOICES];
  size_t count = key->choices(list, TAL_CHOICES);
  *out = '\0';
  for (size_t i = 0; i < count; i++) {
    if (i)
      add(out, size, separator);
    add(out, size, list[i].name);
  }
}

void tal_schema_names(const tal_key *keys, size_t most, char *out, size_t size) {
  size_t count = 0;
  *out = '\0';
  for (const tal_key *key = keys; key->name; key++) {
    if (tal_schema_row(keys, key->name, NULL) != key)
      continue;
    if (count++ == most) {
      add(out, size, ", ...");
      return;
    }
    if (count > 1)
      add(out, size, ", ");
    add(out, size, key->name);
  }
}

void tal_key_range(const tal_key *key, char *out, size_t size) {
  bool number = key->type == TAL_KEY_REAL || key->type == TAL_KEY_WHOLE;
  bool low = !isinf(key->low), high = !isinf(key->high);
  *out = '\0';
  if (!number || (!low && !high))
    return;
  if (low && high)
    snprintf(out, size, "in %c%.15g, %.15g%c", key->low_open ? '(' : '[', key->low, key->high,
             key->high_open ? ')' : ']');
  else if (low)
    snprintf(out, size, "%s %.15g", key->low_open ? ">" : ">=", key->low);
}

static void accepted_number(const tal_key *key, const char *article, char *out, size_t size) {
  char range[64];
  tal_key_range(key, range, sizeof range);
  bool unit = key->unit && key->type == TAL_KEY_REAL;
  snprintf(out, size, "%s%s%s%s%s%s", article, unit ? " in " : "", unit ? key->unit : "", *range ? " " : "", range,
           key->infinite ? " or .inf" : "");
}

static void accepted_group(const tal_key *key, const char *article, char *out, size_t size) {
  char names[200];
  tal_schema_names(key->keys, 12, names, sizeof names);
  snprintf(out, size, "%s with %s", article, names);
}

void tal_key_accepted(const tal_key *key, char *out, size_t size) {
  switch (key->type) {
  case TAL_KEY_REAL:
    accepted_number(key, "a number", out, size);
    break;
  case TAL_KEY_WHOLE:
    accepted_number(key, "a whole number", out, size);
    if (key->keys)
      add(out, size, ", or a mapping with strain or displacement");
    break;
  case TAL_KEY_BOOL:
    snprintf(out, size, "true or false");
    break;
  case TAL_KEY_TEXT:
    snprintf(out, size, "a line of text");
    break;
  case TAL_KEY_CHOICE:
    tal_key_choice_names(key, ", ", out, size);
    break;
  case TAL_KEY_VECTOR:
    snprintf(out, size, "two numbers in %s: [x, y]", key->unit);
    break;
  case TAL_KEY_WHOLES:
    snprintf(out, size, "a list of whole numbers >= %g: [0, 1]", key->low);
    break;
  case TAL_KEY_PAIRS:
    snprintf(out, size, "a list of at least %g pairs: [[%s], ...]", key->low, key->unit ? "x, y" : "diameter, percent");
    break;
  case TAL_KEY_GROUP:
    accepted_group(key, "a mapping", out, size);
    break;
  case TAL_KEY_LIST:
    accepted_group(key, "a list of mappings", out, size);
    break;
  case TAL_KEY_FORCED:
    snprintf(out, size,
             "nearest, a grain's id, a list of ids, or {random: how many, margin: mean diameters from the rim}");
    break;
  case TAL_KEY_TREE:
    snprintf(out, size, "%s", key->note);
    break;
  }
}

const tal_key *tal_schema_row(const tal_key *keys, const char *name, const char *value) {
  const tal_key *first = NULL;
  for (const tal_key *key = keys; key->name; key++) {
    if (strcmp(key->name, name) != 0)
      continue;
    if (key->selector && value && tal_key_exists_with(key, value))
      return key;
    if (!first)
      first = key;
  }
  return first;
}
