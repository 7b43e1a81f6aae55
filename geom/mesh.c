// Triangles in canonical order and their adjacency. Sorting is by counting on the smaller point,
// then within the few that share it.
#include "mesh.h"

#include <assert.h>
#include <string.h>

#include "memory.h"

void geo_mesh_init(geo_mesh *mesh) {
  *mesh = (geo_mesh){0};
}

void geo_mesh_clear(geo_mesh *mesh) {
  free(mesh->corner);
  free(mesh->neighbour);
  geo_mesh_init(mesh);
}

// Turns start[k] = number of items with key k into the offset of the first of them; start holds `keys` + 1.
static void offsets_from_counts(size_t *start, size_t keys) {
  size_t sum = 0;
  for (size_t k = 0; k <= keys; k++) {
    size_t here = start[k];
    start[k] = sum;
    sum += here;
  }
}

// ---- order of triangles ---------------------------------------------------------------------------------------------

typedef int32_t triple[3];

// Where the smallest index stands.
static int first_corner(const int32_t c[3]) {
  int first = c[1] < c[0] ? 1 : 0;
  return c[2] < c[first] ? 2 : first;
}

// A triangle among those with the same smallest index: the other two corners in order, and its number.
typedef struct ranked {
  uint64_t rank;
  int32_t triangle;
} ranked;

static int compare_ranked(const void *a, const void *b) {
  uint64_t p = ((const ranked *)a)->rank, q = ((const ranked *)b)->rank;
  return (p > q) - (p < q);
}

// Few triangles share their smallest index with others; at a hub (the fan of a large cocircular polygon) any number.
static void sort_ranked(ranked *r, size_t count) {
  if (count > 64) {
    qsort(r, count, sizeof *r, compare_ranked);
    return;
  }
  for (size_t s = 1; s < count; s++) {
    ranked moved = r[s];
    size_t at = s;
    for (; at > 0 && moved.rank < r[at - 1].rank; at--)
      r[at] = r[at - 1];
    r[at] = moved;
  }
}

// The triangles in canonical order.
static ranked *canonical_order(const triple *corner, size_t count, size_t points) {
  ranked *order = geo_resize(NULL, count, sizeof *order);
  size_t *start = geo_zeroed(points + 1, sizeof *start);
  for (size_t t = 0; t < count; t++)
    start[corner[t][first_corner(corner[t])]]++;
  offsets_from_counts(start, points);
  for (size_t t = 0; t < count; t++) {
    const int32_t *c = corner[t];
    int k = first_corner(c);
    uint64_t rank = (uint64_t)c[(k + 1) % 3] << 32 | (uint64_t)c[(k + 2) % 3];
    order[start[c[k]]++] = (ranked){rank, (int32_t)t};
  }
  for (size_t p = 0; p < points; p++) { // start[p] is now the end of point p's triangles
    size_t first = p ? start[p - 1] : 0;
    sort_ranked(order + first, start[p] - first);
  }
  free(start);
  return order;
}

static void reserve(geo_mesh *mesh, size_t point_count, size_t count) {
  assert(point_count <= INT32_MAX && count <= INT32_MAX);
  if (count > mesh->triangle_capacity)
    mesh->triangle_capacity = count + count / 64 + 8; // 2n - 2 less the rim: it hardly grows
  mesh->corner = geo_resize(mesh->corner, mesh->triangle_capacity, sizeof *mesh->corner);
  mesh->neighbour = geo_resize(mesh->neighbour, mesh->triangle_capacity, sizeof *mesh->neighbour);
  mesh->point_count = point_count;
  mesh->triangle_count = count;
  mesh->revision++;
}

static void copy_rotated(int32_t to[3], const int32_t from[3], int first) {
  for (int k = 0; k < 3; k++)
    to[k] = from[(first + k) % 3];
}

// ---- sides ----------------------------------------------------------------------------------------------------------

// One side of a triangle, among those with the same smaller point: larger point, triangle and opposite corner in one
// number, so that sides sort by larger point, then triangle.
typedef uint64_t side;

static side side_of(int32_t larger, size_t triangle, int corner) {
  return (uint64_t)larger << 33 | (uint64_t)triangle << 2 | (uint64_t)corner;
}
static int32_t larger_of(side s) {
  return (int32_t)(s >> 33);
}
static int32_t triangle_of(side s) {
  return (int32_t)(s >> 2 & 0x7fffffff);
}
static int corner_of(side s) {
  return (int)(s & 3);
}

// 1 if the triangle runs from the smaller to the larger point.
static int rising(const geo_mesh *mesh, side s) {
  const int32_t *c = mesh->corner[triangle_of(s)];
  return c[(corner_of(s) + 2) % 3] == larger_of(s);
}

static int compare_sides(const void *a, const void *b) {
  side p = *(const side *)a, q = *(const side *)b;
  return (p > q) - (p < q);
}

static void sort_sides(side *sides, size_t count) {
  if (count > 64) {
    qsort(sides, count, sizeof *sides, compare_sides);
    return;
  }
  for (size_t s = 1; s < count; s++) {
    side moved = sides[s];
    size_t at = s;
    for (; at > 0 && moved < sides[at - 1]; at--)
      sides[at] = sides[at - 1];
    sides[at] = moved;
  }
}

// All sides of all triangles in ascending order of (smaller point, larger point, triangle); end[p] is where those of
// smaller point p end.
static side *sorted_sides(const geo_mesh *mesh, size_t **end) {
  size_t points = mesh->point_count;
  side *sides = geo_resize(NULL, 3 * mesh->triangle_count, sizeof *sides);
  size_t *start = geo_zeroed(points + 1, sizeof *start);
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int k = 0; k < 3; k++) {
      int32_t a = mesh->corner[t][(k + 1) % 3], b = mesh->corner[t][(k + 2) % 3];
      start[a < b ? a : b]++;
    }
  offsets_from_counts(start, points);
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int k = 0; k < 3; k++) {
      int32_t a = mesh->corner[t][(k + 1) % 3], b = mesh->corner[t][(k + 2) % 3];
      sides[start[a < b ? a : b]++] = side_of(a < b ? b : a, t, k);
    }
  for (size_t p = 0; p < points; p++) {
    size_t first = p ? start[p - 1] : 0;
    sort_sides(sides + first, start[p] - first);
  }
  *end = start;
  return sides;
}

// Joins triangles that run along one edge in opposite directions. Sides without such a partner stay -1.
static void build_adjacency(geo_mesh *mesh) {
  size_t *end, first = 0;
  side *sides = sorted_sides(mesh, &end);
  memset(mesh->neighbour, -1, mesh->triangle_count * sizeof *mesh->neighbour);
  for (size_t p = 0; p < mesh->point_count; first = end[p++])
    for (size_t s = first + 1; s < end[p]; s++) {
      side a = sides[s - 1], b = sides[s];
      if (larger_of(a) != larger_of(b) || rising(mesh, a) == rising(mesh, b))
        continue;
      if (mesh->neighbour[triangle_of(a)][corner_of(a)] >= 0)
        continue;
      mesh->neighbour[triangle_of(a)][corner_of(a)] = triangle_of(b);
      mesh->neighbour[triangle_of(b)][corner_of(b)] = triangle_of(a);
    }
  free(sides);
  free(end);
}

// ---- public ---------------------------------------------------------------------------------------------------------

void geo_mesh_set(geo_mesh *mesh, size_t point_count, const int32_t (*corner)[3], size_t count) {
  ranked *order = canonical_order(corner, count, point_count);
  reserve(mesh, point_count, count);
  for (size_t t = 0; t < count; t++) {
    const int32_t *c = corner[order[t].triangle];
    copy_rotated(mesh->corner[t], c, first_corner(c));
  }
  free(order);
  build_adjacency(mesh);
}

void geo_mesh_set_joined(geo_mesh *mesh, size_t point_count, const int32_t (*corner)[3], const int32_t (*neighbour)[3],
                         size_t count) {
  ranked *order = canonical_order(corner, count, point_count);
  int32_t *place = geo_resize(NULL, count, sizeof *place);
  for (size_t t = 0; t < count; t++)
    place[order[t].triangle] = (int32_t)t;
  reserve(mesh, point_count, count);
  for (size_t t = 0; t < count; t++) {
    const int32_t *c = corner[order[t].triangle], *n = neighbour[order[t].triangle];
    int first = first_corner(c);
    copy_rotated(mesh->corner[t], c, first);
    for (int k = 0; k < 3; k++) {
      int32_t u = n[(first + k) % 3];
      mesh->neighbour[t][k] = u < 0 ? -1 : place[u];
    }
  }
  free(place);
  free(order);
}

void geo_mesh_move(geo_mesh *mesh, geo_mesh *from) {
  uint64_t revision = mesh->revision + 1;
  geo_mesh_clear(mesh);
  *mesh = *from;
  mesh->revision = revision;
  geo_mesh_init(from);
}

size_t geo_mesh_edges(const geo_mesh *mesh, geo_edge *edges) {
  size_t *end, first = 0, count = 0;
  side *sides = sorted_sides(mesh, &end);
  for (size_t p = 0; p < mesh->point_count; first = end[p++])
    for (size_t s = first; s < end[p]; s++) {
      int32_t t = triangle_of(sides[s]), u = mesh->neighbour[t][corner_of(sides[s])];
      if (u >= 0 && u < t)
        continue; // listed with its other triangle
      edges[count++] = (geo_edge){(int32_t)p, larger_of(sides[s]), t, u};
    }
  free(sides);
  free(end);
  return count;
}

double geo_mesh_area(const geo_mesh *mesh, const double *x, const double *y, size_t t) {
  const int32_t *c = mesh->corner[t];
  return 0.5 * ((x[c[1]] - x[c[0]]) * (y[c[2]] - y[c[0]]) - (y[c[1]] - y[c[0]]) * (x[c[2]] - x[c[0]]));
}
