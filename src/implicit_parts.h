// What the two halves of the implicit scheme share: implicit.c sweeps, implicit_block.c works out blocks of lanes.
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
} tal_implicit_solve;

// What is done to a block: forces of the last step put on, corrected, or all friction times a factor added.
typedef enum tal_implicit_pass { TAL_IMPLICIT_BEGIN, TAL_IMPLICIT_CORRECT, TAL_IMPLICIT_PRESS } tal_implicit_pass;

// Lanes [start, start + count), whole vectors, at most TAL_IMPLICIT_BLOCK, of one colour. A correction returns the
// largest change of a friction force over its cap, the others 0.
double tal_implicit_take(const tal_implicit_solve *s, tal_implicit_pass pass, size_t start, int count, double factor);
// Work over the kick: each force times the mean of the speeds at both ends. Any lanes.
tal_implicit_works tal_implicit_work(const tal_implicit_solve *s, size_t start, int count);

#endif
