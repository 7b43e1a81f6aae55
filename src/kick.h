// The second half of a step for grains whose contacts are summed.
#ifndef TAL_KICK_H
#define TAL_KICK_H

#include "contact_block.h"

// Grains kicked at a time.
enum { TAL_KICK_GRAINS = 64 };

// Adds the wall slots as they stand, boundary forces and gravity to the sums of the grains [start, start + count), then
// the second half kick: velocities become those of the end of the step (integrate_verlet.c explains the order). sums:
// of each grain over its contacts, whole cache lines of zeros from `count` on to the next multiple of 8; count <=
// TAL_KICK_GRAINS; leaves zeros behind. start is a multiple of TAL_KICK_GRAINS, so that what the powers add up to
// depends on no thread. dt [s]. Returns the square of the largest speed in the first half of the coming step of
// sim->dt_next [m^2/s^2] as bits, as tal_drift_group without records returns it.
int64_t tal_kick(tal_sim *sim, tal_force_record *sums, size_t start, int count, double dt);
// The ledger, when all grains are kicked. credit [s]: mean of this and the next step, over which the forces of this
// instant act.
void tal_kick_book(tal_sim *sim, double credit);

#endif
