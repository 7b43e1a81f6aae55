// Anyone's packing from a CSV file. The first line that is neither blank nor a comment (#) names the columns, in any
// order: x, y, r are required; vx, vy, omega, mass, inertia, fixed may follow; a column `id` is read past (ids are in
// file order). A name may carry its SI unit in brackets (x[m]). Fields are separated by commas; an empty mass or
// inertia is "not given". LF or CRLF, a byte order mark and "quoted" fields without commas inside are taken. Anything
// else is an error that names the file and the line: nothing is guessed.
#include "pack_methods.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { X, Y, R, VX, VY, OMEGA, MASS, INERTIA, FIXED, ID, COLUMNS };

static const struct {
  const char *name, *unit;
  double absent; // value without the column, or of an empty field where `may_be_empty`
  bool may_be_empty;
} column[COLUMNS] = {
    [X] = {"x", "m", 0, false},
    [Y] = {"y", "m", 0, false},
    [R] = {"r", "m", 0, false},
    [VX] = {"vx", "m/s", 0, false},
    [VY] = {"vy", "m/s", 0, false},
    [OMEGA] = {"omega", "rad/s", 0, false},
    [MASS] = {"mass", "kg", (double)NAN, true},
    [INERTIA] = {"inertia", "kg m^2", (double)NAN, true},
    [FIXED] = {"fixed", "1", 0, false},
    [ID] = {"id", "1", 0, true},
};

typedef struct row {
  double value[COLUMNS];
  long line;
} row;

typedef struct reader {
  const char *path; // of the CSV file
  FILE *file;
  char *line; // owned, getline's
  size_t line_size;
  long number;        // of the line, from 1
  int field[COLUMNS]; // column that each field of a line belongs to
  size_t field_count; // 0 before the header
  row *rows;          // owned; [capacity]
  size_t count, capacity;
  tal_error *err;
} reader;

static tal_status refuse(const reader *in, const char *key, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static tal_status refuse(const reader *in, const char *key, const char *format, ...) {
  tal_error said;
  va_list args;
  va_start(args, format);
  vsnprintf(said.text, sizeof said.text, format, args);
  va_end(args);
  const char *colon = key[0] ? ": " : "";
  return tal_fail(in->err, TAL_BAD_INPUT, "%s:%ld: %s%s%s", in->path, in->number, key, colon, said.text);
}

// Text without blanks around it and without one pair of quotes; cuts `text` in place.
static char *trimmed(char *text) {
  static const char blank[] = " \t\r\n";
  text += strspn(text, blank);
  size_t length = strlen(text);
  while (length > 0 && strchr(blank, text[length - 1]))
    text[--length] = 0;
  if (length >= 2 && text[0] == '"' && text[length - 1] == '"') {
    text[length - 1] = 0;
    return text + 1;
  }
  return text;
}

// "x" or "x[m]" -> the column; -1 unknown, -2 another unit. Cuts the unit off the name.
static int column_of(char *name) {
  char *unit = strchr(name, '[');
  size_t length = strlen(name);
  if (unit && name[length - 1] == ']') {
    name[length - 1] = 0;
    *unit++ = 0;
  } else {
    unit = NULL;
  }
  for (int c = 0; c < COLUMNS; c++)
    if (strcmp(trimmed(name), column[c].name) == 0)
      return unit && strcmp(unit, column[c].unit) != 0 ? -2 : c;
  return -1;
}

static tal_status read_header(reader *in) {
  bool seen[COLUMNS] = {false};
  char *rest = in->line;
  for (char *name; (name = strsep(&rest, ","));) {
    name = trimmed(name);
    int c = column_of(name);
    if (c == -2)
      return refuse(in, name, "columns are in SI units, as x[m], vx[m/s], omega[rad/s], inertia[kg m^2]");
    if (c == -1)
      return refuse(in, name[0] ? name : "header",
                    "unknown column; accepted are x, y, r (required) and vx, vy, omega, "
                    "mass, inertia, fixed, id");
    if (seen[c])
      return refuse(in, name, "the column is there twice");
    seen[c] = true;
    in->field[in->field_count++] = c;
  }
  for (int c = X; c <= R; c++)
    if (!seen[c])
      return refuse(in, column[c].name, "the header has no such column; x, y and r are required");
  return TAL_OK;
}

// Decimal numbers only: strtod alone would take hexadecimal, "nan" and "inf".
static bool read_number(const char *text, double *value) {
  if (text[0] == 0 || text[strspn(text, "+-.0123456789eE")] != 0)
    return false;
  char *end;
  *value = strtod(text, &end);
  return *end == 0 && end != text && isfinite(*value);
}

static tal_status read_field(const reader *in, int c, const char *text, double *value) {
  if (c == ID)
    return TAL_OK;
  if (text[0] == 0 && column[c].may_be_empty)
    return TAL_OK;
  if (c == FIXED) {
    *value = strcmp(text, "1") == 0 || strcmp(text, "true") == 0;
    if (*value != 0 || strcmp(text, "0") == 0 || strcmp(text, "false") == 0)
      return TAL_OK;
    return refuse(in, "fixed", "'%.40s' is none of 0, 1, false, true", text);
  }
  if (!read_number(text, value))
    return refuse(in, column[c].name, "'%.40s' is not a finite number", text);
  if ((c == R || c == MASS || c == INERTIA) && !(*value > 0))
    return refuse(in, column[c].name, "%s is not above 0", text);
  return TAL_OK;
}

static tal_status read_row(reader *in) {
  if (in->count == INT32_MAX)
    return refuse(in, "", "more than %d grains", INT32_MAX);
  if (in->count == in->capacity) {
    in->capacity = 2 * in->count + 256;
    in->rows = tal_grow(in->rows, in->count, in->capacity, sizeof *in->rows);
  }
  row *made = &in->rows[in->count++];
  made->line = in->number;
  for (int c = 0; c < COLUMNS; c++)
    made->value[c] = column[c].absent;
  char *rest = in->line;
  for (size_t k = 0; k < in->field_count; k++) {
    char *text = strsep(&rest, ",");
    if (!text)
      return refuse(in, "", "%zu fields where the header has %zu", k, in->field_count);
    tal_status status = read_field(in, in->field[k], trimmed(text), &made->value[in->field[k]]);
    if (status)
      return status;
  }
  return rest ? refuse(in, "", "more fields than the %zu of the header", in->field_count) : TAL_OK;
}

static tal_status read_lines(reader *in) {
  static const char byte_order_mark[] = "\xef\xbb\xbf";
  for (ssize_t length; (length = getline(&in->line, &in->line_size, in->file)) >= 0;) {
    in->number++;
    if (strlen(in->line) != (size_t)length)
      return refuse(in, "", "not text (a zero byte)");
    if (in->number == 1 && strncmp(in->line, byte_order_mark, 3) == 0)
      memset(in->line, ' ', 3);
    const char *text = in->line + strspn(in->line, " \t\r\n");
    if (text[0] == 0 || text[0] == '#')
      continue;
    tal_status status = in->field_count == 0 ? read_header(in) : read_row(in);
    if (status)
      return status;
  }
  if (ferror(in->file))
    return tal_fail(in->err, TAL_BAD_INPUT, "%s: cannot read it: %s", in->path, strerror(errno));
  if (in->field_count == 0)
    return tal_fail(in->err, TAL_BAD_INPUT, "%s: no header line naming x, y, r", in->path);
  return in->count > 0 ? TAL_OK : tal_fail(in->err, TAL_BAD_INPUT, "%s: no grains below the header", in->path);
}

static tal_status take_rows(const reader *in, tal_packing *packing) {
  tal_packing_init(packing, in->count);
  for (size_t i = 0; i < in->count; i++) {
    const double *value = in->rows[i].value;
    packing->x[i] = value[X];
    packing->y[i] = value[Y];
    packing->r[i] = value[R];
    tal_packed_extras extras = {value[VX], value[VY], value[OMEGA], value[MASS], value[INERTIA], value[FIXED] != 0};
    tal_packing_extras(packing, i, &extras);
  }
  size_t i, j;
  if (!tal_packing_coincident(packing, &i, &j))
    return TAL_OK;
  return tal_fail(in->err, TAL_BAD_INPUT, "%s:%ld: x, y: grains %zu and %zu (lines %ld and %ld) have the same centre",
                  in->path, in->rows[j].line, i, j, in->rows[i].line, in->rows[j].line);
}

// Relative to the folder of the scene file. Owned by the caller.
static char *csv_path(const tal_scene *scene) {
  const char *slash = scene->path ? strrchr(scene->path, '/') : NULL;
  if (!slash || scene->pack.path[0] == '/')
    return tal_strdup(scene->pack.path);
  size_t folder = (size_t)(slash - scene->path) + 1, size = folder + strlen(scene->pack.path) + 1;
  char *path = tal_alloc(size, 1);
  memcpy(path, scene->path, folder);
  memcpy(path + folder, scene->pack.path, size - folder);
  return path;
}

static tal_status file(const tal_scene *scene, tal_packing *packing, tal_error *err) {
  if (!scene->pack.path || !scene->pack.path[0])
    return tal_pack_fail(scene, 0, "pack.path", err, "missing; pack.method file needs a CSV file");
  char *path = csv_path(scene);
  reader in = {.path = path, .file = fopen(path, "r"), .err = err};
  tal_status status;
  if (!in.file) {
    status = tal_pack_fail(scene, 0, "pack.path", err, "cannot open '%s': %s", path, strerror(errno));
  } else {
    status = read_lines(&in);
    if (!status)
      status = take_rows(&in, packing);
    fclose(in.file);
  }
  free(in.line);
  free(in.rows);
  free(path);
  return status;
}

const tal_packer tal_packer_file = {"file", "a packing from a CSV file with columns x, y, r and more (path)", file};
