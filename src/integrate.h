// Integrators: constant descriptors, one registry line each in integrate.c.
#ifndef TAL_INTEGRATE_H
#define TAL_INTEGRATE_H

#include "registry.h"
#include "sim.h"

struct tal_integrator {
  const char *name;
  const char *help;
  bool implicit;                 // friction is solved by friction.h, not by the sweep over the contacts
  void (*advance)(tal_sim *sim); // one step of sim->dt; run.time is the end of the step already
};

const tal_integrator *tal_integrator_find(const char *name);

// The part of a step before the forces, eqs (12)-(14): first half kick, drift of grains and walls, predicted velocities
// into the grain records, neighbour list, boundary forces.
void tal_integrate_drift(tal_sim *sim, double dt);

extern const tal_integrator tal_verlet, tal_implicit_friction;

#endif
