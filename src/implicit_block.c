// Blocks of lanes: geometry, forces of the last step, corrections, impulses to both bodies. Vector loops throughout;
// four bodies at a time are turned into columns and back (lanes.h).
#include "implicit_parts.h"

#include "effects.h"
#include "law.h"
#include "law_implicit.h"

#include <string.h>

enum { BLOCK = TAL_IMPLICIT_BLOCK };

// A block of lanes: velocities of i against j (spins apart), and what is to be pushed.
typedef struct block {
  double dx[BLOCK], dy[BLOCK];                       // centre i - centre j
  double ux[BLOCK], uy[BLOCK], wi[BLOCK], wj[BLOCK]; // velocity i - velocity j, spins
  double pn[BLOCK], pt[BLOCK];                       // impulses [N s] along n and t on i
} block;

TAL_KERNEL void fetch_places(block *b, const tal_implicit_lanes *m, size_t start, int count) {
  for (int k = 0; k < count; k += 4) {
    tal_lanes r[4];
    for (int q = 0; q < 4; q++)
      r[q] = m->body[m->i[start + k + q]].place - m->body[m->j[start + k + q]].place;
    tal_lanes_turn(r);
    memcpy(b->dx + k, &r[0], sizeof r[0]);
    memcpy(b->dy + k, &r[1], sizeof r[1]);
  }
}

// i's velocity less j's; the spins of both.
TAL_KERNEL void meet(const tal_lanes *i, const tal_lanes *j, tal_lanes *out) {
  *out = __builtin_shufflevector(__builtin_shufflevector(*i - *j, *i, 0, 1, 6, 7), *j, 0, 1, 2, 7);
}

TAL_KERNEL void fetch_velocities(block *b, const tal_implicit_lanes *m, size_t start, int count, bool before) {
  for (int k = 0; k < count; k += 4) {
    tal_lanes r[4];
    for (int q = 0; q < 4; q++) {
      const tal_implicit_body *i = &m->body[m->i[start + k + q]], *j = &m->body[m->j[start + k + q]];
      meet(before ? &i->before : &i->now, before ? &j->before : &j->now, &r[q]);
    }
    tal_lanes_turn(r);
    memcpy(b->ux + k, &r[0], sizeof r[0]);
    memcpy(b->uy + k, &r[1], sizeof r[1]);
    memcpy(b->wi + k, &r[2], sizeof r[2]);
    memcpy(b->wj + k, &r[3], sizeof r[3]);
  }
}

// Gives both bodies of each lane its impulses. Wall slots and fillers have bodies of their own.
TAL_KERNEL void push(const block *b, const tal_implicit_lanes *m, size_t start, int count) {
  const double *restrict nx = m->nx + start, *restrict ny = m->ny + start;
  const double *restrict mass_i = m->mass_i + start, *restrict mass_j = m->mass_j + start;
  const double *restrict inertia_i = m->inertia_i + start, *restrict inertia_j = m->inertia_j + start;
  const double *restrict arm_i = m->arm_i + start, *restrict arm_j = m->arm_j + start;
  double xi[BLOCK], yi[BLOCK], wi[BLOCK], xj[BLOCK], yj[BLOCK], wj[BLOCK];
#pragma omp simd
  for (int k = 0; k < count; k++) {
    double px = b->pn[k] * nx[k] - b->pt[k] * ny[k], py = b->pn[k] * ny[k] + b->pt[k] * nx[k];
    xi[k] = px * mass_i[k];
    yi[k] = py * mass_i[k];
    wi[k] = -(arm_i[k] * b->pt[k] * inertia_i[k]);
    xj[k] = -(px * mass_j[k]);
    yj[k] = -(py * mass_j[k]);
    wj[k] = -(arm_j[k] * b->pt[k] * inertia_j[k]);
  }
  for (int k = 0; k < count; k += 4) {
    tal_lanes i[4], j[4];
    memcpy(&i[0], xi + k, sizeof i[0]);
    memcpy(&i[1], yi + k, sizeof i[1]);
    memcpy(&i[2], wi + k, sizeof i[2]);
    i[3] = i[2];
    memcpy(&j[0], xj + k, sizeof j[0]);
    memcpy(&j[1], yj + k, sizeof j[1]);
    memcpy(&j[2], wj + k, sizeof j[2]);
    j[3] = j[2];
    tal_lanes_turn(i);
    tal_lanes_turn(j);
    for (int q = 0; q < 4; q++) {
      m->body[m->i[start + k + q]].now += i[q];
      m->body[m->j[start + k + q]].now += j[q];
    }
  }
}

// Slip of i against j along t = (-ny, nx), eq (9).
TAL_KERNEL double slip_of(const block *b, const tal_implicit_lanes *m, size_t lane, int k) {
  return m->nx[lane] * b->uy[k] - m->ny[lane] * b->ux[k] - (m->arm_i[lane] * b->wi[k] + m->arm_j[lane] * b->wj[k]);
}

TAL_KERNEL double approach_of(const block *b, const tal_implicit_lanes *m, size_t lane, int k) {
  return -(m->nx[lane] * b->ux[k] + m->ny[lane] * b->uy[k]);
}

// ---- the start of a solve -------------------------------------------------------------------------------------------

TAL_KERNEL double within(double value, double cap) {
  double above = value > cap ? cap : value;
  return above < -cap ? -cap : above;
}

// Geometry, elastic force and viscosity of a block, the approach and slip it starts the kick with, and the forces that
// the last step left, within today's bounds.
TAL_KERNEL void see(const tal_implicit_solve *s, block *b, size_t start, int count, unsigned effects) {
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
  const double *restrict left = effects & TAL_EFFECT_SPRING ? m->kept_spring : m->ft;
  fetch_places(b, m, start, count);
  fetch_velocities(b, m, start, count, true);
#pragma omp simd
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    double distance = sqrt(b->dx[k] * b->dx[k] + b->dy[k] * b->dy[k]), inverse = 1 / distance;
    double overlap = m->reach[lane] - distance, viscous = m->fn[lane] - m->elastic[lane];
    m->nx[lane] = b->dx[k] * inverse;
    m->ny[lane] = b->dy[k] * inverse;
    m->overlap[lane] = overlap;
    double share = m->reach[lane] > m->radius_i[lane] ? 0.5 : 1; // of the overlap shortens i's arm: all of it at a wall
    m->arm_i[lane] = m->radius_i[lane] - share * overlap;
    m->arm_j[lane] = m->reach[lane] - m->radius_i[lane] - 0.5 * overlap;
    tal_meeting meeting = {.overlap = overlap, .stiffness = m->stiffness[lane], .damping = m->damping[lane]};
    double elastic = tal_contact_law(meeting, (tal_law_constants){0}, effects & TAL_EFFECT_HERTZ).fe;
    double fn = elastic + (effects & TAL_EFFECT_DAMPING ? viscous : 0);
    fn = fn > 0 && overlap > 0 ? fn : 0;
    m->elastic[lane] = elastic;
    m->viscosity[lane] = effects & TAL_EFFECT_DAMPING ? tal_viscosity(meeting, effects) : 0;
    m->approach[lane] = approach_of(b, m, lane, k);
    m->slip[lane] = slip_of(b, m, lane, k);
    m->fn[lane] = fn;
    m->ft[lane] = within(left[lane], m->friction[lane] * fn);
  }
}

// Tangential stiffness now, and the spring's force after it has moved with the step [eqs (7)-(8)].
TAL_KERNEL void move_springs(const tal_implicit_solve *s, size_t start, int count, unsigned effects) {
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
  const double kick = s->advances ? s->kick : 0, ratio = s->tangential_ratio;
#pragma omp simd
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    double touching = m->overlap[lane] > 0 ? m->overlap[lane] : 0, before = m->kept_stiffness[lane];
    double slope = effects & TAL_EFFECT_HERTZ ? tal_hertz_slope(m->stiffness[lane], sqrt(touching))
                                              : (touching > 0 ? m->stiffness[lane] : 0);
    double stiffness = ratio * slope, spring = m->kept_spring[lane];
    spring = stiffness < before ? spring * (stiffness / before) : spring;
    spring -= stiffness * kick * m->slip[lane];
    m->spring_stiffness[lane] = stiffness;
    m->spring[lane] = within(spring, m->friction[lane] * m->fn[lane]);
  }
}

TAL_KERNEL void begin_block(const tal_implicit_solve *s, size_t start, int count, unsigned effects) {
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
  block b;
  see(s, &b, start, count, effects);
  if (effects & TAL_EFFECT_SPRING)
    move_springs(s, start, count, effects);
#pragma omp simd
  for (int k = 0; k < count; k++) {
    b.pn[k] = s->kick * m->fn[start + (size_t)k];
    b.pt[k] = s->kick * m->ft[start + (size_t)k];
  }
  push(&b, m, start, count);
}

// ---- sweeps ---------------------------------------------------------------------------------------------------------

// Of a friction force over its cap.
TAL_KERNEL double largest_change(const block *b, const tal_implicit_lanes *m, size_t start, int count, double kick) {
  double largest = 0;
#pragma omp simd reduction(max : largest)
  for (int k = 0; k < count; k++) {
    const double cap = kick * m->friction[start + (size_t)k] * m->fn[start + (size_t)k];
    const double part = fabs(b->pt[k]) / (cap > 0 ? cap : 1);
    largest = part > largest ? part : largest;
  }
  return largest;
}

// The forces that are right if nothing else changes; the largest change of a friction force where someone looks.
TAL_KERNEL double correct_block(const tal_implicit_solve *s, size_t start, int count, unsigned effects) {
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
  block b;
  const double kick = s->kick, inverse_vR = s->inverse_vR;
  const bool advances = s->advances;
  double free[BLOCK], given[BLOCK], brake[BLOCK] = {0}, slip[BLOCK] = {0}, share[BLOCK] = {0};
  fetch_velocities(&b, m, start, count, false);
#pragma omp simd
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    double yield = 0.5 * kick * (m->mass_i[lane] + m->mass_j[lane]);
    double mean = 0.5 * (m->approach[lane] + approach_of(&b, m, lane, k)) + yield * m->fn[lane];
    double fn = m->elastic[lane] > 0 ? tal_implicit_normal(m->elastic[lane], m->viscosity[lane], mean, yield) : 0;
    given[k] = kick * (m->mass_i[lane] + m->mass_j[lane] + m->arm_i[lane] * m->arm_i[lane] * m->inertia_i[lane] +
                       m->arm_j[lane] * m->arm_j[lane] * m->inertia_j[lane]);
    free[k] = slip_of(&b, m, lane, k) - given[k] * m->ft[lane];
    brake[k] = given[k] * m->friction[lane] * fn * inverse_vR;
    slip[k] = fabs(free[k]) * inverse_vR;
    b.pn[k] = kick * (fn - m->fn[lane]);
    m->fn[lane] = fn;
  }
  if (effects & TAL_EFFECT_REGULARISED)
    tal_implicit_shares(slip, brake, share, count, s->exponent);
#pragma omp simd
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    double cap = m->friction[lane] * m->fn[lane], force = free[k] > 0 ? -(cap * share[k]) : cap * share[k];
    if (effects & TAL_EFFECT_SPRING) {
      double moved =
          tal_implicit_spring(m->spring[lane], m->spring_stiffness[lane] * kick, free[k], m->slip[lane], given[k], cap);
      force = advances ? moved : within(m->spring[lane], cap);
    }
    b.pt[k] = kick * (force - m->ft[lane]);
    m->ft[lane] = force;
  }
  push(&b, m, start, count);
  return s->looks ? largest_change(&b, m, start, count, kick) : 0;
}

// Takes the share `factor` of all friction off (negative) or adds it, leaving the forces as they are noted.
TAL_KERNEL double press_block(const tal_implicit_solve *s, size_t start, int count, double factor) {
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
  block b;
  for (int k = 0; k < count; k++) {
    b.pn[k] = 0;
    b.pt[k] = factor * s->kick * m->ft[start + (size_t)k];
  }
  push(&b, m, start, count);
  return 0;
}

// The springs that the next step starts from; of all else it finds fn and ft.
TAL_KERNEL void keep_springs(const tal_implicit_lanes *m, size_t start, int count) {
#pragma omp simd
  for (size_t lane = start; lane < start + (size_t)count; lane++) {
    bool slides = fabs(m->ft[lane]) >= m->friction[lane] * m->fn[lane];
    m->kept_spring[lane] = slides ? m->ft[lane] : m->spring[lane];
    m->kept_stiffness[lane] = m->spring_stiffness[lane];
  }
}

// Of whole vectors, each lane for itself before the lanes are added: in an order that depends on no vector's width.
TAL_KERNEL double add_up(const double *value, int count) {
  enum { LANES = TAL_IMPLICIT_VECTOR };
  double lane[LANES] = {0};
  for (int k = 0; k < count; k += LANES)
    for (int m = 0; m < LANES; m++)
      lane[m] += value[k + m];
  return ((lane[0] + lane[4]) + (lane[2] + lane[6])) + ((lane[1] + lane[5]) + (lane[3] + lane[7]));
}

TAL_KERNEL tal_implicit_works work_block(const tal_implicit_solve *s, size_t start, int count, bool springs) {
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
  block b;
  double friction[BLOCK], damping[BLOCK];
  fetch_velocities(&b, m, start, count, false);
#pragma omp simd
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    friction[k] = m->ft[lane] * (m->slip[lane] + slip_of(&b, m, lane, k));
    damping[k] = (m->elastic[lane] - m->fn[lane]) * (m->approach[lane] + approach_of(&b, m, lane, k));
  }
  if (springs)
    keep_springs(m, start, count);
  return (tal_implicit_works){0.5 * s->kick * add_up(friction, count), 0.5 * s->kick * add_up(damping, count)};
}

tal_implicit_works tal_implicit_work(const tal_implicit_solve *s, size_t start, int count) {
  return s->effects & TAL_EFFECT_SPRING ? work_block(s, start, count, true) : work_block(s, start, count, false);
}

// A variant for every combination that a pass looks at, from one body: what is absent costs nothing.
static double take_begin(const tal_implicit_solve *s, size_t start, int count) {
  switch (s->effects & (TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING | TAL_EFFECT_SPRING)) {
#define ONE(mask)                                                                                                      \
  case (mask):                                                                                                         \
    begin_block(s, start, count, (mask));                                                                              \
    return 0;
#define DAMPED_OR_NOT(mask)  ONE(mask) ONE((mask) | TAL_EFFECT_DAMPING)
#define SPRINGS_OR_NOT(mask) DAMPED_OR_NOT(mask) DAMPED_OR_NOT((mask) | TAL_EFFECT_SPRING)
    SPRINGS_OR_NOT(0)
    SPRINGS_OR_NOT(TAL_EFFECT_HERTZ)
  }
  return 0;
}

static double take_correct(const tal_implicit_solve *s, size_t start, int count) {
  if (s->effects & TAL_EFFECT_REGULARISED)
    return correct_block(s, start, count, TAL_EFFECT_REGULARISED);
  if (s->effects & TAL_EFFECT_SPRING)
    return correct_block(s, start, count, TAL_EFFECT_SPRING);
  return correct_block(s, start, count, 0);
}

double tal_implicit_take(const tal_implicit_solve *s, tal_implicit_pass what, size_t start, int count, double factor) {
  switch (what) {
  case TAL_IMPLICIT_BEGIN:
    return take_begin(s, start, count);
  case TAL_IMPLICIT_CORRECT:
    return take_correct(s, start, count);
  default:
    return press_block(s, start, count, factor);
  }
}
