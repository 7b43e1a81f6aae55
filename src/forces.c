// The hot loop. Slots are taken in blocks: a scalar loop fetches the records of the two grains, a vector loop works out
// geometry and law for the whole block (law.h), a last loop packs the forces into one record per contact. Then each
// grain sums its records in the order of its partners. Measured by tests/bench/bench_step.c.
#include "forces.h"

#include "effects.h"
#include "law.h"

// Contacts and grains taken at a time.
enum { BLOCK = 128, CHUNK = 256 };

// What a block of contacts brings, and what the law makes of it; one array per quantity.
typedef struct block {
  double dx[BLOCK], dy[BLOCK]; // centre i - centre j
  double ux[BLOCK], uy[BLOCK]; // velocity i - velocity j
  double hx[BLOCK], hy[BLOCK]; // the same in the middle of the step
  double reach[BLOCK];         // sum of the radii
  double spins[BLOCK];         // sum of the spins
  double speeds[BLOCK];        // sum of radius times spin
  double force[8][BLOCK];      // members of tal_force_record
} block;

TAL_KERNEL void fetch(block *b, const tal_sim *sim, size_t start, int count, unsigned effects) {
  const int32_t *restrict slot_i = sim->pairs.i + start, *restrict slot_j = sim->pairs.j + start;
  for (int k = 0; k < count; k++) {
    const tal_grain_record *i = &sim->grain_records[slot_i[k]], *j = &sim->grain_records[slot_j[k]];
    TAL_SCALAR_LOOP; // a dozen gathers cost more than two cache lines
    b->dx[k] = i->x - j->x;
    b->dy[k] = i->y - j->y;
    b->reach[k] = i->r + j->r;
    if (effects & (TAL_EFFECT_DAMPING | TAL_EFFECT_REGULARISED)) {
      b->ux[k] = i->ux - j->ux;
      b->uy[k] = i->uy - j->uy;
    }
    if (effects & TAL_EFFECT_SPRING) {
      b->hx[k] = i->hx - j->hx;
      b->hy[k] = i->hy - j->hy;
    }
    if ((effects & TAL_EFFECT_SPIN) && (effects & TAL_EFFECT_FRICTION)) {
      b->spins[k] = i->spin + j->spin;
      b->speeds[k] = i->r * i->spin + j->r * j->spin;
    }
  }
}

// Slip speed of i against j along t = (-ny, nx) with the lever arms r - d/2, eq (9): speeds is r_i w_i + r_j w_j, spins
// is w_i + w_j.
TAL_KERNEL double slip_speed(double nx, double ny, double ux, double uy, double half_overlap, double speeds,
                             double spins, unsigned effects) {
  double slip = nx * uy - ny * ux;
  if (effects & TAL_EFFECT_SPIN)
    slip -= speeds - half_overlap * spins;
  return slip;
}

TAL_KERNEL void work_out(block *b, tal_contacts *slots, size_t start, int count, double dt, tal_law_constants constants,
                         unsigned effects) {
  const double *restrict dx = b->dx, *restrict dy = b->dy, *restrict ux = b->ux, *restrict uy = b->uy;
  const double *restrict hx = b->hx, *restrict hy = b->hy;
  const double *restrict reach = b->reach, *restrict spins = b->spins, *restrict speeds = b->speeds;
  const double *restrict stiffness = slots->stiffness + start, *restrict damping = slots->damping + start;
  const double *restrict friction = slots->friction + start;
  double *restrict spring = slots->spring + start, *restrict spring_stiffness = slots->spring_stiffness + start;
  double *restrict ex = b->force[0], *restrict ey = b->force[1], *restrict vx = b->force[2], *restrict vy = b->force[3];
  double *restrict tx = b->force[4], *restrict ty = b->force[5], *restrict ft = b->force[6], *restrict fh = b->force[7];
#pragma omp simd
  for (int k = 0; k < count; k++) {
    double distance = sqrt(dx[k] * dx[k] + dy[k] * dy[k]);
    double inverse = 1 / distance;
    double x = dx[k] * inverse, y = dy[k] * inverse;
    tal_meeting m = {.overlap = reach[k] - distance, .stiffness = stiffness[k], .friction = friction[k]};
    double half_overlap = 0.5 * m.overlap;
    if (effects & TAL_EFFECT_DAMPING) {
      m.damping = damping[k];
      m.approach = -(x * ux[k] + y * uy[k]);
    }
    if (effects & TAL_EFFECT_REGULARISED)
      m.slip = slip_speed(x, y, ux[k], uy[k], half_overlap, speeds[k], spins[k], effects);
    if (effects & TAL_EFFECT_SPRING) {
      m.slip_distance = dt * slip_speed(x, y, hx[k], hy[k], half_overlap, speeds[k], spins[k], effects);
      m.spring = spring[k];
      m.spring_stiffness = spring_stiffness[k];
    }
    tal_law_force f = tal_contact_law(m, constants, effects);
    ex[k] = f.fe * x;
    ey[k] = f.fe * y;
    if (effects & TAL_EFFECT_DAMPING) {
      vx[k] = f.fd * x;
      vy[k] = f.fd * y;
    }
    if (effects & TAL_EFFECT_FRICTION) {
      tx[k] = -f.ft * y;
      ty[k] = f.ft * x;
      ft[k] = f.ft;
      fh[k] = f.ft * half_overlap;
    }
    if (effects & TAL_EFFECT_SPRING) {
      spring[k] = dt > 0 ? f.ft : spring[k];
      spring_stiffness[k] = dt > 0 ? f.spring_stiffness : spring_stiffness[k];
    }
  }
}

TAL_KERNEL void pack(const block *b, tal_force_record *restrict out, int count, unsigned effects) {
  for (int k = 0; k < count; k++) {
    out[k].elastic_x = b->force[0][k];
    out[k].elastic_y = b->force[1][k];
    out[k].viscous_x = effects & TAL_EFFECT_DAMPING ? b->force[2][k] : 0;
    out[k].viscous_y = effects & TAL_EFFECT_DAMPING ? b->force[3][k] : 0;
    if (effects & TAL_EFFECT_FRICTION) {
      out[k].friction_x = b->force[4][k];
      out[k].friction_y = b->force[5][k];
      out[k].ft = b->force[6][k];
      out[k].ft_half_overlap = b->force[7][k];
    }
  }
}

TAL_KERNEL void sweep_block(tal_sim *sim, double dt, tal_law_constants constants, size_t start, unsigned effects) {
  block b;
  int count = (int)(sim->pairs.count - start < BLOCK ? sim->pairs.count - start : BLOCK);
  fetch(&b, sim, start, count, effects);
  work_out(&b, &sim->pairs, start, count, dt, constants, effects);
  pack(&b, sim->force_records + start, count, effects);
}

// The variants a profile asked for; any other mask runs the same body with the mask at run time, to the same bits.
#define VARIANTS(X)                                                                                                    \
  X(TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING | TAL_EFFECT_REGULARISED | TAL_EFFECT_SPIN)                                  \
  X(TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING | TAL_EFFECT_SPRING | TAL_EFFECT_SPIN)                                       \
  X(TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING)                                                                             \
  X(TAL_EFFECT_HERTZ)                                                                                                  \
  X(TAL_EFFECT_DAMPING)                                                                                                \
  X(0)

static unsigned law_effects(const tal_sim *sim) {
  return sim->effects & (sim->effects & TAL_EFFECT_IMPLICIT ? TAL_EFFECT_NORMAL : TAL_EFFECT_LAW);
}

// The switch stands inside the parallel loop: a parallel region is outlined before inlining, and a mask passed into it
// would no longer be a constant.
static void sweep_variant(tal_sim *sim, double dt, tal_law_constants constants, size_t start) {
  switch (law_effects(sim)) {
#define X(mask)                                                                                                        \
  case (mask):                                                                                                         \
    sweep_block(sim, dt, constants, start, (mask));                                                                    \
    break;
    VARIANTS(X)
#undef X
  default:
    sweep_block(sim, dt, constants, start, law_effects(sim));
  }
}

// One grain-wall slot: the wall's own velocity counts, its lever arm is r - d.
static void wall_slot(tal_sim *sim, double dt, tal_law_constants constants, size_t c) {
  tal_contacts *slots = &sim->wall_contacts;
  const tal_grain_record *g = &sim->grain_records[slots->i[c]];
  const tal_wall *wall = &sim->walls.wall[slots->j[c]];
  tal_wall_point near = tal_wall_nearest(wall, g->x, g->y);
  tal_meeting m = {.overlap = g->r - near.distance,
                   .stiffness = slots->stiffness[c],
                   .damping = slots->damping[c],
                   .friction = slots->friction[c],
                   .spring = slots->spring[c],
                   .spring_stiffness = slots->spring_stiffness[c]};
  double ux = g->ux - wall->vx, uy = g->uy - wall->vy, hx = g->hx - wall->vx, hy = g->hy - wall->vy;
  m.approach = -(near.nx * ux + near.ny * uy);
  m.slip = slip_speed(near.nx, near.ny, ux, uy, m.overlap, g->r * g->spin, g->spin, sim->effects);
  m.slip_distance = dt * slip_speed(near.nx, near.ny, hx, hy, m.overlap, g->r * g->spin, g->spin, sim->effects);
  tal_law_force f = tal_contact_law(m, constants, law_effects(sim));
  slots->nx[c] = near.nx;
  slots->ny[c] = near.ny;
  slots->overlap[c] = m.overlap;
  slots->fe[c] = f.fe;
  slots->fd[c] = f.fd;
  slots->ft[c] = f.ft;
  if (dt > 0 && !(sim->effects & TAL_EFFECT_IMPLICIT)) {
    slots->spring[c] = f.ft;
    slots->spring_stiffness[c] = f.spring_stiffness;
  }
}

void tal_forces_sweep(tal_sim *sim, double dt) {
  const tal_scene_contact *law = &sim->scene->contact;
  tal_law_constants constants = {.inverse_vR = 1 / sim->constants.vR,
                                 .inverse_exponent = 1 / law->exponent,
                                 .tangential_ratio = sim->constants.tangential_ratio};
  const size_t blocks = (sim->pairs.count + BLOCK - 1) / BLOCK;
#pragma omp parallel for schedule(static) if (blocks > 8)
  for (size_t k = 0; k < blocks; k++)
    sweep_variant(sim, dt, constants, k * BLOCK);
  for (size_t c = 0; c < sim->wall_contacts.count; c++)
    wall_slot(sim, dt, constants, c);
}

// Geometry and forces of one grain-grain slot, from the centres and the force record.
static void expand_pair(tal_sim *sim, size_t c) {
  const tal_grains *g = &sim->grains;
  tal_contacts *s = &sim->pairs;
  const tal_force_record *f = &sim->force_records[c];
  const int32_t i = s->i[c], j = s->j[c];
  double dx = g->x[i] - g->x[j], dy = g->y[i] - g->y[j];
  double distance = sqrt(dx * dx + dy * dy), inverse = 1 / distance;
  double nx = dx * inverse, ny = dy * inverse;
  s->nx[c] = nx;
  s->ny[c] = ny;
  s->overlap[c] = g->r[i] + g->r[j] - distance;
  s->fe[c] = f->elastic_x * nx + f->elastic_y * ny;
  s->fd[c] = f->viscous_x * nx + f->viscous_y * ny;
  s->ft[c] = sim->effects & TAL_EFFECT_FRICTION ? f->ft : 0;
  s->slip[c] = slip_speed(nx, ny, g->vx[i] - g->vx[j], g->vy[i] - g->vy[j], 0.5 * s->overlap[c],
                          g->r[i] * g->omega[i] + g->r[j] * g->omega[j], g->omega[i] + g->omega[j], TAL_EFFECT_SPIN);
}

void tal_forces_expand(tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  for (size_t c = 0; c < sim->pairs.count; c++)
    expand_pair(sim, c);
  tal_contacts *s = &sim->wall_contacts;
  for (size_t c = 0; c < s->count; c++) {
    int32_t i = s->i[c];
    const tal_wall *wall = &sim->walls.wall[s->j[c]];
    s->slip[c] = slip_speed(s->nx[c], s->ny[c], g->vx[i] - wall->vx, g->vy[i] - wall->vy, s->overlap[c],
                            g->r[i] * g->omega[i], g->omega[i], TAL_EFFECT_SPIN);
  }
}

void tal_forces_see_now(tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  for (size_t i = 0; i < g->count; i++)
    sim->grain_records[i] =
        (tal_grain_record){g->x[i], g->y[i], g->r[i], g->vx[i], g->vy[i], g->omega[i], g->vx[i], g->vy[i]};
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

// Eight doubles at a time: the members of a force record.
typedef double lanes __attribute__((vector_size(64)));

TAL_KERNEL tal_resultant gather(const tal_sim *sim, size_t grain, unsigned effects) {
  // on the slot's i all as it stands; on its j the vectors change sign, the torque does not
  static const lanes signs[2] = {{1, 1, 1, 1, 1, 1, 1, 1}, {-1, -1, -1, -1, -1, -1, 1, 1}};
  const int32_t *slot = sim->neighbours.slot;
  const lanes *record = (const lanes *)sim->force_records;
  lanes sum = {0};
  for (int32_t k = sim->neighbours.first[grain]; k < sim->neighbours.first[grain + 1]; k++) {
    int32_t side = slot[k] >> 31; // -1: the grain is the slot's j
    sum += signs[-side] * record[slot[k] ^ side];
  }
  tal_resultant f = {.elastic_x = sum[0], .elastic_y = sum[1], .viscous_x = sum[2], .viscous_y = sum[3]};
  if (effects & TAL_EFFECT_FRICTION) {
    f.friction_x = sum[4];
    f.friction_y = sum[5];
    if (effects & TAL_EFFECT_SPIN)
      f.torque = sum[7] - sim->grains.r[grain] * sum[6];
  }
  if (effects & TAL_EFFECT_WALLS)
    gather_walls(sim, grain, &f);
  return f;
}

tal_resultant tal_forces_gather(const tal_sim *sim, size_t grain) {
  return gather(sim, grain, sim->effects | TAL_EFFECT_SPIN);
}

tal_resultant tal_forces_gather_normal(const tal_sim *sim, size_t grain) {
  return gather(sim, grain, sim->effects & ~(unsigned)TAL_EFFECT_FRICTION);
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

// One grain: force, second half kick, and the work of this step's forces: dt f . v is the exact discrete work of a
// force that acts over the two half kicks around the instant of v [eq (16)]; credit is their common length.
TAL_KERNEL void finish_grain(tal_sim *sim, size_t i, double dt, double credit, unsigned effects) {
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
    if (effects & TAL_EFFECT_HELD)
      held_power -= g->inverse_inertia[i] == 0 ? f.torque * omega : 0;
  }
  if (effects & TAL_EFFECT_FRICTION)
    g->friction_work[i] += credit * friction_power;
  if (effects & TAL_EFFECT_DAMPING)
    g->damping_work[i] += credit * (f.viscous_x * vx + f.viscous_y * vy);
  if (effects & TAL_EFFECT_BOUNDARY)
    g->boundary_work[i] += credit * (g->bx[i] * vx + g->by[i] * vy);
  if (effects & TAL_EFFECT_HELD) {
    held_power -= g->inverse_mass[i] == 0 ? fx * vx + fy * vy : 0;
    g->held_work[i] += credit * held_power;
  }
}

TAL_KERNEL void finish_chunk(tal_sim *sim, size_t start, size_t end, double dt, double credit, unsigned effects) {
  for (size_t i = start; i < end; i++)
    finish_grain(sim, i, dt, credit, effects);
}

// A biaxial test with either friction or none; the rest by the run-time mask.
static void finish_variant(tal_sim *sim, size_t start, size_t end, double dt, double credit) {
  enum { biaxial = TAL_EFFECT_DAMPING | TAL_EFFECT_WALLS | TAL_EFFECT_BOUNDARY };
  const unsigned kinds = TAL_EFFECT_DAMPING | TAL_EFFECT_FRICTION | TAL_EFFECT_SPIN | TAL_EFFECT_GRAVITY |
                         TAL_EFFECT_BOUNDARY | TAL_EFFECT_WALLS | TAL_EFFECT_HELD;
  switch (sim->effects & kinds) {
  case biaxial | TAL_EFFECT_REGULARISED | TAL_EFFECT_SPIN:
    finish_chunk(sim, start, end, dt, credit, biaxial | TAL_EFFECT_REGULARISED | TAL_EFFECT_SPIN);
    break;
  case biaxial | TAL_EFFECT_SPRING | TAL_EFFECT_SPIN:
    finish_chunk(sim, start, end, dt, credit, biaxial | TAL_EFFECT_SPRING | TAL_EFFECT_SPIN);
    break;
  case biaxial:
    finish_chunk(sim, start, end, dt, credit, biaxial);
    break;
  default:
    finish_chunk(sim, start, end, dt, credit, sim->effects & kinds);
  }
}

void tal_forces_finish_step(tal_sim *sim, double dt, double credit) {
  const size_t count = sim->grains.count, chunks = (count + CHUNK - 1) / CHUNK;
#pragma omp parallel for schedule(static) if (chunks > 1)
  for (size_t k = 0; k < chunks; k++)
    finish_variant(sim, k * CHUNK, (k + 1) * CHUNK < count ? (k + 1) * CHUNK : count, dt, credit);
}
