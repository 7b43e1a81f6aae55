// Simple shear under minimal conditions: L_xy = rate and L_yx = 0 are imposed, xx and yy are left to the pressure.
#include "stage.h"

#include "boundary_minimal.h"

static void before_step(tal_sim *sim, const tal_scene_stage *plan) {
  (void)plan;
  tal_minimal_before_step(sim);
}

static int64_t steps(const tal_scene_stage *plan) {
  return llround(plan->strain / fabs(plan->rate) / plan->integrator.dt);
}

static tal_status after_step(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)err;
  sim->run.stage_done = sim->run.stage_step >= steps(plan);
  return TAL_OK;
}

static void target(const tal_sim *sim, const tal_scene_stage *plan, tal_boundary_target *out) {
  (void)sim;
  out->held[TAL_XY] = out->held[TAL_SPIN] = true;
  out->gradient.xy = plan->rate;
  out->stress = (geo_tensor){plan->pressure, 0, 0, plan->pressure};
}

const tal_stage tal_stage_shear = {.name = "shear",
                                   .help = "simple shear under minimal boundaries, pressure on xx and yy",
                                   .uses_graph = true,
                                   .steps = steps,
                                   .begin = tal_minimal_begin,
                                   .before_step = before_step,
                                   .after_step = after_step,
                                   .target = target};
