// Friction as a viscous regularisation of Coulomb's law, eq (6) of docs/method.md [P 2.18]:
// ft = mu fn (|s|/vR)^(1/c), against the slip s; fn is the full normal force.
#ifndef TAL_LAW_REGULARISED_H
#define TAL_LAW_REGULARISED_H

#include "root.h"
#include <math.h>

// cap = friction * normal [N]; root = (|slip| / vR)^(1/c); slip with sign. Returns the force on i along t [N].
TAL_KERNEL double tal_regularised_force(double cap, double root, double slip) {
  return copysign(cap * root, -slip);
}

#endif
