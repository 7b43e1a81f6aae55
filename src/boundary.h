// Boundaries: what acts on the loop. Constant descriptors, one registry line each in boundary.c.
#ifndef TAL_BOUNDARY_H
#define TAL_BOUNDARY_H

#include "registry.h"
#include "sim.h"

struct tal_boundary {
  const char *name;
  const char *help;
  bool plates; // stands between plates
  // Sets itself up when a stage begins; NULL: nothing to do.
  tal_status (*begin)(tal_sim *sim, const tal_scene_stage *plan, tal_error *err);
  void (*refreshed)(tal_sim *sim); // the graph is new: settle where on the loop to act
  void (*apply)(tal_sim *sim);     // forces bx, by for the present centres [N]
  // The same for grains [from, to) alone and the centres in sim->loop_centre, where nothing else is asked for: threads
  // press their own grains. NULL: it asks for more, or it acts on others than the loop's grains.
  void (*press)(tal_sim *sim, size_t from, size_t to);
  void (*start)(tal_sim *sim); // velocities with which the stage begins; NULL: those there are
  // Bodies of its own move with the grains: first and second half of a step, eqs (12)-(15). NULL: it has none.
  void (*drift)(tal_sim *sim, double dt);
  void (*finish)(tal_sim *sim, double dt, double credit);
  // Once all other forces of the instant are known: corrects bx, by for what the boundary imposes. The forces act for
  // `close` seconds up to the instant of the synchronised velocities, which the velocities as they stand lack, and for
  // `open` seconds from there on. NULL: nothing is imposed.
  void (*constrain)(tal_sim *sim, double close, double open);
  // Beside constrain: corrects sim->implicit's velocities at the end of the kick, so that friction and damping that are
  // solved for answer to what is imposed. `first` of a solve.
  void (*couple)(tal_sim *sim, double kick, bool first);
  void (*coupled)(tal_sim *sim, double kick); // and when they are found: bx, by of the step
  void (*restored)(tal_sim *sim);             // a checkpoint was read; NULL: nothing to put back
  // Adds to the grains' tangent stiffness and damping sum[grains][2], returns the critical step [s] of its own
  // contacts; NULL: it has none.
  double (*critical)(const tal_sim *sim, double (*sum)[2]);
  tal_status (*check)(const tal_sim *sim, tal_error *err); // has it gone bad? NULL: it cannot
};

const tal_boundary *tal_boundary_find(const char *name);
// Where the boundary has come to act on other grains: no force on those of before, which keep their last one until the
// forces are evaluated anew; sim->pressed says where there may be any from now on.
void tal_boundary_let_go(tal_sim *sim);
// Before `press`: room for the centres of the loop, and no force on grains that have left it.
void tal_boundary_prepare(tal_sim *sim);

extern const tal_boundary tal_boundary_pressure, tal_boundary_membrane, tal_boundary_minimal;

#endif
