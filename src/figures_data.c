// Reads series.csv and run.json for the figures (docs/formats.md). run.json is read with the YAML parser: JSON is a
// part of YAML. The scene in it may be an object or the text of a scene file.
#include "figures_data.h"

#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

char *tal_path_join(const char *dir, const char *name) {
  size_t size = strlen(dir) + strlen(name) + 2;
  char *path = tal_alloc(size, 1);
  snprintf(path, size, "%s/%s", dir, name);
  return path;
}

// The whole file, ended by a zero byte; NULL with errno set when it cannot be read.
static char *read_file(const char *path, size_t *size) {
  FILE *file = fopen(path, "rb");
  if (!file)
    return NULL;
  size_t capacity = 1 << 16, used = 0, got;
  char *text = tal_alloc(capacity, 1);
  while ((got = fread(text + used, 1, capacity - used - 1, file)) > 0) {
    used += got;
    if (capacity - used > 1)
      continue;
    text = tal_grow(text, capacity, capacity * 2, 1);
    capacity *= 2;
  }
  int failed = ferror(file) ? (errno ? errno : EIO) : 0;
  fclose(file);
  text[used] = 0;
  *size = used;
  if (!failed)
    return text;
  free(text);
  errno = failed;
  return NULL;
}

void tal_table_clear(tal_table *table) {
  for (size_t k = 0; k < table->columns; k++)
    free(table->name[k]);
  free(table->name);
  free(table->value);
  *table = (tal_table){0};
}

const double *tal_table_column(const tal_table *table, const char *name) {
  for (size_t k = 0; k < table->columns; k++)
    if (!strcmp(table->name[k], name))
      return table->value + k * table->rows;
  return NULL;
}

static size_t count_char(const char *text, const char *end, char wanted) {
  size_t count = 0;
  for (; text < end; text++)
    count += *text == wanted;
  return count;
}

static void read_header(tal_table *table, const char *line, const char *end) {
  table->columns = count_char(line, end, ',') + 1;
  table->name = tal_alloc(table->columns, sizeof *table->name);
  for (size_t k = 0; k < table->columns; k++) {
    const char *stop = memchr(line, ',', (size_t)(end - line));
    if (!stop)
      stop = end;
    const char *bracket = memchr(line, '[', (size_t)(stop - line));
    const char *last = bracket ? bracket : stop;
    table->name[k] = tal_alloc((size_t)(last - line) + 1, 1);
    memcpy(table->name[k], line, (size_t)(last - line));
    line = stop < end ? stop + 1 : end;
  }
}

// One row of numbers into its place; false when the line is not exactly that.
static bool read_row(tal_table *table, size_t row, const char *line, const char *end) {
  for (size_t k = 0; k < table->columns; k++) {
    char *stop;
    table->value[k * table->rows + row] = strtod(line, &stop);
    if (stop == line || stop > end)
      return false;
    if (k + 1 == table->columns)
      return stop == end;
    if (stop >= end || *stop != ',')
      return false;
    line = stop + 1;
  }
  return false;
}

static tal_status parse_table(tal_table *table, const char *path, const char *text, size_t size, tal_error *err) {
  const char *end = text + size, *line = memchr(text, '\n', size);
  if (!line || line == text)
    return tal_fail(err, TAL_BAD_INPUT, "%s:1: no header line of column names", path);
  read_header(table, text, line[-1] == '\r' ? line - 1 : line);
  line++;
  table->rows = count_char(line, end, '\n');
  table->value = tal_alloc(table->rows * table->columns, sizeof *table->value);
  for (size_t row = 0; row < table->rows; row++) {
    const char *next = memchr(line, '\n', (size_t)(end - line));
    const char *stop = next > line && next[-1] == '\r' ? next - 1 : next;
    if (!read_row(table, row, line, stop))
      return tal_fail(err, TAL_BAD_INPUT, "%s:%zu: not a row of %zu numbers", path, row + 2, table->columns);
    line = next + 1;
  }
  return TAL_OK;
}

tal_status tal_table_read(tal_table *table, const char *path, tal_error *err) {
  *table = (tal_table){0};
  size_t size;
  char *text = read_file(path, &size);
  if (!text)
    return tal_fail(err, TAL_IO, "%s: %s", path, strerror(errno));
  tal_status status = parse_table(table, path, text, size, err);
  free(text);
  if (status)
    tal_table_clear(table);
  return status;
}

static const char *scalar(const yaml_node_t *node) {
  return node && node->type == YAML_SCALAR_NODE ? (const char *)node->data.scalar.value : NULL;
}

// The value of `key` in a mapping, NULL when there is none.
static yaml_node_t *member(yaml_document_t *document, const yaml_node_t *map, const char *key) {
  if (!map || map->type != YAML_MAPPING_NODE)
    return NULL;
  for (const yaml_node_pair_t *pair = map->data.mapping.pairs.start; pair < map->data.mapping.pairs.top; pair++) {
    const char *name = scalar(yaml_document_get_node(document, pair->key));
    if (name && !strcmp(name, key))
      return yaml_document_get_node(document, pair->value);
  }
  return NULL;
}

static void facts_of_scene(tal_run_facts *facts, yaml_document_t *document, const yaml_node_t *scene) {
  const char *name = scalar(member(document, scene, "name"));
  if (name && *name) {
    free(facts->name);
    facts->name = tal_strdup(name);
  }
  const yaml_node_t *stages = member(document, scene, "stages");
  if (!stages || stages->type != YAML_SEQUENCE_NODE)
    return;
  for (const yaml_node_item_t *item = stages->data.sequence.items.start; item < stages->data.sequence.items.top;
       item++) {
    const yaml_node_t *stage = yaml_document_get_node(document, *item);
    const char *kind = scalar(member(document, stage, "kind"));
    if (!kind || strcmp(kind, "confine"))
      continue;
    const char *pressure = scalar(member(document, stage, "pressure"));
    facts->confine_stage = item - stages->data.sequence.items.start;
    facts->pressure = pressure ? strtod(pressure, NULL) : (double)NAN;
    return;
  }
}

// A scene given as text inside run.json (depth 0) is parsed in its turn (depth 1).
static void facts_of_text(tal_run_facts *facts, const char *text, size_t size, int depth) {
  yaml_parser_t parser;
  yaml_document_t document;
  if (!yaml_parser_initialize(&parser))
    return;
  yaml_parser_set_input_string(&parser, (const unsigned char *)text, size);
  if (yaml_parser_load(&parser, &document)) {
    const yaml_node_t *root = yaml_document_get_root_node(&document);
    const yaml_node_t *scene = depth == 0 ? member(&document, root, "scene") : root;
    const char *inner = scalar(scene), *forced = depth == 0 ? scalar(member(&document, root, "forced_grain")) : NULL;
    const char *status = depth == 0 ? scalar(member(&document, root, "status")) : NULL;
    facts->done = facts->done || (status && strcmp(status, "done") == 0);
    if (forced)
      facts->forced_grain = strtoll(forced, NULL, 10);
    if (inner && depth == 0)
      facts_of_text(facts, inner, strlen(inner), 1);
    else
      facts_of_scene(facts, &document, scene);
    yaml_document_delete(&document);
  }
  yaml_parser_delete(&parser);
}

// The last part of a path, trailing slashes aside.
static char *last_part(const char *path) {
  size_t end = strlen(path);
  while (end > 1 && path[end - 1] == '/')
    end--;
  size_t begin = end;
  while (begin > 0 && path[begin - 1] != '/')
    begin--;
  char *part = tal_alloc(end - begin + 1, 1);
  memcpy(part, path + begin, end - begin);
  return part;
}

void tal_run_facts_read(tal_run_facts *facts, const char *dir) {
  *facts = (tal_run_facts){.name = last_part(dir), .confine_stage = -1, .pressure = (double)NAN, .forced_grain = -1};
  char *path = tal_path_join(dir, "run.json");
  size_t size;
  char *text = read_file(path, &size);
  if (text)
    facts_of_text(facts, text, size, 0);
  free(text);
  free(path);
}

void tal_run_facts_clear(tal_run_facts *facts) {
  free(facts->name);
  *facts = (tal_run_facts){0};
}
