// The order of the sweeps, made once per neighbour list: greedy colouring of the slots in their order, each takes the
// first of 64 colours that neither of its grains has. Walls hold no colours: no contact changes their velocity. The
// neighbour list is part of a run's state, so the order is the same after a stop.
#include "implicit.h"

#include "sim.h"

#include <stdlib.h>
#include <string.h>

enum { COLOURS = 64 };

void tal_implicit_init(tal_implicit *system) {
  *system = (tal_implicit){0};
}

static void free_all(tal_implicit *system) {
  tal_implicit_lanes *m = &system->lane;
  free(m->body);
  free(m->i);
  free(m->j);
  free(m->slot);
  free(m->filler);
  free(system->partial);
  free(system->wall_lane);
#define X(name, unit, meaning) free(m->name);
  TAL_LANE_FIELDS(X)
#undef X
}

void tal_implicit_clear(tal_implicit *system) {
  free_all(system);
  tal_implicit_init(system);
}

static void reserve(tal_implicit *s, size_t bodies, size_t lanes) {
  if (bodies <= s->body_capacity && lanes <= s->capacity)
    return;
  free_all(s);
  s->body_capacity = bodies + bodies / 16;
  s->capacity = lanes + lanes / 16;
  s->wall_lane = NULL;
  s->partial = tal_alloc(s->capacity / TAL_IMPLICIT_VECTOR + 1, sizeof *s->partial);
  tal_implicit_lanes *m = &s->lane;
  m->body = tal_alloc(s->body_capacity, sizeof *m->body);
  m->i = tal_alloc(s->capacity, sizeof *m->i);
  m->j = tal_alloc(s->capacity, sizeof *m->j);
  m->slot = tal_alloc(s->capacity, sizeof *m->slot);
  m->filler = tal_alloc(s->capacity, sizeof *m->filler);
#define X(name, unit, meaning) m->name = tal_alloc(s->capacity, sizeof *m->name);
  TAL_LANE_FIELDS(X)
#undef X
}

static int first_free(uint64_t taken) {
  return taken == UINT64_MAX ? COLOURS : __builtin_ctzll(~taken);
}

size_t tal_implicit_colours(const int32_t *i, const int32_t *j, size_t count, size_t grains, uint8_t *colour,
                            bool *serial_last) {
  uint64_t *taken = tal_alloc(grains, sizeof *taken);
  size_t colours = 0;
  *serial_last = false;
  for (size_t k = 0; k < count; k++) {
    bool two = (size_t)j[k] < grains;
    int own = first_free(taken[i[k]] | (two ? taken[j[k]] : 0));
    colour[k] = (uint8_t)own;
    colours = (size_t)own >= colours ? (size_t)own + 1 : colours;
    if (own == COLOURS) {
      *serial_last = true;
      continue;
    }
    taken[i[k]] |= 1ULL << own;
    if (two)
      taken[j[k]] |= 1ULL << own;
  }
  free(taken);
  return colours;
}

// Lanes for each colour: whole vectors, and one vector per contact in the serial one. Returns their sum.
static size_t lay_out(tal_implicit *s, const uint8_t *colour, size_t count) {
  size_t size[COLOURS + 1] = {0};
  for (size_t k = 0; k < count; k++)
    size[colour[k]]++;
  size_t lanes = 0;
  for (size_t c = 0; c < s->colour_count; c++) {
    s->first[c] = lanes;
    bool serial = s->serial_last && c == COLOURS;
    lanes += serial ? size[c] * TAL_IMPLICIT_VECTOR
                    : (size[c] + TAL_IMPLICIT_VECTOR - 1) / TAL_IMPLICIT_VECTOR * TAL_IMPLICIT_VECTOR;
  }
  s->first[s->colour_count] = lanes;
  return lanes;
}

static void fill_lane(const tal_sim *sim, const tal_implicit_lanes *s, size_t lane, int32_t slot) {
  const tal_grains *g = &sim->grains;
  const bool wall = slot < 0;
  const tal_contacts *slots = wall ? &sim->wall_contacts : &sim->pairs;
  const size_t c = (size_t)(wall ? ~slot : slot);
  const int32_t i = slots->i[c], j = slots->j[c];
  const bool spin = sim->effects & TAL_EFFECT_SPIN;
  s->i[lane] = i;
  s->j[lane] = wall ? (int32_t)(g->count + c) : j;
  s->slot[lane] = slot;
  s->filler[lane] = false;
  s->stiffness[lane] = slots->stiffness[c];
  s->damping[lane] = slots->damping[c];
  s->friction[lane] = slots->friction[c];
  s->radius_i[lane] = g->r[i];
  s->reach[lane] = g->r[i] + (wall ? 0 : g->r[j]);
  s->share_i[lane] = wall ? 1 : 0.5;
  s->mass_i[lane] = g->inverse_mass[i];
  s->mass_j[lane] = wall ? 0 : g->inverse_mass[j];
  s->inertia_i[lane] = spin ? g->inverse_inertia[i] : 0;
  s->inertia_j[lane] = spin && !wall ? g->inverse_inertia[j] : 0;
  s->kept_spring[lane] = slots->spring[c];
  s->kept_stiffness[lane] = slots->spring_stiffness[c];
  s->kept_viscous[lane] = slots->viscous[c];
}

// A lane between two bodies that nobody moves, without radius.
static void fill_rest(const tal_implicit_lanes *s, size_t lane, int32_t nobody) {
  s->i[lane] = nobody;
  s->j[lane] = nobody + 1;
  s->slot[lane] = 0;
  s->filler[lane] = true;
#define X(name, unit, meaning) s->name[lane] = 0;
  TAL_LANE_FIELDS(X)
#undef X
}

void tal_implicit_list(tal_sim *sim) {
  tal_implicit *s = &sim->implicit;
  const size_t grains = sim->grains.count, pairs = sim->pairs.count, walls = sim->wall_contacts.count;
  const size_t count = pairs + walls;
  const int32_t nobody = (int32_t)(grains + walls);
  int32_t *i = tal_alloc(count, sizeof *i), *j = tal_alloc(count, sizeof *j);
  uint8_t *colour = tal_alloc(count, sizeof *colour);
  memcpy(i, sim->pairs.i, pairs * sizeof *i);
  memcpy(j, sim->pairs.j, pairs * sizeof *j);
  for (size_t c = 0; c < walls; c++) {
    i[pairs + c] = sim->wall_contacts.i[c];
    j[pairs + c] = (int32_t)(grains + c);
  }
  s->colour_count = tal_implicit_colours(i, j, count, grains, colour, &s->serial_last);
  size_t lanes = lay_out(s, colour, count), next[COLOURS + 1];
  reserve(s, grains + walls + 2, lanes);
  memcpy(next, s->first, sizeof next);
  s->lanes = lanes;
  free(s->wall_lane);
  s->wall_lanes = walls;
  s->wall_lane = tal_alloc(walls, sizeof *s->wall_lane);
  s->lane.body[nobody].place = (tal_lanes){1, 0, 0, 0}; // a unit apart
  s->lane.body[nobody + 1].place = (tal_lanes){0, 0, 0, 0};
  for (size_t k = 0; k < lanes; k++)
    fill_rest(&s->lane, k, nobody);
  for (size_t k = 0; k < count; k++) {
    size_t lane = next[colour[k]];
    next[colour[k]] += colour[k] == COLOURS ? TAL_IMPLICIT_VECTOR : 1;
    fill_lane(sim, &s->lane, lane, k < pairs ? (int32_t)k : ~(int32_t)(k - pairs));
    if (k >= pairs)
      s->wall_lane[k - pairs] = lane;
  }
  free(i);
  free(j);
  free(colour);
  s->all_free = true;
  for (size_t g = 0; g < grains; g++)
    s->all_free = s->all_free && sim->grains.inverse_mass[g] > 0 &&
                  (sim->grains.inverse_inertia[g] > 0 || !(sim->effects & TAL_EFFECT_SPIN));
  s->listed = sim->neighbours.rebuilds;
}

void tal_implicit_save(tal_sim *sim) {
  const tal_implicit *s = &sim->implicit;
  const tal_implicit_lanes *m = &s->lane;
  if (s->listed != sim->neighbours.rebuilds)
    return;
  for (size_t lane = 0; lane < s->lanes; lane++) {
    if (m->filler[lane])
      continue;
    const bool wall = m->slot[lane] < 0;
    tal_contacts *slots = wall ? &sim->wall_contacts : &sim->pairs;
    const size_t c = (size_t)(wall ? ~m->slot[lane] : m->slot[lane]);
    slots->spring[c] = m->kept_spring[lane];
    slots->spring_stiffness[c] = m->kept_stiffness[lane];
    slots->viscous[c] = m->kept_viscous[lane];
  }
}
