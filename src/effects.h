// The effects a run pays for, as a bit mask. A bit is set only when the scene calls for the effect; kernels take the
// mask as a constant where a variant is listed (contact_block.c, kick.c) and as a run-time value otherwise, with the
// same bits.
#ifndef TAL_EFFECTS_H
#define TAL_EFFECTS_H

enum tal_effect {
  TAL_EFFECT_HERTZ = 1,       // normal force K d^1.5, else k d
  TAL_EFFECT_DAMPING = 2,     // viscous part of the normal force
  TAL_EFFECT_REGULARISED = 4, // friction, viscous regularisation of Coulomb's law
  TAL_EFFECT_SPRING = 8,      // friction, incremental spring with Coulomb cap
  TAL_EFFECT_SPIN = 16,       // grains turn
  TAL_EFFECT_GRAVITY = 32,    // body force
  TAL_EFFECT_BOUNDARY = 64,   // forces of a boundary on grains (pressure)
  TAL_EFFECT_WALLS = 128,     // walls and plates
  TAL_EFFECT_HELD = 256,      // fixed grains or held spins whose holders do work
  TAL_EFFECT_IMPLICIT = 512   // friction and damping are solved together (implicit.h)
};

#define TAL_EFFECT_FRICTION (TAL_EFFECT_REGULARISED | TAL_EFFECT_SPRING)
// What the contact law itself looks at.
#define TAL_EFFECT_LAW                                                                                                 \
  (TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING | TAL_EFFECT_REGULARISED | TAL_EFFECT_SPRING | TAL_EFFECT_SPIN)

// A pure function that must vanish into the loop that calls it.
#define TAL_KERNEL static inline __attribute__((always_inline))
// Stands in a loop that is better left scalar.
#define TAL_SCALAR_LOOP __asm__ volatile("")

#endif
