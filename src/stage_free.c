// Free motion for a given duration: walls, gravity and contacts only. Plates that are there stand still.
#include "stage.h"

#include "plates.h"

#include <string.h>

static tal_status begin(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)plan, (void)err;
  sim->boundary = NULL;
  memset(sim->grains.bx, 0, sim->grains.count * sizeof *sim->grains.bx); // what an earlier stage pressed with
  memset(sim->grains.by, 0, sim->grains.count * sizeof *sim->grains.by);
  if (tal_walls_plate(&sim->walls, +1))
    tal_plates_drive(sim, 0);
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
