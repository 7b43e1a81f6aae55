// See study_merge.h.
#include "study_merge.h"

#include "files.h"
#include "study_metrics.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double *value_of(const tal_study_summary *s, size_t run, size_t metric) {
  return &s->values[run * s->study->metric_count + metric];
}

const tal_study_cell *tal_study_cell_of(const tal_study_summary *summary, size_t setting, size_t metric) {
  return &summary->cells[setting * summary->study->metric_count + metric];
}

double tal_study_limit(const tal_study_summary *summary, size_t metric) {
  const tal_study_metric *m = &summary->study->metrics[metric];
  const double mean = tal_study_cell_of(summary, summary->study->reference_setting, metric)->estimate.mean;
  return m->relative ? m->within * fabs(mean) : m->within;
}

// ---- values per run ----

static void note(tal_study_result *result, const tal_study_metric *metric, const tal_error *why) {
  if (!*result->note)
    snprintf(result->note, sizeof result->note, "%.80s: %.200s", metric->name, why->text);
}

static void read_series(const tal_study_summary *s, size_t r) {
  char folder[TAL_PATH_SIZE], path[TAL_PATH_SIZE + 16];
  tal_table series;
  tal_error why;
  tal_study_folder(folder, sizeof folder, s->dir, &s->study->runs[r]);
  snprintf(path, sizeof path, "%s/series.csv", folder);
  tal_status status = tal_table_read(&series, path, &why);
  for (size_t m = 0; m < s->study->metric_count; m++) {
    const tal_study_metric *metric = &s->study->metrics[m];
    if (metric->take == TAL_TAKE_CORRELATION)
      continue;
    if (status || tal_metric_of_series(metric, &series, value_of(s, r, m), &why))
      note(&s->results[r], metric, &why);
  }
  tal_table_clear(&series);
}

static bool read_fluctuation(const tal_study_summary *s, size_t r, const tal_study_metric *metric,
                             tal_fluctuation *out) {
  char folder[TAL_PATH_SIZE];
  tal_error why;
  *out = (tal_fluctuation){0};
  if (s->results[r].state.status != TAL_RUN_DONE)
    return false;
  tal_study_folder(folder, sizeof folder, s->dir, &s->study->runs[r]);
  if (tal_fluctuation_read(out, metric, folder, &why) == TAL_OK)
    return true;
  note(&s->results[r], metric, &why);
  return false;
}

// Every run with that of the reference with the same seed.
static void correlate(const tal_study_summary *s, size_t m) {
  const tal_study *study = s->study;
  const tal_study_metric *metric = &study->metrics[m];
  for (size_t q = 0; q < study->run_count; q++) {
    tal_fluctuation reference, other;
    if (study->runs[q].setting != study->reference_setting || !read_fluctuation(s, q, metric, &reference))
      continue;
    for (size_t r = 0; r < study->run_count; r++) {
      if (study->runs[r].seed != study->runs[q].seed || !read_fluctuation(s, r, metric, &other))
        continue;
      *value_of(s, r, m) = tal_fluctuation_correlation(&reference, &other);
      if (other.start != reference.start)
        note(&s->results[r], metric, &(tal_error){"the run starts from another state than the reference's"});
      tal_fluctuation_clear(&other);
    }
    tal_fluctuation_clear(&reference);
  }
}

static void read_values(tal_study_summary *s) {
  const tal_study *study = s->study;
  for (size_t k = 0; k < study->run_count * study->metric_count; k++)
    s->values[k] = (double)NAN;
  for (size_t r = 0; r < study->run_count; r++) {
    s->results[r].state = tal_study_state_read(study, &study->runs[r], s->dir);
    if (s->results[r].state.status == TAL_RUN_DONE)
      read_series(s, r);
  }
  for (size_t m = 0; m < study->metric_count; m++)
    if (study->metrics[m].take == TAL_TAKE_CORRELATION)
      correlate(s, m);
}

// ---- per setting ----

static void sum_up(tal_study_summary *s, size_t setting) {
  const tal_study *study = s->study;
  tal_study_line *line = &s->lines[setting];
  double *cpu = tal_alloc(study->run_count + 1, sizeof *cpu), *steps = tal_alloc(study->run_count + 1, sizeof *steps);
  for (size_t r = 0; r < study->run_count; r++) {
    const tal_study_result *result = &s->results[r];
    if (study->runs[r].setting != setting)
      continue;
    if (result->state.status == TAL_RUN_DONE) {
      cpu[line->done] = result->state.cpu_time;
      steps[line->done++] = result->state.grain_steps;
      continue;
    }
    *(result->state.status == TAL_RUN_FAILED ? &line->failed : &line->unfinished) += 1;
    if (!line->first_not_done)
      line->first_not_done = result;
  }
  line->cpu_time = tal_median(cpu, line->done);
  line->grain_steps = tal_median(steps, line->done);
  s->done += line->done;
  s->failed += line->failed;
  s->unfinished += line->unfinished;
  free(cpu);
  free(steps);
}

// The finite values of a metric over the seeds of a setting (runs stand in the order of their seeds).
static tal_samples samples_of(const tal_study_summary *s, size_t setting, size_t m, int64_t *seed, double *value) {
  size_t n = 0;
  for (size_t r = 0; r < s->study->run_count; r++) {
    if (s->study->runs[r].setting != setting || !isfinite(*value_of(s, r, m)))
      continue;
    seed[n] = s->study->runs[r].seed;
    value[n++] = *value_of(s, r, m);
  }
  return (tal_samples){seed, value, n};
}

static void compare(tal_study_summary *s, size_t m) {
  const tal_study *study = s->study;
  const size_t most = study->run_count + 1;
  int64_t *seed = tal_alloc(2 * most, sizeof *seed);
  double *value = tal_alloc(2 * most, sizeof *value);
  const tal_samples reference = samples_of(s, study->reference_setting, m, seed + most, value + most);
  for (size_t k = 0; k < study->setting_count; k++) {
    tal_study_cell *cell = &s->cells[k * study->metric_count + m];
    const tal_samples mine = samples_of(s, k, m, seed, value);
    cell->estimate = tal_estimate_of(mine.value, mine.count);
    cell->difference = tal_difference_of(mine, reference, study->confidence);
  }
  free(seed);
  free(value);
}

static void find_frontier(tal_study_summary *s, size_t m) {
  const tal_study *study = s->study;
  double *cost = tal_alloc(study->setting_count, sizeof *cost), *off = tal_alloc(study->setting_count, sizeof *off);
  bool *on = tal_alloc(study->setting_count, sizeof *on);
  for (size_t k = 0; k < study->setting_count; k++) {
    cost[k] = s->lines[k].cpu_time;
    off[k] = fabs(tal_study_cell_of(s, k, m)->difference.mean);
  }
  tal_frontier(cost, off, study->setting_count, on);
  for (size_t k = 0; k < study->setting_count; k++)
    s->cells[k * study->metric_count + m].frontier = on[k];
  free(cost);
  free(off);
  free(on);
}

void tal_study_summary_read(tal_study_summary *summary, const tal_study *study, const char *dir) {
  *summary = (tal_study_summary){.study = study, .dir = dir};
  summary->results = tal_alloc(study->run_count, sizeof *summary->results);
  summary->values = tal_alloc(study->run_count * study->metric_count, sizeof *summary->values);
  summary->lines = tal_alloc(study->setting_count, sizeof *summary->lines);
  summary->cells = tal_alloc(study->setting_count * study->metric_count, sizeof *summary->cells);
  read_values(summary);
  for (size_t k = 0; k < study->setting_count; k++)
    sum_up(summary, k);
  for (size_t m = 0; m < study->metric_count; m++) {
    compare(summary, m);
    find_frontier(summary, m);
  }
}

void tal_study_summary_clear(tal_study_summary *summary) {
  free(summary->results);
  free(summary->values);
  free(summary->lines);
  free(summary->cells);
  *summary = (tal_study_summary){0};
}
