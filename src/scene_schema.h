// The schema: one table that says every scene key's name, type, unit, range, default and meaning. The loader, the
// canonical text, `talus keys`, the JSON Schema and the shell completion all read it. Private to scene*.c and study*.c.
#ifndef TAL_SCENE_SCHEMA_H
#define TAL_SCENE_SCHEMA_H

#include "registry.h"
#include "scene.h"

typedef enum tal_key_type {
  TAL_KEY_REAL,   // double
  TAL_KEY_WHOLE,  // int64_t (or uint64_t); with `keys`: either a whole number or that mapping
  TAL_KEY_BOOL,   // bool
  TAL_KEY_TEXT,   // char *, owned
  TAL_KEY_CHOICE, // const char * of the registry, or (by size) an enum or bool holding the choice's index
  TAL_KEY_VECTOR, // double[2]
  TAL_KEY_WHOLES, // owned int64_t array and its count
  TAL_KEY_PAIRS,  // owned double (*)[2] array and its count
  TAL_KEY_GROUP,  // mapping, a struct
  TAL_KEY_LIST,   // list of mappings, owned array of structs and its count
  TAL_KEY_FORCED, // tal_scene_forced: `nearest`, an id, a list of ids, or {random: K, margin: M}
  TAL_KEY_TREE    // anything, `note` says what; the tree's owner reads it, the struct keeps nothing
} tal_key_type;

typedef struct tal_key tal_key;
struct tal_key {
  const char *name;
  tal_key_type type;
  const char *unit;     // NULL: none
  const char *fallback; // default as YAML text, read like a value from the file; NULL: none
  const char *note;     // how a default without a constant value is found, for people
  const char *selector; // the key beside this one (a choice) on which it depends, NULL: always there
  const char *only;     // values of the selector it exists with, separated by blanks
  bool required;        // reported when missing (where it exists)
  bool optional;        // a group that may be absent as a whole, its required keys with it
  double low, high;     // numbers, or number of items
  bool low_open, high_open;
  bool infinite;       // .inf accepted
  size_t offset, size; // in the group's struct; size 0: checked, not kept
  size_t count_offset; // lists
  size_t item_size;    // lists of mappings
  const tal_key *keys; // of a group or of a list's items, ended by a NULL name
  size_t (*choices)(tal_choice *out, size_t capacity);
  const char *help;
};

#define TAL_CHOICES 16 // capacity that holds every list of choices

// The keys of the whole scene (offsets into tal_scene), ended by a NULL name.
const tal_key *tal_schema(void);
// The row called `name` that exists with the selector's value (NULL: unknown, the first row of that name); NULL if
// none.
const tal_key *tal_schema_row(const tal_key *keys, const char *name, const char *value);
bool tal_key_exists_with(const tal_key *key, const char *value);
// Is `word` among the blank-separated `words`?
bool tal_word_among(const char *word, const char *words);
// Index of a choice, -1 if unknown; *found (may be NULL) becomes the registry's static name.
int tal_key_choice(const tal_key *key, const char *name, const char **found);
// Writes "hertz, linear" with the given separator.
void tal_key_choice_names(const tal_key *key, const char *separator, char *out, size_t size);
// Writes what a value must be, e.g. "a number in Pa > 0".
void tal_key_accepted(const tal_key *key, char *out, size_t size);
// Writes the range, e.g. "> 0", "in (0, 1]", "" when there is none.
void tal_key_range(const tal_key *key, char *out, size_t size);
// Writes the names of `keys`, at most `most` of them.
void tal_schema_names(const tal_key *keys, size_t most, char *out, size_t size);

#endif
