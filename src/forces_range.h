// One thread's part of the sweep over the contacts.
#ifndef TAL_FORCES_RANGE_H
#define TAL_FORCES_RANGE_H

#include "contact_block.h"

// Works out the contacts of part `part` of `parts` ranges of grains, which run side by side, sums them and kicks the
// grains; where the sweep drifts, they are drifted before. sim->sums holds a ring of zeros for each part, sim->rings a
// ring and what lies beyond the part's last grain. Returns the largest of what tal_kick returns.
int64_t tal_forces_range(tal_sim *sim, const tal_sweep *sweep, int part, int parts);

#endif
