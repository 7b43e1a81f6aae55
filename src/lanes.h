// Four doubles at a time: what records of one grain and arrays of many contacts exchange. Plain vector arithmetic, so
// the same bits on any processor.
#ifndef TAL_LANES_H
#define TAL_LANES_H

#include "effects.h"

typedef double tal_v4 __attribute__((vector_size(32)));

// Turns four records of four members into four vectors, one per member, and back.
TAL_KERNEL void tal_transpose4(tal_v4 r[4]) {
  tal_v4 a = __builtin_shufflevector(r[0], r[1], 0, 4, 2, 6), b = __builtin_shufflevector(r[0], r[1], 1, 5, 3, 7);
  tal_v4 c = __builtin_shufflevector(r[2], r[3], 0, 4, 2, 6), d = __builtin_shufflevector(r[2], r[3], 1, 5, 3, 7);
  r[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  r[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  r[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  r[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

#endif
