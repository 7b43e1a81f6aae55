// A small store of arrays: one HDF5 file built in memory and written whole, or read whole, its seal checked, and only
// then given to HDF5. So HDF5 never touches the disk: a full disk, a kill or a flipped bit cannot pass unnoticed.
// Content depends on nothing but what is put in (no times, no addresses): equal data gives equal bytes.
// The first failure sticks: later calls do nothing, and tal_store_save or tal_store_status reports it.
#ifndef TAL_STORE_H
#define TAL_STORE_H

#include "base.h"
#include <stdbool.h>

typedef enum tal_store_type { TAL_STORE_BYTE, TAL_STORE_INT32, TAL_STORE_INT64, TAL_STORE_DOUBLE } tal_store_type;

// Type of the elements a pointer points at.
#define TAL_STORE_TYPE(pointer)                                                                                        \
  _Generic((pointer),                                                                                                  \
      unsigned char *: TAL_STORE_BYTE,                                                                                 \
      int32_t *: TAL_STORE_INT32,                                                                                      \
      int64_t *: TAL_STORE_INT64,                                                                                      \
      double *: TAL_STORE_DOUBLE)

// One data set of the current group: data[rows] or, with columns > 1, data[rows][columns].
typedef struct tal_array {
  const char *name;
  const char *unit; // attribute `unit`; NULL: none (and not looked at when reading)
  tal_store_type type;
  size_t rows, columns;
  void *data; // borrowed; may be NULL when rows is 0
} tal_array;

#define TAL_ARRAY(name_, unit_, pointer_, rows_)                                                                       \
  (&(tal_array){                                                                                                       \
      .name = name_, .unit = unit_, .type = TAL_STORE_TYPE(pointer_), .rows = rows_, .columns = 1, .data = pointer_})

typedef struct tal_store {
  int64_t file, group;                        // HDF5 identifiers
  unsigned char *image;                       // owned; the file that is read, which HDF5 works on in place
  char path[512];                             // for messages
  bool failed;                                //
  char what[200];                             // the first failure
  int32_t (*reporter)(int64_t stack, void *); // HDF5's error printer, off while a store is open
  void *reporter_data;
} tal_store;

// Writing: begin, groups and arrays, then save, which also ends the store.
void tal_store_begin(tal_store *store);
// What follows goes into /name, made when missing; "/" is the root.
void tal_store_group(tal_store *store, const char *name);
void tal_store_put(tal_store *store, const tal_array *array);
// A text as one fixed-length string.
void tal_store_put_text(tal_store *store, const char *name, const char *text);
// Attributes of the current group.
void tal_store_put_integer(tal_store *store, const char *name, int64_t value);
void tal_store_put_number(tal_store *store, const char *name, double value);
// External link in the current group to the root of another HDF5 file, its path relative to this one.
void tal_store_link(tal_store *store, const char *name, const char *file);
// Writes the sealed file in one piece (tal_file_replace: `previous` may be NULL) and ends the store. TAL_IO.
tal_status tal_store_save(tal_store *store, const char *path, const char *previous, tal_error *err);

// Reading: TAL_IO when the file cannot be read, TAL_BAD_INPUT when its seal is broken. End with tal_store_close.
tal_status tal_store_open(tal_store *store, const char *path, tal_error *err);
bool tal_store_has(const tal_store *store, const char *name);
// Rows of a data set in the current group, or number of members of the current group (name NULL).
size_t tal_store_rows(tal_store *store, const char *name);
// Fails unless the data set is there with exactly this type and shape.
void tal_store_get(tal_store *store, const tal_array *array);
// Owned by the caller; "" when it failed.
char *tal_store_get_text(tal_store *store, const char *name);
int64_t tal_store_get_integer(tal_store *store, const char *name);
double tal_store_get_number(tal_store *store, const char *name);
// True when `name` is an external link to `file`.
bool tal_store_links_to(const tal_store *store, const char *name, const char *file);
// TAL_BAD_INPUT naming the file and the first thing that was missing or of another shape.
tal_status tal_store_status(const tal_store *store, tal_error *err);
void tal_store_close(tal_store *store);

#endif
