// Pass 2: keys that do not go with the choices made, and required keys that are missing.
#include "scene_read.h"
#include "scene_walk.h"

#include <stdio.h>
#include <string.h>

static void check_group(tal_report *report, const tal_key *keys, const tal_node *node, const char *base,
                        const tal_trail *at);

static const tal_key *row_that_exists(const tal_key *keys, const char *name, const tal_node *node, const char *base) {
  for (const tal_key *key = keys; key->name; key++)
    if (strcmp(key->name, name) == 0 && tal_walk_exists(key, keys, node, base))
      return key;
  return NULL;
}

static void without_effect(tal_report *report, const tal_key *keys, const tal_node *child, const char *value,
                           const tal_trail *at) {
  const tal_key *key = tal_walk_row(keys, child->key);
  char only[120] = "", text[300];
  for (const tal_key *other = key; other->name; other++) {
    if (strcmp(other->name, key->name) != 0)
      continue;
    size_t used = strlen(only);
    snprintf(only + used, sizeof only - used, "%s%s", used ? " or " : "", other->only);
  }
  snprintf(text, sizeof text, "has no effect with %s: %s; accepted: only with %s: %s", key->selector, value,
           key->selector, only);
  tal_walk_complain(report, child, at, text);
}

static void check_child(tal_report *report, const tal_key *keys, const tal_node *node, const tal_node *child,
                        const char *base, const tal_trail *at) {
  const tal_key *key = tal_walk_row(keys, child->key);
  if (!key)
    return;
  tal_trail here = {at, child->key, 0};
  const char *value = tal_walk_selected(key, keys, node, base);
  if (value && !row_that_exists(keys, child->key, node, base))
    without_effect(report, keys, child, value, &here);
  if (key->type == TAL_KEY_GROUP && child->kind == TAL_NODE_MAP)
    check_group(report, key->keys, child, base + key->offset, &here);
  if (key->type != TAL_KEY_LIST)
    return;
  void *array;
  memcpy(&array, base + key->offset, sizeof array);
  size_t i = 0;
  for (const tal_node *item = array ? child->child : NULL; item; item = item->next, i++) {
    tal_trail there = {&here, NULL, i};
    if (item->kind == TAL_NODE_MAP)
      check_group(report, key->keys, item, (char *)array + i * key->item_size, &there);
  }
}

// Required keys of this group (or of a group absent from the file) that exist and are not given.
static void check_missing(tal_report *report, const tal_key *keys, const tal_node *node, const tal_node *parent,
                          const char *base, const tal_trail *at) {
  for (const tal_key *key = keys; key->name; key++) {
    tal_trail here = {at, key->name, 0};
    if (tal_node_get(node, key->name))
      continue;
    if (key->type == TAL_KEY_GROUP && !key->optional)
      check_missing(report, key->keys, NULL, parent, base + key->offset, &here);
    const char *value = tal_walk_selected(key, keys, node, base);
    if (key->required && (!key->selector || (value && tal_key_exists_with(key, value))))
      tal_walk_wrong(report, key, parent, &here, "is missing", "");
  }
}

static void check_group(tal_report *report, const tal_key *keys, const tal_node *node, const char *base,
                        const tal_trail *at) {
  check_missing(report, keys, node, node, base, at);
  for (const tal_node *child = node->child; child; child = child->next)
    check_child(report, keys, node, child, base, at);
}

void tal_schema_read_variants(const tal_key *keys, const void *base, const tal_node *root, tal_report *report) {
  check_group(report, keys, root, base, NULL);
}

void tal_scene_read_variants(const tal_scene *scene, const tal_node *root, tal_report *report) {
  tal_schema_read_variants(tal_schema(), scene, root, report);
}
