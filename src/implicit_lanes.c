// The order of the sweeps, made once per neighbour list: tiles of grains that lie together, and greedy colouring of the
// slots of a tile in their order, each takes the first of 64 colours that neither of its grains has. Walls hold no
// colours: no contact changes their velocity. The neighbour list is part of a run's state, so the order is the same
// after a stop.
#include "implicit.h"

#include "damping.h"
#include "sim.h"

#include <stdlib.h>
#include <string.h>

enum { COLOURS = 64 };
// Grains of a tile, at least: a few tiles fit into the L2 cache. Small samples are one tile: they gain nothing, and one
// sweep over even and odd tiles leaves some per cent more unbalanced than one over the whole.
enum { TILE = 256, TILES_FROM = TAL_IMPLICIT_TILES_FROM };

void tal_implicit_init(tal_implicit *system) {
  *system = (tal_implicit){0};
}

static void free_lanes(tal_implicit *system) {
  tal_implicit_lanes *m = &system->lane;
  free(m->body);
  free(m->i);
  free(m->j);
  free(m->slot);
  free(m->filler);
#define X(name, unit, meaning) free(m->name);
  TAL_LANE_FIELDS(X)
#undef X
}

void tal_implicit_clear(tal_implicit *system) {
  free_lanes(system);
  free(system->wall_lane);
  free(system->tile);
  free(system->first);
  tal_implicit_init(system);
}

static void reserve(tal_implicit *s, size_t bodies, size_t lanes) {
  if (bodies <= s->body_capacity && lanes <= s->capacity)
    return;
  free_lanes(s);
  s->body_capacity = bodies + bodies / 16;
  s->capacity = lanes + lanes / 16;
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

// Slots of a tile: [pair, pair_end) and, of the walls, [wall, wall_end).
typedef struct share {
  size_t pair, pair_end, wall, wall_end;
} share;

// First slot whose i is not below the grain.
static size_t slot_from(const tal_contacts *slots, size_t from, size_t grain) {
  while (from < slots->count && (size_t)slots->i[from] < grain)
    from++;
  return from;
}

// The share that follows the one before.
static share next_share(const tal_sim *sim, share before, size_t t) {
  const size_t end = (t + 1) * sim->implicit.tile_grains;
  return (share){before.pair_end, slot_from(&sim->pairs, before.pair_end, end), before.wall_end,
                 slot_from(&sim->wall_contacts, before.wall_end, end)};
}

// Lanes for each colour of a tile, from lane `lanes` on: whole vectors, and one vector per contact in the serial one.
// Returns the lane after the last.
static size_t lay_out(tal_implicit *s, const tal_implicit_tile *tile, const uint8_t *colour, size_t count,
                      size_t lanes) {
  size_t size[COLOURS + 1] = {0};
  for (size_t k = 0; k < count; k++)
    size[colour[k]]++;
  for (size_t c = 0; c < tile->colours; c++) {
    s->first[tile->colour + c] = lanes;
    lanes += tile->serial_last && c == COLOURS
                 ? size[c] * TAL_IMPLICIT_VECTOR
                 : (size[c] + TAL_IMPLICIT_VECTOR - 1) / TAL_IMPLICIT_VECTOR * TAL_IMPLICIT_VECTOR;
  }
  s->first[tile->colour + tile->colours] = lanes;
  return lanes;
}

// Colours of the slots of tile t, whose grains and those they meet are numbered from its first.
static void colour_tile(tal_sim *sim, size_t t, share part, uint8_t *colour) {
  tal_implicit_tile *tile = &sim->implicit.tile[t];
  const size_t pairs = part.pair_end - part.pair, walls = part.wall_end - part.wall, count = pairs + walls;
  const size_t base = t * sim->implicit.tile_grains, left = sim->grains.count - base;
  const size_t window = left < 2 * sim->implicit.tile_grains ? left : 2 * sim->implicit.tile_grains;
  int32_t *i = tal_alloc(count, sizeof *i), *j = tal_alloc(count, sizeof *j);
  for (size_t k = 0; k < pairs; k++) {
    i[k] = sim->pairs.i[part.pair + k] - (int32_t)base;
    j[k] = sim->pairs.j[part.pair + k] - (int32_t)base;
  }
  for (size_t k = 0; k < walls; k++) {
    i[pairs + k] = sim->wall_contacts.i[part.wall + k] - (int32_t)base;
    j[pairs + k] = (int32_t)(window + k);
  }
  tile->colours = tal_implicit_colours(i, j, count, window, colour, &tile->serial_last);
  free(i);
  free(j);
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
  s->damping[lane] = tal_damping_of_slot(sim, slots, c);
  s->friction[lane] = wall ? slots->friction[c] : sim->friction;
  s->radius_i[lane] = g->r[i];
  s->reach[lane] = g->r[i] + (wall ? 0 : g->r[j]);
  s->mass_i[lane] = g->inverse_mass[i];
  s->mass_j[lane] = wall ? 0 : g->inverse_mass[j];
  s->inertia_i[lane] = spin ? g->inverse_inertia[i] : 0;
  s->inertia_j[lane] = spin && !wall ? g->inverse_inertia[j] : 0;
  s->kept_spring[lane] = slots->spring[c];
  s->kept_stiffness[lane] = slots->spring_stiffness[c];
  s->elastic[lane] = 0;
  s->fn[lane] = slots->viscous[c];
  s->ft[lane] = slots->spring[c];
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

// Cuts the grains into tiles that no contact reaches across, and colours each; colours of pairs, then walls, tile by
// tile. Returns the number of lanes.
static size_t cut(tal_sim *sim, uint8_t *colour) {
  tal_implicit *s = &sim->implicit;
  const size_t grains = sim->grains.count, span = sim->neighbours.span;
  s->tile_grains = grains < TILES_FROM ? grains : span > TILE ? span : TILE;
  s->tiles = (grains + s->tile_grains - 1) / s->tile_grains;
  free(s->tile);
  free(s->first);
  s->tile = tal_alloc(s->tiles, sizeof *s->tile);
  s->first = tal_alloc(s->tiles * (COLOURS + 1) + 1, sizeof *s->first);
  s->serial_last = false;
  share part = {0};
  size_t lanes = 0, colours = 0;
  for (size_t t = 0; t < s->tiles; t++) {
    part = next_share(sim, part, t);
    uint8_t *own = colour + part.pair + part.wall;
    colour_tile(sim, t, part, own);
    s->tile[t].colour = colours;
    colours += s->tile[t].colours;
    s->serial_last = s->serial_last || s->tile[t].serial_last;
    lanes = lay_out(s, &s->tile[t], own, part.pair_end - part.pair + part.wall_end - part.wall, lanes);
  }
  return lanes;
}

static void fill_tile(tal_sim *sim, size_t t, share part, const uint8_t *colour) {
  tal_implicit *s = &sim->implicit;
  const tal_implicit_tile *tile = &s->tile[t];
  const size_t *first = s->first + tile->colour, pairs = part.pair_end - part.pair;
  const size_t nobody = sim->grains.count + sim->wall_contacts.count + 2 * t;
  size_t next[COLOURS + 1];
  memcpy(next, first, tile->colours * sizeof *next);
  s->lane.body[nobody] = (tal_implicit_body){.place = {1, 0, 0, 0}}; // a unit apart
  s->lane.body[nobody + 1] = (tal_implicit_body){.place = {0, 0, 0, 0}};
  for (size_t lane = first[0]; lane < first[tile->colours]; lane++)
    fill_rest(&s->lane, lane, (int32_t)nobody);
  for (size_t k = 0; k < pairs + part.wall_end - part.wall; k++) {
    const size_t lane = next[colour[k]], wall = part.wall + k - pairs;
    next[colour[k]] += colour[k] == COLOURS ? TAL_IMPLICIT_VECTOR : 1;
    fill_lane(sim, &s->lane, lane, k < pairs ? (int32_t)(part.pair + k) : ~(int32_t)wall);
    if (k >= pairs)
      s->wall_lane[wall] = lane;
  }
}

void tal_implicit_list(tal_sim *sim) {
  tal_implicit *s = &sim->implicit;
  const size_t grains = sim->grains.count, walls = sim->wall_contacts.count;
  uint8_t *colour = tal_alloc(sim->pairs.count + walls, sizeof *colour);
  s->lanes = cut(sim, colour);
  reserve(s, grains + walls + 2 * s->tiles, s->lanes);
  free(s->wall_lane);
  s->wall_lanes = walls;
  s->wall_lane = tal_alloc(walls, sizeof *s->wall_lane);
  share part = {0};
  for (size_t t = 0; t < s->tiles; t++) {
    part = next_share(sim, part, t);
    fill_tile(sim, t, part, colour + part.pair + part.wall);
  }
  free(colour);
  s->all_free = true;
  for (size_t g = 0; g < grains; g++)
    s->all_free = s->all_free && sim->grains.inverse_mass[g] > 0 &&
                  (sim->grains.inverse_inertia[g] > 0 || !(sim->effects & TAL_EFFECT_SPIN));
  s->springs = sim->effects & TAL_EFFECT_SPRING;
  s->listed = sim->neighbours.rebuilds;
}

void tal_implicit_take_friction(tal_sim *sim) {
  const tal_implicit *s = &sim->implicit;
  for (size_t c = 0; s->listed == sim->neighbours.rebuilds && c < s->wall_lanes; c++)
    s->lane.friction[s->wall_lane[c]] = sim->wall_contacts.friction[c];
}

void tal_implicit_save(tal_sim *sim) {
  const tal_implicit *s = &sim->implicit;
  const tal_implicit_lanes *m = &s->lane;
  const double *spring = s->springs ? m->kept_spring : m->ft;
  if (s->listed != sim->neighbours.rebuilds)
    return;
  for (size_t lane = 0; lane < s->lanes; lane++) {
    if (m->filler[lane])
      continue;
    const bool wall = m->slot[lane] < 0;
    tal_contacts *slots = wall ? &sim->wall_contacts : &sim->pairs;
    const size_t c = (size_t)(wall ? ~m->slot[lane] : m->slot[lane]);
    slots->spring[c] = spring[lane];
    slots->spring_stiffness[c] = m->kept_stiffness[lane];
    slots->viscous[c] = m->fn[lane] - m->elastic[lane];
  }
}
