// Integrators: constant descriptors, one registry line each in integrate.c.
#ifndef TAL_INTEGRATE_H
#define TAL_INTEGRATE_H

#include "registry.h"
#include "sim.h"

struct tal_integrator {
  const char *name;
  const char *help;
  void (*advance)(tal_sim *sim); // one step of sim->dt; run.time is the end of the step already
};

const tal_integrator *tal_integrator_find(const char *name);

extern const tal_integrator tal_verlet;

#endif
