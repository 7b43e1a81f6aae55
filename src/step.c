// The algorithm of docs/method.md, chapter 4, in its order.
#include "step.h"

#include "boundary.h"
#include "damping.h"
#include "effects.h"
#include "energy.h"
#include "forced.h"
#include "forces.h"
#include "inspect.h"
#include "integrate.h"
#include "law.h"
#include "plates.h"
#include "stage.h"
#include "walls_load.h"

#include <string.h>

// Evaluations of the forces between two looks for a run gone bad where nothing moves fast.
enum { INSPECT_EVERY = 100 };

static bool any_spin(const tal_grains *g) {
  for (size_t i = 0; i < g->count; i++)
    if (g->omega[i] != 0)
      return true;
  return false;
}

static bool any_held_motion(const tal_grains *g) {
  for (size_t i = 0; i < g->count; i++) {
    if (g->inverse_mass[i] == 0 && (g->vx[i] != 0 || g->vy[i] != 0))
      return true;
    if (g->inverse_inertia[i] == 0 && g->omega[i] != 0)
      return true;
  }
  return false;
}

// The plates' that the stage asks for counts, were they smooth just now.
static bool any_friction(const tal_sim *sim) {
  const tal_scene_stage *plan = tal_sim_stage(sim);
  if (sim->friction > 0)
    return true;
  if (plan && tal_walls_plate(&sim->walls, +1) && tal_step_plate_friction(sim, plan) > 0)
    return true;
  for (size_t w = 0; w < sim->walls.count; w++)
    if (sim->walls.wall[w].friction > 0)
      return true;
  return false;
}

static const char *scheme(const tal_sim *sim) {
  const tal_scene_stage *plan = tal_sim_stage(sim);
  return plan ? plan->integrator.scheme : sim->scene->integrator.scheme;
}

void tal_step_effects(tal_sim *sim) {
  const tal_scene *scene = sim->scene;
  unsigned effects = tal_normal_law_find(scene->contact.normal)->effects;
  if (tal_damping_any(scene))
    effects |= TAL_EFFECT_DAMPING;
  if (any_friction(sim))
    effects |= tal_tangential_law_find(scene->contact.tangential)->effects;
  if ((scene->rotation && (effects & TAL_EFFECT_FRICTION)) || any_spin(&sim->grains))
    effects |= TAL_EFFECT_SPIN;
  if (scene->gravity[0] != 0 || scene->gravity[1] != 0)
    effects |= TAL_EFFECT_GRAVITY;
  if (sim->boundary)
    effects |= TAL_EFFECT_BOUNDARY;
  if (sim->walls.count)
    effects |= TAL_EFFECT_WALLS;
  if (sim->run.forced)
    effects |= TAL_EFFECT_SPIN;
  if (sim->run.forced || any_held_motion(&sim->grains))
    effects |= TAL_EFFECT_HELD;
  if ((effects & (TAL_EFFECT_FRICTION | TAL_EFFECT_DAMPING)) && tal_integrator_find(scheme(sim))->implicit)
    effects |= TAL_EFFECT_IMPLICIT;
  sim->effects = effects;
}

// The observed forces of this instant drive the first half kick of what follows.
static void drive_with_observed(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  for (size_t i = 0; i < g->count; i++) {
    g->fx[i] = g->rx[i] + g->mass[i] * sim->scene->gravity[0];
    g->fy[i] = g->ry[i] + g->mass[i] * sim->scene->gravity[1];
    g->torque[i] = g->rtorque[i];
  }
}

double tal_step_plate_friction(const tal_sim *sim, const tal_scene_stage *plan) {
  return isnan(plan->plate_friction) ? sim->friction : plan->plate_friction;
}

static void set_friction(tal_sim *sim, const tal_scene_stage *plan) {
  sim->friction = isnan(plan->friction) ? sim->scene->material.friction : plan->friction;
  for (size_t w = 0; w < sim->walls.count; w++)
    if (sim->walls.wall[w].plate != 0)
      sim->walls.wall[w].friction = tal_step_plate_friction(sim, plan);
}

int64_t tal_step_small_steps(const tal_sim *sim, int64_t done) {
  const tal_scene_stage *plan = tal_sim_stage(sim);
  const tal_integrator *scheme = tal_integrator_find(plan->integrator.scheme);
  int64_t length = scheme->length ? scheme->length(&plan->integrator, done) : 1;
  int64_t left = sim->stage->steps ? sim->stage->steps(plan) - done : length;
  return left > 0 && left < length ? left : length;
}

double tal_step_length(const tal_sim *sim, int64_t done) {
  return (double)tal_step_small_steps(sim, done) * tal_sim_stage(sim)->integrator.dt;
}

double tal_step_longest(const tal_sim *sim) {
  const tal_scene_stage *stage = tal_sim_stage(sim);
  const tal_scene_integrator *plan = stage ? &stage->integrator : &sim->scene->integrator;
  return (double)tal_integrate_longest(plan) * plan->dt;
}

// Asks the stage whether it is over; the last instant of a stage counts half in the ledger.
static tal_status look_for_end(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  tal_status status = sim->stage->after_step(sim, plan, err);
  if (status == TAL_OK && sim->run.stage_done) {
    tal_sim_driving(sim);
    tal_energy_credit(sim, -0.5 * sim->dt);
  }
  return status;
}

tal_status tal_step_begin_stage(tal_sim *sim, tal_error *err) {
  const tal_scene_stage *plan = tal_sim_stage(sim);
  tal_run *run = &sim->run;
  sim->stage = tal_stage_find(plan->kind);
  run->stage_step = 0;
  sim->dt = tal_step_length(sim, 0);
  run->stage_start = run->time;
  run->stage_done = 0;
  run->stage_begun = 1;
  run->correcting_power = 0;
  sim->next_stride = (double)NAN;
  tal_forced_release(sim);
  tal_status status = sim->stage->begin(sim, plan, err);
  if (status)
    return status;
  if (sim->membrane.count && sim->boundary != &tal_boundary_membrane)
    tal_membrane_remove(sim);
  set_friction(sim, plan);
  tal_step_effects(sim);
  tal_neighbours_rebuild(sim);
  tal_sim_observe(sim);
  if (tal_step_keeps_graph(sim) && (status = tal_step_refresh(sim, err)))
    return status;
  tal_sim_observe(sim);
  if (sim->boundary && sim->boundary->start) {
    sim->boundary->start(sim);
    tal_sim_observe(sim);
  }
  if (sim->boundary && sim->boundary->constrain) {
    sim->boundary->constrain(sim, 0, 0.5 * sim->dt);
    tal_sim_driving(sim);
  }
  tal_walls_take_loads(sim, 0);
  tal_energy_credit(sim, 0.5 * sim->dt);
  drive_with_observed(sim);
  run->force_evaluations++;
  if ((status = tal_inspect(sim, err)))
    return status;
  if ((status = tal_inspect_step(sim, err)))
    return status;
  return look_for_end(sim, plan, err);
}

bool tal_step_keeps_graph(const tal_sim *sim) {
  return sim->stage && (sim->stage->uses_graph || sim->run.strain_begun);
}

tal_status tal_step_refresh(tal_sim *sim, tal_error *err) {
  tal_run *run = &sim->run;
  tal_grains *g = &sim->grains;
  if (run->strain_begun && sim->graph.valid && run->refresh_area > 0)
    run->log_volume += log(geo_loop_area(&sim->graph.loop, g->x, g->y) / run->refresh_area);
  tal_plates_mark(sim);
  tal_status status = tal_graph_refresh(&sim->graph, g, err);
  if (status)
    return status;
  run->refresh_area = geo_loop_area(&sim->graph.loop, g->x, g->y);
  run->refresh_step = run->step;
  run->refresh_strain = run->axial_strain;
  run->refresh_shear = run->shear_strain;
  if (!sim->boundary)
    return TAL_OK;
  const int64_t outside = (int64_t)sim->graph.loop.outside_count;
  run->outside_most = outside > run->outside_most ? outside : run->outside_most;
  sim->boundary->refreshed(sim);
  return TAL_OK;
}

// Squares of lengths [m^2].
static double displacement_since_refresh(const tal_sim *sim, size_t i) {
  const double dx = sim->grains.x[i] - sim->graph.x[i], dy = sim->grains.y[i] - sim->graph.y[i];
  return dx * dx + dy * dy;
}

static double largest_displacement(const tal_sim *sim) {
  double largest = 0;
#pragma omp simd reduction(max : largest)
  for (size_t i = 0; i < sim->grains.count; i++) {
    double here = displacement_since_refresh(sim, i);
    largest = here > largest ? here : largest;
  }
  return largest;
}

static double displacement_of_loop(const tal_sim *sim) {
  double largest = 0;
  for (size_t k = 0; k < sim->graph.loop.count; k++)
    largest = fmax(largest, displacement_since_refresh(sim, (size_t)sim->graph.loop.node[k]));
  return largest;
}

static double square(double x) {
  return x * x;
}

static bool refresh_due(const tal_sim *sim) {
  const tal_scene_continuum *plan = &sim->scene->continuum;
  const double diameter = 2 * sim->constants.mean_radius;
  int64_t steps = sim->run.step - sim->run.refresh_step;
  if (sim->run.settling)
    return steps % 10 == 0 && displacement_of_loop(sim) >= square(0.25 * diameter);
  if (plan->refresh_steps > 0)
    return steps >= plan->refresh_steps;
  double strained =
      fmax(fabs(sim->run.axial_strain - sim->run.refresh_strain), fabs(sim->run.shear_strain - sim->run.refresh_shear));
  if (!isnan(plan->refresh_strain) && strained >= plan->refresh_strain)
    return true;
  // displacement is looked at every tenth step only; with a strain it is the confinement's criterion
  double limit = isnan(plan->refresh_displacement) ? 0.02 : plan->refresh_displacement;
  if (steps % 10 || (!isnan(plan->refresh_strain) && sim->run.strain_begun))
    return false;
  return largest_displacement(sim) >= square(limit * diameter);
}

// Passes over finished stages; false with TAL_OK when all are done.
static tal_status enter_stage(tal_sim *sim, bool *more, tal_error *err) {
  *more = false;
  while (!tal_sim_done(sim)) {
    if (sim->run.stage_begun && !sim->run.stage_done) {
      *more = true;
      return TAL_OK;
    }
    if (sim->run.stage_done)
      sim->run.stage++;
    tal_status status = tal_step_begin_stage(sim, err);
    if (status)
      return status;
  }
  return TAL_OK;
}

// Every so many evaluations, and so often that an overlap half as deep again as the limit cannot come and go in
// between. It follows from the motion alone: a resumed run looks when the unbroken one does.
static bool inspection_due(const tal_sim *sim) {
  const double travel = 0.25 * sim->scene->overlap_limit * sim->constants.least_radius;
  int64_t every = INSPECT_EVERY;
  if (sim->neighbours.stride * INSPECT_EVERY > travel)
    every = (int64_t)fmax(1, travel / sim->neighbours.stride);
  return sim->run.force_evaluations % every == 0;
}

// Somebody looks at the forces of the step that is about to be made: who drives the run, or the stage, which does when
// it ends.
static bool looked_at(const tal_sim *sim, const tal_scene_stage *plan) {
  const tal_stage *stage = sim->stage;
  return sim->watched || (stage->looks && stage->looks(sim, plan)) ||
         (stage->steps && sim->run.stage_step >= stage->steps(plan));
}

tal_status tal_sim_step(tal_sim *sim, tal_error *err) {
  bool more;
  tal_status status = enter_stage(sim, &more, err);
  if (status || !more)
    return status;
  const tal_scene_stage *plan = tal_sim_stage(sim);
  tal_run *run = &sim->run;
  sim->stage->before_step(sim, plan); // pressure and wall velocities of the step (22)-(25)
  const int64_t length = tal_step_small_steps(sim, run->stage_step);
  run->step += length;
  run->stage_step += length;
  run->time = run->stage_start + (double)run->stage_step * plan->integrator.dt;
  sim->dt_next = tal_step_length(sim, run->stage_step);
  sim->remembers = looked_at(sim, plan);
  tal_integrator_find(plan->integrator.scheme)->advance(sim); // (12)-(17)
  sim->dt = sim->dt_next;
  run->force_evaluations++;
  if ((status = tal_inspect_stride(sim, err)))
    return status;
  if (inspection_due(sim)) {
    if ((status = tal_inspect(sim, err)))
      return status;
    if ((status = tal_inspect_step(sim, err)))
      return status;
  }
  if (tal_step_keeps_graph(sim) && refresh_due(sim) && (status = tal_step_refresh(sim, err)))
    return status;
  return look_for_end(sim, plan, err);
}
