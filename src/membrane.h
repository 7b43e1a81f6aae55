// The membrane of a biaxial test [P 3.2]: on either side a chain of beads from plate to plate, linked by springs,
// pressed on its links from outside, touching the grains without friction. Bodies, forces and limits; eqs (92)-(96).
// When it acts is boundary_membrane.c's.
#ifndef TAL_MEMBRANE_H
#define TAL_MEMBRANE_H

#include "base.h"
#include "scene.h"
#include <stdbool.h>

struct tal_sim;

// X(type, name, unit, kept, meaning), as in grains.h; one value per bead, chain by chain, each from bottom to top.
#define TAL_BEAD_FIELDS(X)                                                                                             \
  X(double, side, "1", STATE, "-1: left chain, +1: right chain")                                                       \
  X(double, x, "m", STATE, "centre")                                                                                   \
  X(double, y, "m", STATE, "centre")                                                                                   \
  X(double, r, "m", STATE, "radius")                                                                                   \
  X(double, vx, "m/s", STATE, "velocity at the instant of x")                                                          \
  X(double, vy, "m/s", STATE, "velocity at the instant of y")                                                          \
  X(double, fx, "N", STATE, "force that drives the next half step")                                                    \
  X(double, fy, "N", STATE, "force that drives the next half step")                                                    \
  X(double, mass, "kg", STATE, "mass")                                                                                 \
  X(double, rest, "m", STATE, "unstretched length of the link to the next bead; 0 at the top of a chain")              \
  X(double, stiffness, "N/m", STATE, "of the link to the next bead")                                                   \
  X(double, damping, "N s/m", STATE, "of the link to the next bead")                                                   \
  X(double, plate, "1", STATE, "+1, -1: moves up and down with that plate; 0: free")                                   \
  X(double, tension, "N", STATE, "in the link to the next bead at the last evaluation")                                \
  X(double, ux, "m/s", WORK, "velocity that the laws see")                                                             \
  X(double, uy, "m/s", WORK, "velocity that the laws see")                                                             \
  X(double, rx, "N", WORK, "resultant at the last evaluation")                                                         \
  X(double, ry, "N", WORK, "resultant at the last evaluation")                                                         \
  X(double, px, "N", WORK, "its part from the pressure on the links")                                                  \
  X(double, py, "N", WORK, "its part from the pressure on the links")                                                  \
  X(double, drag, "N", WORK, "viscous part of the tension")                                                            \
  X(double, x_list, "m", WORK, "centre when the candidates were listed")                                               \
  X(double, y_list, "m", WORK, "centre when the candidates were listed")

// A bead and a grain that may touch.
typedef struct tal_bead_contact {
  int32_t bead, grain;
  double stiffness, damping; // of the normal law
  double nx, ny;             // unit normal into the bead
  double overlap, fe, fd;    // [m, N, N]
} tal_bead_contact;

typedef struct tal_membrane {
  size_t count;
#define X(type, name, unit, kept, meaning) type *name; // owned; [count]
  TAL_BEAD_FIELDS(X)
#undef X
  tal_bead_contact *contact; // owned; [contact_count] by bead, then grain
  size_t contact_count, contact_capacity;
  uint64_t listed; // neighbour list at which they were found; 0: not yet
} tal_membrane;

// Zeroed arrays for `count` beads; frees what was there.
void tal_membrane_init(tal_membrane *membrane, size_t count);
void tal_membrane_clear(tal_membrane *membrane);
// Lays a fresh one along both sides of the sample and lets it come to rest under the pressure while the grains stand
// still (92). False where it does not (softer than the pressure can be held by).
bool tal_membrane_lay(struct tal_sim *sim, const tal_scene_membrane *plan);
// Takes it away; it takes its energy along.
void tal_membrane_remove(struct tal_sim *sim);
// Forces of links, pressure and contacts into rx, ry and, those on the grains, into bx, by (93)-(95). Grains are seen
// through their records.
void tal_membrane_forces(struct tal_sim *sim);
// Kinetic and elastic energy [J]; the ends' motion with the plates is the plates'.
double tal_membrane_kinetic(const tal_membrane *membrane);
double tal_membrane_elastic(const struct tal_sim *sim);
// Powers of this instant [W] with the velocities as they stand: of the pressure, of the plates on the ends, of the
// beads on the grains, lost to viscosity.
typedef struct tal_membrane_power {
  double pressure, ends, grains, lost;
} tal_membrane_power;
tal_membrane_power tal_membrane_powers(const struct tal_sim *sim);
// Adds `weight` [s] times the powers noted in the run to its works.
void tal_membrane_credit(struct tal_sim *sim, double weight);
// Adds the membrane's contacts to the grains' sums of tangent stiffness and damping, sum[grains][2], and returns the
// critical step [s] of its own parts (26).
double tal_membrane_critical(const struct tal_sim *sim, double (*sum)[2]);
// What is wrong with it: torn, crossed, a grain outside. TAL_INVALID with the reason.
tal_status tal_membrane_check(const struct tal_sim *sim, tal_error *err);

#endif
