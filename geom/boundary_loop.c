// Peeling with a heap of wide rim edges, O(T + P log P) for P of them, and what is computed from a loop.
// Why the loop stays simple: a triangle with one outer edge is removed only if its opposite point is not on the loop
// yet, so that point joins the loop once; an ear (two outer edges) gives up its tip, which leaves the loop for good,
// since a point of a simple loop with both its loop edges on one triangle has no other triangle inside. A wide edge
// that cannot go because of a neck stays: it can only be freed by its triangle becoming an ear, and then the new outer
// edge asks again. So no edge need be looked at twice.
#include "boundary_loop.h"

#include <stdbool.h>
#include <string.h>

#include "memory.h"

void geo_loop_init(geo_loop *loop) {
  *loop = (geo_loop){0};
}

void geo_loop_clear(geo_loop *loop) {
  free(loop->node);
  geo_loop_init(loop);
}

static void reserve(geo_loop *loop, size_t count) {
  if (count <= loop->capacity)
    return;
  loop->capacity = geo_capacity(loop->capacity, count);
  loop->node = geo_resize(loop->node, loop->capacity, sizeof *loop->node);
}

void geo_loop_set(geo_loop *loop, const int32_t *node, size_t count) {
  reserve(loop, count);
  if (count)
    memcpy(loop->node, node, count * sizeof *node);
  loop->count = count;
  loop->outside_count = loop->triangle_count = 0;
}

// ---- peeling ----

typedef struct wide_edge {
  double gap;   // above the limit
  int32_t i, j; // points, i < j
  int32_t t, k; // the triangle inside and its opposite corner
} wide_edge;

typedef struct peeler {
  const geo_mesh *mesh;
  const double *x, *y, *radius;
  const unsigned char *side; // or NULL
  double gap_limit;
  unsigned char *inside;  // [T] borrowed
  unsigned char *on_loop; // [points] is or was on the loop; no triangle inside asks about those that left it
  wide_edge *heap;        // widest on top
  size_t count, capacity;
  int32_t (*outer)[2]; // triangle and opposite corner of every edge that was outer at some time
  size_t outer_count, outer_capacity, removed;
} peeler;

static wide_edge edge_of(const peeler *p, int32_t t, int k) {
  int32_t a = p->mesh->corner[t][(k + 1) % 3], b = p->mesh->corner[t][(k + 2) % 3];
  int32_t i = a < b ? a : b, j = a < b ? b : a;
  double dx = p->x[j] - p->x[i], dy = p->y[j] - p->y[i];
  double gap = sqrt(dx * dx + dy * dy) - (p->radius[i] + p->radius[j]);
  if (p->side && p->side[i] && p->side[i] == p->side[j])
    gap = p->side[p->mesh->corner[t][k]] == p->side[i] ? (double)INFINITY : -(double)INFINITY;
  return (wide_edge){gap, i, j, t, k};
}

// Wider first, then smaller point indices.
static bool goes_before(const wide_edge *a, const wide_edge *b) {
  if (a->gap != b->gap)
    return a->gap > b->gap;
  return a->i != b->i ? a->i < b->i : a->j < b->j;
}

static void push(peeler *p, wide_edge edge) {
  if (p->count == p->capacity) {
    p->capacity = geo_capacity(p->capacity, p->count + 1);
    p->heap = geo_resize(p->heap, p->capacity, sizeof *p->heap);
  }
  size_t at = p->count++;
  for (; at > 0 && goes_before(&edge, &p->heap[(at - 1) / 2]); at = (at - 1) / 2)
    p->heap[at] = p->heap[(at - 1) / 2];
  p->heap[at] = edge;
}

static wide_edge pop(peeler *p) {
  wide_edge top = p->heap[0], moved = p->heap[--p->count];
  size_t at = 0;
  for (size_t child = 1; child < p->count; child = 2 * at + 1) {
    if (child + 1 < p->count && goes_before(&p->heap[child + 1], &p->heap[child]))
      child++;
    if (!goes_before(&p->heap[child], &moved))
      break;
    p->heap[at] = p->heap[child];
    at = child;
  }
  p->heap[at] = moved;
  return top;
}

static bool is_outer(const peeler *p, int32_t t, int k) {
  int32_t u = p->mesh->neighbour[t][k];
  return u < 0 || !p->inside[u];
}

// Puts outer edge k of t on the loop, and in the heap if it is wide.
static void expose(peeler *p, int32_t t, int k) {
  wide_edge edge = edge_of(p, t, k);
  p->on_loop[edge.i] = p->on_loop[edge.j] = 1;
  if (p->outer_count == p->outer_capacity) {
    p->outer_capacity = geo_capacity(p->outer_capacity, p->outer_count + 1);
    p->outer = geo_resize(p->outer, p->outer_capacity, sizeof *p->outer);
  }
  memcpy(p->outer[p->outer_count++], (int32_t[2]){t, k}, sizeof *p->outer);
  if (edge.gap > p->gap_limit)
    push(p, edge);
}

// Whether triangle t may go, now that its outer edge k is wide. The last triangle counts as an ear, too: where two of
// its edges are wide nothing holds it.
static bool may_remove(const peeler *p, int32_t t, int k) {
  int outer = 0, wide = 0;
  for (int m = 0; m < 3; m++) {
    if (!is_outer(p, t, m))
      continue;
    outer++;
    wide += edge_of(p, t, m).gap > p->gap_limit;
  }
  if (outer == 1)
    return !p->on_loop[p->mesh->corner[t][k]];
  return wide >= 2;
}

static void remove_triangle(peeler *p, int32_t t) {
  p->inside[t] = 0;
  p->removed++;
  for (int m = 0; m < 3; m++) {
    int32_t u = p->mesh->neighbour[t][m];
    if (u < 0 || !p->inside[u])
      continue;
    int k = p->mesh->neighbour[u][0] == t ? 0 : p->mesh->neighbour[u][1] == t ? 1 : 2;
    expose(p, u, k);
  }
}

// Points of a triangulated disk with so many edges around it (Euler).
static size_t points_of(size_t triangles, size_t rim) {
  return triangles ? (triangles + rim + 2) / 2 : 0;
}

// Writes the loop around the inside triangles and counts the points outside.
static void trace(geo_loop *loop, const peeler *p, size_t hull) {
  const geo_mesh *mesh = p->mesh;
  int32_t *next = geo_resize(NULL, mesh->point_count, sizeof *next), start = INT32_MAX;
  size_t edges = 0;
  for (size_t e = 0; e < p->outer_count; e++) {
    const int32_t t = p->outer[e][0], k = p->outer[e][1], *corner = mesh->corner[t], a = corner[(k + 1) % 3];
    if (!p->inside[t])
      continue;
    next[a] = corner[(k + 2) % 3];
    start = a < start ? a : start;
    edges++;
  }
  reserve(loop, edges);
  for (int32_t a = start; loop->count < edges; a = next[a])
    loop->node[loop->count++] = a;
  loop->triangle_count = mesh->triangle_count - p->removed;
  loop->outside_count = points_of(mesh->triangle_count, hull) - points_of(loop->triangle_count, edges);
  free(next);
}

int geo_loop_peel(geo_loop *loop, const geo_mesh *mesh, const double *x, const double *y, const double *radius,
                  const unsigned char *side, double gap_limit, unsigned char *inside) {
  peeler p = {.mesh = mesh, .x = x, .y = y, .radius = radius, .side = side, .gap_limit = gap_limit, .inside = inside};
  p.on_loop = geo_zeroed(mesh->point_count, 1);
  memset(inside, 1, mesh->triangle_count);
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const int32_t *u = mesh->neighbour[t];
    for (int k = 0; k < 3 && (u[0] | u[1] | u[2]) < 0; k++)
      if (u[k] < 0)
        expose(&p, (int32_t)t, k);
  }
  const size_t hull = p.outer_count;
  while (p.count) {
    wide_edge edge = pop(&p);
    if (inside[edge.t] && may_remove(&p, edge.t, edge.k))
      remove_triangle(&p, edge.t);
  }
  loop->count = loop->outside_count = loop->triangle_count = 0;
  trace(loop, &p, hull);
  free(p.outer);
  free(p.heap);
  free(p.on_loop);
  return loop->count ? 0 : -1;
}

// ---- what a loop encloses ----

double geo_loop_area(const geo_loop *loop, const double *x, const double *y) {
  double twice = 0;
  for (size_t k = 1; k + 1 < loop->count; k++) {
    int32_t o = loop->node[0], a = loop->node[k], b = loop->node[k + 1];
    twice += geo_cross((geo_vec){x[a] - x[o], y[a] - y[o]}, (geo_vec){x[b] - x[o], y[b] - y[o]});
  }
  return 0.5 * twice;
}

geo_vec geo_loop_normal(const geo_loop *loop, const double *x, const double *y, size_t k) {
  int32_t a = loop->node[k ? k - 1 : loop->count - 1], b = loop->node[k + 1 < loop->count ? k + 1 : 0];
  return (geo_vec){0.5 * (y[b] - y[a]), -0.5 * (x[b] - x[a])};
}

// Velocities are taken relative to the first node, which changes nothing (the normals sum to zero) but the round-off.
geo_tensor geo_loop_velocity_gradient(const geo_loop *loop, const double *x, const double *y, const double *vx,
                                      const double *vy) {
  geo_tensor sum = {0, 0, 0, 0};
  for (size_t k = 1; k < loop->count; k++) {
    geo_vec v = {vx[loop->node[k]] - vx[loop->node[0]], vy[loop->node[k]] - vy[loop->node[0]]};
    sum = geo_tensor_add(sum, geo_outer(v, geo_loop_normal(loop, x, y, k)));
  }
  return geo_tensor_scale(1 / geo_loop_area(loop, x, y), sum);
}
