// The rim of a triangulation whose points have moved a little.
#ifndef GEO_RIM_H
#define GEO_RIM_H

#include <stdbool.h>

#include "mesh.h"
#include "predicate.h"

// Where motion has pushed triangles at the rim inside out or made the rim concave, `mesh` no longer tiles the hull of
// its points. `mended` gets its triangles less those that are not counter-clockwise, plus triangles that fill the rim's
// notches. False when the rim is no single loop; true does not promise that `mended` tiles the hull.
bool geo_rim_mend(const geo_site *site, size_t n, const geo_mesh *mesh, geo_mesh *mended);

#endif
