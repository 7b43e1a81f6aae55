// See measure_chain_lives.h.
#include "measure_chain_lives.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A chain of this frame and one of the frame before that have grains in common.
typedef struct kinship {
  size_t shared;
  int32_t now, before;
} kinship;

static int closest_first(const void *a, const void *b) {
  const kinship *p = a, *q = b;
  if (p->shared != q->shared)
    return p->shared < q->shared ? 1 : -1;
  if (p->now != q->now)
    return p->now < q->now ? -1 : 1;
  return p->before < q->before ? -1 : 1;
}

// Pairs that share at least two grains and half of the shorter chain (M20).
static size_t list_kin(const tal_chain_tracker *tracker, const tal_chains *now, kinship *kin) {
  const tal_chains *before = &tracker->before;
  size_t *shared = tal_alloc(before->count, sizeof *shared), count = 0;
  for (size_t c = 0; c < now->count; c++) {
    const tal_chain *chain = &now->chain[c];
    const int32_t *grain = now->grain + chain->first;
    for (size_t k = 0; k < chain->count; k++)
      if (before->of[grain[k]] >= 0)
        shared[before->of[grain[k]]]++;
    for (size_t k = 0; k < chain->count; k++) {
      const int32_t other = before->of[grain[k]];
      if (other < 0 || !shared[other])
        continue;
      const size_t length = before->chain[other].count, shorter = length < chain->count ? length : chain->count;
      if (shared[other] >= 2 && 2 * shared[other] >= shorter)
        kin[count++] = (kinship){shared[other], (int32_t)c, other};
      shared[other] = 0;
    }
  }
  free(shared);
  qsort(kin, count, sizeof *kin, closest_first);
  return count;
}

static size_t give_birth(tal_chain_tracker *tracker, const tal_snapshot *s, size_t frame) {
  tracker->life = tal_grow(tracker->life, tracker->life_count, tracker->life_count + 1, sizeof *tracker->life);
  tracker->life[tracker->life_count] = (tal_chain_life){
      .born = frame, .born_time = s->time, .born_strain = s->axial_strain, .from_start = tracker->frames_seen == 0};
  return tracker->life_count++;
}

static const size_t no_one = SIZE_MAX;

// id[now]: the life each chain goes on with. Each chain of before goes on as one, that with the most in common.
static void name_chains(tal_chain_tracker *tracker, const tal_chains *now, const tal_snapshot *s, size_t frame,
                        size_t *id) {
  kinship *kin = tal_alloc(now->grain_count, sizeof *kin);
  bool *taken = tal_alloc(tracker->before.count, sizeof *taken);
  const size_t count = tracker->before.of ? list_kin(tracker, now, kin) : 0;
  for (size_t c = 0; c < now->count; c++)
    id[c] = no_one;
  for (size_t k = 0; k < count; k++) {
    if (id[kin[k].now] != no_one || taken[kin[k].before])
      continue;
    id[kin[k].now] = tracker->id[kin[k].before];
    taken[kin[k].before] = true;
    tracker->gone_on++;
  }
  tracker->ended = tracker->before.count - tracker->gone_on;
  for (size_t c = 0; c < now->count; c++) {
    tracker->born += id[c] == no_one;
    if (id[c] == no_one)
      id[c] = give_birth(tracker, s, frame);
    tal_chain_life *life = &tracker->life[id[c]];
    life->last = frame;
    life->last_time = s->time;
    life->last_strain = s->axial_strain;
    life->frames++;
    life->longest = now->chain[c].count > life->longest ? now->chain[c].count : life->longest;
  }
  free(kin);
  free(taken);
}

// ---- buckling ----

static double angle_at(const double *x, const double *y, const int32_t grain[3]) {
  const double ax = x[grain[0]] - x[grain[1]], ay = y[grain[0]] - y[grain[1]];
  const double bx = x[grain[2]] - x[grain[1]], by = y[grain[2]] - y[grain[1]];
  return fabs(atan2(ax * by - ay * bx, ax * bx + ay * by));
}

static void look_at(tal_chain_tracker *tracker, const tal_chains *now, const tal_snapshot *s, size_t life,
                    const int32_t *grain) {
  tal_buckling event = {life, {grain[0], grain[1], grain[2]}, 0, 0, 0};
  const double load = tracker->before.major[grain[1]];
  tracker->segments++;
  event.before = angle_at(tracker->x, tracker->y, grain);
  event.after = angle_at(s->x, s->y, grain);
  event.lost = 1 - now->major[grain[1]] / load;
  if (event.before - event.after < 2 * TAL_BUCKLING_ANGLE || !(event.lost > 0))
    return;
  tracker->event = tal_grow(tracker->event, tracker->event_count, tracker->event_count + 1, sizeof event);
  tracker->event[tracker->event_count++] = event;
  tracker->life[life].buckled++;
}

static void find_buckling(tal_chain_tracker *tracker, const tal_chains *now, const tal_snapshot *s) {
  const tal_chains *before = &tracker->before;
  for (size_t c = 0; c < before->count; c++)
    for (size_t k = 0; k + 2 < before->chain[c].count; k++)
      look_at(tracker, now, s, tracker->id[c], before->grain + before->chain[c].first + k);
}

// ---- frames ----

static void forget(tal_chain_tracker *tracker) {
  tal_chains_clear(&tracker->before);
  free(tracker->id);
  free(tracker->grain_id);
  free(tracker->x);
  free(tracker->y);
  tracker->id = NULL;
  tracker->grain_id = NULL;
  tracker->x = tracker->y = NULL;
}

static void *copy(const void *from, size_t count, size_t size) {
  void *to = tal_alloc(count, size);
  return count ? memcpy(to, from, count * size) : to;
}

void tal_chain_tracker_add(tal_chain_tracker *tracker, tal_chains *chains, const tal_snapshot *s, size_t frame) {
  const size_t n = s->grain_count;
  size_t *id = tal_alloc(chains->count, sizeof *id);
  if (tracker->grain_count != n || (tracker->grain_id && memcmp(tracker->grain_id, s->id, n * sizeof *s->id) != 0))
    forget(tracker);
  tracker->born = tracker->gone_on = tracker->ended = tracker->segments = tracker->event_count = 0;
  if (tracker->before.of)
    find_buckling(tracker, chains, s);
  name_chains(tracker, chains, s, frame, id);
  forget(tracker);
  tracker->before = *chains;
  *chains = (tal_chains){0};
  tracker->id = id;
  tracker->grain_count = n;
  tracker->grain_id = copy(s->id, n, sizeof *s->id);
  tracker->x = copy(s->x, n, sizeof *s->x);
  tracker->y = copy(s->y, n, sizeof *s->y);
  tracker->frame = frame;
  tracker->frames_seen++;
}

void tal_chain_tracker_end(tal_chain_tracker *tracker) {
  for (size_t k = 0; k < tracker->life_count; k++)
    tracker->life[k].to_end = tracker->life[k].last == tracker->frame;
}

void tal_chain_tracker_clear(tal_chain_tracker *tracker) {
  forget(tracker);
  free(tracker->life);
  free(tracker->event);
  *tracker = (tal_chain_tracker){0};
}
