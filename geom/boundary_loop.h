// The boundary of a granular assembly: the hull of a triangulation, peeled where its edges bridge gaps.
#ifndef GEO_BOUNDARY_LOOP_H
#define GEO_BOUNDARY_LOOP_H

#include "mesh.h"
#include "vec.h"

typedef struct geo_loop {
  size_t count;          // B
  size_t capacity;       // allocated nodes
  int32_t *node;         // owned; [B] point indices, counter-clockwise, starting at the smallest index
  size_t outside_count;  // points of the mesh left outside the loop (hidden ones are no points of the mesh)
  size_t triangle_count; // triangles inside the loop
} geo_loop;

void geo_loop_init(geo_loop *loop);
void geo_loop_clear(geo_loop *loop);
// Replaces the nodes (used when a stored state is read back).
void geo_loop_set(geo_loop *loop, const int32_t *node, size_t count);

// Peels: a boundary triangle is removed while its outer edge (i,j) has a gap |ij| - radius_i - radius_j > gap_limit
// [length] and the removal keeps the boundary one simple loop. Longest gap first, ties by point index, so the result
// does not depend on the order of triangles. A triangle with two outer edges goes only if both are that wide: then its
// tip lies outside. Where only a triangle holds two parts together it stays, however wide. side[points] or NULL: an
// edge whose two points have the same mark other than 0 lies along a rigid side; its triangle goes if the third point
// has that mark, too (the loop takes in every point at the side), and stays if not, however wide the edge. inside[T]:
// set to 1 for kept triangles. Returns 0, or -1 when no triangle would be left (loop->count = 0).
int geo_loop_peel(geo_loop *loop, const geo_mesh *mesh, const double *x, const double *y, const double *radius,
                  const unsigned char *side, double gap_limit, unsigned char *inside);

// Enclosed area [length^2] by the shoelace sum about the first node.
double geo_loop_area(const geo_loop *loop, const double *x, const double *y);
// N_A of node k: half the sum of the two adjacent edges' outward normals times their lengths [length]. Sum over k is 0.
geo_vec geo_loop_normal(const geo_loop *loop, const double *x, const double *y, size_t k);
// Mean velocity gradient (1/A) sum_A v_A (x) N_A [1/time]; equals the area mean over the triangles inside.
geo_tensor geo_loop_velocity_gradient(const geo_loop *loop, const double *x, const double *y, const double *vx,
                                      const double *vy);

#endif
