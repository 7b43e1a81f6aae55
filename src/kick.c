// Four grains at a time: their sums are turned into lanes that never see memory. The work of this step's forces: the
// power f . v over dt is the exact discrete work of a force that acts over the two half kicks around the instant of v
// [eq (16)].
#include "kick.h"

#include "root.h"

// Adds the wall slots of the grains, in the order of the walls.
static void add_walls(const tal_sim *sim, tal_force_record *sums, size_t start, int count) {
  const tal_contacts *s = &sim->wall_contacts;
  const int32_t *first = sim->neighbours.wall_first;
  for (int32_t c = first[start]; c < first[start + (size_t)count]; c++) {
    tal_force_record *sum = sums + ((size_t)s->i[c] - start);
    sum->elastic_x += s->fe[c] * s->nx[c];
    sum->elastic_y += s->fe[c] * s->ny[c];
    sum->viscous_x += s->fd[c] * s->nx[c];
    sum->viscous_y += s->fd[c] * s->ny[c];
    sum->friction_x -= s->ft[c] * s->ny[c];
    sum->friction_y += s->ft[c] * s->nx[c];
    sum->ft += s->ft[c];
    sum->ft_half_overlap += s->ft[c] * s->overlap[c];
  }
}

// Sums over the contacts of four grains, as lanes; what the effects leave out is zero.
typedef struct four {
  union {
    struct {
      tal_lanes elastic_x, elastic_y, viscous_x, viscous_y;
    };
    tal_lanes first[4];
  };
  union {
    struct {
      tal_lanes friction_x, friction_y, ft, ft_half_overlap;
    };
    tal_lanes second[4];
  };
} four;

TAL_KERNEL void take(tal_force_record *sums, four *f, unsigned effects) {
  tal_force_halves *sum = (tal_force_halves *)sums;
  for (int m = 0; m < 4; m++) {
    f->first[m] = sum[m].first;
    f->second[m] = (tal_lanes){0};
    sum[m].first = (tal_lanes){0};
    if (effects & TAL_EFFECT_FRICTION) {
      f->second[m] = sum[m].second;
      sum[m].second = (tal_lanes){0};
    }
  }
  tal_lanes_turn(f->first);
  tal_lanes_turn(f->second);
}

// Powers of four grains, added up.
typedef struct powers {
  tal_lanes friction, damping, boundary, held;
} powers;

// What a kick has in common.
typedef struct kick_plan {
  double half, half_next; // [s] of this step and the coming one
  const double *gravity;  // [m/s^2]
} kick_plan;

// Where the divisor is zero, the power; else nothing.
TAL_KERNEL void hold(tal_lanes *power, const tal_lanes *inverse) {
  *power = (tal_lanes)((tal_lanes_bits)(*inverse == 0) & (tal_lanes_bits)*power);
}

// Torques, spins and what they add to the powers of friction and of who holds grains.
TAL_KERNEL void turn_four(const tal_grains *g, size_t i, const four *f, const kick_plan *plan, tal_lanes *power,
                          tal_lanes *held) {
  const tal_lanes inverse_inertia = TAL_LANES_AT(g->inverse_inertia, i);
  const tal_lanes turn = f->ft_half_overlap - TAL_LANES_AT(g->r, i) * f->ft;
  const tal_lanes spin = TAL_LANES_AT(g->omega, i) + plan->half * (turn * inverse_inertia);
  TAL_LANES_AT(g->torque, i) = turn;
  TAL_LANES_AT(g->omega, i) = spin;
  *held = turn * spin;
  *power += *held;
  hold(held, &inverse_inertia);
}

TAL_KERNEL void kick_four(const tal_grains *g, size_t i, const four *f, const kick_plan *plan, powers *p,
                          tal_lanes_bits *fastest, unsigned effects) {
  const tal_lanes inverse_mass = TAL_LANES_AT(g->inverse_mass, i);
  tal_lanes x = f->elastic_x + f->viscous_x, y = f->elastic_y + f->viscous_y;
  if (effects & TAL_EFFECT_FRICTION) {
    x += f->friction_x;
    y += f->friction_y;
  }
  if (effects & TAL_EFFECT_BOUNDARY) {
    x += TAL_LANES_AT(g->bx, i);
    y += TAL_LANES_AT(g->by, i);
  }
  if (effects & TAL_EFFECT_GRAVITY) {
    x += TAL_LANES_AT(g->mass, i) * plan->gravity[0];
    y += TAL_LANES_AT(g->mass, i) * plan->gravity[1];
  }
  const tal_lanes ax = x * inverse_mass, ay = y * inverse_mass;
  const tal_lanes u = TAL_LANES_AT(g->vx, i) + plan->half * ax, v = TAL_LANES_AT(g->vy, i) + plan->half * ay;
  const tal_lanes next_u = u + plan->half_next * ax, next_v = v + plan->half_next * ay;
  tal_lanes_fastest(&next_u, &next_v, fastest);
  TAL_LANES_AT(g->fx, i) = x;
  TAL_LANES_AT(g->fy, i) = y;
  TAL_LANES_AT(g->vx, i) = u;
  TAL_LANES_AT(g->vy, i) = v;
  tal_lanes friction = f->friction_x * u + f->friction_y * v, held_spin = {0}, held = x * u + y * v;
  if (effects & TAL_EFFECT_SPIN)
    turn_four(g, i, f, plan, &friction, &held_spin);
  hold(&held, &inverse_mass);
  if (effects & TAL_EFFECT_FRICTION)
    p->friction += friction;
  if (effects & TAL_EFFECT_DAMPING)
    p->damping += f->viscous_x * u + f->viscous_y * v;
  if (effects & TAL_EFFECT_BOUNDARY)
    p->boundary += TAL_LANES_AT(g->bx, i) * u + TAL_LANES_AT(g->by, i) * v;
  if (effects & TAL_EFFECT_HELD)
    p->held += 0 - held_spin - held;
}

// In an order that depends on no vector's width.
TAL_KERNEL double add_up(const tal_lanes *a, const tal_lanes *b) {
  const tal_lanes sum = *a + *b;
  return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

TAL_KERNEL int64_t kick(tal_sim *sim, tal_force_record *sums, size_t start, int count, double dt, unsigned effects) {
  const kick_plan plan = {0.5 * dt, 0.5 * sim->dt_next, sim->scene->gravity};
  powers p[2] = {{{0}, {0}, {0}, {0}}, {{0}, {0}, {0}, {0}}}; // of the even fours, of the odd ones
  tal_lanes_bits fastest = {0};
  for (int k = 0; k < count; k += 8) {
    four f;
    take(sums + k, &f, effects);
    kick_four(&sim->grains, start + (size_t)k, &f, &plan, &p[0], &fastest, effects);
    take(sums + k + 4, &f, effects);
    kick_four(&sim->grains, start + (size_t)k + 4, &f, &plan, &p[1], &fastest, effects);
  }
  sim->powers[start / TAL_KICK_GRAINS] = (tal_kick_powers){.friction = add_up(&p[0].friction, &p[1].friction),
                                                           .damping = add_up(&p[0].damping, &p[1].damping),
                                                           .boundary = add_up(&p[0].boundary, &p[1].boundary),
                                                           .held = add_up(&p[0].held, &p[1].held)};
  return tal_lanes_largest(&fastest);
}

// Every combination, so that what is absent costs nothing; but held motion, which takes the mask at run time.
#define DAMPED_OR_NOT(mask)  ONE(mask) ONE((mask) | TAL_EFFECT_DAMPING)
#define PRESSED_OR_NOT(mask) DAMPED_OR_NOT(mask) DAMPED_OR_NOT((mask) | TAL_EFFECT_BOUNDARY)
#define HEAVY_OR_NOT(mask)   PRESSED_OR_NOT(mask) PRESSED_OR_NOT((mask) | TAL_EFFECT_GRAVITY)
#define TURNS_OR_NOT(mask)   HEAVY_OR_NOT(mask) HEAVY_OR_NOT((mask) | TAL_EFFECT_SPIN)
#define EVERY_VARIANT        TURNS_OR_NOT(0) TURNS_OR_NOT(TAL_EFFECT_REGULARISED)

int64_t tal_kick(tal_sim *sim, tal_force_record *sums, size_t start, int count, double dt) {
  unsigned effects = sim->effects & (TAL_EFFECT_DAMPING | TAL_EFFECT_SPIN | TAL_EFFECT_GRAVITY | TAL_EFFECT_BOUNDARY |
                                     TAL_EFFECT_HELD);
  if (sim->effects & TAL_EFFECT_FRICTION)
    effects |= TAL_EFFECT_REGULARISED; // either law: the forces are there
  if (!sim->pressed[start / TAL_KICK_GRAINS])
    effects &= ~(unsigned)TAL_EFFECT_BOUNDARY;
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
