// One value at a time: a scalar, a pair, a list of numbers. Strict, and helpful about what was probably meant.
#include "scene_value.h"
#include "scene_walk.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_scalar(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at) {
  if (node->kind == TAL_NODE_SCALAR && !node->null)
    return true;
  const char *what = node->kind == TAL_NODE_MAP    ? "is a mapping"
                     : node->kind == TAL_NODE_LIST ? "is a list"
                                                   : "has no value";
  tal_walk_wrong(report, key, node, at, what, "");
  return false;
}

static bool out_of_range(const tal_key *key, double value) {
  if (isnan(value))
    return true;
  if (isinf(value))
    return !(key->infinite && value > 0);
  return value < key->low || value > key->high || (key->low_open && value == key->low) ||
         (key->high_open && value == key->high);
}

// Says what is wrong with a scalar that was expected to be `what`.
static void complain_scalar(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at,
                            const char *what, const char *guess) {
  char quoted[48], text[160];
  tal_quote(node->text, 40, quoted, sizeof quoted);
  snprintf(text, sizeof text, "'%s' %s", quoted, node->quoted ? "is quoted, which makes it text" : what);
  tal_walk_wrong(report, key, node, at, text, node->quoted ? "" : guess);
}

static bool read_real(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at, double *out) {
  static const char *const problems[] = {"", "is not a number", "is too large for a number",
                                         "is too small for a number"};
  char guess[64] = "";
  double value = 0;
  if (!is_scalar(report, key, node, at))
    return false;
  tal_number result = tal_read_real(node->text, &value);
  if (result != TAL_NUMBER_OK || node->quoted) {
    tal_guess_real(node->text, key->unit, guess, sizeof guess);
    complain_scalar(report, key, node, at, problems[result], guess);
    return false;
  }
  if (out_of_range(key, value)) {
    complain_scalar(report, key, node, at, isfinite(value) ? "is out of range" : "is not a finite number", "");
    return false;
  }
  *out = value;
  return true;
}

static bool read_whole(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at,
                       int64_t *out) {
  static const char *const problems[] = {"", "is not a whole number in digits", "is too large", ""};
  char digits[32] = "", guess[64] = "";
  int64_t value = 0;
  if (!is_scalar(report, key, node, at))
    return false;
  tal_number result = tal_read_whole(node->text, &value);
  if (result != TAL_NUMBER_OK || node->quoted) {
    tal_guess_whole(node->text, digits, sizeof digits);
    snprintf(guess, sizeof guess, "%s", *digits ? digits : "digits only, such as 10000");
    complain_scalar(report, key, node, at, problems[result], result == TAL_NUMBER_NOT ? guess : "");
    return false;
  }
  if ((double)value < key->low || (double)value > key->high) {
    complain_scalar(report, key, node, at, "is out of range", "");
    return false;
  }
  *out = value;
  return true;
}

static void read_bool(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at, bool *out) {
  bool value;
  if (!is_scalar(report, key, node, at))
    return;
  if (node->quoted || !tal_read_bool(node->text, &value))
    complain_scalar(report, key, node, at, "is not true or false", "");
  else
    *out = value;
}

static void read_text(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at, char **out) {
  if (!is_scalar(report, key, node, at))
    return;
  bool good = *node->text && strlen(node->text) <= 1000;
  for (const char *c = node->text; *c; c++)
    good = good && (unsigned char)*c >= ' ' && *c != 127;
  if (!good) {
    tal_walk_wrong(report, key, node, at, "is empty, longer than 1000 bytes or more than one line", "");
    return;
  }
  free(*out);
  *out = tal_strdup(node->text);
}

void tal_store_choice(const tal_key *key, int index, const char *name, void *place) {
  if (key->size == sizeof(char *))
    memcpy(place, &name, sizeof name);
  else if (key->size == sizeof(bool))
    *(bool *)place = index != 0;
  else if (key->size == sizeof(int))
    memcpy(place, &index, sizeof index);
}

static void read_choice(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at,
                        void *place) {
  const char *name = NULL;
  if (!is_scalar(report, key, node, at))
    return;
  int index = tal_key_choice(key, node->text, &name);
  if (index < 0) {
    char quoted[48], text[80];
    tal_quote(node->text, 40, quoted, sizeof quoted);
    snprintf(text, sizeof text, "'%s' is not known", quoted);
    tal_walk_wrong(report, key, node, at, text, "");
    return;
  }
  tal_store_choice(key, index, name, place);
}

// Two numbers, each checked against the row's range; the pair is kept only whole.
static bool read_pair(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at,
                      double out[2]) {
  double value[2] = {0, 0};
  if (node->kind != TAL_NODE_LIST || node->count != 2) {
    tal_walk_wrong(report, key, node, at, "is not a list of two numbers", "");
    return false;
  }
  tal_key element = *key;
  element.type = TAL_KEY_REAL;
  bool good = true;
  for (size_t i = 0; i < 2; i++) {
    tal_trail item = {at, NULL, i};
    good = read_real(report, &element, tal_node_item(node, i), &item, &value[i]) && good;
  }
  if (good)
    memcpy(out, value, sizeof value);
  return good;
}

bool tal_list_length_good(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at) {
  double least = key->type == TAL_KEY_WHOLES ? 0 : key->low;
  if (node->kind == TAL_NODE_LIST && (double)node->count >= least && (double)node->count <= key->high)
    return true;
  char text[80];
  if (node->kind == TAL_NODE_LIST)
    snprintf(text, sizeof text, "has %zu items", node->count);
  else
    snprintf(text, sizeof text,
             node->kind == TAL_NODE_MAP ? "is a mapping"
             : node->null               ? "has no value"
                                        : "is not a list");
  tal_walk_wrong(report, key, node, at, text, "");
  return false;
}

void tal_store_array(const tal_key *key, char *base, void *array, size_t count) {
  memcpy(base + key->offset, &array, sizeof array);
  memcpy(base + key->count_offset, &count, sizeof count);
}

// The array becomes the row's list; with a wrong element it is thrown away and the list stays empty.
static void store_or_drop(const tal_key *key, char *base, void *array, size_t count, bool good) {
  if (good)
    tal_store_array(key, base, array, count);
  else
    free(array);
}

static void read_wholes(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at, char *base) {
  if (!tal_list_length_good(report, key, node, at) || !node->count)
    return;
  int64_t *values = tal_alloc(node->count, sizeof *values);
  tal_key element = *key;
  element.type = TAL_KEY_WHOLE;
  bool good = true;
  size_t i = 0;
  for (const tal_node *child = node->child; child; child = child->next, i++) {
    tal_trail item = {at, NULL, i};
    good = read_whole(report, &element, child, &item, &values[i]) && good;
  }
  store_or_drop(key, base, values, node->count, good);
}

static void read_pairs(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at, char *base) {
  const tal_key pair = {.name = "",
                        .type = TAL_KEY_VECTOR,
                        .unit = key->unit ? key->unit : "m and percent",
                        .low = key->unit ? -HUGE_VAL : 0,
                        .high = HUGE_VAL};
  if (!tal_list_length_good(report, key, node, at))
    return;
  double(*values)[2] = tal_alloc(node->count, sizeof *values);
  bool good = true;
  size_t i = 0;
  for (const tal_node *child = node->child; child; child = child->next, i++) {
    tal_trail item = {at, NULL, i};
    good = read_pair(report, &pair, child, &item, values[i]) && good;
  }
  store_or_drop(key, base, values, node->count, good);
}

// ---- forced grains ----

static const tal_key forced_id = {.name = "", .type = TAL_KEY_WHOLE, .low = 0, .high = 1e8};
static const tal_key forced_random = {.name = "random", .type = TAL_KEY_WHOLE, .low = 1, .high = 1e6};
static const tal_key forced_margin = {
    .name = "margin", .type = TAL_KEY_REAL, .unit = "mean diameters", .high = HUGE_VAL};

static void read_drawn(tal_report *report, const tal_node *node, const tal_trail *at, tal_scene_forced *out) {
  for (const tal_node *child = node->child; child; child = child->next) {
    tal_trail here = {at, child->key, 0};
    if (strcmp(child->key, "random") == 0)
      read_whole(report, &forced_random, child, &here, &out->random);
    else if (strcmp(child->key, "margin") == 0)
      read_real(report, &forced_margin, child, &here, &out->margin);
    else
      tal_walk_complain(report, child, &here, "unknown key; accepted: random, margin");
  }
  tal_trail here = {at, "random", 0};
  if (!tal_node_get(node, "random"))
    tal_walk_wrong(report, &forced_random, node, &here, "is missing", "");
}

static void read_listed(tal_report *report, const tal_node *node, const tal_trail *at, tal_scene_forced *out) {
  int64_t *ids = tal_alloc(node->count, sizeof *ids);
  bool good = true;
  size_t k = 0;
  for (const tal_node *child = node->child; child; child = child->next, k++) {
    tal_trail item = {at, NULL, k};
    good = read_whole(report, &forced_id, child, &item, &ids[k]) && good;
    for (size_t j = 0; good && j < k; j++)
      if (ids[j] == ids[k]) {
        tal_walk_complain(report, child, &item, "is listed already; accepted: each grain once");
        good = false;
      }
  }
  if (!good) {
    free(ids);
    return;
  }
  free(out->ids);
  *out = (tal_scene_forced){.ids = ids, .count = node->count, .margin = out->margin, .many = true};
}

static void read_forced(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at,
                        tal_scene_forced *out) {
  out->margin = 10;
  int64_t id = 0;
  if (node->kind == TAL_NODE_MAP) {
    read_drawn(report, node, at, out);
  } else if (node->kind == TAL_NODE_LIST && node->count) {
    read_listed(report, node, at, out);
  } else if (node->kind != TAL_NODE_SCALAR || node->null || node->quoted) {
    tal_walk_wrong(report, key, node, at, "is no choice of grains", "");
  } else if (tal_read_whole(node->text, &id) == TAL_NUMBER_OK && id >= 0) {
    free(out->ids);
    *out = (tal_scene_forced){.ids = tal_alloc(1, sizeof *out->ids), .count = 1, .margin = 10};
    out->ids[0] = id;
  } else if (strcmp(node->text, "nearest") != 0) {
    complain_scalar(report, key, node, at, "is no choice of grains", "");
  }
}

void tal_read_plain(tal_report *report, const tal_key *key, const tal_node *node, char *base, const tal_trail *at) {
  void *place = base + key->offset;
  if (key->type == TAL_KEY_REAL)
    read_real(report, key, node, at, place);
  if (key->type == TAL_KEY_WHOLE)
    read_whole(report, key, node, at, place);
  if (key->type == TAL_KEY_BOOL)
    read_bool(report, key, node, at, place);
  if (key->type == TAL_KEY_TEXT)
    read_text(report, key, node, at, place);
  if (key->type == TAL_KEY_CHOICE)
    read_choice(report, key, node, at, place);
  if (key->type == TAL_KEY_VECTOR)
    read_pair(report, key, node, at, place);
  if (key->type == TAL_KEY_WHOLES)
    read_wholes(report, key, node, at, base);
  if (key->type == TAL_KEY_PAIRS)
    read_pairs(report, key, node, at, base);
  if (key->type == TAL_KEY_FORCED)
    read_forced(report, key, node, at, place);
}
