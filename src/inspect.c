#include "inspect.h"

#include "boundary.h"
#include "critical.h"
#include "energy.h"
#include "step.h"

#include <math.h>
#include <stdio.h>

static bool is_finite(const tal_grains *g, size_t i) {
  const double huge = 1e150; // whose square is still a number
  return fabs(g->x[i]) < huge && fabs(g->y[i]) < huge && fabs(g->vx[i]) < huge && fabs(g->vy[i]) < huge &&
         fabs(g->omega[i]) < huge;
}

// Of all grains at once, as vectors; who it is, is looked for only where this says that there is one.
static bool all_well(const tal_sim *sim, double world) {
  const tal_grains *g = &sim->grains;
  unsigned ill = 0;
#pragma omp simd reduction(| : ill)
  for (size_t i = 0; i < g->count; i++)
    ill |= !is_finite(g, i) | !(fabs(g->x[i]) <= world) | !(fabs(g->y[i]) <= world);
  return !ill;
}

static tal_status inspect_numbers(const tal_sim *sim, tal_error *err) {
  const tal_grains *g = &sim->grains;
  for (size_t i = 0; i < g->count; i++)
    if (!is_finite(g, i))
      return tal_fail(err, TAL_INVALID,
                      "grain %lld has no finite position or velocity at t = %g s: the time step is probably too large "
                      "for its contacts; take a smaller integrator.dt",
                      (long long)g->id[i], sim->run.time);
  return TAL_OK;
}

// [m] Beyond it the digits of a coordinate no longer tell an overlap (D2).
static double world_of(const tal_sim *sim) {
  return sim->scene->world_limit * 2 * sim->constants.mean_radius;
}

static tal_status inspect_world(const tal_sim *sim, tal_error *err) {
  const tal_grains *g = &sim->grains;
  const double limit = world_of(sim);
  for (size_t i = 0; i < g->count; i++)
    if (!(fabs(g->x[i]) <= limit && fabs(g->y[i]) <= limit))
      return tal_fail(err, TAL_INVALID,
                      "grain %lld is outside the world at t = %g s: at (%.4g, %.4g) m, further than %g mean diameters "
                      "from the origin (limits.world), where coordinates are too coarse for overlaps; it flew away, or "
                      "the sample lies far off: put walls around it or the origin into its middle",
                      (long long)g->id[i], sim->run.time, g->x[i], g->y[i], sim->scene->world_limit);
  return TAL_OK;
}

static tal_status inspect_overlap(const tal_sim *sim, tal_error *err) {
  int64_t grain;
  const double overlap = tal_largest_overlap(sim, &grain);
  if (overlap <= sim->scene->overlap_limit)
    return TAL_OK;
  return tal_fail(err, TAL_INVALID,
                  "grain %lld overlaps by %.3g of the smaller radius at t = %g s (limits.overlap: %g): contacts too "
                  "soft, a step too large or an impact too fast; raise material.young, lower dt or the speeds",
                  (long long)grain, overlap, sim->run.time, sim->scene->overlap_limit);
}

static tal_status inspect_plates(const tal_sim *sim, tal_error *err) {
  const tal_grains *g = &sim->grains;
  for (int side = 1; side >= -1; side -= 2) {
    const tal_wall *plate = tal_walls_plate(&sim->walls, side);
    for (size_t i = 0; plate && i < g->count; i++)
      if (side * (g->y[i] - plate->y0) < -g->r[i])
        return tal_fail(err, TAL_INVALID,
                        "grain %lld was lost through a plate at t = %g s: contacts too soft for the load or a step too "
                        "large; raise material.young or lower dt",
                        (long long)g->id[i], sim->run.time);
  }
  return TAL_OK;
}

tal_status tal_inspect(const tal_sim *sim, tal_error *err) {
  tal_status status = TAL_OK;
  if (!all_well(sim, world_of(sim)) && (status = inspect_numbers(sim, err)) == TAL_OK)
    status = inspect_world(sim, err);
  if (status == TAL_OK)
    status = inspect_overlap(sim, err);
  if (status == TAL_OK)
    status = inspect_plates(sim, err);
  return status;
}

static size_t fastest_grain(const tal_grains *g) {
  size_t fastest = 0;
  double most = -1;
  for (size_t i = 0; i < g->count; i++) {
    const double speed = hypot(g->vx[i], g->vy[i]);
    if (!(speed <= most)) { // a speed that is no number is the fastest
      fastest = i;
      most = isnan(speed) ? (double)INFINITY : speed;
    }
  }
  return fastest;
}

tal_status tal_inspect_stride(const tal_sim *sim, tal_error *err) {
  const double stride = sim->neighbours.stride / sim->constants.least_radius;
  if (stride <= sim->scene->stride_limit)
    return TAL_OK;
  tal_status status = inspect_numbers(sim, err);
  if (status)
    return status;
  return tal_fail(
      err, TAL_INVALID,
      "grain %lld moves %.3g of the smallest radius in one step at t = %g s (limits.stride: %g) and may pass "
      "through others unseen: an unstable step, or a speed out of hand; lower dt or the speeds",
      (long long)sim->grains.id[fastest_grain(&sim->grains)], stride, sim->run.time, sim->scene->stride_limit);
}

tal_status tal_inspect_step(const tal_sim *sim, tal_error *err) {
  if (sim->boundary && sim->boundary->check) {
    tal_status status = sim->boundary->check(sim, err);
    if (status)
      return status;
  }
  const tal_scene_stage *plan = tal_sim_stage(sim);
  int64_t grain;
  const double critical = tal_critical_step_where(sim, &grain), longest = tal_step_longest(sim);
  if (plan->integrator.force || longest <= critical)
    return TAL_OK;
  char where[64] = "";
  if (grain >= 0)
    snprintf(where, sizeof where, ", least at grain %lld", (long long)grain);
  return tal_fail(
      err, TAL_INVALID,
      "integrator.%s = %g s is above the critical step %.4g s of the contacts at t = %g s (stage %d, %s%s): "
      "%s; a smaller dt, or integrator.force: true at your own risk",
      longest > plan->integrator.dt ? "n dt" : "dt", longest, critical, sim->run.time, (int)sim->run.stage, plan->kind,
      where, sim->run.stage_step ? "they stiffen as they are pressed" : "too large from the start");
}

tal_status tal_inspect_energy(const tal_sim *sim, const tal_row *before, const tal_row *row, tal_error *err) {
  const double scale = tal_energy_scale(sim, row);
  const double gained = row->energy_residual * scale - before->energy_residual * tal_energy_scale(sim, before);
  const double known = row->dt_ratio <= 1 ? tal_energy_of_a_step(sim) : 0;
  const double limit = sim->scene->residual_limit * (scale + row->kinetic + row->elastic);
  if (fabs(gained) <= limit + known)
    return TAL_OK;
  return tal_fail(err, TAL_INVALID,
                  "%.3g J of energy %s between t = %g and %g s, %.3g of all that changed hands (limits.residual: %g); "
                  "grain %lld is the fastest: the step is too large, or impacts are too short for it; lower dt (now "
                  "%.3g of the critical step)",
                  fabs(gained), gained > 0 ? "came from nowhere" : "vanished", before->time, row->time,
                  fabs(gained) / (scale + row->kinetic + row->elastic), sim->scene->residual_limit,
                  (long long)sim->grains.id[fastest_grain(&sim->grains)], row->dt_ratio);
}
