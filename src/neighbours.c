// The neighbour list. Slots ascend by (i, j); each grain's incidences come out in the order of its partners because the
// slots are dealt out in that order. The list is safe while no two centres can have come closer by more than the skin.
#include "neighbours.h"

#include "damping.h"
#include "kick.h"
#include "law.h"
#include "sim.h"

#include <stdlib.h>
#include <string.h>

// Steps between two looks at the displacements, at most.
enum { LOOK_EVERY = 64 };

void tal_neighbours_init(tal_neighbours *neighbours) {
  *neighbours = (tal_neighbours){0};
}

void tal_neighbours_clear(tal_neighbours *neighbours) {
  geo_pairs_clear(&neighbours->far);
  free(neighbours->first);
  free(neighbours->slot);
  free(neighbours->wall_first);
  free(neighbours->seat);
  *neighbours = (tal_neighbours){0};
}

// Reduced mass of a contact [kg]; an immovable side counts as infinitely heavy.
static double reduced_mass(double inverse_i, double inverse_j) {
  double sum = inverse_i + inverse_j;
  return sum > 0 ? 1 / sum : 0;
}

static double slot_damping(const tal_sim *sim, double stiffness, double mass) {
  return tal_damping_coefficient(sim->scene, &sim->constants, stiffness, mass);
}

static void fill_pair(tal_sim *sim, tal_contacts *slots, size_t c, int32_t i, int32_t j) {
  const tal_grains *g = &sim->grains;
  double reduced = g->r[i] * g->r[j] / (g->r[i] + g->r[j]);
  double modulus = sim->constants.modulus;
  slots->i[c] = i;
  slots->j[c] = j;
  slots->reach[c] = g->r[i] + g->r[j];
  slots->stiffness[c] =
      sim->effects & TAL_EFFECT_HERTZ ? tal_hertz_stiffness(modulus, modulus, reduced) : sim->scene->contact.stiffness;
  if (slots->damping)
    slots->damping[c] = slot_damping(sim, slots->stiffness[c], reduced_mass(g->inverse_mass[i], g->inverse_mass[j]));
}

static void fill_wall(tal_sim *sim, tal_contacts *slots, size_t c, int32_t i, int32_t w) {
  const tal_grains *g = &sim->grains;
  const tal_wall *wall = &sim->walls.wall[w];
  slots->i[c] = i;
  slots->j[c] = w;
  slots->reach[c] = g->r[i];
  slots->stiffness[c] = sim->effects & TAL_EFFECT_HERTZ
                            ? tal_hertz_stiffness(sim->constants.modulus, wall->modulus, g->r[i])
                            : sim->scene->contact.stiffness;
  slots->damping[c] = slot_damping(sim, slots->stiffness[c], reduced_mass(g->inverse_mass[i], 0));
  slots->friction[c] = wall->friction;
  slots->spring[c] = slots->spring_stiffness[c] = slots->viscous[c] = 0;
}

// Both lists ascend by (i, j): one merge carries the histories over. What the implicit scheme left is for itself alone.
static void carry_springs(const tal_contacts *old, tal_contacts *slots, bool solved) {
  size_t o = 0;
  if (!old->spring)
    return;
  for (size_t c = 0; c < slots->count; c++) {
    while (o < old->count && (old->i[o] < slots->i[c] || (old->i[o] == slots->i[c] && old->j[o] < slots->j[c])))
      o++;
    if (o < old->count && old->i[o] == slots->i[c] && old->j[o] == slots->j[c]) {
      slots->spring[c] = old->spring[o];
      slots->spring_stiffness[c] = old->spring_stiffness[o];
      if (solved && old->viscous)
        slots->viscous[c] = old->viscous[o];
    }
  }
}

// A ring holds all grains from the first that is not yet complete to the last partner that a block may have, and
// handfuls at both ends.
static void lay_ring(tal_sim *sim) {
  const tal_contacts *slots = &sim->pairs;
  tal_neighbours *n = &sim->neighbours;
  const size_t block = TAL_BLOCK, waiting = TAL_BLOCK;
  size_t span = 0, length = 0;
  for (size_t c = 0; c < slots->count; c++) {
    size_t i = (size_t)slots->i[c], first = (size_t)slots->i[c < block ? 0 : c - block + 1];
    span = (size_t)slots->j[c] - i > span ? (size_t)slots->j[c] - i : span;
    length = i - first > length ? i - first : length;
  }
  n->span = span;
  n->ring = 1;
  while (n->ring < length + span + 1 + 2 * waiting)
    n->ring *= 2;
}

static void seat_slots(tal_sim *sim) {
  const tal_contacts *slots = &sim->pairs;
  tal_neighbours *n = &sim->neighbours;
  const size_t mask = n->ring - 1;
  free(n->seat);
  n->seat = tal_alloc(slots->count + 3, sizeof *n->seat);
  for (size_t c = 0; c < slots->count; c++)
    n->seat[c] = tal_seat_of((size_t)slots->i[c] & mask, (size_t)slots->j[c] & mask);
}

// Pairs that are looked through before the bucket grid is searched again: as far as is worth it, and no further than
// a quarter of the smallest grain, so that there are few.
static double far_reach(const tal_sim *sim) {
  const double reach = fmin(0.15 * 2 * sim->constants.mean_radius, 0.25 * 2 * sim->constants.least_radius);
  return reach > 3 * sim->constants.skin ? reach : sim->constants.skin;
}

static double sum_of_radii(const tal_grains *g) {
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (size_t i = 0; i < g->count; i++)
    sum += g->r[i];
  return sum;
}

static void search_far(tal_sim *sim) {
  tal_neighbours *n = &sim->neighbours;
  const tal_grains *g = &sim->grains;
  const double radii = sum_of_radii(g);
  if (2 * n->far_moved * (1 + 1e-9) + sim->constants.skin <= n->reach && radii == n->far_radii)
    return;
  n->reach = far_reach(sim);
  n->far_moved = 0;
  n->far_radii = radii;
  geo_pairs_clear(&n->far);
  geo_cells_pairs(g->x_list, g->y_list, g->r, g->count, n->reach, &n->far);
  geo_pairs_fit(&n->far);
}

// All pairs closer than contact plus the skin.
static void search_pairs(tal_sim *sim, geo_pairs *pairs) {
  const tal_grains *g = &sim->grains;
  const geo_pairs *far = &sim->neighbours.far;
  search_far(sim);
  geo_pairs_reserve(pairs, far->count);
  for (size_t c = 0; c < far->count; c++) {
    const int32_t i = far->pair[c][0], j = far->pair[c][1];
    const double dx = g->x_list[i] - g->x_list[j], dy = g->y_list[i] - g->y_list[j];
    const double near = g->r[i] + g->r[j] + sim->constants.skin;
    pairs->pair[pairs->count][0] = i;
    pairs->pair[pairs->count][1] = j;
    pairs->count += near > 0 && dx * dx + dy * dy < near * near;
  }
}

static void list_pairs(tal_sim *sim) {
  geo_pairs found, *pairs = &found;
  geo_pairs_init(pairs);
  search_pairs(sim, pairs);
  tal_contacts fresh;
  tal_contacts_init(&fresh);
  const tal_contact_needs needs = {.past = sim->effects & (TAL_EFFECT_SPRING | TAL_EFFECT_IMPLICIT),
                                   .solved = sim->effects & TAL_EFFECT_IMPLICIT,
                                   .damped =
                                       sim->effects & TAL_EFFECT_DAMPING && isnan(tal_damping_time_of_slots(sim))};
  tal_contacts_reserve_pairs(&fresh, pairs->count + pairs->count / 32 + 64, needs);
  fresh.count = pairs->count;
  for (size_t c = 0; c < pairs->count; c++)
    fill_pair(sim, &fresh, c, pairs->pair[c][0], pairs->pair[c][1]);
  if (needs.past)
    carry_springs(&sim->pairs, &fresh, needs.solved);
  tal_contacts_swap(&sim->pairs, &fresh);
  tal_contacts_clear(&fresh);
  geo_pairs_clear(pairs);
  lay_ring(sim);
  seat_slots(sim);
}

// Elastic energy [J] of a grain on a wall `back` seconds before the end of this step's drift.
static double energy_on_wall(const tal_sim *sim, size_t i, const tal_wall *wall, double stiffness, double back) {
  const tal_grains *g = &sim->grains;
  double x = g->x[i] - back * (g->vx[i] - wall->vx), y = g->y[i] - back * (g->vy[i] - wall->vy);
  double overlap = g->r[i] - tal_wall_nearest(wall, x, y).distance;
  if (overlap <= 0)
    return 0;
  return sim->effects & TAL_EFFECT_HERTZ ? tal_hertz_energy(stiffness, overlap) : tal_linear_energy(stiffness, overlap);
}

// A wall that vanishes takes the elastic energy of its contacts with it, one that appears brings it: that of the middle
// of the step, because the force at its last or first instant acts over half a step.
static void book_change(tal_sim *sim, const tal_contacts *slots, bool there) {
  for (size_t c = 0; c < slots->count; c++) {
    tal_wall *wall = &sim->walls.wall[slots->j[c]];
    if ((wall->listed != 0) == there || tal_wall_active(wall, sim->run.time) != there)
      continue;
    size_t i = (size_t)slots->i[c];
    double energy = energy_on_wall(sim, i, wall, slots->stiffness[c], 0);
    energy += energy_on_wall(sim, i, wall, slots->stiffness[c], sim->dt);
    wall->work += there ? 0.5 * energy : -0.5 * energy;
  }
}

static void list_walls(tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  tal_contacts fresh;
  tal_contacts_init(&fresh);
  for (size_t i = 0; i < g->count; i++) {
    sim->neighbours.wall_first[i] = (int32_t)fresh.count;
    for (size_t w = 0; w < sim->walls.count; w++) {
      const tal_wall *wall = &sim->walls.wall[w];
      if (!tal_wall_active(wall, sim->run.time))
        continue;
      // the wall where it was when the centres were there
      double x = g->x_list[i] + (wall->x0 - wall->x_list), y = g->y_list[i] + (wall->y0 - wall->y_list);
      if (tal_wall_nearest(wall, x, y).distance >= g->r[i] + sim->constants.skin)
        continue;
      if (fresh.count == fresh.capacity)
        tal_contacts_reserve(&fresh, fresh.capacity * 2 + 64);
      fill_wall(sim, &fresh, fresh.count++, (int32_t)i, (int32_t)w);
    }
  }
  sim->neighbours.wall_first[g->count] = (int32_t)fresh.count;
  if (sim->effects & (TAL_EFFECT_SPRING | TAL_EFFECT_IMPLICIT))
    carry_springs(&sim->wall_contacts, &fresh, sim->effects & TAL_EFFECT_IMPLICIT);
  if (sim->neighbours.rebuilds > 0) { // what is there at the start is part of the start
    book_change(sim, &sim->wall_contacts, false);
    book_change(sim, &fresh, true);
  }
  tal_contacts_swap(&sim->wall_contacts, &fresh);
  tal_contacts_clear(&fresh);
}

void tal_neighbours_forget(tal_neighbours *neighbours) {
  free(neighbours->first);
  free(neighbours->slot);
  neighbours->first = neighbours->slot = NULL;
}

// Deals the slots out to their grains: counts, then fills in slot order.
void tal_neighbours_deal(tal_sim *sim) {
  tal_neighbours *n = &sim->neighbours;
  const tal_contacts *slots = &sim->pairs;
  size_t count = sim->grains.count;
  if (n->first)
    return;
  n->first = tal_alloc(count + 1, sizeof *n->first);
  n->slot = tal_alloc(2 * slots->count, sizeof *n->slot);
  for (size_t c = 0; c < slots->count; c++) {
    n->first[slots->i[c] + 1]++;
    n->first[slots->j[c] + 1]++;
  }
  for (size_t i = 0; i < count; i++)
    n->first[i + 1] += n->first[i];
  for (size_t c = 0; c < slots->count; c++) {
    n->slot[n->first[slots->i[c]]++] = (int32_t)c;
    n->slot[n->first[slots->j[c]]++] = ~(int32_t)c;
  }
  memmove(n->first + 1, n->first, count * sizeof *n->first);
  n->first[0] = 0;
}

// The list for the centres in x_list, y_list.
static void list_all(tal_sim *sim) {
  tal_neighbours *n = &sim->neighbours;
  const tal_grains *g = &sim->grains;
  if (n->grain_capacity != g->count) {
    free(n->wall_first);
    n->wall_first = tal_alloc(g->count + 1, sizeof *n->wall_first);
    free(sim->powers);
    free(sim->pressed);
    sim->powers = tal_alloc(g->count / TAL_KICK_GRAINS + 1, sizeof *sim->powers);
    sim->pressed = tal_alloc(g->count / TAL_KICK_GRAINS + 1, sizeof *sim->pressed);
    n->grain_capacity = g->count;
  }
  tal_implicit_save(sim);
  list_pairs(sim);
  list_walls(sim);
  tal_neighbours_forget(n);
  n->rebuilds++;
}

// Largest displacement since the list was built, squared [m^2]; NAN when a coordinate is.
static double largest_displacement(const tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  double largest = 0;
  bool finite = true;
#pragma omp simd reduction(max : largest) reduction(&& : finite)
  for (size_t i = 0; i < g->count; i++) {
    double dx = g->x[i] - g->x_list[i], dy = g->y[i] - g->y_list[i];
    double d2 = dx * dx + dy * dy;
    largest = d2 > largest ? d2 : largest;
    finite = finite && d2 <= 1e300;
  }
  return finite ? largest : (double)NAN;
}

void tal_neighbours_rebuild(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  sim->neighbours.far_moved += sqrt(largest_displacement(sim));
  memcpy(g->x_list, g->x, g->count * sizeof *g->x);
  memcpy(g->y_list, g->y, g->count * sizeof *g->y);
  for (size_t w = 0; w < sim->walls.count; w++) {
    sim->walls.wall[w].x_list = sim->walls.wall[w].x0;
    sim->walls.wall[w].y_list = sim->walls.wall[w].y0;
  }
  list_all(sim);
  sim->neighbours.moved = 0;
  sim->neighbours.unseen = 0;
  for (size_t w = 0; w < sim->walls.count; w++)
    sim->walls.wall[w].listed = tal_wall_active(&sim->walls.wall[w], sim->run.time);
}

void tal_neighbours_restore(tal_sim *sim) {
  sim->neighbours.far_moved = (double)NAN;
  sim->neighbours.rebuilds = 0;       // the first list of this process: no wall comes or goes by it
  tal_implicit_clear(&sim->implicit); // lanes of a list before this one
  list_all(sim);
  sim->neighbours.moved = sim->constants.skin; // the next step has to look
}

static double largest_wall_displacement(const tal_sim *sim) {
  double largest = 0;
  for (size_t w = 0; w < sim->walls.count; w++) {
    const tal_wall *wall = &sim->walls.wall[w];
    largest = fmax(largest, hypot(wall->x0 - wall->x_list, wall->y0 - wall->y_list));
  }
  return largest;
}

static bool walls_changed(const tal_sim *sim) {
  for (size_t w = 0; w < sim->walls.count; w++)
    if (tal_wall_active(&sim->walls.wall[w], sim->run.time) != (sim->walls.wall[w].listed != 0))
      return true;
  return false;
}

// Adding up the fastest grain's steps bounds the displacements; they are looked at when the bound no longer does, and
// now and then, lest round-off in coordinates adds up. That a look is due follows from the motion alone.
bool tal_neighbours_hold(tal_sim *sim, double step) {
  tal_neighbours *n = &sim->neighbours;
  const double moved = n->moved + step;
  if (walls_changed(sim) || n->unseen + 1 >= LOOK_EVERY ||
      !(moved + fmax(moved, largest_wall_displacement(sim)) < sim->constants.skin))
    return false;
  n->stride = step;
  n->moved = moved;
  n->unseen++;
  return true;
}

bool tal_neighbours_stale(tal_sim *sim, double step) {
  tal_neighbours *n = &sim->neighbours;
  if (tal_neighbours_hold(sim, step))
    return false;
  n->stride = step;
  if (walls_changed(sim))
    return true;
  const double walls = largest_wall_displacement(sim);
  n->moved = sqrt(largest_displacement(sim));
  n->unseen = 0;
  return !(n->moved + fmax(n->moved, walls) < sim->constants.skin);
}
