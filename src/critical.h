// How far a run is from its limits: critical step, quasi-static and size coefficients.
#ifndef TAL_CRITICAL_H
#define TAL_CRITICAL_H

#include "sim.h"

// Largest stable step [s] of the integrator for the graph of contacts as it stands, eq (26): a bound from below
// (element by element, masses shared by stiffness), exact for two grains. INFINITY without contacts.
double tal_critical_step(const tal_sim *sim);
// The same; *grain: id of a grain at the contact that sets it, -1 where no contact does.
double tal_critical_step_where(const tal_sim *sim, int64_t *grain);
// The critical step of one contact of the given tangent stiffness [N/m], damping [N s/m] and reduced mass [kg].
double tal_critical_step_pair(double stiffness, double damping, double reduced_mass);
// phi above which inertia is no longer negligible: chapter 7 of docs/method.md.
#define TAL_QUASISTATIC_LIMIT 1e-3
// phi [P 2.12, 2.B1] for a rate [1/s], a pressure [Pa] and a height [m]; psi = 2R/L.
double tal_quasistatic_coefficient(const tal_sim *sim, double rate, double pressure, double height);
// Largest overlap over the smaller radius (walls: the grain's radius); *grain: who, -1 without contacts.
double tal_largest_overlap(const tal_sim *sim, int64_t *grain);
// What the scene alone says: critical step [s] of the softest contact it can make, INFINITY when it says nothing.
// reduced_mass [kg] of the heaviest two bodies; damped: false for a scheme that solves for the damping.
double tal_critical_step_scene(const tal_scene *scene, const tal_constants *constants, double reduced_mass,
                               bool damped);
// The step [s] above which explicit regularised friction at the force of a confined contact overshoots by more than vR:
// it chatters; eq (27). INFINITY without such friction. Printed, never refused.
double tal_friction_step(const tal_sim *sim, double pressure);

#endif
