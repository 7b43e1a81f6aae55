// A whole run with its files: the loop around tal_sim_step, and the observers between steps.
#ifndef TAL_RUN_H
#define TAL_RUN_H

#include "sim.h"

typedef struct tal_run_options {
  const char *dir;  // where the files go
  int threads;      // 0: as many as there are
  bool resume;      // go on from the checkpoint in dir
  bool quiet;       // no progress line
  const char *from; // a run's folder or checkpoint whose state is the start, NULL: the packing
} tal_run_options;

typedef struct tal_run_result {
  tal_row row;       // of the last state
  bool already_done; // resume of a finished run
  bool checkpoint;   // dir holds a good checkpoint of this run
  double wall_time;  // [s] of this process
  double grain_steps_per_second;
} tal_run_result;

// Sets and returns the number of threads for so many grains: as asked for, else (0) what is there and pays.
int tal_run_threads(size_t grains, int asked);
// Puts the state of a finished run into `sim`, which was created from a scene that goes on where that run's ended: the
// same but for its further stages. TAL_BAD_INPUT when it is no such run, or damaged; TAL_IO.
tal_status tal_run_from(tal_sim *sim, const char *path, tal_error *err);
// Runs the scene into options->dir. Returns TAL_OK, TAL_BAD_INPUT, TAL_INVALID (the last good checkpoint stays),
// TAL_IO, or TAL_INTERRUPTED after SIGINT, SIGTERM, SIGUSR1 or SIGHUP (checkpoint written), with one sentence in err.
tal_status tal_run_scene(const tal_scene *scene, const tal_run_options *options, tal_run_result *result,
                         tal_error *err);

#endif
