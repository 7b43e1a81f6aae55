// YAML to a small tree, on libyaml's event parser: the events come one by one, so depth and size are bounded before
// anything is built. See scene_yaml.h for what is refused.
#include "scene_yaml.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

#define BLOCK_BYTES ((size_t)64 * 1024)

typedef struct tal_tree_block {
  struct tal_tree_block *next;
  size_t used, size;
  char *memory;
} tal_tree_block;

static void *take(tal_tree *tree, size_t bytes) {
  bytes = (bytes + 15) / 16 * 16;
  tal_tree_block *block = tree->blocks;
  if (!block || block->size - block->used < bytes) {
    block = tal_alloc(1, sizeof *block);
    block->size = bytes > BLOCK_BYTES ? bytes : BLOCK_BYTES;
    block->memory = tal_alloc(block->size, 1);
    block->next = tree->blocks;
    tree->blocks = block;
  }
  void *memory = block->memory + block->used;
  block->used += bytes;
  return memory;
}

void tal_tree_clear(tal_tree *tree) {
  while (tree->blocks) {
    tal_tree_block *next = tree->blocks->next;
    free(tree->blocks->memory);
    free(tree->blocks);
    tree->blocks = next;
  }
  tree->root = NULL;
}

char *tal_tree_copy(tal_tree *tree, const char *text, size_t length) {
  char *copy = take(tree, length + 1);
  if (length)
    memcpy(copy, text, length);
  copy[length] = '\0';
  return copy;
}

tal_node *tal_node_create(tal_tree *tree, tal_node_kind kind) {
  tal_node *node = take(tree, sizeof *node);
  *node = (tal_node){.kind = kind};
  return node;
}

void tal_node_append(tal_node *parent, tal_node *child) {
  if (parent->last)
    parent->last->next = child;
  else
    parent->child = child;
  parent->last = child;
  parent->count++;
}

tal_node *tal_node_get(const tal_node *map, const char *key) {
  if (!map || map->kind != TAL_NODE_MAP)
    return NULL;
  for (tal_node *node = map->child; node; node = node->next)
    if (strcmp(node->key, key) == 0)
      return node;
  return NULL;
}

tal_node *tal_node_item(const tal_node *list, size_t index) {
  if (!list || list->kind != TAL_NODE_LIST)
    return NULL;
  tal_node *node = list->child;
  while (node && index--)
    node = node->next;
  return node;
}

static tal_node *follow(tal_node *node, const char *path, bool whole) {
  tal_node *reached = node;
  while (reached && *path) {
    char key[64];
    size_t length = strcspn(path, ".");
    snprintf(key, sizeof key, "%.*s", (int)length, path);
    tal_node *next = tal_node_get(reached, key);
    if (!next)
      return whole ? NULL : reached;
    reached = next;
    path += length + (path[length] == '.');
  }
  return reached;
}

tal_node *tal_node_find(tal_node *node, const char *path) {
  return follow(node, path, true);
}

tal_node *tal_node_nearest(tal_node *node, const char *path) {
  return follow(node, path, false);
}

// ---- events to tree ----

typedef struct builder {
  tal_tree *tree;
  const char *override;
  tal_yaml_error *error;
  tal_node *open[TAL_YAML_DEPTH]; // collections not closed yet
  size_t depth;
  const char *key; // read, its value still to come
  int key_line;
  tal_node *root;
  int documents;
} builder;

static bool refuse(builder *b, int line, const char *what) {
  b->error->line = line;
  snprintf(b->error->text, sizeof b->error->text, "%s", what);
  return false;
}

static bool plain_null(const char *text) {
  return !*text || strcmp(text, "~") == 0 || strcmp(text, "null") == 0;
}

static bool take_key(builder *b, const yaml_event_t *event, int line) {
  tal_node *map = b->open[b->depth - 1];
  const char *text = (const char *)event->data.scalar.value;
  if (map->count >= TAL_YAML_KEYS)
    return refuse(b, line, "a mapping with more than 256 keys; accepted: those of `talus keys`");
  const tal_node *twin = tal_node_get(map, text);
  if (twin) {
    b->error->line = line;
    snprintf(b->error->text, sizeof b->error->text, "the key '%.40s' is given twice (first in line %d); accepted: once",
             text, twin->line);
    return false;
  }
  b->key = tal_tree_copy(b->tree, text, event->data.scalar.length);
  b->key_line = line;
  return true;
}

// Puts a new node where the stream stands.
static tal_node *place(builder *b, tal_node_kind kind, int line) {
  tal_node *node = tal_node_create(b->tree, kind);
  node->override = b->override;
  node->line = line;
  if (!b->depth) {
    b->root = node;
    return node;
  }
  if (b->key) {
    node->key = b->key;
    node->line = b->key_line;
    b->key = NULL;
  }
  tal_node_append(b->open[b->depth - 1], node);
  return node;
}

static bool on_scalar(builder *b, const yaml_event_t *event, int line) {
  if (memchr(event->data.scalar.value, '\0', event->data.scalar.length))
    return refuse(b, line, "a NUL character in the text; accepted: plain text");
  bool in_map = b->depth && b->open[b->depth - 1]->kind == TAL_NODE_MAP;
  if (in_map && !b->key)
    return take_key(b, event, line);
  tal_node *node = place(b, TAL_NODE_SCALAR, line);
  node->text = tal_tree_copy(b->tree, (const char *)event->data.scalar.value, event->data.scalar.length);
  node->quoted = event->data.scalar.style != YAML_PLAIN_SCALAR_STYLE;
  node->null = !node->quoted && plain_null(node->text);
  return true;
}

static bool on_open(builder *b, tal_node_kind kind, int line) {
  if (b->depth && b->open[b->depth - 1]->kind == TAL_NODE_MAP && !b->key)
    return refuse(b, line, "a key that is a list or a mapping; accepted: a word");
  if (b->depth == TAL_YAML_DEPTH)
    return refuse(b, line, "nested too deep; accepted: at most 32 levels");
  tal_node *node = place(b, kind, line);
  b->open[b->depth++] = node;
  return true;
}

static bool on_event(builder *b, const yaml_event_t *event) {
  int line = (int)event->start_mark.line + 1;
  const char *plain = "anchors, aliases and tags (& * !) are not supported; accepted: the value itself";
  switch (event->type) {
  case YAML_DOCUMENT_START_EVENT:
    if (event->data.document_start.version_directive ||
        event->data.document_start.tag_directives.start != event->data.document_start.tag_directives.end)
      return refuse(b, line, "directives (%YAML, %TAG) are not supported; accepted: the keys themselves");
    return b->documents++ ? refuse(b, line, "a second document (---); accepted: one") : true;
  case YAML_ALIAS_EVENT:
    return refuse(b, line, plain);
  case YAML_SCALAR_EVENT:
    if (event->data.scalar.anchor || event->data.scalar.tag)
      return refuse(b, line, plain);
    return on_scalar(b, event, line);
  case YAML_SEQUENCE_START_EVENT:
    if (event->data.sequence_start.anchor || event->data.sequence_start.tag)
      return refuse(b, line, plain);
    return on_open(b, TAL_NODE_LIST, line);
  case YAML_MAPPING_START_EVENT:
    if (event->data.mapping_start.anchor || event->data.mapping_start.tag)
      return refuse(b, line, plain);
    return on_open(b, TAL_NODE_MAP, line);
  case YAML_SEQUENCE_END_EVENT:
  case YAML_MAPPING_END_EVENT:
    b->depth--;
    return true;
  default:
    return true;
  }
}

static int line_of_offset(const char *bytes, size_t size, size_t offset) {
  int line = 1;
  for (size_t i = 0; i < size && i < offset; i++)
    line += bytes[i] == '\n';
  return line;
}

static void syntax_error(const yaml_parser_t *parser, const char *bytes, size_t size, tal_yaml_error *error) {
  const char *problem = parser->problem ? parser->problem : "cannot be read";
  if (parser->error == YAML_READER_ERROR) {
    error->line = line_of_offset(bytes, size, parser->problem_offset);
    snprintf(error->text, sizeof error->text, "not plain text: %s; accepted: YAML in UTF-8", problem);
    return;
  }
  error->line = (int)parser->problem_mark.line + 1;
  const char *hint = "";
  if (strstr(problem, "cannot start any token"))
    hint = " (indent with spaces, not tabs)";
  snprintf(error->text, sizeof error->text, "not YAML: %s%s%s%s; accepted: key: value", problem,
           parser->context ? " " : "", parser->context ? parser->context : "", hint);
}

static bool run_parser(builder *b, yaml_parser_t *parser, const char *bytes, size_t size) {
  for (bool done = false; !done;) {
    yaml_event_t event;
    if (!yaml_parser_parse(parser, &event)) {
      syntax_error(parser, bytes, size, b->error);
      return false;
    }
    done = event.type == YAML_STREAM_END_EVENT;
    bool good = on_event(b, &event);
    yaml_event_delete(&event);
    if (!good)
      return false;
  }
  return b->root ? true : refuse(b, 1, "empty; accepted: key: value (see `talus keys`)");
}

tal_node *tal_yaml_parse(tal_tree *tree, const char *bytes, size_t size, const char *override, tal_yaml_error *error) {
  *error = (tal_yaml_error){0};
  builder b = {.tree = tree, .override = override, .error = error};
  yaml_parser_t parser;
  if (!yaml_parser_initialize(&parser)) {
    refuse(&b, 0, "no memory for the YAML parser");
    return NULL;
  }
  yaml_parser_set_input_string(&parser, (const unsigned char *)bytes, size);
  bool good = run_parser(&b, &parser, bytes, size);
  yaml_parser_delete(&parser);
  return good ? b.root : NULL;
}
