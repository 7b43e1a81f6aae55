// A triangulation of points in the plane: triangles, their neighbours, and the counts that identify it.
// Points are referred to by index; the coordinates belong to the caller.
#ifndef GEO_MESH_H
#define GEO_MESH_H

#include <stddef.h>
#include <stdint.h>

typedef struct geo_mesh {
  size_t point_count;       // number of points triangulated
  size_t triangle_count;    // T
  size_t triangle_capacity; // allocated triangles
  int32_t (*corner)[3];     // owned; [T][3] point indices, counter-clockwise, smallest index first
  int32_t (*neighbour)[3];  // owned; [T][3] triangle across the edge OPPOSITE corner k, -1 outside
  uint64_t revision;        // bumped by every change of the triangles
} geo_mesh;

// An undirected edge of the mesh with the one or two triangles that carry it.
typedef struct geo_edge {
  int32_t i, j; // points, i < j
  int32_t t, u; // triangles; u = -1 on the rim
} geo_edge;

void geo_mesh_init(geo_mesh *mesh);
void geo_mesh_clear(geo_mesh *mesh);
// Replaces the triangles (rotated so that the smallest index comes first, sorted, orientation kept) and rebuilds the
// adjacency in O(T) where few edges meet at each point. `corner` [count][3] must be counter-clockwise. The result does
// not depend on the order given.
void geo_mesh_set(geo_mesh *mesh, size_t point_count, const int32_t (*corner)[3], size_t count);
// The same for triangles whose neighbours are known: neighbour[t][k] as in geo_mesh, numbered like `corner`. O(T).
void geo_mesh_set_joined(geo_mesh *mesh, size_t point_count, const int32_t (*corner)[3], const int32_t (*neighbour)[3],
                         size_t count);
// Gives the triangles of `from` to `mesh`; `from` is left empty.
void geo_mesh_move(geo_mesh *mesh, geo_mesh *from);
// Fills `edges` (capacity >= 3 T) in ascending (i, j) order and returns E.
size_t geo_mesh_edges(const geo_mesh *mesh, geo_edge *edges);
// Signed area of triangle t [length^2], positive counter-clockwise.
double geo_mesh_area(const geo_mesh *mesh, const double *x, const double *y, size_t t);

#endif
