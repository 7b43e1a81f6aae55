#include "walls.h"

#include <math.h>
#include <stdlib.h>

void tal_walls_init(tal_walls *walls) {
  *walls = (tal_walls){0};
}

void tal_walls_clear(tal_walls *walls) {
  free(walls->wall);
  *walls = (tal_walls){0};
}

tal_wall *tal_walls_add(tal_walls *walls) {
  if (walls->count == walls->capacity) {
    walls->wall = tal_grow(walls->wall, walls->capacity, walls->capacity * 2 + 4, sizeof *walls->wall);
    walls->capacity = walls->capacity * 2 + 4;
  }
  tal_wall *wall = &walls->wall[walls->count++];
  *wall = (tal_wall){.from_time = -(double)INFINITY, .until_time = (double)INFINITY};
  return wall;
}

tal_wall *tal_walls_plate(const tal_walls *walls, int side) {
  for (size_t w = 0; w < walls->count; w++)
    if (walls->wall[w].plate == side)
      return &walls->wall[w];
  return NULL;
}

bool tal_wall_active(const tal_wall *wall, double time) {
  return time >= wall->from_time && time < wall->until_time;
}

tal_wall_point tal_wall_nearest(const tal_wall *wall, double x, double y) {
  if (wall->plate != 0)
    return (tal_wall_point){0, wall->plate, (y - wall->y0) * wall->plate};
  double dx = wall->x1 - wall->x0, dy = wall->y1 - wall->y0, length = sqrt(dx * dx + dy * dy);
  double ax = x - wall->x0, ay = y - wall->y0, tx = dx / length, ty = dy / length;
  double along = ax * tx + ay * ty;
  if (along > 0 && along < length) { // the normal is the wall's own, not a difference of nearly equal points
    double left = tx * ay - ty * ax;
    return left < 0 ? (tal_wall_point){ty, -tx, -left} : (tal_wall_point){-ty, tx, left};
  }
  double ex = along > 0 ? x - wall->x1 : ax, ey = along > 0 ? y - wall->y1 : ay;
  double distance = sqrt(ex * ex + ey * ey);
  if (distance == 0)
    return (tal_wall_point){-ty, tx, 0}; // on the end itself: any direction
  return (tal_wall_point){ex / distance, ey / distance, distance};
}
