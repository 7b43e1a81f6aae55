// The second half of a step for grains whose contacts are summed.
#ifndef TAL_KICK_H
#define TAL_KICK_H

#include "contact_block.h"

// Adds the wall slots, boundary forces and gravity to the sums of the grains [start, start + count), then the second
// half kick and the ledger: velocities become those of the end of the step (integrate_verlet.c explains the order).
// sums: one lane per grain, count <= TAL_BLOCK. dt [s]; credit [s]: mean of this and the next step, over which the
// forces of this instant act.
void tal_kick(tal_sim *sim, tal_force_block *sums, size_t start, int count, double dt, double credit);

#endif
