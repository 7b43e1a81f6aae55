// From STUDY.yaml to a plan: the file's tree, its parts (study_read.c), the settings they make, and the scene of each,
// loaded and checked now so that nothing can be misspelt in the tenth hour of a study.
#include "files.h"
#include "progress.h"
#include "scene_read.h"
#include "scene_set.h"
#include "scene_value.h"
#include "study_read.h"
#include "study_schema.h"
#include "study_words.h"

#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// ---- the file ----

// `reference: 1e-6` is short for `reference: {value: 1e-6}`.
static void spell_out_reference(tal_tree *tree) {
  tal_node *node = tal_node_get(tree->root, "reference");
  if (!node || node->kind == TAL_NODE_MAP)
    return;
  tal_node *value = tal_node_create(tree, node->kind);
  *value = *node;
  value->key = "value";
  value->next = NULL;
  node->kind = TAL_NODE_MAP;
  node->child = node->last = value;
  node->count = 1;
}

static bool read_tree(tal_study *study, tal_report *report) {
  unsigned char *bytes = NULL;
  size_t size = 0;
  tal_error err;
  tal_yaml_error error;
  if (tal_file_read(study->path, &bytes, &size, &err) != TAL_OK || size > TAL_YAML_BYTES) {
    tal_report_text(report, 0, NULL, "", "cannot be read; accepted: a study file in YAML");
    free(bytes);
    return false;
  }
  study->tree.root = tal_yaml_parse(&study->tree, (const char *)bytes, size, NULL, &error);
  free(bytes);
  if (!study->tree.root)
    tal_report_text(report, error.line, NULL, "", error.text);
  else if (study->tree.root->kind != TAL_NODE_MAP)
    tal_report_text(report, study->tree.root->line, NULL, "", "the study is not a mapping; accepted: key: value");
  return report->errors->count == 0;
}

// Does --set name a key of the study (or nothing at all, which is reported there)?
static bool is_of_study(const char *option) {
  char word[64];
  snprintf(word, sizeof word, "%.*s", (int)strcspn(option, ".[="), option);
  return !*word || !option[strcspn(option, "=")] || tal_schema_row(tal_study_keys(), word, NULL);
}

static bool same_key(const char *a, const char *b) {
  const size_t length = strcspn(a, "=");
  return length == strcspn(b, "=") && strncmp(a, b, length) == 0;
}

// A key of the scene, set in every run over what the study file says.
static void add_option(tal_study *study, const char *option) {
  const tal_study_set set = {tal_tree_copy(&study->tree, option, strlen(option)), 0, true};
  for (size_t k = 0; k < study->common.count; k++)
    if (same_key(study->common.item[k].text, option)) {
      study->common.item[k] = set;
      return;
    }
  tal_study_sets_add(&study->common, set);
}

// What a dial turns no option can hold still.
static void check_options(const tal_study *study, tal_report *report) {
  for (size_t k = 0; k < study->common.count; k++)
    for (size_t s = 0; s < study->setting_count && study->common.item[k].option; s++)
      for (size_t j = 0; j < study->settings[s].sets.count; j++)
        if (same_key(study->common.item[k].text, study->settings[s].sets.item[j].text))
          tal_report_text(report, 0, study->common.item[k].text, "",
                          "a dial turns this key; accepted: other keys, or the dial: dials.0.values=[...]");
}

static void find_scene(tal_study *study, tal_report *report) {
  if (!study->scene)
    return;
  const char *slash = strrchr(study->path, '/');
  const int folder = slash && *study->scene != '/' ? (int)(slash - study->path) + 1 : 0;
  const char *path = tal_words_format(&study->tree, "%.*s%s", folder, study->path, study->scene);
  study->scene_path = tal_strdup(path);
  if (access(path, R_OK) != 0)
    tal_report_add(report, tal_node_get(study->tree.root, "scene"), "scene",
                   "'%.200s' cannot be read; accepted: a scene file, relative to the study file's folder", path);
}

// ---- settings ----

static bool same_number(const char *a, const char *b) {
  double x, y;
  return tal_read_real(a, &x) == TAL_NUMBER_OK && tal_read_real(b, &y) == TAL_NUMBER_OK && x == y;
}

// Which value of the dial is meant: by its label, as a number, or written the same way. TAL_STUDY_OWN: none.
static size_t find_value(tal_study *study, const tal_study_dial *dial, const tal_node *node) {
  const char *wanted = node->kind == TAL_NODE_SCALAR ? node->text : tal_words_of_node(&study->tree, node);
  for (size_t k = 0; k < dial->count; k++)
    if (dial->value[k].label && strcmp(dial->value[k].label, wanted) == 0)
      return k;
  for (size_t k = 0; k < dial->count; k++)
    if (dial->value[k].label && same_number(dial->value[k].label, wanted))
      return k;
  return TAL_STUDY_OWN;
}

static void list_labels(const tal_study_dial *dial, char *out, size_t size) {
  size_t used = 0;
  *out = '\0';
  for (size_t k = 0; k < dial->count && k < 12 && used < size; k++)
    used += (size_t)snprintf(out + used, size - used, "%s%.60s", k ? ", " : "", dial->value[k].label);
}

// The reference's place among the values of each dial; false when reported.
static bool find_reference(tal_study *study, size_t place[2], tal_report *report) {
  const tal_node *node = tal_node_find(study->tree.root, "reference.value");
  for (size_t d = 0; d < study->dial_count; d++) {
    const tal_study_dial *dial = &study->dials[d];
    const tal_node *item = study->dial_count == 1        ? node
                           : node->kind == TAL_NODE_LIST ? tal_node_item(node, d)
                                                         : tal_node_get(node, dial->name);
    char labels[500];
    place[d] = item ? find_value(study, dial, item) : TAL_STUDY_OWN;
    if (place[d] != TAL_STUDY_OWN)
      continue;
    list_labels(dial, labels, sizeof labels);
    tal_report_add(report, item ? item : node, "reference", "%s is not among the values of dial '%.40s'; accepted: %s",
                   item ? tal_words_of_node(&study->tree, item) : "nothing", dial->name, labels);
    return false;
  }
  return true;
}

static void describe_setting(tal_study *study, tal_study_setting *setting) {
  const char *label = "", *id = "";
  for (size_t d = 0; d < study->dial_count; d++) {
    const tal_study_dial *dial = &study->dials[d];
    const tal_study_value *value = &dial->value[setting->value[d]];
    const char *part = value->named ? value->label : tal_words_format(&study->tree, "%s=%s", dial->name, value->label);
    label = tal_words_format(&study->tree, "%s%s%s", label, d ? ", " : "", part);
    id = tal_words_format(&study->tree, "%s%s%s-%s", id, d ? "_" : "", dial->name, value->label);
    for (size_t k = 0; k < value->sets.count; k++)
      tal_study_sets_add(&setting->sets, value->sets.item[k]);
  }
  setting->label = label;
  // As a name of a folder it must fit one.
  setting->id = tal_words_format(&study->tree, "%.120s", tal_words_slug(&study->tree, id));
}

static tal_study_setting *add_setting(tal_study *study) {
  study->settings = tal_grow(study->settings, study->setting_count, study->setting_count + 1, sizeof *study->settings);
  tal_study_setting *setting = &study->settings[study->setting_count++];
  *setting = (tal_study_setting){.value = {TAL_STUDY_OWN, TAL_STUDY_OWN}, .seeds = &study->seeds};
  return setting;
}

static void add_own_reference(tal_study *study) {
  tal_study_setting *setting = add_setting(study);
  setting->label = study->reference.label ? study->reference.label : "reference";
  setting->id = tal_words_format(&study->tree, "reference-%s", tal_words_slug(&study->tree, setting->label));
  for (size_t k = 0; k < study->reference.sets.count; k++)
    tal_study_sets_add(&setting->sets, study->reference.sets.item[k]);
}

static void make_settings(tal_study *study, const size_t reference[2]) {
  const size_t second = study->dial_count > 1 ? study->dials[1].count : 1;
  for (size_t i = 0; i < study->dials[0].count; i++)
    for (size_t j = 0; j < second; j++) {
      tal_study_setting *setting = add_setting(study);
      setting->value[0] = i;
      setting->value[1] = study->dial_count > 1 ? j : TAL_STUDY_OWN;
      describe_setting(study, setting);
      if (i == reference[0] && setting->value[1] == reference[1])
        study->reference_setting = study->setting_count - 1;
    }
  if (study->reference.sets.count) {
    study->reference_setting = study->setting_count;
    add_own_reference(study);
  }
  if (study->reference.seeds.count)
    study->settings[study->reference_setting].seeds = &study->reference.seeds;
}

// Two labels may give the same folder.
static void check_ids(const tal_study *study, tal_report *report) {
  for (size_t s = 0; s < study->setting_count; s++)
    for (size_t k = 0; k < s; k++)
      if (strcmp(study->settings[s].id, study->settings[k].id) == 0)
        tal_report_add(report, tal_node_get(study->tree.root, "dials"), "dials",
                       "'%.60s' and '%.60s' would share the folder %.60s; accepted: labels that differ in letters",
                       study->settings[k].label, study->settings[s].label, study->settings[s].id);
}

// ---- scenes ----

// All keys changed in a run, as tal_scene_load takes them; owned by the caller, the texts by the tree.
static const tal_study_set **sets_of(tal_study *study, const tal_study_setting *setting, const char ***texts,
                                     size_t *count) {
  *count = study->common.count + setting->sets.count;
  const tal_study_set **sets = tal_alloc(*count + 1, sizeof *sets);
  *texts = tal_alloc(*count + 2, sizeof **texts);
  for (size_t k = 0; k < *count; k++) {
    sets[k] = k < study->common.count ? &study->common.item[k] : &setting->sets.item[k - study->common.count];
    (*texts)[k] = sets[k]->text;
  }
  return sets;
}

// What is wrong in a setting's scene and not in the base scene is the setting's doing.
static void blame(tal_report *report, const char *text, const tal_scene_errors *base, const char *label) {
  for (size_t e = 0; e < base->count; e++)
    if (strcmp(base->item[e].text, text) == 0) {
      tal_report_line(report, text);
      return;
    }
  char full[sizeof((tal_error *)NULL)->text];
  snprintf(full, sizeof full, "%.900s (in setting %.80s)", text, label);
  tal_report_line(report, full);
}

// Says what tal_scene_load found, with the line of the study file in place of the --set that it saw.
static void pass_on(const tal_scene_errors *errors, const tal_study_set *const *sets, size_t count,
                    const tal_scene_errors *base, const char *label, tal_report *report) {
  for (size_t e = 0; e < errors->count; e++) {
    const char *text = errors->item[e].text, *found = NULL;
    char prefix[140], quoted[104];
    size_t k = count;
    while (k > 0 && !found) {
      tal_quote(sets[--k]->text, 100, quoted, sizeof quoted);
      snprintf(prefix, sizeof prefix, "--set %s: ", quoted);
      if (strncmp(text, prefix, strlen(prefix)) == 0)
        found = text + strlen(prefix);
    }
    if (found && sets[k]->option)
      tal_report_text(report, 0, sets[k]->text, "", found);
    else if (found)
      tal_report_text(report, sets[k]->line, NULL, "", found);
    else
      blame(report, text, base, label);
  }
}

static double nominal_steps(const tal_scene *scene) {
  double steps = 0;
  bool open;
  for (size_t s = 0; s < scene->stage_count; s++)
    if (scene->stages[s].integrator.dt > 0)
      steps += tal_progress_nominal_time(&scene->stages[s], &open) / scene->stages[s].integrator.dt;
  return steps;
}

static void check_metrics(const tal_study *study, const tal_scene *scene, tal_report *report) {
  double strain = 0;
  for (size_t s = 0; s < scene->stage_count; s++)
    if (isfinite(scene->stages[s].strain))
      strain += fabs(scene->stages[s].strain);
  for (size_t m = 0; m < study->metric_count; m++) {
    const tal_study_metric *metric = &study->metrics[m];
    const bool value = metric->take == TAL_TAKE_VALUE;
    const double last = value ? metric->at : metric->to;
    char place[80], text[160];
    snprintf(place, sizeof place, "metrics[%zu].%s", m, value ? "at" : "to");
    snprintf(text, sizeof text, "%g is beyond the strain of the scene's stages, %g; accepted: up to that", last,
             strain);
    if (!metric->along_time && strain > 0 && last > strain * (1 + 1e-9))
      tal_report_text(report, metric->line, NULL, place, text);
  }
  for (size_t k = 0; k < study->cost_stage_count; k++)
    if ((size_t)study->cost_stages[k] >= scene->stage_count)
      tal_report_add(report, tal_node_get(study->tree.root, "cost_stages"), "cost_stages",
                     "%lld is no stage; accepted: from 0 to %zu", (long long)study->cost_stages[k],
                     scene->stage_count - 1);
}

// The runs of a setting, until its scene is found wrong; `base`: errors of the scene without the dials.
static void add_runs(tal_study *study, size_t s, const tal_scene_errors *base, tal_report *report) {
  const tal_study_setting *setting = &study->settings[s];
  const char **texts;
  size_t count;
  const tal_study_set **sets = sets_of(study, setting, &texts, &count);
  bool good = true;
  for (size_t k = 0; k < setting->seeds->count && good; k++) {
    tal_scene scene;
    tal_scene_errors errors;
    const int64_t seed = setting->seeds->seed[k];
    texts[count] = tal_words_format(&study->tree, "seed=%lld", (long long)seed);
    good = tal_scene_load(&scene, study->scene_path, texts, count + 1, &errors) == TAL_OK;
    if (!good) {
      pass_on(&errors, sets, count, base, setting->label, report);
      break;
    }
    if (s == 0 && k == 0)
      check_metrics(study, &scene, report);
    char *text = tal_scene_text(&scene);
    study->runs[study->run_count++] =
        (tal_study_run){tal_words_format(&study->tree, "%s_s%lld", setting->id, (long long)seed), s, seed,
                        tal_hash(text, strlen(text)), nominal_steps(&scene)};
    free(text);
    tal_scene_clear(&scene);
  }
  free(sets);
  free(texts);
}

static void make_runs(tal_study *study, tal_report *report) {
  size_t count = 0;
  for (size_t s = 0; s < study->setting_count; s++)
    count += study->settings[s].seeds->count;
  study->runs = tal_alloc(count, sizeof *study->runs);
  const tal_study_setting none = {.seeds = &study->seeds};
  const char **texts;
  tal_scene scene;
  tal_scene_errors base;
  free(sets_of(study, &none, &texts, &count));
  if (tal_scene_load(&scene, study->scene_path, texts, count, &base) == TAL_OK)
    tal_scene_clear(&scene);
  free(texts);
  for (size_t s = 0; s < study->setting_count; s++)
    add_runs(study, s, &base, report);
}

// ---- all of it ----

static void load(tal_study *study, const char *const *sets, size_t set_count, tal_report *report) {
  if (!read_tree(study, report))
    return;
  for (size_t k = 0; k < set_count; k++)
    if (is_of_study(sets[k]))
      tal_scene_set(&study->tree, sets[k], report);
  spell_out_reference(&study->tree);
  tal_schema_read(tal_study_keys(), study, study->tree.root, report);
  tal_schema_read_variants(tal_study_keys(), study, study->tree.root, report);
  find_scene(study, report);
  tal_study_read(study, report);
  for (size_t k = 0; k < set_count; k++)
    if (!is_of_study(sets[k]))
      add_option(study, sets[k]);
  size_t reference[2] = {TAL_STUDY_OWN, TAL_STUDY_OWN};
  if (report->errors->count || (!study->reference.sets.count && !find_reference(study, reference, report)))
    return;
  make_settings(study, reference);
  check_ids(study, report);
  check_options(study, report);
  if (!report->errors->count)
    make_runs(study, report);
}

tal_status tal_study_load(tal_study *study, const char *path, const char *const *sets, size_t set_count,
                          tal_scene_errors *errors) {
  tal_report report = {.file = path, .errors = errors};
  errors->count = 0;
  *study = (tal_study){.path = tal_strdup(path)};
  locale_t plain = newlocale(LC_NUMERIC_MASK, "C", (locale_t)0), before = uselocale(plain);
  load(study, sets, set_count, &report);
  uselocale(before);
  freelocale(plain);
  if (!errors->count)
    return TAL_OK;
  tal_study_clear(study);
  return TAL_BAD_INPUT;
}

void tal_study_clear(tal_study *study) {
  for (size_t d = 0; d < study->dial_count; d++) {
    for (size_t k = 0; k < study->dials[d].count; k++)
      free(study->dials[d].value[k].sets.item);
    free(study->dials[d].value);
    tal_schema_release(tal_study_dial_keys(), &study->dials[d]);
  }
  for (size_t m = 0; m < study->metric_count; m++) {
    free(study->metrics[m].name);
    free(study->metrics[m].column);
  }
  for (size_t s = 0; s < study->setting_count; s++)
    free(study->settings[s].sets.item);
  tal_schema_release(tal_study_keys(), study);
  free(study->seeds.seed);
  free(study->reference.seeds.seed);
  free(study->reference.sets.item);
  free(study->common.item);
  free(study->settings);
  free(study->runs);
  free(study->scene_path);
  free(study->path);
  tal_tree_clear(&study->tree);
  *study = (tal_study){0};
}
