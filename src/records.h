// What the hot loop reads and writes, packed to one cache line per grain and per contact: a contact fetches two lines
// instead of a dozen, a grain sums one line per contact. Rebuilt every step, kept by nobody.
#ifndef TAL_RECORDS_H
#define TAL_RECORDS_H

// One grain as the contact laws see it.
typedef struct tal_grain_record {
  double x, y;   // [m] centre
  double r;      // [m] radius
  double ux, uy; // [m/s] velocity for damping and regularised friction: predicted for the instant of x, y
  double spin;   // [rad/s] the same; for the spring law in the middle of the step
  double hx, hy; // [m/s] velocity in the middle of the step: it moves the tangential springs
} __attribute__((aligned(64))) tal_grain_record;

// Forces of one contact on its grain i; on j the vectors change sign.
typedef struct tal_force_record {
  double elastic_x, elastic_y;   // [N] elastic normal force
  double viscous_x, viscous_y;   // [N] the rest of the normal force
  double friction_x, friction_y; // [N] tangential force
  double ft;                     // [N] tangential force along t
  double ft_half_overlap;        // [N m] ft d/2: the torque on either grain is ft d/2 - ft r
} __attribute__((aligned(64))) tal_force_record;

#endif
