// See measure_tables.h.
#include "measure_tables.h"

#include "files.h"
#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct tal_one_table {
  char name[64];
  FILE *out; // of name.tmp
  bool temporary;
} one_table;

static void path_of(const tal_tables *tables, const one_table *table, char path[TAL_PATH_SIZE], bool temporary) {
  char name[80];
  snprintf(name, sizeof name, "%s%s", table->name, temporary ? ".tmp" : "");
  tal_file_path(path, tables->folder, name);
}

// Where it cannot be opened what is written goes nowhere, and saving says so.
static void open_table(tal_tables *tables, one_table *table) {
  char path[TAL_PATH_SIZE];
  path_of(tables, table, path, true);
  table->out = fopen(path, "we");
  table->temporary = table->out != NULL;
  if (table->out)
    return;
  tables->failed = true;
  table->out = fopen("/dev/null", "we");
  assert(table->out);
}

static FILE *get(tal_tables *tables, const char *name, const char *header) {
  for (size_t k = 0; k < tables->count; k++)
    if (strcmp(tables->table[k]->name, name) == 0)
      return tables->table[k]->out;
  one_table *table = tal_alloc(1, sizeof *table);
  tables->table = tal_grow(tables->table, tables->count, tables->count + 1, sizeof(one_table *));
  tables->table[tables->count++] = table;
  snprintf(table->name, sizeof table->name, "%s", name);
  open_table(tables, table);
  fprintf(table->out, "%s\n", header);
  return table->out;
}

FILE *tal_tables_get(tal_tables *tables, const char *name, const char *header) {
  FILE *out;
#pragma omp critical(tal_tables)
  out = get(tables, name, header);
  return out;
}

void tal_put(FILE *table, double value) {
  fprintf(table, ",%.12g", value);
}

void tal_put_symmetric(FILE *table, double xx, double xy, double yx, double yy) {
  fprintf(table, ",%.12g,%.12g,%.12g", xx, (xy + yx) / 2, yy);
}

static int by_name(const void *a, const void *b) {
  return strcmp((*(one_table *const *)a)->name, (*(one_table *const *)b)->name);
}

static tal_status save(const tal_tables *tables, one_table *table, char path[TAL_PATH_SIZE], tal_error *err) {
  char temporary[TAL_PATH_SIZE];
  path_of(tables, table, temporary, true);
  path_of(tables, table, path, false);
  if (!table->temporary || fflush(table->out) || ferror(table->out) || fsync(fileno(table->out)) ||
      rename(temporary, path))
    return tal_fail(err, TAL_IO, "%s: cannot be written: %s", path, strerror(errno));
  table->temporary = false;
  return TAL_OK;
}

tal_status tal_tables_save(tal_tables *tables, void (*made)(void *user, const char *path), void *user, tal_error *err) {
  tal_status status = TAL_OK;
  if (tables->count)
    qsort(tables->table, tables->count, sizeof *tables->table, by_name);
  for (size_t k = 0; k < tables->count && !status; k++) {
    char path[TAL_PATH_SIZE];
    status = save(tables, tables->table[k], path, err);
    if (!status && made)
      made(user, path);
  }
  tal_tables_clear(tables);
  return status;
}

void tal_tables_clear(tal_tables *tables) {
  char path[TAL_PATH_SIZE];
  for (size_t k = 0; k < tables->count; k++) {
    fclose(tables->table[k]->out);
    path_of(tables, tables->table[k], path, true);
    if (tables->table[k]->temporary)
      unlink(path);
    free(tables->table[k]);
  }
  free(tables->table);
  *tables = (tal_tables){.folder = tables->folder};
}
