// Coordination, the solid fraction of each cell, and void polygons: what is left of the Delaunay graph when every edge
// that is no contact is opened. Equations (M23)-(M27). N. P. Kruyt and L. Rothenburg, J. Appl. Mech. 63 (1996) 706.
#ifndef TAL_MEASURE_VOIDS_H
#define TAL_MEASURE_VOIDS_H

#include "measure_snapshot.h"

enum { TAL_COORDINATION_BINS = 8, TAL_VOID_BINS = 10 };

// Of the grains of a part; walls keep a grain from being a rattler but are not counted.
typedef struct tal_coordination {
  size_t grains, rattlers;
  double mean, bearing;               // contacts with grains per grain; without rattlers and their contacts (46)
  size_t with[TAL_COORDINATION_BINS]; // grains with 0, 1, ... contacts, the last bin open
} tal_coordination;
tal_coordination tal_coordination_measure(const tal_part *part);

// rattler[grain_count]: removed when grains with fewer than two contacts, walls included, are taken away until none is
// left to take. Owned by the caller.
bool *tal_rattlers_find(const tal_snapshot *snapshot);

// Area of the grains in cell t (M24) [m^2]: the sectors at its corners.
double tal_cell_solid(const tal_snapshot *snapshot, size_t t);

typedef struct tal_void {
  size_t cells, sides; // triangles in it; contacts around it
  bool open;           // it reaches the rim of the graph through an edge that is no contact
  double area, solid;  // [m^2]; of the grains in it
  double x, y;         // [m] centroid
  double aspect;       // short axis over long one, from the second moments of its area
  double angle;        // [rad] of the long axis, in [0, pi)
} tal_void;

typedef struct tal_voids {
  size_t count;
  tal_void *item; // owned; [count] those with their centroid in the part's region
  int32_t *of;    // owned; [cell_count of the snapshot] item, -1: not in the region
  // Of the closed ones:
  size_t closed, with[TAL_VOID_BINS]; // with 0, 1, 2, 3 ... sides, the last bin open
  double mean_sides, mean_area, largest_area, mean_aspect;
} tal_voids;
void tal_voids_find(tal_voids *voids, const tal_part *part);
void tal_voids_clear(tal_voids *voids);

#endif
