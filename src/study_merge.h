// What the runs of a study have left, as numbers: values per run, and per setting and metric the mean over seeds and
// the difference from the reference. The tables, figures and sentence are written from this.
#ifndef TAL_STUDY_MERGE_H
#define TAL_STUDY_MERGE_H

#include "study.h"
#include "study_state.h"
#include "study_stats.h"

typedef struct tal_study_result {
  tal_study_state state;
  char note[300]; // of a finished run: why a metric is NAN or to be doubted; ""
} tal_study_result;

typedef struct tal_study_cell {
  tal_estimate estimate;
  tal_difference difference; // from the reference; zero for the reference itself
  bool frontier;
} tal_study_cell;

// A setting as a whole.
typedef struct tal_study_line {
  double cpu_time, grain_steps;           // medians over its finished runs
  size_t done, failed, unfinished;        // runs; missing ones count as unfinished
  const tal_study_result *first_not_done; // NULL: all are done
} tal_study_line;

typedef struct tal_study_summary {
  const tal_study *study;    // borrowed
  const char *dir;           // borrowed
  tal_study_result *results; // owned; [run_count]
  double *values;            // owned; [run_count][metric_count]
  tal_study_line *lines;     // owned; [setting_count]
  tal_study_cell *cells;     // owned; [setting_count][metric_count]
  size_t done, failed, unfinished;
} tal_study_summary;

// Reads what is in `dir`. Never fails: what cannot be read is a run that is missing or a note.
void tal_study_summary_read(tal_study_summary *summary, const tal_study *study, const char *dir);
void tal_study_summary_clear(tal_study_summary *summary);
const tal_study_cell *tal_study_cell_of(const tal_study_summary *summary, size_t setting, size_t metric);
// The error that would do, in the metric's unit; NAN when the study names none.
double tal_study_limit(const tal_study_summary *summary, size_t metric);

// DIR/study.csv (one row per setting and metric) and DIR/runs.csv (one row per run). TAL_IO.
tal_status tal_study_tables_write(const tal_study_summary *summary, tal_error *err);
// The report for people, ended by the sentence; owned by the caller.
char *tal_study_report(const tal_study_summary *summary);
// The sentence alone; owned by the caller.
char *tal_study_sentence(const tal_study_summary *summary);
// DIR/figures/error_METRIC.png for every metric with something to see. *count: how many. TAL_IO, TAL_INTERRUPTED.
tal_status tal_study_figures_draw(const tal_study_summary *summary, int *count, tal_error *err);

#endif
