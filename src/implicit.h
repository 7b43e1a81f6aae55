// Friction and normal damping of all contacts solved together at velocity level (scheme implicit_friction), eqs
// (50)-(56): each contact's forces are the law's answer to the velocities that the kick of all forces leaves behind,
// found by sweeps over the contacts that correct both bodies at once (Gauss-Seidel), from the forces of the last step
// on. Grains are cut into tiles that lie in memory one after the other; a contact belongs to the tile of its i and
// reaches no further than the next tile. A sweep takes the even tiles, then the odd ones, each colour by colour;
// contacts of one colour share no grain. Even tiles do not meet each other, nor do odd ones, so the number of threads
// does not matter, and tiles may go through all passes of a step while they are in the cache (implicit_passes.c). Equal
// and opposite impulses with the arms r - d/2 keep momentum and angular momentum.
#ifndef TAL_IMPLICIT_H
#define TAL_IMPLICIT_H

#include "base.h"
#include "lanes.h"
#include <stdbool.h>

struct tal_sim;

// One lane per listed slot, wall slots too, tile by tile, colour by colour; every colour is filled up to whole vectors
// with lanes that push nobody. X(name, unit, meaning)
#define TAL_LANE_FIELDS(X)                                                                                             \
  X(stiffness, "N/m^1.5 | N/m", "slot's")                                                                              \
  X(damping, "N s/m^1.5 | N s/m", "slot's")                                                                            \
  X(friction, "1", "slot's")                                                                                           \
  X(radius_i, "m", "of grain i")                                                                                       \
  X(reach, "m", "sum of the radii")                                                                                    \
  X(mass_i, "1/kg", "inverse")                                                                                         \
  X(mass_j, "1/kg", "inverse")                                                                                         \
  X(inertia_i, "1/(kg m^2)", "inverse")                                                                                \
  X(inertia_j, "1/(kg m^2)", "inverse")                                                                                \
  X(nx, "1", "unit normal into i, this step")                                                                          \
  X(ny, "1", "unit normal into i, this step")                                                                          \
  X(overlap, "m", "this step")                                                                                         \
  X(arm_i, "m", "this step")                                                                                           \
  X(arm_j, "m", "this step")                                                                                           \
  X(elastic, "N", "elastic normal force, this step")                                                                   \
  X(viscosity, "N s/m", "normal force per speed of approach, this step")                                               \
  X(approach, "m/s", "at the start of the kick")                                                                       \
  X(slip, "m/s", "at the start of the kick")                                                                           \
  X(fn, "N", "normal force found so far; between steps elastic and the slot's `viscous`")                              \
  X(ft, "N", "tangential force found so far, on i along t = (-ny, nx)")                                                \
  X(spring, "N", "spring law: force of the spring at this instant")                                                    \
  X(spring_stiffness, "N/m", "spring law: at this instant")                                                            \
  X(kept_spring, "N", "spring law: slot's `spring`, after the last step")                                              \
  X(kept_stiffness, "N/m", "spring law: slot's `spring_stiffness`, after the last step")

// A grain, or what a wall slot meets: place and velocities (v, v, spin, spin), at the end of the kick with the forces
// found so far and at its start.
typedef struct tal_implicit_body {
  tal_lanes place; // x, y [m]
  tal_lanes now, before;
} tal_implicit_body;

// Where all that lies. Loops take a copy of this, so that what they store cannot be taken for one of these pointers.
typedef struct tal_implicit_lanes {
  tal_implicit_body *body;                   // owned; [body_capacity] grains, wall slots, two of each tile at rest
  int32_t *i, *j;                            // owned; [capacity] bodies
  int32_t *slot;                             // owned; [capacity] in sim->pairs; ~ of it in sim->wall_contacts
  bool *filler;                              // owned; [capacity] lanes that only fill a vector
#define X(name, unit, meaning) double *name; // owned; [capacity]
  TAL_LANE_FIELDS(X)
#undef X
} tal_implicit_lanes;

// Work of a block's contacts over a kick, on both sides together [J].
typedef struct tal_implicit_works {
  double friction, damping;
} tal_implicit_works;

// Grains that lie together, and the contacts of which one of them is the i.
typedef struct tal_implicit_tile {
  size_t colour, colours;  // in `first`
  bool serial_last;        // its last colour holds what found no free one, a vector each
  int passes;              // done of those under way
  double change;           // largest change of a friction force over its cap in the last sweep
  tal_implicit_works work; // over the kick
} tal_implicit_tile;

typedef struct tal_implicit {
  tal_implicit_lanes lane;
  size_t lanes, capacity, body_capacity;
  size_t *wall_lane; // owned; [wall_lanes] lanes of the wall slots
  size_t wall_lanes;
  bool all_free; // no grain is fixed and no spin held
  bool springs;  // the lanes were made for the spring law: kept_spring is what the last step left, else ft
  size_t tiles, tile_grains;
  tal_implicit_tile *tile; // owned; [tiles]
  size_t *first;           // owned; [colours + 1] first lane of each colour of each tile
  bool serial_last;        // in some tile
  uint64_t listed;         // neighbour list these lanes were made from
  int64_t sweeps;          // since the start, for reports
} tal_implicit;

// Lanes of a vector; grains from which a sample has several tiles. The passes over one tile are one thread's, and
// grains that others have touched in between would have to come back to it.
enum { TAL_IMPLICIT_VECTOR = 8, TAL_IMPLICIT_TILES_FROM = 8000 };

void tal_implicit_init(tal_implicit *system);
void tal_implicit_clear(tal_implicit *system);
// A step: forces of all slots for the kick of sim->dt that starts from the grains' velocities as they stand, with the
// boundary forces; the second half of the kick; works over `credit` seconds [eq (16)]; histories move. The wall slots
// hold their forces then, the force records where tal_implicit_answer is asked.
void tal_implicit_step(struct tal_sim *sim, double credit);
// An observation: forces for half a step from the velocities as they stand, into force records and wall slots. Lanes
// are made anew after it.
void tal_implicit_observe(struct tal_sim *sim);
// Fills the force records from the last step.
void tal_implicit_answer(struct tal_sim *sim);
// Brings the slots' histories up to date, for a checkpoint or a new list.
void tal_implicit_save(struct tal_sim *sim);
// Takes over the walls' friction from the slots of the list there is.
void tal_implicit_take_friction(struct tal_sim *sim);

// Lanes for the slots of the present neighbour list: colours, and what does not change until the next list.
void tal_implicit_list(struct tal_sim *sim);
// Deals `count` contacts of bodies (i, j) to colours: no two contacts of a colour share a body below `grains`. What
// finds none of the 64 goes into a last one (*serial_last). Returns the number of colours; colour[k] of contact k.
size_t tal_implicit_colours(const int32_t *i, const int32_t *j, size_t count, size_t grains, uint8_t *colour,
                            bool *serial_last);

#endif
