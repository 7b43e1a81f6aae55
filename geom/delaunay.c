// Registry of the backends and what they share: checks, centring, repair.
// Far from the origin lifted heights lose all their digits, so where all coordinates of an axis have one sign and lie
// within a factor of two, their middle is subtracted. That subtraction is exact (Sterbenz), as is the scaling by a
// power of two that follows: the sites triangulated are the given points, not rounded ones. Everywhere else the offset
// is no larger than the extent and nothing is subtracted.
#include "delaunay.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "delaunay_backend.h"
#include "memory.h"
#include "predicate.h"
#include "regular.h"
#include "rim.h"

static const geo_delaunay_backend *const backends[] = {
#ifdef TAL_HAVE_CGAL
    &geo_delaunay_cgal,
#endif
    &geo_delaunay_qhull, NULL};

const geo_delaunay_backend *const *geo_delaunay_backends(void) {
  return backends;
}

const geo_delaunay_backend *geo_delaunay_backend_find(const char *name) {
  for (size_t k = 0; backends[k]; k++)
    if (strcmp(backends[k]->name, name) == 0)
      return backends[k];
  return NULL;
}

typedef struct axis {
  double middle; // subtracted
  double size;   // largest magnitude after that
} axis;

static axis axis_of(const double *x, size_t n) {
  double least = x[0], most = x[0];
  for (size_t i = 1; i < n; i++) {
    least = x[i] < least ? x[i] : least;
    most = x[i] > most ? x[i] : most;
  }
  bool far = least > 0 ? most <= 2 * least : most < 0 && least >= 2 * most;
  axis a = {.middle = far ? least + 0.5 * (most - least) : 0};
  a.size = fmax(fabs(least - a.middle), fabs(most - a.middle));
  return a;
}

// Magnitudes below this share of the extent (weights: of its square) count as zero, which keeps the exact predicates
// clear of underflow.
static double without_dust(double value, double least) {
  return fabs(value) < least ? 0 : value;
}

// Centred and scaled so that the largest coordinate lies in [1, 2); weights go with the square.
static geo_site *sites_of(const double *x, const double *y, const double *weight, size_t n) {
  axis ax = axis_of(x, n), ay = axis_of(y, n);
  double size = fmax(ax.size, ay.size);
  const int exponent = size > 0 ? -ilogb(size) : 0;
  // of the whole power one factor may be beyond the numbers
  const double half = ldexp(1, exponent / 2), rest = ldexp(1, exponent - exponent / 2);
  geo_site *site = geo_resize(NULL, n, sizeof *site);
  for (size_t i = 0; i < n; i++) {
    site[i].x = without_dust((x[i] - ax.middle) * half * rest, 0x1p-200);
    site[i].y = without_dust((y[i] - ay.middle) * half * rest, 0x1p-200);
    site[i].w = weight ? without_dust(weight[i] * half * half * rest * rest, 0x1p-450) : 0;
  }
  return site;
}

static bool all_finite(const double *x, const double *y, const double *weight, size_t n, geo_delaunay_report *report) {
  for (size_t i = 0; i < n; i++) {
    if (isfinite(x[i]) && isfinite(y[i]) && (!weight || isfinite(weight[i])))
      continue;
    report->first = (int32_t)i;
    snprintf(report->text, sizeof report->text, "point %zu has a coordinate or weight that is not a finite number", i);
    return false;
  }
  return true;
}

static bool weights_in_range(const geo_site *site, size_t n, geo_delaunay_report *report) {
  for (size_t i = 0; i < n; i++) {
    if (fabs(site[i].w) < 0x1p400)
      continue;
    report->first = (int32_t)i;
    snprintf(report->text, sizeof report->text, "the weight of point %zu is out of all proportion to the extent", i);
    return false;
  }
  return true;
}

static size_t slot_of(geo_site p, size_t mask) {
  double key[2] = {p.x + 0.0, p.y + 0.0}; // -0 counts as 0
  uint64_t bits[2];
  memcpy(bits, key, sizeof bits);
  uint64_t hash = (bits[0] * 0x9E3779B97F4A7C15u ^ bits[1]) * 0xD6E8FEB86659FD93u;
  return (size_t)((hash ^ hash >> 32) * 0xD6E8FEB86659FD93u >> 20) & mask;
}

// Finds the first point that repeats an earlier one, in O(n).
static bool all_distinct(const geo_site *site, size_t n, geo_delaunay_report *report) {
  size_t mask = 15;
  while (mask < 2 * n)
    mask = 2 * mask + 1;
  int32_t *table = geo_resize(NULL, mask + 1, sizeof *table);
  memset(table, -1, (mask + 1) * sizeof *table);
  for (size_t i = 0; i < n && report->first < 0; i++) {
    size_t slot = slot_of(site[i], mask);
    while (table[slot] >= 0 && (site[table[slot]].x != site[i].x || site[table[slot]].y != site[i].y))
      slot = (slot + 1) & mask;
    if (table[slot] >= 0) {
      report->first = table[slot];
      report->second = (int32_t)i;
    }
    table[slot] = (int32_t)i;
  }
  free(table);
  return report->first < 0;
}

static bool all_on_one_line(const geo_site *site, size_t n) {
  for (size_t i = 2; i < n; i++)
    if (geo_orient(site[0], site[1], site[i]) != 0)
      return false;
  return true;
}

static geo_delaunay_result build(const geo_delaunay_backend *backend, const geo_site *site, bool weighted, size_t n,
                                 geo_mesh *mesh, geo_delaunay_report *report) {
  double *column = geo_resize(NULL, 3 * n, sizeof *column);
  for (size_t i = 0; i < n; i++) {
    column[i] = site[i].x;
    column[n + i] = site[i].y;
    column[2 * n + i] = site[i].w;
  }
  geo_mesh candidate;
  geo_mesh_init(&candidate);
  geo_delaunay_result result =
      backend->build(column, column + n, weighted ? column + 2 * n : NULL, n, &candidate, report);
  if (result == GEO_DELAUNAY_OK) {
    report->hidden = geo_regular_repair(site, n, &candidate);
    geo_mesh_move(mesh, &candidate);
  }
  geo_mesh_clear(&candidate);
  free(column);
  return result;
}

// From the mesh as it stands, or with its rim mended.
static bool update(const geo_site *site, size_t n, geo_mesh *mesh, size_t *hidden) {
  if (geo_regular_update(site, n, mesh, hidden))
    return true;
  geo_mesh mended;
  geo_mesh_init(&mended);
  bool good = geo_rim_mend(site, n, mesh, &mended) && geo_regular_update(site, n, &mended, hidden);
  if (good)
    geo_mesh_move(mesh, &mended);
  geo_mesh_clear(&mended);
  return good;
}

// What can be said without triangulating; then *site holds the sites.
static geo_delaunay_result prepare(const double *x, const double *y, const double *weight, size_t n, geo_site **site,
                                   geo_delaunay_report *report) {
  *report = (geo_delaunay_report){.first = -1, .second = -1};
  if (n < 3) {
    snprintf(report->text, sizeof report->text, "%zu points: a triangulation needs at least three", n);
    return GEO_DELAUNAY_TOO_FEW;
  }
  if (!all_finite(x, y, weight, n, report))
    return GEO_DELAUNAY_NOT_FINITE;
  *site = sites_of(x, y, weight, n);
  if (weights_in_range(*site, n, report))
    return GEO_DELAUNAY_OK;
  free(*site);
  return GEO_DELAUNAY_NOT_FINITE;
}

static geo_delaunay_result build_checked(const geo_delaunay_backend *backend, const geo_site *site, const double *x,
                                         const double *y, bool weighted, size_t n, geo_mesh *mesh,
                                         geo_delaunay_report *report) {
  if (!all_distinct(site, n, report)) {
    snprintf(report->text, sizeof report->text, "points %d and %d coincide at (%.9g, %.9g)", report->first,
             report->second, x[report->first], y[report->first]);
    return GEO_DELAUNAY_DUPLICATE;
  }
  if (all_on_one_line(site, n)) {
    snprintf(report->text, sizeof report->text, "all %zu points lie on one line", n);
    return GEO_DELAUNAY_COLLINEAR;
  }
  return build(backend, site, weighted, n, mesh, report);
}

geo_delaunay_result geo_delaunay(const geo_delaunay_backend *backend, const double *x, const double *y,
                                 const double *weight, size_t n, geo_mesh *mesh, geo_delaunay_report *report) {
  geo_delaunay_report unused;
  geo_site *site;
  report = report ? report : &unused;
  geo_delaunay_result result = prepare(x, y, weight, n, &site, report);
  if (result != GEO_DELAUNAY_OK)
    return result;
  result = build_checked(backend, site, x, y, weight != NULL, n, mesh, report);
  free(site);
  return result;
}

geo_delaunay_result geo_delaunay_update(const geo_delaunay_backend *backend, const double *x, const double *y,
                                        const double *weight, size_t n, geo_mesh *mesh, geo_delaunay_report *report) {
  geo_delaunay_report unused;
  geo_site *site;
  report = report ? report : &unused;
  geo_delaunay_result result = prepare(x, y, weight, n, &site, report);
  if (result != GEO_DELAUNAY_OK)
    return result;
  if (!update(site, n, mesh, &report->hidden))
    result = build_checked(backend, site, x, y, weight != NULL, n, mesh, report);
  free(site);
  return result;
}
