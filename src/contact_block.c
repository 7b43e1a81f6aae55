// A block goes through loops of its own: one fetches the records of the grains, four contacts at a time, turns them
// into arrays and works out the normals; a vector loop works out the law with selects in place of branches; regularised
// friction, whose root is a chain of operations as long as all the rest, is put on by two more.
#include "contact_block.h"

#include "damping.h"

// What a block of contacts brings; one array per quantity.
typedef struct meetings {
  double distance[TAL_BLOCK];          // of the centres
  double ux[TAL_BLOCK], uy[TAL_BLOCK]; // velocity i - velocity j
  double hx[TAL_BLOCK], hy[TAL_BLOCK]; // the same in the middle of the step
  double spins[TAL_BLOCK];             // sum of the spins
  double speeds[TAL_BLOCK];            // sum of radius times spin
} __attribute__((aligned(64))) meetings;

// What regularised friction still has to know of them.
typedef struct rubbing {
  double cap[TAL_BLOCK];
  double slip[TAL_BLOCK];  // over vR
  double begun[TAL_BLOCK]; // first half of the root
} __attribute__((aligned(64))) rubbing;

tal_sweep tal_sweep_of(const tal_sim *sim, double dt) {
  const tal_scene_contact *law = &sim->scene->contact;
  return (tal_sweep){.dt = dt,
                     .moves = dt > 0,
                     .law = sim->effects & TAL_EFFECT_LAW,
                     .friction = sim->friction,
                     .damping_time = tal_damping_time_of_slots(sim),
                     .constants = {.inverse_vR = 1 / sim->constants.vR,
                                   .inverse_exponent = 1 / law->exponent,
                                   .tangential_ratio = sim->constants.tangential_ratio}};
}

// way: centre i - centre j; velocities where the law needs them. i, j: records.
TAL_KERNEL void fetch_first(meetings *b, const tal_grain_record *const i[4], const tal_grain_record *const j[4], int k,
                            tal_lanes way[2], unsigned effects) {
  tal_lanes v[4];
  for (int m = 0; m < 4; m++)
    v[m] = *(const tal_lanes *)&i[m]->x - *(const tal_lanes *)&j[m]->x;
  tal_lanes_turn(v);
  way[0] = v[0];
  way[1] = v[1];
  if (effects & (TAL_EFFECT_DAMPING | TAL_EFFECT_REGULARISED)) {
    *(tal_lanes *)&b->ux[k] = v[2];
    *(tal_lanes *)&b->uy[k] = v[3];
  }
}

TAL_KERNEL void fetch_spin(meetings *b, const tal_grain_record *const i[4], const tal_grain_record *const j[4], int k) {
  tal_lanes_pair p[4];
  tal_lanes v[2];
  for (int m = 0; m < 4; m++)
    p[m] = *(const tal_lanes_pair *)&i[m]->spin + *(const tal_lanes_pair *)&j[m]->spin;
  tal_lanes_turn_pairs(p, v);
  *(tal_lanes *)&b->spins[k] = v[0];
  *(tal_lanes *)&b->speeds[k] = v[1];
}

// Velocities in the middle of the step and spins.
TAL_KERNEL void fetch_second(meetings *b, const tal_grain_record *const i[4], const tal_grain_record *const j[4],
                             int k) {
  const tal_lanes_bits minus = {INT64_MIN, INT64_MIN, 0, 0}; // spins add up
  tal_lanes v[4];
  for (int m = 0; m < 4; m++)
    v[m] = *(const tal_lanes *)&i[m]->hx + (tal_lanes)(*(const tal_lanes_bits *)&j[m]->hx ^ minus);
  tal_lanes_turn(v);
  *(tal_lanes *)&b->hx[k] = v[0];
  *(tal_lanes *)&b->hy[k] = v[1];
  *(tal_lanes *)&b->spins[k] = v[2];
  *(tal_lanes *)&b->speeds[k] = v[3];
}

// Distances and normals: root and division take their time while other records are fetched.
TAL_KERNEL void normals(meetings *b, const tal_lanes way[2], int k, tal_force_block *out) {
  tal_lanes distance = way[0] * way[0] + way[1] * way[1];
  tal_lanes_root(&distance);
  const tal_lanes inverse = 1 / distance;
  *(tal_lanes *)&b->distance[k] = distance;
  *(tal_lanes *)&out->x[k] = way[0] * inverse;
  *(tal_lanes *)&out->y[k] = way[1] * inverse;
}

// Whole groups of four; of each the normals beside the next one's records.
TAL_KERNEL void fetch(meetings *b, const tal_grain_record *record, const tal_seat *at, int count, tal_force_block *out,
                      unsigned effects) {
  tal_lanes way[2], before[2] = {{0}, {0}};
  for (int k = 0; k < count; k += 4) {
    const tal_grain_record *i[4], *j[4];
    for (int m = 0; m < 4; m++) {
      i[m] = tal_at(record, at[k + m].i);
      j[m] = tal_at(record, at[k + m].j);
    }
    fetch_first(b, i, j, k, way, effects);
    if (effects & TAL_EFFECT_SPRING)
      fetch_second(b, i, j, k);
    else if (effects & TAL_EFFECT_SPIN && effects & TAL_EFFECT_FRICTION)
      fetch_spin(b, i, j, k);
    if (k)
      normals(b, before, k - 4, out);
    before[0] = way[0];
    before[1] = way[1];
  }
  normals(b, before, (count - 1) & ~3, out);
}

TAL_KERNEL void rub(rubbing *r, const tal_sweep *sweep, int count, tal_force_block *out) {
  const double *restrict slip = r->slip, *restrict cap = r->cap;
  double *restrict begun = r->begun, *restrict friction = out->friction;
  const double inverse_exponent = sweep->constants.inverse_exponent;
#pragma omp simd
  for (int k = 0; k < count; k++)
    begun[k] = tal_root_begin(fabs(slip[k]), inverse_exponent);
#pragma omp simd
  for (int k = 0; k < count; k++)
    friction[k] = tal_regularised_force(cap[k], tal_root_end(fabs(slip[k]), begun[k]), slip[k]);
}

TAL_KERNEL void work_out(const meetings *b, tal_contacts *slots, const tal_sweep *sweep, size_t start, int count,
                         tal_force_block *out, unsigned effects) {
  const double *restrict distance = b->distance, *restrict nx = out->x, *restrict ny = out->y;
  const double *restrict ux = b->ux, *restrict uy = b->uy;
  const double *restrict hx = b->hx, *restrict hy = b->hy, *restrict spins = b->spins, *restrict speeds = b->speeds;
  const double *restrict reach = slots->reach + start, *restrict stiffness = slots->stiffness + start;
  // one time for all contacts, as a scene with `damping` has it, saves an array
  const bool own = slots->damping != NULL;
  const double *restrict viscous = (own ? slots->damping : slots->stiffness) + start;
  const double damping_scale = own ? 1 : sweep->damping_time;
  double unused[2][TAL_BLOCK]; // where histories go that are not to move
  const bool past = effects & TAL_EFFECT_SPRING;
  double *spring = past ? slots->spring + start : unused[0];
  double *spring_stiffness = past ? slots->spring_stiffness + start : unused[1];
  double *new_spring = sweep->moves ? spring : unused[0];
  double *new_spring_stiffness = sweep->moves ? spring_stiffness : unused[1];
  double *restrict fe = out->elastic, *restrict fd = out->viscous;
  double *restrict ft = out->friction, *restrict half = out->half_overlap;
  const tal_law_constants constants = sweep->constants;
  const double friction = sweep->friction, dt = sweep->dt;
  const unsigned at_once = effects & ~(unsigned)TAL_EFFECT_REGULARISED;
  rubbing r;
#pragma omp simd
  for (int k = 0; k < count; k++) {
    const double x = nx[k], y = ny[k];
    tal_meeting m = {.overlap = reach[k] - distance[k], .stiffness = stiffness[k], .friction = friction};
    double half_overlap = 0.5 * m.overlap;
    if (effects & TAL_EFFECT_DAMPING) {
      m.damping = damping_scale * viscous[k];
      m.approach = -(x * ux[k] + y * uy[k]);
    }
    if (effects & TAL_EFFECT_SPRING) {
      // + 0: where dt is 0 a force of -0 stays -0
      m.slip_distance = dt * tal_slip_speed(x, y, hx[k], hy[k], half_overlap, speeds[k], spins[k], effects) + 0.0;
      m.spring = spring[k];
      m.spring_stiffness = spring_stiffness[k];
    }
    tal_law_force f = tal_contact_law(m, constants, at_once);
    fe[k] = f.fe;
    if (effects & TAL_EFFECT_DAMPING)
      fd[k] = f.fd;
    if (effects & TAL_EFFECT_FRICTION)
      half[k] = half_overlap;
    if (effects & TAL_EFFECT_REGULARISED) {
      r.cap[k] = f.cap;
      r.slip[k] = tal_slip_speed(x, y, ux[k], uy[k], half_overlap, speeds[k], spins[k], effects) * constants.inverse_vR;
    }
    if (effects & TAL_EFFECT_SPRING) {
      ft[k] = f.ft;
      new_spring[k] = f.ft;
      new_spring_stiffness[k] = f.spring_stiffness;
    }
  }
  if (effects & TAL_EFFECT_REGULARISED)
    rub(&r, sweep, count, out);
}

TAL_KERNEL void block(tal_sim *sim, const tal_sweep *sweep, const tal_grain_record *record, const tal_seat *at,
                      size_t start, int count, tal_force_block *out, unsigned effects) {
  meetings b;
  fetch(&b, record, at, count, out, effects);
  work_out(&b, &sim->pairs, sweep, start, count, out, effects);
}

// A variant for every combination the law can see, from one body: what is absent costs nothing.
#define DAMPED_OR_NOT(mask) ONE(mask) ONE((mask) | TAL_EFFECT_DAMPING)
#define TURNS_OR_NOT(mask)  DAMPED_OR_NOT(mask) DAMPED_OR_NOT((mask) | TAL_EFFECT_SPIN)
#define EACH_FRICTION(mask)                                                                                            \
  DAMPED_OR_NOT(mask) TURNS_OR_NOT((mask) | TAL_EFFECT_REGULARISED) TURNS_OR_NOT((mask) | TAL_EFFECT_SPRING)
#define EVERY_VARIANT EACH_FRICTION(0) EACH_FRICTION(TAL_EFFECT_HERTZ)

void tal_contact_block(tal_sim *sim, const tal_sweep *sweep, const tal_grain_record *record, const tal_seat *at,
                       size_t start, int count, tal_force_block *out) {
  // without friction it is nothing to a contact that grains turn
  switch (sweep->law & TAL_EFFECT_FRICTION ? sweep->law : sweep->law & ~(unsigned)TAL_EFFECT_SPIN) {
#define ONE(mask)                                                                                                      \
  case (mask):                                                                                                         \
    block(sim, sweep, record, at, start, count, out, (mask));                                                          \
    break;
    EVERY_VARIANT
  }
}
