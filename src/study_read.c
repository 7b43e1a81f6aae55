// See study_read.h. The table of study_schema.c has read names, columns and numbers; here the parts whose shape depends
// on what they say.
#include "study_read.h"

#include "scene_value.h"
#include "scene_walk.h"
#include "study_schema.h"
#include "study_words.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SEEDS = 10000, MOST_VALUES = 1000 };

void tal_study_sets_add(tal_study_sets *sets, tal_study_set set) {
  sets->item = tal_grow(sets->item, sets->count, sets->count + 1, sizeof *sets->item);
  sets->item[sets->count++] = set;
}

// ---- keys of the scene and their values ----

// Does the path lead to a mapping of the scene, whose members may be set one by one?
static bool leads_to_group(const char *path) {
  const tal_key *keys = tal_schema(), *row = NULL;
  char word[64];
  for (size_t length; keys && *path; path += length + (path[length] != '\0')) {
    length = strcspn(path, ".[");
    snprintf(word, sizeof word, "%.*s", (int)length, path);
    if (length && strspn(word, "0123456789]") == length)
      continue;
    row = tal_walk_row(keys, word);
    keys = row ? row->keys : NULL;
  }
  return row && (row->type == TAL_KEY_GROUP || row->type == TAL_KEY_LIST);
}

// {a.b: 1} and {a: {b: 1}} alike; a mapping that is a value in itself stays one.
static void take_sets(tal_study *study, tal_study_sets *sets, const char *prefix, const tal_node *map) {
  for (const tal_node *child = map->child; child; child = child->next) {
    const char *path = *prefix ? tal_words_format(&study->tree, "%s.%s", prefix, child->key) : child->key;
    if (child->kind == TAL_NODE_MAP && leads_to_group(path)) {
      take_sets(study, sets, path, child);
      continue;
    }
    const char *value = tal_words_of_node(&study->tree, child);
    const char *text = tal_words_format(&study->tree, "%s=%s", path, value);
    tal_study_sets_add(sets, (tal_study_set){text, child->line, child->override != NULL});
  }
}

static bool read_sets(tal_study *study, tal_study_sets *sets, const tal_node *node, const char *key,
                      tal_report *report) {
  if (node->kind == TAL_NODE_MAP && node->count) {
    take_sets(study, sets, "", node);
    return true;
  }
  tal_report_add(report, node, key, "is not a mapping with keys; accepted: {KEY: VALUE, ...} with keys of the scene");
  return false;
}

// ---- seeds ----

static bool add_seed(tal_study_seeds *seeds, int64_t seed) {
  for (size_t k = 0; k < seeds->count; k++)
    if (seeds->seed[k] == seed)
      return false;
  seeds->seed = tal_grow(seeds->seed, seeds->count, seeds->count + 1, sizeof *seeds->seed);
  size_t at = seeds->count++;
  for (; at > 0 && seeds->seed[at - 1] > seed; at--)
    seeds->seed[at] = seeds->seed[at - 1];
  seeds->seed[at] = seed;
  return true;
}

static void read_seeds(tal_study_seeds *seeds, const tal_node *node, const char *key, tal_report *report) {
  const char *accepted = "accepted: a number of seeds from 1 to 10000, or a list of different ones: [1, 2, 3]";
  int64_t value = 0;
  const bool list = node->kind == TAL_NODE_LIST && node->count > 0 && node->count <= MOST_SEEDS;
  bool good = list;
  for (const tal_node *item = list ? node->child : NULL; item; item = item->next)
    good = good && item->kind == TAL_NODE_SCALAR && !item->quoted &&
           tal_read_whole(item->text, &value) == TAL_NUMBER_OK && value >= 0 && add_seed(seeds, value);
  if (node->kind == TAL_NODE_SCALAR && !node->quoted && tal_read_whole(node->text, &value) == TAL_NUMBER_OK) {
    good = value >= 1 && value <= MOST_SEEDS;
    for (int64_t seed = 1; good && seed <= value; seed++)
      add_seed(seeds, seed);
  }
  if (!good)
    tal_report_add(report, node, key, "%s; %s", list ? "holds what is no seed, or one twice" : "gives no seeds",
                   accepted);
}

// ---- dials ----

static const char *label_of_sets(tal_study *study, const tal_study_sets *sets) {
  const char *label = "";
  for (size_t k = 0; k < sets->count; k++)
    label = tal_words_format(&study->tree, "%s%s%s", label, k ? ", " : "", sets->item[k].text);
  return label;
}

static bool is_group(const tal_node *node) {
  return tal_node_get(node, "set") != NULL;
}

static void read_group(tal_study *study, tal_study_value *value, const tal_node *node, const char *key,
                       tal_report *report) {
  const tal_node *label = tal_node_get(node, "label");
  char place[120];
  for (const tal_node *child = node->child; child; child = child->next) {
    snprintf(place, sizeof place, "%.60s.%.40s", key, child->key);
    if (strcmp(child->key, "set") == 0)
      read_sets(study, &value->sets, child, place, report);
    else if (child != label)
      tal_report_add(report, child, place, "unknown key; accepted: label, set");
  }
  snprintf(place, sizeof place, "%.60s.label", key);
  if (label && (label->kind != TAL_NODE_SCALAR || !*label->text))
    tal_report_add(report, label, place, "is not a word; accepted: a line of text");
  value->named = label != NULL;
  value->label = label && label->kind == TAL_NODE_SCALAR ? label->text : label_of_sets(study, &value->sets);
}

// The value for the dial's key, or for each of its keys.
static void read_plain(tal_study *study, tal_study_value *value, const tal_node *node, const char *key,
                       const tal_node *keys) {
  const char *text = value->label = tal_words_of_node(&study->tree, node);
  if (node->kind == TAL_NODE_SCALAR)
    value->label = node->text;
  for (const tal_node *item = keys ? keys->child : NULL; item; item = item->next)
    tal_study_sets_add(&value->sets, (tal_study_set){tal_words_format(&study->tree, "%s=%s", item->text, text),
                                                     node->line, node->override != NULL});
  if (!keys)
    tal_study_sets_add(&value->sets, (tal_study_set){tal_words_format(&study->tree, "%s=%s", key, text), node->line,
                                                     node->override != NULL});
}

static bool keys_good(const tal_node *keys, const char *place, tal_report *report) {
  bool good = keys->kind == TAL_NODE_LIST && keys->count;
  for (const tal_node *item = good ? keys->child : NULL; item; item = item->next)
    good = good && item->kind == TAL_NODE_SCALAR && *item->text;
  if (!good)
    tal_report_add(report, keys, place, "is not a list of keys; accepted: [integrator.dt, stages.1.integrator.dt]");
  return good;
}

static void name_dial(tal_study_dial *dial, const tal_node *keys) {
  const char *key = dial->key ? dial->key : keys ? keys->child->text : "setting", *dot = strrchr(key, '.');
  if (!dial->name)
    dial->name = tal_strdup(dot && dot[1] ? dot + 1 : key);
}

static void check_dial(const tal_study *study, size_t d, const tal_node *node, tal_report *report) {
  const tal_study_dial *dial = &study->dials[d];
  char place[80];
  snprintf(place, sizeof place, "dials[%zu].key", d);
  if (dial->key && strcmp(dial->key, "seed") == 0)
    tal_report_add(report, tal_node_get(node, "key"), place, "is no dial; accepted: seeds, beside the dials");
  snprintf(place, sizeof place, "dials[%zu].keys", d);
  const tal_node *keys = tal_node_get(node, "keys");
  if (keys && dial->key)
    tal_report_add(report, keys, place, "stands beside key; accepted: one of the two");
  snprintf(place, sizeof place, "dials[%zu].name", d);
  if (d && strcmp(study->dials[0].name, dial->name) == 0)
    tal_report_add(report, node, place, "'%.40s' is the first dial's name; accepted: another name", dial->name);
}

static void read_value(tal_study *study, tal_study_dial *dial, const tal_node *node, const char *place,
                       const tal_node *keys, tal_report *report) {
  tal_study_value *value = &dial->value[dial->count];
  value->node = node;
  if (is_group(node))
    read_group(study, value, node, place, report);
  else if (dial->key || keys)
    read_plain(study, value, node, dial->key, keys);
  else
    tal_report_add(report, node, place,
                   "names no key; accepted: {label: ..., set: {KEY: VALUE, ...}}, or a dial's key");
  for (size_t k = 0; value->label && k < dial->count; k++)
    if (dial->value[k].label && strcmp(dial->value[k].label, value->label) == 0)
      tal_report_add(report, node, place, "'%.60s' is there already; accepted: different values, or labels",
                     value->label);
  dial->count++;
}

static void read_dial(tal_study *study, size_t d, const tal_node *node, tal_report *report) {
  tal_study_dial *dial = &study->dials[d];
  const tal_node *values = tal_node_get(node, "values"), *keys = tal_node_get(node, "keys");
  char place[80];
  snprintf(place, sizeof place, "dials[%zu].keys", d);
  if (keys && !keys_good(keys, place, report))
    return;
  name_dial(dial, keys);
  check_dial(study, d, node, report);
  if (!values)
    return;
  snprintf(place, sizeof place, "dials[%zu].values", d);
  const bool own = tal_node_find(study->tree.root, "reference.set") && study->dial_count == 1;
  if (values->kind != TAL_NODE_LIST || values->count < (own ? 1 : 2) || values->count > MOST_VALUES) {
    tal_report_add(report, values, place, "%s; accepted: a list of two to 1000 values",
                   values->kind != TAL_NODE_LIST ? "is not a list"
                   : values->count < 2           ? "has too few values to compare"
                                                 : "has too many values");
    return;
  }
  dial->value = tal_alloc(values->count, sizeof *dial->value);
  for (const tal_node *item = values->child; item; item = item->next) {
    snprintf(place, sizeof place, "dials[%zu].values[%zu]", d, dial->count);
    read_value(study, dial, item, place, keys, report);
  }
}

// ---- metrics ----

static void read_within(tal_study_metric *metric, const tal_node *node, const char *place, tal_report *report) {
  const size_t length = node->kind == TAL_NODE_SCALAR ? strlen(node->text) : 0;
  char text[40];
  metric->relative = length > 1 && node->text[length - 1] == '%';
  snprintf(text, sizeof text, "%.*s", (int)(length - metric->relative), length ? node->text : "");
  double value = (double)NAN;
  if (length < sizeof text && tal_read_real(text, &value) == TAL_NUMBER_OK && value > 0 && isfinite(value)) {
    metric->within = metric->relative ? value / 100 : value;
    return;
  }
  tal_report_add(report, node, place, "is no error; accepted: a number > 0 in the column's unit, or a share: 5%%");
}

static char *metric_name(const tal_study_metric *metric) {
  static const char *const word[] = {"at", "mean", "peak", "trough", "peak_at", "trough_at", "correlation"};
  char text[200], window[80] = "";
  if (metric->take == TAL_TAKE_VALUE)
    snprintf(window, sizeof window, "_%g", metric->at);
  else if (isfinite(metric->from) && isfinite(metric->to))
    snprintf(window, sizeof window, "_%g_%g", metric->from, metric->to);
  else if (isfinite(metric->from) || isfinite(metric->to))
    snprintf(window, sizeof window, "_%s_%g", isfinite(metric->from) ? "from" : "to",
             isfinite(metric->from) ? metric->from : metric->to);
  snprintf(text, sizeof text, "%.80s%s%s%s", metric->column ? metric->column : "", metric->column ? "_" : "",
           word[metric->take], window);
  return tal_strdup(text);
}

static void read_metric(tal_study *study, size_t m, const tal_node *node, tal_report *report) {
  tal_study_metric *metric = &study->metrics[m];
  const tal_node *within = tal_node_get(node, "within"), *column = tal_node_get(node, "column");
  char place[80];
  const char *near;
  metric->line = node->line;
  metric->within = (double)NAN;
  snprintf(place, sizeof place, "metrics[%zu].within", m);
  if (within)
    read_within(metric, within, place, report);
  snprintf(place, sizeof place, "metrics[%zu].column", m);
  if (column && metric->column && !tal_study_column_known(metric->column, &near))
    tal_report_add(report, column, place, "'%.40s' is no column%s%s%s; accepted: a column of series.csv, without unit",
                   metric->column, *near ? "; did you mean '" : "", near, *near ? "'?" : "");
  snprintf(place, sizeof place, "metrics[%zu].to", m);
  if (metric->to <= metric->from)
    tal_report_add(report, node, place, "%g is not beyond from %g; accepted: a larger one", metric->to, metric->from);
  if (!metric->name)
    metric->name = metric_name(metric);
  snprintf(place, sizeof place, "metrics[%zu]", m);
  for (size_t k = 0; k < m; k++)
    if (strcmp(tal_words_slug(&study->tree, study->metrics[k].name), tal_words_slug(&study->tree, metric->name)) == 0)
      tal_report_add(report, node, place, "is called '%.60s' as metrics[%zu] is; accepted: another name", metric->name,
                     k);
}

// ---- all of it ----

static void read_reference(tal_study *study, tal_node *root, tal_report *report) {
  const tal_node *reference = tal_node_get(root, "reference"), *set = tal_node_get(reference, "set");
  const tal_node *value = tal_node_get(reference, "value"), *seeds = tal_node_get(reference, "seeds");
  if (!reference)
    tal_report_add(
        report, root, "reference",
        "is missing; accepted: one of the dial's values, {value: ..., seeds: ...}, or {set: ..., label: ...}");
  else if (set && value)
    tal_report_add(report, set, "reference.set", "stands beside value; accepted: one of the two");
  else if (!set && !value)
    tal_report_add(report, reference, "reference", "names no setting; accepted: value or set");
  if (set)
    read_sets(study, &study->reference.sets, set, "reference.set", report);
  if (!set && study->reference.label)
    tal_report_add(report, tal_node_get(reference, "label"), "reference.label",
                   "has no effect with value; accepted: only with set");
  if (seeds)
    read_seeds(&study->reference.seeds, seeds, "reference.seeds", report);
}

void tal_study_read(tal_study *study, tal_report *report) {
  tal_node *root = study->tree.root;
  const tal_node *set = tal_node_get(root, "set"), *seeds = tal_node_get(root, "seeds");
  const tal_node *dials = tal_node_get(root, "dials"), *metrics = tal_node_get(root, "metrics");
  if (set)
    read_sets(study, &study->common, set, "set", report);
  if (seeds)
    read_seeds(&study->seeds, seeds, "seeds", report);
  for (size_t d = 0; d < study->dial_count; d++)
    read_dial(study, d, tal_node_item(dials, d), report);
  for (size_t m = 0; m < study->metric_count; m++)
    read_metric(study, m, tal_node_item(metrics, m), report);
  read_reference(study, root, report);
}
