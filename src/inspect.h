// Looks for a run gone bad: cheap, always on, eqs (D1)-(D5) of docs/method.md. Each finding is TAL_INVALID with one
// sentence that names a grain, the time, the likely cause and what to change.
#ifndef TAL_INSPECT_H
#define TAL_INSPECT_H

#include "sim.h"

// Every 100th step, and before anything is written: numbers that are none, grains outside the world or lost through a
// plate, overlaps beyond the limit.
tal_status tal_inspect(const tal_sim *sim, tal_error *err);
// After every step: a grain that moved so far in it that it may have passed through another unseen. The bound that the
// neighbour list works with: one comparison.
tal_status tal_inspect_stride(const tal_sim *sim, tal_error *err);
// Every 100th step: the step against the critical one of the contacts as they stand.
tal_status tal_inspect_step(const tal_sim *sim, tal_error *err);
// Between two rows of one run: energy that came from nowhere.
tal_status tal_inspect_energy(const tal_sim *sim, const tal_row *before, const tal_row *row, tal_error *err);

#endif
