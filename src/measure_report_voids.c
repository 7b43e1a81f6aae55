// voids.csv: coordination, solid fraction of the cells, void polygons frame by frame. cells.csv, void_list.csv and the
// maps solid-NNNNNN.png, voids-NNNNNN.png: of the frames of --at.
#include "measure_map.h"

#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>

static void *create(tal_measuring *run) {
  tal_tables_get(&run->tables, "voids.csv",
                 TAL_ROW
                 ",grains,rattlers,coordination,coordination_bearing,z0,z1,z2,z3,z4,z5,z6,z7_and_more,cells,"
                 "solid_fraction,cell_solid_sd,cell_solid_median,cell_solid_min,cell_solid_max,voids,closed_voids,"
                 "mean_sides,mean_area[m^2],largest_area[m^2],mean_aspect,sides3,sides4,sides5,sides6,sides7,"
                 "sides8,sides9_and_more");
  return NULL;
}

static void put_coordination(FILE *out, const tal_coordination *z) {
  fprintf(out, ",%zu,%zu", z->grains, z->rattlers);
  tal_put(out, z->mean);
  tal_put(out, z->bearing);
  for (size_t k = 0; k < TAL_COORDINATION_BINS; k++)
    fprintf(out, ",%zu", z->with[k]);
}

// Mean and deviation are weighted by area: the needles at the rim, which their discs outgrow, do not count for much.
static void put_solid(FILE *out, const tal_part *part) {
  const size_t n = part->cell_count;
  double *share = tal_alloc(n + 1, sizeof *share), solid = 0, square = 0;
  for (size_t k = 0; k < n; k++) {
    const size_t t = (size_t)part->cell[k];
    const double area = tal_cell_solid(part->of, t);
    solid += area;
    share[k] = area / part->of->cell_area[t];
    square += area * share[k];
  }
  const double mean = part->area > 0 ? solid / part->area : 0;
  fprintf(out, ",%zu", n);
  tal_put(out, mean);
  tal_put(out, part->area > 0 ? sqrt(fmax(0, square / part->area - mean * mean)) : 0);
  tal_put(out, n ? gsl_stats_median(share, 1, n) : 0);
  tal_put(out, n ? gsl_stats_min(share, 1, n) : 0);
  tal_put(out, n ? gsl_stats_max(share, 1, n) : 0);
  free(share);
}

static void put_voids(FILE *out, const tal_voids *voids) {
  fprintf(out, ",%zu,%zu", voids->count, voids->closed);
  tal_put(out, voids->mean_sides);
  tal_put(out, voids->mean_area);
  tal_put(out, voids->largest_area);
  tal_put(out, voids->mean_aspect);
  for (size_t k = 3; k < TAL_VOID_BINS; k++)
    fprintf(out, ",%zu", voids->with[k]);
}

// ---- the frames of --at ----

static void put_cells(tal_measuring *run, const tal_part *part, const tal_voids *voids) {
  FILE *out = tal_tables_get(&run->tables, "cells.csv", TAL_ROW ",i,j,k,x[m],y[m],area[m^2],solid_fraction,void");
  const tal_snapshot *s = part->of;
  for (size_t k = 0; k < part->cell_count; k++) {
    const size_t t = (size_t)part->cell[k];
    const int32_t *c = s->corner[t];
    tal_measuring_row(run, part, out);
    fprintf(out, ",%lld,%lld,%lld", (long long)s->id[c[0]], (long long)s->id[c[1]], (long long)s->id[c[2]]);
    tal_put(out, (s->x[c[0]] + s->x[c[1]] + s->x[c[2]]) / 3);
    tal_put(out, (s->y[c[0]] + s->y[c[1]] + s->y[c[2]]) / 3);
    tal_put(out, s->cell_area[t]);
    tal_put(out, tal_cell_solid(s, t) / s->cell_area[t]);
    fprintf(out, ",%d\n", (int)voids->of[t]);
  }
}

static void put_list(tal_measuring *run, const tal_part *part, const tal_voids *voids) {
  FILE *out = tal_tables_get(&run->tables, "void_list.csv",
                             TAL_ROW ",void,cells,sides,open,area[m^2],solid_fraction,x[m],y[m],aspect,direction[deg]");
  for (size_t k = 0; k < voids->count; k++) {
    const tal_void *v = &voids->item[k];
    tal_measuring_row(run, part, out);
    fprintf(out, ",%zu,%zu,%zu,%d", k, v->cells, v->sides, v->open);
    tal_put(out, v->area);
    tal_put(out, v->area > 0 ? v->solid / v->area : 0);
    tal_put(out, v->x);
    tal_put(out, v->y);
    tal_put(out, v->aspect);
    tal_put(out, v->angle * 180 / TAL_PI);
    fputc('\n', out);
  }
}

static double *blank(size_t count) {
  double *value = tal_alloc(count, sizeof *value);
  for (size_t k = 0; k < count; k++)
    value[k] = (double)NAN;
  return value;
}

static void draw_solid(tal_measuring *run, const tal_part *part) {
  tal_measure_map m;
  double *value = blank(part->of->cell_count);
  for (size_t k = 0; k < part->cell_count; k++) {
    const size_t t = (size_t)part->cell[k];
    value[t] = fmax(0.6, fmin(0.92, tal_cell_solid(part->of, t) / part->of->cell_area[t]));
  }
  if (tal_measure_map_begin(&m, run, "solid fraction of cells", 2, true)) {
    fputs(
        "set palette defined (0.6 '#3b0f2f', 0.7 '#c4461f', 0.78 '#f0a83c', 0.84 '#e4e4e4', 0.92 '#fbfbfb') maxcolors "
        "256\nset cbrange [0.6:0.92]\nset cbtics 0.1\nset cbtics add ('≤0.6' 0.6)\nset colorbox\n",
        m.plot.script);
    tal_measure_map_cells(&m, part->of, value);
    tal_map_walls(&m.data.last, &m.plot);
    tal_measure_map_end(&m, run, "solid");
  }
  free(value);
}

static void draw_voids(tal_measuring *run, const tal_part *part, const tal_voids *voids) {
  tal_measure_map m;
  double *value = blank(part->of->cell_count);
  for (size_t t = 0; t < part->of->cell_count; t++)
    if (voids->of[t] >= 0 && !voids->item[voids->of[t]].open)
      value[t] = (double)(voids->item[voids->of[t]].sides < 9 ? voids->item[voids->of[t]].sides : 9);
  if (tal_measure_map_begin(&m, run, "void polygons", 3, true)) {
    tal_map_heading(&m.map, &m.plot, 2, "%zu closed, mean sides %.3g", voids->closed, voids->mean_sides);
    fputs("set palette defined (3 '#f4f4f4', 4 '#d9d9d9', 5 '#f3cf9a', 6 '#e89b3a', 7 '#c4461f', 8 '#7d1d2b', 9 "
          "'#3b0f2f') maxcolors 7\nset cbrange [2.5:9.5]\nset cbtics 1\nset cbtics add ('≥9' 9)\nset cblabel 'contacts "
          "around it'\nset colorbox\n",
          m.plot.script);
    tal_measure_map_cells(&m, part->of, value);
    tal_measure_map_contacts(&m, part->of, part->contact, part->contact_count, part->mean_fn,
                             0.04 * part->mean_diameter * m.map.scale, "contacts", "#1b2a5c");
    tal_map_walls(&m.data.last, &m.plot);
    tal_measure_map_end(&m, run, "voids");
  }
  free(value);
}

static void frame(void *state, tal_measuring *run, const tal_part *part) {
  (void)state;
  FILE *out = tal_tables_get(&run->tables, "voids.csv", "");
  const tal_coordination z = tal_coordination_measure(part);
  tal_voids voids;
  tal_voids_find(&voids, part);
  tal_measuring_row(run, part, out);
  put_coordination(out, &z);
  put_solid(out, part);
  put_voids(out, &voids);
  fputc('\n', out);
  if (run->detail) {
    put_cells(run, part, &voids);
    put_list(run, part, &voids);
    if (run->options->figures && part->cell_count) {
      draw_solid(run, part);
      draw_voids(run, part, &voids);
    }
  }
  tal_voids_clear(&voids);
}

const tal_measurement tal_measurement_voids = {create, frame, NULL};
