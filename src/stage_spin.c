// One forced grain [P 4.2]: its spin is ramped up and held, eq (R1), whatever torque that takes; its centre and all
// other grains are free. The assembly is pressed all round and its mean shear and mean rotation are held, eqs
// (82)-(83); where no pressure is known nothing is imposed on it (a few grains between walls).
// A list of grains or {random: K} is a plan of many such stages, each in a run of its own (ensemble.h).
#include "stage.h"

#include "forced.h"

#include <string.h>

static bool pressed(const tal_scene_stage *plan) {
  return plan->pressure > 0;
}

static tal_status begin(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  tal_grains *g = &sim->grains;
  size_t forced;
  tal_status status = tal_forced_choose(sim, plan, &forced, err);
  if (status)
    return status;
  if (pressed(plan)) {
    status = tal_minimal_begin(sim, plan, err);
  } else {
    sim->boundary = NULL;
    memset(g->bx, 0, g->count * sizeof *g->bx); // what an earlier stage pressed with
    memset(g->by, 0, g->count * sizeof *g->by);
  }
  if (status == TAL_OK)
    tal_forced_take(sim, forced);
  return status;
}

// (R1)
static double spin_at(const tal_scene_stage *plan, double elapsed) {
  return plan->omega * fmin(1, elapsed / plan->ramp);
}

static void before_step(tal_sim *sim, const tal_scene_stage *plan) {
  if (pressed(plan))
    tal_minimal_before_step(sim);
  tal_forced_turn(sim, spin_at(plan, sim->run.time + sim->dt - sim->run.stage_start));
}

static int64_t steps(const tal_scene_stage *plan) {
  return llround((plan->ramp + plan->hold) / plan->integrator.dt);
}

static tal_status after_step(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)err;
  sim->run.stage_done = sim->run.stage_step >= steps(plan);
  return TAL_OK;
}

static void target(const tal_sim *sim, const tal_scene_stage *plan, tal_boundary_target *out) {
  (void)sim;
  out->held[TAL_XY] = out->held[TAL_SPIN] = true;
  out->stress = (geo_tensor){plan->pressure, 0, 0, plan->pressure};
}

const tal_stage tal_stage_spin = {.name = "spin",
                                  .help =
                                      "one grain is turned, the assembly under pressure held from turning as a whole",
                                  .steps = steps,
                                  .begin = begin,
                                  .before_step = before_step,
                                  .after_step = after_step,
                                  .target = target};
