// One time step of a run, and the passage from stage to stage.
#ifndef TAL_STEP_H
#define TAL_STEP_H

#include "sim.h"

// Finds the effects that the scene calls for now (effects.h) and writes them into sim->effects.
void tal_step_effects(tal_sim *sim);
// Sets up the stage run.stage: its friction, plates, boundary, graph and first forces.
tal_status tal_step_begin_stage(tal_sim *sim, tal_error *err);
// True when the graph is part of the run now (a stage that acts on it, or strain being integrated over it).
bool tal_step_keeps_graph(const tal_sim *sim);
// Small steps, of integrator.dt each, in the step that starts `done` of them after the start of the stage; cut where
// the stage ends.
int64_t tal_step_small_steps(const tal_sim *sim, int64_t done);
// Length [s] of the step that starts `done` small steps after the start of the stage.
double tal_step_length(const tal_sim *sim, int64_t done);
// Length [s] of the longest step of the stage.
double tal_step_longest(const tal_sim *sim);
// Fresh graph; accumulates the volumetric strain over the interval that ends.
tal_status tal_step_refresh(tal_sim *sim, tal_error *err);
// Friction between plates and grains that the stage asks for.
double tal_step_plate_friction(const tal_sim *sim, const tal_scene_stage *plan);

#endif
