// The study without its processes: metrics against columns with a closed form, statistics on drawn samples, the
// frontier, correlations, the plan, messages, and merging of run folders written here.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "files.h"
#include "json.h"
#include "scene_files.h"
#include "study_merge.h"
#include "study_metrics.h"

#include <float.h>
#include <ftw.h>
#include <gsl/gsl_randist.h>
#include <math.h>
#include <sys/stat.h>

#define assert_near(a, b, tolerance)                                                                                   \
  do {                                                                                                                 \
    const double a_ = (a), b_ = (b);                                                                                   \
    if (!(fabs(a_ - b_) <= (tolerance)))                                                                               \
      fail_msg("%s = %.17g, expected %.17g +- %g", #a, a_, b_, (double)(tolerance));                                   \
  } while (0)

// ---- metrics of series ----

enum { CONFINED = 5 };

// Rows of a confinement with strain 0 and wild values, then `rows` of a compression up to strain 0.1.
static tal_table make_series(size_t rows, double (*f)(double)) {
  static const char *const names[] = {"time", "axial_strain", "stress_ratio"};
  tal_table t = {.rows = CONFINED + rows, .columns = 3};
  t.name = tal_alloc(3, sizeof *t.name);
  t.value = tal_alloc(3 * t.rows, sizeof *t.value);
  for (size_t k = 0; k < 3; k++)
    t.name[k] = tal_strdup(names[k]);
  for (size_t r = 0; r < t.rows; r++) {
    const double strain = r < CONFINED ? 0 : 0.1 * (double)(r - CONFINED) / (double)(rows - 1);
    t.value[r] = (double)r;
    t.value[t.rows + r] = strain;
    t.value[2 * t.rows + r] = r < CONFINED ? 1e9 : f(strain);
  }
  return t;
}

// What the metric takes at `a` (a value) or from a to b; NAN when it is refused.
static double metric_along(const tal_table *series, tal_study_take take, bool time, double a, double b) {
  char column[] = "stress_ratio";
  double value;
  tal_error why;
  const tal_study_metric metric = {.column = column, .take = take, .along_time = time, .at = a, .from = a, .to = b};
  if (tal_metric_of_series(&metric, series, &value, &why) == TAL_OK)
    return value;
  assert_true(isnan(value));
  return (double)NAN;
}

static double metric_of(const tal_table *series, tal_study_take take, double a, double b) {
  return metric_along(series, take, false, a, b);
}

static const double none = (double)NAN;

static double line(double s) {
  return 1 + 20 * s;
}

// 1 at both ends, 2 in the middle of [0, 0.1].
static double hill(double s) {
  return 2 - fabs(s - 0.05) / 0.05;
}

static double wave(double s) {
  return sin(40 * s);
}

// ROUND: straight columns give their value and mean anywhere, between rows too; rows of the confinement do not count.
static void test_straight_columns(void **state) {
  (void)state;
  tal_table t = make_series(21, line);
  assert_near(metric_of(&t, TAL_TAKE_VALUE, 0.05, none), 2, 4 * DBL_EPSILON);
  assert_near(metric_of(&t, TAL_TAKE_VALUE, 0.0123, none), line(0.0123), 4 * DBL_EPSILON);
  assert_near(metric_of(&t, TAL_TAKE_VALUE, 0, none), 1, 0);
  assert_near(metric_of(&t, TAL_TAKE_MEAN, 0.0123, 0.0777), line(0.045), 8 * DBL_EPSILON);
  assert_near(metric_of(&t, TAL_TAKE_MEAN, 0.0301, 0.0302), line(0.03015), 64 * DBL_EPSILON);
  assert_near(metric_along(&t, TAL_TAKE_VALUE, true, CONFINED + 2.5, none), line(0.0125), 4 * DBL_EPSILON);
  tal_table_clear(&t);
}

// EXACT: peak and trough of a hill whose top is a row, whole and in a window, and where they stand.
static void test_peaks(void **state) {
  (void)state;
  tal_table t = make_series(21, hill);
  assert_true(metric_of(&t, TAL_TAKE_PEAK, none, none) == hill(t.value[t.rows + CONFINED + 10]));
  assert_true(metric_of(&t, TAL_TAKE_PEAK_AT, none, none) == t.value[t.rows + CONFINED + 10]);
  assert_true(metric_of(&t, TAL_TAKE_TROUGH_AT, none, none) == 0);
  assert_true(metric_of(&t, TAL_TAKE_TROUGH, none, none) == 1);
  assert_true(metric_of(&t, TAL_TAKE_PEAK_AT, 0.072, none) == t.value[t.rows + CONFINED + 15]);
  assert_true(metric_of(&t, TAL_TAKE_TROUGH_AT, 0.01, 0.09) == t.value[t.rows + CONFINED + 2]);
  // ROUND: and the mean of the hill is 1.5.
  assert_near(metric_of(&t, TAL_TAKE_MEAN, 0, 0.1), 1.5, 16 * DBL_EPSILON);
  tal_table_clear(&t);
}

// ORDER: the mean of a smooth column converges with the square of the distance of the rows.
static void test_mean_order(void **state) {
  (void)state;
  const double from = 0.013, to = 0.083, exact = (cos(40 * from) - cos(40 * to)) / (40 * (to - from));
  double first = 0, last = 0;
  for (int level = 0; level < 5; level++) {
    tal_table t = make_series((size_t)(50 << level) + 1, wave);
    last = fabs(metric_of(&t, TAL_TAKE_MEAN, from, to) - exact);
    first = level ? first : last;
    tal_table_clear(&t);
  }
  assert_near(log2(first / last) / 4, 2, 0.2);
}

// EXACT: what the table does not hold is refused: beyond its end, nan, another column; a thousandth short is its end.
static void test_metric_refusals(void **state) {
  (void)state;
  tal_table t = make_series(21, line);
  assert_true(isnan(metric_of(&t, TAL_TAKE_VALUE, 0.11, none)));
  assert_true(isnan(metric_of(&t, TAL_TAKE_MEAN, 0.05, 0.2)));
  assert_true(metric_of(&t, TAL_TAKE_VALUE, 0.10005, none) == line(t.value[2 * t.rows - 1]));
  t.value[2 * t.rows + CONFINED + 10] = (double)NAN;
  assert_true(isnan(metric_of(&t, TAL_TAKE_MEAN, 0.04, 0.06)));
  assert_near(metric_of(&t, TAL_TAKE_MEAN, 0.06, 0.08), line(0.07), 8 * DBL_EPSILON);
  free(t.name[2]);
  t.name[2] = tal_strdup("other");
  assert_true(isnan(metric_of(&t, TAL_TAKE_PEAK, none, none)));
  tal_table_clear(&t);
}

// ---- statistics ----

// ROUND: mean and standard error of three numbers; Student's quantile of printed tables (t 0.975, 7) = 2.364624252.
static void test_small_samples(void **state) {
  (void)state;
  const double three[] = {1, 2, 4};
  const tal_estimate e = tal_estimate_of(three, 3);
  assert_near(e.mean, 7.0 / 3, 4 * DBL_EPSILON);
  assert_near(e.error, sqrt(7.0 / 9), 4 * DBL_EPSILON);
  assert_true(isnan(tal_estimate_of(three, 1).error) && isnan(tal_estimate_of(three, 0).mean));
  assert_near(tal_student(0.95, 7), 2.364624252, 5e-10);
  assert_near(tal_student(0.99, 3), 5.840909310, 5e-9);
  assert_true(isnan(tal_student(0.95, 0)));
  double five[] = {5, 1, 4, 2, 3}, two[] = {1, 2};
  assert_true(tal_median(five, 5) == 3 && tal_median(two, 2) == 1.5 && isnan(tal_median(two, 0)));
}

// ROUND: pairs are the seeds that both have: differences 1, 3 at seeds 3 and 5. Without two of them: difference of
// means with Welch's degrees of freedom.
static void test_pairing(void **state) {
  (void)state;
  const int64_t a_seed[] = {1, 3, 5, 9}, b_seed[] = {3, 5, 7}, c_seed[] = {2, 4, 6};
  const double a[] = {100, 11, 23, -50}, b[] = {10, 20, 1e6}, c[] = {1, 2, 6};
  tal_difference d = tal_difference_of((tal_samples){a_seed, a, 4}, (tal_samples){b_seed, b, 3}, 0.95);
  assert_true(d.paired && d.n == 2 && d.freedom == 1);
  assert_near(d.mean, 2, 0);
  assert_near(d.error, 1, 4 * DBL_EPSILON);
  assert_near(d.bound, 2 + 12.7062047362, 1e-9);
  d = tal_difference_of((tal_samples){c_seed, c, 3}, (tal_samples){b_seed, b, 2}, 0.95);
  assert_true(!d.paired && d.n == 2);
  assert_near(d.mean, -12, 4 * DBL_EPSILON);
  const double va = 7.0 / 3, vb = 25;
  assert_near(d.error, sqrt(va + vb), 16 * DBL_EPSILON);
  assert_near(d.freedom, (va + vb) * (va + vb) / (va * va / 2 + vb * vb), 1e-12);
  d = tal_difference_of((tal_samples){a_seed, a, 1}, (tal_samples){a_seed, b, 1}, 0.95);
  assert_true(d.mean == 90 && isnan(d.error) && isnan(d.bound));
  d = tal_difference_of((tal_samples){a_seed, a, 0}, (tal_samples){a_seed, b, 3}, 0.95);
  assert_true(isnan(d.mean) && isnan(d.bound));
}

// MODEL: normal samples of known bias: the interval mean +- half holds the bias in 95 % of 4000 studies (paired, where
// the sample's own scatter is ten times the noise, and of independent samples of different width), within 3 s.e.
static void test_coverage(void **state) {
  (void)state;
  enum { STUDIES = 4000, SEEDS = 6 };
  gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
  const int64_t seed[] = {1, 2, 3, 4, 5, 6}, other[] = {7, 8, 9, 10, 11, 12};
  for (int paired = 0; paired < 2; paired++) {
    int held = 0;
    for (int study = 0; study < STUDIES; study++) {
      double a[SEEDS], b[SEEDS];
      for (int k = 0; k < SEEDS; k++) {
        const double sample = paired ? 10 * gsl_ran_gaussian(rng, 1) : 0;
        a[k] = sample + 0.7 + gsl_ran_gaussian(rng, 1);
        b[k] = sample + gsl_ran_gaussian(rng, paired ? 1 : 2);
      }
      const tal_difference d =
          tal_difference_of((tal_samples){seed, a, SEEDS}, (tal_samples){paired ? seed : other, b, SEEDS}, 0.95);
      assert_true(d.paired == (paired != 0));
      held += fabs(d.mean - 0.7) <= d.half;
    }
    assert_near((double)held / STUDIES, 0.95, 3 * sqrt(0.95 * 0.05 / STUDIES));
  }
  gsl_rng_free(rng);
}

// EXACT: the frontier of a constructed set: dominated, equal, tied and meaningless points.
static void test_frontier(void **state) {
  (void)state;
  const double cost[] = {1, 2, 3, 4, 2, 5, (double)NAN, 1, 6};
  const double off[] = {9, 5, 6, 1, 5, 1, 0, 9.5, (double)NAN};
  const bool expected[] = {true, true, false, true, true, false, false, false, false};
  bool on[9];
  tal_frontier(cost, off, 9, on);
  for (int k = 0; k < 9; k++)
    assert_int_equal(on[k], expected[k]);
}

// ---- correlation of fluctuations ----

enum { POINTS = 400 };

typedef struct field {
  double x[POINTS], y[POINTS], dx[POINTS], dy[POINTS];
  int64_t id[POINTS];
} field;

static void draw_field(field *f, gsl_rng *rng) {
  for (int k = 0; k < POINTS; k++) {
    f->x[k] = 0.02 * gsl_rng_uniform(rng);
    f->y[k] = 5 + 0.04 * gsl_rng_uniform(rng); // far from the origin
    f->dx[k] = gsl_ran_gaussian(rng, 1e-6);
    f->dy[k] = gsl_ran_gaussian(rng, 1e-6);
    f->id[k] = k;
  }
}

static tal_fluctuation whole(field *f) {
  return (tal_fluctuation){.count = POINTS, .id = f->id, .u = f->dx, .v = f->dy};
}

// ROUND: an affine field leaves nothing; added to another it changes nothing. EXACT: a field with itself gives 1, with
// its opposite -1, and grains that one of two fields lacks do not count.
static void test_fluctuations(void **state) {
  (void)state;
  gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
  field a, b;
  draw_field(&a, rng);
  b = a;
  for (int k = 0; k < POINTS; k++) {
    b.dx[k] += 3e-4 + 0.02 * a.x[k] - 0.01 * a.y[k];
    b.dy[k] += -1e-4 - 0.05 * a.y[k] + 0.03 * a.x[k];
  }
  tal_fluctuation_of(a.x, a.y, a.dx, a.dy, POINTS);
  tal_fluctuation_of(b.x, b.y, b.dx, b.dy, POINTS);
  for (int k = 0; k < POINTS; k++) {
    assert_near(b.dx[k], a.dx[k], 1e-14);
    assert_near(b.dy[k], a.dy[k], 1e-14);
  }
  tal_fluctuation f = whole(&a), g = whole(&b);
  assert_true(tal_fluctuation_correlation(&f, &f) == 1);
  assert_near(tal_fluctuation_correlation(&f, &g), 1, 1e-8);
  for (int k = 0; k < POINTS; k++)
    b.dx[k] = -a.dx[k], b.dy[k] = -a.dy[k];
  assert_true(tal_fluctuation_correlation(&f, &g) == -1);
  b.dx[7] = 1e9;
  b.id[7] = 10000; // nobody in a, and out of order from there on: end the field before it
  g.count = 7;
  assert_true(tal_fluctuation_correlation(&f, &g) == -1);
  g.count = 0;
  assert_true(isnan(tal_fluctuation_correlation(&f, &g)));
  gsl_rng_free(rng);
}

// MODEL: independent fields correlate to 0 in the mean of 200 draws, within 3 s.e., and no more than 1 / sqrt(2 N) in
// scatter, within 15 %.
static void test_independent_fields(void **state) {
  (void)state;
  enum { DRAWS = 200 };
  gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
  double value[DRAWS];
  for (int k = 0; k < DRAWS; k++) {
    field a, b;
    draw_field(&a, rng);
    draw_field(&b, rng);
    tal_fluctuation_of(a.x, a.y, a.dx, a.dy, POINTS);
    tal_fluctuation_of(b.x, b.y, b.dx, b.dy, POINTS);
    const tal_fluctuation f = whole(&a), g = whole(&b);
    value[k] = tal_fluctuation_correlation(&f, &g);
  }
  const tal_estimate e = tal_estimate_of(value, DRAWS);
  assert_near(e.mean, 0, 3 * e.error);
  assert_near(e.error * sqrt(DRAWS) * sqrt(2 * POINTS), 1, 0.15);
  gsl_rng_free(rng);
}

// ---- a study on disk ----

static const char base_scene[] = "name: base\n"
                                 "grains: {count: 50, radius: {law: uniform, min: 0.5e-3, max: 1e-3}}\n"
                                 "material: {young: 30e9, density: 2675, friction: 0.4, damping: 0.002}\n"
                                 "mass_scaling: 1e5\n"
                                 "pack: {method: drop_and_roll, width: 9e-3}\n"
                                 "integrator: {dt: 1e-5}\n"
                                 "stages:\n"
                                 "  - {kind: confine, pressure: 100e3, ramp: 0.5}\n"
                                 "  - {kind: compress, rate: 1e-2, strain: 0.1}\n";

static const char study_text[] = "name: closed\n"                                                              // 1
                                 "scene: s.yaml\n"                                                             // 2
                                 "set: {stages.0.ramp: 0.25, output: {series_every: 0.1}}\n"                   // 3
                                 "dials:\n"                                                                    // 4
                                 "  - {key: stages.1.integrator.dt, values: [8e-6, 4e-6, 1e-6]}\n"             // 5
                                 "seeds: 3\n"                                                                  // 6
                                 "reference: 1.0e-6\n"                                                         // 7
                                 "metrics:\n"                                                                  // 8
                                 "  - {take: mean, column: stress_ratio, from: 0.02, to: 0.08, within: 10%}\n" // 9
                                 "  - {take: value, column: mean_slip, at: 0.1, within: 0.5}\n"                // 10
                                 "cost_stages: [1]\n";                                                         // 11

typedef struct folder {
  scene_folder at; // s.yaml in it
  char study[440], out[440];
} folder;

static void write_text(const char *path, const char *text) {
  FILE *file = fopen(path, "w");
  assert_non_null(file);
  fputs(text, file);
  assert_int_equal(fclose(file), 0);
}

static int folder_begin(void **state) {
  folder *f = calloc(1, sizeof *f);
  f->at = scene_folder_create();
  snprintf(f->study, sizeof f->study, "%s/study.yaml", f->at.path);
  snprintf(f->out, sizeof f->out, "%s/out", f->at.path);
  write_text(f->at.file, base_scene);
  write_text(f->study, study_text);
  *state = f;
  return 0;
}

static int remove_entry(const char *path, const struct stat *info, int type, struct FTW *walk) {
  (void)info, (void)type, (void)walk;
  return remove(path);
}

static int folder_end(void **state) {
  folder *f = *state;
  nftw(f->at.path, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
  free(f);
  return 0;
}

#define folder_test(function) cmocka_unit_test_setup_teardown(function, folder_begin, folder_end)

static void load(tal_study *study, const folder *f) {
  tal_scene_errors errors;
  if (tal_study_load(study, f->study, NULL, 0, &errors) != TAL_OK)
    fail_msg("%s", errors.item[0].text);
}

static char *read_text(const char *dir, const char *name) {
  char path[TAL_PATH_SIZE];
  unsigned char *bytes;
  size_t size;
  tal_error err;
  tal_file_path(path, dir, name);
  if (tal_file_read(path, &bytes, &size, &err) != TAL_OK)
    fail_msg("%s", err.text);
  bytes = tal_grow(bytes, size, size + 1, 1);
  return (char *)bytes;
}

// The scene's text of a run, by the words of its command.
static char *scene_text_of(const tal_study *study, size_t r, const char *dir) {
  char **words = tal_study_words(study, &study->runs[r], dir);
  const char *sets[16];
  size_t count = 0;
  for (size_t k = 0; words[k]; k++)
    if (strcmp(words[k], "--set") == 0)
      sets[count++] = words[k + 1];
  tal_scene scene;
  tal_scene_errors errors;
  assert_int_equal(tal_scene_load(&scene, words[1], sets, count, &errors), TAL_OK);
  char *text = tal_scene_text(&scene);
  assert_true(scene.seed == (uint64_t)study->runs[r].seed);
  tal_scene_clear(&scene);
  tal_study_words_free(words);
  return text;
}

// EXACT: the plan: settings by seeds in order, ids, the scene each line names, the same bytes when made again.
static void test_plan(void **state) {
  const folder *f = *state;
  tal_study study;
  tal_error err;
  load(&study, f);
  assert_int_equal(study.run_count, 9);
  assert_int_equal(study.reference_setting, 2);
  assert_string_equal(study.runs[0].id, "dt-8e-6_s1");
  assert_string_equal(study.runs[8].id, "dt-1e-6_s3");
  assert_string_equal(study.metrics[0].name, "stress_ratio_mean_0.02_0.08");
  assert_string_equal(study.metrics[1].name, "mean_slip_at_0.1");
  for (size_t r = 0; r < 9; r++) {
    char *text = scene_text_of(&study, r, f->out);
    assert_true(tal_hash(text, strlen(text)) == study.runs[r].scene);
    assert_non_null(strstr(text, "ramp: 0.25"));
    assert_non_null(strstr(text, "series_every: 0.1\n"));
    free(text);
  }
  // --set goes over what the file sets.
  const char *const ramp[] = {"stages.0.ramp=0.125"};
  tal_study changed;
  tal_scene_errors errors;
  assert_int_equal(tal_study_load(&changed, f->study, ramp, 1, &errors), TAL_OK);
  char *text = scene_text_of(&changed, 4, f->out);
  assert_non_null(strstr(text, "ramp: 0.125\n"));
  free(text);
  tal_study_clear(&changed);
  // 0.25 s at 1e-5 s, then 10 s at 8e-6 s.
  assert_near(study.runs[0].steps, 0.25 / 1e-5 + 10 / 8e-6, 1e-6);
  assert_int_equal(tal_study_plan_write(&study, f->out, &err), TAL_OK);
  char *plan = read_text(f->out, "plan.csv"), *commands = read_text(f->out, "commands.txt");
  assert_non_null(strstr(commands, "/out/runs/dt-4e-6_s2 -t 1 -q --no-figures --set stages.0.ramp=0.25 --set "
                                   "output.series_every=0.1 --set stages.1.integrator.dt=4e-6 --set seed=2\n"));
  tal_study_clear(&study);
  load(&study, f);
  assert_int_equal(tal_study_plan_write(&study, f->out, &err), TAL_OK);
  char *again = read_text(f->out, "plan.csv");
  assert_string_equal(plan, again);
  free(plan);
  free(again);
  free(commands);
  tal_study_clear(&study);
}

// EXACT: a plan may grow by seeds and values; with another scene in a run that it has it is refused, and stays.
static void test_changed_plan(void **state) {
  const folder *f = *state;
  tal_study study;
  tal_error err;
  load(&study, f);
  assert_int_equal(tal_study_plan_write(&study, f->out, &err), TAL_OK);
  tal_study_clear(&study);
  tal_scene_errors errors;
  const char *const more[] = {"seeds=5", "dials.0.values=[8e-6, 4e-6, 2e-6, 1e-6]"};
  assert_int_equal(tal_study_load(&study, f->study, more, 2, &errors), TAL_OK);
  assert_int_equal(study.run_count, 20);
  assert_int_equal(tal_study_plan_write(&study, f->out, &err), TAL_OK);
  tal_study_clear(&study);
  char *before = read_text(f->out, "plan.csv");
  const char *const other[] = {"material.friction=0.3"};
  assert_int_equal(tal_study_load(&study, f->study, other, 1, &errors), TAL_OK);
  assert_int_equal(tal_study_plan_write(&study, f->out, &err), TAL_BAD_INPUT);
  assert_non_null(strstr(err.text, "plan.csv: run dt-8e-6_s1 was planned with another scene"));
  char *after = read_text(f->out, "plan.csv");
  assert_string_equal(before, after);
  free(before);
  free(after);
  tal_study_clear(&study);
}

// EXACT: two dials make a grid; groups of keys, keys that share a value, an own reference with seeds of its own.
static void test_grid(void **state) {
  const folder *f = *state;
  write_text(f->study, "scene: s.yaml\n"
                       "dials:\n"
                       "  - name: integrator\n"
                       "    values:\n"
                       "      - {label: I, set: {integrator.dt: 2e-5}}\n"
                       "      - {label: 'ours, 5e-5', set: {integrator: {scheme: implicit_friction, dt: 5e-5}}}\n"
                       "  - {name: ramps, keys: [stages.0.ramp, stages.0.timeout], values: [1.5, 2.5]}\n"
                       "seeds: [4, 2]\n"
                       "reference: {set: {integrator.dt: 1e-6}, label: III, seeds: 3}\n"
                       "metrics: [{take: correlation}]\n");
  tal_study study;
  load(&study, f);
  assert_int_equal(study.setting_count, 5);
  assert_int_equal(study.reference_setting, 4);
  assert_int_equal(study.run_count, 4 * 2 + 3);
  assert_string_equal(study.runs[0].id, "integrator-I_ramps-1.5_s2");
  assert_string_equal(study.runs[5].id, "integrator-ours-5e-5_ramps-1.5_s4");
  assert_string_equal(study.settings[3].label, "ours, 5e-5, ramps=2.5");
  assert_string_equal(study.runs[10].id, "reference-III_s3");
  char *text = scene_text_of(&study, 7, f->out);
  assert_non_null(strstr(text, "scheme: implicit_friction"));
  assert_non_null(strstr(text, "ramp: 2.5\n"));
  assert_non_null(strstr(text, "timeout: 2.5"));
  free(text);
  tal_study_clear(&study);
}

// EXACT: messages name file, line and key, or the option; nothing is left behind in memory or on disk.
static void test_messages(void **state) {
  static const struct {
    const char *from, *to, *says;
  } wrong[] = {
      {"integrator.dt", "integrator.dtt", "study.yaml:5: stages[1].integrator.dtt: unknown key; did you mean 'dt'?"},
      {"[8e-6, 4e-6, 1e-6]", "[8e-6, 4us, 1e-6]", "study.yaml:5: stages[1].integrator.dt: '4us' is not a number"},
      {"[8e-6, 4e-6, 1e-6]", "[1e-6]", "study.yaml:5: dials[0].values: has too few values to compare"},
      {"4e-6", "8e-6", "study.yaml:5: dials[0].values[1]: '8e-6' is there already"},
      {"stages.1.integrator.dt", "seed", "study.yaml:5: dials[0].key: is no dial"},
      {"key: stages.1.integrator.dt, ", "", "study.yaml:5: dials[0].values[0]: names no key"},
      {"seeds: 3", "seeds: 0", "study.yaml:6: seeds: gives no seeds"},
      {"seeds: 3", "seeds: []", "study.yaml:6: seeds: gives no seeds"},
      {"seeds: 3", "seeds: [1, 1]", "study.yaml:6: seeds: holds what is no seed, or one twice"},
      {"seeds: 3\n", "", "study.yaml:1: seeds: is missing"},
      {"reference: 1.0e-6", "reference: 2e-6",
       "study.yaml:7: reference: 2e-6 is not among the values of dial 'dt'; accepted: 8e-6, 4e-6, 1e-6"},
      {"reference: 1.0e-6\n", "", "study.yaml:1: reference: is missing"},
      {"column: mean_slip", "column: mean_slop",
       "metrics[1].column: 'mean_slop' is no column; did you mean 'mean_slip'"},
      {"take: value", "take: valu", "study.yaml:10: metrics[1].take: 'valu' is not known"},
      {"take: value, ", "", "study.yaml:10: metrics[1].take: is missing"},
      {"at: 0.1", "at: 0.2", "metrics[1].at: 0.2 is beyond the strain of the scene's stages, 0.1"},
      {"to: 0.08", "to: 0.01", "metrics[0].to: 0.01 is not beyond from 0.02"},
      {"within: 10%", "within: ten", "study.yaml:9: metrics[0].within: is no error"},
      {"scene: s.yaml", "scene: t.yaml", "/t.yaml' cannot be read; accepted: a scene file"},
      {"cost_stages: [1]", "cost_stages: [2]", "study.yaml:11: cost_stages: 2 is no stage"},
      {"stages.0.ramp: 0.25", "stages.0.rump: 0.25", "study.yaml:3: stages[0].rump: unknown key"},
      {"name: closed", "nom: closed", "study.yaml:1: nom: unknown key; did you mean 'name'?"},
  };
  const folder *f = *state;
  for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
    char text[sizeof study_text + 200];
    const char *at = strstr(study_text, wrong[k].from);
    assert_non_null(at);
    snprintf(text, sizeof text, "%.*s%s%s", (int)(at - study_text), study_text, wrong[k].to,
             at + strlen(wrong[k].from));
    write_text(f->study, text);
    tal_study study;
    tal_scene_errors errors;
    assert_int_equal(tal_study_load(&study, f->study, NULL, 0, &errors), TAL_BAD_INPUT);
    if (!strstr(errors.item[0].text, wrong[k].says) || errors.count > 3)
      fail_msg("expected '%s', got %zu: %s", wrong[k].says, errors.count, errors.item[0].text);
  }
  write_text(f->study, study_text);
  const char *const options[] = {"seeds=none", "stages.4.rate=1", "stages.1.rate=fast", "stages.1.integrator.dt=1"};
  const char *const says[] = {"--set seeds=none: seeds: gives no seeds", "--set stages.4.rate=1: stages: has 2 items",
                              "--set stages.1.rate=fast: stages[1].rate: 'fast' is not a number",
                              "--set stages.1.integrator.dt=1: a dial turns this key"};
  for (size_t k = 0; k < 4; k++) {
    tal_study study;
    tal_scene_errors errors;
    assert_int_equal(tal_study_load(&study, f->study, options + k, 1, &errors), TAL_BAD_INPUT);
    if (strncmp(errors.item[0].text, says[k], strlen(says[k])) != 0)
      fail_msg("expected '%s', got %s", says[k], errors.item[0].text);
  }
}

// ---- merging ----

// A finished run: stress ratio 2 + its seed's share + bias throughout, slip rising to its end; cost in stage 1.
static void write_run(const tal_study *study, size_t r, const char *dir, const char *status, double bias) {
  char folder_name[TAL_PATH_SIZE], path[TAL_PATH_SIZE + 16], *text = NULL;
  size_t size;
  const double seed = (double)study->runs[r].seed;
  tal_error err;
  tal_study_folder(folder_name, sizeof folder_name, dir, &study->runs[r]);
  assert_int_equal(tal_folder_create(folder_name, &err), TAL_OK);
  tal_json json = {.out = open_memstream(&text, &size)};
  char *scene = scene_text_of(study, r, dir);
  tal_json_open(&json, NULL, '{');
  tal_json_text(&json, "status", status);
  tal_json_text(&json, "reason", "grain 7 is lost");
  tal_json_integer(&json, "grains", 50);
  tal_json_number(&json, "time", 1.5);
  tal_json_open(&json, "stages", '[');
  for (int k = 0; k < 2; k++) {
    tal_json_open(&json, NULL, '{');
    tal_json_integer(&json, "steps", k ? 1000 : 7);
    tal_json_number(&json, "cpu_time", k ? seed / (1 + 10 * bias) : 1000);
    tal_json_close(&json, '}');
  }
  tal_json_close(&json, ']');
  tal_json_text(&json, "scene_text", scene);
  tal_json_close(&json, '}');
  fclose(json.out);
  snprintf(path, sizeof path, "%s/run.json", folder_name);
  write_text(path, text);
  free(text);
  free(scene);
  snprintf(path, sizeof path, "%s/series.csv", folder_name);
  FILE *series = fopen(path, "w");
  fputs("time[s],axial_strain,stress_ratio,mean_slip\n", series);
  for (int k = 0; k <= 10; k++)
    fprintf(series, "%d,%.17g,%.17g,%.17g\n", k, 0.01 * k, 2 + 0.25 * seed + bias, k * seed / 10);
  fclose(series);
}

static const double biases[] = {0.5, 0.125, 0};

// EXACT: run folders written here: the paired difference is the bias though seeds scatter more, costs are those of the
// stage that counts, the cheapest setting within 10 % is the one in the middle.
static void test_merge(void **state) {
  const folder *f = *state;
  tal_study study;
  tal_study_summary s;
  tal_error err;
  load(&study, f);
  for (size_t r = 0; r < study.run_count; r++)
    write_run(&study, r, f->out, "done", biases[study.runs[r].setting]);
  tal_study_summary_read(&s, &study, f->out);
  assert_int_equal(s.done, 9);
  for (size_t k = 0; k < 3; k++) {
    const tal_study_cell *ratio = tal_study_cell_of(&s, k, 0), *slip = tal_study_cell_of(&s, k, 1);
    assert_near(ratio->estimate.mean, 2.5 + biases[k], 1e-14);
    assert_near(ratio->estimate.error, 0.25 / sqrt(3), 1e-14);
    assert_near(ratio->difference.mean, biases[k], 1e-14);
    assert_near(ratio->difference.bound, biases[k], 1e-13);
    assert_near(slip->estimate.mean, 2, 1e-14);
    assert_true(slip->difference.mean == 0);
    assert_near(s.lines[k].cpu_time, 2 / (1 + 10 * biases[k]), 1e-15);
    assert_true(s.lines[k].grain_steps == 50 * 1000);
    assert_true(ratio->frontier && slip->frontier == (k == 0));
  }
  assert_near(tal_study_limit(&s, 0), 0.25, 1e-14);
  char *sentence = tal_study_sentence(&s);
  assert_non_null(strstr(sentence,
                         "Cheapest setting shown to be within 10 % in stress_ratio_mean_0.02_0.08, 0.5 in "
                         "mean_slip_at_0.1 of the reference: dt=4e-6, 0.889 CPU s a run, 2.25 times cheaper"));
  assert_non_null(strstr(sentence, "3 seeds exclude (Student's t, 95 %) a bias beyond 5 % in stress_ratio"));
  free(sentence);
  assert_int_equal(tal_study_tables_write(&s, &err), TAL_OK);
  char *runs = read_text(f->out, "runs.csv"), *table = read_text(f->out, "study.csv");
  assert_non_null(strstr(runs, "\ndt-4e-6_s2,dt=4e-6,4e-6,2,done,0.8888888888888888,50000,2.62"));
  assert_non_null(strstr(table, "\ndt=1e-6,1e-6,mean_slip_at_0.1,yes,3,2,"));
  free(runs);
  free(table);
  tal_study_summary_clear(&s);
  tal_study_clear(&study);
}

// EXACT: a missing, a failed, an unfinished run and one of another scene are named and lose nothing of the others.
static void test_merge_with_losses(void **state) {
  const folder *f = *state;
  tal_study study;
  tal_study_summary s;
  tal_error err;
  load(&study, f);
  for (size_t r = 0; r < study.run_count; r++)
    if (r != 0) // seed 1 of 8e-6 is missing
      write_run(&study, r, f->out, r == 1 ? "invalid" : r == 3 ? "interrupted" : "done", biases[study.runs[r].setting]);
  char path[TAL_PATH_SIZE];
  tal_file_path(path, f->out, "runs/dt-4e-6_s2/run.json");
  write_text(path, "{\"status\": \"done\", \"scene_text\": \"another\"}");
  tal_study_summary_read(&s, &study, f->out);
  assert_int_equal(s.done, 5);
  assert_int_equal(s.failed, 2);
  assert_int_equal(s.unfinished, 2);
  assert_string_equal(s.results[0].state.reason, "not begun");
  assert_string_equal(s.results[1].state.reason, "grain 7 is lost");
  assert_string_equal(s.results[3].state.reason, "unfinished at t = 1.5 s");
  assert_string_equal(s.results[4].state.reason, "the folder holds a run of another scene");
  const tal_study_cell *one = tal_study_cell_of(&s, 0, 0);
  assert_true(one->estimate.n == 1 && isnan(one->estimate.error));
  assert_near(one->difference.mean, 0.5, 1e-14);
  assert_true(isnan(one->difference.bound));
  assert_int_equal(tal_study_cell_of(&s, 2, 0)->estimate.n, 3);
  char *report = tal_study_report(&s);
  assert_non_null(strstr(report, "closed: 5 of 9 runs done, 2 failed, 2 unfinished or missing"));
  assert_non_null(strstr(report, "failed     dt-8e-6_s2: grain 7 is lost"));
  assert_non_null(strstr(report, "; one seed excludes no bias"));
  free(report);
  assert_int_equal(tal_study_tables_write(&s, &err), TAL_OK);
  char *runs = read_text(f->out, "runs.csv");
  assert_non_null(strstr(runs, "\ndt-8e-6_s1,dt=8e-6,8e-6,1,missing,nan,nan,nan,nan,not begun\n"));
  free(runs);
  tal_study_summary_clear(&s);
  tal_study_clear(&study);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_straight_columns),
      cmocka_unit_test(test_peaks),
      cmocka_unit_test(test_mean_order),
      cmocka_unit_test(test_metric_refusals),
      cmocka_unit_test(test_small_samples),
      cmocka_unit_test(test_pairing),
      cmocka_unit_test(test_coverage),
      cmocka_unit_test(test_frontier),
      cmocka_unit_test(test_fluctuations),
      cmocka_unit_test(test_independent_fields),
      folder_test(test_plan),
      folder_test(test_changed_plan),
      folder_test(test_grid),
      folder_test(test_messages),
      folder_test(test_merge),
      folder_test(test_merge_with_losses),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
