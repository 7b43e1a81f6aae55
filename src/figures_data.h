// What the figures read besides frames: the columns of series.csv by name, and the few facts of run.json they quote.
// Nothing here judges the numbers; `talus verify` does.
#ifndef TAL_FIGURES_DATA_H
#define TAL_FIGURES_DATA_H

#include "base.h"
#include <stdbool.h>

// A table of numbers with named columns.
typedef struct tal_table {
  size_t rows, columns;
  char **name;   // owned; [columns] header without its [unit]
  double *value; // owned; [columns][rows], NAN where the file says nan
} tal_table;

// Reads a comma-separated file: one header line of `name` or `name[unit]`, then numbers. A last line without its line
// end is one still being written and is left out. TAL_IO when the file cannot be read, TAL_BAD_INPUT (`FILE:LINE: ...`)
// when it is no such table; *table is empty then.
tal_status tal_table_read(tal_table *table, const char *path, tal_error *err);
void tal_table_clear(tal_table *table);
// The values [rows] of the column, NULL when there is none of that name.
const double *tal_table_column(const tal_table *table, const char *name);

// From run.json. Whatever is missing there stays at the value given here.
typedef struct tal_run_facts {
  char *name;            // owned; scene name, else the last part of the folder's path
  int64_t confine_stage; // index of the first confine stage, -1: none known
  double pressure;       // [Pa] its target, NAN: not known
  bool done;             // the run is complete
  int64_t forced_grain;  // id of the grain whose spin the last stage imposes, -1: none
} tal_run_facts;

// Never fails: a figure without its scene name is better than none.
void tal_run_facts_read(tal_run_facts *facts, const char *dir);
void tal_run_facts_clear(tal_run_facts *facts);

// "dir/name" in new memory; owned by the caller.
char *tal_path_join(const char *dir, const char *name);

#endif
