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

enum { GRAINS = TAL_DRIFT_GRAINS, PARALLEL_FROM = 2000 };

// Returns what no grain has moved further than [m].
static double drift_all(tal_sim *sim, double dt) {
  const size_t count = sim->grains.count;
  const size_t parallel_from = sim->effects & TAL_EFFECT_IMPLICIT ? TAL_IMPLICIT_TILES_FROM : PARALLEL_FROM;
  int64_t fastest = 0;
#pragma omp parallel for schedule(static) reduction(max : fastest) if (count > parallel_from)
  for (size_t start = 0; start < count; start += GRAINS) {
    int64_t here = sim->hot->drift_group(sim, start, (int)(count - start < GRAINS ? count - start : GRAINS), dt, NULL);
    fastest = here > fastest ? here : fastest;
  }
  return tal_drift_stride(dt, fastest);
}

void tal_integrate_drift(tal_sim *sim, double dt) {
  sim->remembers = true; // records are made from it
  const double moved = drift_all(sim, dt);
  sim->next_stride = (double)NAN;
  if (sim->boundary && sim->boundary->drift)
    sim->boundary->drift(sim, dt);
  if (tal_neighbours_stale(sim, moved))
    tal_neighbours_rebuild(sim);
  if (sim->boundary)
    sim->boundary->apply(sim);
}

// A step may drift its grains while it works out the contacts when the list is known to hold and the boundary can do
// with the centres of its grains. Takes the step into account in the list.
static bool may_sweep_at_once(tal_sim *sim) {
  return (!sim->boundary || sim->boundary->press) && tal_neighbours_hold(sim, sim->next_stride);
}

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
      tal_boundary_prepare(sim);
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
