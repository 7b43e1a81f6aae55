// Many forced grains from one confined state: what a spin stage with a list of grains or {random: K} asks for. The
// stages before it are one run in DIR; then each grain has an ordinary run DIR/runs/grain-ID of the same scene with
// that one grain, begun from DIR/checkpoint.h5. The runs are made, and resumed, like those of a study (study.h).
#ifndef TAL_ENSEMBLE_H
#define TAL_ENSEMBLE_H

#include "scene.h"
#include <stdbool.h>

// Does the last stage force many grains?
bool tal_ensemble_asked(const tal_scene *scene);
// The scene without that stage, a view: nothing in it is owned.
tal_scene tal_ensemble_confined(const tal_scene *scene);
// Are the listed grains there? TAL_BAD_INPUT "FILE:LINE: key: ..."; packs the scene. Before anything is written.
tal_status tal_ensemble_check(const tal_scene *scene, tal_error *err);

typedef struct tal_ensemble_options {
  const char *dir;         // of the run up to the confined state, which is complete
  const char *program;     // path of talus
  const char *const *sets; // [set_count] KEY=VALUE with which the scene was read
  size_t set_count;
  int cores; // 0: as many as there are
  bool quiet;
} tal_ensemble_options;

typedef struct tal_ensemble_result {
  size_t grains, failed, unfinished;
  char reason[400]; // of the first that failed
} tal_ensemble_result;

// Draws the grains, writes DIR/plan.csv and DIR/commands.txt and makes every run that is not finished. TAL_OK when each
// was tried, TAL_BAD_INPUT (too few grains, a plan of another scene), TAL_INTERRUPTED, TAL_IO.
tal_status tal_ensemble_run(const tal_scene *scene, const tal_ensemble_options *options, tal_ensemble_result *result,
                            tal_error *err);

#endif
