// Backend: lower hull of the lifted points (x, y, x^2 + y^2 - w) by libqhull_r (Barber, Dobkin and Huhdanpaa 1996).
// Qhull works to a tolerance: it merges nearly coplanar facets (Qt cuts them into triangles again), may leave out
// points that are nearly coplanar and slivers along a nearly straight rim, and gives up on input that is flat to its
// tolerance. All of that is left to the repair that follows in delaunay.c; where qhull gives up the candidate is empty.
#include <stdbool.h>
#include <string.h>

#include <libqhull_r/qhull_ra.h>

#include "delaunay_backend.h"
#include "memory.h"
#include "predicate.h"

static double *lifted_points(const double *x, const double *y, const double *weight, size_t n) {
  double *point = geo_resize(NULL, 3 * n, sizeof *point);
  for (size_t i = 0; i < n; i++) {
    point[3 * i] = x[i];
    point[3 * i + 1] = y[i];
    point[3 * i + 2] = x[i] * x[i] + y[i] * y[i] - (weight ? weight[i] : 0);
  }
  return point;
}

// The facets that face downwards. Seen from outside the hull a facet turns one way, seen from above a lower facet
// turns the other, so the exact sign of the projected area tells lower (kept) from upper and upright ones.
static void lower_hull(qhT *qh, const double *x, const double *y, size_t n, geo_mesh *mesh) {
  int32_t(*corner)[3] = geo_resize(NULL, (size_t)qh->num_facets, sizeof *corner);
  size_t count = 0;
  facetT *facet;
  FORALLfacets {
    vertexT *vertex, **vertexp;
    int32_t c[3];
    int found = 0;
    FOREACHvertex_(facet->vertices) if (found < 3) c[found++] = qh_pointid(qh, vertex->point);
    if (found < 3)
      continue;
    if (!(facet->toporient ^ qh_ORIENTclock)) {
      int32_t swap = c[1];
      c[1] = c[2];
      c[2] = swap;
    }
    geo_site s[3];
    for (int k = 0; k < 3; k++)
      s[k] = (geo_site){x[c[k]], y[c[k]], 0};
    if (geo_orient(s[0], s[1], s[2]) > 0)
      memcpy(corner[count++], c, sizeof c);
  }
  geo_mesh_set(mesh, n, (const int32_t(*)[3])corner, count);
  free(corner);
}

static geo_delaunay_result build(const double *x, const double *y, const double *weight, size_t n, geo_mesh *mesh,
                                 geo_delaunay_report *report) {
  if (n == 3)
    return GEO_DELAUNAY_OK; // no solid to take the hull of: empty candidate
  char command[] = "qhull Qt Qbb Pp", *message = NULL;
  size_t message_size = 0;
  FILE *silence = open_memstream(&message, &message_size);
  geo_checked(silence, 1, sizeof *silence);
  double *point = lifted_points(x, y, weight, n);
  qhT context, *qh = &context;
  qh_zero(qh, silence);
  int code = qh_new_qhull(qh, 3, (int)n, point, False, command, NULL, silence);
  if (code == qh_ERRnone)
    lower_hull(qh, x, y, n, mesh);
  qh_freeqhull(qh, !qh_ALL);
  int long_blocks, long_bytes;
  qh_memfreeshort(qh, &long_blocks, &long_bytes);
  fclose(silence);
  bool failed = code == qh_ERRmem || code == qh_ERRinput;
  if (failed)
    snprintf(report->text, sizeof report->text, "qhull failed (code %d): %.*s", code, (int)strcspn(message, "\n"),
             message);
  free(message);
  free(point);
  return failed ? GEO_DELAUNAY_BACKEND : GEO_DELAUNAY_OK;
}

const geo_delaunay_backend geo_delaunay_qhull = {"qhull", "lifted convex hull by libqhull_r", build};
