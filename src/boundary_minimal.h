// Minimal boundary conditions [P 3.2]: no plates; the mean velocity gradient of the loop is imposed component by
// component, what is not imposed is left to the stress on the loop. For the stages that use them (compress, shear,
// deform) and for those who report.
#ifndef TAL_BOUNDARY_MINIMAL_H
#define TAL_BOUNDARY_MINIMAL_H

#include "sim.h"

// What a stage asks of the loop at run.time.
typedef struct tal_boundary_target {
  bool held[TAL_COMPONENTS]; // imposed: xx, yy, shear (xy + yx), spin (yx - xy)
  geo_tensor gradient;       // [1/s] the imposed components of L = dv_a/dx_b
  geo_tensor stress;         // [Pa] on the loop, symmetric, compression positive; correcting forces come on top
} tal_boundary_target;

// Sets the stage up: plates go, the loop is pressed all round.
tal_status tal_minimal_begin(tal_sim *sim, const tal_scene_stage *plan, tal_error *err);
// Adds the strain of the step that is about to be taken.
void tal_minimal_before_step(tal_sim *sim);
// The mean gradient of the coming step less the imposed one, NAN where nothing is imposed: xx, yy, xy [1/s].
geo_tensor tal_minimal_error(const tal_sim *sim);
// Decay rate [1/s] of an error of the strain rate per unit of the penalty constant K [N m s], for the loop as it is:
// the largest eigenvalue of (88).
double tal_minimal_decay(const tal_rows *rows, const bool held[TAL_COMPONENTS], const double *inverse_mass,
                         const geo_loop *loop);
// The same for a stage of the scene that has not begun, on a fresh graph of the grains as they are; NAN without one.
double tal_minimal_decay_planned(tal_sim *sim, const tal_scene_stage *plan);
// Largest K [N m s] that the step `dt` [s] bears beside contacts whose critical step is `critical` [s], (89).
double tal_minimal_penalty_limit(double decay, double dt, double critical);

#endif
