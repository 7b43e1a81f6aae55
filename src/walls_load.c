#include "walls_load.h"

#include "effects.h"
#include "law.h"

// The wall's load times its velocity over half a step [eq (17)].
static void half_work(tal_wall *wall, double dt) {
  wall->work -= 0.5 * dt * (wall->fx * wall->vx + wall->fy * wall->vy);
  wall->friction_work -= 0.5 * dt * (wall->friction_fx * wall->vx + wall->friction_fy * wall->vy);
  wall->damping_work -= 0.5 * dt * (wall->damping_fx * wall->vx + wall->damping_fy * wall->vy);
}

void tal_walls_drift(tal_sim *sim) {
  for (size_t w = 0; w < sim->walls.count; w++) {
    tal_wall *wall = &sim->walls.wall[w];
    half_work(wall, sim->dt);
    wall->x0 += sim->dt * wall->vx;
    wall->y0 += sim->dt * wall->vy;
    wall->x1 += sim->dt * wall->vx;
    wall->y1 += sim->dt * wall->vy;
  }
}

static void take_slot(const tal_sim *sim, tal_wall *wall, size_t c) {
  const tal_contacts *s = &sim->wall_contacts;
  double root = sqrt(s->overlap[c] > 0 ? s->overlap[c] : 0);
  double fn = s->fe[c] + s->fd[c];
  wall->fx -= fn * s->nx[c] - s->ft[c] * s->ny[c];
  wall->fy -= fn * s->ny[c] + s->ft[c] * s->nx[c];
  wall->friction_fx += s->ft[c] * s->ny[c];
  wall->friction_fy -= s->ft[c] * s->nx[c];
  wall->damping_fx -= s->fd[c] * s->nx[c];
  wall->damping_fy -= s->fd[c] * s->ny[c];
  if (s->overlap[c] <= 0)
    return;
  int hertz = (sim->effects & TAL_EFFECT_HERTZ) != 0;
  double slope = hertz ? tal_hertz_slope(s->stiffness[c], root) : s->stiffness[c];
  wall->contact_stiffness += slope;
  wall->contact_vy += slope * sim->grains.vy[s->i[c]];
  wall->contact_damping += hertz ? s->damping[c] * root : s->damping[c];
}

void tal_walls_take_loads(tal_sim *sim, double dt) {
  for (size_t w = 0; w < sim->walls.count; w++) {
    tal_wall *wall = &sim->walls.wall[w];
    wall->fx = wall->fy = wall->friction_fx = wall->friction_fy = wall->damping_fx = wall->damping_fy = 0;
    wall->contact_stiffness = wall->contact_damping = wall->contact_vy = 0;
  }
  for (size_t c = 0; c < sim->wall_contacts.count; c++)
    take_slot(sim, &sim->walls.wall[sim->wall_contacts.j[c]], c);
  for (size_t w = 0; w < sim->walls.count; w++) {
    tal_wall *wall = &sim->walls.wall[w];
    wall->contact_vy = wall->contact_stiffness > 0 ? wall->contact_vy / wall->contact_stiffness : 0;
    if (dt > 0)
      half_work(wall, dt);
  }
}
