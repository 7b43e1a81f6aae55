// Walls: line segments of the scene, and the two plates of a biaxial test as walls without ends.
#ifndef TAL_WALLS_H
#define TAL_WALLS_H

#include "base.h"
#include <stdbool.h>

// X(type, name, unit, kept, meaning), as in grains.h; one value per wall.
#define TAL_WALL_FIELDS(X)                                                                                             \
  X(double, x0, "m", STATE, "first end")                                                                               \
  X(double, y0, "m", STATE, "first end")                                                                               \
  X(double, x1, "m", STATE, "second end")                                                                              \
  X(double, y1, "m", STATE, "second end")                                                                              \
  X(double, vx, "m/s", STATE, "velocity over the coming step")                                                         \
  X(double, vy, "m/s", STATE, "velocity over the coming step")                                                         \
  X(double, modulus, "Pa", STATE, "young / (1 - poisson^2), infinite when rigid")                                      \
  X(double, friction, "1", STATE, "coefficient of friction")                                                           \
  X(double, from_time, "s", STATE, "there from this time on")                                                          \
  X(double, until_time, "s", STATE, "gone from this time on")                                                          \
  X(double, plate, "1", STATE,                                                                                         \
    "+1: plate pushing up (bottom), -1: plate pushing down (top), 0: a segment of the scene")                          \
  X(double, fx, "N", STATE, "force of the grains on the wall at the last step")                                        \
  X(double, fy, "N", STATE, "force of the grains on the wall at the last step")                                        \
  X(double, contact_stiffness, "N/m", STATE, "sum of the tangent stiffness of its contacts at the last step")          \
  X(double, contact_damping, "N s/m", STATE, "sum of the damping coefficients of its contacts at the last step")       \
  X(double, contact_vy, "m/s", STATE, "mean vertical velocity of its touching grains, weighted by that stiffness")     \
  X(double, friction_fx, "N", STATE, "tangential part of that force")                                                  \
  X(double, friction_fy, "N", STATE, "tangential part of that force")                                                  \
  X(double, damping_fx, "N", STATE, "viscous part of that force")                                                      \
  X(double, damping_fy, "N", STATE, "viscous part of that force")                                                      \
  X(double, work, "J", STATE, "work done by the wall on the grains")                                                   \
  X(double, friction_work, "J", STATE, "its part through tangential forces")                                           \
  X(double, damping_work, "J", STATE, "its part through viscous forces")                                               \
  X(double, x_list, "m", STATE, "first end when the neighbour list was built")                                         \
  X(double, y_list, "m", STATE, "first end when the neighbour list was built")                                         \
  X(double, listed, "1", STATE, "1: there when the neighbour list was built")

typedef struct tal_wall {
#define X(type, name, unit, kept, meaning) type name;
  TAL_WALL_FIELDS(X)
#undef X
} tal_wall;

typedef struct tal_walls {
  size_t count, capacity;
  tal_wall *wall; // owned
} tal_walls;

// A point of a wall and the unit normal from it towards (x, y); distance >= 0 [m].
typedef struct tal_wall_point {
  double nx, ny, distance;
} tal_wall_point;

void tal_walls_init(tal_walls *walls);
void tal_walls_clear(tal_walls *walls);
// Appends a zeroed wall that is there for ever and returns it; the pointer holds until the next one is added.
tal_wall *tal_walls_add(tal_walls *walls);
// The plate pushing up (+1) or down (-1), NULL when there is none.
tal_wall *tal_walls_plate(const tal_walls *walls, int side);
bool tal_wall_active(const tal_wall *wall, double time);
// Nearest point of the wall to a centre. A plate has one side: a centre beyond it is at a negative distance.
tal_wall_point tal_wall_nearest(const tal_wall *wall, double x, double y);

#endif
