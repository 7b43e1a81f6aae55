// Private to geom: the backends behind the registry in delaunay.c.
// A backend hands over a candidate: its triangles over sites that are centred, scaled to about 1, finite, distinct and
// not on one line. It may leave round-off errors and ties as they fall: delaunay.c puts the candidate right.
#ifndef GEO_DELAUNAY_BACKEND_H
#define GEO_DELAUNAY_BACKEND_H

#include "delaunay.h"

extern const geo_delaunay_backend geo_delaunay_qhull;
extern const geo_delaunay_backend geo_delaunay_cgal; // only where TAL_HAVE_CGAL is defined

#endif
