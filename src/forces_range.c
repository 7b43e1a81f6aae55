// The hot loop, one pass over memory. Slots ascend by (i, j): grains up to the last partner of a block of contacts are
// drifted and what the laws see of them goes into a ring of records; the block is worked out, its forces are added to
// the sums of both grains, and grains below the next slot's i are complete and kicked while their sums are still in the
// cache. Only the grains between the two ends of a contact are alive at a time: two rings hold their records and sums.
// Measured by tests/bench/bench_step.c.
//
// Each thread takes a range of grains. Contacts that reach into it from below belong to another thread's range: before
// anyone moves a history, each thread works out the slots just below its range for its own grains' sake. So every
// grain sums the same numbers in the same order, whatever the number of threads. The records of other threads' grains
// are taken before anyone moves a grain.
#include "forces_range.h"

#include "boundary.h"
#include "drift.h"
#include "forces.h"
#include "kick.h"

#include <string.h>

_Static_assert(sizeof(tal_grain_record) == sizeof(tal_force_record), "the rings have the same places");

enum { GRAINS = TAL_KICK_GRAINS };
// A cache line of doubles, and the grains and slots that memory is asked for at a time. Smaller samples than ASK_FROM
// grains stay in some cache.
enum { LINE = 8, ASK_GRAINS = LINE, ASK_SLOTS = 2 * LINE, ASK_FROM = 16000 };
// How far ahead of use, in grains and slots.
enum { AHEAD_GRAINS = GRAINS, AHEAD_SLOTS = 4 * TAL_BLOCK };

// Arrays that a step goes through.
typedef struct arrays {
  const double *array[18];
  int count;
} arrays;

typedef struct range {
  tal_sim *sim;
  tal_sweep sweep;
  tal_force_record *sum;    // ring; grain g at g & mask, zero where no contact has been added
  tal_grain_record *record; // ring, the same places
  tal_grain_record *beyond; // records of the grains from `last` on, other threads'
  size_t mask;
  size_t last;  // grains below are this thread's
  size_t seen;  // grains below have drifted and have a record
  size_t done;  // grains below are dealt with
  size_t asked; // memory has been asked for grains below
  arrays of_grains, of_slots;
  bool kicks; // grains are kicked when complete, else forgotten
  int64_t fastest;
} range;

// ---- records --------------------------------------------------------------------------------------------------------

// Records of the grains below `end`, whole handfuls.
static void see(range *t, size_t end) {
  const size_t all = t->sim->grains.count;
  for (; t->seen < end && t->seen < all; t->seen += GRAINS) {
    const int count = (int)(all - t->seen < GRAINS ? all - t->seen : GRAINS);
    tal_grain_record *to = t->record + (t->seen & t->mask);
    if (t->seen >= t->last) {
      memcpy(to, t->beyond + (t->seen - t->last), (size_t)count * sizeof *to);
      continue;
    }
    if (t->sweep.drifts)
      tal_drift_group(t->sim, t->seen, count, t->sweep.dt, to);
    else
      tal_drift_records(t->sim, t->seen, count, to);
  }
}

// Records of other threads' grains from `start` on, below `end`; grain g's at to[(g - first) & mask].
static void foresee(const range *t, size_t start, size_t end, tal_grain_record *to, size_t first, size_t mask) {
  const size_t all = t->sim->grains.count;
  for (; start < end && start < all; start += GRAINS) {
    const int count = (int)(all - start < GRAINS ? all - start : GRAINS);
    if (t->sweep.drifts)
      tal_drift_foresee(t->sim, start, count, t->sweep.dt, to + ((start - first) & mask));
    else
      tal_drift_records(t->sim, start, count, to + ((start - first) & mask));
  }
}

// The centres that this thread's grains of the loop are going to have.
static void foresee_loop(const range *t, size_t from) {
  const tal_grains *g = &t->sim->grains;
  const geo_loop *loop = &t->sim->graph.loop;
  const double dt = t->sweep.dt, half = 0.5 * dt;
  for (size_t k = 0; k < loop->count; k++) {
    const size_t i = (size_t)loop->node[k];
    if (i < from || i >= t->last)
      continue;
    t->sim->loop_centre[k][0] = g->x[i] + dt * (g->vx[i] + half * (g->fx[i] * g->inverse_mass[i]));
    t->sim->loop_centre[k][1] = g->y[i] + dt * (g->vy[i] + half * (g->fy[i] * g->inverse_mass[i]));
  }
}

// ---- memory ---------------------------------------------------------------------------------------------------------

static void put(arrays *a, const double *array) {
  if (array)
    a->array[a->count++] = array;
}

static void find_arrays(range *t) {
  const tal_grains *g = &t->sim->grains;
  const tal_contacts *s = &t->sim->pairs;
  const unsigned effects = t->sim->effects;
  const double *const move[] = {g->x, g->y, g->vx, g->vy, g->fx, g->fy, g->inverse_mass};
  const double *const turn[] = {g->theta, g->omega, g->torque, g->inverse_inertia, g->r};
  const double *const past[] = {s->reach, s->stiffness, s->damping, s->spring, s->spring_stiffness};
  if (g->count < ASK_FROM)
    return;
  for (size_t m = 0; m < sizeof move / sizeof *move; m++)
    put(&t->of_grains, move[m]);
  for (size_t m = 0; effects & TAL_EFFECT_SPIN && m < sizeof turn / sizeof *turn; m++)
    put(&t->of_grains, turn[m]);
  put(&t->of_grains, effects & TAL_EFFECT_GRAVITY ? g->mass : NULL);
  for (size_t m = 0; m < sizeof past / sizeof *past; m++)
    put(&t->of_slots, past[m]);
}

// Asks for what is needed soon, a few lines at a time between sums: many at once would be more than the processor can
// wait for beside its work, and by itself it foresees too little of so many arrays.
static void ask(range *t, size_t slot) {
  const tal_contacts *s = &t->sim->pairs;
  const size_t grain = t->asked > t->seen ? t->asked : t->seen;
  if (!t->of_grains.count)
    return;
  slot += AHEAD_SLOTS;
  __builtin_prefetch(s->i + slot);
  for (int line = 0; line < ASK_SLOTS; line += LINE)
    __builtin_prefetch(t->sim->neighbours.seat + slot + line);
  for (int m = 0; m < t->of_slots.count; m++)
    for (int line = 0; line < ASK_SLOTS; line += LINE)
      __builtin_prefetch(t->of_slots.array[m] + slot + line, 1);
  if (grain >= t->seen + AHEAD_GRAINS || grain >= t->last)
    return;
  for (int m = 0; m < t->of_grains.count; m++)
    __builtin_prefetch(t->of_grains.array[m] + grain, 1);
  if (t->sim->effects & TAL_EFFECT_BOUNDARY && t->sim->pressed[grain / GRAINS]) {
    __builtin_prefetch(t->sim->grains.bx + grain);
    __builtin_prefetch(t->sim->grains.by + grain);
  }
  t->asked = grain + ASK_GRAINS;
}

// ---- sums -----------------------------------------------------------------------------------------------------------

TAL_KERNEL void add_group(range *t, const tal_seat *at, const tal_force_block *b, int k, int count, unsigned effects) {
  const tal_lanes signs = {-1, -1, 1, 1}; // on j the vectors change sign, the torque does not
  tal_lanes first[4], second[4];
  tal_force_block_turn(b, k, first, second, effects);
  for (int m = 0; m < count; m++) {
    tal_force_halves *at_i = tal_at(t->sum, at[k + m].i), *at_j = tal_at(t->sum, at[k + m].j);
    at_i->first += first[m]; // stores to one line side by side: the other order costs a tenth of a step
    if (effects & TAL_EFFECT_FRICTION)
      at_i->second += second[m];
    at_j->first -= first[m];
    if (effects & TAL_EFFECT_FRICTION)
      at_j->second += signs * second[m];
  }
}

TAL_KERNEL void add(range *t, const tal_seat *at, const tal_force_block *b, size_t start, int count, unsigned effects) {
  const int whole = count & ~3;
  for (int k = 0; k < whole; k += 4) {
    if (k % ASK_SLOTS == 0)
      ask(t, start + (size_t)k);
    add_group(t, at, b, k, 4, effects);
  }
  if (whole < count)
    add_group(t, at, b, whole, count - whole, effects);
}

static void add_block(range *t, const tal_seat *at, const tal_force_block *b, size_t start, int count) {
  const bool friction = t->sweep.law & TAL_EFFECT_FRICTION, damping = t->sweep.law & TAL_EFFECT_DAMPING;
  if (friction && damping)
    add(t, at, b, start, count, TAL_EFFECT_FRICTION | TAL_EFFECT_DAMPING);
  else if (friction)
    add(t, at, b, start, count, TAL_EFFECT_FRICTION);
  else if (damping)
    add(t, at, b, start, count, TAL_EFFECT_DAMPING);
  else
    add(t, at, b, start, count, 0);
}

// ---- ranges ---------------------------------------------------------------------------------------------------------

// The walls of a handful of grains, and its kick.
static int64_t finish(range *t, int count) {
  see(t, t->done + (size_t)count);
  if (t->sim->effects & TAL_EFFECT_WALLS) {
    const int32_t *first = t->sim->neighbours.wall_first + t->done;
    tal_forces_sweep_walls(t->sim, &t->sweep, t->record, t->mask, (size_t)first[0], (size_t)first[count]);
  }
  return tal_kick(t->sim, t->sum + (t->done & t->mask), t->done, count, t->sweep.dt);
}

// Sums of grains that others kick.
static void forget(range *t, size_t count) {
  for (size_t k = 0; k < count; k++)
    t->sum[(t->done + k) & t->mask] = (tal_force_record){0};
}

// The grains below `end` are complete; those that do not fill a handful may wait.
static void complete(range *t, size_t end, bool all) {
  while (end > t->done && (all || end - t->done >= GRAINS)) {
    size_t count = end - t->done < GRAINS ? end - t->done : GRAINS;
    if (t->kicks) {
      int64_t fastest = finish(t, (int)count);
      t->fastest = fastest > t->fastest ? fastest : t->fastest;
    } else {
      forget(t, count);
    }
    t->done += count;
  }
}

// First slot whose i is not below the grain.
static size_t slot_of(const tal_contacts *slots, size_t grain) {
  size_t first = 0, end = slots->count;
  while (first < end) {
    size_t middle = first + (end - first) / 2;
    if ((size_t)slots->i[middle] < grain)
      first = middle + 1;
    else
      end = middle;
  }
  return first;
}

// All slots whose i lies in [t->done, last).
static void work_off(range *t, size_t last) {
  const tal_contacts *slots = &t->sim->pairs;
  const tal_seat *seat = t->sim->neighbours.seat;
  const size_t end = slot_of(slots, last);
  for (size_t start = slot_of(slots, t->done); start < end; start += TAL_BLOCK) {
    int count = (int)(end - start < TAL_BLOCK ? end - start : TAL_BLOCK);
    tal_force_block b;
    complete(t, (size_t)slots->i[start], false);
    see(t, (size_t)slots->i[start + (size_t)count - 1] + t->sim->neighbours.span + 1);
    tal_contact_block(t->sim, &t->sweep, t->record, seat + start, start, count, &b);
    add_block(t, seat + start, &b, start, count);
  }
  complete(t, last, true);
}

int64_t tal_forces_range(tal_sim *sim, const tal_sweep *sweep, int part, int parts) {
  const size_t ring = sim->neighbours.ring, span = sim->neighbours.span;
  const size_t groups = (sim->grains.count + GRAINS - 1) / GRAINS;
  const size_t first = groups * (size_t)part / (size_t)parts * GRAINS;
  const size_t beyond = groups * (size_t)(part + 1) / (size_t)parts * GRAINS;
  const size_t last = beyond < sim->grains.count ? beyond : sim->grains.count;
  range t = {.sim = sim,
             .sweep = *sweep,
             .sum = sim->sums + (size_t)part * ring,
             .record = sim->rings + 2 * (size_t)part * ring,
             .mask = ring - 1,
             .last = last,
             .seen = first};
  t.beyond = t.record + ring;
  t.done = first > span ? first - span : 0;
  find_arrays(&t);
  t.sweep.moves = false;
  foresee(&t, t.done / GRAINS * GRAINS, first, t.record, 0, t.mask);
  foresee(&t, last, last + span, t.beyond, last, SIZE_MAX);
  const tal_boundary *boundary = sweep->drifts ? sim->boundary : NULL;
  if (boundary)
    foresee_loop(&t, first);
  if (parts > 1) {
#pragma omp barrier
  }
  if (boundary)
    boundary->press(sim, first, last);
  work_off(&t, first);
  if (parts > 1 && sweep->law & TAL_EFFECT_SPRING) { // the only history
#pragma omp barrier
  }
  t.sweep.moves = sweep->moves;
  t.kicks = true;
  work_off(&t, last);
  t.kicks = false;
  complete(&t, last + span, true); // what other threads' grains were given
  return t.fastest;
}
