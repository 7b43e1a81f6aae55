// Pass 1: walks the tree beside the schema table. Knows types and ranges, no key by name: rules that join several keys
// are in scene_check.c. Every value, default or given, goes through the same readers.
#include "scene_read.h"

#include "scene_value.h"
#include "scene_walk.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void read_group(tal_report *report, const tal_key *keys, const tal_node *node, char *base, const tal_trail *at);

static void read_list(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at, char *base) {
  if (!tal_list_length_good(report, key, node, at) || !node->count)
    return;
  char *items = tal_alloc(node->count, key->item_size);
  tal_key entry = *key;
  entry.type = TAL_KEY_GROUP;
  size_t i = 0;
  for (const tal_node *child = node->child; child; child = child->next, i++) {
    tal_trail item = {at, NULL, i};
    const tal_node *map = child->kind == TAL_NODE_MAP ? child : NULL;
    if (!map)
      tal_walk_wrong(report, &entry, child, &item, "is not a mapping", "");
    read_group(report, key->keys, map, items + i * key->item_size, &item);
  }
  tal_store_array(key, base, items, node->count);
}

static void read_subgroup(tal_report *report, const tal_key *key, const tal_node *node, char *base,
                          const tal_trail *at) {
  const tal_node *map = node->kind == TAL_NODE_MAP ? node : NULL;
  if (!map)
    tal_walk_wrong(report, key, node, at, node->null ? "has no value" : "is not a mapping", "");
  read_group(report, key->keys, map, base + key->offset, at);
}

static void read_value(tal_report *report, const tal_key *key, const tal_node *node, char *base, const tal_trail *at) {
  bool mapping = key->keys && node->kind == TAL_NODE_MAP;
  if (key->type == TAL_KEY_LIST) {
    read_list(report, key, node, at, base);
  } else if (key->type == TAL_KEY_GROUP) {
    read_subgroup(report, key, node, base, at);
  } else if (key->type == TAL_KEY_WHOLE && mapping) {
    *(int64_t *)(base + key->offset) = 0;
    read_group(report, key->keys, node, base, at);
  } else {
    tal_read_plain(report, key, node, base, at);
  }
}

static void set_vector(double *place, double x, double y) {
  place[0] = x;
  place[1] = y;
}

// The row's default; the zeroed struct already holds 0, false, NULL and empty lists.
static void set_default(const tal_key *key, char *base) {
  char *place = base + key->offset;
  const char *text = key->fallback;
  const char *name = NULL;
  if (key->type == TAL_KEY_VECTOR)
    set_vector((double *)place, text ? 0 : nan(""), text ? 0 : nan(""));
  if (key->type == TAL_KEY_REAL && (!text || tal_read_real(text, (double *)place) != TAL_NUMBER_OK))
    *(double *)place = nan("");
  if (!text)
    return;
  if (key->type == TAL_KEY_WHOLE)
    tal_read_whole(text, (int64_t *)place);
  if (key->type == TAL_KEY_BOOL)
    tal_read_bool(text, (bool *)place);
  if (key->type == TAL_KEY_TEXT)
    *(char **)place = tal_strdup(text);
  if (key->type != TAL_KEY_CHOICE)
    return;
  int index = tal_key_choice(key, text, &name);
  if (index >= 0)
    tal_store_choice(key, index, name, place);
}

static void set_unset(const tal_key *key, char *base) {
  tal_key bare = *key;
  bare.fallback = NULL;
  set_default(&bare, base);
}

static void set_defaults(const tal_key *keys, const tal_node *node, char *base) {
  for (const tal_key *key = keys; key->name; key++)
    set_unset(key, base);
  for (const tal_key *key = keys; key->name; key++)
    if (tal_walk_exists(key, keys, node, base))
      set_default(key, base);
}

static void unknown_key(tal_report *report, const tal_key *keys, const tal_node *child, const tal_trail *at) {
  const char *near = NULL;
  int best = 3;
  for (const tal_key *key = keys; key->name; key++) {
    int distance = tal_edit_distance(child->key, key->name);
    if (distance >= best || distance * 2 > (int)strlen(key->name))
      continue;
    best = distance;
    near = key->name;
  }
  char names[300], text[400];
  tal_schema_names(keys, 20, names, sizeof names);
  if (near)
    snprintf(text, sizeof text, "unknown key; did you mean '%s'? accepted: %s", near, names);
  else
    snprintf(text, sizeof text, "unknown key; accepted: %s", names);
  tal_walk_complain(report, child, at, text);
}

// Reads a mapping (NULL: all defaults) into the struct at base.
static void read_group(tal_report *report, const tal_key *keys, const tal_node *node, char *base, const tal_trail *at) {
  set_defaults(keys, node, base);
  for (const tal_key *key = keys; key->name; key++)
    if (key->keys && key->type == TAL_KEY_GROUP && !tal_node_get(node, key->name))
      read_group(report, key->keys, NULL, base + key->offset, at);
    else if (key->keys && key->type == TAL_KEY_WHOLE)
      set_defaults(key->keys, NULL, base);
  for (const tal_node *child = node ? node->child : NULL; child; child = child->next) {
    tal_trail here = {at, child->key, 0};
    const tal_key *key = tal_walk_row(keys, child->key);
    if (!key) {
      unknown_key(report, keys, child, &here);
      continue;
    }
    read_value(report, tal_schema_row(keys, child->key, tal_walk_selected(key, keys, node, base)), child, base, &here);
  }
}

void tal_schema_read(const tal_key *keys, void *base, const tal_node *root, tal_report *report) {
  read_group(report, keys, root, base, NULL);
}

void tal_scene_read(tal_scene *scene, const tal_node *root, tal_report *report) {
  tal_schema_read(tal_schema(), scene, root, report);
}

void tal_schema_release(const tal_key *keys, void *base) {
  for (const tal_key *key = keys; key->name; key++) {
    if (tal_schema_row(keys, key->name, NULL) != key)
      continue;
    char *place = (char *)base + key->offset;
    if (key->type == TAL_KEY_GROUP)
      tal_schema_release(key->keys, place);
    bool owned = key->type == TAL_KEY_TEXT || key->type == TAL_KEY_WHOLES || key->type == TAL_KEY_PAIRS ||
                 key->type == TAL_KEY_LIST || key->type == TAL_KEY_FORCED;
    if (!owned)
      continue;
    void *memory;
    memcpy(&memory, place, sizeof memory);
    free(memory);
    memory = NULL;
    memcpy(place, &memory, sizeof memory);
  }
}
