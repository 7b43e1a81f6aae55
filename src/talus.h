// Talus: the library's public face. Load a scene, run it, look at it:
//
//   tal_scene scene; tal_scene_errors errors; tal_error err;
//   if (tal_scene_load(&scene, "scene.yaml", NULL, 0, &errors)) ...
//   tal_sim *sim;
//   if (tal_sim_create(&sim, &scene, &err)) ...
//   while (!tal_sim_done(sim))
//     if (tal_sim_step(sim, &err)) ...
//   tal_row row; tal_sim_row(sim, &row);
//
// or run.h for a whole run with its files.
#ifndef TAL_TALUS_H
#define TAL_TALUS_H

#include "base.h"
#include "continuum.h"
#include "critical.h"
#include "energy.h"
#include "figures.h"
#include "impact.h"
#include "measure.h"
#include "output.h"
#include "run.h"
#include "scene.h"
#include "sim.h"

#endif
