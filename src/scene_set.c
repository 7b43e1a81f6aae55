// --set KEY=VALUE on the tree. Whether the key exists and the value fits is found later, by the same readers as for the
// file.
#include "scene_set.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// One step of the path: a word or an index. Returns the rest, NULL at a malformed step.
static const char *next_step(const char *path, char *step, size_t size) {
  if (*path == '.')
    path++;
  bool bracket = *path == '[';
  path += bracket;
  size_t length = strcspn(path, bracket ? "]" : ".[");
  if (!length || length >= size)
    return NULL;
  memcpy(step, path, length);
  step[length] = '\0';
  path += length;
  if (!bracket)
    return *path == '.' && !path[1] ? NULL : path;
  return *path == ']' && strspn(step, "0123456789") == length ? path + 1 : NULL;
}

typedef struct setter {
  tal_tree *tree;
  tal_report *report;
  const char *override; // the tree's copy of "KEY=VALUE"
  const char *key;
} setter;

static void refuse(setter *s, const char *done, const char *what) {
  tal_report_text(s->report, 0, s->override, done, what);
}

static tal_node *existing(const tal_node *node, const char *step) {
  bool index = strspn(step, "0123456789") == strlen(step) && strlen(step) < 10;
  if (node->kind == TAL_NODE_LIST)
    return index ? tal_node_item(node, strtoul(step, NULL, 10)) : NULL;
  return tal_node_get(node, step);
}

// A list gains no item by --set and a word makes no list; reported otherwise.
static bool can_make(setter *s, const tal_node *node, const char *step, const char *done) {
  char text[160];
  bool index = strspn(step, "0123456789") == strlen(step);
  if (node->kind != TAL_NODE_LIST && !index)
    return true;
  if (node->kind != TAL_NODE_LIST)
    snprintf(text, sizeof text, "is no list with items in the scene; accepted: the whole list, %.40s=[...]", done);
  else if (!index)
    snprintf(text, sizeof text, "is a list; accepted: an index, such as %.40s.0.%.40s", done, step);
  else if (!node->count)
    snprintf(text, sizeof text, "is empty; accepted: the whole list, %.40s=[...]", done);
  else
    snprintf(text, sizeof text, "has %zu items; accepted: an index from 0 to %zu", node->count, node->count - 1);
  refuse(s, done, text);
  return false;
}

// Adds an empty child; what was no mapping becomes one.
static tal_node *make_child(setter *s, tal_node *map, const char *step) {
  if (map->kind != TAL_NODE_MAP) {
    map->kind = TAL_NODE_MAP;
    map->override = s->override;
    map->null = map->quoted = false;
  }
  tal_node *node = tal_node_create(s->tree, TAL_NODE_SCALAR);
  node->override = s->override;
  node->line = map->line;
  node->key = tal_tree_copy(s->tree, step, strlen(step));
  node->text = "";
  node->null = true;
  tal_node_append(map, node);
  return node;
}

// The node at the key, made if need be; NULL when reported. Nothing is made before every step is known to be possible.
static tal_node *reach(setter *s) {
  static const tal_node nothing = {.kind = TAL_NODE_MAP};
  char step[64];
  tal_node *node = s->tree->root;
  const char *rest = s->key, *made = NULL;
  for (const tal_node *at = node; *rest;) {
    const char *here = rest, *done = tal_tree_copy(s->tree, s->key, (size_t)(rest - s->key));
    rest = next_step(rest, step, sizeof step);
    tal_node *child = existing(at, step);
    if (!child && !can_make(s, at, step, done))
      return NULL;
    if (!child && !made)
      made = here;
    if (child)
      node = child;
    at = child ? child : &nothing;
  }
  for (rest = made ? made : rest; *rest;) {
    rest = next_step(rest, step, sizeof step);
    node = make_child(s, node, step);
  }
  return node;
}

static bool well_formed(const char *key) {
  char step[64];
  for (const char *rest = key; *rest;)
    if (!(rest = next_step(rest, step, sizeof step)))
      return false;
  return true;
}

static void replace(tal_node *node, const tal_node *value) {
  tal_node old = *node;
  *node = *value;
  node->key = old.key;
  node->next = old.next;
  node->line = old.line;
}

static tal_node *parse_value(setter *s, const char *value) {
  tal_yaml_error error;
  if (!value[strspn(value, " ")]) {
    refuse(s, s->key, "has no value; accepted: KEY=VALUE");
    return NULL;
  }
  tal_node *node = tal_yaml_parse(s->tree, value, strlen(value), s->override, &error);
  if (!node)
    refuse(s, s->key, error.text);
  return node;
}

void tal_scene_set(tal_tree *tree, const char *override, tal_report *report) {
  setter s = {tree, report, tal_tree_copy(tree, override, strlen(override)), ""};
  const char *equals = strchr(override, '=');
  if (!equals || equals == override) {
    refuse(&s, "", "names no key; accepted: KEY=VALUE, such as material.friction=0.3");
    return;
  }
  s.key = tal_tree_copy(tree, override, (size_t)(equals - override));
  if (!well_formed(s.key)) {
    refuse(&s, "", "is not a key; accepted: words joined by dots, such as stages.1.strain=0.1");
    return;
  }
  const tal_node *value = parse_value(&s, equals + 1);
  tal_node *node = value ? reach(&s) : NULL;
  if (node)
    replace(node, value);
}
