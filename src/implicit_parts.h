// What the parts of the implicit scheme share: implicit.c solves, implicit_passes.c goes
// over the tiles, implicit_block.c works out blocks of lanes.
#ifndef TAL_IMPLICIT_PARTS_H
#define TAL_IMPLICIT_PARTS_H

#include "sim.h"

// Constants of a solve.
typedef struct tal_implicit_solve {
  tal_sim *sim;
  tal_implicit *system;
  double kick, inverse_vR, exponent, tangential_ratio;
  unsigned effects;
  bool advances;
  bool looks; // at changes of friction forces
} tal_implicit_solve;

// What is done to a tile: velocities before the kick set; forces of the last step put on; corrected; works added up and
// what the next step starts from kept; all friction times a factor added.
typedef enum tal_implicit_pass {
  TAL_IMPLICIT_SET,
  TAL_IMPLICIT_BEGIN,
  TAL_IMPLICIT_CORRECT,
  TAL_IMPLICIT_WORK,
  TAL_IMPLICIT_PRESS
} tal_implicit_pass;

// The passes over all tiles, one after the other in effect; works and changes are left in the tiles.
void tal_implicit_passes(const tal_implicit_solve *s, const tal_implicit_pass *pass, int count, double factor);

// Lanes [start, start + count), whole vectors, at most TAL_IMPLICIT_BLOCK, of one colour. A correction returns the
// largest change of a friction force over its cap where the solve looks at it, else 0.
double tal_implicit_take(const tal_implicit_solve *s, tal_implicit_pass pass, size_t start, int count, double factor);
// Work over the kick: each force times the mean of the speeds at both ends. Keeps the forces for the next step. Any
// lanes.
tal_implicit_works tal_implicit_work(const tal_implicit_solve *s, size_t start, int count);

#endif
