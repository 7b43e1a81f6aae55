// Friction as an incremental tangential spring with a Coulomb cap, eqs (7)-(8) of docs/method.md [H 2.17-2.20].
// Where the stiffness falls (Hertz, unloading) the stored force falls with it, where it rises the force stays: the
// stored energy ft^2 / (2 kt) then never grows by a change of stiffness. While it rises, slip is met by the mean of the
// stiffnesses before and now: the one of now alone would make the law of first order in dt.
#ifndef TAL_LAW_SPRING_H
#define TAL_LAW_SPRING_H

#include "effects.h"

// before, stiffness_before: force on i along t [N] and tangential stiffness [N/m] after the last step; slip distance of
// this step [m]; cap = mu fn >= 0 [N]. Returns the force now.
TAL_KERNEL double tal_spring_force(double before, double stiffness_before, double stiffness, double slip_distance,
                                   double cap) {
  double kept = stiffness < stiffness_before ? before * (stiffness / stiffness_before) : before;
  int rises = stiffness_before > 0 && stiffness > stiffness_before; // a new contact knows no stiffness before
  double along = rises ? 0.5 * (stiffness_before + stiffness) : stiffness;
  double trial = kept - along * slip_distance;
  double above = trial > cap ? cap : trial;
  return above < -cap ? -cap : above;
}

#endif
