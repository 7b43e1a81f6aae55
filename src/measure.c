// The list of measurements and the pass over the frames.
#include "measure.h"

#include "figures_data.h"
#include "files.h"
#include "measure_figures.h"
#include "measure_list.h"
#include <stdlib.h>

static const tal_measurement *const measurements[] = {
    &tal_measurement_tensors, //
    &tal_measurement_forces,  //
    &tal_measurement_chains,  //
    &tal_measurement_voids,   //
    &tal_measurement_bands,   //
    &tal_measurement_export,  //
};
enum { MEASUREMENTS = sizeof measurements / sizeof *measurements };

void tal_measuring_row(const tal_measuring *run, const tal_part *part, FILE *table) {
  fprintf(table, "%zu", run->frame);
  tal_put(table, part->of->time);
  tal_put(table, part->of->axial_strain);
}

static tal_status measure_frame(tal_measuring *run, void *const state[], tal_measure_counts *counts, tal_error *err) {
  tal_snapshot snapshot;
  tal_part part;
  tal_status status = tal_snapshot_read(&snapshot, run->choice.frames.entry[run->frame].path, err);
  if (status)
    return status;
  tal_part_select(&part, &snapshot, &run->options->region);
  run->detail = run->choice.detail[run->frame];
  // Measurements share nothing but the list of tables. Those of a frame of --at read and draw: one after the other.
#pragma omp parallel for schedule(dynamic) if (!run->detail)
  for (size_t m = 0; m < MEASUREMENTS; m++)
    measurements[m]->frame(state[m], run, &part);
  *counts = (tal_measure_counts){counts->frames + 1, part.grain_count, part.contact_count};
  tal_part_clear(&part);
  tal_snapshot_clear(&snapshot);
  return TAL_OK;
}

static tal_status measure_all(tal_measuring *run, tal_measure_counts *counts, tal_error *err) {
  const tal_measure_options *options = run->options;
  void *state[MEASUREMENTS] = {0};
  tal_status status = TAL_OK;
  for (size_t m = 0; m < MEASUREMENTS; m++)
    state[m] = measurements[m]->create ? measurements[m]->create(run) : NULL;
  for (run->frame = 0; run->frame < run->choice.frames.count && !status; run->frame++) {
    if (!run->choice.in[run->frame])
      continue;
    status = measure_frame(run, state, counts, err);
    if (options->progress)
      options->progress(options->user, counts->frames, run->choice.in_count);
  }
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
    status = tal_tables_save(&run->tables, run->out, run->options->made, run->options->user, err);
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
  tal_measuring run = {.dir = dir, .out = out, .options = options};
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
