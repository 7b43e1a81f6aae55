// The schema table for people, editors and shells. Writes only to the stream it is given.
#ifndef TAL_SCENE_KEYS_H
#define TAL_SCENE_KEYS_H

#include <stdbool.h>
#include <stdio.h>

// Aligned table of every key (what NULL or ""), of one key, of a group ("contact") or of one kind of variant
// ("stages.compress", "grains.radius.sieve", "contact.linear"). List indices in `what` are passed over. False: no such
// key, nothing written.
bool tal_keys_print(FILE *out, const char *what);
// The whole table as a section of a Markdown page.
void tal_keys_markdown(FILE *out);
// JSON Schema (draft 7) of a scene.
void tal_keys_json(FILE *out);
// Every key as --set takes it, lists with index 0 to 3, as bash words: one per line.
void tal_keys_words(FILE *out);
// Nearest known path to a mistyped one; "" when nothing is near.
void tal_keys_nearest(const char *what, char *out, size_t size);

#endif
