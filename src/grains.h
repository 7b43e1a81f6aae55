// The grains: structure of arrays generated from one field list. An index is a place in memory (order.h);
// an id is what a grain is called by users.
#ifndef TAL_GRAINS_H
#define TAL_GRAINS_H

#include "base.h"

// X(type, name, unit, kept, meaning). kept: STATE is what a checkpoint holds, WORK can be recomputed,
// SEEN has memory only where someone looks between steps.
#define TAL_GRAIN_FIELDS(X)                                                                                            \
  X(int64_t, id, "1", STATE, "identity, 0-based, in packing order")                                                    \
  X(double, x, "m", STATE, "centre")                                                                                   \
  X(double, y, "m", STATE, "centre")                                                                                   \
  X(double, r, "m", STATE, "radius")                                                                                   \
  X(double, theta, "rad", STATE, "rotation, counter-clockwise")                                                        \
  X(double, vx, "m/s", STATE, "velocity at the instant of x")                                                          \
  X(double, vy, "m/s", STATE, "velocity at the instant of y")                                                          \
  X(double, omega, "rad/s", STATE, "spin, counter-clockwise")                                                          \
  X(double, fx, "N", STATE, "force that drives the next half step: contacts, boundaries, gravity")                     \
  X(double, fy, "N", STATE, "force that drives the next half step: contacts, boundaries, gravity")                     \
  X(double, torque, "N m", STATE, "torque that drives the next half step")                                             \
  X(double, mass, "kg", STATE, "mass, scaling included")                                                               \
  X(double, inertia, "kg m^2", STATE, "moment of inertia, scaling included")                                           \
  X(double, inverse_mass, "1/kg", STATE, "0 for a fixed grain")                                                        \
  X(double, inverse_inertia, "1/(kg m^2)", STATE, "0 where the spin is held")                                          \
  X(double, window_vx, "m/s", STATE, "velocity when the window of mean forces began")                                  \
  X(double, window_vy, "m/s", STATE, "velocity when the window of mean forces began")                                  \
  X(double, ux, "m/s", WORK, "velocity that the laws saw last: predicted for the instant of x")                        \
  X(double, uy, "m/s", WORK, "velocity that the laws saw last: predicted for the instant of y")                        \
  X(double, spin, "rad/s", WORK, "spin that the laws saw last; for the spring law in the middle of the step")          \
  X(double, bx, "N", WORK, "boundary force (pressure on the loop) at the last evaluation")                             \
  X(double, by, "N", WORK, "boundary force (pressure on the loop) at the last evaluation")                             \
  X(double, rx, "N", SEEN, "observed resultant of contacts and boundaries, gravity left out")                          \
  X(double, ry, "N", SEEN, "observed resultant of contacts and boundaries, gravity left out")                          \
  X(double, rtorque, "N m", SEEN, "observed resultant torque")                                                         \
  X(double, x_list, "m", STATE, "centre when the neighbour list was built")                                            \
  X(double, y_list, "m", STATE, "centre when the neighbour list was built")

typedef struct tal_grains {
  size_t count;
#define X(type, name, unit, kept, meaning) type *name; // owned; [count]; SEEN may be NULL
  TAL_GRAIN_FIELDS(X)
#undef X
} tal_grains;

// Zeroed arrays for `count` grains in whole cache lines, ids 0..count-1.
void tal_grains_init(tal_grains *grains, size_t count);
// Gives the SEEN fields memory where they have none, and takes it away.
void tal_grains_show(tal_grains *grains);
void tal_grains_hide(tal_grains *grains);
void tal_grains_clear(tal_grains *grains);

#endif
