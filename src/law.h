// The contact law: one pure function of one meeting for grain-grain, grain-wall and grain-plate, assembled from the
// normal and tangential laws that the effect mask names. Also the registries of both kinds of law.
#ifndef TAL_LAW_H
#define TAL_LAW_H

#include "law_hertz.h"
#include "law_linear.h"
#include "law_regularised.h"
#include "law_spring.h"
#include "registry.h"

// What a law sees of one contact. Approach and slip are speeds of i against j [m/s].
typedef struct tal_meeting {
  double overlap;                  // [m] touching when positive
  double approach;                 // [m/s] growth rate of the overlap
  double slip;                     // [m/s] along t
  double slip_distance;            // [m] along t over this step (spring law)
  double stiffness;                // slot's
  double damping;                  // slot's
  double friction;                 // slot's
  double spring, spring_stiffness; // slot's history
} tal_meeting;

// Scene-wide numbers of the laws.
typedef struct tal_law_constants {
  double inverse_vR;       // [s/m]
  double inverse_exponent; // 1/c
  double tangential_ratio; // k_t / k_n
} tal_law_constants;

typedef struct tal_law_force {
  double fe, fd, ft;       // [N] as in contacts.h
  double cap;              // [N] friction times normal force, bound of |ft|
  double spring_stiffness; // [N/m] tangential stiffness now
} tal_law_force;

// Without TAL_EFFECT_REGULARISED in the mask that law's force is left out: for loops that add it when all caps are
// known.
TAL_KERNEL tal_law_force tal_contact_law(tal_meeting m, tal_law_constants k, unsigned effects) {
  double touching = m.overlap > 0 ? m.overlap : 0;
  double root = effects & TAL_EFFECT_HERTZ ? sqrt(touching) : 1;
  double fe = effects & TAL_EFFECT_HERTZ ? tal_hertz_elastic(m.stiffness, touching, root)
                                         : tal_linear_elastic(m.stiffness, touching);
  double fn = fe;
  if (effects & TAL_EFFECT_DAMPING) {
    double fv = effects & TAL_EFFECT_HERTZ ? tal_hertz_viscous(m.damping, root, m.approach)
                                           : tal_linear_viscous(m.damping, m.approach);
    double sum = fe + fv;
    fn = sum > 0 ? sum : 0;
    if (!(effects & TAL_EFFECT_HERTZ)) // Hertz: apart, the root is zero
      fn = m.overlap > 0 ? fn : 0;
  }
  tal_law_force f = {.fe = fe, .fd = fn - fe, .cap = m.friction * fn};
  if (effects & TAL_EFFECT_REGULARISED)
    f.ft = tal_regularised_force(f.cap, tal_root(fabs(m.slip) * k.inverse_vR, k.inverse_exponent), m.slip);
  if (effects & TAL_EFFECT_SPRING) {
    double slope = effects & TAL_EFFECT_HERTZ ? tal_hertz_slope(m.stiffness, root) : (m.overlap > 0 ? m.stiffness : 0);
    f.spring_stiffness = k.tangential_ratio * slope;
    f.ft = tal_spring_force(m.spring, m.spring_stiffness, f.spring_stiffness, m.slip_distance, f.cap);
  }
  return f;
}

// Normal force per speed of approach [N s/m].
TAL_KERNEL double tal_viscosity(tal_meeting m, unsigned effects) {
  double touching = m.overlap > 0 ? m.overlap : 0;
  double viscosity =
      effects & TAL_EFFECT_HERTZ ? tal_hertz_viscous(m.damping, sqrt(touching), 1) : tal_linear_viscous(m.damping, 1);
  return m.overlap > 0 ? viscosity : 0;
}

// Registered laws: name, one-line help, the effects they set.
struct tal_law {
  const char *name;
  const char *help;
  unsigned effects;
};

// NULL when no such law.
const struct tal_law *tal_normal_law_find(const char *name);
const struct tal_law *tal_tangential_law_find(const char *name);

#endif
