// See measure_export.h.
#include "measure_export.h"

#include "files.h"
#include "store.h"
#include <hdf5.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 64 };

typedef struct column_set {
  char name[64], unit[32];
  size_t rows, columns;
  bool whole;           // whole numbers
  int64_t *whole_value; // owned; [rows][columns]
  double *value;        // owned
} column_set;

typedef struct listing {
  size_t count;
  column_set set[MOST];
  hid_t group;
} listing;

static void read_unit(hid_t set, char unit[32]) {
  char *text = NULL;
  *unit = '\0';
  if (H5Aexists(set, "unit") <= 0)
    return;
  hid_t attribute = H5Aopen(set, "unit", H5P_DEFAULT), type = H5Aget_type(attribute);
  if (H5Tis_variable_str(type) > 0 && H5Aread(attribute, type, &text) >= 0 && text) {
    snprintf(unit, 32, "%.31s", strcmp(text, "1") == 0 ? "" : text);
    H5free_memory(text);
  }
  H5Tclose(type);
  H5Aclose(attribute);
}

static void read_set(listing *list, const char *name) {
  hid_t set = H5Dopen2(list->group, name, H5P_DEFAULT);
  if (set < 0 || list->count == MOST)
    return;
  column_set *to = &list->set[list->count];
  hid_t space = H5Dget_space(set), type = H5Dget_type(set);
  hsize_t size[2] = {0, 1};
  const int dimensions = H5Sget_simple_extent_ndims(space);
  const H5T_class_t class = H5Tget_class(type);
  if (dimensions >= 1 && dimensions <= 2 && (class == H5T_INTEGER || class == H5T_FLOAT)) {
    H5Sget_simple_extent_dims(space, size, NULL);
    *to = (column_set){.rows = size[0], .columns = size[1], .whole = class == H5T_INTEGER};
    snprintf(to->name, sizeof to->name, "%.63s", name);
    read_unit(set, to->unit);
    if (to->whole)
      to->whole_value = tal_alloc(to->rows * to->columns, sizeof *to->whole_value);
    else
      to->value = tal_alloc(to->rows * to->columns, sizeof *to->value);
    if (to->rows)
      H5Dread(set, to->whole ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT,
              to->whole ? (void *)to->whole_value : (void *)to->value);
    list->count++;
  }
  H5Tclose(type);
  H5Sclose(space);
  H5Dclose(set);
}

static herr_t visit(hid_t group, const char *name, const H5L_info_t *info, void *context) {
  (void)group;
  (void)info;
  read_set(context, name);
  return 0;
}

static herr_t add_name(hid_t group, const char *name, const H5L_info_t *info, void *context) {
  (void)group;
  (void)info;
  char *text = context;
  snprintf(text + strlen(text), 400 - strlen(text), "%s%.40s", *text ? ", " : "", name);
  return 0;
}

// The group and the data set in it that `field` names; NULL for all of them. False when there is no such thing.
static bool find(tal_store *store, const char *field, char group[80], const char **name) {
  const char *slash = strchr(field, '/');
  const size_t length = slash ? (size_t)(slash - field) : strlen(field);
  snprintf(group, 80, "%.*s", (int)(length < 79 ? length : 79), field);
  *name = slash ? slash + 1 : NULL;
  if (!*group || H5Lexists(store->file, group, H5P_DEFAULT) <= 0)
    return false;
  tal_store_group(store, group);
  return !*name || (**name && !strchr(*name, '/') && H5Lexists(store->group, *name, H5P_DEFAULT) > 0);
}

static tal_status no_field(tal_store *store, const char *field, tal_error *err) {
  char names[400] = "", group[80];
  const char *slash = strchr(field, '/');
  snprintf(group, sizeof group, "%.*s", slash ? (int)(slash - field < 79 ? slash - field : 79) : 0, field);
  if (*group && H5Lexists(store->file, group, H5P_DEFAULT) > 0)
    tal_store_group(store, group);
  else
    tal_store_group(store, "/");
  H5Literate(store->group, H5_INDEX_NAME, H5_ITER_INC, NULL, add_name, names);
  return tal_fail(err, TAL_BAD_INPUT, "--export: there is no field '%.80s'; accepted: %s", field, names);
}

// ---- the table ----

static const char *ending(const column_set *set, size_t column, char text[24]) {
  static const char *const four[] = {"_xx", "_xy", "_yx", "_yy"}, *const three[] = {"_xx", "_xy", "_yy"};
  if (set->columns == 1)
    return "";
  if (set->columns == 4)
    return four[column];
  if (set->columns == 3 && strcmp(set->name, "strain") == 0)
    return three[column];
  snprintf(text, 24, "_%zu", column);
  return text;
}

static void put_header(FILE *out, const listing *list) {
  char text[24];
  for (size_t k = 0; k < list->count; k++)
    for (size_t c = 0; c < list->set[k].columns; c++) {
      const column_set *set = &list->set[k];
      fprintf(out, "%s%s%s", k + c ? "," : "", set->name, ending(set, c, text));
      if (*set->unit)
        fprintf(out, "[%s]", set->unit);
    }
  fputc('\n', out);
}

static void put_rows(FILE *out, const listing *list) {
  size_t rows = list->count ? list->set[0].rows : 0;
  for (size_t k = 0; k < list->count; k++)
    rows = list->set[k].rows < rows ? list->set[k].rows : rows;
  for (size_t row = 0; row < rows; row++) {
    for (size_t k = 0; k < list->count; k++)
      for (size_t c = 0; c < list->set[k].columns; c++) {
        const column_set *set = &list->set[k];
        if (k + c)
          fputc(',', out);
        if (set->whole)
          fprintf(out, "%lld", (long long)set->whole_value[row * set->columns + c]);
        else
          fprintf(out, "%.17g", set->value[row * set->columns + c]);
      }
    fputc('\n', out);
  }
}

static tal_status write_table(const listing *list, const char *csv, tal_error *err) {
  char *text = NULL;
  size_t size;
  FILE *out = tal_text_begin(&text, &size);
  put_header(out, list);
  put_rows(out, list);
  tal_text_end(out);
  tal_status status = tal_file_replace(csv, NULL, text, size, err);
  free(text);
  return status;
}

static void listing_clear(listing *list) {
  for (size_t k = 0; k < list->count; k++) {
    free(list->set[k].value);
    free(list->set[k].whole_value);
  }
  free(list);
}

// csv NULL: only whether the field is there.
static tal_status export(const char *path, const char *field, const char *csv, tal_error *err) {
  tal_store store;
  char group[80];
  const char *name;
  tal_status status = tal_store_open(&store, path, err);
  if (status)
    return status;
  if (!find(&store, field, group, &name)) {
    status = no_field(&store, field, err);
  } else if (csv) {
    listing *list = tal_alloc(1, sizeof *list);
    list->group = store.group;
    if (name)
      read_set(list, name);
    else
      H5Literate(store.group, H5_INDEX_NAME, H5_ITER_INC, NULL, visit, list);
    status = write_table(list, csv, err);
    listing_clear(list);
  }
  tal_store_close(&store);
  return status;
}

tal_status tal_frame_export(const char *path, const char *field, const char *csv, tal_error *err) {
  return export(path, field, csv, err);
}

tal_status tal_frame_has(const char *path, const char *field, tal_error *err) {
  return export(path, field, NULL, err);
}
