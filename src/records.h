// What the hot loop reads and writes, packed to one cache line per grain: a contact fetches two lines instead of a
// dozen. The first half of a grain record is subtracted from its partner's; of the second half the first pair too, the
// last pair is added. Records of grains live in rings while a step passes over them (forces_range.c), and where someone
// looks.
#ifndef TAL_RECORDS_H
#define TAL_RECORDS_H

#include <stddef.h>
#include <stdint.h>

// One grain as the contact laws see it.
typedef struct tal_grain_record {
  double x, y;   // [m] centre
  double ux, uy; // [m/s] velocity for damping and regularised friction: predicted for the instant of x, y
  double hx, hy; // [m/s] velocity in the middle of the step: it moves the tangential springs
  double spin;   // [rad/s] as ux, uy; for the spring law in the middle of the step
  double r_spin; // [m/s] radius times spin
} __attribute__((aligned(64))) tal_grain_record;

// Forces of one contact on its grain i (on j the vectors change sign), or sums of them over the contacts of a grain.
typedef struct tal_force_record {
  double elastic_x, elastic_y;   // [N] elastic normal force
  double viscous_x, viscous_y;   // [N] the rest of the normal force
  double friction_x, friction_y; // [N] tangential force
  double ft;                     // [N] tangential force along t
  double ft_half_overlap;        // [N m] ft d/2: the torque on either grain is ft d/2 - ft r
} __attribute__((aligned(64))) tal_force_record;

// Where two grains that meet have their records, and in a ring of sums their sums.
typedef struct tal_seat {
  uint32_t i, j; // [bytes] from the first
} tal_seat;

static inline tal_seat tal_seat_of(size_t i, size_t j) {
  return (tal_seat){(uint32_t)(i * sizeof(tal_grain_record)), (uint32_t)(j * sizeof(tal_grain_record))};
}

// Powers of forces on the grains of one kick [W].
typedef struct tal_kick_powers {
  double friction, damping, boundary, held;
} tal_kick_powers;

#endif
