// Friction of all contacts solved together at velocity level (scheme implicit_friction), eqs (50)-(55): each contact's
// force is the law's answer to the slip at the END of the kick that all forces give, found by sweeps over the contacts
// that correct the velocities of the two bodies at once (Gauss-Seidel), from the forces of the last step on. Contacts
// are taken colour by colour; contacts of one colour share no movable body, so the order within a colour and the number
// of threads do not matter. Colours depend on the touching contacts alone, never on the age of the neighbour list.
// Equal and opposite impulses with the arms r - d/2 keep momentum and angular momentum.
#ifndef TAL_FRICTION_H
#define TAL_FRICTION_H

#include "base.h"
#include <stdbool.h>

struct tal_sim;

// A grain, or a wall behind the last grain.
typedef struct tal_friction_body {
  double vx, vy, spin;                    // [m/s, m/s, rad/s] at the end of the kick, with the forces found so far
  double before_x, before_y, before_spin; // at its start
  double inverse_mass, inverse_inertia;   // 0: does not give way
} __attribute__((aligned(64))) tal_friction_body;

// A contact that carries a normal force. Slip and force are along t = (-ny, nx), of and on i.
typedef struct tal_friction_contact {
  int32_t i, j;            // bodies; j >= grains: a wall
  int32_t slot, at_wall;   // in sim->pairs, or in sim->wall_contacts when at_wall
  double nx, ny;           // unit normal into i
  double arm_i, arm_j;     // [m]
  double cap;              // [N] mu fn
  double given;            // [m/(s N)] slip per force over the kick
  double before;           // [m/s] slip at the start of the kick
  double force;            // [N] found so far
  double spring;           // [N] spring law: force of the spring at this instant
  double spring_stiffness; // [N/m]
} tal_friction_contact;

typedef struct tal_friction_system {
  tal_friction_body *body; // owned; [body_capacity]
  size_t body_capacity;
  tal_friction_contact *contact; // owned; [capacity] by (i, j), walls last
  int64_t *key;                  // owned; [capacity] (i, j) of the contacts that were coloured last
  int32_t *order;                // owned; [capacity] contacts by colour
  size_t count, capacity;        // contacts now
  size_t coloured;               // contacts when they were coloured last
  size_t colour_count;
  int32_t first[66]; // start of each colour in `order`; the last colour is swept in order by one thread
  bool serial_last;  // the last colour holds what found no free colour
  int64_t sweeps;    // since the start, for reports
} tal_friction_system;

void tal_friction_init(tal_friction_system *system);
void tal_friction_clear(tal_friction_system *system);
// Friction forces for a kick of `kick` seconds that starts from the grains' velocities as they stand, with the normal
// forces of the slots and the boundary forces: into the force records and the wall slots. A step (`advances`) keeps the
// forces as the next step's start and moves the springs; an observation does not.
void tal_friction_solve(struct tal_sim *sim, double kick, bool advances);

// The order of the sweeps: colours of the contacts in `contact`, kept when nothing has changed.
void tal_friction_colour(tal_friction_system *system, size_t grains);

#endif
