// The impact of two mean grains over the damping: a table and a picture that answer P's Fig. 2.1.
#ifndef TAL_FIGURES_IMPACT_H
#define TAL_FIGURES_IMPACT_H

#include "damping.h"

// What is drawn: everything else as the scene has it, the damping varied.
typedef struct tal_impact_study {
  const char *name; // of the scene
  bool hertz;
  tal_pair pair;    // two mean grains with the scene's own damping
  double speed;     // [m/s] at which they meet
  double reference; // [s] t0 = 1/rate [P 2.5], NAN without a rate
} tal_impact_study;

// Of a scene whose constants are known. TAL_BAD_INPUT where no speed is: a Hertz scene without vR and
// restitution_speed.
tal_status tal_impact_study_of(const tal_scene *scene, const tal_constants *constants, tal_impact_study *study,
                               tal_error *err);
// Writes folder/impact.csv, columns in docs/formats.md. TAL_IO.
tal_status tal_impact_study_table(const tal_scene *scene, const tal_impact_study *study, const char *folder,
                                  tal_error *err);
// Draws folder/impact.png. TAL_IO, TAL_INTERRUPTED as tal_plot_finish.
tal_status tal_impact_study_draw(const tal_scene *scene, const tal_impact_study *study, const char *folder,
                                 tal_error *err);

#endif
