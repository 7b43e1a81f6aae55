// A study: one scene, one or two dials turned, several seeds, one reference; error against cost. STUDY.yaml becomes a
// plan of ordinary runs (study_read.c, study_plan.c); they are run, each on one thread, as many at a time as there are
// cores (study_run.c); what they left is merged into tables, figures and a sentence (study_merge.c and on). Every step
// reads only files, so any of them can be done elsewhere and later.
#ifndef TAL_STUDY_H
#define TAL_STUDY_H

#include "scene.h"
#include "scene_yaml.h"

// What a metric takes from a column of series.csv, or from the fields.
typedef enum tal_study_take {
  TAL_TAKE_VALUE,
  TAL_TAKE_MEAN,
  TAL_TAKE_PEAK,
  TAL_TAKE_TROUGH,
  TAL_TAKE_PEAK_AT,
  TAL_TAKE_TROUGH_AT,
  TAL_TAKE_CORRELATION
} tal_study_take;

typedef struct tal_study_metric {
  char *name;   // owned
  char *column; // owned; NULL for a correlation
  tal_study_take take;
  bool along_time;     // at, from, to are times [s], else axial strains
  double at, from, to; // NAN: not given
  double within;       // error looked for, NAN: none
  bool relative;       // within is a share of the reference's mean
  int line;            // in the study file
} tal_study_metric;

// One key changed, as --set takes it. Texts live in the study's tree.
typedef struct tal_study_set {
  const char *text; // KEY=VALUE
  int line;         // in the study file
  bool option;      // from --set
} tal_study_set;

typedef struct tal_study_sets {
  size_t count;
  tal_study_set *item; // owned
} tal_study_sets;

typedef struct tal_study_value {
  const char *label;    // the value as written, or the label given
  const tal_node *node; // as written
  bool named;           // a group with a label: needs no dial's name before it
  tal_study_sets sets;
} tal_study_value;

typedef struct tal_study_dial {
  char *name, *key; // owned; key NULL: every value is a group of keys
  size_t count;
  tal_study_value *value; // owned; [count]
} tal_study_dial;

typedef struct tal_study_seeds {
  size_t count;
  int64_t *seed; // owned; ascending
} tal_study_seeds;

typedef struct tal_study_reference {
  char *label;           // owned; of an own setting
  tal_study_seeds seeds; // count 0: those of the study
  tal_study_sets sets;   // of an own setting
} tal_study_reference;

#define TAL_STUDY_OWN SIZE_MAX // place of a reference that is no dial value

// One point of the study: a value of each dial, or the reference's own setting.
typedef struct tal_study_setting {
  const char *id;      // in names of folders
  const char *label;   // for people
  size_t value[2];     // index into the dials, TAL_STUDY_OWN
  tal_study_sets sets; // of the dials
  const tal_study_seeds *seeds;
} tal_study_setting;

typedef struct tal_study_run {
  const char *id;
  size_t setting;
  int64_t seed;
  uint64_t scene; // XXH3 of the scene as resolved
  double steps;   // nominal small steps: what a scheduler may sort by
} tal_study_run;

typedef struct tal_study {
  tal_tree tree; // owns nodes and texts
  char *path;    // owned; the study file as given
  char *name;    // owned
  char *scene;   // owned; as written
  char *scene_path;
  double confidence;
  int64_t *cost_stages; // owned; stages whose cost counts, all when none
  size_t cost_stage_count;
  tal_study_metric *metrics; // owned
  size_t metric_count;
  tal_study_dial *dials; // owned; one or two
  size_t dial_count;
  tal_study_seeds seeds;
  tal_study_reference reference;
  tal_study_sets common;       // keys changed in every run
  const char *from;            // checkpoint that every run begins from, NULL: none
  tal_study_setting *settings; // owned; the reference's own last
  size_t setting_count;
  size_t reference_setting;
  tal_study_run *runs; // owned; setting by setting, seeds ascending
  size_t run_count;
} tal_study;

// Reads STUDY.yaml, with the overrides of --set (a key of the study goes there, every other to the scene of all runs),
// and makes the plan: the scene of every setting is loaded and checked. TAL_OK (then tal_study_clear) or TAL_BAD_INPUT
// with up to ten messages "FILE:LINE: key: what is wrong, what is accepted"; *study is empty then.
tal_status tal_study_load(tal_study *study, const char *path, const char *const *sets, size_t set_count,
                          tal_scene_errors *errors);
void tal_study_clear(tal_study *study);

// Folder of a run: DIR/runs/ID.
void tal_study_folder(char *path, size_t size, const char *dir, const tal_study_run *run);
// The words after `talus` that make the run, ended by NULL; free with tal_study_words_free.
char **tal_study_words(const tal_study *study, const tal_study_run *run, const char *dir);
void tal_study_words_free(char **words);
// Writes DIR/plan.csv and DIR/commands.txt. TAL_BAD_INPUT, with nothing written, when the plan that is there has a run
// of the same name with another scene; TAL_IO.
tal_status tal_study_plan_write(const tal_study *study, const char *dir, tal_error *err);

typedef struct tal_study_options {
  const char *dir;
  const char *program; // path of talus
  int cores;           // 0: as many as there are
  bool quiet;          // no progress line
} tal_study_options;

// Makes every run that is not finished: new ones, and interrupted ones with --resume. A run that failed keeps none
// from being made. TAL_OK when nothing is left to do, TAL_INTERRUPTED after SIGINT or SIGTERM (children have written
// their checkpoints), TAL_IO.
tal_status tal_study_run_all(const tal_study *study, const tal_study_options *options, tal_error *err);

#endif
