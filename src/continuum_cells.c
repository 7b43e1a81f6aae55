// Strain and stress of each Delaunay cell inside the loop: (31), (34), (35), (37). Bagi 1996, Satake 1992,
// Christoffersen et al. 1981. One observed instant; nothing is integrated in time here.
#include "continuum.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double nothing = (double)NAN; // of what has no meaning

#define SIZE_FIELD(name, unit, meaning) cells->name = tal_alloc(count, sizeof *cells->name);
#define FREE_FIELD(name, unit, meaning) free(cells->name);

void tal_cells_init(tal_cells *cells) {
  *cells = (tal_cells){0};
}

void tal_cells_clear(tal_cells *cells) {
  free(cells->corner);
  TAL_CELL_FIELDS(FREE_FIELD)
  *cells = (tal_cells){0};
}

static void resize(tal_cells *cells, size_t count) {
  if (cells->count == count)
    return;
  tal_cells_clear(cells);
  if (count == 0)
    return;
  cells->count = count;
  cells->corner = tal_alloc(count, sizeof *cells->corner);
  TAL_CELL_FIELDS(SIZE_FIELD)
}

size_t tal_cells_moments(const tal_observed *seen, geo_tensor *moment) {
  const tal_grains *grains = seen->grains;
  const tal_contacts *pairs = seen->pairs;
  size_t off_graph = 0;
  for (size_t c = 0; c < pairs->count; c++) {
    if (!(pairs->overlap[c] > 0))
      continue;
    int32_t i = pairs->i[c], j = pairs->j[c], cell[2];
    size_t shared = tal_graph_edge_cells(seen->graph, i, j, cell);
    off_graph += shared == 0;
    if (shared == 0)
      continue;
    geo_vec branch = {grains->x[i] - grains->x[j], grains->y[i] - grains->y[j]};
    geo_tensor share = geo_tensor_scale(1.0 / (double)shared, geo_outer(tal_contact_force(pairs, c), branch));
    for (size_t k = 0; k < shared; k++)
      moment[cell[k]] = geo_tensor_add(moment[cell[k]], share);
  }
  return off_graph;
}

static void velocity_gradient(const tal_grains *grains, tal_cells *cells, size_t c) {
  geo_vec p[3], v[3];
  for (int k = 0; k < 3; k++) {
    int32_t i = cells->corner[c][k];
    p[k] = (geo_vec){grains->x[i], grains->y[i]};
    v[k] = (geo_vec){grains->vx[i], grains->vy[i]};
  }
  geo_tensor L = tal_cell_gradient(p, v, &cells->area[c]);
  double shear = (L.xy + L.yx) / 2, difference = (L.xx - L.yy) / 2;
  cells->Lxx[c] = L.xx;
  cells->Lxy[c] = L.xy;
  cells->Lyx[c] = L.yx;
  cells->Lyy[c] = L.yy;
  cells->L_II[c] = sqrt(difference * difference + shear * shear); // (35): D' has the entries +-difference and shear
}

static void strain(const tal_graph *graph, const tal_grains *grains, tal_cells *cells, size_t c) {
  geo_vec p[3], u[3];
  for (int k = 0; k < 3; k++) {
    int32_t i = cells->corner[c][k];
    p[k] = (geo_vec){graph->x[i], graph->y[i]};
    u[k] = (geo_vec){grains->x[i] - graph->x[i], grains->y[i] - graph->y[i]};
  }
  double reference_area;
  geo_tensor H = tal_cell_gradient(p, u, &reference_area);
  cells->strain_xx[c] = H.xx;
  cells->strain_xy[c] = (H.xy + H.yx) / 2;
  cells->strain_yy[c] = H.yy;
}

static void stress(double thickness, geo_tensor moment, tal_cells *cells, size_t c) {
  double volume = cells->area[c] * thickness;
  geo_tensor sigma =
      volume == 0 ? (geo_tensor){nothing, nothing, nothing, nothing} : geo_tensor_scale(1 / volume, moment);
  cells->stress_xx[c] = sigma.xx;
  cells->stress_xy[c] = sigma.xy;
  cells->stress_yx[c] = sigma.yx;
  cells->stress_yy[c] = sigma.yy;
  cells->pressure[c] = geo_trace(sigma) / 2;
}

void tal_cells_measure(const tal_observed *seen, tal_cells *cells) {
  const tal_graph *graph = seen->graph;
  size_t count = graph->valid ? graph->cell_count : 0;
  resize(cells, count);
  if (count == 0)
    return;
  assert(graph->grain_count == seen->grains->count);
  geo_tensor *moment = tal_alloc(count, sizeof *moment);
  tal_cells_moments(seen, moment);
  for (size_t c = 0; c < count; c++) {
    memcpy(cells->corner[c], graph->mesh.corner[graph->cell[c]], sizeof cells->corner[c]);
    velocity_gradient(seen->grains, cells, c);
    strain(graph, seen->grains, cells, c);
    stress(seen->thickness, moment[c], cells, c);
  }
  free(moment);
}
