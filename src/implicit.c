#include "implicit_parts.h"

#include "boundary.h"
#include "forces.h"
#include "law.h"

// Grains from which threads pay.
enum { PARALLEL_FROM = TAL_IMPLICIT_TILES_FROM };
// Sweeps beyond the scene's number when friction would do work, or while the tolerance is not met.
enum { MORE_SWEEPS = 20, MOST_SWEEPS = 200 };
// Passes that go through the tiles together.
enum { AT_ONCE = 8 };

// The nearest point of the wall to each grain that may touch it.
static void set_walls(const tal_implicit_solve *s) {
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

// ---- sweeps ---------------------------------------------------------------------------------------------------------

static tal_implicit_works work(const tal_implicit_solve *s) {
  const tal_implicit *m = s->system;
  tal_implicit_works sum = {0, 0};
  for (size_t t = 0; t < m->tiles; t++) {
    sum.friction += m->tile[t].work.friction;
    sum.damping += m->tile[t].work.damping;
  }
  return sum;
}

static double largest_change(const tal_implicit_solve *s) {
  double largest = 0;
  for (size_t t = 0; t < s->system->tiles; t++)
    largest = s->system->tile[t].change > largest ? s->system->tile[t].change : largest;
  return largest;
}

// Passes that are to come.
typedef struct queue {
  tal_implicit_pass pass[AT_ONCE];
  int count;
} queue;

static void flush(const tal_implicit_solve *s, queue *q) {
  tal_implicit_passes(s, q->pass, q->count, 1);
  q->count = 0;
}

static void put(const tal_implicit_solve *s, queue *q, tal_implicit_pass pass) {
  if (q->count == AT_ONCE)
    flush(s, q);
  q->pass[q->count++] = pass;
}

// What a boundary imposes on the loop is met by forces of its own, found beside those of the contacts.
static void couple(const tal_implicit_solve *s, queue *q, bool first) {
  const tal_boundary *boundary = s->sim->boundary;
  if (!boundary || !boundary->couple || !s->advances)
    return;
  flush(s, q);
  boundary->couple(s->sim, s->kick, first);
}

static void sweep(const tal_implicit_solve *s, queue *q) {
  put(s, q, TAL_IMPLICIT_CORRECT);
  couple(s, q, false);
  s->system->sweeps++;
}

static tal_implicit_works sweep_again(const tal_implicit_solve *s, queue *q) {
  sweep(s, q);
  if (s->advances)
    put(s, q, TAL_IMPLICIT_WORK);
  flush(s, q);
  return work(s);
}

// With all friction taken down to the share x its work is x A + x^2 B, B > 0: nil at x = -A/B.
static tal_implicit_works take_down(const tal_implicit_solve *s, queue *q, double all) {
  static const tal_implicit_pass off[] = {TAL_IMPLICIT_PRESS, TAL_IMPLICIT_WORK};
  tal_implicit *m = s->system;
  tal_implicit_passes(s, off, 2, -1);
  double linear = work(s).friction, share = linear < 0 ? linear / (linear - all) : 0;
  for (size_t lane = 0; lane < m->lanes; lane++)
    m->lane.ft[lane] *= share;
  put(s, q, TAL_IMPLICIT_PRESS);
  couple(s, q, false);
  put(s, q, TAL_IMPLICIT_WORK);
  flush(s, q);
  return work(s);
}

// Sweeps; the work of a step.
static tal_implicit_works settle(const tal_implicit_solve *s, const tal_scene_integrator *plan) {
  const int64_t sweeps = s->advances ? plan->sweeps : MORE_SWEEPS;
  queue q = {.count = 0};
  put(s, &q, TAL_IMPLICIT_SET);
  put(s, &q, TAL_IMPLICIT_BEGIN);
  couple(s, &q, true);
  for (int64_t k = 0; k < sweeps; k++)
    sweep(s, &q);
  if (s->advances)
    put(s, &q, TAL_IMPLICIT_WORK);
  flush(s, &q);
  for (int k = 0; k < MOST_SWEEPS && largest_change(s) > plan->tolerance; k++)
    sweep_again(s, &q);
  if (!s->advances)
    return (tal_implicit_works){0, 0};
  tal_implicit_works done = work(s);
  if (!(s->effects & TAL_EFFECT_REGULARISED))
    return done;
  for (int k = 0; done.friction > 0 && k < MORE_SWEEPS; k++)
    done = sweep_again(s, &q);
  return done.friction > 0 ? take_down(s, &q, done.friction) : done;
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

static void answer_walls(const tal_implicit_solve *s) {
  const tal_implicit_lanes *m = &s->system->lane;
  for (size_t k = 0; k < s->system->wall_lanes; k++) {
    size_t lane = s->system->wall_lane[k];
    answer_wall(&s->sim->wall_contacts, m, lane, (size_t)~m->slot[lane]);
  }
}

static tal_implicit_works solve_all(tal_sim *sim, double kick, bool advances) {
  if (sim->implicit.listed != sim->neighbours.rebuilds)
    tal_implicit_list(sim);
  const tal_scene_stage *stage = tal_sim_stage(sim);
  const tal_scene_integrator *plan = stage ? &stage->integrator : &sim->scene->integrator;
  tal_implicit_solve s = {.sim = sim,
                          .system = &sim->implicit,
                          .kick = kick,
                          .inverse_vR = 1 / sim->constants.vR,
                          .exponent = sim->scene->contact.exponent,
                          .tangential_ratio = sim->constants.tangential_ratio,
                          .effects = sim->effects,
                          .advances = advances,
                          .looks = !isnan(plan->tolerance)};
  set_walls(&s);
  tal_implicit_works done = settle(&s, plan);
  answer_walls(&s);
  sim->forces_kept = false;
  return done;
}

void tal_implicit_observe(tal_sim *sim) {
  tal_implicit_save(sim);
  solve_all(sim, 0.5 * sim->dt, false);
  tal_implicit_answer(sim);
  sim->implicit.listed = UINT64_MAX;
}

// The bodies hold where the kick ends; the instant is in its middle.
static void take_one(tal_grains *g, const tal_implicit_body *body, size_t i, double per_kick, bool spin) {
  const tal_lanes mean = 0.5 * (body[i].before + body[i].now), change = per_kick * (body[i].now - body[i].before);
  g->vx[i] = mean[0];
  g->vy[i] = mean[1];
  g->fx[i] = g->mass[i] * change[0];
  g->fy[i] = g->mass[i] * change[1];
  if (spin) {
    g->omega[i] = mean[2];
    g->torque[i] = g->inertia[i] * change[2];
  }
}

// The same for grains i ... i + 3, i a multiple of 4.
static void take_four(tal_grains *g, const tal_implicit_body *body, size_t i, double per_kick, bool spin) {
  tal_lanes mean[4], change[4];
  for (size_t q = 0; q < 4; q++) {
    mean[q] = 0.5 * (body[i + q].before + body[i + q].now);
    change[q] = per_kick * (body[i + q].now - body[i + q].before);
  }
  tal_lanes_turn(mean);
  tal_lanes_turn(change);
  *(tal_lanes *)&g->vx[i] = mean[0];
  *(tal_lanes *)&g->vy[i] = mean[1];
  *(tal_lanes *)&g->fx[i] = *(const tal_lanes *)&g->mass[i] * change[0];
  *(tal_lanes *)&g->fy[i] = *(const tal_lanes *)&g->mass[i] * change[1];
  if (spin) {
    *(tal_lanes *)&g->omega[i] = mean[2];
    *(tal_lanes *)&g->torque[i] = *(const tal_lanes *)&g->inertia[i] * change[2];
  }
}

// In eight sums, so that none waits for the one before.
static double boundary_power(const tal_grains *g) {
  enum { SUMS = 8 };
  double sum[SUMS] = {0}, all = 0;
  for (size_t i = 0; i < g->count; i += SUMS)
    for (size_t k = 0; k < SUMS && i + k < g->count; k++)
      sum[k] += g->bx[i + k] * g->vx[i + k] + g->by[i + k] * g->vy[i + k];
  for (size_t k = 0; k < SUMS; k++)
    all += sum[k];
  return all;
}

static void take_velocities(tal_sim *sim, double credit) {
  tal_grains *g = &sim->grains;
  const tal_implicit_body *body = sim->implicit.lane.body;
  const double per_kick = 1 / sim->dt;
  const bool spin = sim->effects & TAL_EFFECT_SPIN;
  const size_t whole = g->count & ~(size_t)3;
#pragma omp parallel for schedule(static) if (g->count > PARALLEL_FROM)
  for (size_t i = 0; i < whole; i += 4)
    take_four(g, body, i, per_kick, spin);
  for (size_t i = whole; i < g->count; i++)
    take_one(g, body, i, per_kick, spin);
  if (sim->effects & TAL_EFFECT_BOUNDARY)
    sim->run.boundary_work += credit * boundary_power(g);
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
    tal_forces_forget(sim);
    take_velocities(sim, credit);
    book(sim, done, credit);
    return;
  }
  tal_implicit_answer(sim); // what holds a grain has to know the forces on it
  tal_forces_finish_step(sim, sim->dt, credit);
}
