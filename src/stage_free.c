// Free motion for a given duration: walls, gravity and contacts only.
#include "stage.h"

static tal_status begin(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)plan, (void)err;
  sim->boundary = NULL;
  return TAL_OK;
}

static void before_step(tal_sim *sim, const tal_scene_stage *plan) {
  (void)sim, (void)plan;
}

static int64_t steps(const tal_scene_stage *plan) {
  return llround(plan->duration / plan->integrator.dt);
}

static tal_status after_step(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)err;
  sim->run.stage_done = sim->run.stage_step >= steps(plan);
  return TAL_OK;
}

const tal_stage tal_stage_free = {.name = "free",
                                  .help = "free motion for a duration",
                                  .steps = steps,
                                  .begin = begin,
                                  .before_step = before_step,
                                  .after_step = after_step};
