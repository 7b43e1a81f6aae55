// Private to geom: a triangulation while it is being changed, closed by ghost triangles.
// A ghost joins a rim edge to one point at infinity (index `ghost` = number of sites), so that every edge has two
// triangles and the outside is walked and opened like the inside.
#ifndef GEO_WORKING_H
#define GEO_WORKING_H

#include <stdbool.h>

#include "mesh.h"
#include "predicate.h"

typedef struct geo_working {
  const geo_site *site; // borrowed; [ghost]
  int32_t ghost;
  size_t count, capacity;  // triangle slots, free ones included
  int32_t (*corner)[3];    // owned; counter-clockwise; a ghost has one corner `ghost`; a free slot starts with -1
  int32_t (*neighbour)[3]; // owned; across the edge opposite corner k
  int32_t *stamp;          // owned; [capacity] last site whose cavity held this triangle, -1 if none
  int32_t *link;           // owned; [ghost + 1] scratch: a triangle by point
} geo_working;

// Copies the mesh and adds ghosts if it tiles the hull of its points. Otherwise returns false and makes nothing.
bool geo_working_load(geo_working *w, const geo_site *site, size_t n, const geo_mesh *mesh);
// One triangle, of site 0, site 1 and the first site that is not on their line.
void geo_working_start(geo_working *w, const geo_site *site, size_t n);
void geo_working_clear(geo_working *w);
// Makes room for `count` slots in all.
void geo_working_reserve(geo_working *w, size_t count);
// Writes the finite triangles.
void geo_working_store(const geo_working *w, geo_mesh *mesh);

// Position of triangle u among the neighbours of t.
static inline int geo_working_side(const geo_working *w, int32_t t, int32_t u) {
  return w->neighbour[t][0] == u ? 0 : w->neighbour[t][1] == u ? 1 : 2;
}

// Position of the ghost among the corners of t, -1 if t is finite.
static inline int geo_working_ghost(const geo_working *w, int32_t t) {
  for (int k = 0; k < 3; k++)
    if (w->corner[t][k] == w->ghost)
      return k;
  return -1;
}

static inline void geo_working_join(geo_working *w, int32_t t, int k, int32_t u, int m) {
  w->neighbour[t][k] = u;
  w->neighbour[u][m] = t;
}

#endif
