// run.json: what was run, by what, how fast, how it ended. The scene stands there twice: as JSON values under "scene"
// and as the text that loads to it under "scene_text".
#include "output_parts.h"

#include "json.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

// ---- the scene's YAML as JSON ----

static bool is_integer(const char *text) {
  text += *text == '-';
  size_t digits = strspn(text, "0123456789");
  return digits > 0 && text[digits] == '\0' && (text[0] != '0' || digits == 1);
}

static void put_scalar(tal_json *json, const char *key, const yaml_node_t *node) {
  const char *text = (const char *)node->data.scalar.value;
  char *end;
  double value = strtod(text, &end);
  if (node->data.scalar.style != YAML_PLAIN_SCALAR_STYLE) {
    tal_json_text(json, key, text);
  } else if (strcmp(text, "true") == 0 || strcmp(text, "false") == 0 || strcmp(text, "null") == 0 || is_integer(text)) {
    tal_json_literal(json, key, text);
  } else if (*text && *end == '\0' && isfinite(value)) {
    tal_json_number(json, key, value);
  } else {
    tal_json_text(json, key, text); // names, and .inf and .nan, which JSON has not
  }
}

// As deep as the scene's schema, which the text was written from.
static void put_node(tal_json *json, const char *key, yaml_document_t *document, int index) {
  yaml_node_t *node = yaml_document_get_node(document, index);
  if (node->type == YAML_SCALAR_NODE) {
    put_scalar(json, key, node);
  } else if (node->type == YAML_SEQUENCE_NODE) {
    tal_json_open(json, key, '[');
    for (int *item = node->data.sequence.items.start; item < node->data.sequence.items.top; item++) {
      put_node(json, NULL, document, *item);
    }
    tal_json_close(json, ']');
  } else {
    tal_json_open(json, key, '{');
    for (yaml_node_pair_t *pair = node->data.mapping.pairs.start; pair < node->data.mapping.pairs.top; pair++) {
      yaml_node_t *name = yaml_document_get_node(document, pair->key);
      put_node(json, (const char *)name->data.scalar.value, document, pair->value);
    }
    tal_json_close(json, '}');
  }
}

static bool load_document(yaml_document_t *document, const void *text, size_t size) {
  yaml_parser_t parser;
  if (!yaml_parser_initialize(&parser))
    return false;
  yaml_parser_set_input_string(&parser, text, size);
  bool loaded = yaml_parser_load(&parser, document) != 0;
  yaml_parser_delete(&parser);
  if (loaded && yaml_document_get_root_node(document))
    return true;
  if (loaded)
    yaml_document_delete(document);
  return false;
}

// False: no memory for the document, as the text itself is well-formed.
static bool put_scene(tal_json *json, const char *text) {
  yaml_document_t document;
  const bool loaded = load_document(&document, text, strlen(text));
  if (loaded) {
    put_node(json, "scene", &document, 1);
    yaml_document_delete(&document);
  }
  tal_json_text(json, "scene_text", text);
  return loaded;
}

// ---- the report ----

static void put_run(tal_json *json, const tal_sim *sim, const tal_run_report *report) {
  tal_json_text(json, "version", TAL_VERSION);
  // clang names itself in __VERSION__, gcc gives only the number.
  tal_json_text(json, "compiler", strstr(__VERSION__, "lang") ? __VERSION__ : "gcc " __VERSION__);
  const geo_delaunay_backend *backend = sim->graph.backend;
  tal_json_text(json, "backend", backend ? backend->name : sim->scene->continuum.backend);
  tal_json_integer(json, "cores", report->cores);
  tal_json_integer(json, "grains", (int64_t)sim->grains.count);
  tal_json_number(json, "thickness", sim->constants.thickness);
  tal_json_number(json, "vR", sim->constants.vR);
  if (sim->run.forced)
    tal_json_integer(json, "forced_grain", sim->grains.id[sim->run.forced - 1]);
  if (sim->run.penalty > 0)
    tal_json_number(json, "penalty", sim->run.penalty);
  tal_json_integer(json, "steps", sim->run.step);
  tal_json_number(json, "time", sim->run.time);
  tal_json_integer(json, "force_evaluations", sim->run.force_evaluations);
  tal_json_number(json, "wall_time", report->wall_time);
  tal_json_number(json, "cpu_time", report->cpu_time);
  tal_json_number(json, "grain_steps_per_second", report->grain_steps_per_second);
  tal_json_number(json, "energy_residual", report->energy_residual);
}

static void put_warnings(tal_json *json, const tal_run_report *report) {
  tal_json_open(json, "warnings", '[');
  for (size_t k = 0; k < report->warning_count; k++)
    tal_json_text(json, NULL, report->warnings[k]);
  tal_json_close(json, ']');
}

static void put_stages(tal_json *json, const tal_run_report *report) {
  tal_json_open(json, "stages", '[');
  for (size_t k = 0; k < report->stage_count; k++) {
    const tal_stage_report *stage = &report->stages[k];
    tal_json_open(json, NULL, '{');
    tal_json_text(json, "kind", stage->kind);
    tal_json_integer(json, "steps", stage->steps);
    tal_json_number(json, "wall_time", stage->wall_time);
    tal_json_number(json, "cpu_time", stage->cpu_time);
    tal_json_number(json, "grain_steps_per_second", stage->grain_steps_per_second);
    tal_json_close(json, '}');
  }
  tal_json_close(json, ']');
}

static void put_packing(tal_json *json, const tal_sim *sim) {
  tal_json_open(json, "packing", '{');
  tal_json_number(json, "solid_fraction", sim->packing_solid_fraction);
  tal_json_number(json, "coordination", sim->packing_coordination);
  tal_json_number(json, "largest_overlap", sim->packing_overlap);
  tal_json_close(json, '}');
}

tal_status tal_output_report(tal_output *output, const tal_sim *sim, const tal_run_report *report, tal_error *err) {
  char path[TAL_PATH_SIZE], *text = NULL;
  size_t size = 0;
  tal_file_path(path, output->dir, "run.json");
  tal_json json = {.out = tal_text_begin(&text, &size)};
  tal_json_open(&json, NULL, '{');
  tal_json_text(&json, "name", sim->scene->name);
  tal_json_text(&json, "status", report->status);
  tal_json_text(&json, "reason", report->reason);
  put_run(&json, sim, report);
  put_warnings(&json, report);
  put_stages(&json, report);
  put_packing(&json, sim);
  const bool whole = put_scene(&json, output->scene_text);
  tal_json_close(&json, '}');
  tal_text_end(json.out);
  tal_status status = whole ? tal_file_replace(path, NULL, text, size, err)
                            : tal_fail(err, TAL_IO, "%s: no memory for the scene", path);
  free(text);
  return status;
}

// ---- reading it back: JSON is YAML ----

static const yaml_node_t *member(yaml_document_t *document, const yaml_node_t *node, const char *name) {
  if (!node || node->type != YAML_MAPPING_NODE)
    return NULL;
  for (yaml_node_pair_t *pair = node->data.mapping.pairs.start; pair < node->data.mapping.pairs.top; pair++) {
    const yaml_node_t *key = yaml_document_get_node(document, pair->key);
    if (key->type == YAML_SCALAR_NODE && strcmp((const char *)key->data.scalar.value, name) == 0) {
      return yaml_document_get_node(document, pair->value);
    }
  }
  return NULL;
}

static double number(const yaml_node_t *node) {
  if (!node || node->type != YAML_SCALAR_NODE)
    return 0;
  double value = strtod((const char *)node->data.scalar.value, NULL);
  return isfinite(value) && value > 0 ? value : 0;
}

static void read_stages(yaml_document_t *document, tal_stage_report *before, size_t stage_count) {
  const yaml_node_t *stages = member(document, yaml_document_get_root_node(document), "stages");
  if (!stages || stages->type != YAML_SEQUENCE_NODE)
    return;
  const size_t known = (size_t)(stages->data.sequence.items.top - stages->data.sequence.items.start);
  for (size_t k = 0; k < known && k < stage_count; k++) {
    const yaml_node_t *stage = yaml_document_get_node(document, stages->data.sequence.items.start[k]);
    before[k].steps = (int64_t)number(member(document, stage, "steps"));
    before[k].wall_time = number(member(document, stage, "wall_time"));
    before[k].cpu_time = number(member(document, stage, "cpu_time"));
    before[k].grain_steps_per_second = number(member(document, stage, "grain_steps_per_second"));
  }
}

bool tal_output_reported_done(const tal_output *output) {
  char path[TAL_PATH_SIZE];
  unsigned char *text;
  size_t size;
  yaml_document_t document;
  bool done = false;
  tal_file_path(path, output->dir, "run.json");
  if (tal_file_read(path, &text, &size, NULL) != TAL_OK)
    return false;
  if (load_document(&document, text, size)) {
    const yaml_node_t *status = member(&document, yaml_document_get_root_node(&document), "status");
    done = status && status->type == YAML_SCALAR_NODE && strcmp((const char *)status->data.scalar.value, "done") == 0;
    yaml_document_delete(&document);
  }
  free(text);
  return done;
}

void tal_report_read(const char *dir, tal_stage_report *before, size_t stage_count) {
  char path[TAL_PATH_SIZE];
  unsigned char *text;
  size_t size;
  yaml_document_t document;
  tal_file_path(path, dir, "run.json");
  if (tal_file_read(path, &text, &size, NULL) != TAL_OK)
    return;
  if (load_document(&document, text, size)) {
    read_stages(&document, before, stage_count);
    yaml_document_delete(&document);
  }
  free(text);
}
