// A vector loop over a handful of grains; the work of this step's forces: dt f . v is the exact discrete work of a
// force that acts over the two half kicks around the instant of v [eq (16)].
#include "kick.h"

#include "root.h"

// Powers are added up in so many lanes.
enum { LANES = 8 };

// Adds the wall slots of the grains, in the order of the walls.
static void add_walls(const tal_sim *sim, tal_force_block *sums, size_t start, int count) {
  const tal_contacts *s = &sim->wall_contacts;
  const int32_t *first = sim->neighbours.wall_first;
  double(*sum)[TAL_BLOCK] = sums->force;
  for (int32_t c = first[start]; c < first[start + (size_t)count]; c++) {
    size_t k = (size_t)s->i[c] - start;
    sum[0][k] += s->fe[c] * s->nx[c];
    sum[1][k] += s->fe[c] * s->ny[c];
    sum[2][k] += s->fd[c] * s->nx[c];
    sum[3][k] += s->fd[c] * s->ny[c];
    sum[4][k] -= s->ft[c] * s->ny[c];
    sum[5][k] += s->ft[c] * s->nx[c];
    sum[6][k] += s->ft[c];
    sum[7][k] += s->ft[c] * s->overlap[c];
  }
}

// Of one kick, one lane per grain.
typedef struct powers {
  double friction[TAL_KICK_GRAINS], damping[TAL_KICK_GRAINS], boundary[TAL_KICK_GRAINS], held[TAL_KICK_GRAINS];
} __attribute__((aligned(64))) powers;

// In an order that depends on no vector's width.
TAL_KERNEL double add_up(const double *power, int count) {
  double lane[LANES] = {0};
  for (int k = 0; k < count; k += LANES)
    for (int m = 0; m < LANES; m++)
      lane[m] += power[k + m];
  return ((lane[0] + lane[4]) + (lane[2] + lane[6])) + ((lane[1] + lane[5]) + (lane[3] + lane[7]));
}

TAL_KERNEL int64_t kick(tal_sim *sim, const tal_force_block *sums, size_t start, int count, double dt,
                        unsigned effects) {
  tal_grains *g = &sim->grains;
  const double *restrict ex = sums->force[0], *restrict ey = sums->force[1], *restrict dx = sums->force[2];
  const double *restrict dy = sums->force[3], *restrict tx = sums->force[4], *restrict ty = sums->force[5];
  const double *restrict ft = sums->force[6], *restrict fh = sums->force[7];
  const double *restrict r = g->r + start, *restrict mass = g->mass + start;
  const double *restrict inverse_mass = g->inverse_mass + start, *restrict inverse_inertia = g->inverse_inertia + start;
  const double *restrict bx = g->bx + start, *restrict by = g->by + start;
  double *restrict vx = g->vx + start, *restrict vy = g->vy + start, *restrict omega = g->omega + start;
  double *restrict fx = g->fx + start, *restrict fy = g->fy + start, *restrict torque = g->torque + start;
  powers p;
  const int whole = (count + LANES - 1) / LANES * LANES;
  for (int k = count; k < whole; k++)
    p.friction[k] = p.damping[k] = p.boundary[k] = p.held[k] = 0;
  const double gravity_x = sim->scene->gravity[0], gravity_y = sim->scene->gravity[1], half = 0.5 * dt,
               half_next = 0.5 * sim->dt_next;
  int64_t fastest = 0;
#pragma omp simd reduction(max : fastest)
  for (int k = 0; k < count; k++) {
    double x = ex[k] + dx[k], y = ey[k] + dy[k];
    if (effects & TAL_EFFECT_FRICTION) {
      x += tx[k];
      y += ty[k];
    }
    if (effects & TAL_EFFECT_BOUNDARY) {
      x += bx[k];
      y += by[k];
    }
    if (effects & TAL_EFFECT_GRAVITY) {
      x += mass[k] * gravity_x;
      y += mass[k] * gravity_y;
    }
    double ax = x * inverse_mass[k], ay = y * inverse_mass[k];
    double u = vx[k] + half * ax, v = vy[k] + half * ay;
    int64_t speed = tal_speed_bits(u + half_next * ax, v + half_next * ay);
    fastest = speed > fastest ? speed : fastest;
    fx[k] = x;
    fy[k] = y;
    vx[k] = u;
    vy[k] = v;
    double friction_power = effects & TAL_EFFECT_FRICTION ? tx[k] * u + ty[k] * v : 0, held_power = 0;
    if (effects & TAL_EFFECT_SPIN) {
      double turn = effects & TAL_EFFECT_FRICTION ? fh[k] - r[k] * ft[k] : 0;
      double spin = omega[k] + half * (turn * inverse_inertia[k]);
      torque[k] = turn;
      omega[k] = spin;
      friction_power += turn * spin;
      if (effects & TAL_EFFECT_HELD)
        held_power -= inverse_inertia[k] == 0 ? turn * spin : 0;
    }
    if (effects & TAL_EFFECT_FRICTION)
      p.friction[k] = friction_power;
    if (effects & TAL_EFFECT_DAMPING)
      p.damping[k] = dx[k] * u + dy[k] * v;
    if (effects & TAL_EFFECT_BOUNDARY)
      p.boundary[k] = bx[k] * u + by[k] * v;
    if (effects & TAL_EFFECT_HELD) {
      held_power -= inverse_mass[k] == 0 ? x * u + y * v : 0;
      p.held[k] = held_power;
    }
  }
  sim->powers[start / TAL_KICK_GRAINS] =
      (tal_kick_powers){.friction = effects & TAL_EFFECT_FRICTION ? add_up(p.friction, whole) : 0,
                        .damping = effects & TAL_EFFECT_DAMPING ? add_up(p.damping, whole) : 0,
                        .boundary = effects & TAL_EFFECT_BOUNDARY ? add_up(p.boundary, whole) : 0,
                        .held = effects & TAL_EFFECT_HELD ? add_up(p.held, whole) : 0};
  return fastest;
}

// Every combination, so that what is absent costs nothing; but held motion, which takes the mask at run time.
#define DAMPED_OR_NOT(mask)  ONE(mask) ONE((mask) | TAL_EFFECT_DAMPING)
#define PRESSED_OR_NOT(mask) DAMPED_OR_NOT(mask) DAMPED_OR_NOT((mask) | TAL_EFFECT_BOUNDARY)
#define HEAVY_OR_NOT(mask)   PRESSED_OR_NOT(mask) PRESSED_OR_NOT((mask) | TAL_EFFECT_GRAVITY)
#define TURNS_OR_NOT(mask)   HEAVY_OR_NOT(mask) HEAVY_OR_NOT((mask) | TAL_EFFECT_SPIN)
#define EVERY_VARIANT        TURNS_OR_NOT(0) TURNS_OR_NOT(TAL_EFFECT_REGULARISED)

int64_t tal_kick(tal_sim *sim, tal_force_block *sums, size_t start, int count, double dt) {
  unsigned effects = sim->effects & (TAL_EFFECT_DAMPING | TAL_EFFECT_SPIN | TAL_EFFECT_GRAVITY | TAL_EFFECT_BOUNDARY |
                                     TAL_EFFECT_HELD);
  if (sim->effects & TAL_EFFECT_FRICTION)
    effects |= TAL_EFFECT_REGULARISED; // either law: the forces are there
  if (sim->effects & TAL_EFFECT_WALLS)
    add_walls(sim, sums, start, count);
  switch (effects) {
#define ONE(mask)                                                                                                      \
  case (mask):                                                                                                         \
    return kick(sim, sums, start, count, dt, (mask));
    EVERY_VARIANT
  default:
    return kick(sim, sums, start, count, dt, effects);
  }
}

void tal_kick_book(tal_sim *sim, double credit) {
  tal_kick_powers sum = {0, 0, 0, 0};
  for (size_t k = 0; k * TAL_KICK_GRAINS < sim->grains.count; k++) {
    sum.friction += sim->powers[k].friction;
    sum.damping += sim->powers[k].damping;
    sum.boundary += sim->powers[k].boundary;
    sum.held += sim->powers[k].held;
  }
  sim->run.friction_work += credit * sum.friction;
  sim->run.damping_work += credit * sum.damping;
  sim->run.boundary_work += credit * sum.boundary;
  sim->run.held_work += credit * sum.held;
}
