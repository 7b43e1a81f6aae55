// The list of measurements and the pass over the frames.
#include "measure.h"

#include "figures_data.h"
#include "files.h"
#include "measure_figures.h"
#include "measure_list.h"
#include "measure_map.h"
#include <stdlib.h>

static const tal_measurement *const measurements[] = {
    &tal_measurement_bands,   // first, for it takes longest
    &tal_measurement_chains,  //
    &tal_measurement_voids,   //
    &tal_measurement_forces,  //
    &tal_measurement_tensors, //
    &tal_measurement_export,  //
};
enum { MEASUREMENTS = sizeof measurements / sizeof *measurements };

void tal_measuring_row(const tal_measuring *run, const tal_part *part, FILE *table) {
  fprintf(table, "%zu", run->frame);
  tal_put(table, part->of->time);
  tal_put(table, part->of->axial_strain);
}

// ---- the pass ----

// The frame at hand and, while that is measured, the one after it, which is read meanwhile.
typedef struct frames_at_hand {
  tal_snapshot now, next;
  size_t after; // number of `next`, past the last frame: none
  tal_status status;
  tal_error err;
} frames_at_hand;

static void read_next(frames_at_hand *at, const tal_measuring *run) {
  if (at->after >= run->choice.frames.count)
    return;
#pragma omp critical(tal_store)
  at->status = tal_snapshot_read(&at->next, run->choice.frames.entry[at->after].path, &at->err);
}

static size_t following(const tal_measuring *run, size_t frame) {
  while (frame < run->choice.frames.count && !run->choice.in[frame])
    frame++;
  return frame;
}

// Measurements share nothing but the list of tables. Those of a frame of --at read and draw: one after the other.
static void measure_frame(tal_measuring *run, void *const state[], frames_at_hand *at, tal_measure_counts *counts) {
  tal_part part;
  tal_part_select(&part, &at->now, &run->options->region);
  run->detail = run->choice.detail[run->frame];
#pragma omp parallel for schedule(dynamic) if (!run->detail)
  for (size_t m = 0; m <= MEASUREMENTS; m++) {
    if (m == 0)
      read_next(at, run);
    else
      measurements[m - 1]->frame(state[m - 1], run, &part);
  }
  *counts = (tal_measure_counts){counts->frames + 1, part.grain_count, part.contact_count};
  tal_part_clear(&part);
}

static tal_status pass(tal_measuring *run, void *const state[], tal_measure_counts *counts, tal_error *err) {
  const tal_measure_options *options = run->options;
  frames_at_hand at = {.after = following(run, 0)};
  read_next(&at, run);
  while (!at.status && at.after < run->choice.frames.count) {
    at.now = at.next;
    at.next = (tal_snapshot){0};
    run->frame = at.after;
    at.after = following(run, run->frame + 1);
    measure_frame(run, state, &at, counts);
    tal_snapshot_clear(&at.now);
    if (options->progress)
      options->progress(options->user, counts->frames, run->choice.in_count);
    if (!at.status && tal_measure_stopped(run))
      at.status = tal_fail(&at.err, TAL_INTERRUPTED, "%s: stopped after %zu of %zu frames, no tables written", run->dir,
                           counts->frames, run->choice.in_count);
  }
  tal_snapshot_clear(&at.next);
  return at.status ? tal_fail(err, at.status, "%s", at.err.text) : TAL_OK;
}

static tal_status measure_all(tal_measuring *run, tal_measure_counts *counts, tal_error *err) {
  void *state[MEASUREMENTS] = {0};
  for (size_t m = 0; m < MEASUREMENTS; m++)
    state[m] = measurements[m]->create ? measurements[m]->create(run) : NULL;
  // A folder that cannot be written to is told at once, by saving.
  const tal_status status = run->tables.failed ? TAL_OK : pass(run, state, counts, err);
  if (status)
    tal_measure_failed(run, status, err);
  for (size_t m = 0; m < MEASUREMENTS; m++)
    if (measurements[m]->finish)
      measurements[m]->finish(state[m], run);
  return status;
}

// Before anything is written: the fields of --export are there in the frames that they are wanted of.
static tal_status check_exports(const tal_measuring *run, tal_error *err) {
  tal_status status = TAL_OK;
  for (size_t k = 0; k < run->choice.frames.count; k++)
    for (size_t e = 0; run->choice.detail[k] && e < run->options->export_count && !status; e++)
      status = tal_frame_has(run->choice.frames.entry[k].path, run->options->exports[e], err);
  return status;
}

static tal_status work(tal_measuring *run, tal_measure_counts *counts, tal_error *err) {
  tal_status status = check_exports(run, err);
  if (!status)
    status = tal_folder_create(run->out, err);
  if (!status)
    status = measure_all(run, counts, err);
  if (!status)
    status = tal_tables_save(&run->tables, run->options->made, run->options->user, err);
  else
    tal_tables_clear(&run->tables);
  if (!status && run->options->figures && counts->contacts)
    tal_measure_curves_draw(run);
  if (!status && run->status)
    status = tal_fail(err, run->status, "%s", run->err.text);
  return status;
}

tal_status tal_measure(const char *dir, const char *out, const tal_measure_options *options, tal_measure_counts *counts,
                       tal_error *err) {
  tal_run_facts facts;
  tal_measuring run = {.dir = dir, .out = out, .options = options, .tables = {.folder = out}};
  *counts = (tal_measure_counts){0};
  tal_status status = tal_frame_choose(&run.choice, dir, options->window, options->at, err);
  if (status)
    return status;
  run.strain_step = options->over > 0 ? options->over : 0.02;
  tal_measure_facts_read(&run.facts, dir);
  tal_run_facts_read(&facts, dir);
  run.name = facts.name;
  status = work(&run, counts, err);
  tal_run_facts_clear(&facts);
  tal_measure_facts_clear(&run.facts);
  tal_frame_choice_clear(&run.choice);
  return status;
}
