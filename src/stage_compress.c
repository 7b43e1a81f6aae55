// Biaxial compression: the engineering axial strain grows linearly, eq (25). Between plates that approach each other at
// constant speed, the chosen boundary on the sides [P 2.5]; or, with boundary: minimal, without plates: yy is imposed,
// no shear, no spin, xx is left to the pressure [P 3.2].
#include "stage.h"

#include "boundary.h"
#include "boundary_minimal.h"
#include "plates.h"

static bool without_plates(const tal_sim *sim) {
  return !sim->boundary->plates;
}

// The plates come with the height that the strain so far has left.
static void begin_plates(tal_sim *sim) {
  const bool fresh = !tal_walls_plate(&sim->walls, +1);
  tal_plates_ensure(sim);
  if (fresh || !sim->run.strain_begun)
    sim->run.height0 = tal_plates_distance(sim) / (1 - sim->run.axial_strain);
  if (sim->run.strain_begun)
    return;
  sim->run.strain_begun = 1;
  sim->run.log_volume = 0;
  sim->run.refresh_area = 0; // what happened before does not count
}

static tal_status begin(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  sim->boundary = tal_boundary_find(plan->boundary);
  sim->run.pressure = plan->pressure;
  if (sim->run.axial_strain + plan->strain >= 1)
    return tal_fail(err, TAL_BAD_INPUT, "stages[%d].strain = %g would leave no height after an axial strain of %g",
                    (int)sim->run.stage, plan->strain, sim->run.axial_strain);
  if (!without_plates(sim))
    begin_plates(sim);
  return sim->boundary->begin ? sim->boundary->begin(sim, plan, err) : TAL_OK;
}

static void before_step(tal_sim *sim, const tal_scene_stage *plan) {
  if (without_plates(sim))
    tal_minimal_before_step(sim);
  else
    tal_plates_drive(sim, plan->rate * sim->run.height0);
}

static int64_t steps(const tal_scene_stage *plan) {
  return llround(plan->strain / plan->rate / plan->integrator.dt);
}

static tal_status after_step(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)err;
  if (!without_plates(sim))
    sim->run.axial_strain = 1 - tal_plates_distance(sim) / sim->run.height0;
  sim->run.stage_done = sim->run.stage_step >= steps(plan);
  return TAL_OK;
}

// (81): the height goes down by the same amount in any time.
static void target(const tal_sim *sim, const tal_scene_stage *plan, tal_boundary_target *out) {
  const tal_run *run = &sim->run;
  double strain = run->axial_start + plan->rate * (run->time - run->stage_start);
  out->held[TAL_YY] = out->held[TAL_XY] = out->held[TAL_SPIN] = true;
  out->gradient.yy = -plan->rate / (1 - strain);
  out->stress = (geo_tensor){plan->pressure, 0, 0, plan->pressure};
}

const tal_stage tal_stage_compress = {.name = "compress",
                                      .help = "biaxial compression at a constant rate, with or without plates",
                                      .uses_graph = true,
                                      .steps = steps,
                                      .begin = begin,
                                      .before_step = before_step,
                                      .after_step = after_step,
                                      .target = target};
