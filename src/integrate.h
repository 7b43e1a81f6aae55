// Integrators: constant descriptors, one registry line each in integrate.c.
#ifndef TAL_INTEGRATE_H
#define TAL_INTEGRATE_H

#include "registry.h"
#include "sim.h"

struct tal_integrator {
  const char *name;
  const char *help;
  bool implicit; // friction and damping are solved by implicit.h, not by the sweep over the contacts
  int64_t (*cycle)(const tal_scene_integrator *plan); // small steps after which the pattern repeats; NULL: 1
  // Length in small steps of the step that starts `done` small steps after the start of the stage; NULL: 1.
  int64_t (*length)(const tal_scene_integrator *plan, int64_t done);
  void (*advance)(tal_sim *sim); // one step of sim->dt; run.time is the end of the step already
};

const tal_integrator *tal_integrator_find(const char *name);

// The part of a step before the forces, eqs (12)-(14): first half kick, drift of grains, predicted velocities,
// neighbour list, boundary forces. The walls have drifted.
void tal_integrate_drift(tal_sim *sim, double dt);
// Time [s] over which the forces of this instant act: half of this step and half of the next.
static inline double tal_integrate_credit(const tal_sim *sim) {
  return 0.5 * (sim->dt + sim->dt_next);
}
// Second half of what moves beside the grains: bodies of the boundary, loads of the walls.
void tal_integrate_end(tal_sim *sim);
// One step of velocity Verlet.
void tal_integrate_verlet_step(tal_sim *sim);
// Small steps after which the pattern of steps repeats: what is written on a schedule is written there.
int64_t tal_integrate_cycle(const tal_scene_integrator *plan);
// Small steps of the longest step: what the critical step limits.
int64_t tal_integrate_longest(const tal_scene_integrator *plan);

extern const tal_integrator tal_verlet, tal_two_timescale, tal_implicit_friction;

#endif
