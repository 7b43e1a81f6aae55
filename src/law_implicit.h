// Friction of one contact solved at the velocity it leaves behind, eqs (50)-(52) of docs/method.md: the force of a step
// is the law's force at the slip that this very force brings about. Both laws are monotone, so there is one root.
#ifndef TAL_LAW_IMPLICIT_H
#define TAL_LAW_IMPLICIT_H

#include "effects.h"
#include <math.h>

// Regularised law: the root u in [0, inf) of u^c + b u = a, a >= 0, b >= 0, c >= 1; u is |ft| / (mu fn), a the slip
// over vR that friction has to brake, b the slip over vR that mu fn takes away in a step. The left side is convex and
// grows: Newton's iteration from the right of the root never leaves that side, and the smaller of the two bounds a/b
// (sticks: friction takes all) and a^(1/c) (slides: friction takes next to nothing) is at most a factor 2 in u^c + b u
// away.
TAL_KERNEL double tal_implicit_share(double a, double b, double c) {
  if (!(a > 0))
    return 0;
  double u = a / b;
  if (!(u < 1) || pow(u, c) > a)
    u = fmin(u, pow(a, 1 / c));
  for (int k = 0; k < 60; k++) {
    double slope = pow(u, c - 1);
    double step = (u * slope + b * u - a) / (c * slope + b);
    u -= step;
    if (!(step > 1e-15 * u))
      break;
  }
  return u > 0 ? u : 0;
}

// Spring law: the force at this instant is the mean (1, 2, 1)/4 of the spring's at the last, this and the next instant,
// the last of which depends on the force: q - k dt (s - before)/4 with s = free + compliance dt ft, cut at the cap.
// q: spring force at this instant [N]; k_dt = kt dt [N s/m]; compliance_dt [m/(s N)] slip per force.
TAL_KERNEL double tal_implicit_spring(double q, double k_dt, double free, double before, double compliance_dt,
                                      double cap) {
  double trial = (q - 0.25 * k_dt * (free - before)) / (1 + 0.25 * k_dt * compliance_dt);
  double above = trial > cap ? cap : trial;
  return above < -cap ? -cap : above;
}

#endif
