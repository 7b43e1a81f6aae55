// See order.h. Layers are as good as any curve here: what counts is how far apart in memory two grains in contact lie
// at most, and that is the grains of two layers. A curve that fills space has neighbours half a sample apart.
#include "order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct place {
  double layer, along;
  int32_t grain;
} place;

static int compare_places(const void *a, const void *b) {
  const place *p = a, *q = b;
  if (p->layer != q->layer)
    return p->layer < q->layer ? -1 : 1;
  if (p->along != q->along)
    return p->along < q->along ? -1 : 1;
  return p->grain < q->grain ? -1 : p->grain > q->grain;
}

static double extent(const double *value, size_t count) {
  double low = value[0], high = value[0];
  for (size_t i = 1; i < count; i++) {
    low = fmin(low, value[i]);
    high = fmax(high, value[i]);
  }
  return high - low;
}

// from[k]: grain that comes k-th.
static int32_t *layers(const tal_grains *g) {
  const bool tall = extent(g->y, g->count) >= extent(g->x, g->count);
  const double *across = tall ? g->y : g->x, *along = tall ? g->x : g->y;
  double diameter = 0;
  for (size_t i = 0; i < g->count; i++)
    diameter += 2 * g->r[i] / (double)g->count;
  place *all = tal_alloc(g->count, sizeof *all);
  for (size_t i = 0; i < g->count; i++)
    all[i] = (place){floor(across[i] / diameter), along[i], (int32_t)i};
  qsort(all, g->count, sizeof *all, compare_places);
  int32_t *from = tal_alloc(g->count, sizeof *from);
  for (size_t k = 0; k < g->count; k++)
    from[k] = all[k].grain;
  free(all);
  return from;
}

// to[k] = from[index[k]]; both elements of the given size.
static void pick(void *to, const void *from, const int32_t *index, size_t count, size_t size) {
  for (size_t k = 0; k < count; k++)
    memcpy((char *)to + k * size, (const char *)from + (size_t)index[k] * size, size);
}

static void pick_grains(tal_grains *to, const tal_grains *from, const int32_t *index) {
  tal_grains_init(to, from->count);
#define X(type, name, unit, kept, meaning) pick(to->name, from->name, index, from->count, sizeof *to->name);
  TAL_GRAIN_FIELDS(X)
#undef X
}

void tal_order_grains(tal_grains *grains) {
  if (grains->count < TAL_ORDER_FROM)
    return;
  int32_t *from = layers(grains);
  tal_grains laid;
  pick_grains(&laid, grains, from);
  tal_grains_clear(grains);
  *grains = laid;
  free(from);
}

int32_t *tal_order_of_ids(const tal_grains *grains) {
  int32_t *index = tal_alloc(grains->count, sizeof *index);
  for (size_t i = 0; i < grains->count; i++)
    index[grains->id[i]] = (int32_t)i;
  return index;
}

// ---- instants in the order of ids -----------------------------------------------------------------------------------

static bool in_order(const tal_grains *g) {
  for (size_t i = 0; i < g->count; i++)
    if (g->id[i] != (int64_t)i)
      return false;
  return true;
}

typedef struct pair {
  int32_t i, j, slot;
} pair;

static int compare_pairs(const void *a, const void *b) {
  const pair *p = a, *q = b;
  if (p->i != q->i)
    return p->i < q->i ? -1 : 1;
  return p->j < q->j ? -1 : p->j > q->j;
}

// Slots by the ids of their bodies, ascending. Seen from the other grain the normal turns over, and no scalar does.
static void pick_slots(tal_contacts *to, const tal_contacts *from, const int64_t *id, bool walls) {
  pair *all = tal_alloc(from->count, sizeof *all);
  int32_t *slot = tal_alloc(from->count, sizeof *slot);
  for (size_t c = 0; c < from->count; c++) {
    int32_t i = (int32_t)id[from->i[c]], j = walls ? from->j[c] : (int32_t)id[from->j[c]];
    all[c] = walls || i < j ? (pair){i, j, (int32_t)c} : (pair){j, i, (int32_t)c};
  }
  qsort(all, from->count, sizeof *all, compare_pairs);
  for (size_t c = 0; c < from->count; c++)
    slot[c] = all[c].slot;
  tal_contacts_init(to);
  tal_contacts_reserve(to, from->count);
  to->count = from->count;
#define X(type, name, unit, kept, meaning)                                                                             \
  if (from->name)                                                                                                      \
    pick(to->name, from->name, slot, from->count, sizeof *to->name);
  TAL_CONTACT_FIELDS(X)
#undef X
  for (size_t c = 0; c < from->count; c++) {
    const bool turned = all[c].i != (int32_t)id[from->i[slot[c]]];
    to->i[c] = all[c].i;
    to->j[c] = all[c].j;
    to->nx[c] = turned ? -to->nx[c] : to->nx[c];
    to->ny[c] = turned ? -to->ny[c] : to->ny[c];
  }
  free(all);
  free(slot);
}

static void pick_graph(tal_graph *to, const tal_graph *from, const tal_grains *g, const int32_t *index) {
  const size_t n = g->count, triangles = from->mesh.triangle_count, nodes = from->loop.count;
  tal_graph_init(to);
  if (!from->valid)
    return;
  int32_t(*corner)[3] = tal_alloc(triangles, sizeof *corner), *node = tal_alloc(nodes, sizeof *node);
  double *x = tal_alloc(n, sizeof *x), *y = tal_alloc(n, sizeof *y);
  for (size_t k = 0; k < 3 * triangles; k++)
    corner[k / 3][k % 3] = (int32_t)g->id[from->mesh.corner[k / 3][k % 3]];
  for (size_t k = 0; k < nodes; k++)
    node[k] = (int32_t)g->id[from->loop.node[k]];
  pick(x, from->x, index, n, sizeof *x);
  pick(y, from->y, index, n, sizeof *y);
  tal_graph_restore(to, n, (const int32_t(*)[3])corner, triangles, node, nodes, from->inside, x, y);
  free(corner);
  free(node);
  free(x);
  free(y);
}

void tal_by_id_init(tal_by_id *copy, const tal_observed *seen) {
  *copy = (tal_by_id){.seen = *seen};
  if (in_order(seen->grains))
    return;
  int32_t *index = tal_order_of_ids(seen->grains);
  pick_grains(&copy->grains, seen->grains, index);
  pick_slots(&copy->pairs, seen->pairs, seen->grains->id, false);
  pick_slots(&copy->walls, seen->walls, seen->grains->id, true);
  pick_graph(&copy->graph, seen->graph, seen->grains, index);
  copy->seen.grains = &copy->grains;
  copy->seen.pairs = &copy->pairs;
  copy->seen.walls = &copy->walls;
  copy->seen.graph = &copy->graph;
  free(index);
}

void tal_by_id_clear(tal_by_id *copy) {
  tal_grains_clear(&copy->grains);
  tal_contacts_clear(&copy->pairs);
  tal_contacts_clear(&copy->walls);
  tal_graph_clear(&copy->graph);
}
