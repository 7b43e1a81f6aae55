// Friction of one contact solved at the velocity it leaves behind, eqs (50)-(52) of docs/method.md: the force of a step
// is the law's force at the slip that this very force brings about. Both laws are monotone, so there is one root.
#ifndef TAL_LAW_IMPLICIT_H
#define TAL_LAW_IMPLICIT_H

#include "root.h"
#include <math.h>

// One round of Halley's iteration for u^c + b u = a.
TAL_KERNEL double tal_implicit_round(double u, double a, double b, double c) {
  double power = tal_power(u, c - 1);
  double excess = u * power + b * u - a, slope = c * power + b, bend = c * (c - 1) * power / u;
  return u - 2 * excess * slope / (2 * slope * slope - excess * bend);
}

// Regularised law: the root u of u^c + b u = a; u is |ft| / (mu fn), a >= 0 the slip over vR that friction has to
// brake, b >= 0 the slip over vR that mu fn takes away in the kick, c >= 1. The left side is convex and grows, and the
// smaller of the bounds a/b (it sticks: friction takes all) and a^(1/c) (it slides: friction takes next to nothing) is
// at most a factor 2 of it away: from there Halley's iteration has reached round-off after four rounds for c up to 50,
// 1e-12 of u for c = 200 (tests/test_implicit_friction.c). No branches, so that it vectorises and gives the same bits
// everywhere.
TAL_KERNEL double tal_implicit_share(double a, double b, double c, double inverse_c) {
  double slip = a > 1e-280 ? a : 1e-280, stuck = slip / (b > 1e-280 ? b : 1e-280);
  double slides = tal_power(slip, inverse_c);
  double u = stuck < slides ? stuck : slides;
  u = tal_implicit_round(u, a, b, c); // written out: a loop in the body keeps the loop around it from vectorising
  u = tal_implicit_round(u, a, b, c);
  u = tal_implicit_round(u, a, b, c);
  u = tal_implicit_round(u, a, b, c);
  return a > 1e-280 ? u : 0;
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
