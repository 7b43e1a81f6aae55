// Velocity Verlet with the velocities that the laws see predicted for the instant of the positions, eqs (12)-(15):
// second order also with velocity-dependent forces. Laws read with half-step velocities would be of first order.
#include "integrate.h"

#include "boundary.h"
#include "drift.h"
#include "effects.h"
#include "forces.h"
#include "hot.h"
#include "neighbours.h"
#include "walls_load.h"

#include <stdlib.h>

enum { GRAINS = TAL_DRIFT_GRAINS, PARALLEL_FROM = 2000 };

// Returns what no grain has moved further than [m].
static double drift_all(tal_sim *sim, double dt) {
  const size_t count = sim->grains.count;
  int64_t fastest = 0;
#pragma omp parallel for schedule(static) reduction(max : fastest) if (count > PARALLEL_FROM)
  for (size_t start = 0; start < count; start += GRAINS) {
    int64_t here = sim->hot->drift_group(sim, start, (int)(count - start < GRAINS ? count - start : GRAINS), dt);
    fastest = here > fastest ? here : fastest;
  }
  return tal_drift_stride(dt, fastest);
}

void tal_integrate_drift(tal_sim *sim, double dt) {
  const double moved = drift_all(sim, dt);
  sim->next_stride = (double)NAN;
  if (sim->boundary && sim->boundary->drift)
    sim->boundary->drift(sim, dt);
  if (tal_neighbours_stale(sim, moved))
    tal_neighbours_rebuild(sim);
  if (sim->boundary)
    sim->boundary->apply(sim);
}

// ---- one pass over memory -------------------------------------------------------------------------------------------

// A step may drift its grains while it works out the contacts when the list is known to hold and the boundary can do
// with the centres of its grains. Takes the step into account in the list.
static bool may_sweep_at_once(tal_sim *sim) {
  return (!sim->boundary || sim->boundary->centres) && tal_neighbours_hold(sim, sim->next_stride);
}

// Boundary forces for the centres that the loop's grains are going to have.
static void apply_ahead(tal_sim *sim, double dt) {
  const geo_loop *loop = &sim->graph.loop;
  const tal_grains *g = &sim->grains;
  const double half = 0.5 * dt;
  double(*at)[2] = tal_alloc(loop->count, sizeof *at);
  for (size_t k = 0; k < loop->count; k++) {
    const int32_t i = loop->node[k];
    at[k][0] = g->x[i];
    at[k][1] = g->y[i];
  }
  for (size_t k = 0; k < loop->count; k++) { // from `at`: a loop may pass a grain twice
    const int32_t i = loop->node[k];
    g->x[i] = at[k][0] + dt * (g->vx[i] + half * (g->fx[i] * g->inverse_mass[i]));
    g->y[i] = at[k][1] + dt * (g->vy[i] + half * (g->fy[i] * g->inverse_mass[i]));
  }
  sim->boundary->apply(sim);
  for (size_t k = 0; k < loop->count; k++) {
    const int32_t i = loop->node[k];
    g->x[i] = at[k][0];
    g->y[i] = at[k][1];
  }
  free(at);
}

// ---- the step -------------------------------------------------------------------------------------------------------

// Forces of the contacts and what the boundary imposes, second half kick, ledger, eq (15). Where the boundary imposes
// something it has to know the forces of the contacts first.
static void sweep_drifted(tal_sim *sim) {
  const double credit = tal_integrate_credit(sim);
  if (!sim->boundary || !sim->boundary->constrain) {
    tal_forces_step(sim, sim->dt, credit, false);
    return;
  }
  tal_forces_sweep(sim, sim->dt);
  sim->boundary->constrain(sim, 0.5 * sim->dt, 0.5 * sim->dt_next);
  sim->run.correcting_work += credit * sim->run.correcting_power;
  tal_forces_finish_step(sim, sim->dt, credit);
}

void tal_integrate_end(tal_sim *sim) {
  if (sim->boundary && sim->boundary->finish)
    sim->boundary->finish(sim, sim->dt, tal_integrate_credit(sim));
  if (sim->effects & TAL_EFFECT_WALLS)
    tal_walls_take_loads(sim, sim->dt);
}

void tal_integrate_verlet_step(tal_sim *sim) {
  if (sim->effects & TAL_EFFECT_WALLS)
    tal_walls_drift(sim);
  if (may_sweep_at_once(sim)) {
    if (sim->boundary)
      apply_ahead(sim, sim->dt);
    tal_forces_step(sim, sim->dt, tal_integrate_credit(sim), true);
  } else {
    tal_integrate_drift(sim, sim->dt);
    sweep_drifted(sim);
  }
  tal_integrate_end(sim);
}

const tal_integrator tal_verlet = {.name = "verlet",
                                   .help = "velocity Verlet, second order, velocities synchronised for the laws",
                                   .advance = tal_integrate_verlet_step};
