// Method none: the grains of the scene's own list, where they are.
#include "pack_methods.h"

#include <math.h>

static tal_status check_listed(const tal_scene *scene, size_t i, tal_error *err) {
  const tal_listed_grain *grain = &scene->grains.list[i];
  if (!isfinite(grain->x) || !isfinite(grain->y) || !(grain->r > 0 && isfinite(grain->r)))
    return tal_pack_fail(scene, 0, "grains.list", err, "grain %zu: x and y must be finite and r above 0", i);
  if (!isfinite(grain->vx) || !isfinite(grain->vy) || !isfinite(grain->omega))
    return tal_pack_fail(scene, 0, "grains.list", err, "grain %zu: vx, vy and omega must be finite", i);
  if (grain->mass <= 0 || grain->inertia <= 0 || isinf(grain->mass) || isinf(grain->inertia))
    return tal_pack_fail(scene, 0, "grains.list", err, "grain %zu: mass and inertia must be above 0 and finite", i);
  return TAL_OK;
}

static tal_status list(const tal_scene *scene, tal_packing *packing, tal_error *err) {
  size_t count = scene->grains.list_count;
  if (count == 0)
    return tal_pack_fail(scene, 0, "grains.list", err, "no grains; pack.method none needs listed grains");
  if (count > INT32_MAX)
    return tal_pack_fail(scene, 0, "grains.list", err, "more than %d grains", INT32_MAX);
  tal_packing_init(packing, count);
  for (size_t i = 0; i < count; i++) {
    tal_status status = check_listed(scene, i, err);
    if (status)
      return status;
    const tal_listed_grain *grain = &scene->grains.list[i];
    packing->x[i] = grain->x;
    packing->y[i] = grain->y;
    packing->r[i] = grain->r;
    tal_packed_extras extras = {grain->vx, grain->vy, grain->omega, grain->mass, grain->inertia, grain->fixed};
    tal_packing_extras(packing, i, &extras);
  }
  size_t i, j;
  if (tal_packing_coincident(packing, &i, &j))
    return tal_pack_fail(scene, 0, "grains.list", err, "grains %zu and %zu have the same centre", i, j);
  return TAL_OK;
}

const tal_packer tal_packer_list = {"none", "the grains listed in the scene", list};
