// A confined assembly in no time, for measurements: a drop-and-roll packing whose radii are swollen until its contacts
// carry the overlap of 100 kPa. Radii are uniform between 0.5 and 1 mm, the material is P's.
#ifndef TAL_BENCH_CONFINED_H
#define TAL_BENCH_CONFINED_H

#include "neighbours.h"
#include "sim.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

// `more`: what the scene has beside grains, packing and elasticity, in YAML: material goes on after `density`. Ends the
// program with a line where that is no scene.
__attribute__((format(printf, 4, 5))) static inline tal_sim *confined_assembly(tal_scene *scene, int count,
                                                                               double width, const char *more, ...) {
  char path[] = "/tmp/talus-confined-XXXXXX";
  FILE *out = fdopen(mkstemp(path), "w");
  fprintf(out,
          "grains: {count: %d, radius: {law: uniform, min: 0.5e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
          "pack: {method: drop_and_roll, width: %g}\nmass_scaling: 1e5\nmaterial: {young: 30e9, poisson: 0.3, "
          "density: 2675",
          count, width);
  va_list arguments;
  va_start(arguments, more);
  vfprintf(out, more, arguments);
  va_end(arguments);
  fclose(out);
  tal_scene_errors errors;
  tal_error err;
  tal_sim *sim = NULL;
  if (tal_scene_load(scene, path, NULL, 0, &errors))
    fprintf(stderr, "%s\n", errors.item[0].text);
  else if (tal_sim_create(&sim, scene, &err))
    fprintf(stderr, "%s\n", err.text);
  unlink(path);
  if (!sim)
    exit(1);
  for (size_t i = 0; i < sim->grains.count; i++)
    sim->grains.r[i] *= 1.0004;
  tal_neighbours_rebuild(sim);
  return sim;
}

#endif
