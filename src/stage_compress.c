// Biaxial compression [P 2.5]: the plates approach each other at constant speed, so that the engineering axial strain
// grows linearly, eq (25); the chosen boundary acts on the sides.
#include "stage.h"

#include "boundary.h"
#include "plates.h"

static tal_status begin(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)err;
  tal_plates_ensure(sim);
  sim->boundary = tal_boundary_find(plan->boundary);
  sim->run.pressure = plan->pressure;
  if (!sim->run.strain_begun) {
    sim->run.strain_begun = 1;
    sim->run.height0 = tal_plates_distance(sim);
    sim->run.log_volume = 0;
    sim->run.refresh_area = 0; // what happened before does not count
  }
  return TAL_OK;
}

static void before_step(tal_sim *sim, const tal_scene_stage *plan) {
  tal_plates_drive(sim, plan->rate * sim->run.height0);
}

static int64_t steps(const tal_scene_stage *plan) {
  return llround(plan->strain / plan->rate / plan->integrator.dt);
}

static tal_status after_step(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)err;
  sim->run.axial_strain = 1 - tal_plates_distance(sim) / sim->run.height0;
  sim->run.stage_done = sim->run.stage_step >= steps(plan);
  return TAL_OK;
}

const tal_stage tal_stage_compress = {.name = "compress",
                                      .help = "biaxial compression between plates at a constant rate",
                                      .uses_graph = true,
                                      .steps = steps,
                                      .begin = begin,
                                      .before_step = before_step,
                                      .after_step = after_step};
