// Stress of each grain from the forces at its contact points, (41). Walls count: they press on the grain as well.
#include "continuum.h"

#include <string.h>

static void add_moment(geo_tensor *moment, geo_vec force, double lever, geo_vec n) {
  *moment = geo_tensor_add(*moment, geo_tensor_scale(lever, geo_outer(force, n)));
}

void tal_grain_stress(const tal_observed *seen, geo_tensor *stress) {
  const tal_grains *grains = seen->grains;
  const tal_contacts *pairs = seen->pairs, *walls = seen->walls;
  memset(stress, 0, grains->count * sizeof *stress);
  // Centre less contact point is (r - overlap/2) n for i; force and normal both turn round for j.
  for (size_t c = 0; c < pairs->count; c++) {
    if (!(pairs->overlap[c] > 0))
      continue;
    int32_t i = pairs->i[c], j = pairs->j[c];
    geo_vec force = tal_contact_force(pairs, c), n = {pairs->nx[c], pairs->ny[c]};
    add_moment(&stress[i], force, grains->r[i] - pairs->overlap[c] / 2, n);
    add_moment(&stress[j], force, grains->r[j] - pairs->overlap[c] / 2, n);
  }
  for (size_t c = 0; c < walls->count; c++) {
    if (!(walls->overlap[c] > 0))
      continue;
    int32_t i = walls->i[c];
    geo_vec n = {walls->nx[c], walls->ny[c]};
    add_moment(&stress[i], tal_contact_force(walls, c), grains->r[i] - walls->overlap[c], n);
  }
  for (size_t i = 0; i < grains->count; i++)
    stress[i] = geo_tensor_scale(1 / (TAL_PI * grains->r[i] * grains->r[i] * seen->thickness), stress[i]);
}
