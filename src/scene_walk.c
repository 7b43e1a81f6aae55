// The walk's messages and its view of the choices; see the header.
#include "scene_walk.h"

#include "scene_value.h"

#include <stdio.h>
#include <string.h>

static void write_trail(const tal_trail *at, char *out, size_t size) {
  *out = '\0';
  if (!at)
    return;
  write_trail(at->up, out, size);
  size_t used = strlen(out);
  char name[48];
  if (at->name) {
    tal_quote(at->name, 40, name, sizeof name);
    snprintf(out + used, size - used, "%s%s", used ? "." : "", name);
  } else {
    snprintf(out + used, size - used, "[%zu]", at->index);
  }
}

void tal_walk_complain(tal_report *report, const tal_node *node, const tal_trail *at, const char *what) {
  char key[200];
  write_trail(at, key, sizeof key);
  tal_report_add(report, node, key, "%s", what);
}

void tal_walk_wrong(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at, const char *what,
                    const char *guess) {
  char accepted[400], text[560];
  tal_key_accepted(key, accepted, sizeof accepted);
  const char *open = *guess ? " (write " : "", *close = *guess ? ")" : "";
  snprintf(text, sizeof text, "%s; accepted: %s%s%s%s", what, accepted, open, guess, close);
  tal_walk_complain(report, node, at, text);
}

const char *tal_walk_chosen(const tal_key *key, const void *place) {
  tal_choice list[TAL_CHOICES];
  size_t count = key->choices(list, TAL_CHOICES);
  int index = 0;
  const char *name = NULL;
  if (key->size == sizeof(char *)) {
    memcpy(&name, place, sizeof name);
    return name;
  }
  if (key->size == sizeof(bool))
    index = *(const bool *)place;
  else if (key->size == sizeof(int))
    memcpy(&index, place, sizeof index);
  return index >= 0 && (size_t)index < count ? list[index].name : NULL;
}

const tal_key *tal_walk_row(const tal_key *keys, const char *name) {
  return tal_schema_row(keys, name, NULL);
}

// The selector's value as the tree says it, else as the struct holds it (pass 1: the default); NULL when given badly.
static const char *selected(const tal_key *keys, const char *selector, const tal_node *node, const char *base) {
  const tal_key *key = tal_walk_row(keys, selector);
  const tal_node *given = tal_node_get(node, selector);
  if (!given)
    return tal_walk_chosen(key, base + key->offset);
  const char *name = NULL;
  if (given->kind == TAL_NODE_SCALAR)
    tal_key_choice(key, given->text, &name);
  return name;
}

const char *tal_walk_selected(const tal_key *key, const tal_key *keys, const tal_node *node, const char *base) {
  return key->selector ? selected(keys, key->selector, node, base) : NULL;
}

bool tal_walk_exists(const tal_key *key, const tal_key *keys, const tal_node *node, const char *base) {
  const char *value = tal_walk_selected(key, keys, node, base);
  return value ? tal_key_exists_with(key, value) : tal_walk_row(keys, key->name) == key;
}
