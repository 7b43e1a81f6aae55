// Any mix of strain and stress under minimal conditions: a component of the mean velocity gradient that `rates` names
// is imposed, one that `stresses` names is left to that stress. xx and yy that neither names are left to the pressure;
// shear that neither names is held at rest. The spin is imposed always: a stress has no couple to answer for it.
#include "stage.h"

#include "boundary_minimal.h"

static void before_step(tal_sim *sim, const tal_scene_stage *plan) {
  (void)plan;
  tal_minimal_before_step(sim);
}

static int64_t steps(const tal_scene_stage *plan) {
  return llround(plan->duration / plan->integrator.dt);
}

static tal_status after_step(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)err;
  sim->run.stage_done = sim->run.stage_step >= steps(plan);
  return TAL_OK;
}

static double given_or(double value, double otherwise) {
  return isnan(value) ? otherwise : value;
}

static void target(const tal_sim *sim, const tal_scene_stage *plan, tal_boundary_target *out) {
  (void)sim;
  const tal_scene_rates *rates = &plan->rates;
  const tal_scene_stresses *stresses = &plan->stresses;
  out->held[TAL_XX] = !isnan(rates->xx);
  out->held[TAL_YY] = !isnan(rates->yy);
  out->held[TAL_XY] = isnan(stresses->xy);
  out->held[TAL_SPIN] = true;
  out->gradient =
      (geo_tensor){given_or(rates->xx, 0), given_or(rates->xy, 0), given_or(rates->yx, 0), given_or(rates->yy, 0)};
  double shear = given_or(stresses->xy, 0);
  out->stress =
      (geo_tensor){given_or(stresses->xx, plan->pressure), shear, shear, given_or(stresses->yy, plan->pressure)};
}

const tal_stage tal_stage_deform = {.name = "deform",
                                    .help = "any mix of imposed strain rates and stresses, minimal boundaries",
                                    .uses_graph = true,
                                    .steps = steps,
                                    .begin = tal_minimal_begin,
                                    .before_step = before_step,
                                    .after_step = after_step,
                                    .target = target};
