// The CSV tables of `talus measure`: each grows in a temporary file and gets its name at the end, whole. Numbers have
// 12 digits; what cannot be said of nothing is 0, and the count beside it says so.
#ifndef TAL_MEASURE_TABLES_H
#define TAL_MEASURE_TABLES_H

#include "base.h"
#include <stdbool.h>
#include <stdio.h>

typedef struct tal_tables {
  size_t count;
  struct tal_one_table **table; // owned
  const char *folder;           // borrowed; where they go
  bool failed;                  // one cannot be written: tal_tables_save tells which
} tal_tables;

// The open table of that file name; begins it with `header` (no line end) when it is new. Owned here. Threads may ask
// at once.
FILE *tal_tables_get(tal_tables *tables, const char *name, const char *header);
// A comma and a number.
void tal_put(FILE *table, double value);
// A comma, then xx, xy and yy of the symmetric part of a tensor given as xx xy yx yy.
void tal_put_symmetric(FILE *table, double xx, double xy, double yx, double yy);
// Ends all in the order of their names, telling each path; then they are gone. TAL_IO.
tal_status tal_tables_save(tal_tables *tables, void (*made)(void *user, const char *path), void *user, tal_error *err);
// Leaves nothing of tables that were not saved.
void tal_tables_clear(tal_tables *tables);

#endif
