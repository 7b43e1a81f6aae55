#include "plates.h"

#include "effects.h"
#include "energy.h"
#include "law.h"

#include <math.h>
#include <stdlib.h>

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

void tal_plates_mark(tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  const tal_wall *bottom = tal_walls_plate(&sim->walls, +1), *top = tal_walls_plate(&sim->walls, -1);
  free(sim->graph.side);
  sim->graph.side = NULL;
  if (!bottom || !top)
    return;
  const double reach = 0.01 * 2 * sim->constants.mean_radius;
  unsigned char *side = sim->graph.side = tal_alloc(g->count, 1);
  const tal_contacts *slots = &sim->pairs;
  for (size_t i = 0; i < g->count; i++)
    side[i] = g->y[i] - g->r[i] < bottom->y0 + reach ? 1 : g->y[i] + g->r[i] > top->y0 - reach ? 2 : 0;
  unsigned char *held = tal_alloc(g->count, 1);
  for (size_t c = 0; c < slots->count; c++) {
    int32_t i = slots->i[c], j = slots->j[c];
    if ((side[i] | side[j]) && hypot(g->x[i] - g->x[j], g->y[i] - g->y[j]) < g->r[i] + g->r[j] + reach)
      held[i] = held[j] = 1;
  }
  for (size_t i = 0; i < g->count; i++)
    side[i] = held[i] ? side[i] : 0;
  free(held);
}

double tal_plates_distance(const tal_sim *sim) {
  return tal_walls_plate(&sim->walls, -1)->y0 - tal_walls_plate(&sim->walls, +1)->y0;
}

void tal_plates_drive(tal_sim *sim, double speed) {
  for (int side = 1; side >= -1; side -= 2) {
    tal_wall *plate = tal_walls_plate(&sim->walls, side);
    plate->vx = 0;
    plate->vy = 0.5 * side * speed;
  }
}

void tal_plates_rub(tal_sim *sim, double friction) {
  tal_wall *bottom = tal_walls_plate(&sim->walls, +1), *top = tal_walls_plate(&sim->walls, -1);
  if (bottom->friction == friction && top->friction == friction)
    return;
  bottom->friction = top->friction = friction;
  tal_contacts *slots = &sim->wall_contacts;
  for (size_t c = 0; c < slots->count; c++)
    slots->friction[c] = sim->walls.wall[slots->j[c]].friction;
  tal_implicit_take_friction(sim);
}

void tal_plates_slide(tal_sim *sim, double speed_limit) {
  tal_wall *bottom = tal_walls_plate(&sim->walls, +1), *top = tal_walls_plate(&sim->walls, -1);
  const double mass = sqrt((double)sim->grains.count) * sim->constants.mean_mass;
  double speed = top->vx + 0.5 * sim->dt * (top->fx - bottom->fx) / mass;
  top->vx = fmax(-speed_limit, fmin(speed_limit, speed));
  bottom->vx = -top->vx;
}

static double width_at_plate(const tal_sim *sim, int side) {
  const int32_t *node = sim->graph.loop.node;
  const tal_run *run = &sim->run;
  int32_t left = node[side > 0 ? run->arc_bottom_left : run->arc_top_left];
  int32_t right = node[side > 0 ? run->arc_bottom_right : run->arc_top_right];
  return sim->grains.x[right] - sim->grains.x[left];
}

// Tangent stiffness [N/m] of one contact with a mean grain that carries the whole load. The plate counts on no less: at
// a first light touch the tangent of Hertz' law promises far too long a way.
static double stiffness_at(const tal_sim *sim, double load) {
  if (!(sim->effects & TAL_EFFECT_HERTZ))
    return sim->scene->contact.stiffness;
  const tal_constants *k = &sim->constants;
  double stiffness = tal_hertz_stiffness(k->modulus, k->modulus, k->mean_radius);
  const double root = sqrt(k->mean_radius); // the cube root of a ratio: the same digits in any unit of length
  return tal_hertz_slope(stiffness, root * cbrt(load / (stiffness * k->mean_radius * root)));
}

// Half the speed at which the grains at the two plates part; their common motion is not the plates' to follow.
static double parting_speed(const tal_sim *sim) {
  return 0.5 * (tal_walls_plate(&sim->walls, -1)->contact_vy - tal_walls_plate(&sim->walls, +1)->contact_vy);
}

static void servo(tal_sim *sim, int side, double target, double parting, double speed_limit) {
  tal_wall *plate = tal_walls_plate(&sim->walls, side);
  double elastic = -side * (plate->fy - plate->damping_fy); // grains push the bottom plate (side +1) down
  double stiffness = fmax(plate->contact_stiffness, stiffness_at(sim, target));
  double resistance = stiffness * sim->dt + plate->contact_damping;
  double outward = resistance > 0 ? parting + 0.8 * (elastic - target) / resistance : 0;
  plate->vy = -side * fmax(-speed_limit, fmin(speed_limit, outward));
}

void tal_plates_servo(tal_sim *sim, double pressure, double speed_limit) {
  const double parting = parting_speed(sim), line = pressure * sim->constants.thickness;
  for (int side = 1; side >= -1; side -= 2)
    servo(sim, side, line * width_at_plate(sim, side), parting, speed_limit);
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
