// CPU seconds of a drop-and-roll packing and of all that comes before the first step (masses, order in memory,
// neighbour list, first forces). Usage: bench_pack [N ...] (default 4000 100000 1000000).
#include "sim.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

static double cpu_seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void load(tal_scene *scene, int n) {
  char path[] = "/tmp/talus-bench-XXXXXX";
  FILE *out = fdopen(mkstemp(path), "w");
  fprintf(out,
          "grains: {count: %d, radius: {law: uniform, min: 0.5e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
          "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\nmass_scaling: 1e5\n"
          "pack: {method: drop_and_roll, width: %g}\nintegrator: {dt: 1e-5}\n"
          "stages: [{kind: compress, pressure: 100e3, rate: 5e-3, strain: 0.2}]\n",
          n, 1e-3 * sqrt(n));
  fclose(out);
  tal_scene_errors errors;
  if (tal_scene_load(scene, path, NULL, 0, &errors)) {
    fprintf(stderr, "%s\n", errors.item[0].text);
    exit(1);
  }
  unlink(path);
}

static void measure(int n) {
  tal_scene scene;
  tal_packing packing;
  tal_sim *sim;
  tal_error err;
  load(&scene, n);
  double start = cpu_seconds();
  tal_status status = tal_pack(&scene, &packing, &err);
  const double packed = cpu_seconds() - start;
  start = cpu_seconds();
  if (status || tal_sim_create(&sim, &scene, &err)) {
    fprintf(stderr, "%s\n", err.text);
    exit(1);
  }
  printf("%8d %10.3f %10.3f\n", n, packed, cpu_seconds() - start);
  fflush(stdout);
  tal_packing_clear(&packing);
  tal_sim_free(sim);
  tal_scene_clear(&scene);
}

int main(int argc, char **argv) {
  omp_set_num_threads(1);
  printf("%8s %10s %10s   [CPU s]\n", "N", "packing", "ready");
  for (int k = 1; k < argc; k++)
    measure(atoi(argv[k]));
  if (argc == 1) {
    measure(4000);
    measure(100000);
    measure(1000000);
  }
  return 0;
}
