// How much a contact is damped: from material.damping, contact.damping or contact.restitution, eqs (1), (4), (64).
// With `restitution` each contact gets the damping that its own stiffness and reduced mass need, so that every pair
// delivers e: at any speed for the linear law, at restitution_speed for Hertz.
#ifndef TAL_DAMPING_H
#define TAL_DAMPING_H

#include "impact.h"
#include "sim.h"

// The number that contact.restitution asks for: beta of eq (60) for Hertz, zeta of eq (5) for linear; NAN where damping
// is given as such. A root search: once per scene.
double tal_damping_number(const tal_scene *scene);
// Is any contact of this scene damped?
bool tal_damping_any(const tal_scene *scene);
// Damping of a contact of stiffness K or k and reduced mass [kg] (0: neither body moves): T K [N s/m^1.5] for Hertz, c
// [N s/m] for linear.
double tal_damping_coefficient(const tal_scene *scene, const tal_constants *constants, double stiffness,
                               double reduced_mass);

// The one damping over stiffness [s] of all slots; NAN where each has its own.
double tal_damping_time_of_slots(const tal_sim *sim);
// Damping of one slot: its own where the list keeps one.
double tal_damping_of_slot(const tal_sim *sim, const tal_contacts *slots, size_t c);

// A contact as the impact toolbox sees it.
typedef struct tal_pair {
  double stiffness;    // K [N/m^1.5] or k [N/m]
  double reduced_mass; // [kg]
  double damping;      // T [s] or c [N s/m]
} tal_pair;

// Two grains of mean radius and mean mass.
tal_pair tal_damping_mean_pair(const tal_scene *scene, const tal_constants *constants);
// Time scale [s] of an impact at `speed` [m/s] and its damping number (beta or zeta).
double tal_damping_time(const tal_scene *scene, const tal_pair *pair, double speed);
double tal_damping_number_at(const tal_scene *scene, const tal_pair *pair, double speed);
// The impact at `speed`, its duration in s.
tal_impact tal_damping_impact(const tal_scene *scene, const tal_pair *pair, double speed);

#endif
