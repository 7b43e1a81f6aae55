// Triangles in canonical order and their adjacency. All sorting is by counting: O(T + points).
#include "mesh.h"

#include <assert.h>
#include <stdbool.h>
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

typedef int32_t triple[3];

// Stable counting sort of triples by one of their columns.
static void sort_by_column(const triple *from, triple *to, size_t count, int column, size_t keys, size_t *start) {
  memset(start, 0, (keys + 1) * sizeof *start);
  for (size_t t = 0; t < count; t++)
    start[from[t][column]]++;
  offsets_from_counts(start, keys);
  for (size_t t = 0; t < count; t++)
    memcpy(to[start[from[t][column]]++], from[t], sizeof(triple));
}

// One side of a triangle.
typedef struct side {
  int32_t smaller, larger; // its points
  int32_t triangle;
  int8_t corner; // opposite corner in that triangle
  int8_t rising; // 1 if the triangle runs from the smaller to the larger point
} side;

static bool side_before(const side *a, const side *b) {
  return a->larger != b->larger ? a->larger < b->larger : a->triangle < b->triangle;
}

static int compare_sides(const void *a, const void *b) {
  return side_before(a, b) ? -1 : side_before(b, a);
}

// Few sides meet at most points; a hub (the fan of a large cocircular polygon) may have any number.
static void sort_sides(side *sides, size_t count) {
  if (count > 64) {
    qsort(sides, count, sizeof *sides, compare_sides);
    return;
  }
  for (size_t s = 1; s < count; s++) {
    side moved = sides[s];
    size_t at = s;
    for (; at > 0 && side_before(&moved, &sides[at - 1]); at--)
      sides[at] = sides[at - 1];
    sides[at] = moved;
  }
}

static side side_of(const geo_mesh *mesh, size_t t, int k) {
  int32_t a = mesh->corner[t][(k + 1) % 3], b = mesh->corner[t][(k + 2) % 3];
  return (side){a < b ? a : b, a < b ? b : a, (int32_t)t, (int8_t)k, a < b};
}

// All sides of all triangles in ascending order of (smaller point, larger point, triangle).
static side *sorted_sides(const geo_mesh *mesh) {
  size_t points = mesh->point_count;
  side *sides = geo_resize(NULL, 3 * mesh->triangle_count, sizeof *sides);
  size_t *start = geo_zeroed(points + 1, sizeof *start);
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int k = 0; k < 3; k++)
      start[side_of(mesh, t, k).smaller]++;
  offsets_from_counts(start, points);
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int k = 0; k < 3; k++) {
      side here = side_of(mesh, t, k);
      sides[start[here.smaller]++] = here;
    }
  for (size_t p = 0; p < points; p++) { // start[p] is now the end of point p's sides
    size_t first = p ? start[p - 1] : 0;
    sort_sides(sides + first, start[p] - first);
  }
  free(start);
  return sides;
}

// Joins triangles that run along one edge in opposite directions. Sides without such a partner stay -1.
static void build_adjacency(geo_mesh *mesh) {
  side *sides = sorted_sides(mesh);
  memset(mesh->neighbour, -1, mesh->triangle_count * sizeof *mesh->neighbour);
  for (size_t s = 1; s < 3 * mesh->triangle_count; s++) {
    side a = sides[s - 1], b = sides[s];
    if (a.smaller != b.smaller || a.larger != b.larger || a.rising == b.rising)
      continue;
    if (mesh->neighbour[a.triangle][a.corner] >= 0)
      continue;
    mesh->neighbour[a.triangle][a.corner] = b.triangle;
    mesh->neighbour[b.triangle][b.corner] = a.triangle;
  }
  free(sides);
}

static void copy_rotated(int32_t to[3], const int32_t from[3]) {
  int first = from[1] < from[0] ? 1 : 0;
  if (from[2] < from[first])
    first = 2;
  for (int k = 0; k < 3; k++)
    to[k] = from[(first + k) % 3];
}

void geo_mesh_set(geo_mesh *mesh, size_t point_count, const int32_t (*corner)[3], size_t count) {
  assert(point_count <= INT32_MAX && count <= INT32_MAX);
  triple *rotated = geo_resize(NULL, count, sizeof *rotated);
  for (size_t t = 0; t < count; t++)
    copy_rotated(rotated[t], corner[t]);
  mesh->triangle_capacity = geo_capacity(mesh->triangle_capacity, count);
  mesh->corner = geo_resize(mesh->corner, mesh->triangle_capacity, sizeof *mesh->corner);
  mesh->neighbour = geo_resize(mesh->neighbour, mesh->triangle_capacity, sizeof *mesh->neighbour);
  size_t *start = geo_resize(NULL, point_count + 1, sizeof *start);
  sort_by_column((const triple *)rotated, mesh->corner, count, 2, point_count, start);
  sort_by_column((const triple *)mesh->corner, rotated, count, 1, point_count, start);
  sort_by_column((const triple *)rotated, mesh->corner, count, 0, point_count, start);
  free(start);
  free(rotated);
  mesh->point_count = point_count;
  mesh->triangle_count = count;
  mesh->revision++;
  build_adjacency(mesh);
}

size_t geo_mesh_edges(const geo_mesh *mesh, geo_edge *edges) {
  side *sides = sorted_sides(mesh);
  size_t count = 0;
  for (size_t s = 0; s < 3 * mesh->triangle_count; s++) {
    int32_t t = sides[s].triangle, u = mesh->neighbour[t][sides[s].corner];
    if (u >= 0 && u < t)
      continue; // listed with its other triangle
    edges[count++] = (geo_edge){sides[s].smaller, sides[s].larger, t, u};
  }
  free(sides);
  return count;
}

double geo_mesh_area(const geo_mesh *mesh, const double *x, const double *y, size_t t) {
  const int32_t *c = mesh->corner[t];
  return 0.5 * ((x[c[1]] - x[c[0]]) * (y[c[2]] - y[c[0]]) - (y[c[1]] - y[c[0]]) * (x[c[2]] - x[c[0]]));
}
