#include "plates.h"

#include "energy.h"

#include <math.h>

void tal_plates_ensure(tal_sim *sim) {
  if (tal_walls_plate(&sim->walls, +1))
    return;
  const tal_grains *g = &sim->grains;
  double bottom = (double)INFINITY, top = -(double)INFINITY;
  for (size_t i = 0; i < g->count; i++) {
    bottom = fmin(bottom, g->y[i] - g->r[i]);
    top = fmax(top, g->y[i] + g->r[i]);
  }
  for (int side = 1; side >= -1; side -= 2) {
    tal_wall *plate = tal_walls_add(&sim->walls);
    plate->plate = side;
    plate->y0 = plate->y1 = side > 0 ? bottom : top;
    plate->modulus = sim->constants.modulus;
  }
}

double tal_plates_distance(const tal_sim *sim) {
  return tal_walls_plate(&sim->walls, -1)->y0 - tal_walls_plate(&sim->walls, +1)->y0;
}

void tal_plates_drive(tal_sim *sim, double speed) {
  tal_walls_plate(&sim->walls, +1)->vy = 0.5 * speed;
  tal_walls_plate(&sim->walls, -1)->vy = -0.5 * speed;
}

static double width_at_plate(const tal_sim *sim, int side) {
  const int32_t *node = sim->graph.loop.node;
  const tal_run *run = &sim->run;
  int32_t left = node[side > 0 ? run->arc_bottom_left : run->arc_top_left];
  int32_t right = node[side > 0 ? run->arc_bottom_right : run->arc_top_right];
  return sim->grains.x[right] - sim->grains.x[left];
}

static void servo(tal_sim *sim, int side, double target, double speed_limit) {
  tal_wall *plate = tal_walls_plate(&sim->walls, side);
  double load = -side * plate->fy; // grains push the bottom plate (side +1) down
  double resistance = plate->contact_stiffness * sim->dt + plate->contact_damping;
  double outward = resistance > 0 ? 0.8 * (load - target) / resistance : -speed_limit;
  outward = fmax(-speed_limit, fmin(speed_limit, outward));
  plate->vy = -side * outward;
}

void tal_plates_servo(tal_sim *sim, double pressure, double speed_limit) {
  for (int side = 1; side >= -1; side -= 2)
    servo(sim, side, pressure * sim->constants.thickness * width_at_plate(sim, side), speed_limit);
}

void tal_plates_remove(tal_sim *sim) {
  const tal_contacts *slots = &sim->wall_contacts;
  for (size_t c = 0; c < slots->count; c++) {
    tal_wall *wall = &sim->walls.wall[slots->j[c]];
    if (wall->plate != 0)
      wall->work -= tal_energy_normal(sim, slots, c);
  }
  for (size_t w = 0; w < sim->walls.count; w++) {
    tal_wall *wall = &sim->walls.wall[w];
    if (wall->plate == 0)
      continue;
    wall->plate = 0;
    wall->until_time = wall->from_time;
    wall->listed = 0; // its energy is booked
    wall->vx = wall->vy = wall->fx = wall->fy = 0;
  }
}
