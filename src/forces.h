// Contact forces: a sweep over the slots, one output slot per contact, then a gather grain by grain in the order of the
// partners' ids. No scatter, so any number of threads gives the same bits.
#ifndef TAL_FORCES_H
#define TAL_FORCES_H

#include "sim.h"

// Forces of every slot from the grain records: force records of the grain-grain slots, nx ... ft of the wall slots. dt
// [s] moves the tangential springs; 0: an observation, histories are left alone. Friction that is solved implicitly is
// left out: tal_friction_solve adds it.
void tal_forces_sweep(tal_sim *sim, double dt);
// Grain records of this very instant: centres and velocities as they stand.
void tal_forces_see_now(tal_sim *sim);
// Fills nx, ny, overlap, fe, fd, ft of the grain-grain slots from the force records, and slip of all slots from the
// velocities as they stand. For those who look at contacts between steps; a step does without.
void tal_forces_expand(tal_sim *sim);

// Sums over the slots of one grain.
typedef struct tal_resultant {
  double elastic_x, elastic_y;   // [N]
  double viscous_x, viscous_y;   // [N]
  double friction_x, friction_y; // [N]
  double torque;                 // [N m]
} tal_resultant;

tal_resultant tal_forces_gather(const tal_sim *sim, size_t grain);
// The elastic and viscous members alone.
tal_resultant tal_forces_gather_normal(const tal_sim *sim, size_t grain);

// Resultants of every grain into rx, ry, rtorque from the slots as they stand (boundary forces added, gravity not).
void tal_forces_resultants(tal_sim *sim);
// Gather, boundary forces and gravity, then the second half kick and the ledger: velocities become those of the end of
// the step (integrate_verlet.c explains the order). dt [s]; credit [s]: mean of this and the next step, over which the
// forces of this instant act.
void tal_forces_finish_step(tal_sim *sim, double dt, double credit);

#endif
