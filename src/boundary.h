// Boundaries: what acts on the loop. Constant descriptors, one registry line each in boundary.c.
#ifndef TAL_BOUNDARY_H
#define TAL_BOUNDARY_H

#include "registry.h"
#include "sim.h"

struct tal_boundary {
  const char *name;
  const char *help;
  void (*refreshed)(tal_sim *sim); // the graph is new: settle where on the loop to act
  void (*apply)(tal_sim *sim);     // forces bx, by for the present centres [N]
};

const tal_boundary *tal_boundary_find(const char *name);

extern const tal_boundary tal_boundary_pressure;

#endif
