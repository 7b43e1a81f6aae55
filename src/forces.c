// The hot loop. Slots are taken in blocks: a scalar loop fetches what the two grains bring, a vector loop works out
// geometry and law for the whole block (contact kernel of law.h), and stores go straight to the slots.
// Numbers of the variants listed at the end: tests/bench/bench_step.c.
#include "forces.h"

#include "effects.h"
#include "law.h"

enum { BLOCK = 128 };

// What a block of contacts brings, one array per quantity.
typedef struct block {
  double dx[BLOCK], dy[BLOCK];                   // centre i - centre j
  double ux[BLOCK], uy[BLOCK];                   // velocity i - velocity j
  double hx[BLOCK], hy[BLOCK];                   // the same in the middle of the step
  double ri[BLOCK], rj[BLOCK];                   // radii
  double wi[BLOCK], wj[BLOCK];                   // spins
  double vi[BLOCK], vj[BLOCK];                   // spins in the middle of the step
} block;

TAL_KERNEL void fetch(block *b, const tal_sim *sim, const tal_velocities *u, size_t start, int count, unsigned effects) {
  const tal_grains *g = &sim->grains;
  const int32_t *restrict slot_i = sim->pairs.i + start, *restrict slot_j = sim->pairs.j + start;
  for (int k = 0; k < count; k++) {
    int32_t i = slot_i[k], j = slot_j[k];
    b->dx[k] = g->x[i] - g->x[j];
    b->dy[k] = g->y[i] - g->y[j];
    b->ri[k] = g->r[i];
    b->rj[k] = g->r[j];
    if (effects & (TAL_EFFECT_DAMPING | TAL_EFFECT_REGULARISED)) {
      b->ux[k] = u->x[i] - u->x[j];
      b->uy[k] = u->y[i] - u->y[j];
    }
    if ((effects & TAL_EFFECT_SPIN) && (effects & TAL_EFFECT_REGULARISED)) {
      b->wi[k] = u->omega[i];
      b->wj[k] = u->omega[j];
    }
    if (effects & TAL_EFFECT_SPRING) {
      b->hx[k] = u->half_x[i] - u->half_x[j];
      b->hy[k] = u->half_y[i] - u->half_y[j];
    }
    if ((effects & TAL_EFFECT_SPIN) && (effects & TAL_EFFECT_SPRING)) {
      b->vi[k] = u->half_omega[i];
      b->vj[k] = u->half_omega[j];
    }
  }
}

// Slip speed of i against j along t = (-ny, nx), lever arms r - d/2 [eq (9)].
TAL_KERNEL double slip_speed(double nx, double ny, double ux, double uy, double arm_i, double arm_j, double wi,
                             double wj, unsigned effects) {
  double slip = nx * uy - ny * ux;
  if (effects & TAL_EFFECT_SPIN) slip -= arm_i * wi + arm_j * wj;
  return slip;
}

TAL_KERNEL void work_out(const block *restrict b, tal_contacts *slots, size_t start, int count, double dt,
                         tal_law_constants constants, unsigned effects) {
  const double *restrict stiffness = slots->stiffness + start, *restrict damping = slots->damping + start;
  const double *restrict friction = slots->friction + start;
  double *restrict spring = slots->spring + start, *restrict spring_stiffness = slots->spring_stiffness + start;
  double *restrict nx = slots->nx + start, *restrict ny = slots->ny + start, *restrict overlap = slots->overlap + start;
  double *restrict fe = slots->fe + start, *restrict fd = slots->fd + start, *restrict ft = slots->ft + start;
#pragma omp simd
  for (int k = 0; k < count; k++) {
    double distance = sqrt(b->dx[k] * b->dx[k] + b->dy[k] * b->dy[k]);
    double inverse = 1 / distance;
    double x = b->dx[k] * inverse, y = b->dy[k] * inverse;
    tal_meeting m = {.overlap = b->ri[k] + b->rj[k] - distance, .stiffness = stiffness[k], .friction = friction[k]};
    double arm_i = b->ri[k] - 0.5 * m.overlap, arm_j = b->rj[k] - 0.5 * m.overlap;
    if (effects & TAL_EFFECT_DAMPING) {
      m.damping = damping[k];
      m.approach = -(x * b->ux[k] + y * b->uy[k]);
    }
    if (effects & TAL_EFFECT_REGULARISED)
      m.slip = slip_speed(x, y, b->ux[k], b->uy[k], arm_i, arm_j, b->wi[k], b->wj[k], effects);
    if (effects & TAL_EFFECT_SPRING) {
      m.slip_distance = dt * slip_speed(x, y, b->hx[k], b->hy[k], arm_i, arm_j, b->vi[k], b->vj[k], effects);
      m.spring = spring[k];
      m.spring_stiffness = spring_stiffness[k];
    }
    tal_law_force f = tal_contact_law(m, constants, effects);
    nx[k] = x;
    ny[k] = y;
    overlap[k] = m.overlap;
    fe[k] = f.fe;
    fd[k] = f.fd;
    ft[k] = f.ft;
    if (effects & TAL_EFFECT_SPRING) {
      spring[k] = dt > 0 ? f.ft : spring[k];
      spring_stiffness[k] = dt > 0 ? f.spring_stiffness : spring_stiffness[k];
    }
  }
}

TAL_KERNEL void sweep_pairs(tal_sim *sim, const tal_velocities *u, tal_law_constants constants, unsigned effects) {
  const size_t blocks = (sim->pairs.count + BLOCK - 1) / BLOCK;
#pragma omp parallel for schedule(static) if (blocks > 8)
  for (size_t k = 0; k < blocks; k++) {
    block b;
    size_t start = k * BLOCK;
    int count = (int)(sim->pairs.count - start < BLOCK ? sim->pairs.count - start : BLOCK);
    fetch(&b, sim, u, start, count, effects);
    work_out(&b, &sim->pairs, start, count, u->dt, constants, effects);
  }
}

// One grain-wall slot: the wall's own velocity counts, its lever arm is r - d.
static void wall_slot(tal_sim *sim, const tal_velocities *u, tal_law_constants constants, size_t c) {
  tal_contacts *slots = &sim->wall_contacts;
  const tal_grains *g = &sim->grains;
  int32_t i = slots->i[c];
  const tal_wall *wall = &sim->walls.wall[slots->j[c]];
  tal_wall_point near = tal_wall_nearest(wall, g->x[i], g->y[i]);
  tal_meeting m = {.overlap = g->r[i] - near.distance,
                   .stiffness = slots->stiffness[c],
                   .damping = slots->damping[c],
                   .friction = slots->friction[c],
                   .spring = slots->spring[c],
                   .spring_stiffness = slots->spring_stiffness[c]};
  double arm = g->r[i] - m.overlap;
  double ux = u->x[i] - wall->vx, uy = u->y[i] - wall->vy;
  m.approach = -(near.nx * ux + near.ny * uy);
  m.slip = slip_speed(near.nx, near.ny, ux, uy, arm, 0, u->omega[i], 0, sim->effects);
  m.slip_distance = u->dt * slip_speed(near.nx, near.ny, u->half_x[i] - wall->vx, u->half_y[i] - wall->vy, arm, 0,
                                       u->half_omega[i], 0, sim->effects);
  tal_law_force f = tal_contact_law(m, constants, sim->effects);
  slots->nx[c] = near.nx;
  slots->ny[c] = near.ny;
  slots->overlap[c] = m.overlap;
  slots->fe[c] = f.fe;
  slots->fd[c] = f.fd;
  slots->ft[c] = f.ft;
  if (u->dt > 0) {
    slots->spring[c] = f.ft;
    slots->spring_stiffness[c] = f.spring_stiffness;
  }
}

// The variants a profile asked for; any other mask runs the same body with the mask at run time, to the same bits.
#define VARIANTS(X)                                                                                                    \
  X(TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING | TAL_EFFECT_REGULARISED | TAL_EFFECT_SPIN)                                  \
  X(TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING | TAL_EFFECT_SPRING | TAL_EFFECT_SPIN)                                       \
  X(TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING)                                                                             \
  X(TAL_EFFECT_HERTZ)                                                                                                  \
  X(TAL_EFFECT_DAMPING)                                                                                                \
  X(0)

void tal_forces_sweep(tal_sim *sim, tal_velocities velocities) {
  const tal_scene_contact *law = &sim->scene->contact;
  tal_law_constants constants = {.inverse_vR = 1 / sim->constants.vR,
                                 .inverse_exponent = 1 / law->exponent,
                                 .tangential_ratio = sim->constants.tangential_ratio};
  switch (sim->effects & TAL_EFFECT_LAW) {
#define X(mask)                                                                                                        \
  case (mask):                                                                                                         \
    sweep_pairs(sim, &velocities, constants, (mask));                                                                  \
    break;
    VARIANTS(X)
#undef X
  default:
    sweep_pairs(sim, &velocities, constants, sim->effects & TAL_EFFECT_LAW);
  }
  for (size_t c = 0; c < sim->wall_contacts.count; c++) wall_slot(sim, &velocities, constants, c);
}

void tal_forces_slip(tal_sim *sim, tal_velocities u) {
  const tal_grains *g = &sim->grains;
  tal_contacts *slots = &sim->pairs;
  for (size_t c = 0; c < slots->count; c++) {
    int32_t i = slots->i[c], j = slots->j[c];
    slots->slip[c] = slip_speed(slots->nx[c], slots->ny[c], u.x[i] - u.x[j], u.y[i] - u.y[j],
                                g->r[i] - 0.5 * slots->overlap[c], g->r[j] - 0.5 * slots->overlap[c], u.omega[i],
                                u.omega[j], TAL_EFFECT_SPIN);
  }
  slots = &sim->wall_contacts;
  for (size_t c = 0; c < slots->count; c++) {
    int32_t i = slots->i[c];
    const tal_wall *wall = &sim->walls.wall[slots->j[c]];
    slots->slip[c] = slip_speed(slots->nx[c], slots->ny[c], u.x[i] - wall->vx, u.y[i] - wall->vy,
                                g->r[i] - slots->overlap[c], 0, u.omega[i], 0, TAL_EFFECT_SPIN);
  }
}

// ---- gather ---------------------------------------------------------------------------------------------------------

TAL_KERNEL void gather_walls(const tal_sim *sim, size_t grain, tal_resultant *sum) {
  const tal_contacts *s = &sim->wall_contacts;
  for (int32_t c = sim->neighbours.wall_first[grain]; c < sim->neighbours.wall_first[grain + 1]; c++) {
    sum->elastic_x += s->fe[c] * s->nx[c];
    sum->elastic_y += s->fe[c] * s->ny[c];
    sum->viscous_x += s->fd[c] * s->nx[c];
    sum->viscous_y += s->fd[c] * s->ny[c];
    sum->friction_x -= s->ft[c] * s->ny[c];
    sum->friction_y += s->ft[c] * s->nx[c];
    sum->torque -= s->ft[c] * (sim->grains.r[grain] - s->overlap[c]);
  }
}

TAL_KERNEL tal_resultant gather(const tal_sim *sim, size_t grain, unsigned effects) {
  const tal_contacts *s = &sim->pairs;
  const int32_t *slot = sim->neighbours.slot;
  const double r = sim->grains.r[grain];
  tal_resultant sum = {0};
  for (int32_t k = sim->neighbours.first[grain]; k < sim->neighbours.first[grain + 1]; k++) {
    int32_t side = slot[k] >> 31; // -1: the grain is the slot's j
    int32_t c = slot[k] ^ side;
    double sign = 1 + 2 * side;
    double nx = sign * s->nx[c], ny = sign * s->ny[c];
    sum.elastic_x += s->fe[c] * nx;
    sum.elastic_y += s->fe[c] * ny;
    if (effects & TAL_EFFECT_DAMPING) {
      sum.viscous_x += s->fd[c] * nx;
      sum.viscous_y += s->fd[c] * ny;
    }
    if (effects & TAL_EFFECT_FRICTION) {
      sum.friction_x -= s->ft[c] * ny;
      sum.friction_y += s->ft[c] * nx;
      if (effects & TAL_EFFECT_SPIN) sum.torque -= s->ft[c] * (r - 0.5 * s->overlap[c]);
    }
  }
  if (effects & TAL_EFFECT_WALLS) gather_walls(sim, grain, &sum);
  return sum;
}

tal_resultant tal_forces_gather(const tal_sim *sim, size_t grain) {
  return gather(sim, grain, sim->effects | TAL_EFFECT_SPIN);
}

void tal_forces_resultants(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  for (size_t i = 0; i < g->count; i++) {
    tal_resultant f = tal_forces_gather(sim, i);
    g->rx[i] = f.elastic_x + f.viscous_x + f.friction_x;
    g->ry[i] = f.elastic_y + f.viscous_y + f.friction_y;
    g->rtorque[i] = f.torque;
    if (sim->effects & TAL_EFFECT_BOUNDARY) {
      g->rx[i] += g->bx[i];
      g->ry[i] += g->by[i];
    }
  }
}

// One grain: force, second half kick, and the work of this step's forces: dt f . v is the exact discrete work of a force
// that acts over the two half kicks around the instant of v [eq (16)].
TAL_KERNEL void finish_grain(tal_sim *sim, size_t i, double dt, unsigned effects) {
  tal_grains *g = &sim->grains;
  tal_resultant f = gather(sim, i, effects);
  double fx = f.elastic_x + f.viscous_x + f.friction_x, fy = f.elastic_y + f.viscous_y + f.friction_y;
  if (effects & TAL_EFFECT_BOUNDARY) {
    fx += g->bx[i];
    fy += g->by[i];
  }
  if (effects & TAL_EFFECT_GRAVITY) {
    fx += g->mass[i] * sim->scene->gravity[0];
    fy += g->mass[i] * sim->scene->gravity[1];
  }
  double vx = g->vx[i] + 0.5 * dt * (fx * g->inverse_mass[i]), vy = g->vy[i] + 0.5 * dt * (fy * g->inverse_mass[i]);
  g->fx[i] = fx;
  g->fy[i] = fy;
  g->vx[i] = vx;
  g->vy[i] = vy;
  double friction_power = f.friction_x * vx + f.friction_y * vy, held_power = 0;
  if (effects & TAL_EFFECT_SPIN) {
    double omega = g->omega[i] + 0.5 * dt * (f.torque * g->inverse_inertia[i]);
    g->torque[i] = f.torque;
    g->omega[i] = omega;
    friction_power += f.torque * omega;
    if (effects & TAL_EFFECT_HELD) held_power -= g->inverse_inertia[i] == 0 ? f.torque * omega : 0;
  }
  if (effects & TAL_EFFECT_FRICTION) g->friction_work[i] += dt * friction_power;
  if (effects & TAL_EFFECT_DAMPING) g->damping_work[i] += dt * (f.viscous_x * vx + f.viscous_y * vy);
  if (effects & TAL_EFFECT_BOUNDARY) g->boundary_work[i] += dt * (g->bx[i] * vx + g->by[i] * vy);
  if (effects & TAL_EFFECT_HELD) {
    held_power -= g->inverse_mass[i] == 0 ? fx * vx + fy * vy : 0;
    g->held_work[i] += dt * held_power;
  }
}

TAL_KERNEL void finish_all(tal_sim *sim, double dt, unsigned effects) {
#pragma omp parallel for schedule(static) if (sim->grains.count > 500)
  for (size_t i = 0; i < sim->grains.count; i++) finish_grain(sim, i, dt, effects);
}

// A biaxial test with friction, without, and the rest by the run-time mask.
void tal_forces_finish_step(tal_sim *sim, double dt) {
  const unsigned biaxial = TAL_EFFECT_DAMPING | TAL_EFFECT_WALLS | TAL_EFFECT_BOUNDARY;
  const unsigned kinds = TAL_EFFECT_DAMPING | TAL_EFFECT_FRICTION | TAL_EFFECT_SPIN | TAL_EFFECT_GRAVITY |
                         TAL_EFFECT_BOUNDARY | TAL_EFFECT_WALLS | TAL_EFFECT_HELD;
  switch (sim->effects & kinds) {
  case biaxial | TAL_EFFECT_REGULARISED | TAL_EFFECT_SPIN:
    finish_all(sim, dt, biaxial | TAL_EFFECT_REGULARISED | TAL_EFFECT_SPIN);
    break;
  case biaxial | TAL_EFFECT_SPRING | TAL_EFFECT_SPIN:
    finish_all(sim, dt, biaxial | TAL_EFFECT_SPRING | TAL_EFFECT_SPIN);
    break;
  case biaxial:
    finish_all(sim, dt, biaxial);
    break;
  default:
    finish_all(sim, dt, sim->effects & kinds);
  }
}
