// Turns a candidate triangulation into THE regular (power, or with equal weights Delaunay) triangulation of the sites,
// exactly: whatever a library's round-off got wrong is repaired by predicates without error, and ties are broken by
// point index, so that the answer is a function of the sites alone.
#ifndef GEO_REGULAR_H
#define GEO_REGULAR_H

#include <stdbool.h>

#include "mesh.h"
#include "predicate.h"

// `mesh` holds a candidate: any triangles over the n sites, even none. Where it tiles the hull of its points it is kept
// and edges are flipped until every one is locally regular (Lawson 1977), then missing sites are inserted; otherwise
// all sites are inserted one by one (Bowyer 1981, Watson 1981). Ties: see tie_break.h.
// The sites must be distinct and not all on one line; |x|, |y|, |w| as predicate.h demands.
// Returns the number of hidden sites: those that are no vertex because their power cell has no interior.
size_t geo_regular_repair(const geo_site *site, size_t n, geo_mesh *mesh);

// The same by flips alone for a mesh over all n sites, which may coincide or lie on one line. Where it does not tile
// the hull or flips do not lead there the mesh is unchanged and false is returned; true is proof that no sites
// coincide. A mesh that is regular already keeps its revision. *hidden as above.
bool geo_regular_update(const geo_site *site, size_t n, geo_mesh *mesh, size_t *hidden);

#endif
