#include "friction.h"

#include "effects.h"
#include "forces.h"
#include "law.h"
#include "law_implicit.h"
#include "sim.h"

#include <stdlib.h>

// Contacts of a colour, or grains, from which threads pay; contacts taken at a time.
enum { PARALLEL_FROM = 2000, BLOCK = 64, LANES = 8 };
// Sweeps beyond the scene's number when friction would do work, or while the tolerance is not met.
enum { MORE_SWEEPS = 20, MOST_SWEEPS = 200 };

void tal_friction_init(tal_friction_system *system) {
  *system = (tal_friction_system){0};
}

void tal_friction_clear(tal_friction_system *system) {
  free(system->body);
  free(system->contact);
  free(system->key);
  free(system->order);
  *system = (tal_friction_system){0};
}

static void reserve(tal_friction_system *system, size_t bodies, size_t contacts) {
  if (bodies > system->body_capacity) {
    free(system->body);
    system->body = tal_alloc(bodies, sizeof *system->body);
    system->body_capacity = bodies;
  }
  if (contacts <= system->capacity)
    return;
  system->contact = tal_grow(system->contact, system->capacity, contacts, sizeof *system->contact);
  system->key = tal_grow(system->key, system->capacity, contacts, sizeof *system->key);
  system->order = tal_grow(system->order, system->capacity, contacts, sizeof *system->order);
  system->capacity = contacts;
}

// ---- what there is to solve -----------------------------------------------------------------------------------------

static double slip_of(const tal_friction_contact *c, const tal_friction_body *body) {
  const tal_friction_body *i = &body[c->i], *j = &body[c->j];
  return c->nx * (i->vy - j->vy) - c->ny * (i->vx - j->vx) - c->arm_i * i->spin - c->arm_j * j->spin;
}

static double slip_before(const tal_friction_contact *c, const tal_friction_body *body) {
  const tal_friction_body *i = &body[c->i], *j = &body[c->j];
  return c->nx * (i->before_y - j->before_y) - c->ny * (i->before_x - j->before_x) - c->arm_i * i->before_spin -
         c->arm_j * j->before_spin;
}

// Velocities before the kick and with all forces but friction after it.
static void set_bodies(tal_sim *sim, double kick) {
  const tal_grains *g = &sim->grains;
  const double *gravity = sim->scene->gravity;
  tal_friction_body *body = sim->sticking.body;
  const bool spin = sim->effects & TAL_EFFECT_SPIN, boundary = sim->effects & TAL_EFFECT_BOUNDARY;
#pragma omp parallel for schedule(static) if (g->count > PARALLEL_FROM)
  for (size_t i = 0; i < g->count; i++) {
    tal_resultant f = tal_forces_gather_normal(sim, i);
    double fx = f.elastic_x + f.viscous_x + g->mass[i] * gravity[0];
    double fy = f.elastic_y + f.viscous_y + g->mass[i] * gravity[1];
    if (boundary) {
      fx += g->bx[i];
      fy += g->by[i];
    }
    tal_friction_body *b = &body[i];
    b->before_x = g->vx[i];
    b->before_y = g->vy[i];
    b->before_spin = spin ? g->omega[i] : 0;
    b->inverse_mass = g->inverse_mass[i];
    b->inverse_inertia = spin ? g->inverse_inertia[i] : 0;
    b->vx = b->before_x + kick * (fx * b->inverse_mass);
    b->vy = b->before_y + kick * (fy * b->inverse_mass);
    b->spin = b->before_spin;
  }
  for (size_t w = 0; w < sim->walls.count; w++) {
    const tal_wall *wall = &sim->walls.wall[w];
    body[g->count + w] = (tal_friction_body){wall->vx, wall->vy, 0, wall->vx, wall->vy, 0, 0, 0};
  }
}

// Tangential stiffness now and the spring's force before it moves [eqs (7)-(8)].
static void set_spring(const tal_sim *sim, tal_friction_contact *c, const tal_contacts *slots, double overlap) {
  double slope = sim->effects & TAL_EFFECT_HERTZ ? tal_hertz_slope(slots->stiffness[c->slot], sqrt(overlap))
                                                 : slots->stiffness[c->slot];
  double before = slots->spring_stiffness[c->slot];
  c->spring_stiffness = sim->constants.tangential_ratio * slope;
  c->spring = c->force = slots->spring[c->slot];
  if (c->spring_stiffness < before)
    c->spring *= c->spring_stiffness / before;
}

static void add_contact(tal_sim *sim, const tal_contacts *slots, tal_friction_contact c, double fn, double overlap) {
  c.cap = slots->friction[c.slot] * fn;
  c.force = slots->spring[c.slot];
  if (sim->effects & TAL_EFFECT_SPRING)
    set_spring(sim, &c, slots, overlap);
  sim->sticking.contact[sim->sticking.count++] = c;
}

// Normal force and geometry of the slots that carry any; the others hold no friction.
static void collect_pairs(tal_sim *sim, bool advances) {
  const tal_grains *g = &sim->grains;
  tal_contacts *slots = &sim->pairs;
  for (size_t k = 0; k < slots->count; k++) {
    tal_force_record *f = &sim->force_records[k];
    double fx = f->elastic_x + f->viscous_x, fy = f->elastic_y + f->viscous_y;
    if ((fx == 0 && fy == 0) || slots->friction[k] == 0) {
      f->friction_x = f->friction_y = f->ft = f->ft_half_overlap = 0;
      if (advances)
        slots->spring[k] = slots->spring_stiffness[k] = 0;
      continue;
    }
    int32_t i = slots->i[k], j = slots->j[k];
    double dx = g->x[i] - g->x[j], dy = g->y[i] - g->y[j], distance = sqrt(dx * dx + dy * dy);
    double overlap = g->r[i] + g->r[j] - distance;
    tal_friction_contact c = {.i = i, .j = j, .slot = (int32_t)k, .nx = dx / distance, .ny = dy / distance};
    c.arm_i = g->r[i] - 0.5 * overlap;
    c.arm_j = g->r[j] - 0.5 * overlap;
    add_contact(sim, slots, c, fx * c.nx + fy * c.ny, overlap);
  }
}

static void collect_walls(tal_sim *sim, bool advances) {
  const tal_grains *g = &sim->grains;
  tal_contacts *slots = &sim->wall_contacts;
  for (size_t k = 0; k < slots->count; k++) {
    double fn = slots->fe[k] + slots->fd[k];
    slots->ft[k] = 0;
    if (fn == 0 || slots->friction[k] == 0) {
      if (advances)
        slots->spring[k] = slots->spring_stiffness[k] = 0;
      continue;
    }
    tal_friction_contact c = {.i = slots->i[k],
                              .j = (int32_t)g->count + slots->j[k],
                              .slot = (int32_t)k,
                              .at_wall = 1,
                              .nx = slots->nx[k],
                              .ny = slots->ny[k],
                              .arm_i = g->r[slots->i[k]] - slots->overlap[k]};
    add_contact(sim, slots, c, fn, slots->overlap[k]);
  }
}

static void set_compliances(tal_friction_system *system, double kick, bool spring, bool advances) {
  const tal_friction_body *body = system->body;
  for (size_t k = 0; k < system->count; k++) {
    tal_friction_contact *c = &system->contact[k];
    const tal_friction_body *i = &body[c->i], *j = &body[c->j];
    double compliance = i->inverse_mass + j->inverse_mass + c->arm_i * c->arm_i * i->inverse_inertia +
                        c->arm_j * c->arm_j * j->inverse_inertia;
    c->given = compliance * kick;
    c->before = slip_before(c, body);
    if (!spring)
      continue;
    double moved = advances ? c->spring - c->spring_stiffness * kick * c->before : c->spring;
    c->spring = fmax(-c->cap, fmin(c->cap, moved));
  }
}

// ---- sweeps ---------------------------------------------------------------------------------------------------------

// Constants of a solve.
typedef struct solve {
  tal_friction_system *system;
  size_t grains;
  double kick, inverse_vR, exponent, inverse_exponent;
  bool spring, advances;
} solve;

static double spring_force(const solve *s, const tal_friction_contact *c, double free) {
  return tal_implicit_spring(c->spring, c->spring_stiffness * s->kick, free, c->before, c->given, c->cap);
}

// Gives the two bodies the impulse `p` [N s] along t. A wall is nobody's to write.
static void push(const solve *s, const tal_friction_contact *c, double p) {
  tal_friction_body *i = &s->system->body[c->i];
  double px = -c->ny * p, py = c->nx * p;
  i->vx += px * i->inverse_mass;
  i->vy += py * i->inverse_mass;
  i->spin -= c->arm_i * p * i->inverse_inertia;
  if ((size_t)c->j >= s->grains)
    return;
  tal_friction_body *j = &s->system->body[c->j];
  j->vx -= px * j->inverse_mass;
  j->vy -= py * j->inverse_mass;
  j->spin -= c->arm_j * p * j->inverse_inertia;
}

// Shares of the caps, regularised law. The block is filled up to whole vectors: a scalar rest took most of the time.
static void find_shares(const solve *s, double *free, double *brake, double *share, int count) {
  const double inverse_vR = s->inverse_vR, exponent = s->exponent, inverse_exponent = s->inverse_exponent;
  const int whole = (count + LANES - 1) / LANES * LANES;
  for (int k = count; k < whole; k++)
    free[k] = brake[k] = 0;
#pragma omp simd
  for (int k = 0; k < whole; k++)
    share[k] = tal_implicit_share(fabs(free[k]) * inverse_vR, brake[k], exponent, inverse_exponent);
}

// The forces that are right if nothing else changes, for contacts that share no grain; the largest change over the cap.
static double correct_block(const solve *s, const int32_t *order, int count) {
  tal_friction_contact *contact = s->system->contact;
  double free[BLOCK], brake[BLOCK], share[BLOCK], largest = 0;
  for (int k = 0; k < count; k++) {
    const tal_friction_contact *c = &contact[order[k]];
    free[k] = slip_of(c, s->system->body) - c->given * c->force;
    brake[k] = c->given * c->cap * s->inverse_vR;
  }
  if (!s->spring)
    find_shares(s, free, brake, share, count);
  for (int k = 0; k < count; k++) {
    tal_friction_contact *c = &contact[order[k]];
    double force = free[k] > 0 ? -c->cap * share[k] : c->cap * share[k];
    if (s->spring)
      force = s->advances ? spring_force(s, c, free[k]) : c->spring;
    double change = force - c->force, part = fabs(change) / c->cap;
    c->force = force;
    push(s, c, s->kick * change);
    largest = part > largest ? part : largest;
  }
  return largest;
}

// One sweep over all colours; the largest change of a force over its cap.
static double sweep(const solve *s) {
  tal_friction_system *system = s->system;
  double largest = 0;
  for (size_t k = 0; k < system->colour_count; k++) {
    const int32_t from = system->first[k], to = system->first[k + 1];
    const bool serial = system->serial_last && k + 1 == system->colour_count;
    const int32_t size = serial ? 1 : BLOCK;
#pragma omp parallel for schedule(static) reduction(max : largest) if (to - from > PARALLEL_FROM && !serial)
    for (int32_t m = from; m < to; m += size) {
      double change = correct_block(s, system->order + m, to - m < size ? to - m : size);
      largest = change > largest ? change : largest;
    }
  }
  system->sweeps++;
  return largest;
}

// The forces of the last step, within today's caps.
static void start(const solve *s) {
  for (size_t k = 0; k < s->system->count; k++) {
    tal_friction_contact *c = &s->system->contact[k];
    c->force = fmax(-c->cap, fmin(c->cap, c->force));
    push(s, c, s->kick * c->force);
  }
}

// Work of friction over the kick [J]: each force times the mean of the slips at both ends.
static double work(const solve *s) {
  double sum = 0;
  for (size_t k = 0; k < s->system->count; k++) {
    const tal_friction_contact *c = &s->system->contact[k];
    sum += 0.5 * s->kick * c->force * (c->before + slip_of(c, s->system->body));
  }
  return sum;
}

// With all forces taken down to the share x the work is x A + x^2 B, B > 0: nil at x = -A/B.
static void take_down(const solve *s) {
  tal_friction_system *system = s->system;
  double all = work(s), linear = 0;
  for (size_t k = 0; k < system->count; k++)
    push(s, &system->contact[k], -s->kick * system->contact[k].force);
  linear = work(s);
  double share = linear < 0 ? linear / (linear - all) : 0;
  for (size_t k = 0; k < system->count; k++) {
    system->contact[k].force *= share;
    push(s, &system->contact[k], s->kick * system->contact[k].force);
  }
}

static void settle(const solve *s, const tal_scene_integrator *plan) {
  int64_t sweeps = s->advances ? plan->sweeps : MORE_SWEEPS;
  double change = 0;
  start(s);
  for (int64_t k = 0; k < sweeps; k++)
    change = sweep(s);
  for (int k = 0; k < MOST_SWEEPS && change > plan->tolerance; k++)
    change = sweep(s);
  if (s->spring || !s->advances)
    return;
  for (int k = 0; k < MORE_SWEEPS && work(s) > 0; k++)
    sweep(s);
  if (work(s) > 0)
    take_down(s);
}

// ---- answers --------------------------------------------------------------------------------------------------------

static void answer(tal_sim *sim, const tal_friction_contact *c, bool advances) {
  tal_contacts *slots = c->at_wall ? &sim->wall_contacts : &sim->pairs;
  if (c->at_wall) {
    slots->ft[c->slot] = c->force;
  } else {
    tal_force_record *f = &sim->force_records[c->slot];
    f->friction_x = -c->force * c->ny;
    f->friction_y = c->force * c->nx;
    f->ft = c->force;
    f->ft_half_overlap = c->force * (sim->grains.r[c->i] - c->arm_i);
  }
  if (!advances)
    return;
  bool slides = fabs(c->force) >= c->cap;
  slots->spring[c->slot] = sim->effects & TAL_EFFECT_SPRING && !slides ? c->spring : c->force;
  slots->spring_stiffness[c->slot] = c->spring_stiffness;
}

void tal_friction_solve(tal_sim *sim, double kick, bool advances) {
  const tal_scene_contact *law = &sim->scene->contact;
  tal_friction_system *system = &sim->sticking;
  const bool spring = sim->effects & TAL_EFFECT_SPRING;
  reserve(system, sim->grains.count + sim->walls.count, sim->pairs.count + sim->wall_contacts.count);
  system->count = 0;
  collect_pairs(sim, advances);
  collect_walls(sim, advances);
  tal_friction_colour(system, sim->grains.count);
  set_bodies(sim, kick);
  set_compliances(system, kick, spring, advances);
  solve s = {system,        sim->grains.count, kick,   1 / sim->constants.vR,
             law->exponent, 1 / law->exponent, spring, advances};
  const tal_scene_stage *stage = tal_sim_stage(sim);
  settle(&s, stage ? &stage->integrator : &sim->scene->integrator);
  for (size_t k = 0; k < system->count; k++)
    answer(sim, &system->contact[k], advances);
}
