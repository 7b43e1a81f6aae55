#include "implicit.h"

#include "boundary.h"
#include "forces.h"
#include "law.h"
#include "sim.h"

#include <string.h>

// Lanes of a colour, or grains, from which threads pay.
enum { PARALLEL_FROM = 2000 };
// Sweeps beyond the scene's number when friction would do work, or while the tolerance is not met.
enum { MORE_SWEEPS = 20, MOST_SWEEPS = 200 };
enum { BLOCK = TAL_IMPLICIT_BLOCK };

// Constants of a solve.
typedef struct solve {
  tal_sim *sim;
  tal_implicit *system;
  double kick, inverse_vR, exponent, tangential_ratio;
  unsigned effects;
  bool advances;
} solve;

// A block of lanes: velocities of i against j (spins apart), and what is to be pushed.
typedef struct block {
  double dx[BLOCK], dy[BLOCK];                       // centre i - centre j
  double ux[BLOCK], uy[BLOCK], wi[BLOCK], wj[BLOCK]; // velocity i - velocity j, spins
  double pn[BLOCK], pt[BLOCK];                       // impulses [N s] along n and t on i
  double change[BLOCK];                              // of a friction force over its cap
} block;

// ---- bodies ---------------------------------------------------------------------------------------------------------

// Velocities before the kick, and after it with the boundary's forces and gravity alone.
static void set_grains(const solve *s) {
  const tal_grains *g = &s->sim->grains;
  const double *gravity = s->sim->scene->gravity;
  const bool spin = s->effects & TAL_EFFECT_SPIN, boundary = s->effects & TAL_EFFECT_BOUNDARY;
  tal_implicit_body *body = s->system->body;
#pragma omp parallel for schedule(static) if (g->count > PARALLEL_FROM)
  for (size_t i = 0; i < g->count; i++) {
    const double kick = g->inverse_mass[i] > 0 ? s->kick : 0;
    double ax = gravity[0], ay = gravity[1], w = spin ? g->omega[i] : 0;
    if (boundary) {
      ax += g->bx[i] * g->inverse_mass[i];
      ay += g->by[i] * g->inverse_mass[i];
    }
    body[i].place = (tal_v4){g->x[i], g->y[i], 0, 0};
    body[i].before = (tal_v4){g->vx[i], g->vy[i], w, w};
    body[i].now = body[i].before + (tal_v4){kick * ax, kick * ay, 0, 0};
  }
}

// The nearest point of the wall to each grain that may touch it.
static void set_walls(const solve *s) {
  const tal_grains *g = &s->sim->grains;
  const tal_contacts *slots = &s->sim->wall_contacts;
  for (size_t c = 0; c < slots->count; c++) {
    const tal_wall *wall = &s->sim->walls.wall[slots->j[c]];
    double x = g->x[slots->i[c]], y = g->y[slots->i[c]];
    tal_wall_point near = tal_wall_nearest(wall, x, y);
    tal_v4 velocity = {wall->vx, wall->vy, 0, 0};
    s->system->body[g->count + c] = (tal_implicit_body){
        {x - near.distance * near.nx, y - near.distance * near.ny, 0, 0}, .now = velocity, .before = velocity};
  }
}

TAL_KERNEL void fetch_places(block *b, const tal_implicit *m, size_t start, int count) {
  for (int k = 0; k < count; k += 4) {
    tal_v4 r[4];
    for (int q = 0; q < 4; q++)
      r[q] = m->body[m->i[start + k + q]].place - m->body[m->j[start + k + q]].place;
    tal_transpose4(r);
    memcpy(b->dx + k, &r[0], sizeof r[0]);
    memcpy(b->dy + k, &r[1], sizeof r[1]);
  }
}

// i's velocity less j's; the spins of both.
TAL_KERNEL tal_v4 meet(tal_v4 i, tal_v4 j) {
  return __builtin_shufflevector(__builtin_shufflevector(i - j, i, 0, 1, 6, 6), j, 0, 1, 2, 7);
}

TAL_KERNEL void fetch_velocities(block *b, const tal_implicit *m, size_t start, int count, bool before) {
  for (int k = 0; k < count; k += 4) {
    tal_v4 r[4];
    for (int q = 0; q < 4; q++) {
      const tal_implicit_body *i = &m->body[m->i[start + k + q]], *j = &m->body[m->j[start + k + q]];
      r[q] = before ? meet(i->before, j->before) : meet(i->now, j->now);
    }
    tal_transpose4(r);
    memcpy(b->ux + k, &r[0], sizeof r[0]);
    memcpy(b->uy + k, &r[1], sizeof r[1]);
    memcpy(b->wi + k, &r[2], sizeof r[2]);
    memcpy(b->wj + k, &r[3], sizeof r[3]);
  }
}

// Gives both bodies of each lane its impulses. Wall slots and fillers have bodies of their own.
TAL_KERNEL void push(const block *b, tal_implicit *m, size_t start, int count) {
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
    tal_v4 i[4], j[4];
    memcpy(&i[0], xi + k, sizeof i[0]);
    memcpy(&i[1], yi + k, sizeof i[1]);
    memcpy(&i[2], wi + k, sizeof i[2]);
    i[3] = i[2];
    memcpy(&j[0], xj + k, sizeof j[0]);
    memcpy(&j[1], yj + k, sizeof j[1]);
    memcpy(&j[2], wj + k, sizeof j[2]);
    j[3] = j[2];
    tal_transpose4(i);
    tal_transpose4(j);
    for (int q = 0; q < 4; q++) {
      m->body[m->i[start + k + q]].now += i[q];
      m->body[m->j[start + k + q]].now += j[q];
    }
  }
}

// Slip of i against j along t = (-ny, nx), eq (9).
TAL_KERNEL double slip_of(const block *b, const tal_implicit *m, size_t lane, int k) {
  return m->nx[lane] * b->uy[k] - m->ny[lane] * b->ux[k] - (m->arm_i[lane] * b->wi[k] + m->arm_j[lane] * b->wj[k]);
}

TAL_KERNEL double approach_of(const block *b, const tal_implicit *m, size_t lane, int k) {
  return -(m->nx[lane] * b->ux[k] + m->ny[lane] * b->uy[k]);
}

// ---- the start of a solve -------------------------------------------------------------------------------------------

// Geometry, elastic force and viscosity of a block, and the approach and slip it starts the kick with.
TAL_KERNEL void see(const solve *s, block *b, size_t start, int count, unsigned effects) {
  tal_implicit *m = s->system;
  fetch_places(b, m, start, count);
  fetch_velocities(b, m, start, count, true);
#pragma omp simd
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    double distance = sqrt(b->dx[k] * b->dx[k] + b->dy[k] * b->dy[k]), inverse = 1 / distance;
    double overlap = m->reach[lane] - distance;
    m->nx[lane] = b->dx[k] * inverse;
    m->ny[lane] = b->dy[k] * inverse;
    m->overlap[lane] = overlap;
    m->arm_i[lane] = m->radius_i[lane] - m->share_i[lane] * overlap;
    m->arm_j[lane] = m->reach[lane] - m->radius_i[lane] - 0.5 * overlap;
    tal_meeting meeting = {.overlap = overlap, .stiffness = m->stiffness[lane], .damping = m->damping[lane]};
    m->elastic[lane] = tal_contact_law(meeting, (tal_law_constants){0}, effects & TAL_EFFECT_HERTZ).fe;
    m->viscosity[lane] = effects & TAL_EFFECT_DAMPING ? tal_viscosity(meeting, effects) : 0;
    m->approach[lane] = approach_of(b, m, lane, k);
    m->slip[lane] = slip_of(b, m, lane, k);
  }
}

TAL_KERNEL double within(double value, double cap) {
  double above = value > cap ? cap : value;
  return above < -cap ? -cap : above;
}

// The forces of the last step, within today's bounds.
TAL_KERNEL void remember(const solve *s, size_t start, int count, unsigned effects) {
  tal_implicit *m = s->system;
  for (size_t lane = start; lane < start + (size_t)count; lane++) {
    const int32_t slot = m->slot[lane];
    const tal_contacts *slots = slot < 0 ? &s->sim->wall_contacts : &s->sim->pairs;
    const size_t c = (size_t)(slot < 0 ? ~slot : slot);
    double fn = m->elastic[lane] + (effects & TAL_EFFECT_DAMPING ? slots->viscous[c] : 0);
    m->fn[lane] = m->filler[lane] || !(m->overlap[lane] > 0) || !(fn > 0) ? 0 : fn;
    m->ft[lane] = m->filler[lane] ? 0 : within(slots->spring[c], m->friction[lane] * m->fn[lane]);
    if (effects & TAL_EFFECT_SPRING) {
      m->spring[lane] = m->filler[lane] ? 0 : slots->spring[c];
      m->spring_stiffness[lane] = m->filler[lane] ? 0 : slots->spring_stiffness[c];
    }
  }
}

// Tangential stiffness now, and the spring's force after it has moved with the step [eqs (7)-(8)].
TAL_KERNEL void move_springs(const solve *s, size_t start, int count, unsigned effects) {
  tal_implicit *m = s->system;
  for (size_t lane = start; lane < start + (size_t)count; lane++) {
    double touching = m->overlap[lane] > 0 ? m->overlap[lane] : 0, before = m->spring_stiffness[lane];
    double slope = effects & TAL_EFFECT_HERTZ ? tal_hertz_slope(m->stiffness[lane], sqrt(touching))
                                              : (touching > 0 ? m->stiffness[lane] : 0);
    double stiffness = s->tangential_ratio * slope, spring = m->spring[lane];
    if (stiffness < before)
      spring *= stiffness / before;
    if (s->advances)
      spring -= stiffness * s->kick * m->slip[lane];
    m->spring_stiffness[lane] = stiffness;
    m->spring[lane] = within(spring, m->friction[lane] * m->fn[lane]);
  }
}

TAL_KERNEL void begin_block(const solve *s, size_t start, int count, unsigned effects) {
  tal_implicit *m = s->system;
  block b;
  see(s, &b, start, count, effects);
  remember(s, start, count, effects);
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

// The forces that are right if nothing else changes; the largest change of a friction force over its cap.
TAL_KERNEL double correct_block(const solve *s, size_t start, int count, unsigned effects) {
  tal_implicit *m = s->system;
  block b;
  double free[BLOCK], given[BLOCK], brake[BLOCK], slip[BLOCK], share[BLOCK] = {0}, largest = 0;
  fetch_velocities(&b, m, start, count, false);
#pragma omp simd
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    double yield = 0.5 * s->kick * (m->mass_i[lane] + m->mass_j[lane]);
    double mean = 0.5 * (m->approach[lane] + approach_of(&b, m, lane, k)) + yield * m->fn[lane];
    double fn = m->overlap[lane] > 0 ? tal_implicit_normal(m->elastic[lane], m->viscosity[lane], mean, yield) : 0;
    given[k] = s->kick * (m->mass_i[lane] + m->mass_j[lane] + m->arm_i[lane] * m->arm_i[lane] * m->inertia_i[lane] +
                          m->arm_j[lane] * m->arm_j[lane] * m->inertia_j[lane]);
    free[k] = slip_of(&b, m, lane, k) - given[k] * m->ft[lane];
    brake[k] = given[k] * m->friction[lane] * fn * s->inverse_vR;
    slip[k] = fabs(free[k]) * s->inverse_vR;
    b.pn[k] = s->kick * (fn - m->fn[lane]);
    m->fn[lane] = fn;
  }
  if (effects & TAL_EFFECT_REGULARISED)
    tal_implicit_shares(slip, brake, share, count, s->exponent);
#pragma omp simd reduction(max : largest)
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    double cap = m->friction[lane] * m->fn[lane], force = free[k] > 0 ? -(cap * share[k]) : cap * share[k];
    if (effects & TAL_EFFECT_SPRING) {
      double moved = tal_implicit_spring(m->spring[lane], m->spring_stiffness[lane] * s->kick, free[k], m->slip[lane],
                                         given[k], cap);
      force = s->advances ? moved : within(m->spring[lane], cap);
    }
    double change = force - m->ft[lane], part = cap > 0 ? fabs(change) / cap : 0;
    b.pt[k] = s->kick * change;
    m->ft[lane] = force;
    largest = part > largest ? part : largest;
  }
  push(&b, m, start, count);
  return largest;
}

// Takes the share `factor` of all friction off (negative) or adds it, leaving the forces as they are noted.
TAL_KERNEL double press_block(const solve *s, size_t start, int count, double factor) {
  tal_implicit *m = s->system;
  block b;
  for (int k = 0; k < count; k++) {
    b.pn[k] = 0;
    b.pt[k] = factor * s->kick * m->ft[start + (size_t)k];
  }
  push(&b, m, start, count);
  return 0;
}

// Work of friction over the kick [J]: each force times the mean of the slips at both ends.
TAL_KERNEL double work_of_block(const solve *s, size_t start, int count) {
  const tal_implicit *m = s->system;
  block b;
  double work = 0;
  fetch_velocities(&b, m, start, count, false);
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    work += m->ft[lane] * (m->slip[lane] + slip_of(&b, m, lane, k));
  }
  return 0.5 * s->kick * work;
}

typedef enum pass { BEGIN, CORRECT, PRESS, WORK } pass;

// The variants a profile asked for; any other mask runs the same body with the mask at run time, to the same bits.
#define VARIANTS(X)                                                                                                    \
  X(TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING | TAL_EFFECT_REGULARISED)                                                    \
  X(TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING | TAL_EFFECT_SPRING)

TAL_KERNEL double take_block(const solve *s, pass what, size_t start, int count, double factor, unsigned effects) {
  switch (what) {
  case BEGIN:
    begin_block(s, start, count, effects);
    return 0;
  case CORRECT:
    return correct_block(s, start, count, effects);
  case PRESS:
    return press_block(s, start, count, factor);
  default:
    return work_of_block(s, start, count);
  }
}

static double take_variant(const solve *s, pass what, size_t start, int count, double factor) {
  const unsigned kinds = TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING | TAL_EFFECT_FRICTION;
  switch (s->effects & kinds) {
#define X(mask)                                                                                                        \
  case (mask):                                                                                                         \
    return take_block(s, what, start, count, factor, (mask));
    VARIANTS(X)
#undef X
  default:
    return take_block(s, what, start, count, factor, s->effects & kinds);
  }
}

// What a boundary imposes on the loop is met by forces of its own, found beside those of the contacts.
static void couple(const solve *s, bool first) {
  const tal_boundary *boundary = s->sim->boundary;
  if (boundary && boundary->couple && s->advances)
    boundary->couple(s->sim, s->kick, first);
}

// One pass over all colours. WORK returns a sum, the others the largest of what the blocks return.
static double sweep(const solve *s, pass what, double factor) {
  tal_implicit *m = s->system;
  double largest = 0, sum = 0;
  for (size_t colour = 0; colour < m->colour_count; colour++) {
    const size_t from = m->first[colour], to = m->first[colour + 1];
    const bool serial = m->serial_last && colour + 1 == m->colour_count;
    const size_t size = serial ? TAL_IMPLICIT_VECTOR : BLOCK;
#pragma omp parallel for schedule(static) if (to - from > PARALLEL_FROM && !serial)
    for (size_t start = from; start < to; start += size)
      m->partial[(start - from) / size] =
          take_variant(s, what, start, (int)(to - start < size ? to - start : size), factor);
    for (size_t k = 0; k < (to - from + size - 1) / size; k++) {
      largest = m->partial[k] > largest ? m->partial[k] : largest;
      sum += m->partial[k];
    }
  }
  m->sweeps += what == CORRECT;
  return what == WORK ? sum : largest;
}

// With all friction taken down to the share x its work is x A + x^2 B, B > 0: nil at x = -A/B.
static void take_down(const solve *s, double all) {
  tal_implicit *m = s->system;
  sweep(s, PRESS, -1);
  double linear = sweep(s, WORK, 0), share = linear < 0 ? linear / (linear - all) : 0;
  for (size_t lane = 0; lane < m->lanes; lane++)
    m->ft[lane] *= share;
  sweep(s, PRESS, 1);
}

static void settle(const solve *s, const tal_scene_integrator *plan) {
  int64_t sweeps = s->advances ? plan->sweeps : MORE_SWEEPS;
  double change = 0, work = 0;
  sweep(s, BEGIN, 0);
  couple(s, true);
  for (int64_t k = 0; k < sweeps; k++) {
    change = sweep(s, CORRECT, 0);
    couple(s, false);
  }
  for (int k = 0; k < MOST_SWEEPS && change > plan->tolerance; k++) {
    change = sweep(s, CORRECT, 0);
    couple(s, false);
  }
  if (!(s->effects & TAL_EFFECT_REGULARISED) || !s->advances)
    return;
  for (int k = 0; (work = sweep(s, WORK, 0)) > 0 && k < MORE_SWEEPS; k++) {
    sweep(s, CORRECT, 0);
    couple(s, false);
  }
  if (work > 0)
    take_down(s, work);
}

// ---- answers --------------------------------------------------------------------------------------------------------

static void answer_wall(tal_contacts *slots, const tal_implicit *m, size_t lane, size_t c) {
  slots->nx[c] = m->nx[lane];
  slots->ny[c] = m->ny[lane];
  slots->overlap[c] = m->overlap[lane];
  slots->fe[c] = m->elastic[lane];
  slots->fd[c] = m->fn[lane] - m->elastic[lane];
  slots->ft[c] = m->ft[lane];
}

static void answer_pair(tal_force_record *f, const tal_implicit *m, size_t lane) {
  double nx = m->nx[lane], ny = m->ny[lane], ft = m->ft[lane], viscous = m->fn[lane] - m->elastic[lane];
  *f = (tal_force_record){.elastic_x = m->elastic[lane] * nx,
                          .elastic_y = m->elastic[lane] * ny,
                          .viscous_x = viscous * nx,
                          .viscous_y = viscous * ny,
                          .friction_x = -ft * ny,
                          .friction_y = ft * nx,
                          .ft = ft,
                          .ft_half_overlap = ft * (m->radius_i[lane] - m->arm_i[lane])};
}

static void answer(const solve *s, size_t lane) {
  const tal_implicit *m = s->system;
  if (m->filler[lane])
    return;
  const bool wall = m->slot[lane] < 0, springs = s->effects & TAL_EFFECT_SPRING;
  const size_t c = (size_t)(wall ? ~m->slot[lane] : m->slot[lane]);
  tal_contacts *slots = wall ? &s->sim->wall_contacts : &s->sim->pairs;
  if (wall)
    answer_wall(slots, m, lane, c);
  else
    answer_pair(&s->sim->force_records[c], m, lane);
  if (!s->advances)
    return;
  bool slides = fabs(m->ft[lane]) >= m->friction[lane] * m->fn[lane];
  slots->viscous[c] = m->fn[lane] - m->elastic[lane];
  slots->spring[c] = springs && !slides ? m->spring[lane] : m->ft[lane];
  slots->spring_stiffness[c] = m->spring_stiffness[lane];
}

void tal_implicit_solve(tal_sim *sim, double kick, bool advances) {
  const tal_scene_contact *law = &sim->scene->contact;
  if (sim->implicit.listed != sim->neighbours.rebuilds)
    tal_implicit_list(sim);
  solve s = {.sim = sim,
             .system = &sim->implicit,
             .kick = kick,
             .inverse_vR = 1 / sim->constants.vR,
             .exponent = law->exponent,
             .tangential_ratio = sim->constants.tangential_ratio,
             .effects = sim->effects,
             .advances = advances};
  set_grains(&s);
  set_walls(&s);
  const tal_scene_stage *stage = tal_sim_stage(sim);
  settle(&s, stage ? &stage->integrator : &sim->scene->integrator);
#pragma omp parallel for schedule(static) if (s.system->lanes > PARALLEL_FROM)
  for (size_t lane = 0; lane < s.system->lanes; lane++)
    answer(&s, lane);
}
