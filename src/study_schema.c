// See study_schema.h. Rows of type TREE are read by study_read.c.
#include "study_schema.h"

#include "scene_value.h"
#include "sim.h"

#include <math.h>
#include <string.h>

#define KEY(word, kind)                .name = word, .type = TAL_KEY_##kind
#define AT(type, member)               .offset = offsetof(type, member), .size = sizeof(((type *)NULL)->member)
#define COUNTED(type, member, counter) AT(type, member), .count_offset = offsetof(type, counter)
#define ANY                            .low = -HUGE_VAL, .high = HUGE_VAL
#define ONLY(values)                   .selector = "take", .only = values

#define OF_COLUMN "value mean peak trough peak_at trough_at"
#define OF_WINDOW "peak trough peak_at trough_at correlation"

static size_t fill(const tal_choice *list, size_t count, tal_choice *out, size_t capacity) {
  for (size_t i = 0; i < count && i < capacity; i++)
    out[i] = list[i];
  return count < capacity ? count : capacity;
}

// In the order of tal_study_take.
static size_t take_choices(tal_choice *out, size_t capacity) {
  static const tal_choice list[] = {
      {"value", "the column at one place"},
      {"mean", "its mean over a window"},
      {"peak", "its largest value"},
      {"trough", "its smallest value"},
      {"peak_at", "where the largest value stands"},
      {"trough_at", "where the smallest value stands"},
      {"correlation", "of displacement fluctuations with those of the reference's run of the same seed"}};
  return fill(list, sizeof list / sizeof *list, out, capacity);
}

static size_t along_choices(tal_choice *out, size_t capacity) {
  static const tal_choice list[] = {{"axial_strain", "strain"}, {"time", "time in s"}};
  return fill(list, sizeof list / sizeof *list, out, capacity);
}

static const tal_key metric_keys[] = {
    {KEY("name", TEXT), .note = "from column and take", AT(tal_study_metric, name), .help = "in tables and file names"},
    {KEY("take", CHOICE), .required = true, .choices = take_choices, AT(tal_study_metric, take),
     .help = "what is taken"},
    {KEY("column", TEXT), ONLY(OF_COLUMN), .required = true, AT(tal_study_metric, column),
     .help = "column of series.csv, without its unit"},
    {KEY("along", CHOICE), .fallback = "axial_strain", .choices = along_choices, AT(tal_study_metric, along_time),
     .help = "what at, from and to count"},
    {KEY("at", REAL), ONLY("value"), .required = true, ANY, AT(tal_study_metric, at), .help = "the place"},
    {KEY("from", REAL), ONLY("mean"), .required = true, ANY, AT(tal_study_metric, from), .help = "begin of the window"},
    {KEY("to", REAL), ONLY("mean"), .required = true, ANY, AT(tal_study_metric, to), .help = "its end"},
    {KEY("from", REAL), ONLY(OF_WINDOW), .note = "where the strain begins", ANY, AT(tal_study_metric, from),
     .help = "begin of the window"},
    {KEY("to", REAL), ONLY(OF_WINDOW), .note = "the last", ANY, AT(tal_study_metric, to), .help = "its end"},
    {KEY("within", TREE), .note = "an error: 0.01, or 5% of the reference", .help = "error that would do"},
    {.name = NULL}};

static const tal_key dial_keys[] = {
    {KEY("name", TEXT), .note = "the last word of its key", AT(tal_study_dial, name), .help = "in tables"},
    {KEY("key", TEXT), .note = "none: values are groups {label:, set:}", AT(tal_study_dial, key),
     .help = "the scene's key"},
    {KEY("keys", TREE), .note = "a list of scene keys that all get the value", .help = "in place of key"},
    {KEY("values", TREE), .required = true, .note = "a list of values or of {label: ..., set: {KEY: VALUE, ...}}",
     .help = "what the dial is turned to"},
    {.name = NULL}};

#define SEEDS "a number of seeds, or a list of them: [1, 2, 3]"

static const tal_key reference_keys[] = {
    {KEY("value", TREE), .note = "one of the dial's values; of two dials a list of two", .help = "the reference"},
    {KEY("set", TREE), .note = "a mapping of scene keys", .help = "or a setting of its own"},
    {KEY("label", TEXT), .note = "reference", AT(tal_study, reference.label), .help = "of an own setting"},
    {KEY("seeds", TREE), .note = SEEDS, .help = "its seeds, where they differ"},
    {.name = NULL}};

static const tal_key study_keys[] = {
    {KEY("name", TEXT), .fallback = "study", AT(tal_study, name), .help = "title"},
    {KEY("scene", TEXT), .required = true, AT(tal_study, scene), .help = "the scene, relative to the study file"},
    {KEY("set", TREE), .note = "a mapping of scene keys", .help = "keys changed in every run"},
    {KEY("dials", LIST), .required = true, .low = 1, .high = 2, COUNTED(tal_study, dials, dial_count),
     .item_size = sizeof(tal_study_dial), .keys = dial_keys, .help = "one or two"},
    {KEY("seeds", TREE), .required = true, .note = SEEDS, .help = "samples"},
    {KEY("reference", GROUP), .offset = 0, .size = sizeof(tal_study), .keys = reference_keys,
     .help = "what errors are counted from"},
    {KEY("metrics", LIST), .required = true, .low = 1, .high = 32, COUNTED(tal_study, metrics, metric_count),
     .item_size = sizeof(tal_study_metric), .keys = metric_keys, .help = "what is compared"},
    {KEY("cost_stages", WHOLES), .note = "all", .high = 10000, COUNTED(tal_study, cost_stages, cost_stage_count),
     .help = "stages whose cost counts"},
    {KEY("confidence", REAL), .fallback = "0.95", .low = 0.5, .low_open = true, .high = 1, .high_open = true,
     AT(tal_study, confidence), .help = "of what is said to be excluded"},
    {.name = NULL}};

const tal_key *tal_study_keys(void) {
  return study_keys;
}

const tal_key *tal_study_dial_keys(void) {
  return dial_keys;
}

const tal_key *tal_study_metric_keys(void) {
  return metric_keys;
}

bool tal_study_column_known(const char *name, const char **near) {
  static const char *const columns[] = {
#define X(column, unit, meaning) #column,
      TAL_SERIES_FIELDS(X)
#undef X
  };
  int best = 4;
  *near = "";
  for (size_t k = 0; k < sizeof columns / sizeof *columns; k++) {
    if (strcmp(columns[k], name) == 0)
      return true;
    const int distance = tal_edit_distance(name, columns[k]);
    if (distance >= best)
      continue;
    best = distance;
    *near = columns[k];
  }
  return false;
}
