// Texts of a study: values as --set takes them, names of folders, quoting for shells and CSV. Private to study*.c.
#ifndef TAL_STUDY_WORDS_H
#define TAL_STUDY_WORDS_H

#include "scene_yaml.h"

#include <stdio.h>

// A value of a YAML file on one line, as --set takes it; lives in the tree.
const char *tal_words_of_node(tal_tree *tree, const tal_node *node);
// printf into the tree.
const char *tal_words_format(tal_tree *tree, const char *format, ...) __attribute__((format(printf, 2, 3)));
// Letters, digits, . + _ and - stay, everything else becomes one -; lives in the tree. Never empty, never "." or "..".
const char *tal_words_slug(tal_tree *tree, const char *text);
// One word for a POSIX shell: quoted where it must be.
void tal_words_shell(FILE *out, const char *word);
// One field of a CSV file (RFC 4180): quoted where it must be.
void tal_words_csv(FILE *out, const char *field);
// A number that reads back to the same bits; nan as "nan".
void tal_words_number(FILE *out, double value);

#endif
