// What a run leaves on disk (docs/formats.md): series.csv, tracks.csv, fields/NNNNNN.h5, fields.h5, fields.xdmf,
// checkpoint.h5, checkpoint.prev.h5, run.json. Every file but the two CSV is written whole: temporary name, fsync,
// rename.
#ifndef TAL_OUTPUT_H
#define TAL_OUTPUT_H

#include "sim.h"

// Per stage, for run.json.
typedef struct tal_stage_report {
  const char *kind;
  int64_t steps;
  double wall_time; // [s]
  double grain_steps_per_second;
  double cpu_time; // [s] over all threads
} tal_stage_report;

typedef struct tal_run_report {
  const char *status; // "done", "interrupted", "invalid", "running"
  const char *reason; // sentence when invalid, else ""
  int cores;
  double wall_time; // [s] summed over resumed parts
  double cpu_time;  // [s] the same over all threads
  double grain_steps_per_second;
  double energy_residual;
  const tal_stage_report *stages; // [stage_count]
  size_t stage_count;
  const char *const *warnings; // [warning_count]
  size_t warning_count;
} tal_run_report;

typedef struct tal_output tal_output;

// Are all grains of output.tracks there? TAL_BAD_INPUT "FILE: output.tracks: ..." when not; ask before anything is
// written.
tal_status tal_output_check_tracks(const tal_scene *scene, size_t grain_count, tal_error *err);

// Opens DIR for a new run: made with its parents when missing (TAL_IO when that fails), locked against a second run
// (TAL_BAD_INPUT: "a run is at work in DIR"), TAL_BAD_INPUT when it already holds a run (says: --resume or another -o).
tal_status tal_output_create(tal_output **output, const char *dir, const tal_scene *scene, tal_error *err);
// Opens DIR to go on: locks, reads checkpoint.h5 (or, when it is damaged, offers checkpoint.prev.h5 in the message),
// checks version and scene, cuts series.csv, tracks.csv and the frames back to the checkpoint, fills `sim` (created
// from the same scene) and calls tal_sim_restored. *finished: the run was already complete. TAL_BAD_INPUT on a damaged
// or foreign checkpoint, nothing changed then. Was the program killed while it renamed checkpoint.h5,
// checkpoint.prev.h5 is the one to go on from. The last checkpoint of a run must come after its last row and frame.
tal_status tal_output_resume(tal_output **output, const char *dir, const tal_scene *scene, tal_sim *sim, bool *finished,
                             tal_error *err);
// Does run.json say that the run is done? Not after a kill between the last checkpoint and the last report.
bool tal_output_reported_done(const tal_output *output);
// Brings the index files up to date; everything else is on disk since the last checkpoint or report. NULL is fine.
void tal_output_close(tal_output *output);
// The stages [scene->stage_count] as the parts of the run before this one left them: wall time and steps from run.json,
// zero where it knows nothing (always for a new run). Owned by the output.
const tal_stage_report *tal_output_stages_before(const tal_output *output);

// One row / one frame (the driving forces, as tal_sim_row left them) / the tracked grains (after tal_sim_observe).
// Times are unique: what was written for this very step already is not written again. TAL_IO; a row that did not fit on
// the disk is taken off again.
tal_status tal_output_row(tal_output *output, const tal_row *row, tal_error *err);
tal_status tal_output_tracks(tal_output *output, const tal_sim *sim, tal_error *err);
tal_status tal_output_fields(tal_output *output, tal_sim *sim, tal_error *err);
// checkpoint.h5 (the one before becomes checkpoint.prev.h5).
tal_status tal_output_checkpoint(tal_output *output, tal_sim *sim, tal_error *err);
tal_status tal_output_report(tal_output *output, const tal_sim *sim, const tal_run_report *report, tal_error *err);

#endif
