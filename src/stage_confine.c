// Confinement, eqs (22)-(24): the pressure on the loop's sides is ramped up, the plates follow under a force servo that
// aims at p h times the width they stand for and slide sideways so that their friction holds no shear. While the
// pressure rises the plates bed the uneven ends of the packing: the arcs end at the corners of the sample. Once it is
// almost at rest they end at the outermost grains that touch. Ends when sigma_xx = sigma_yy = p and sigma_xy = 0 within
// the tolerance and the assembly is at rest; fails, saying what was reached, after the timeout. "At rest" looks at
// forces averaged over a window (the change of momentum across it): explicit regularised friction chatters from step to
// step however still the grains are.
#include "stage.h"

#include "boundary.h"
#include "plates.h"
#include "step.h"

#include <stdlib.h>
#include <string.h>

// Length of the window of mean forces as a share of the ramp.
static const double window_share = 0.025;
// Unbalanced force at which bedding ends: among grains that fly about the outermost that touch a plate say nothing
// about its width.
static const double calm = 0.05;
// Loops that an assembly at rest is given before one stands.
enum { LOOPS = 3 };

static void open_window(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  memcpy(g->window_vx, g->vx, g->count * sizeof *g->vx);
  memcpy(g->window_vy, g->vy, g->count * sizeof *g->vy);
  sim->run.impulse_time = sim->run.time;
}

static tal_status begin(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)err;
  if (isnan(sim->scene->pack.cut_radius)) // a cut assembly is pressed all around
    tal_plates_ensure(sim);
  sim->boundary = &tal_boundary_pressure;
  sim->run.bedding = 1;
  sim->run.settling = sim->run.released = 0;
  sim->run.pressure = 0;
  sim->run.rest = (double)INFINITY;
  open_window(sim);
  (void)plan;
  return TAL_OK;
}

static void before_step(tal_sim *sim, const tal_scene_stage *plan) {
  double elapsed = sim->run.time + sim->dt - sim->run.stage_start;
  sim->run.pressure = plan->pressure * fmin(1, elapsed / plan->ramp);
  if (!tal_walls_plate(&sim->walls, +1))
    return;
  const double speed_limit = 0.1 * tal_plates_distance(sim) / plan->ramp;
  tal_plates_servo(sim, sim->run.pressure, speed_limit);
  tal_plates_slide(sim, speed_limit);
  tal_plates_rub(sim, sim->run.released ? 0 : tal_step_plate_friction(sim, plan));
}

// Mean of m |dv| / window over the free grains, over the mean contact force of this instant.
static void close_window(tal_sim *sim, const tal_macro *macro) {
  const tal_grains *g = &sim->grains;
  double sum = 0, window = sim->run.time - sim->run.impulse_time;
  size_t free_grains = 0;
  for (size_t i = 0; i < g->count; i++) {
    if (g->inverse_mass[i] == 0)
      continue;
    sum += g->mass[i] * hypot(g->vx[i] - g->window_vx[i], g->vy[i] - g->window_vy[i]) / window;
    free_grains++;
  }
  sim->run.rest = sum / (double)(free_grains ? free_grains : 1) / macro->mean_force;
  open_window(sim);
}

static bool isotropic(geo_tensor stress, const tal_scene_stage *plan) {
  const double p = plan->pressure, allowed = plan->tolerance * p;
  return fabs(stress.xx - p) <= allowed && fabs(stress.yy - p) <= allowed &&
         0.5 * fabs(stress.xy + stress.yx) <= allowed;
}

// A fresh graph for an assembly at rest. *changed: its loop has other grains.
static tal_status renew(tal_sim *sim, bool *changed, tal_error *err) {
  const size_t count = sim->graph.loop.count;
  int32_t *before = tal_alloc(count, sizeof *before);
  memcpy(before, sim->graph.loop.node, count * sizeof *before);
  tal_status status = tal_step_refresh(sim, err);
  const geo_loop *loop = &sim->graph.loop;
  *changed = !status && (loop->count != count || memcmp(before, loop->node, count * sizeof *before) != 0);
  free(before);
  return status;
}

// The end of a window: done, or what the next one needs. A loop that changes between the same few ways as often as it
// is renewed would keep the assembly moving for ever: the last of them stands.
static tal_status look(tal_sim *sim, const tal_scene_stage *plan, tal_macro *macro, tal_error *err) {
  tal_run *run = &sim->run;
  tal_observed seen = tal_sim_driving(sim);
  tal_macro_measure(&seen, macro);
  close_window(sim, macro);
  run->released = 0;
  if (run->bedding) {
    if (run->time - run->stage_start < plan->ramp || run->rest > fmax(calm, plan->unbalanced))
      return TAL_OK;
    run->bedding = 0;
    run->settling = 1;
    return tal_step_refresh(sim, err); // the arcs end elsewhere now
  }
  if (run->rest > plan->unbalanced)
    return TAL_OK;
  bool changed = false;
  tal_status status = run->settling <= LOOPS ? renew(sim, &changed, err) : TAL_OK;
  run->settling += changed;
  if (status || changed)
    return status;
  run->stage_done = isotropic(macro->stress, plan);
  run->released = !run->stage_done;
  return TAL_OK;
}

// A window ends.
static bool looks(const tal_sim *sim, const tal_scene_stage *plan) {
  return sim->run.time - sim->run.impulse_time >= window_share * plan->ramp * (1 - 1e-9);
}

static tal_status after_step(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  tal_run *run = &sim->run;
  double elapsed = run->time - run->stage_start;
  if (!looks(sim, plan))
    return TAL_OK;
  tal_macro macro;
  tal_status status = look(sim, plan, &macro, err);
  if (run->stage_done)
    run->settling = 0;
  if (status || run->stage_done || elapsed < plan->timeout)
    return status;
  return tal_fail(err, TAL_INVALID,
                  "confine did not settle in %g s: sigma_xx = %.4g Pa, sigma_yy = %.4g Pa, sigma_xy = %.4g Pa for a "
                  "pressure of %.4g Pa (tolerance %g), unbalanced %.3g (asked: %g); a longer timeout or ramp, more "
                  "damping or a looser tolerance may help",
                  elapsed, macro.stress.xx, macro.stress.yy, 0.5 * (macro.stress.xy + macro.stress.yx), plan->pressure,
                  plan->tolerance, run->rest, plan->unbalanced);
}

const tal_stage tal_stage_confine = {.name = "confine",
                                     .help = "isotropic confinement between plates, pressure on the sides",
                                     .uses_graph = true,
                                     .begin = begin,
                                     .before_step = before_step,
                                     .looks = looks,
                                     .after_step = after_step};
