// YAML text as a small tree with line numbers: what the scene loader walks. Only the plain part of YAML: mappings,
// lists and scalars; no anchors, aliases, tags or second document. Private to scene*.c and study*.c.
#ifndef TAL_SCENE_YAML_H
#define TAL_SCENE_YAML_H

#include "base.h"
#include <stdbool.h>

#define TAL_YAML_DEPTH 32                     // deepest nesting accepted
#define TAL_YAML_KEYS  256                    // most keys in one mapping
#define TAL_YAML_BYTES ((size_t)64 * 1 << 20) // longest text accepted

typedef enum tal_node_kind { TAL_NODE_SCALAR, TAL_NODE_LIST, TAL_NODE_MAP } tal_node_kind;

typedef struct tal_node tal_node;
struct tal_node {
  tal_node_kind kind;
  bool quoted;          // scalar written with quotes or as a block: text, never a number
  bool null;            // plain empty scalar, ~ or null
  int line;             // of the key, for an item its own, for the root its first line
  const char *override; // NULL: from the file, else "KEY=VALUE" of the --set it came from
  const char *key;      // inside a mapping, else NULL
  const char *text;     // scalar
  tal_node *child, *last, *next;
  size_t count; // children
};

// Owns every node and text of one scene (file and overrides). Zero-initialise; free with tal_tree_clear.
typedef struct tal_tree {
  tal_node *root;
  struct tal_tree_block *blocks;
} tal_tree;

typedef struct tal_yaml_error {
  int line;       // 1-based, 0 when unknown
  char text[240]; // what is wrong and what is accepted
} tal_yaml_error;

// Parses `size` bytes; `override` as in tal_node. Returns the root node (owned by the tree), NULL with *error filled.
tal_node *tal_yaml_parse(tal_tree *tree, const char *bytes, size_t size, const char *override, tal_yaml_error *error);
void tal_tree_clear(tal_tree *tree);
char *tal_tree_copy(tal_tree *tree, const char *text, size_t length);
// A new empty mapping or scalar of the tree.
tal_node *tal_node_create(tal_tree *tree, tal_node_kind kind);
void tal_node_append(tal_node *parent, tal_node *child);

// Child of a mapping, NULL when there is none or `map` is NULL or no mapping.
tal_node *tal_node_get(const tal_node *map, const char *key);
// Item of a list, NULL when out of range.
tal_node *tal_node_item(const tal_node *list, size_t index);
// Follows "a.b.c" through mappings; NULL when a step is missing.
tal_node *tal_node_find(tal_node *node, const char *path);
// The deepest node on the way along `path` that exists.
tal_node *tal_node_nearest(tal_node *node, const char *path);

#endif
