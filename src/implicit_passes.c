// Passes over the tiles. In effect a pass goes over all even tiles, then over all odd ones, and the next pass begins
// when it is done. Only neighbours meet: a pass on an even tile has to follow the pass before on both neighbours, on an
// odd tile the same pass on them. So the passes follow each other through the sample at a distance of two tiles, and
// what they work on is in the cache still. Threads take ranges of tiles and go as far as they can without their
// neighbours' tiles; what is left about the ends of the ranges is done by one. No order but that of neighbours counts:
// the same bits for any number of threads.
#include "implicit_parts.h"

#include "effects.h"
#include "hot.h"

#include <omp.h>

enum { BLOCK = TAL_IMPLICIT_BLOCK };
// A range of fewer tiles is all end.
enum { TILES_PER_THREAD = 6 };

// Passes under way on the tiles [begin, end).
typedef struct work_list {
  const tal_implicit_solve *solve;
  const tal_implicit_pass *pass;
  int count;
  double factor;
  ptrdiff_t begin, end;
} work_list;

// Velocities before the kick, and after it with the boundary's forces and gravity alone.
static void set_one(const tal_implicit_solve *s, size_t i, bool spin, bool boundary) {
  const tal_grains *g = &s->sim->grains;
  const double kick = g->inverse_mass[i] > 0 ? s->kick : 0, w = spin ? g->omega[i] : 0;
  double ax = s->sim->scene->gravity[0], ay = s->sim->scene->gravity[1];
  if (boundary) {
    ax += g->bx[i] * g->inverse_mass[i];
    ay += g->by[i] * g->inverse_mass[i];
  }
  tal_implicit_body *body = &s->system->lane.body[i];
  body->place = (tal_lanes){g->x[i], g->y[i], 0, 0};
  body->before = (tal_lanes){g->vx[i], g->vy[i], w, w};
  body->now = (tal_lanes){g->vx[i] + kick * ax, g->vy[i] + kick * ay, w, w};
}

static tal_lanes four(const double *from) {
  return *(const tal_lanes *)from;
}

// The same of grains i ... i + 3, i a multiple of 4.
static void set_four(const tal_implicit_solve *s, size_t i, bool spin, bool boundary) {
  const tal_grains *g = &s->sim->grains;
  const tal_lanes nil = {0}, inverse_mass = four(g->inverse_mass + i), w = spin ? four(g->omega + i) : nil;
  tal_lanes kick = nil + s->kick;
  for (int q = 0; q < 4; q++)
    kick[q] = inverse_mass[q] > 0 ? kick[q] : 0;
  tal_lanes ax = nil + s->sim->scene->gravity[0], ay = nil + s->sim->scene->gravity[1];
  if (boundary) {
    ax += four(g->bx + i) * inverse_mass;
    ay += four(g->by + i) * inverse_mass;
  }
  const tal_lanes vx = four(g->vx + i), vy = four(g->vy + i);
  tal_lanes place[4] = {four(g->x + i), four(g->y + i), nil, nil}, before[4] = {vx, vy, w, w};
  tal_lanes now[4] = {vx + kick * ax, vy + kick * ay, w, w};
  tal_lanes_turn(place);
  tal_lanes_turn(before);
  tal_lanes_turn(now);
  for (size_t q = 0; q < 4; q++)
    s->system->lane.body[i + q] = (tal_implicit_body){.place = place[q], .now = now[q], .before = before[q]};
}

static void set_grains(const tal_implicit_solve *s, size_t from, size_t to) {
  const bool spin = s->effects & TAL_EFFECT_SPIN, boundary = s->effects & TAL_EFFECT_BOUNDARY;
  size_t i = from;
  for (; i < to && i % 4 != 0; i++)
    set_one(s, i, spin, boundary);
  for (; i + 4 <= to; i += 4)
    set_four(s, i, spin, boundary);
  for (; i < to; i++)
    set_one(s, i, spin, boundary);
}

// One colour: the largest of what its blocks return.
static double take_colour(const tal_implicit_solve *s, tal_implicit_pass what, size_t from, size_t to, size_t size,
                          double factor) {
  double largest = 0;
  for (size_t start = from; start < to; start += size) {
    double change = s->sim->hot->implicit_take(s, what, start, (int)(to - start < size ? to - start : size), factor);
    largest = change > largest ? change : largest;
  }
  return largest;
}

static void sweep_tile(const tal_implicit_solve *s, tal_implicit_pass what, tal_implicit_tile *tile, double factor) {
  const size_t *first = s->system->first + tile->colour;
  double largest = 0;
  for (size_t c = 0; c < tile->colours; c++) {
    const bool serial = tile->serial_last && c + 1 == tile->colours;
    double change = take_colour(s, what, first[c], first[c + 1], serial ? TAL_IMPLICIT_VECTOR : BLOCK, factor);
    largest = change > largest ? change : largest;
  }
  if (what == TAL_IMPLICIT_CORRECT)
    tile->change = largest;
}

static void work_tile(const tal_implicit_solve *s, tal_implicit_tile *tile) {
  const size_t *first = s->system->first + tile->colour, end = first[tile->colours];
  tile->work = (tal_implicit_works){0, 0};
  for (size_t start = first[0]; start < end; start += BLOCK) {
    tal_implicit_works part = s->sim->hot->implicit_work(s, start, (int)(end - start < BLOCK ? end - start : BLOCK));
    tile->work.friction += part.friction;
    tile->work.damping += part.damping;
  }
}

static void pass_tile(const tal_implicit_solve *s, tal_implicit_pass what, size_t t, double factor) {
  const size_t size = s->system->tile_grains, count = s->sim->grains.count, end = (t + 1) * size;
  if (what == TAL_IMPLICIT_SET)
    set_grains(s, t * size, end < count ? end : count);
  else if (what == TAL_IMPLICIT_WORK)
    work_tile(s, &s->system->tile[t]);
  else
    sweep_tile(s, what, &s->system->tile[t], factor);
}

// Has tile t done so many passes, as far as this range knows? Beyond the sample there is nothing to wait for.
static bool has_done(const work_list *w, ptrdiff_t t, int passes) {
  if (t < 0 || t >= (ptrdiff_t)w->solve->system->tiles)
    return true;
  return passes == 0 || (t >= w->begin && t < w->end && w->solve->system->tile[t].passes >= passes);
}

// Pass p on tile t where it is its turn.
static void try_pass(const work_list *w, ptrdiff_t t, int p) {
  const int needed = p + (t & 1);
  if (t < w->begin || t >= w->end || w->solve->system->tile[t].passes != p)
    return;
  if (!has_done(w, t - 1, needed) || !has_done(w, t + 1, needed))
    return;
  pass_tile(w->solve, w->pass[p], (size_t)t, w->factor);
  w->solve->system->tile[t].passes = p + 1;
}

static void go_through(const work_list *w) {
  for (ptrdiff_t front = w->begin & ~(ptrdiff_t)1; front < w->end + 2 * w->count; front += 2)
    for (int p = 0; p < w->count; p++) {
      try_pass(w, front - 2 * p, p);
      try_pass(w, front - 2 * p - 1, p);
    }
}

void tal_implicit_passes(const tal_implicit_solve *s, const tal_implicit_pass *pass, int count, double factor) {
  const ptrdiff_t tiles = (ptrdiff_t)s->system->tiles;
  const ptrdiff_t useful = tiles / TILES_PER_THREAD, there = omp_get_max_threads();
  const int threads = (int)(useful < 1 ? 1 : useful < there ? useful : there);
  const work_list all = {s, pass, count, factor, 0, tiles};
  for (ptrdiff_t t = 0; t < tiles; t++)
    s->system->tile[t].passes = 0;
  if (threads > 1) {
#pragma omp parallel num_threads(threads)
    {
      const ptrdiff_t part = omp_get_thread_num(), parts = omp_get_num_threads();
      work_list own = all;
      own.begin = tiles * part / parts;
      own.end = tiles * (part + 1) / parts;
      go_through(&own);
    }
  }
  go_through(&all);
}
