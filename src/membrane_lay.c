// Laying a membrane (92), and looking whether it is still one. A chain starts as a straight line beside the sample and
// is moved by its own forces, with the energy taken out whenever it is at its peak, until it rests on the grains, which
// stand still meanwhile.
#include "membrane.h"

#include "boundary_loop.h"
#include "sim.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_ROUNDS = 40000, LOOK_EVERY = 20 };
// At rest: the largest force left on a bead over the pressure on a link.
static const double at_rest = 1e-4;

static double or_else(double value, double otherwise) {
  return isnan(value) ? otherwise : value;
}

// Mass of a grain of that radius, by the mean grain's density.
static double grain_mass(const tal_sim *sim, double radius) {
  const tal_grains *g = &sim->grains;
  const bool sphere = sim->scene->grains.shape == TAL_SPHERE;
  double mass = 0, size = 0;
  for (size_t i = 0; i < g->count; i++) {
    mass += g->mass[i];
    size += sphere ? g->r[i] * g->r[i] * g->r[i] : g->r[i] * g->r[i];
  }
  return mass / size * (sphere ? radius * radius * radius : radius * radius);
}

// One chain of `links` links from the bottom to the top plate, clear of the grains.
static void place_chain(tal_sim *sim, const tal_scene_membrane *plan, size_t first, size_t links, int side) {
  tal_membrane *m = &sim->membrane;
  const tal_grains *g = &sim->grains;
  const double low = tal_walls_plate(&sim->walls, +1)->y0, high = tal_walls_plate(&sim->walls, -1)->y0;
  const double radius = or_else(plan->radius, 1.25 * sim->constants.mean_radius);
  const double length = (high - low) / (double)links;
  double x = -(double)INFINITY;
  for (size_t i = 0; i < g->count; i++)
    x = fmax(x, side * g->x[i] + g->r[i]);
  for (size_t k = 0; k <= links; k++) {
    const size_t b = first + k;
    m->side[b] = side;
    m->x[b] = side * (x + radius);
    m->y[b] = k == links ? high : low + (double)k * length;
    m->r[b] = radius;
    m->mass[b] = or_else(plan->mass, grain_mass(sim, radius));
    m->rest[b] = k == links ? 0 : length - plan->prestress / plan->stiffness;
    m->stiffness[b] = plan->stiffness;
    m->damping[b] = 2 * plan->damping * sqrt(plan->stiffness * m->mass[b]);
    m->plate[b] = k == 0 ? 1 : k == links ? -1 : 0;
  }
}

// A step that is safe for the beads alone: link and contact stiffness over the lightest bead.
static double safe_step(const tal_sim *sim) {
  double(*sum)[2] = tal_alloc(sim->grains.count, sizeof *sum);
  double step = tal_membrane_critical(sim, sum);
  free(sum);
  return 0.3 * step;
}

// Semi-implicit Euler; the ends keep their height.
static void move(tal_membrane *m, double dt) {
  for (size_t b = 0; b < m->count; b++) {
    m->vx[b] += dt * m->rx[b] / m->mass[b];
    m->vy[b] = m->plate[b] != 0 ? 0 : m->vy[b] + dt * m->ry[b] / m->mass[b];
    m->x[b] += dt * m->vx[b];
    m->y[b] += dt * m->vy[b];
    m->ux[b] = m->vx[b];
    m->uy[b] = m->vy[b];
  }
}

static void stop(tal_membrane *m) {
  const size_t bytes = m->count * sizeof(double);
  memset(m->vx, 0, bytes);
  memset(m->vy, 0, bytes);
  memset(m->ux, 0, bytes);
  memset(m->uy, 0, bytes);
}

static double largest_force(const tal_membrane *m) {
  double largest = 0;
  for (size_t b = 0; b < m->count; b++)
    largest = fmax(largest, fmax(fabs(m->rx[b]), m->plate[b] != 0 ? 0 : fabs(m->ry[b])));
  return largest;
}

static bool settle(tal_sim *sim) {
  tal_membrane *m = &sim->membrane;
  const double small = at_rest * sim->run.pressure * sim->constants.thickness * 2 * m->r[0];
  double dt = 0, before = 0;
  for (int round = 0; round < MOST_ROUNDS; round++) {
    tal_membrane_forces(sim);
    if (round % LOOK_EVERY == 0) {
      dt = safe_step(sim);
      if (round > 0 && largest_force(m) < small) {
        stop(m);
        tal_membrane_forces(sim);
        return true;
      }
    }
    move(m, dt);
    double now = tal_membrane_kinetic(m);
    if (now < before) {
      stop(m);
      now = 0;
    }
    before = now;
  }
  stop(m);
  return false;
}

bool tal_membrane_lay(tal_sim *sim, const tal_scene_membrane *plan) {
  const double low = tal_walls_plate(&sim->walls, +1)->y0, high = tal_walls_plate(&sim->walls, -1)->y0;
  const double radius = or_else(plan->radius, 1.25 * sim->constants.mean_radius);
  const size_t links = (size_t)fmax(2, ceil((high - low) / (2 * radius)));
  tal_grains *g = &sim->grains;
  tal_membrane_init(&sim->membrane, 2 * (links + 1));
  place_chain(sim, plan, 0, links, -1);
  place_chain(sim, plan, links + 1, links, +1);
  memset(g->ux, 0, g->count * sizeof *g->ux); // the grains stand still
  memset(g->uy, 0, g->count * sizeof *g->uy);
  bool rests = settle(sim);
  memset(g->bx, 0, g->count * sizeof *g->bx); // of the laying
  memset(g->by, 0, g->count * sizeof *g->by);
  sim->run.membrane_brought += tal_membrane_elastic(sim);
  return rests;
}

void tal_membrane_remove(tal_sim *sim) {
  tal_run *run = &sim->run;
  run->membrane_brought -= tal_membrane_kinetic(&sim->membrane) + tal_membrane_elastic(sim);
  run->membrane_pressure_power = run->membrane_ends_power = 0;
  run->membrane_grains_power = run->membrane_lost_power = 0;
  tal_membrane_clear(&sim->membrane);
}

// ---- is it still one? ----

static geo_vec bead_at(const tal_membrane *m, size_t b) {
  return (geo_vec){m->x[b], m->y[b]};
}

static double turn(geo_vec a, geo_vec b, geo_vec c) {
  return geo_cross(geo_sub(b, a), geo_sub(c, a));
}

static bool cross(geo_vec a, geo_vec b, geo_vec c, geo_vec d) {
  return turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0;
}

// The first link that crosses another one; count where none does.
static size_t crossed_link(const tal_membrane *m) {
  for (size_t a = 0; a < m->count; a++)
    for (size_t b = a + 1; m->rest[a] > 0 && b < m->count; b++)
      if (m->rest[b] > 0 && cross(bead_at(m, a), bead_at(m, a + 1), bead_at(m, b), bead_at(m, b + 1)))
        return a;
  return m->count;
}

// The first link through which the smallest grain fits.
static size_t torn_link(const tal_membrane *m, double smallest) {
  for (size_t b = 0; b < m->count; b++)
    if (m->rest[b] > 0) {
      double gap = hypot(m->x[b + 1] - m->x[b], m->y[b + 1] - m->y[b]) - m->r[b] - m->r[b + 1];
      if (!(gap < 2 * smallest))
        return b;
    }
  return m->count;
}

// Is the centre beyond the chain on that side: an odd number of links between it and the middle of the sample.
static bool beyond(const tal_membrane *m, double x, double y, int side) {
  bool outside = false;
  for (size_t b = 0; b < m->count; b++) {
    if (!(m->rest[b] > 0) || (m->side[b] > 0) != (side > 0) || (m->y[b] > y) == (m->y[b + 1] > y))
      continue;
    double at = m->x[b] + (y - m->y[b]) * (m->x[b + 1] - m->x[b]) / (m->y[b + 1] - m->y[b]);
    if (side * x > side * at)
      outside = !outside;
  }
  return outside;
}

static tal_status check_grains(const tal_sim *sim, tal_error *err) {
  const tal_grains *g = &sim->grains;
  for (size_t i = 0; i < g->count; i++)
    for (int side = -1; side <= 1; side += 2)
      if (beyond(&sim->membrane, g->x[i], g->y[i], side))
        return tal_fail(err, TAL_INVALID, "grain %lld escaped through the %s membrane at t = %g s", (long long)g->id[i],
                        side < 0 ? "left" : "right", sim->run.time);
  return TAL_OK;
}

tal_status tal_membrane_check(const tal_sim *sim, tal_error *err) {
  const tal_membrane *m = &sim->membrane;
  const tal_grains *g = &sim->grains;
  double smallest = (double)INFINITY;
  for (size_t i = 0; i < g->count; i++)
    smallest = fmin(smallest, g->r[i]);
  size_t torn = torn_link(m, smallest), crossed = crossed_link(m);
  if (crossed < m->count)
    return tal_fail(err, TAL_INVALID, "the membrane crosses itself at (%g, %g) m, t = %g s", m->x[crossed],
                    m->y[crossed], sim->run.time);
  if (torn < m->count)
    return tal_fail(
        err, TAL_INVALID,
        "the membrane is torn at (%g, %g) m, t = %g s: a grain of radius %g m fits between two beads; a stiffer "
        "membrane (membrane.stiffness), larger beads or less pressure",
        m->x[torn], m->y[torn], sim->run.time, smallest);
  return check_grains(sim, err);
}
