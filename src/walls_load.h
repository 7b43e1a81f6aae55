// What the grains do to the walls in a step: loads, the work that moving walls do, and the walls' own motion.
#ifndef TAL_WALLS_LOAD_H
#define TAL_WALLS_LOAD_H

#include "sim.h"

// Moves the walls by one step; the loads of the step's start do half their work.
void tal_walls_drift(tal_sim *sim);
// Sums the wall slots into loads, tangent stiffness and damping of each wall; then the loads do their half of the work
// over dt [s] (0: an observation, no work).
void tal_walls_take_loads(tal_sim *sim, double dt);

#endif
