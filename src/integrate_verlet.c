// Velocity Verlet with the velocities that the laws see predicted for the instant of the positions, eqs (12)-(15):
// second order also with velocity-dependent forces. Laws read with half-step velocities would be of first order.
#include "integrate.h"

#include "boundary.h"
#include "effects.h"
#include "forces.h"
#include "neighbours.h"
#include "walls_load.h"

enum { CHUNK = 512 };

// First half kick, drift, prediction of the grains in [start, end); what the laws shall see goes into the records.
TAL_KERNEL void drift(tal_grains *g, tal_grain_record *record, size_t start, size_t end, double dt, unsigned effects) {
  for (size_t i = start; i < end; i++) {
    double kick_x = 0.5 * dt * (g->fx[i] * g->inverse_mass[i]), kick_y = 0.5 * dt * (g->fy[i] * g->inverse_mass[i]);
    double vx = g->vx[i] + kick_x, vy = g->vy[i] + kick_y;
    double x = g->x[i] + dt * vx, y = g->y[i] + dt * vy, spin = 0;
    if (effects & TAL_EFFECT_SPIN) {
      double turn = 0.5 * dt * (g->torque[i] * g->inverse_inertia[i]);
      double omega = g->omega[i] + turn;
      g->theta[i] += dt * omega;
      g->omega[i] = omega;
      spin = effects & TAL_EFFECT_SPRING ? omega : omega + turn;
    }
    g->x[i] = x;
    g->y[i] = y;
    g->vx[i] = vx;
    g->vy[i] = vy;
    record[i] = (tal_grain_record){x, y, g->r[i], vx + kick_x, vy + kick_y, spin, vx, vy};
  }
}

static void drift_all(tal_sim *sim, double dt) {
  const size_t count = sim->grains.count, chunks = (count + CHUNK - 1) / CHUNK;
#pragma omp parallel for schedule(static) if (chunks > 3)
  for (size_t k = 0; k < chunks; k++) {
    size_t end = (k + 1) * CHUNK < count ? (k + 1) * CHUNK : count;
    drift(&sim->grains, sim->grain_records, k * CHUNK, end, dt, sim->effects);
  }
}

void tal_integrate_drift(tal_sim *sim, double dt) {
  drift_all(sim, dt);
  if (sim->effects & TAL_EFFECT_WALLS)
    tal_walls_drift(sim);
  if (sim->boundary && sim->boundary->drift)
    sim->boundary->drift(sim, dt);
  if (tal_neighbours_stale(sim))
    tal_neighbours_rebuild(sim);
  if (sim->boundary)
    sim->boundary->apply(sim);
}

void tal_integrate_finish(tal_sim *sim) {
  const double credit = 0.5 * (sim->dt + sim->dt_next);
  if (sim->boundary && sim->boundary->constrain) {
    sim->boundary->constrain(sim, 0.5 * sim->dt, 0.5 * sim->dt_next);
    sim->run.correcting_work += credit * sim->run.correcting_power;
  }
  tal_forces_finish_step(sim, sim->dt, credit);
  if (sim->boundary && sim->boundary->finish)
    sim->boundary->finish(sim, sim->dt, credit);
  if (sim->effects & TAL_EFFECT_WALLS)
    tal_walls_take_loads(sim, sim->dt);
}

void tal_integrate_verlet_step(tal_sim *sim) {
  tal_integrate_drift(sim, sim->dt);
  tal_forces_sweep(sim, sim->dt);
  tal_integrate_finish(sim);
}

const tal_integrator tal_verlet = {.name = "verlet",
                                   .help = "velocity Verlet, second order, velocities synchronised for the laws",
                                   .advance = tal_integrate_verlet_step};
