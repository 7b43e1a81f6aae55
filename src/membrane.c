// Beads, what acts on them, their energies and powers; see membrane.h.
#include "membrane.h"

#include "critical.h"
#include "damping.h"
#include "effects.h"
#include "law.h"
#include "sim.h"

#include <stdlib.h>
#include <string.h>

void tal_membrane_init(tal_membrane *membrane, size_t count) {
  tal_membrane_clear(membrane);
  membrane->count = count;
#define X(type, name, unit, kept, meaning) membrane->name = tal_alloc(count, sizeof(type));
  TAL_BEAD_FIELDS(X)
#undef X
}

void tal_membrane_clear(tal_membrane *membrane) {
#define X(type, name, unit, kept, meaning) free(membrane->name);
  TAL_BEAD_FIELDS(X)
#undef X
  free(membrane->contact);
  *membrane = (tal_membrane){0};
}

// ---- who may touch whom ----

// Reach [m] beyond contact, besides the skin of the neighbour list, within which a bead may move before it looks anew.
static double margin(const tal_sim *sim) {
  return 0.2 * sim->constants.mean_radius;
}

static double contact_damping(const tal_sim *sim, double stiffness, double bead_mass, double grain_inverse) {
  return tal_damping_coefficient(sim->scene, &sim->constants, stiffness, 1 / (1 / bead_mass + grain_inverse));
}

static void add_candidate(tal_sim *sim, size_t b, size_t i) {
  tal_membrane *m = &sim->membrane;
  const tal_grains *g = &sim->grains;
  if (m->contact_count == m->contact_capacity) {
    size_t capacity = 2 * m->contact_capacity + 256;
    m->contact = tal_grow(m->contact, m->contact_capacity, capacity, sizeof *m->contact);
    m->contact_capacity = capacity;
  }
  const double modulus = sim->constants.modulus, reduced = m->r[b] * g->r[i] / (m->r[b] + g->r[i]);
  tal_bead_contact c = {.bead = (int32_t)b, .grain = (int32_t)i};
  c.stiffness =
      sim->effects & TAL_EFFECT_HERTZ ? tal_hertz_stiffness(modulus, modulus, reduced) : sim->scene->contact.stiffness;
  c.damping = sim->effects & TAL_EFFECT_DAMPING ? contact_damping(sim, c.stiffness, m->mass[b], g->inverse_mass[i]) : 0;
  m->contact[m->contact_count++] = c;
}

static void list_candidates(tal_sim *sim) {
  tal_membrane *m = &sim->membrane;
  const tal_grains *g = &sim->grains;
  const double beyond = margin(sim) + sim->constants.skin;
  m->contact_count = 0;
  for (size_t b = 0; b < m->count; b++)
    for (size_t i = 0; i < g->count; i++) {
      double dx = m->x[b] - g->x[i], dy = m->y[b] - g->y[i], reach = m->r[b] + g->r[i] + beyond;
      if (dx * dx + dy * dy < reach * reach)
        add_candidate(sim, b, i);
    }
  memcpy(m->x_list, m->x, m->count * sizeof *m->x);
  memcpy(m->y_list, m->y, m->count * sizeof *m->y);
  m->listed = sim->neighbours.rebuilds;
}

// Grains move less than the skin between two neighbour lists.
static bool stale(const tal_sim *sim) {
  const tal_membrane *m = &sim->membrane;
  const double limit = margin(sim) * margin(sim);
  if (!m->listed || m->listed != sim->neighbours.rebuilds)
    return true;
  for (size_t b = 0; b < m->count; b++) {
    double dx = m->x[b] - m->x_list[b], dy = m->y[b] - m->y_list[b];
    if (dx * dx + dy * dy > limit)
      return true;
  }
  return false;
}

// ---- forces ----

// Elastic tension (93): none while the link is slack; shorter than half it pushes, so that beads keep their order.
static double elastic_tension(double length, double rest, double stiffness) {
  return length > rest ? stiffness * (length - rest) : length < rest / 2 ? stiffness * (length - rest / 2) : 0;
}

static void add_link(tal_membrane *m, size_t b, double line) {
  double dx = m->x[b + 1] - m->x[b], dy = m->y[b + 1] - m->y[b], length = sqrt(dx * dx + dy * dy);
  double tx = dx / length, ty = dy / length;
  double growth = tx * (m->ux[b + 1] - m->ux[b]) + ty * (m->uy[b + 1] - m->uy[b]);
  double elastic = elastic_tension(length, m->rest[b], m->stiffness[b]);
  double sum = elastic == 0 ? 0 : elastic + m->damping[b] * growth;
  m->tension[b] = elastic * sum > 0 ? sum : 0; // a damper changes no pull into a push
  m->drag[b] = m->tension[b] - elastic;
  m->rx[b] += m->tension[b] * tx;
  m->ry[b] += m->tension[b] * ty;
  m->rx[b + 1] -= m->tension[b] * tx;
  m->ry[b + 1] -= m->tension[b] * ty;
  for (size_t end = b; end <= b + 1; end++) { // inward normal times length, half to each end (94)
    m->px[end] -= 0.5 * line * m->side[b] * dy;
    m->py[end] += 0.5 * line * m->side[b] * dx;
  }
}

// Damping of a touching contact at this overlap [N s/m]. Where the scheme solves damping it is solved here contact by
// contact (95): the share that is left bears any step.
static double viscosity(const tal_sim *sim, const tal_bead_contact *c) {
  const tal_membrane *m = &sim->membrane;
  double damping = sim->effects & TAL_EFFECT_HERTZ ? c->damping * sqrt(c->overlap) : c->damping;
  double mobility = 1 / m->mass[c->bead] + sim->grains.inverse_mass[c->grain];
  return sim->effects & TAL_EFFECT_IMPLICIT ? damping / (1 + 4 * damping * sim->dt * mobility) : damping;
}

static void add_contact(tal_sim *sim, tal_bead_contact *c) {
  tal_membrane *m = &sim->membrane;
  tal_grains *g = &sim->grains;
  const size_t b = (size_t)c->bead, i = (size_t)c->grain;
  double dx = m->x[b] - g->x[i], dy = m->y[b] - g->y[i], distance = sqrt(dx * dx + dy * dy);
  c->overlap = m->r[b] + g->r[c->grain] - distance;
  c->fe = c->fd = 0;
  if (c->overlap <= 0)
    return;
  c->nx = dx / distance;
  c->ny = dy / distance;
  tal_meeting meeting = {.overlap = c->overlap, .stiffness = c->stiffness};
  c->fe = tal_contact_law(meeting, (tal_law_constants){0}, sim->effects & TAL_EFFECT_HERTZ).fe;
  double approach = -(c->nx * (m->ux[b] - g->ux[i]) + c->ny * (m->uy[b] - g->uy[i]));
  c->fd = fmax(-c->fe, viscosity(sim, c) * approach);
  double fx = (c->fe + c->fd) * c->nx, fy = (c->fe + c->fd) * c->ny;
  m->rx[b] += fx;
  m->ry[b] += fy;
  g->bx[c->grain] -= fx;
  g->by[c->grain] -= fy;
}

void tal_membrane_forces(tal_sim *sim) {
  tal_membrane *m = &sim->membrane;
  const double line = sim->run.pressure * sim->constants.thickness;
  if (stale(sim))
    list_candidates(sim);
  const size_t bytes = m->count * sizeof(double);
  memset(m->px, 0, bytes);
  memset(m->py, 0, bytes);
  memset(m->rx, 0, bytes);
  memset(m->ry, 0, bytes);
  for (size_t b = 0; b < m->count; b++)
    if (m->rest[b] > 0)
      add_link(m, b, line);
  for (size_t c = 0; c < m->contact_count; c++)
    add_contact(sim, &m->contact[c]);
  for (size_t b = 0; b < m->count; b++) {
    m->rx[b] += m->px[b];
    m->ry[b] += m->py[b];
  }
}

// ---- energies and powers (96) ----

double tal_membrane_kinetic(const tal_membrane *m) {
  double sum = 0;
  for (size_t b = 0; b < m->count; b++)
    sum += 0.5 * m->mass[b] * (m->vx[b] * m->vx[b] + (m->plate[b] != 0 ? 0 : m->vy[b] * m->vy[b]));
  return sum;
}

double tal_membrane_elastic(const tal_sim *sim) {
  const tal_membrane *m = &sim->membrane;
  double sum = 0;
  for (size_t b = 0; b < m->count; b++) {
    if (!(m->rest[b] > 0))
      continue;
    double length = hypot(m->x[b + 1] - m->x[b], m->y[b + 1] - m->y[b]);
    double tension = elastic_tension(length, m->rest[b], m->stiffness[b]);
    sum += 0.5 * tension * tension / m->stiffness[b];
  }
  for (size_t c = 0; c < m->contact_count; c++) {
    const tal_bead_contact *contact = &m->contact[c];
    if (contact->overlap > 0)
      sum += sim->effects & TAL_EFFECT_HERTZ ? tal_hertz_energy(contact->stiffness, contact->overlap)
                                             : tal_linear_energy(contact->stiffness, contact->overlap);
  }
  return sum;
}

tal_membrane_power tal_membrane_powers(const tal_sim *sim) {
  const tal_membrane *m = &sim->membrane;
  const tal_grains *g = &sim->grains;
  tal_membrane_power p = {0};
  for (size_t b = 0; b < m->count; b++) {
    p.pressure += m->px[b] * m->vx[b] + m->py[b] * m->vy[b];
    if (m->plate[b] != 0) // what holds the end to its plate
      p.ends -= m->ry[b] * m->vy[b];
    if (!(m->rest[b] > 0))
      continue;
    double dx = m->x[b + 1] - m->x[b], dy = m->y[b + 1] - m->y[b], length = sqrt(dx * dx + dy * dy);
    p.lost += m->drag[b] * (dx * (m->vx[b + 1] - m->vx[b]) + dy * (m->vy[b + 1] - m->vy[b])) / length;
  }
  for (size_t c = 0; c < m->contact_count; c++) {
    const tal_bead_contact *k = &m->contact[c];
    const size_t b = (size_t)k->bead, i = (size_t)k->grain;
    if (k->overlap <= 0)
      continue;
    p.grains -= (k->fe + k->fd) * (k->nx * g->vx[i] + k->ny * g->vy[i]);
    p.lost -= k->fd * (k->nx * (m->vx[b] - g->vx[i]) + k->ny * (m->vy[b] - g->vy[i]));
  }
  return p;
}

void tal_membrane_credit(tal_sim *sim, double weight) {
  tal_run *run = &sim->run;
  run->membrane_pressure_work += weight * run->membrane_pressure_power;
  run->membrane_ends_work += weight * run->membrane_ends_power;
  run->membrane_grains_work += weight * run->membrane_grains_power;
  run->membrane_lost_work += weight * run->membrane_lost_power;
}

// ---- limits ----

static double tangent(const tal_sim *sim, const tal_bead_contact *c) {
  return sim->effects & TAL_EFFECT_HERTZ ? tal_hertz_slope(c->stiffness, sqrt(c->overlap)) : c->stiffness;
}

double tal_membrane_critical(const tal_sim *sim, double (*sum)[2]) {
  const tal_membrane *m = &sim->membrane;
  double(*bead)[2] = tal_alloc(m->count, sizeof *bead), least = (double)INFINITY;
  for (size_t b = 0; b < m->count; b++)
    for (size_t end = b; m->rest[b] > 0 && end <= b + 1; end++) {
      bead[end][0] += m->stiffness[b];
      bead[end][1] += m->damping[b];
    }
  for (size_t c = 0; c < m->contact_count; c++) {
    const tal_bead_contact *k = &m->contact[c];
    if (k->overlap <= 0)
      continue;
    const double stiffness = tangent(sim, k), damping = viscosity(sim, k);
    bead[k->bead][0] += stiffness;
    bead[k->bead][1] += damping;
    sum[k->grain][0] += stiffness;
    sum[k->grain][1] += damping;
  }
  for (size_t b = 0; b < m->count; b++)
    if (m->rest[b] > 0)
      least = fmin(least, tal_critical_step_pair(bead[b][0] / m->mass[b] + bead[b + 1][0] / m->mass[b + 1],
                                                 bead[b][1] / m->mass[b] + bead[b + 1][1] / m->mass[b + 1], 1));
  for (size_t c = 0; c < m->contact_count; c++) {
    const tal_bead_contact *k = &m->contact[c];
    const double inverse = sim->grains.inverse_mass[k->grain], mass = m->mass[k->bead];
    if (k->overlap > 0)
      least = fmin(least, tal_critical_step_pair(bead[k->bead][0] / mass + sum[k->grain][0] * inverse,
                                                 bead[k->bead][1] / mass + sum[k->grain][1] * inverse, 1));
  }
  free(bead);
  return least;
}
