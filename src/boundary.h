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
  void (*start)(tal_sim *sim);     // velocities with which the stage begins; beside constrain
  // Once all other forces of the instant are known: corrects bx, by for what the boundary imposes. The forces act for
  // `close` seconds up to the instant of the synchronised velocities, which the velocities as they stand lack, and for
  // `open` seconds from there on. NULL: nothing is imposed.
  void (*constrain)(tal_sim *sim, double close, double open);
  // Beside constrain: corrects sim->implicit's velocities at the end of the kick, so that friction and damping that are
  // solved for answer to what is imposed. `first` of a solve.
  void (*couple)(tal_sim *sim, double kick, bool first);
  void (*restored)(tal_sim *sim);                          // a checkpoint was read; NULL: nothing to put back
  tal_status (*check)(const tal_sim *sim, tal_error *err); // has it gone bad? NULL: it cannot
};

const tal_boundary *tal_boundary_find(const char *name);

extern const tal_boundary tal_boundary_pressure, tal_boundary_minimal;

#endif
