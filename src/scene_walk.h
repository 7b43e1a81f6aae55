// Where a walk of the tree beside the schema table stands, what it says when something is wrong there, and which rows
// exist with the choices made. Private to scene*.c.
#ifndef TAL_SCENE_WALK_H
#define TAL_SCENE_WALK_H

#include "scene_report.h"
#include "scene_schema.h"

// A chain of stack frames; written out only for a message.
typedef struct tal_trail {
  const struct tal_trail *up; // NULL: the scene itself
  const char *name;           // NULL: item `index` of the list above
  size_t index;
} tal_trail;

// Reports `what` about the key at the end of the trail; `node` gives the line.
void tal_walk_complain(tal_report *report, const tal_node *node, const tal_trail *at, const char *what);
// The same with "; accepted: ..." of the row and, unless "", what the user probably meant.
void tal_walk_wrong(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at, const char *what,
                    const char *guess);
// First row of that name, NULL if none.
const tal_key *tal_walk_row(const tal_key *keys, const char *name);
// The value of the row's selector: as the tree says it, else as the struct at base holds it; NULL when it has no
// selector or the value is not resolved or not valid.
const char *tal_walk_selected(const tal_key *key, const tal_key *keys, const tal_node *node, const char *base);
// Does the row exist with what is selected? With nothing selected only the first row of its name does.
bool tal_walk_exists(const tal_key *key, const tal_key *keys, const tal_node *node, const char *base);
// The registry's name of the choice held at `place` for this row, NULL when none.
const char *tal_walk_chosen(const tal_key *key, const void *place);

// Reads a value that is not a mapping or a list of mappings into the struct at `base`; reports what is wrong with it.
void tal_read_plain(tal_report *report, const tal_key *key, const tal_node *node, char *base, const tal_trail *at);
// Stores the choice of this index and name where the row says.
void tal_store_choice(const tal_key *key, int index, const char *name, void *place);
// Makes `array` (of the row's struct from now on) with its count the row's list.
void tal_store_array(const tal_key *key, char *base, void *array, size_t count);
// True when a list node has an accepted number of items; else reported.
bool tal_list_length_good(tal_report *report, const tal_key *key, const tal_node *node, const tal_trail *at);

#endif
