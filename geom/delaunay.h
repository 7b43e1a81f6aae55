// Delaunay and power (weighted Delaunay) triangulations of points in the plane, by either of two libraries behind one
// interface. Ties (cocircular points) are broken by a rule of ours that looks at point indices only, so both backends
// give the same triangles there too.
#ifndef GEO_DELAUNAY_H
#define GEO_DELAUNAY_H

#include "mesh.h"

typedef enum geo_delaunay_result {
  GEO_DELAUNAY_OK = 0,
  GEO_DELAUNAY_TOO_FEW,    // fewer than three points
  GEO_DELAUNAY_COLLINEAR,  // all points on one line
  GEO_DELAUNAY_DUPLICATE,  // two points coincide (their indices are in the report)
  GEO_DELAUNAY_NOT_FINITE, // a coordinate or weight is not a finite number
  GEO_DELAUNAY_BACKEND     // the library failed; the report says how
} geo_delaunay_result;

typedef struct geo_delaunay_report {
  int32_t first, second; // offending points, -1 if none
  size_t hidden;         // power only: points that are no vertex of the triangulation
  char text[200];        // one readable sentence, "" if all is well
} geo_delaunay_report;

// A backend: constant descriptor, one registry line in delaunay.c.
typedef struct geo_delaunay_backend {
  const char *name; // "cgal", "qhull"
  const char *help;
  // Fills `mesh` with a candidate, which geo_delaunay then makes exact and canonical. `weight` is NULL for plain, else
  // squared radii [length^2]. Coordinates are already centred and scaled to a size of about 1, weights likewise.
  geo_delaunay_result (*build)(const double *x, const double *y, const double *weight, size_t n, geo_mesh *mesh,
                               geo_delaunay_report *report);
} geo_delaunay_backend;

// NULL-terminated list of the backends built in (cgal first when it is there).
const geo_delaunay_backend *const *geo_delaunay_backends(void);
// NULL if unknown or not built in.
const geo_delaunay_backend *geo_delaunay_backend_find(const char *name);

// Triangulates n points. weight NULL: plain Delaunay; else power triangulation with weight = radius^2 [length^2].
// On failure `mesh` is unchanged and the report says why. `report` may be NULL.
geo_delaunay_result geo_delaunay(const geo_delaunay_backend *backend, const double *x, const double *y,
                                 const double *weight, size_t n, geo_mesh *mesh, geo_delaunay_report *report);

// The same triangles, sooner where `mesh` holds the triangulation of these points before they moved a little: its rim
// is mended, its edges are tested exactly and flipped; where that does not do, all is built anew. Where no triangle
// changes the mesh keeps its revision.
geo_delaunay_result geo_delaunay_update(const geo_delaunay_backend *backend, const double *x, const double *y,
                                        const double *weight, size_t n, geo_mesh *mesh, geo_delaunay_report *report);

#endif
