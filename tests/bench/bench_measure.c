// CPU and wall seconds per frame of tal_measure, and its peak memory, on frames of N^2 x 1000 grains: those of a
// biaxial test of 1000 grains, set side by side N times in x and in y. Tables without figures, the last frame with its
// lists. Usage: bench_measure [N [FRAMES ...]] (default 10, and 3, 12 frames; 100 frames of 100,000 grains need 5.3 GB
// in $TMPDIR or /tmp).
#include "files.h"
#include "measure.h"
#include "run.h"
#include "store.h"

#include <ftw.h>
#include <hdf5.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const char scene_text[] =
    "seed: 3\n"
    "grains: {count: 1000, radius: {law: uniform, min: 0.5e-3, max: 1e-3}}\n"
    "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\n"
    "mass_scaling: 1e5\n"
    "pack: {method: drop_and_roll, width: 36e-3}\n"
    "continuum: {refresh: {strain: 1e-4}}\n"
    "integrator: {scheme: implicit_friction, dt: 2e-4, sweeps: 1}\n"
    "stages:\n"
    "  - {kind: confine, pressure: 100e3, ramp: 0.5, friction: 0.1, tolerance: 0.2, unbalanced: 0.05}\n"
    "  - {kind: compress, boundary: pressure, rate: 0.05, strain: 0.1}\n"
    "output: {series_every: 0.02, fields_every: 0.02}\n";

static void give_up(const tal_error *err) {
  fprintf(stderr, "bench_measure: %s\n", err->text);
  _exit(1);
}

// ---- the frames ----

typedef struct tiling {
  int side, frames;
  const char *from, *to; // folders
} tiling;

static void run_one(const void *context) {
  const tiling *t = context;
  char path[TAL_PATH_SIZE];
  tal_scene scene;
  tal_scene_errors errors = {0};
  tal_run_result result;
  tal_error err;
  tal_file_path(path, t->from, "scene.yaml");
  if (tal_file_replace(path, NULL, scene_text, sizeof scene_text - 1, &err))
    give_up(&err);
  if (tal_scene_load(&scene, path, NULL, 0, &errors))
    give_up(&errors.item[0]);
  if (tal_run_scene(&scene, &(tal_run_options){.dir = t->from, .threads = 1, .quiet = true}, &result, &err))
    give_up(&err);
  tal_scene_clear(&scene);
}

typedef struct group {
  tal_store *from, *to;
  const char *name;
  size_t side, grains;
  double width, height; // [m] of a tile
} group;

// What a column gains from tile to tile: places move, ids and indices of grains go on counting.
static double gain_of(const group *g, const char *column, size_t tile) {
  const bool grains = strcmp(g->name, "grains") == 0, walls = strcmp(g->name, "wall_contacts") == 0;
  if (grains && strcmp(column, "x") == 0)
    return (double)(tile % g->side) * g->width;
  if (grains && strcmp(column, "y") == 0)
    return (double)(tile / g->side) * g->height;
  const bool indices = strlen(column) == 1 && strchr("ijk", *column) && !(walls && *column == 'j');
  return indices || strcmp(column, "id") == 0 || strcmp(column, "corner") == 0 ? (double)(tile * g->grains) : 0;
}

static void repeat(const group *g, const char *name, tal_array one) {
  const size_t tiles = g->side * g->side, n = one.rows * one.columns;
  tal_array many = {name, NULL, one.type, tiles * one.rows, one.columns, tal_alloc(tiles * n, 8)};
  one.data = tal_alloc(n, 8);
  tal_store_get(g->from, &one);
  for (size_t k = 0; k < tiles * n; k++) {
    const double gain = gain_of(g, name, k / n);
    if (one.type == TAL_STORE_DOUBLE)
      ((double *)many.data)[k] = ((double *)one.data)[k % n] + gain;
    else if (one.type == TAL_STORE_INT64)
      ((int64_t *)many.data)[k] = ((int64_t *)one.data)[k % n] + (int64_t)gain;
    else
      ((int32_t *)many.data)[k] = ((int32_t *)one.data)[k % n] + (int32_t)gain;
  }
  tal_store_put(g->to, &many);
  free(one.data);
  free(many.data);
}

static herr_t visit(hid_t at, const char *name, const H5L_info_t *info, void *context) {
  (void)info;
  hid_t set = H5Dopen2(at, name, H5P_DEFAULT), space = H5Dget_space(set), type = H5Dget_type(set);
  hsize_t size[2] = {0, 1};
  H5Sget_simple_extent_dims(space, size, NULL);
  const tal_store_type kind = H5Tget_class(type) == H5T_FLOAT ? TAL_STORE_DOUBLE
                              : H5Tget_size(type) == 8        ? TAL_STORE_INT64
                                                              : TAL_STORE_INT32;
  const bool bytes = H5Tget_size(type) == 1;
  H5Tclose(type);
  H5Sclose(space);
  H5Dclose(set);
  if (!bytes && size[0])
    repeat(context, name, (tal_array){name, NULL, kind, size[0], size[1], NULL});
  return 0;
}

static double extent(tal_store *from, const char *name) {
  const size_t n = tal_store_rows(from, name);
  double *x = tal_alloc(n, sizeof *x), low = HUGE_VAL, high = -HUGE_VAL;
  tal_store_get(from, TAL_ARRAY(name, NULL, x, n));
  for (size_t k = 0; k < n; k++) {
    low = x[k] < low ? x[k] : low;
    high = x[k] > high ? x[k] : high;
  }
  free(x);
  return high - low + 1e-3; // a mean radius and more on either side
}

static void tile_frame(const tiling *t, int frame, int of) {
  static const char *const names[] = {"grains", "contacts", "wall_contacts", "cells"};
  char path[TAL_PATH_SIZE], file[40];
  tal_store from, to;
  tal_error err;
  snprintf(file, sizeof file, "fields/%06d.h5", of);
  tal_file_path(path, t->from, file);
  if (tal_store_open(&from, path, &err))
    give_up(&err);
  tal_store_begin(&to);
  tal_store_put_number(&to, "time", tal_store_get_number(&from, "time"));
  tal_store_put_number(&to, "axial_strain", tal_store_get_number(&from, "axial_strain"));
  tal_store_put_integer(&to, "step", tal_store_get_integer(&from, "step"));
  tal_store_put_integer(&to, "stage", tal_store_get_integer(&from, "stage"));
  tal_store_group(&from, "grains");
  group g = {&from, &to, NULL, (size_t)t->side, tal_store_rows(&from, "id"), extent(&from, "x"), extent(&from, "y")};
  for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
    g.name = names[k];
    tal_store_group(&from, g.name);
    tal_store_group(&to, g.name);
    H5Literate(from.group, H5_INDEX_NAME, H5_ITER_INC, NULL, visit, &g);
  }
  if (tal_store_status(&from, &err))
    give_up(&err);
  tal_store_close(&from);
  snprintf(file, sizeof file, "fields/%06d.h5", frame);
  tal_file_path(path, t->to, file);
  if (tal_store_save(&to, path, NULL, &err))
    give_up(&err);
}

// The frames lie as far apart in strain as they can: from the first of the compression to the last.
static void tile(const void *context) {
  const tiling *t = context;
  char path[TAL_PATH_SIZE], file[40];
  int first = -1, last = 0;
  tal_store store;
  tal_error err;
  tal_file_path(path, t->to, "fields");
  if (tal_folder_create(path, &err))
    give_up(&err);
  for (;; last++) {
    snprintf(file, sizeof file, "fields/%06d.h5", last);
    tal_file_path(path, t->from, file);
    if (tal_store_open(&store, path, NULL))
      break;
    first = first < 0 && tal_store_get_integer(&store, "stage") == 1 ? last : first;
    tal_store_close(&store);
  }
  for (int k = 0; k < t->frames; k++)
    tile_frame(t, k, first + (last - 1 - first) * k / (t->frames > 1 ? t->frames - 1 : 1));
}

// ---- the measurement ----

typedef struct job {
  const char *dir;
  int threads;
} job;

static void measure(const void *context) {
  const job *j = context;
  char out[TAL_PATH_SIZE];
  tal_measure_counts counts;
  tal_error err;
  tal_file_path(out, j->dir, "measure");
  omp_set_num_threads(j->threads);
  if (tal_measure(j->dir, out, &(tal_measure_options){0}, &counts, &err))
    give_up(&err);
}

typedef struct cost {
  double cpu, wall; // [s]
  double memory;    // [MB]
} cost;

// In a child: its peak memory is its own, and OpenMP does not live through a fork.
static cost in_child(void (*work)(const void *), const void *context) {
  struct timespec begin, end;
  struct rusage use;
  int status;
  clock_gettime(CLOCK_MONOTONIC, &begin);
  const pid_t child = fork();
  if (child == 0) {
    work(context);
    _exit(0);
  }
  if (wait4(child, &status, 0, &use) < 0 || status)
    exit(1);
  clock_gettime(CLOCK_MONOTONIC, &end);
  return (cost){(double)(use.ru_utime.tv_sec + use.ru_stime.tv_sec) +
                    1e-6 * (double)(use.ru_utime.tv_usec + use.ru_stime.tv_usec),
                (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec),
                (double)use.ru_maxrss / 1024};
}

static int remove_entry(const char *path, const struct stat *info, int type, struct FTW *at) {
  (void)info, (void)type, (void)at;
  return remove(path);
}

static void measure_frames(const char *folder, const char *one, int side, int frames) {
  char dir[TAL_PATH_SIZE];
  tal_file_path(dir, folder, "tiled");
  in_child(tile, &(tiling){side, frames, one, dir});
  for (int threads = 1; threads <= 2; threads++) {
    const cost c = in_child(measure, &(job){dir, threads});
    printf("%10d %7d %8d %14.3f %15.3f %12.0f\n", side * side * 1000, frames, threads, c.cpu / frames, c.wall / frames,
           c.memory);
    fflush(stdout);
  }
  nftw(dir, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
}

int main(int argc, char **argv) {
  char folder[TAL_PATH_SIZE], one[TAL_PATH_SIZE];
  const char *where = getenv("TMPDIR");
  const int side = argc > 1 ? atoi(argv[1]) : 10;
  tal_error err;
  tal_file_path(folder, where ? where : "/tmp", "talus-bench-XXXXXX");
  if (side < 1 || !mkdtemp(folder))
    return 1;
  tal_file_path(one, folder, "one");
  if (tal_folder_create(one, &err))
    give_up(&err);
  in_child(run_one, &(tiling){.from = one});
  printf("%10s %7s %8s %14s %15s %12s\n", "grains", "frames", "threads", "CPU s/frame", "wall s/frame", "peak MB");
  for (int k = 2; k < (argc > 2 ? argc : 4); k++)
    measure_frames(folder, one, side, argc > 2 ? atoi(argv[k]) : k == 2 ? 3 : 12);
  nftw(folder, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
  return 0;
}
