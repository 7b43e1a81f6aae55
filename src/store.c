// See store.h. Every HDF5 status goes through `check`.
#include "store.h"

#include "files.h"
#include <hdf5.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(sizeof(hid_t) == sizeof(int64_t), "HDF5 1.10 or later");

// The first failure is what the user hears of.
static bool check(tal_store *store, int64_t result, const char *what, const char *name) {
  if (result < 0 && !store->failed) {
    store->failed = true;
    snprintf(store->what, sizeof store->what, "%s %s", what, name);
  }
  return !store->failed;
}

static hid_t type_in_file(tal_store_type type) {
  const hid_t types[] = {H5T_STD_U8LE, H5T_STD_I32LE, H5T_STD_I64LE, H5T_IEEE_F64LE};
  return types[type];
}

static hid_t type_in_memory(tal_store_type type) {
  const hid_t types[] = {H5T_NATIVE_UCHAR, H5T_NATIVE_INT32, H5T_NATIVE_INT64, H5T_NATIVE_DOUBLE};
  return types[type];
}

// HDF5 prints its errors unless told not to; the program that uses us gets its own setting back in `loud`.
static void quiet(tal_store *store) {
  H5E_auto2_t reporter = NULL;
  H5Eget_auto2(H5E_DEFAULT, &reporter, &store->reporter_data);
  store->reporter = (int32_t(*)(int64_t, void *))reporter;
  H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

static void loud(const tal_store *store) {
  H5Eset_auto2(H5E_DEFAULT, (H5E_auto2_t)store->reporter, store->reporter_data);
}

// A name HDF5 cannot mistake for another open file: it compares names of files that live in memory.
static void memory_name(const tal_store *store, char name[32]) {
  snprintf(name, 32, "%p", (const void *)store);
}

// The oldest format that serves: read by every HDF5. (In 1.10.8, H5Fget_file_image breaks the checksum of the newer
// superblock when it clears the open-for-writing mark.)
static hid_t memory_access(tal_store *store) {
  hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  check(store, access, "preparing", "memory");
  check(store, H5Pset_fapl_core(access, (size_t)1 << 20, 0), "preparing", "memory");
  check(store, H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18), "preparing", "the format");
  return access;
}

// Creation properties without the time of day.
static hid_t timeless(tal_store *store, hid_t class) {
  hid_t properties = H5Pcreate(class);
  check(store, properties, "preparing", "properties");
  check(store, H5Pset_obj_track_times(properties, false), "preparing", "properties");
  return properties;
}

static void start(tal_store *store, const char *path) {
  *store = (tal_store){.file = H5I_INVALID_HID, .group = H5I_INVALID_HID};
  snprintf(store->path, sizeof store->path, "%s", path);
  quiet(store);
}

void tal_store_begin(tal_store *store) {
  start(store, "");
  char name[32];
  memory_name(store, name);
  hid_t access = memory_access(store);
  hid_t create = timeless(store, H5P_FILE_CREATE);
  store->file = H5Fcreate(name, H5F_ACC_TRUNC, create, access);
  check(store, store->file, "making", "the file");
  H5Pclose(create);
  H5Pclose(access);
  tal_store_group(store, "/");
}

void tal_store_group(tal_store *store, const char *name) {
  if (store->failed)
    return;
  if (store->group >= 0)
    check(store, H5Gclose(store->group), "closing the group before", name);
  if (strcmp(name, "/") == 0 || H5Lexists(store->file, name, H5P_DEFAULT) > 0) {
    store->group = H5Gopen2(store->file, name, H5P_DEFAULT);
  } else {
    hid_t create = timeless(store, H5P_GROUP_CREATE);
    store->group = H5Gcreate2(store->file, name, H5P_DEFAULT, create, H5P_DEFAULT);
    H5Pclose(create);
  }
  check(store, store->group, "there is no group", name);
}

// An attribute of one element on an object.
static void put_attribute(tal_store *store, hid_t object, const char *name, const hid_t types[2], const void *value) {
  hid_t space = H5Screate(H5S_SCALAR);
  hid_t attribute = H5Acreate2(object, name, types[0], space, H5P_DEFAULT, H5P_DEFAULT);
  if (check(store, attribute, "making the attribute", name)) {
    check(store, H5Awrite(attribute, types[1], value), "writing the attribute", name);
  }
  if (attribute >= 0)
    check(store, H5Aclose(attribute), "closing the attribute", name);
  H5Sclose(space);
}

static hid_t text_type(tal_store *store, size_t length) {
  hid_t type = H5Tcopy(H5T_C_S1);
  check(store, H5Tset_size(type, length ? length : 1), "preparing", "a text");
  check(store, H5Tset_strpad(type, length == H5T_VARIABLE ? H5T_STR_NULLTERM : H5T_STR_NULLPAD), "preparing", "a text");
  check(store, H5Tset_cset(type, H5T_CSET_UTF8), "preparing", "a text");
  return type;
}

// Of variable length: that is what Python's h5py hands out as str.
static void put_unit(tal_store *store, hid_t object, const char *unit) {
  hid_t type = text_type(store, H5T_VARIABLE);
  put_attribute(store, object, "unit", (const hid_t[2]){type, type}, &unit);
  H5Tclose(type);
}

// Makes and writes one data set; ends with it open (or < 0) for its attributes.
static hid_t put_data(tal_store *store, const char *name, hid_t space, const hid_t types[2], const void *data) {
  hid_t create = timeless(store, H5P_DATASET_CREATE);
  hid_t set = H5Dcreate2(store->group, name, types[0], space, H5P_DEFAULT, create, H5P_DEFAULT);
  H5Pclose(create);
  if (check(store, set, "making", name) && H5Sget_simple_extent_npoints(space) > 0) {
    check(store, H5Dwrite(set, types[1], H5S_ALL, H5S_ALL, H5P_DEFAULT, data), "writing", name);
  }
  return set;
}

void tal_store_put(tal_store *store, const tal_array *array) {
  if (store->failed)
    return;
  const hid_t types[2] = {type_in_file(array->type), type_in_memory(array->type)};
  const hsize_t size[2] = {array->rows, array->columns};
  hid_t space = H5Screate_simple(array->columns > 1 ? 2 : 1, size, NULL);
  check(store, space, "shaping", array->name);
  hid_t set = put_data(store, array->name, space, types, array->data);
  if (array->unit && !store->failed)
    put_unit(store, set, array->unit);
  if (set >= 0)
    check(store, H5Dclose(set), "closing", array->name);
  H5Sclose(space);
}

void tal_store_put_text(tal_store *store, const char *name, const char *text) {
  if (store->failed)
    return;
  hid_t type = text_type(store, strlen(text));
  hid_t space = H5Screate(H5S_SCALAR);
  hid_t set = put_data(store, name, space, (const hid_t[2]){type, type}, text);
  if (set >= 0)
    check(store, H5Dclose(set), "closing", name);
  H5Sclose(space);
  H5Tclose(type);
}

void tal_store_put_integer(tal_store *store, const char *name, int64_t value) {
  if (store->failed)
    return;
  put_attribute(store, store->group, name, (const hid_t[2]){H5T_STD_I64LE, H5T_NATIVE_INT64}, &value);
}

void tal_store_put_number(tal_store *store, const char *name, double value) {
  if (store->failed)
    return;
  put_attribute(store, store->group, name, (const hid_t[2]){H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE}, &value);
}

void tal_store_link(tal_store *store, const char *name, const char *file) {
  if (store->failed)
    return;
  check(store, H5Lcreate_external(file, "/", store->group, name, H5P_DEFAULT, H5P_DEFAULT), "linking", name);
}

// The finished file's bytes with room for the seal; NULL when it failed.
static unsigned char *image_of(tal_store *store, size_t *size) {
  if (store->failed || !check(store, H5Fflush(store->file, H5F_SCOPE_GLOBAL), "flushing", "the file"))
    return NULL;
  ssize_t length = H5Fget_file_image(store->file, NULL, 0);
  if (!check(store, length, "taking", "the image"))
    return NULL;
  unsigned char *image = tal_alloc((size_t)length + TAL_SEAL_SIZE, 1);
  check(store, H5Fget_file_image(store->file, image, (size_t)length), "taking", "the image");
  *size = (size_t)length;
  return image;
}

tal_status tal_store_save(tal_store *store, const char *path, const char *previous, tal_error *err) {
  size_t size = 0;
  unsigned char *image = image_of(store, &size);
  tal_status status;
  if (store->failed) {
    status = tal_fail(err, TAL_IO, "%s: HDF5 failed: %s", path, store->what);
  } else {
    tal_seal_make(image + size, image, size);
    status = tal_file_replace(path, previous, image, size + TAL_SEAL_SIZE, err);
  }
  free(image);
  tal_store_close(store);
  return status;
}

// HDF5 copies a file image three times unless these say that it may use the store's own, which outlives its file.
static void *lend(size_t size, H5FD_file_image_op_t operation, void *image) {
  (void)size;
  (void)operation;
  return image;
}

static void *copy_nothing(void *to, const void *from, size_t size, H5FD_file_image_op_t operation, void *image) {
  (void)from;
  (void)size;
  (void)operation;
  (void)image;
  return to;
}

static herr_t keep(void *memory, H5FD_file_image_op_t operation, void *image) {
  (void)memory;
  (void)operation;
  (void)image;
  return 0;
}

static void *same(void *image) {
  return image;
}

static herr_t leave(void *image) {
  (void)image;
  return 0;
}

static void open_image(tal_store *store, size_t size) {
  char name[32];
  memory_name(store, name);
  hid_t access = memory_access(store);
  H5FD_file_image_callbacks_t callbacks = {lend, copy_nothing, NULL, keep, same, leave, store->image};
  check(store, H5Pset_file_image_callbacks(access, &callbacks), "lending", "the content");
  check(store, H5Pset_file_image(access, store->image, size), "taking", "the content");
  store->file = H5Fopen(name, H5F_ACC_RDONLY, access);
  check(store, store->file, "it is no", "HDF5 file");
  H5Pclose(access);
  tal_store_group(store, "/");
}

tal_status tal_store_open(tal_store *store, const char *path, tal_error *err) {
  start(store, path);
  size_t size;
  tal_status status = tal_file_read(path, &store->image, &size, err);
  if (status == TAL_OK && !tal_seal_check(store->image, size)) {
    status = tal_fail(err, TAL_BAD_INPUT, "%s is damaged: its content does not match its checksum", path);
  }
  if (status == TAL_OK) {
    open_image(store, size - TAL_SEAL_SIZE);
    status = tal_store_status(store, err);
  }
  if (status != TAL_OK)
    tal_store_close(store);
  return status;
}

bool tal_store_has(const tal_store *store, const char *name) {
  return !store->failed && H5Lexists(store->group, name, H5P_DEFAULT) > 0;
}

// Opens a data set and its space; < 0 and the failure noted when it is not there.
static hid_t open_data(tal_store *store, const char *name, hid_t *space) {
  *space = H5I_INVALID_HID;
  if (store->failed)
    return H5I_INVALID_HID;
  hid_t set = H5Dopen2(store->group, name, H5P_DEFAULT);
  if (check(store, set, "there is no data set", name))
    *space = H5Dget_space(set);
  return set;
}

size_t tal_store_rows(tal_store *store, const char *name) {
  if (store->failed)
    return 0;
  if (!name) {
    H5G_info_t info;
    return check(store, H5Gget_info(store->group, &info), "counting", "a group") ? (size_t)info.nlinks : 0;
  }
  hid_t space;
  hid_t set = open_data(store, name, &space);
  hsize_t size[H5S_MAX_RANK] = {0};
  if (set >= 0)
    check(store, H5Sget_simple_extent_dims(space, size, NULL), "there is no shape of", name);
  if (set >= 0) {
    H5Sclose(space);
    H5Dclose(set);
  }
  return store->failed ? 0 : (size_t)size[0];
}

static bool has_shape(const tal_array *array, hid_t set, hid_t space) {
  hsize_t size[H5S_MAX_RANK] = {0};
  int rank = array->columns > 1 ? 2 : 1;
  hid_t type = H5Dget_type(set);
  bool same = H5Tequal(type, type_in_file(array->type)) > 0 && H5Sget_simple_extent_ndims(space) == rank &&
              H5Sget_simple_extent_dims(space, size, NULL) == rank && size[0] == array->rows &&
              (rank == 1 || size[1] == array->columns);
  H5Tclose(type);
  return same;
}

void tal_store_get(tal_store *store, const tal_array *array) {
  hid_t space;
  hid_t set = open_data(store, array->name, &space);
  if (set < 0)
    return;
  if (check(store, has_shape(array, set, space) ? 0 : -1, "unexpected type or shape of", array->name) && array->rows) {
    herr_t result = H5Dread(set, type_in_memory(array->type), H5S_ALL, H5S_ALL, H5P_DEFAULT, array->data);
    check(store, result, "reading", array->name);
  }
  H5Sclose(space);
  H5Dclose(set);
}

char *tal_store_get_text(tal_store *store, const char *name) {
  hid_t space;
  hid_t set = open_data(store, name, &space);
  if (set < 0)
    return tal_strdup("");
  hid_t type = H5Dget_type(set);
  bool text = H5Tget_class(type) == H5T_STRING && H5Sget_simple_extent_npoints(space) == 1;
  check(store, text ? 0 : -1, "there is no text in", name);
  char *value = tal_alloc(text ? H5Tget_size(type) + 1 : 1, 1);
  if (text)
    check(store, H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, value), "reading", name);
  H5Tclose(type);
  H5Sclose(space);
  H5Dclose(set);
  return value;
}

static void get_attribute(tal_store *store, const char *name, const hid_t types[2], void *value) {
  if (store->failed)
    return;
  hid_t attribute = H5Aopen(store->group, name, H5P_DEFAULT);
  if (!check(store, attribute, "there is no attribute", name))
    return;
  hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
  bool same = H5Tequal(type, types[0]) > 0 && H5Sget_simple_extent_npoints(space) == 1;
  if (check(store, same ? 0 : -1, "unexpected type of", name)) {
    check(store, H5Aread(attribute, types[1], value), "reading", name);
  }
  H5Sclose(space);
  H5Tclose(type);
  H5Aclose(attribute);
}

int64_t tal_store_get_integer(tal_store *store, const char *name) {
  int64_t value = 0;
  get_attribute(store, name, (const hid_t[2]){H5T_STD_I64LE, H5T_NATIVE_INT64}, &value);
  return value;
}

double tal_store_get_number(tal_store *store, const char *name) {
  double value = 0;
  get_attribute(store, name, (const hid_t[2]){H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE}, &value);
  return value;
}

bool tal_store_links_to(const tal_store *store, const char *name, const char *file) {
  if (store->failed)
    return false;
  char value[TAL_PATH_SIZE];
  H5L_info_t info;
  const char *target = NULL, *object = NULL;
  return H5Lget_info(store->group, name, &info, H5P_DEFAULT) >= 0 && info.type == H5L_TYPE_EXTERNAL &&
         info.u.val_size <= sizeof value && H5Lget_val(store->group, name, value, sizeof value, H5P_DEFAULT) >= 0 &&
         H5Lunpack_elink_val(value, info.u.val_size, NULL, &target, &object) >= 0 && strcmp(target, file) == 0;
}

tal_status tal_store_status(const tal_store *store, tal_error *err) {
  if (!store->failed)
    return TAL_OK;
  return tal_fail(err, TAL_BAD_INPUT, "%s is not as expected: %s", store->path, store->what);
}

void tal_store_close(tal_store *store) {
  if (store->group >= 0)
    H5Gclose(store->group);
  if (store->file >= 0)
    H5Fclose(store->file);
  store->group = store->file = H5I_INVALID_HID;
  free(store->image);
  store->image = NULL;
  loud(store);
}
