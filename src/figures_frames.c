// Reads field frames with HDF5 (docs/formats.md). Checksums are the business of `talus verify`; here every extent and
// index is checked, so that a damaged file cannot lead outside an array.
#include "figures_frames.h"

#include "figures_data.h"
#include <dirent.h>
#include <errno.h>
#include <hdf5.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

// HDF5 prints its error stack by default; the library must not.
typedef struct quiet {
  H5E_auto2_t print;
  void *data;
} quiet;

static quiet quiet_begin(void) {
  quiet old = {0};
  H5Eget_auto2(H5E_DEFAULT, &old.print, &old.data);
  H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  return old;
}

static void quiet_end(quiet old) {
  H5Eset_auto2(H5E_DEFAULT, old.print, old.data);
}

static double read_attribute(hid_t file, const char *name) {
  double value = (double)NAN;
  if (H5Aexists(file, name) <= 0)
    return value;
  hid_t attribute = H5Aopen(file, name, H5P_DEFAULT);
  if (attribute < 0)
    return value;
  hid_t space = H5Aget_space(attribute);
  if (H5Sget_simple_extent_npoints(space) != 1 || H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0)
    value = (double)NAN;
  H5Sclose(space);
  H5Aclose(attribute);
  return value;
}

// Number of elements of a one-dimensional data set; 0 when there is none.
static size_t extent(hid_t file, const char *path, const char *group) {
  if (H5Lexists(file, group, H5P_DEFAULT) <= 0 || H5Lexists(file, path, H5P_DEFAULT) <= 0)
    return 0;
  hid_t set = H5Dopen2(file, path, H5P_DEFAULT);
  if (set < 0)
    return 0;
  hid_t space = H5Dget_space(set);
  hssize_t points = H5Sget_simple_extent_ndims(space) == 1 ? H5Sget_simple_extent_npoints(space) : 0;
  H5Sclose(space);
  H5Dclose(set);
  return points > 0 ? (size_t)points : 0;
}

// What of a frame is being read; `failed` names the first data set that is missing or has another length.
typedef struct reading {
  hid_t file;
  const char *failed;
} reading;

static void *read_array(reading *in, const char *group, const char *path, size_t count, hid_t type) {
  void *value = tal_alloc(count, 8);
  if (count == 0)
    return value;
  bool good = extent(in->file, path, group) == count;
  if (good) {
    hid_t set = H5Dopen2(in->file, path, H5P_DEFAULT);
    good = set >= 0 && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0;
    if (set >= 0)
      H5Dclose(set);
  }
  if (!good && !in->failed)
    in->failed = path;
  return value;
}

static double *read_reals(reading *in, const char *group, const char *path, size_t count) {
  return read_array(in, group, path, count, H5T_NATIVE_DOUBLE);
}

// The same, NAN all over where there is no such data set.
static double *read_optional(reading *in, const char *group, const char *path, size_t count) {
  if (extent(in->file, path, group))
    return read_reals(in, group, path, count);
  double *value = tal_alloc(count, sizeof *value);
  for (size_t k = 0; k < count; k++)
    value[k] = (double)NAN;
  return value;
}

// Whole numbers in [0, limit).
static int64_t *read_indices(reading *in, const char *group, const char *path, size_t count, size_t limit) {
  int64_t *value = read_array(in, group, path, count, H5T_NATIVE_INT64);
  for (size_t k = 0; k < count; k++)
    if ((value[k] < 0 || (uint64_t)value[k] >= limit) && !in->failed)
      in->failed = path;
  return value;
}

static void read_grains(reading *in, tal_frame *frame) {
  size_t n = frame->grain_count = extent(in->file, "/grains/x", "/grains");
  frame->id = read_indices(in, "/grains", "/grains/id", n, SIZE_MAX / 2);
  frame->x = read_reals(in, "/grains", "/grains/x", n);
  frame->y = read_reals(in, "/grains", "/grains/y", n);
  frame->r = read_reals(in, "/grains", "/grains/r", n);
  frame->theta = read_reals(in, "/grains", "/grains/theta", n);
  frame->omega = read_optional(in, "/grains", "/grains/omega", n);
}

// Contacts whose overlap is round-off of the coordinates (a packing that rests on nothing but geometry) carry forces
// that mean nothing; they are left out.
static void drop_hairs(tal_frame *frame, const double *overlap) {
  size_t kept = 0;
  for (size_t c = 0; c < frame->contact_count; c++) {
    double least = fmin(frame->r[frame->i[c]], frame->r[frame->j[c]]);
    if (overlap[c] < 1e-10 * least)
      continue;
    frame->i[kept] = frame->i[c];
    frame->j[kept] = frame->j[c];
    frame->ft[kept] = frame->ft[c];
    frame->fn[kept++] = frame->fn[c];
  }
  frame->contact_count = kept;
}

static void read_contacts(reading *in, tal_frame *frame) {
  size_t n = frame->contact_count = extent(in->file, "/contacts/i", "/contacts");
  frame->i = read_indices(in, "/contacts", "/contacts/i", n, frame->grain_count);
  frame->j = read_indices(in, "/contacts", "/contacts/j", n, frame->grain_count);
  frame->fn = read_reals(in, "/contacts", "/contacts/fn", n);
  frame->ft = read_optional(in, "/contacts", "/contacts/ft", n);
  double *overlap = read_reals(in, "/contacts", "/contacts/overlap", n);
  if (!in->failed)
    drop_hairs(frame, overlap);
  free(overlap);
}

static void read_beads(reading *in, tal_frame *frame) {
  size_t n = frame->bead_count = extent(in->file, "/membrane/x", "/membrane");
  frame->bx = read_reals(in, "/membrane", "/membrane/x", n);
  frame->by = read_reals(in, "/membrane", "/membrane/y", n);
  frame->br = read_reals(in, "/membrane", "/membrane/r", n);
}

static void read_cells(reading *in, tal_frame *frame) {
  size_t n = frame->cell_count = extent(in->file, "/cells/i", "/cells");
  static const char *const corner[3] = {"/cells/i", "/cells/j", "/cells/k"};
  for (int k = 0; k < 3; k++)
    frame->corner[k] = read_indices(in, "/cells", corner[k], n, frame->grain_count);
  frame->L_II = read_reals(in, "/cells", "/cells/L_II", n);
  frame->pressure = read_reals(in, "/cells", "/cells/pressure", n);
  frame->area = read_reals(in, "/cells", "/cells/area", n);
  frame->loop_count = extent(in->file, "/loop/node", "/loop");
  frame->loop = read_indices(in, "/loop", "/loop/node", frame->loop_count, frame->grain_count);
}

// The ends of a plate: it has none of its own, so it is shown as wide as the grains lie.
static void span_plate(const tal_frame *frame, double line[4]) {
  line[0] = HUGE_VAL;
  line[2] = -HUGE_VAL;
  for (size_t k = 0; k < frame->grain_count; k++) {
    line[0] = fmin(line[0], frame->x[k] - frame->r[k]);
    line[2] = fmax(line[2], frame->x[k] + frame->r[k]);
  }
}

// Walls and plates that are there at the time of the frame.
static void read_walls(reading *in, tal_frame *frame) {
  enum { X0, Y0, X1, Y1, PLATE, FROM, UNTIL, COLUMNS };
  static const char *const path[COLUMNS] = {"/walls/x0",    "/walls/y0",        "/walls/x1",        "/walls/y1",
                                            "/walls/plate", "/walls/from_time", "/walls/until_time"};
  size_t n = extent(in->file, path[X0], "/walls");
  double *column[COLUMNS];
  for (int k = 0; k < COLUMNS; k++)
    column[k] = read_reals(in, "/walls", path[k], n);
  frame->wall = tal_alloc(n, sizeof *frame->wall);
  for (size_t w = 0; w < n; w++) {
    if (frame->time < column[FROM][w] || frame->time >= column[UNTIL][w])
      continue;
    double *line = frame->wall[frame->wall_count++];
    for (int k = 0; k < 4; k++)
      line[k] = column[k][w];
    if (column[PLATE][w] != 0)
      span_plate(frame, line);
  }
  for (int k = 0; k < COLUMNS; k++)
    free(column[k]);
}

tal_status tal_frame_read(tal_frame *frame, const char *path, tal_error *err) {
  *frame = (tal_frame){0};
  quiet old = quiet_begin();
  reading in = {.file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT)};
  if (in.file < 0) {
    quiet_end(old);
    return tal_fail(err, TAL_IO, "%s: not a readable field frame", path);
  }
  frame->time = read_attribute(in.file, "time");
  frame->axial_strain = read_attribute(in.file, "axial_strain");
  read_grains(&in, frame);
  read_contacts(&in, frame);
  read_cells(&in, frame);
  read_walls(&in, frame);
  read_beads(&in, frame);
  H5Fclose(in.file);
  quiet_end(old);
  if (!in.failed)
    return TAL_OK;
  tal_frame_clear(frame);
  return tal_fail(err, TAL_IO, "%s: %s is missing or damaged", path, in.failed);
}

void tal_frame_clear(tal_frame *frame) {
  void *const owned[] = {
      frame->id,   frame->x,    frame->y,         frame->r,         frame->theta,     frame->i,     frame->j,
      frame->fn,   frame->wall, frame->corner[0], frame->corner[1], frame->corner[2], frame->L_II,  frame->pressure,
      frame->area, frame->loop, frame->bx,        frame->by,        frame->br,        frame->omega, frame->ft};
  for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
    free(owned[k]);
  *frame = (tal_frame){0};
}

static bool is_frame_name(const struct dirent *entry) {
  size_t digits = strspn(entry->d_name, "0123456789");
  return digits > 0 && !strcmp(entry->d_name + digits, ".h5");
}

static int frame_filter(const struct dirent *entry) {
  return is_frame_name(entry);
}

// Time and strain of one frame; false when it cannot be opened.
static bool read_entry(tal_frame_entry *entry, const char *path) {
  hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file < 0)
    return false;
  *entry = (tal_frame_entry){tal_strdup(path), read_attribute(file, "time"), read_attribute(file, "axial_strain")};
  H5Fclose(file);
  return true;
}

tal_status tal_frame_list_read(tal_frame_list *list, const char *dir, tal_error *err) {
  *list = (tal_frame_list){0};
  char *folder = tal_path_join(dir, "fields");
  struct dirent **names = NULL;
  // Version order sorts 1000000 after 999999.
  int count = scandir(folder, &names, frame_filter, versionsort);
  list->entry = tal_alloc(count > 0 ? (size_t)count : 0, sizeof *list->entry);
  tal_status status = TAL_OK;
  quiet old = quiet_begin();
  for (int k = 0; k < count; k++) {
    char *path = tal_path_join(folder, names[k]->d_name);
    if (read_entry(&list->entry[list->count], path))
      list->count++;
    else if (!status)
      status = tal_fail(err, TAL_IO, "%s: not a readable field frame, left out", path);
    free(path);
    free(names[k]);
  }
  quiet_end(old);
  free(names);
  free(folder);
  return status;
}

void tal_frame_list_clear(tal_frame_list *list) {
  for (size_t k = 0; k < list->count; k++)
    free(list->entry[k].path);
  free(list->entry);
  *list = (tal_frame_list){0};
}
