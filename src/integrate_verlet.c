// Velocity Verlet with the velocities that the laws see predicted for the instant of the positions, eqs (12)-(15):
// second order also with velocity-dependent forces. Laws read with half-step velocities would be of first order.
#include "integrate.h"

#include "boundary.h"
#include "effects.h"
#include "forces.h"
#include "neighbours.h"
#include "walls_load.h"

// First half kick, drift, prediction.
TAL_KERNEL void drift(tal_grains *g, double dt, unsigned effects) {
#pragma omp parallel for simd schedule(static) if (g->count > 2000)
  for (size_t i = 0; i < g->count; i++) {
    double kick_x = 0.5 * dt * (g->fx[i] * g->inverse_mass[i]), kick_y = 0.5 * dt * (g->fy[i] * g->inverse_mass[i]);
    double vx = g->vx[i] + kick_x, vy = g->vy[i] + kick_y;
    g->x[i] += dt * vx;
    g->y[i] += dt * vy;
    g->vx[i] = vx;
    g->vy[i] = vy;
    g->ux[i] = vx + kick_x;
    g->uy[i] = vy + kick_y;
    if (effects & TAL_EFFECT_SPIN) {
      double turn = 0.5 * dt * (g->torque[i] * g->inverse_inertia[i]);
      double omega = g->omega[i] + turn;
      g->theta[i] += dt * omega;
      g->omega[i] = omega;
      g->uomega[i] = omega + turn;
    }
  }
}

static void advance(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  if (sim->effects & TAL_EFFECT_SPIN)
    drift(g, sim->dt, TAL_EFFECT_SPIN);
  else
    drift(g, sim->dt, 0);
  if (sim->effects & TAL_EFFECT_WALLS) tal_walls_drift(sim);
  if (tal_neighbours_stale(sim)) tal_neighbours_rebuild(sim);
  if (sim->boundary) sim->boundary->apply(sim);
  tal_forces_sweep(sim, (tal_velocities){g->ux, g->uy, g->uomega, g->vx, g->vy, g->omega, sim->dt});
  tal_forces_finish_step(sim, sim->dt);
  if (sim->effects & TAL_EFFECT_WALLS) tal_walls_take_loads(sim, sim->dt);
}

const tal_integrator tal_verlet = {"verlet", "velocity Verlet, second order, velocities synchronised for the laws",
                                   advance};
