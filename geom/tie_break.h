// Canonical triangles where four or more sites lie on one circle (power: four lifted sites on one plane).
#ifndef GEO_TIE_BREAK_H
#define GEO_TIE_BREAK_H

#include "mesh.h"
#include "predicate.h"

// `mesh` must be a regular triangulation of the sites. Each maximal face, that is the convex polygon joined from all
// triangles with one circle (plane), becomes the fan from its smallest point index. Sites inside a face or on its sides
// between corners (power only: their cells have no interior) are dropped. Two regular triangulations of the same sites
// become equal.
void geo_tie_break(const geo_site *site, geo_mesh *mesh);

#endif
