// Head-on impact of two bodies that meet at a given speed: how fast they part and how long they touch, for the normal
// laws of docs/method.md with the force clipped at zero, eqs (60)-(66). The contact is over when the force is zero.
// Hertz: a high-order solution of the motion, as a function of one damping number; linear: closed forms. Knows no
// scene: damping.h does.
#ifndef TAL_IMPACT_H
#define TAL_IMPACT_H

typedef struct tal_impact {
  double restitution; // e: speed after over speed before
  double loss;        // 1 - e, with all its digits where e is near 1
  double duration;    // of the contact, over the law's time scale
} tal_impact;

// Damping number beta = T / (time scale) >= 0, eq (60); 0 is elastic, held below 1e90, where e is 1.3e-150. Relative
// error of all three below 1e-11 (tests/test_impact.c).
tal_impact tal_impact_hertz(double damping_number);
// Time scale [s] of the Hertz law, eq (60): (m^2 / (K^2 v))^(1/5) for stiffness K [N/m^1.5], reduced mass m [kg] and
// impact speed v [m/s].
double tal_impact_hertz_time(double stiffness, double reduced_mass, double speed);
// The damping number that delivers e in (0, 1]: inverse of tal_impact_hertz by root finding; 0 for e = 1, about
// (3/2)^0.4 e^-0.6 as e -> 0 (held below 1e90).
double tal_impact_hertz_number(double restitution);

// Damping ratio zeta = c / (2 sqrt(k m)) >= 0; the time scale is sqrt(m/k); eqs (5) and (66).
tal_impact tal_impact_linear(double damping_ratio);

#endif
