// Field frames: fields/NNNNNN.h5 for one instant each, and fields.h5, which links them as /frames/NNNNNN. One file per
// time, each written whole: a run killed at any moment leaves every frame readable.
#include "output_parts.h"

#include "order.h"
#include "store.h"
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void put(tal_store *store, const char *name, const char *unit, double *data, size_t rows, size_t columns) {
  tal_store_put(store, &(tal_array){name, unit, TAL_STORE_DOUBLE, rows, columns, data});
}

// Column `from` of a table of doubles whose rows are `stride` doubles long.
static void put_strided(tal_store *store, const char *name, const char *unit, const double *from, size_t stride,
                        size_t rows) {
  double *column = tal_alloc(rows, sizeof *column);
  for (size_t k = 0; k < rows; k++)
    column[k] = from[k * stride];
  put(store, name, unit, column, rows, 1);
  free(column);
}

// Points in space, as XDMF readers want them.
static void put_positions(tal_store *store, const tal_grains *g) {
  double *position = tal_alloc(3 * g->count, sizeof *position);
  for (size_t i = 0; i < g->count; i++) {
    position[3 * i] = g->x[i];
    position[3 * i + 1] = g->y[i];
  }
  put(store, "position", "m", position, g->count, 3);
  free(position);
}

static void put_grains(tal_store *store, const tal_observed *seen) {
  const tal_grains *g = seen->grains;
  const size_t n = g->count;
  tal_store_group(store, "grains");
  tal_store_put(store, TAL_ARRAY("id", "1", g->id, n));
  const struct {
    const char *name, *unit;
    double *data;
  } columns[] = {
      {"x", "m", g->x},
      {"y", "m", g->y},
      {"r", "m", g->r},
      {"theta", "rad", g->theta},
      {"vx", "m/s", g->vx},
      {"vy", "m/s", g->vy},
      {"fx", "N", g->rx},
      {"fy", "N", g->ry},
      {"omega", "rad/s", g->omega},
      {"mass", "kg", g->mass},
      {"torque", "N m", g->rtorque},
  };
  for (size_t k = 0; k < sizeof columns / sizeof *columns; k++) {
    put(store, columns[k].name, columns[k].unit, columns[k].data, n, 1);
  }
  put_positions(store, g);
  geo_tensor *stress = tal_alloc(n, sizeof *stress);
  tal_grain_stress(seen, stress);
  put_strided(store, "stress_xx", "Pa", &stress->xx, 4, n);
  put_strided(store, "stress_xy", "Pa", &stress->xy, 4, n);
  put_strided(store, "stress_yx", "Pa", &stress->yx, 4, n);
  put_strided(store, "stress_yy", "Pa", &stress->yy, 4, n);
  free(stress);
}

// Contacts as a user thinks of them: X(type, name, unit, value in slot c).
#define CONTACT_COLUMNS(X)                                                                                             \
  X(int32_t, i, "1", contacts->i[c])                                                                                   \
  X(int32_t, j, "1", contacts->j[c])                                                                                   \
  X(double, fn, "N", contacts->fe[c] + contacts->fd[c])                                                                \
  X(double, ft, "N", contacts->ft[c])                                                                                  \
  X(double, nx, "1", contacts->nx[c])                                                                                  \
  X(double, ny, "1", contacts->ny[c])                                                                                  \
  X(double, overlap, "m", contacts->overlap[c])                                                                        \
  X(double, slip, "m/s", contacts->slip[c])

static void put_contacts(tal_store *store, const char *group, const tal_contacts *contacts) {
  tal_store_group(store, group);
#define X(type, name, unit, value)                                                                                     \
  {                                                                                                                    \
    type *column = tal_alloc(contacts->count, sizeof *column);                                                         \
    size_t touching = 0;                                                                                               \
    for (size_t c = 0; c < contacts->count; c++) {                                                                     \
      if (contacts->overlap[c] > 0)                                                                                    \
        column[touching++] = value;                                                                                    \
    }                                                                                                                  \
    tal_store_put(store, TAL_ARRAY(#name, unit, column, touching));                                                    \
    free(column);                                                                                                      \
  }
  CONTACT_COLUMNS(X)
#undef X
}

#define IF_STATE(...) __VA_ARGS__
#define IF_WORK(...)

static void put_walls(tal_store *store, const tal_walls *walls) {
  tal_store_group(store, "walls");
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept({                                                                                                          \
    type *column = tal_alloc(walls->count, sizeof *column);                                                            \
    for (size_t w = 0; w < walls->count; w++)                                                                          \
      column[w] = walls->wall[w].name;                                                                                 \
    tal_store_put(store, TAL_ARRAY(#name, unit, column, walls->count));                                                \
    free(column);                                                                                                      \
  })
  TAL_WALL_FIELDS(X)
#undef X
}

static void put_membrane(tal_store *store, const tal_membrane *membrane) {
  tal_store_group(store, "membrane");
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept(tal_store_put(store, TAL_ARRAY(#name, unit, membrane->name, membrane->count));)
  TAL_BEAD_FIELDS(X)
#undef X
}

static void put_cell_tensors(tal_store *store, const tal_cells *cells) {
  const size_t n = cells->count;
  double *table = tal_alloc(4 * n, sizeof *table);
  const double *const L[4] = {cells->Lxx, cells->Lxy, cells->Lyx, cells->Lyy};
  const double *const stress[4] = {cells->stress_xx, cells->stress_xy, cells->stress_yx, cells->stress_yy};
  const double *const strain[3] = {cells->strain_xx, cells->strain_xy, cells->strain_yy};
  for (size_t k = 0; k < 4 * n; k++)
    table[k] = L[k % 4][k / 4];
  put(store, "L", "1/s", table, n, 4);
  for (size_t k = 0; k < 4 * n; k++)
    table[k] = stress[k % 4][k / 4];
  put(store, "stress", "Pa", table, n, 4);
  for (size_t k = 0; k < 3 * n; k++)
    table[k] = strain[k % 3][k / 3];
  put(store, "strain", "1", table, n, 3);
  free(table);
}

// Node indices as one table (what XDMF wants) and as three columns.
static void put_corners(tal_store *store, const tal_cells *cells) {
  static const char *const names[3] = {"i", "j", "k"};
  const size_t n = cells->count;
  int32_t *column = tal_alloc(n, sizeof *column);
  tal_store_put(store, &(tal_array){"corner", "1", TAL_STORE_INT32, n, 3, n ? cells->corner[0] : NULL});
  for (size_t side = 0; side < 3; side++) {
    for (size_t k = 0; k < n; k++)
      column[k] = cells->corner[k][side];
    tal_store_put(store, TAL_ARRAY(names[side], "1", column, n));
  }
  free(column);
}

static size_t put_cells(tal_store *store, const tal_observed *seen) {
  tal_cells cells;
  tal_cells_init(&cells);
  if (seen->graph->valid)
    tal_cells_measure(seen, &cells);
  tal_store_group(store, "cells");
  put_corners(store, &cells);
  put_cell_tensors(store, &cells);
  put(store, "area", "m^2", cells.area, cells.count, 1);
  put(store, "L_II", "1/s", cells.L_II, cells.count, 1);
  put(store, "pressure", "Pa", cells.pressure, cells.count, 1);
  const size_t count = cells.count;
  tal_cells_clear(&cells);
  return count;
}

static void put_loop(tal_store *store, const tal_graph *graph) {
  tal_store_group(store, "loop");
  tal_store_put(store, TAL_ARRAY("node", "1", graph->loop.node, graph->valid ? graph->loop.count : 0));
}

static tal_status write_frame(const char *path, tal_sim *sim, size_t *cells, tal_error *err) {
  const tal_observed now = tal_sim_driving(sim);
  tal_by_id copy;
  tal_store store;
  tal_by_id_init(&copy, &now);
  const tal_observed seen = copy.seen;
  tal_store_begin(&store);
  tal_store_put_number(&store, "time", sim->run.time);
  tal_store_put_integer(&store, "step", sim->run.step);
  tal_store_put_integer(&store, "stage", sim->run.stage);
  tal_store_put_number(&store, "axial_strain", sim->run.axial_strain);
  put_grains(&store, &seen);
  put_contacts(&store, "contacts", seen.pairs);
  put_contacts(&store, "wall_contacts", seen.walls);
  put_walls(&store, &sim->walls);
  if (sim->membrane.count)
    put_membrane(&store, &sim->membrane);
  *cells = put_cells(&store, &seen);
  put_loop(&store, seen.graph);
  tal_by_id_clear(&copy);
  return tal_store_save(&store, path, NULL, err);
}

tal_status tal_output_fields(tal_output *output, tal_sim *sim, tal_error *err) {
  const size_t frame = output->files.frame_count;
  if (frame > 0 && output->files.frame[frame - 1].step == sim->run.step)
    return TAL_OK;
  char name[32], path[TAL_PATH_SIZE];
  snprintf(name, sizeof name, TAL_FRAME_NAME, frame);
  tal_file_path(path, output->dir, name);
  size_t cells;
  tal_status status = write_frame(path, sim, &cells, err);
  if (status != TAL_OK)
    return status;
  tal_frame_mark mark = {sim->run.time, sim->run.step, (int64_t)sim->grains.count, (int64_t)cells};
  tal_run_files_add_frame(&output->files, mark);
  status = tal_fields_index(output, err);
  // fields.xdmf grows by kilobytes per frame: past the first frames it is rewritten now and then, and at checkpoints.
  const size_t listed = output->listed_frames;
  return status == TAL_OK && frame + 1 > listed + listed / 64 ? tal_xdmf_write(output, err) : status;
}

tal_status tal_fields_index(tal_output *output, tal_error *err) {
  char file[32], path[TAL_PATH_SIZE];
  tal_store store;
  tal_store_begin(&store);
  tal_store_group(&store, "frames");
  for (size_t k = 0; k < output->files.frame_count; k++) {
    snprintf(file, sizeof file, TAL_FRAME_NAME, k);
    char link[32];
    snprintf(link, sizeof link, "%06zu", k);
    tal_store_link(&store, link, file);
  }
  tal_file_path(path, output->dir, "fields.h5");
  return tal_store_save(&store, path, NULL, err);
}

tal_status tal_fields_check(const char *dir, const tal_run_files *files, tal_error *err) {
  for (size_t k = 0; k < files->frame_count; k++) {
    char name[32], path[TAL_PATH_SIZE];
    snprintf(name, sizeof name, TAL_FRAME_NAME, k);
    tal_file_path(path, dir, name);
    if (!tal_file_exists(path)) {
      return tal_fail(err, TAL_BAD_INPUT, "%s is missing, the checkpoint was written with %zu frames", path,
                      files->frame_count);
    }
  }
  return TAL_OK;
}

tal_status tal_fields_drop_later(const tal_output *output, tal_error *err) {
  char folder[TAL_PATH_SIZE], path[TAL_PATH_SIZE];
  tal_file_path(folder, output->dir, "fields");
  DIR *entries = opendir(folder);
  if (!entries)
    return tal_fail(err, TAL_IO, "%s: cannot be read: %s", folder, strerror(errno));
  tal_status status = TAL_OK;
  for (struct dirent *entry; (entry = readdir(entries));) {
    char *end;
    size_t frame = strtoul(entry->d_name, &end, 10);
    bool unfinished = strcmp(end, ".h5.tmp") == 0,
         later = strcmp(end, ".h5") == 0 && frame >= output->files.frame_count;
    if (end == entry->d_name || !(unfinished || later))
      continue;
    tal_file_path(path, folder, entry->d_name);
    if (unlink(path) != 0)
      status = tal_fail(err, TAL_IO, "%s: cannot be removed: %s", path, strerror(errno));
  }
  closedir(entries);
  return status;
}
