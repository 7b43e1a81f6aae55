// Contact forces: a sweep over the slots, one output slot per contact, then a gather grain by grain in the order of the
// partners' ids. No scatter, so any number of threads gives the same bits.
#ifndef TAL_FORCES_H
#define TAL_FORCES_H

#include "sim.h"

// Which velocities the laws see. All arrays [n].
typedef struct tal_velocities {
  const double *x, *y, *omega;                // [m/s, m/s, rad/s] at the instant of the positions
  const double *half_x, *half_y, *half_omega; // in the middle of the step: they move the tangential springs
  double dt;                                  // [s] by which the springs move; 0: an observation, histories are left alone
} tal_velocities;

// Fills nx, ny, overlap, fe, fd, ft (and, where dt > 0, the spring history) of every slot, grain-grain and grain-wall.
void tal_forces_sweep(tal_sim *sim, tal_velocities velocities);
// Also fills slip (observed states only).
void tal_forces_slip(tal_sim *sim, tal_velocities velocities);

// Sums over the slots of one grain.
typedef struct tal_resultant {
  double elastic_x, elastic_y;   // [N]
  double viscous_x, viscous_y;   // [N]
  double friction_x, friction_y; // [N]
  double torque;                 // [N m]
} tal_resultant;

tal_resultant tal_forces_gather(const tal_sim *sim, size_t grain);

// Resultants of every grain into rx, ry, rtorque from the slots as they stand (boundary forces added, gravity not).
void tal_forces_resultants(tal_sim *sim);
// Gather, boundary forces and gravity, then the second half kick and the ledger: velocities become those of the end of
// the step (integrate_verlet.c explains the order). dt [s].
void tal_forces_finish_step(tal_sim *sim, double dt);

#endif
