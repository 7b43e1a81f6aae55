// Lawson flips and Bowyer-Watson insertion with exact predicates.
// Deterministic: the regular triangulation is unique up to ties, and those are broken last, so neither the candidate
// nor the order of insertion shows in the result.
#include "regular.h"

#include <stdlib.h>
#include <string.h>

#include "memory.h"
#include "tie_break.h"
#include "working.h"

// ---- flips ----

typedef struct edge_stack {
  size_t count, capacity;
  int32_t (*edge)[2]; // triangle, opposite corner
} edge_stack;

static void push_edge(edge_stack *stack, int32_t t, int k) {
  if (stack->count == stack->capacity) {
    stack->capacity = geo_capacity(stack->capacity, stack->count + 1);
    stack->edge = geo_resize(stack->edge, stack->capacity, sizeof *stack->edge);
  }
  stack->edge[stack->count][0] = t;
  stack->edge[stack->count++][1] = k;
}

static geo_site site_of(const geo_working *w, int32_t t, int k) {
  return w->site[w->corner[t][k]];
}

// What flipping has met so far.
typedef struct flips {
  bool changed; // a flip was made
  bool ties;    // an edge lay exactly on the circle, at the time
} flips;

static bool edge_in_conflict(const geo_working *w, int32_t t, int k, flips *met) {
  int32_t u = w->neighbour[t][k];
  if (geo_working_ghost(w, t) >= 0 || geo_working_ghost(w, u) >= 0)
    return false;
  geo_site d = site_of(w, u, geo_working_side(w, u, t));
  int conflict = geo_conflict(site_of(w, t, 0), site_of(w, t, 1), site_of(w, t, 2), d);
  met->ties |= conflict == 0;
  return conflict > 0;
}

// Triangles t = (a, b, c) and u = (d, c, b) become t = (a, b, d) and u = (a, d, c). False if that would turn one over.
static bool flip(geo_working *w, int32_t t, int k, edge_stack *stack) {
  int32_t u = w->neighbour[t][k];
  int m = geo_working_side(w, u, t);
  int32_t a = w->corner[t][k], b = w->corner[t][(k + 1) % 3], c = w->corner[t][(k + 2) % 3], d = w->corner[u][m];
  if (geo_orient(w->site[a], w->site[b], w->site[d]) <= 0 || geo_orient(w->site[a], w->site[d], w->site[c]) <= 0)
    return false;
  int32_t ca = w->neighbour[t][(k + 1) % 3], ab = w->neighbour[t][(k + 2) % 3];
  int32_t bd = w->neighbour[u][(m + 1) % 3], dc = w->neighbour[u][(m + 2) % 3];
  int ca_side = geo_working_side(w, ca, t), ab_side = geo_working_side(w, ab, t);
  int bd_side = geo_working_side(w, bd, u), dc_side = geo_working_side(w, dc, u);
  memcpy(w->corner[t], (int32_t[3]){a, b, d}, sizeof *w->corner);
  memcpy(w->corner[u], (int32_t[3]){a, d, c}, sizeof *w->corner);
  geo_working_join(w, t, 1, u, 2);
  geo_working_join(w, t, 2, ab, ab_side);
  geo_working_join(w, t, 0, bd, bd_side);
  geo_working_join(w, u, 0, dc, dc_side);
  geo_working_join(w, u, 1, ca, ca_side);
  push_edge(stack, t, 0);
  push_edge(stack, t, 2);
  push_edge(stack, u, 0);
  push_edge(stack, u, 1);
  return true;
}

// Flips until every edge is locally regular: each flip lowers the lifted surface, so this ends. False if an edge in
// conflict cannot be flipped (power only: a site that should be hidden is a vertex).
static bool flip_all(geo_working *w, flips *met) {
  edge_stack stack = {0};
  bool good = true;
  *met = (flips){0};
  for (size_t t = 0; t < w->count; t++)
    for (int k = 0; k < 3; k++)
      if (w->neighbour[t][k] > (int32_t)t && edge_in_conflict(w, (int32_t)t, k, met))
        push_edge(&stack, (int32_t)t, k);
  while (stack.count && good) {
    const int32_t *edge = stack.edge[--stack.count];
    int32_t t = edge[0], k = edge[1];
    if (!edge_in_conflict(w, t, k, met))
      continue;
    met->changed = true;
    good = flip(w, t, k, &stack);
  }
  free(stack.edge);
  return good;
}

// ---- insertion ----

typedef struct border_edge {
  int32_t from, to; // counter-clockwise around the cavity
  int32_t outside;  // triangle beyond
  int32_t side;     // the edge's position there
} border_edge;

typedef struct inserter {
  geo_working w;
  int32_t hint;        // where the next search starts
  int32_t *cavity;     // triangles in conflict with the new site
  border_edge *border; // edges around them
  size_t cavity_count, cavity_capacity, border_count, border_capacity;
} inserter;

// Where p lies: a finite triangle that holds it, or a ghost whose rim edge it lies strictly outside of. The walk ends
// because a regular triangulation has no cyclic line of sight (Edelsbrunner 1990).
static int32_t locate(const geo_working *w, int32_t t, geo_site p) {
  int g = geo_working_ghost(w, t);
  if (g >= 0)
    t = w->neighbour[t][g];
  for (;;) {
    int k = 0;
    while (k < 3 && geo_orient(site_of(w, t, (k + 1) % 3), site_of(w, t, (k + 2) % 3), p) >= 0)
      k++;
    if (k == 3)
      return t;
    t = w->neighbour[t][k];
    if (geo_working_ghost(w, t) >= 0)
      return t;
  }
}

// A ghost is in conflict with what lies outside its edge; on the edge's line the finite triangle behind it decides,
// which is the limit of a site moved there from within.
static bool in_conflict(const geo_working *w, int32_t t, geo_site p) {
  int g = geo_working_ghost(w, t);
  if (g >= 0) {
    int turn = geo_orient(site_of(w, t, (g + 1) % 3), site_of(w, t, (g + 2) % 3), p);
    if (turn != 0)
      return turn > 0;
    t = w->neighbour[t][g];
  }
  return geo_conflict(site_of(w, t, 0), site_of(w, t, 1), site_of(w, t, 2), p) > 0;
}

static void add_to_cavity(inserter *in, int32_t t, int32_t p) {
  if (in->cavity_count == in->cavity_capacity) {
    in->cavity_capacity = geo_capacity(in->cavity_capacity, in->cavity_count + 1);
    in->cavity = geo_resize(in->cavity, in->cavity_capacity, sizeof *in->cavity);
  }
  in->cavity[in->cavity_count++] = t;
  in->w.stamp[t] = p;
}

static void add_to_border(inserter *in, border_edge edge) {
  if (in->border_count == in->border_capacity) {
    in->border_capacity = geo_capacity(in->border_capacity, in->border_count + 1);
    in->border = geo_resize(in->border, in->border_capacity, sizeof *in->border);
  }
  in->border[in->border_count++] = edge;
}

// All triangles in conflict with site p, found from `first` across edges, and the edges around them.
static void open_cavity(inserter *in, int32_t first, int32_t p) {
  geo_working *w = &in->w;
  in->cavity_count = in->border_count = 0;
  add_to_cavity(in, first, p);
  for (size_t s = 0; s < in->cavity_count; s++)
    for (int k = 0; k < 3; k++) {
      int32_t t = in->cavity[s], u = w->neighbour[t][k];
      if (w->stamp[u] == p)
        continue;
      if (in_conflict(w, u, w->site[p])) {
        add_to_cavity(in, u, p);
        continue;
      }
      int32_t from = w->corner[t][(k + 1) % 3], to = w->corner[t][(k + 2) % 3];
      add_to_border(in, (border_edge){from, to, u, geo_working_side(w, u, t)});
    }
}

// One triangle from each border edge to p, in the cavity's slots first.
static void fill_cavity(inserter *in, int32_t p) {
  geo_working *w = &in->w;
  for (size_t b = 0; b < in->border_count; b++) {
    border_edge edge = in->border[b];
    if (b >= in->cavity_count)
      geo_working_reserve(w, w->count + 1);
    int32_t t = b < in->cavity_count ? in->cavity[b] : (int32_t)w->count++;
    memcpy(w->corner[t], (int32_t[3]){edge.from, edge.to, p}, sizeof *w->corner);
    geo_working_join(w, t, 2, edge.outside, edge.side);
    w->link[edge.from] = t;
    in->hint = t;
  }
  for (size_t b = 0; b < in->border_count; b++)
    geo_working_join(w, w->link[in->border[b].from], 0, w->link[in->border[b].to], 1);
  for (size_t s = in->border_count; s < in->cavity_count; s++)
    w->corner[in->cavity[s]][0] = -1;
}

static void insert(inserter *in, int32_t p) {
  int32_t t = locate(&in->w, in->hint, in->w.site[p]);
  in->hint = t;
  if (!in_conflict(&in->w, t, in->w.site[p]))
    return; // hidden
  open_cavity(in, t, p);
  fill_cavity(in, p);
}

// ---- orders of insertion ----

// Position of cell (x, y) of a 2^16 by 2^16 grid along Hilbert's curve.
static uint64_t hilbert(uint32_t x, uint32_t y) {
  uint64_t along = 0;
  for (uint32_t s = 1u << 15; s > 0; s >>= 1) {
    uint32_t right = (x & s) != 0, up = (y & s) != 0;
    along = along << 2 | ((3 * right) ^ up);
    if (up)
      continue;
    if (right) {
      x = ~x;
      y = ~y;
    }
    uint32_t swap = x;
    x = y;
    y = swap;
  }
  return along;
}

typedef struct ranked {
  uint64_t rank;
  int32_t site;
} ranked;

static int compare_rank(const void *a, const void *b) {
  const ranked *p = a, *q = b;
  if (p->rank != q->rank)
    return p->rank < q->rank ? -1 : 1;
  return p->site < q->site ? -1 : p->site > q->site;
}

// Rounds of doubling size, each along Hilbert's curve (Amenta, Choi and Rote 2003): short walks and small cavities for
// any input. The rounds are drawn from a hash of the index, so they are the same every time.
static ranked *insertion_order(const geo_site *site, size_t n) {
  double x0 = site[0].x, x1 = x0, y0 = site[0].y, y1 = y0;
  for (size_t i = 1; i < n; i++) {
    x0 = site[i].x < x0 ? site[i].x : x0;
    x1 = site[i].x > x1 ? site[i].x : x1;
    y0 = site[i].y < y0 ? site[i].y : y0;
    y1 = site[i].y > y1 ? site[i].y : y1;
  }
  double size = x1 - x0 > y1 - y0 ? x1 - x0 : y1 - y0, scale = 65535 / size;
  ranked *order = geo_resize(NULL, n, sizeof *order);
  for (size_t i = 0; i < n; i++) {
    uint64_t hash = (i + 1) * 0x9E3779B97F4A7C15u;
    unsigned round = 20 - (unsigned)__builtin_ctzll(hash >> 40 | 1u << 20);
    uint64_t along = hilbert((uint32_t)((site[i].x - x0) * scale), (uint32_t)((site[i].y - y0) * scale));
    order[i] = (ranked){(uint64_t)round << 32 | along, (int32_t)i};
  }
  qsort(order, n, sizeof *order, compare_rank);
  return order;
}

static void insert_all(inserter *in, size_t n) {
  ranked *order = insertion_order(in->w.site, n);
  int32_t first[3];
  memcpy(first, in->w.corner[0], sizeof first);
  for (size_t k = 0; k < n; k++) {
    int32_t p = order[k].site;
    if (p != first[0] && p != first[1] && p != first[2])
      insert(in, p);
  }
  free(order);
}

static void insert_missing(inserter *in, size_t n) {
  geo_working *w = &in->w;
  unsigned char *present = geo_zeroed(n + 1, 1);
  for (size_t t = 0; t < w->count; t++)
    for (int k = 0; k < 3; k++)
      present[w->corner[t][k]] = 1;
  for (size_t p = 0; p < n; p++)
    if (!present[p])
      insert(in, (int32_t)p);
  free(present);
}

// ---- together ----

static size_t count_hidden(const geo_mesh *mesh) {
  size_t hidden = mesh->point_count;
  unsigned char *seen = geo_zeroed(mesh->point_count, 1);
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int k = 0; k < 3; k++) {
      hidden -= !seen[mesh->corner[t][k]];
      seen[mesh->corner[t][k]] = 1;
    }
  free(seen);
  return hidden;
}

size_t geo_regular_repair(const geo_site *site, size_t n, geo_mesh *mesh) {
  inserter in = {0};
  flips met;
  bool kept = geo_working_load(&in.w, site, n, mesh);
  if (kept && !flip_all(&in.w, &met)) {
    geo_working_clear(&in.w);
    kept = false;
  }
  if (kept) {
    insert_missing(&in, n);
  } else {
    geo_working_start(&in.w, site, n);
    insert_all(&in, n);
  }
  geo_working_store(&in.w, mesh);
  geo_working_clear(&in.w);
  free(in.cavity);
  free(in.border);
  geo_tie_break(site, mesh);
  return count_hidden(mesh);
}

bool geo_regular_update(const geo_site *site, size_t n, geo_mesh *mesh, size_t *hidden) {
  geo_working w;
  flips met;
  if (mesh->point_count != n || !geo_working_load(&w, site, n, mesh))
    return false;
  bool good = count_hidden(mesh) == 0 && flip_all(&w, &met);
  if (good && met.changed)
    geo_working_store(&w, mesh);
  geo_working_clear(&w);
  *hidden = 0;
  if (good && met.ties) {
    geo_tie_break(site, mesh);
    *hidden = count_hidden(mesh);
  }
  return good;
}
