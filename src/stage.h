// Stages: what a run is asked to do, one after the other. Constant descriptors, one registry line each in stage.c.
#ifndef TAL_STAGE_H
#define TAL_STAGE_H

#include "boundary_minimal.h"
#include "registry.h"
#include "sim.h"

struct tal_stage {
  const char *name;
  const char *help;
  bool uses_graph; // the graph is kept fresh during the stage; else it is built for output only
  // Small steps that the stage takes in all; NULL: not known beforehand.
  int64_t (*steps)(const tal_scene_stage *plan);
  // Sets plates, pressure, friction, boundary. Forces are evaluated afterwards.
  tal_status (*begin)(tal_sim *sim, const tal_scene_stage *plan, tal_error *err);
  // Before each step: pressure and wall velocities of the step.
  void (*before_step)(tal_sim *sim, const tal_scene_stage *plan);
  // Whether after_step is going to look at the forces of the step that ends at run.time. NULL: only where `steps` are
  // done; a stage that does not know its steps beforehand has to say, for the last look is at its end.
  bool (*looks)(const tal_sim *sim, const tal_scene_stage *plan);
  // After each step (and once after begin): sets run.stage_done, or fails with what was reached.
  tal_status (*after_step)(tal_sim *sim, const tal_scene_stage *plan, tal_error *err);
  // What the stage asks of a minimal boundary at run.time, into a zeroed target; NULL: it knows none.
  void (*target)(const tal_sim *sim, const tal_scene_stage *plan, tal_boundary_target *target);
};

const tal_stage *tal_stage_find(const char *name);

extern const tal_stage tal_stage_free, tal_stage_confine, tal_stage_compress, tal_stage_shear, tal_stage_deform,
    tal_stage_spin;

#endif
