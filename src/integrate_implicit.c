// Velocity Verlet whose friction and normal damping are solved at velocity level (implicit.h), eqs (50)-(56): the
// forces at an instant answer to the velocities that the whole kick they belong to leaves behind, at the geometry of
// that instant. What forces explicit steps to be small is the slope of the regularised law near rest, infinite at zero
// slip, and then the damping; here a contact that sticks is held by one solve, and the step is limited by normal
// stiffness alone (26). Second order where friction does not slide, first order where it does; at rest exact for any
// step: the slip is the law's own creep. The spring law enters by the mean of its force over three instants, second
// order.
#include "integrate.h"

#include "effects.h"
#include "implicit.h"
#include "walls_load.h"

static void advance(tal_sim *sim) {
  if (!(sim->effects & TAL_EFFECT_IMPLICIT)) { // nothing to solve
    tal_integrate_verlet_step(sim);
    return;
  }
  if (sim->effects & TAL_EFFECT_WALLS)
    tal_walls_drift(sim);
  tal_integrate_drift(sim, sim->dt);
  tal_implicit_step(sim, tal_integrate_credit(sim));
  tal_integrate_end(sim);
}

const tal_integrator tal_implicit_friction = {
    .name = "implicit_friction",
    .help = "velocity Verlet, friction and damping solved for the velocities they leave behind",
    .implicit = true,
    .advance = advance};
