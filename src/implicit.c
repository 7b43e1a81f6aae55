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
} block;

// ---- bodies ---------------------------------------------------------------------------------------------------------

// Velocities before the kick, and after it with the boundary's forces and gravity alone.
static void set_grains(const solve *s) {
  const tal_grains *g = &s->sim->grains;
  const double *gravity = s->sim->scene->gravity;
  const bool spin = s->effects & TAL_EFFECT_SPIN, boundary = s->effects & TAL_EFFECT_BOUNDARY;
  tal_implicit_body *body = s->system->lane.body;
#pragma omp parallel for schedule(static) if (g->count > PARALLEL_FROM)
  for (size_t i = 0; i < g->count; i++) {
    const double kick = g->inverse_mass[i] > 0 ? s->kick : 0;
    double ax = gravity[0], ay = gravity[1], w = spin ? g->omega[i] : 0;
    if (boundary) {
      ax += g->bx[i] * g->inverse_mass[i];
      ay += g->by[i] * g->inverse_mass[i];
    }
    body[i].place = (tal_lanes){g->x[i], g->y[i], 0, 0};
    body[i].before = (tal_lanes){g->vx[i], g->vy[i], w, w};
    body[i].now = body[i].before + (tal_lanes){kick * ax, kick * ay, 0, 0};
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
    tal_lanes velocity = {wall->vx, wall->vy, 0, 0};
    s->system->lane.body[g->count + c] = (tal_implicit_body){
        {x - near.distance * near.nx, y - near.distance * near.ny, 0, 0}, .now = velocity, .before = velocity};
  }
}

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
  *out = __builtin_shufflevector(__builtin_shufflevector(*i - *j, *i, 0, 1, 6, 6), *j, 0, 1, 2, 7);
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

// Geometry, elastic force and viscosity of a block, and the approach and slip it starts the kick with.
TAL_KERNEL void see(const solve *s, block *b, size_t start, int count, unsigned effects) {
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
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
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
#pragma omp simd
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    double fn = m->elastic[lane] + (effects & TAL_EFFECT_DAMPING ? m->kept_viscous[lane] : 0);
    fn = fn > 0 ? fn : 0;
    m->fn[lane] = m->overlap[lane] > 0 ? fn : 0;
    m->ft[lane] = within(m->kept_spring[lane], m->friction[lane] * m->fn[lane]);
  }
}

// Tangential stiffness now, and the spring's force after it has moved with the step [eqs (7)-(8)].
TAL_KERNEL void move_springs(const solve *s, size_t start, int count, unsigned effects) {
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

TAL_KERNEL void begin_block(const solve *s, size_t start, int count, unsigned effects) {
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
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
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
  block b;
  const double kick = s->kick, inverse_vR = s->inverse_vR;
  const bool advances = s->advances;
  double free[BLOCK], given[BLOCK], brake[BLOCK], slip[BLOCK], share[BLOCK] = {0}, part[BLOCK], largest = 0;
  fetch_velocities(&b, m, start, count, false);
#pragma omp simd
  for (int k = 0; k < count; k++) {
    const size_t lane = start + (size_t)k;
    double yield = 0.5 * kick * (m->mass_i[lane] + m->mass_j[lane]);
    double mean = 0.5 * (m->approach[lane] + approach_of(&b, m, lane, k)) + yield * m->fn[lane];
    double fn = m->overlap[lane] > 0 ? tal_implicit_normal(m->elastic[lane], m->viscosity[lane], mean, yield) : 0;
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
    double change = force - m->ft[lane];
    b.pt[k] = kick * change;
    m->ft[lane] = force;
    part[k] = fabs(change) / (cap > 0 ? cap : 1);
  }
#pragma omp simd reduction(max : largest)
  for (int k = 0; k < count; k++)
    largest = part[k] > largest ? part[k] : largest;
  push(&b, m, start, count);
  return largest;
}

// Takes the share `factor` of all friction off (negative) or adds it, leaving the forces as they are noted.
TAL_KERNEL double press_block(const solve *s, size_t start, int count, double factor) {
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
  block b;
  for (int k = 0; k < count; k++) {
    b.pn[k] = 0;
    b.pt[k] = factor * s->kick * m->ft[start + (size_t)k];
  }
  push(&b, m, start, count);
  return 0;
}

// Work over the kick: each force times the mean of the speeds at both ends.
TAL_KERNEL tal_implicit_works work_of_block(const solve *s, size_t start, int count) {
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
  tal_implicit_works sum = {0, 0};
  for (int k = 0; k < count; k++) {
    sum.friction += friction[k];
    sum.damping += damping[k];
  }
  return (tal_implicit_works){0.5 * s->kick * sum.friction, 0.5 * s->kick * sum.damping};
}

static tal_implicit_works work(const solve *s) {
  tal_implicit *m = s->system;
  const size_t blocks = (m->lanes + BLOCK - 1) / BLOCK;
  tal_implicit_works sum = {0, 0};
#pragma omp parallel for schedule(static) if (m->lanes > PARALLEL_FROM)
  for (size_t k = 0; k < blocks; k++)
    m->partial[k] = work_of_block(s, k * BLOCK, (int)(m->lanes - k * BLOCK < BLOCK ? m->lanes - k * BLOCK : BLOCK));
  for (size_t k = 0; k < blocks; k++) {
    sum.friction += m->partial[k].friction;
    sum.damping += m->partial[k].damping;
  }
  return sum;
}

typedef enum pass { BEGIN, CORRECT, PRESS } pass;

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
  default:
    return press_block(s, start, count, factor);
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

// One block of the colour that begins at lane `from`.
static void take(const solve *s, pass what, size_t from, size_t start, size_t to, size_t size, double factor) {
  const int count = (int)(to - start < size ? to - start : size);
  s->system->partial[(start - from) / size].friction = take_variant(s, what, start, count, factor);
}

// Blocks of one colour. A parallel region costs a small sample more than its work, even when it is told to be none.
static void take_colour(const solve *s, pass what, size_t from, size_t to, size_t size, double factor, bool parallel) {
  if (!parallel) {
    for (size_t start = from; start < to; start += size)
      take(s, what, from, start, to, size, factor);
    return;
  }
#pragma omp parallel for schedule(static)
  for (size_t start = from; start < to; start += size)
    take(s, what, from, start, to, size, factor);
}

// One pass over all colours; the largest of what the blocks return.
static double sweep(const solve *s, pass what, double factor) {
  tal_implicit *m = s->system;
  double largest = 0;
  for (size_t colour = 0; colour < m->colour_count; colour++) {
    const size_t from = m->first[colour], to = m->first[colour + 1];
    const bool serial = m->serial_last && colour + 1 == m->colour_count;
    const size_t size = serial ? TAL_IMPLICIT_VECTOR : BLOCK;
    take_colour(s, what, from, to, size, factor, to - from > PARALLEL_FROM && !serial);
    for (size_t k = 0; k < (to - from + size - 1) / size; k++)
      largest = m->partial[k].friction > largest ? m->partial[k].friction : largest;
  }
  m->sweeps += what == CORRECT;
  return largest;
}

// With all friction taken down to the share x its work is x A + x^2 B, B > 0: nil at x = -A/B.
static tal_implicit_works take_down(const solve *s, double all) {
  tal_implicit *m = s->system;
  sweep(s, PRESS, -1);
  double linear = work(s).friction, share = linear < 0 ? linear / (linear - all) : 0;
  for (size_t lane = 0; lane < m->lanes; lane++)
    m->lane.ft[lane] *= share;
  sweep(s, PRESS, 1);
  couple(s, false);
  return work(s);
}

// Sweeps; the work of a step.
static tal_implicit_works settle(const solve *s, const tal_scene_integrator *plan) {
  int64_t sweeps = s->advances ? plan->sweeps : MORE_SWEEPS;
  double change = 0;
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
  if (!s->advances)
    return (tal_implicit_works){0, 0};
  tal_implicit_works done = work(s);
  if (!(s->effects & TAL_EFFECT_REGULARISED))
    return done;
  for (int k = 0; done.friction > 0 && k < MORE_SWEEPS; k++) {
    sweep(s, CORRECT, 0);
    couple(s, false);
    done = work(s);
  }
  return done.friction > 0 ? take_down(s, done.friction) : done;
}

// ---- answers --------------------------------------------------------------------------------------------------------

static void answer_wall(tal_contacts *slots, const tal_implicit_lanes *m, size_t lane, size_t c) {
  slots->nx[c] = m->nx[lane];
  slots->ny[c] = m->ny[lane];
  slots->overlap[c] = m->overlap[lane];
  slots->fe[c] = m->elastic[lane];
  slots->fd[c] = m->fn[lane] - m->elastic[lane];
  slots->ft[c] = m->ft[lane];
}

static void answer_pair(tal_force_record *f, const tal_implicit_lanes *m, size_t lane) {
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

void tal_implicit_answer(tal_sim *sim) {
  const tal_implicit *s = &sim->implicit;
  const tal_implicit_lanes *m = &s->lane;
  tal_forces_keep(sim);
#pragma omp parallel for schedule(static) if (s->lanes > PARALLEL_FROM)
  for (size_t lane = 0; lane < s->lanes; lane++)
    if (!m->filler[lane] && m->slot[lane] >= 0)
      answer_pair(&sim->force_records[m->slot[lane]], m, lane);
}

static void answer_walls(const solve *s) {
  const tal_implicit_lanes *m = &s->system->lane;
  for (size_t k = 0; k < s->system->wall_lanes; k++) {
    size_t lane = s->system->wall_lane[k];
    answer_wall(&s->sim->wall_contacts, m, lane, (size_t)~m->slot[lane]);
  }
}

// What the next step starts from.
static void keep(const solve *s) {
  const tal_implicit_lanes lanes = s->system->lane, *m = &lanes;
  const bool springs = s->effects & TAL_EFFECT_SPRING;
#pragma omp simd
  for (size_t lane = 0; lane < s->system->lanes; lane++) {
    bool slides = fabs(m->ft[lane]) >= m->friction[lane] * m->fn[lane];
    m->kept_viscous[lane] = m->fn[lane] - m->elastic[lane];
    m->kept_spring[lane] = springs && !slides ? m->spring[lane] : m->ft[lane];
    m->kept_stiffness[lane] = m->spring_stiffness[lane];
  }
}

static tal_implicit_works solve_all(tal_sim *sim, double kick, bool advances) {
  if (sim->implicit.listed != sim->neighbours.rebuilds)
    tal_implicit_list(sim);
  solve s = {.sim = sim,
             .system = &sim->implicit,
             .kick = kick,
             .inverse_vR = 1 / sim->constants.vR,
             .exponent = sim->scene->contact.exponent,
             .tangential_ratio = sim->constants.tangential_ratio,
             .effects = sim->effects,
             .advances = advances};
  const tal_scene_stage *stage = tal_sim_stage(sim);
  set_grains(&s);
  set_walls(&s);
  tal_implicit_works done = settle(&s, stage ? &stage->integrator : &sim->scene->integrator);
  answer_walls(&s);
  if (advances)
    keep(&s);
  sim->forces_kept = false;
  return done;
}

void tal_implicit_observe(tal_sim *sim) {
  solve_all(sim, 0.5 * sim->dt, false);
  tal_implicit_answer(sim);
}

// The bodies hold where the kick ends; the instant is in its middle.
static void take_velocities(tal_sim *sim, double credit) {
  tal_grains *g = &sim->grains;
  const tal_implicit_body *body = sim->implicit.lane.body;
  const double per_kick = 1 / sim->dt;
  const bool spin = sim->effects & TAL_EFFECT_SPIN, boundary = sim->effects & TAL_EFFECT_BOUNDARY;
#pragma omp parallel for schedule(static) if (g->count > PARALLEL_FROM)
  for (size_t i = 0; i < g->count; i++) {
    const tal_lanes mean = 0.5 * (body[i].before + body[i].now), change = per_kick * (body[i].now - body[i].before);
    g->vx[i] = mean[0];
    g->vy[i] = mean[1];
    g->fx[i] = g->mass[i] * change[0];
    g->fy[i] = g->mass[i] * change[1];
    if (spin) {
      g->omega[i] = mean[2];
      g->torque[i] = g->inertia[i] * change[2];
    }
    if (boundary)
      g->boundary_work[i] += credit * (g->bx[i] * mean[0] + g->by[i] * mean[1]);
  }
}

// Books what the contacts did to the grains: a wall slot's part that goes with the wall is the wall's [eq (17)].
static void book(tal_sim *sim, tal_implicit_works done, double credit) {
  const tal_contacts *s = &sim->wall_contacts;
  done.friction /= sim->dt;
  done.damping /= sim->dt;
  for (size_t c = 0; c < s->count; c++) {
    const tal_wall *wall = &sim->walls.wall[s->j[c]];
    done.friction += s->ft[c] * (s->nx[c] * wall->vy - s->ny[c] * wall->vx);
    done.damping += s->fd[c] * (s->nx[c] * wall->vx + s->ny[c] * wall->vy);
  }
  sim->run.friction_work += credit * done.friction;
  sim->run.damping_work += credit * done.damping;
}

void tal_implicit_step(tal_sim *sim, double credit) {
  tal_implicit_works done = solve_all(sim, sim->dt, true);
  if (sim->boundary && sim->boundary->coupled) {
    sim->boundary->coupled(sim, sim->dt);
    sim->run.correcting_work += credit * sim->run.correcting_power;
  }
  if (sim->implicit.all_free) {
    take_velocities(sim, credit);
    book(sim, done, credit);
    return;
  }
  tal_implicit_answer(sim); // what holds a grain has to know the forces on it
  tal_forces_finish_step(sim, sim->dt, credit);
}
