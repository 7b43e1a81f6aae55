// Contact forces. A step sums the forces of the slots grain by grain and kicks each grain as soon as its contacts are
// done (forces_range.c); observers and friction solved implicitly want the force of every slot kept (forces_kept.c).
// Every grain sums its slots in the order of its partners, so any number of threads gives the same bits.
#ifndef TAL_FORCES_H
#define TAL_FORCES_H

#include "contact_block.h"

// Forces of every slot, histories moved by dt [s], summed; then tal_kick for every grain. The force records of
// grain-grain slots are not kept. `drifts`: grains drift first, each shortly before its contacts are worked out, in one
// pass over memory; else they have drifted. Sets sim->next_stride.
void tal_forces_step(tal_sim *sim, double dt, double credit, bool drifts);

// Forces of every slot from what the laws see of the grains: force records of the grain-grain slots, nx ... ft of the
// wall slots. dt [s] moves the tangential springs; 0: an observation, histories are left alone.
void tal_forces_sweep(tal_sim *sim, double dt);
// Room for a record of every slot, which the caller fills.
void tal_forces_keep(tal_sim *sim);
// The memory of what observers were shown goes back.
void tal_forces_forget(tal_sim *sim);
// nx ... ft of the wall slots [first, end) alone; grain g's record is at g & mask.
void tal_forces_sweep_walls(tal_sim *sim, const tal_sweep *sweep, const tal_grain_record *record, size_t mask,
                            size_t first, size_t end);
// The same as tal_forces_step from the force records as they stand.
void tal_forces_finish_step(tal_sim *sim, double dt, double credit);
// Lets the laws see this very instant: centres and velocities as they stand.
void tal_forces_see_now(tal_sim *sim);
// Fills nx, ny, overlap, fe, fd, ft of the grain-grain slots with the forces of the last step or sweep, and slip of all
// slots from the velocities as they stand. For those who look at contacts between steps; a step does without.
void tal_forces_expand(tal_sim *sim);

// Sums over the slots of one grain.
typedef struct tal_resultant {
  double elastic_x, elastic_y;   // [N]
  double viscous_x, viscous_y;   // [N]
  double friction_x, friction_y; // [N]
  double torque;                 // [N m]
} tal_resultant;

// After tal_forces_sweep or tal_forces_expand.
tal_resultant tal_forces_gather(const tal_sim *sim, size_t grain);

// Resultants of every grain into rx, ry, rtorque from the slots as they stand (boundary forces added, gravity not).
// After tal_forces_sweep or tal_forces_expand.
void tal_forces_resultants(tal_sim *sim);

#endif
