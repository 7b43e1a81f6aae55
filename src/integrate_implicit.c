// Velocity Verlet whose friction is solved at velocity level (friction.h), eqs (50)-(55): the force at an instant
// answers to the slip of the whole kick it belongs to, v_half + dt (F + friction)/m, at the geometry and normal force
// of that instant. What forces explicit steps to be small is the slope of the regularised law near rest, infinite at
// zero slip; here a contact that sticks is held by one solve, and the step is limited by normal stiffness and damping
// alone (26). Second order where friction does not act, first order where it slides; at rest exact for any step: the
// slip is the law's own creep. The spring law enters by the mean of its force over three instants, second order.
#include "integrate.h"

#include "effects.h"
#include "forces.h"
#include "friction.h"
#include "walls_load.h"

static void advance(tal_sim *sim) {
  tal_integrate_drift(sim, sim->dt);
  tal_forces_sweep(sim, sim->dt);
  if (sim->effects & TAL_EFFECT_IMPLICIT)
    tal_friction_solve(sim, sim->dt, true);
  tal_forces_finish_step(sim, sim->dt, tal_integrate_credit(sim));
  if (sim->effects & TAL_EFFECT_WALLS)
    tal_walls_take_loads(sim, sim->dt);
}

const tal_integrator tal_implicit_friction = {.name = "implicit_friction",
                                              .help = "velocity Verlet, friction solved for the slip it leaves behind",
                                              .implicit = true,
                                              .advance = advance};
