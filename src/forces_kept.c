// The force of every slot kept in a record of its own: for observers, and for friction that is solved after the sweep.
// The last step kept nothing; where it was watched (tal_sim_watch) its forces are worked out again from what the laws
// saw of the grains, to the same bits: a spring that stands at its force and does not move answers with that force.
#include "forces.h"

#include "drift.h"
#include "kick.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GRAINS = TAL_KICK_GRAINS, PARALLEL_FROM = 2000 };

// ---- sweep ----------------------------------------------------------------------------------------------------------

static void keep_block(const tal_force_block *b, tal_force_record *out, int count, unsigned law) {
  for (int k = 0; k < count; k += 4) {
    tal_lanes first[4], second[4];
    tal_force_block_turn(b, k, first, second, law);
    for (int m = 0; m < 4 && k + m < count; m++) {
      *(tal_lanes *)&out[k + m].elastic_x = first[m];
      *(tal_lanes *)&out[k + m].friction_x = second[m];
    }
  }
}

void tal_forces_keep(tal_sim *sim) {
  sim->forces_kept = true;
  tal_neighbours_deal(sim);
  if (sim->force_capacity >= sim->pairs.count)
    return;
  free(sim->force_records);
  sim->force_capacity = sim->pairs.capacity;
  sim->force_records = tal_alloc(sim->force_capacity, sizeof *sim->force_records);
}

void tal_forces_forget(tal_sim *sim) {
  sim->forces_kept = false;
  if (!sim->force_records)
    return;
  free(sim->force_records);
  free(sim->grain_records);
  sim->force_records = NULL;
  sim->grain_records = NULL;
  sim->force_capacity = 0;
  tal_contacts_hide(&sim->pairs);
  tal_grains_hide(&sim->grains);
  tal_neighbours_forget(&sim->neighbours);
  tal_graph_forget_edges(&sim->graph);
}

static void see_grains(tal_sim *sim) {
  const size_t count = sim->grains.count;
  if (!sim->remembers) {
    fprintf(stderr, "talus: forces of a step that was not watched (tal_sim_watch) are asked for\n");
    abort();
  }
  if (!sim->grain_records)
    sim->grain_records = tal_alloc((count + 3) / 4 * 4, sizeof *sim->grain_records);
#pragma omp parallel for schedule(static) if (count > PARALLEL_FROM)
  for (size_t start = 0; start < count; start += GRAINS)
    tal_drift_records(sim, start, (int)(count - start < GRAINS ? count - start : GRAINS), sim->grain_records + start);
}

static void sweep_pairs(tal_sim *sim, double dt) {
  const size_t count = sim->pairs.count;
  tal_forces_keep(sim);
  see_grains(sim);
  const tal_sweep sweep = tal_sweep_of(sim, dt);
#pragma omp parallel for schedule(static) if (count > PARALLEL_FROM)
  for (size_t start = 0; start < count; start += TAL_BLOCK) {
    int here = (int)(count - start < TAL_BLOCK ? count - start : TAL_BLOCK);
    tal_force_block b = {0};
    const size_t first = (size_t)sim->pairs.i[start];
    tal_seat at[TAL_BLOCK] = {{0, 0}};
    for (int k = 0; k < here; k++)
      at[k] =
          tal_seat_of((size_t)sim->pairs.i[start + (size_t)k] - first, (size_t)sim->pairs.j[start + (size_t)k] - first);
    tal_contact_block(sim, &sweep, sim->grain_records + first, at, start, here, &b);
    keep_block(&b, sim->force_records + start, here, sweep.law);
  }
}

// One grain-wall slot: the wall's own velocity counts, its lever arm is r - d.
static void wall_slot(tal_sim *sim, const tal_sweep *sweep, const tal_grain_record *g, size_t c) {
  tal_contacts *slots = &sim->wall_contacts;
  const tal_wall *wall = &sim->walls.wall[slots->j[c]];
  tal_wall_point near = tal_wall_nearest(wall, g->x, g->y);
  tal_meeting m = {.overlap = slots->reach[c] - near.distance,
                   .stiffness = slots->stiffness[c],
                   .damping = slots->damping[c],
                   .friction = slots->friction[c],
                   .spring = slots->spring[c],
                   .spring_stiffness = slots->spring_stiffness[c]};
  double ux = g->ux - wall->vx, uy = g->uy - wall->vy, hx = g->hx - wall->vx, hy = g->hy - wall->vy;
  m.approach = -(near.nx * ux + near.ny * uy);
  m.slip = tal_slip_speed(near.nx, near.ny, ux, uy, m.overlap, g->r_spin, g->spin, sim->effects);
  m.slip_distance =
      sweep->dt * tal_slip_speed(near.nx, near.ny, hx, hy, m.overlap, g->r_spin, g->spin, sim->effects) + 0.0;
  tal_law_force f = tal_contact_law(m, sweep->constants, sweep->law);
  slots->nx[c] = near.nx;
  slots->ny[c] = near.ny;
  slots->overlap[c] = m.overlap;
  slots->fe[c] = f.fe;
  slots->fd[c] = f.fd;
  slots->ft[c] = f.ft;
  if (sweep->moves) {
    slots->spring[c] = f.ft;
    slots->spring_stiffness[c] = f.spring_stiffness;
  }
}

void tal_forces_sweep_walls(tal_sim *sim, const tal_sweep *sweep, const tal_grain_record *record, size_t mask,
                            size_t first, size_t end) {
  for (size_t c = first; c < end; c++)
    wall_slot(sim, sweep, &record[(size_t)sim->wall_contacts.i[c] & mask], c);
}

void tal_forces_sweep(tal_sim *sim, double dt) {
  sweep_pairs(sim, dt);
  const tal_sweep sweep = tal_sweep_of(sim, dt);
  tal_forces_sweep_walls(sim, &sweep, sim->grain_records, SIZE_MAX, 0, sim->wall_contacts.count);
}

void tal_forces_see_now(tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  memcpy(g->ux, g->vx, g->count * sizeof *g->ux);
  memcpy(g->uy, g->vy, g->count * sizeof *g->uy);
  memcpy(g->spin, g->omega, g->count * sizeof *g->spin);
  sim->remembers = true;
}

// ---- slots ----------------------------------------------------------------------------------------------------------

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
  s->slip[c] =
      tal_slip_speed(nx, ny, g->vx[i] - g->vx[j], g->vy[i] - g->vy[j], 0.5 * s->overlap[c],
                     g->r[i] * g->omega[i] + g->r[j] * g->omega[j], g->omega[i] + g->omega[j], TAL_EFFECT_SPIN);
}

void tal_forces_expand(tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  if (!sim->forces_kept && sim->effects & TAL_EFFECT_IMPLICIT)
    tal_implicit_answer(sim);
  else if (!sim->forces_kept)
    sweep_pairs(sim, 0);
  tal_contacts_show(&sim->pairs);
  for (size_t c = 0; c < sim->pairs.count; c++)
    expand_pair(sim, c);
  tal_contacts *s = &sim->wall_contacts;
  for (size_t c = 0; c < s->count; c++) {
    int32_t i = s->i[c];
    const tal_wall *wall = &sim->walls.wall[s->j[c]];
    s->slip[c] = tal_slip_speed(s->nx[c], s->ny[c], g->vx[i] - wall->vx, g->vy[i] - wall->vy, s->overlap[c],
                                g->r[i] * g->omega[i], g->omega[i], TAL_EFFECT_SPIN);
  }
}

// ---- sums -----------------------------------------------------------------------------------------------------------

// Sum over the grain-grain slots of one grain.
static tal_force_record sum_pairs(const tal_sim *sim, size_t grain) {
  const tal_lanes torque = {-1, -1, 1, 1}; // on the slot's j the vectors change sign, the torque does not
  const int32_t *slot = sim->neighbours.slot;
  const tal_force_halves *record = (const tal_force_halves *)sim->force_records;
  tal_force_halves sum = {{0}, {0}};
  for (int32_t k = sim->neighbours.first[grain]; k < sim->neighbours.first[grain + 1]; k++) {
    if (slot[k] >= 0) {
      sum.first += record[slot[k]].first;
      sum.second += record[slot[k]].second;
    } else { // the grain is the slot's j
      sum.first -= record[~slot[k]].first;
      sum.second += torque * record[~slot[k]].second;
    }
  }
  tal_force_record f;
  memcpy(&f, &sum, sizeof f);
  return f;
}

static void add_walls(const tal_sim *sim, size_t grain, tal_resultant *sum) {
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

tal_resultant tal_forces_gather(const tal_sim *sim, size_t grain) {
  tal_force_record sum = sum_pairs(sim, grain);
  tal_resultant f = {sum.elastic_x, sum.elastic_y, sum.viscous_x, sum.viscous_y, 0, 0, 0};
  if (sim->effects & TAL_EFFECT_FRICTION) {
    f.friction_x = sum.friction_x;
    f.friction_y = sum.friction_y;
    f.torque = sum.ft_half_overlap - sim->grains.r[grain] * sum.ft;
  }
  if (sim->effects & TAL_EFFECT_WALLS)
    add_walls(sim, grain, &f);
  return f;
}

void tal_forces_resultants(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  tal_grains_show(g);
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

void tal_forces_finish_step(tal_sim *sim, double dt, double credit) {
  const size_t count = sim->grains.count;
#pragma omp parallel for schedule(static) if (count > PARALLEL_FROM)
  for (size_t start = 0; start < count; start += GRAINS) {
    int here = (int)(count - start < GRAINS ? count - start : GRAINS);
    tal_force_record sums[GRAINS] = {0};
    for (int k = 0; k < here; k++)
      sums[k] = sum_pairs(sim, start + (size_t)k);
    tal_kick(sim, sums, start, here, dt);
  }
  tal_kick_book(sim, credit);
}
