// The simulation: owns every part of a run. One step is in step.c; what a run is asked to do is in stage_*.c.
#ifndef TAL_SIM_H
#define TAL_SIM_H

#include "boundary_rows.h"
#include "contacts.h"
#include "continuum.h"
#include "grains.h"
#include "implicit.h"
#include "membrane.h"
#include "neighbours.h"
#include "pack.h"
#include "records.h"
#include "scene.h"
#include "walls.h"

// Progress of a run: X(type, name, unit, meaning). All of it is kept in a checkpoint.
#define TAL_RUN_FIELDS(X)                                                                                              \
  X(int64_t, step, "1", "small steps taken since the start")                                                           \
  X(double, time, "s", "simulated time")                                                                               \
  X(int64_t, stage, "1", "index of the current or last stage")                                                         \
  X(int64_t, stage_step, "1", "steps taken in this stage")                                                             \
  X(double, stage_start, "s", "time at which this stage began")                                                        \
  X(int64_t, bedding, "1", "1 while the plates bed the uneven ends of a packing")                                      \
  X(int64_t, settling, "1", "loops under which the assembly has come to rest or shall; 0: not a stage's last part")    \
  X(int64_t, released, "1", "1 while the plates of a confinement are smooth")                                          \
  X(int64_t, stage_begun, "1", "1 once the stage has set itself up")                                                   \
  X(int64_t, force_evaluations, "1", "sweeps over the contacts that drove the motion")                                 \
  X(int64_t, refresh_step, "1", "step of the last refresh of the graph")                                               \
  X(double, refresh_strain, "1", "axial strain at the last refresh")                                                   \
  X(double, refresh_area, "m^2", "area of the loop just after the last refresh")                                       \
  X(int64_t, strain_begun, "1", "1 once the first compress has begun")                                                 \
  X(double, log_volume, "1", "log of the area ratio over the finished refresh intervals since the first compress")     \
  X(double, height0, "m", "distance of the plates when the first compress began")                                      \
  X(double, axial_strain, "1", "engineering axial strain, compression positive")                                       \
  X(double, shear_strain, "1", "time integral of L_xy + L_yx of the loop under minimal boundaries")                    \
  X(double, axial_start, "1", "axial strain when this stage began")                                                    \
  X(double, gradient_xx, "1/s", "mean velocity gradient of the loop in the coming step (minimal boundaries)")          \
  X(double, gradient_xy, "1/s", "mean velocity gradient of the loop in the coming step")                               \
  X(double, gradient_yx, "1/s", "mean velocity gradient of the loop in the coming step")                               \
  X(double, gradient_yy, "1/s", "mean velocity gradient of the loop in the coming step")                               \
  X(double, penalty, "N m s", "penalty constant of minimal boundaries")                                                \
  X(double, correcting_power, "W", "power of the forces that correct the mean velocity gradient")                      \
  X(double, correcting_work, "J", "work of the forces that correct the mean velocity gradient")                        \
  X(int64_t, unsolvable, "1", "1 when the mean velocity gradient could not be imposed")                                \
  X(double, membrane_pressure_power, "W", "of the pressure on the membrane's links")                                   \
  X(double, membrane_pressure_work, "J", "of the pressure on the membrane's links")                                    \
  X(double, membrane_ends_power, "W", "of the plates on the membrane's ends")                                          \
  X(double, membrane_ends_work, "J", "of the plates on the membrane's ends")                                           \
  X(double, membrane_grains_power, "W", "of the membrane on the grains")                                               \
  X(double, membrane_grains_work, "J", "of the membrane on the grains")                                                \
  X(double, membrane_lost_power, "W", "lost in the membrane and its contacts to viscosity")                            \
  X(double, membrane_lost_work, "J", "lost in the membrane and its contacts to viscosity")                             \
  X(double, membrane_brought, "J", "energy of membranes laid, less that of membranes taken away")                      \
  X(int64_t, outside_most, "1", "most grains outside the loop since the first boundary acted")                         \
  X(double, refresh_shear, "1", "shear strain at the last refresh")                                                    \
  X(double, pressure, "Pa", "pressure applied now on the loop")                                                        \
  X(double, impulse_time, "s", "start of the window over which mean forces are taken")                                 \
  X(int64_t, arc_bottom_left, "1", "place on the loop where the left arc ends")                                        \
  X(int64_t, arc_bottom_right, "1", "place on the loop where the right arc begins")                                    \
  X(int64_t, arc_top_right, "1", "place on the loop where the right arc ends")                                         \
  X(int64_t, arc_top_left, "1", "place on the loop where the left arc begins")                                         \
  X(double, rest, "1", "mean unbalanced force over mean contact force, averaged over the last window")                 \
  X(int64_t, forced, "1", "1 + index of the grain whose spin is imposed; 0: none")                                     \
  X(int64_t, stage_done, "1", "1 once the current stage has reached its end")                                          \
  X(double, friction_work, "J", "work on grains by tangential contact forces")                                         \
  X(double, damping_work, "J", "work on grains by the viscous part of normal contact forces")                          \
  X(double, boundary_work, "J", "work on grains by boundary forces")                                                   \
  X(double, held_work, "J", "work by what holds fixed grains and held spins")                                          \
  X(double, kinetic0, "J", "kinetic energy at the start")                                                              \
  X(double, elastic0, "J", "elastic energy at the start")                                                              \
  X(double, gravity0, "J", "potential energy of gravity at the start")

typedef struct tal_run {
#define X(type, name, unit, meaning) type name;
  TAL_RUN_FIELDS(X)
#undef X
} tal_run;

// One line of series.csv: X(name, unit, meaning); `step` and `stage` are written as whole numbers.
#define TAL_SERIES_FIELDS(X)                                                                                           \
  X(time, "s", "simulated time")                                                                                       \
  X(step, "", "small steps since the start")                                                                           \
  X(stage, "", "index of the stage, from 0")                                                                           \
  X(axial_strain, "", "engineering, compression positive")                                                             \
  X(volumetric_strain, "", "engineering, dilation positive, zero until the first compress")                            \
  X(sigma_xx, "Pa", "stress of the assembly from contacts, compression positive")                                      \
  X(sigma_yy, "Pa", "stress of the assembly from contacts")                                                            \
  X(sigma_xy, "Pa", "stress of the assembly from contacts, symmetrised")                                               \
  X(sigma_xx_boundary, "Pa", "the same from boundary forces")                                                          \
  X(sigma_yy_boundary, "Pa", "the same from boundary forces")                                                          \
  X(sigma_xy_boundary, "Pa", "the same from boundary forces, symmetrised")                                             \
  X(sigma_xx_inertia, "Pa", "inertia part: sigma = boundary + inertia")                                                \
  X(sigma_yy_inertia, "Pa", "inertia part")                                                                            \
  X(sigma_xy_inertia, "Pa", "inertia part, symmetrised")                                                               \
  X(stress_ratio, "", "sigma_yy / sigma_xx")                                                                           \
  X(coordination, "", "2 contacts / grains, walls and plates not counted")                                             \
  X(coordination_bearing, "", "the same without rattlers")                                                             \
  X(solid_fraction, "", "grain area inside the loop over its area")                                                    \
  X(fabric_xx, "", "contact fabric, mean of n (x) n")                                                                  \
  X(fabric_xy, "", "contact fabric")                                                                                   \
  X(fabric_yy, "", "contact fabric")                                                                                   \
  X(mean_slip, "", "mean slip speed of touching pairs over vR")                                                        \
  X(unbalanced, "", "mean unbalanced force over mean contact force")                                                   \
  X(shear_strain, "", "integral of L_xy + L_yx under minimal boundaries")                                              \
  X(multiplier_xx, "Pa", "stress by which minimal boundaries correct the imposed strain rate, beside the pressure")    \
  X(multiplier_yy, "Pa", "the same")                                                                                   \
  X(multiplier_xy, "Pa", "the same")                                                                                   \
  X(multiplier_spin, "Pa", "couple that holds the mean spin, as the antisymmetric stress yx - xy it is half of")       \
  X(strain_rate_error_xx, "1/s", "mean velocity gradient that moves the grains less the imposed one, extension +")     \
  X(strain_rate_error_yy, "1/s", "the same")                                                                           \
  X(strain_rate_error_xy, "1/s", "the same, symmetric part")                                                           \
  X(boundary_rank, "", "stress fields beyond the uniform ones that hold the shape (minimal, order > 0)")               \
  X(outside, "", "grains outside the loop")                                                                            \
  X(plate_bottom_shear, "N", "horizontal force of the grains on the bottom plate")                                     \
  X(plate_top_shear, "N", "horizontal force of the grains on the top plate")                                           \
  X(membrane_tension, "N", "largest tension in a link of the membrane")                                                \
  X(plate_bottom, "N", "force of the grains on the bottom plate, compression positive")                                \
  X(plate_top, "N", "force of the grains on the top plate, compression positive")                                      \
  X(kinetic, "J", "kinetic energy")                                                                                    \
  X(elastic, "J", "elastic energy of contacts, tangential springs included")                                           \
  X(gravity, "J", "potential energy of gravity")                                                                       \
  X(work_walls, "J", "work done by plates and walls")                                                                  \
  X(work_pressure, "J", "work done by the pressure on the loop")                                                       \
  X(work_minimal, "J", "work done by the forces that impose the strain rate (minimal)")                                \
  X(work_membrane, "J", "energy that membranes brought when laid, less what they took along")                          \
  X(work_held, "J", "work done by what holds fixed grains and held spins")                                             \
  X(dissipated_friction, "J", "energy lost to friction")                                                               \
  X(dissipated_damping, "J", "energy lost to the viscous normal force")                                                \
  X(energy_residual, "", "what the ledger does not close by, as a share of the total work")                            \
  X(power_contacts, "W", "stress power of the cells")                                                                  \
  X(power_boundary, "W", "power of boundary forces and inertia on the same cells")                                     \
  X(dt_ratio, "", "time step over the critical one")                                                                   \
  X(phi, "", "quasi-static coefficient [P 2.12, 2.B1] from the running state")                                         \
  X(psi, "", "size coefficient 2R/L [P 2.14]")                                                                         \
  X(overlap_max, "", "largest overlap over the smaller radius")

typedef struct tal_row {
#define X(name, unit, meaning) double name;
  TAL_SERIES_FIELDS(X)
#undef X
} tal_row;

typedef struct tal_sim tal_sim;

// A normal or tangential contact law (law.c), an integrator (integrate.c), a boundary (boundary.c), a stage (stage.c).
typedef struct tal_law tal_law;
typedef struct tal_integrator tal_integrator;
typedef struct tal_boundary tal_boundary;
typedef struct tal_hot tal_hot;
typedef struct tal_stage tal_stage;

// Constants derived once from scene and packing.
typedef struct tal_constants {
  double mean_radius;      // [m] of the grains
  double least_radius;     // [m] of the smallest grain
  double mean_mass;        // [kg] scaling included
  double thickness;        // [m]
  double vR;               // [m/s] NAN when no law needs it and no stage gives it
  double modulus;          // [Pa] young / (1 - poisson^2) of the grains
  double skin;             // [m]
  double tangential_ratio; // k_t / k_n of the spring law
  // what contact.restitution asks for: beta or zeta of eqs (60), (5), NAN without it; [m/s] where Hertz delivers it
  double damping_number, restitution_speed;
} tal_constants;

struct tal_sim {
  const tal_scene *scene; // borrowed
  const tal_hot *hot;     // the hot loops for this processor
  tal_constants constants;
  tal_grains grains;
  tal_contacts pairs;         // grain-grain slots
  tal_contacts wall_contacts; // grain-wall slots
  tal_walls walls;
  tal_grain_record *grain_records; // owned; [grains] what the contact laws see, where someone looks
  tal_force_record *force_records; // owned; [force_capacity] what they answer, per slot, where it is kept
  tal_force_record *sums;          // owned; [ring_capacity] rings of the hot loop, zero between steps
  tal_grain_record *rings;         // owned; [2 ring_capacity] rings of the hot loop
  tal_kick_powers *powers;         // owned; [grains / TAL_KICK_GRAINS + 1] of this step
  unsigned char *pressed;          // owned; [as powers] 0: the boundary acts on none of these grains
  size_t force_capacity, ring_capacity;
  bool forces_kept; // the force records are those of the last step or sweep
  tal_neighbours neighbours;
  tal_implicit implicit; // scratch of friction and damping solved implicitly
  tal_graph graph;
  tal_membrane membrane;
  tal_rows rows; // of a minimal boundary
  tal_run run;
  const tal_stage *stage;       // descriptor of the current stage, NULL when all are done
  const tal_boundary *boundary; // what presses the loop now, NULL: nothing
  bool boundary_moved;          // the boundary acts on other grains than at the last evaluation
  double (*loop_centre)[2];     // owned; [loop_capacity] centres of the loop's grains that a boundary presses at [m]
  size_t loop_capacity;
  double friction;    // [-] of grain-grain contacts now (a stage may change it)
  double dt;          // [s] of the step being taken; between two steps: of the coming one
  double dt_next;     // [s] of the step after the one being taken
  double next_stride; // [m] no grain will move further than this in the coming step; NAN: not known
  unsigned effects;   // mask of effects.h that the hot loop pays for
  bool watched;       // as tal_sim_watch left it
  bool remembers;     // what the laws saw last is in ux, uy, spin of the grains
  double packing_solid_fraction, packing_coordination, packing_overlap; // report of the packer
};

// Packs the scene and computes the first forces. *sim is NULL on failure.
tal_status tal_sim_create(tal_sim **sim, const tal_scene *scene, tal_error *err);
void tal_sim_free(tal_sim *sim);
// One time step (and, where due, the stage's refresh of the graph). TAL_INVALID with the reason when the run went bad.
tal_status tal_sim_step(tal_sim *sim, tal_error *err);
// Whether somebody is going to look at the forces that drive the motion after the coming steps: true at first. Steps
// that nobody looks at remember less and cost less; where the driving forces are asked for all the same, the program
// aborts.
void tal_sim_watch(tal_sim *sim, bool watched);
// True when every stage is finished.
bool tal_sim_done(const tal_sim *sim);
// The forces that drive the motion at this instant, as the last step left them in the slots: sums into rx, ry, rtorque.
// What series and fields look at. Where explicit friction chatters these balance the boundary forces in the mean;
// forces read again with the corrected velocities do not (method.md, chapter 4).
tal_observed tal_sim_driving(tal_sim *sim);
// Forces of this instant read again with this instant's velocities, into slots and rx, ry, rtorque; changes nothing
// that the motion sees. What tracks look at. Equal to the driving forces up to the order of the integrator.
tal_observed tal_sim_observe(tal_sim *sim);
// The series line of this instant, from the driving forces.
void tal_sim_row(tal_sim *sim, tal_row *row);
// After STATE fields, graph and run were put back: everything that follows from them.
void tal_sim_restored(tal_sim *sim);
// The stage being run or just finished; NULL for a scene without stages.
const tal_scene_stage *tal_sim_stage(const tal_sim *sim);

#endif
