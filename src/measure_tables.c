// See measure_tables.h.
#include "measure_tables.h"

#include "files.h"
#include <stdlib.h>
#include <string.h>

typedef struct tal_one_table {
  char name[64];
  FILE *out; // a memory stream
  char *text;
  size_t size;
} one_table;

static FILE *get(tal_tables *tables, const char *name, const char *header) {
  for (size_t k = 0; k < tables->count; k++)
    if (strcmp(tables->table[k]->name, name) == 0)
      return tables->table[k]->out;
  one_table *table = tal_alloc(1, sizeof *table); // the stream holds the addresses of its text and size
  tables->table = tal_grow(tables->table, tables->count, tables->count + 1, sizeof(one_table *));
  tables->table[tables->count++] = table;
  snprintf(table->name, sizeof table->name, "%s", name);
  table->out = open_memstream(&table->text, &table->size);
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

tal_status tal_tables_save(tal_tables *tables, const char *folder, void (*made)(void *user, const char *path),
                           void *user, tal_error *err) {
  tal_status status = TAL_OK;
  if (tables->count)
    qsort(tables->table, tables->count, sizeof *tables->table, by_name);
  for (size_t k = 0; k < tables->count && !status; k++) {
    one_table *table = tables->table[k];
    char path[TAL_PATH_SIZE];
    fflush(table->out);
    tal_file_path(path, folder, table->name);
    status = tal_file_replace(path, NULL, table->text, table->size, err);
    if (!status && made)
      made(user, path);
  }
  tal_tables_clear(tables);
  return status;
}

void tal_tables_clear(tal_tables *tables) {
  for (size_t k = 0; k < tables->count; k++) {
    fclose(tables->table[k]->out);
    free(tables->table[k]->text);
    free(tables->table[k]);
  }
  free(tables->table);
  *tables = (tal_tables){0};
}
