// Regular packings of equal grains: rows x columns on a triangular or square lattice, the first grain at (r, r), ids
// row by row from the bottom. Neighbour distance a = 2 r + gap; odd triangular rows are shifted by a / 2 and rows lie
// a sqrt(3) / 2 apart. Not for grains of several sizes.
#include "pack_methods.h"
#include "radius.h"

#include <math.h>

static tal_status check_lattice(const tal_scene *scene, double r, tal_error *err) {
  int64_t columns = scene->pack.columns, rows = scene->pack.rows, count = scene->grains.count;
  if (isnan(r))
    return tal_pack_fail(scene, 0, "grains.radius", err,
                         "a lattice takes equal grains: a uniform law with min equal to max");
  if (columns < 1 || columns > INT32_MAX)
    return tal_pack_fail(scene, 0, "pack.columns", err, "must be 1 or more");
  if (rows < 1 || rows > INT32_MAX / columns)
    return tal_pack_fail(scene, 0, "pack.rows", err, "must be 1 or more, columns times rows at most %d", INT32_MAX);
  if (count != 0 && count != columns * rows)
    return tal_pack_fail(scene, 0, "grains.count", err, "%lld grains, but columns times rows is %lld; leave it out",
                         (long long)count, (long long)(columns * rows));
  if (!(2 * r + scene->pack.gap > 0) || !isfinite(scene->pack.gap))
    return tal_pack_fail(scene, 0, "pack.gap", err,
                         "%g m leaves no distance between neighbours: above %g m is accepted", scene->pack.gap, -2 * r);
  return TAL_OK;
}

static tal_status lattice(const tal_scene *scene, tal_packing *packing, tal_error *err) {
  tal_error law;
  if (tal_radius_check(&scene->grains.radius, &law))
    return tal_pack_fail(scene, 0, "grains.radius", err, "%s", law.text);
  double r = tal_radius_single(&scene->grains.radius);
  tal_status status = check_lattice(scene, r, err);
  if (status)
    return status;
  size_t columns = (size_t)scene->pack.columns, rows = (size_t)scene->pack.rows;
  bool triangular = scene->pack.pattern == TAL_LATTICE_TRIANGULAR;
  double a = 2 * r + scene->pack.gap, row_height = triangular ? 0.5 * sqrt(3.0) * a : a;
  tal_packing_init(packing, columns * rows);
  for (size_t i = 0; i < packing->count; i++) {
    size_t row = i / columns, column = i % columns;
    double shift = triangular && row % 2 == 1 ? 0.5 : 0;
    packing->x[i] = r + ((double)column + shift) * a;
    packing->y[i] = r + (double)row * row_height;
    packing->r[i] = r;
  }
  return TAL_OK;
}

const tal_packer tal_packer_lattice = {
    "lattice", "equal grains on a triangular or square lattice (pattern, columns, rows, gap)", lattice};
