// The hot loop. Slots ascend by (i, j): a block of contacts is worked out, its forces are added to the sums of both
// grains, and grains below the next slot's i are complete and kicked while their sums are still in the cache. Only the
// sums of the grains between the two ends of a contact are alive at a time: a ring holds them. Measured by
// tests/bench/bench_step.c.
//
// Each thread takes a range of grains. Contacts that reach into it from below belong to another thread's range: before
// anyone moves a history, each thread works out the slots just below its range for its own grains' sake. So every
// grain sums the same numbers in the same order, whatever the number of threads.
#include "forces_range.h"

#include "kick.h"

enum { GRAINS = TAL_KICK_GRAINS };

typedef struct range {
  tal_sim *sim;
  tal_sweep sweep;
  tal_force_record *sum; // ring; grain g at g & mask, zero where no contact has been added
  size_t mask;
  size_t done;    // grains below are dealt with
  size_t fetched; // records below are asked for
  bool kicks;     // grains are kicked when complete, else forgotten
} range;

// ---- sums -----------------------------------------------------------------------------------------------------------

typedef struct halves {
  tal_lanes first, second; // of a force record
} halves;

TAL_KERNEL void add_group(range *t, const int32_t *i, const int32_t *j, const tal_force_block *b, int k, int count,
                          bool friction) {
  const tal_lanes signs = {-1, -1, 1, 1}; // on j the vectors change sign, the torque does not
  tal_lanes first[4], second[4];
  tal_force_block_turn(b, k, first, second);
  for (int m = 0; m < count; m++) {
    halves *at_i = (halves *)&t->sum[(size_t)i[k + m] & t->mask], *at_j = (halves *)&t->sum[(size_t)j[k + m] & t->mask];
    at_i->first += first[m];
    at_j->first -= first[m];
    if (friction) {
      at_i->second += second[m];
      at_j->second += signs * second[m];
    }
  }
}

static void add_block(range *t, const tal_force_block *b, size_t start, int count) {
  const int32_t *i = t->sim->pairs.i + start, *j = t->sim->pairs.j + start;
  const bool friction = t->sweep.law & TAL_EFFECT_FRICTION;
  const int whole = count & ~3;
  for (int k = 0; k < whole; k += 4)
    if (friction)
      add_group(t, i, j, b, k, 4, true);
    else
      add_group(t, i, j, b, k, 4, false);
  if (whole < count)
    add_group(t, i, j, b, whole, count - whole, friction);
}

// Takes the sums of grains off the ring.
static void take_sums(range *t, size_t start, int count, tal_force_block *out) {
  for (int k = 0; k < count; k += 4) {
    tal_lanes first[4], second[4];
    for (int m = 0; m < 4; m++) {
      halves *sum = (halves *)&t->sum[(start + (size_t)(k + m)) & t->mask];
      first[m] = sum->first;
      second[m] = sum->second;
      if (k + m < count)
        *sum = (halves){{0}, {0}};
    }
    tal_lanes_turn(first);
    tal_lanes_turn(second);
    for (int m = 0; m < 4; m++) {
      *(tal_lanes *)&out->force[m][k] = first[m];
      *(tal_lanes *)&out->force[4 + m][k] = second[m];
    }
  }
}

// ---- ranges ---------------------------------------------------------------------------------------------------------

// The grains below `end` are complete; those that do not fill a handful may wait.
static void complete(range *t, size_t end, bool all) {
  while (end > t->done && (all || end - t->done >= GRAINS)) {
    size_t count = end - t->done < GRAINS ? end - t->done : GRAINS;
    tal_force_block sums;
    take_sums(t, t->done, (int)count, &sums);
    if (t->kicks)
      tal_kick(t->sim, &sums, t->done, (int)count, t->sweep.dt);
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

// Asks for the records of all partners of the next slots: partners come in no order that the processor would foresee.
static void fetch_ahead(range *t, size_t grain) {
  const size_t last = grain + t->sim->neighbours.span + TAL_BLOCK, count = t->sim->grains.count;
  for (; t->fetched < last && t->fetched < count; t->fetched++)
    __builtin_prefetch(&t->sim->grain_records[t->fetched]);
}

// All slots whose i lies in [t->done, last).
static void work_off(range *t, size_t last) {
  const tal_contacts *slots = &t->sim->pairs;
  const size_t end = slot_of(slots, last);
  for (size_t start = slot_of(slots, t->done); start < end; start += TAL_BLOCK) {
    int count = (int)(end - start < TAL_BLOCK ? end - start : TAL_BLOCK);
    tal_force_block b;
    complete(t, (size_t)slots->i[start], false);
    fetch_ahead(t, (size_t)slots->i[start]);
    tal_contact_block(t->sim, &t->sweep, start, count, &b);
    add_block(t, &b, start, count);
  }
  complete(t, last, true);
}

void tal_forces_range(tal_sim *sim, const tal_sweep *sweep, int part, int parts) {
  const size_t ring = sim->neighbours.ring, span = sim->neighbours.span;
  const size_t groups = (sim->grains.count + GRAINS - 1) / GRAINS;
  const size_t first = groups * (size_t)part / (size_t)parts * GRAINS;
  const size_t beyond = groups * (size_t)(part + 1) / (size_t)parts * GRAINS;
  const size_t last = beyond < sim->grains.count ? beyond : sim->grains.count;
  range t = {.sim = sim, .sweep = *sweep, .sum = sim->sums + (size_t)part * ring, .mask = ring - 1};
  t.done = t.fetched = first > span ? first - span : 0;
  t.sweep.moves = false;
  work_off(&t, first);
  if (parts > 1 && sweep->law & TAL_EFFECT_SPRING) { // the only history
#pragma omp barrier
  }
  t.sweep.moves = sweep->moves;
  t.kicks = true;
  work_off(&t, last);
  t.kicks = false;
  complete(&t, last + span, true); // what other threads' grains were given
}
