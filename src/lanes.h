// Four doubles at a time, and the turn of four records into four arrays and back. Written with the compilers' generic
// vectors: one instruction per line with AVX, the same bits without.
#ifndef TAL_LANES_H
#define TAL_LANES_H

#include "effects.h"

#include <math.h>
#include <stdint.h>

// Contacts that the implicit scheme takes at a time.
enum { TAL_IMPLICIT_BLOCK = 64 };

typedef double tal_lanes __attribute__((vector_size(32), may_alias));
typedef double tal_lanes_pair __attribute__((vector_size(16), may_alias));
typedef int64_t tal_lanes_bits __attribute__((vector_size(32), may_alias));

// Elements i ... i + 3, i a multiple of four.
#define TAL_LANES_AT(array, i) (*(tal_lanes *)&(array)[i])

// Rows become columns: v[m][k] and v[k][m] change places.
TAL_KERNEL void tal_lanes_turn(tal_lanes v[4]) {
  tal_lanes a = __builtin_shufflevector(v[0], v[1], 0, 4, 2, 6), b = __builtin_shufflevector(v[0], v[1], 1, 5, 3, 7);
  tal_lanes c = __builtin_shufflevector(v[2], v[3], 0, 4, 2, 6), d = __builtin_shufflevector(v[2], v[3], 1, 5, 3, 7);
  v[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  v[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  v[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  v[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

TAL_KERNEL void tal_lanes_root(tal_lanes *x) {
  for (int m = 0; m < 4; m++)
    (*x)[m] = sqrt((*x)[m]);
}

// Squares of speeds as bits, which order like the numbers, NAN above all: of each lane the largest so far.
TAL_KERNEL void tal_lanes_fastest(const tal_lanes *u, const tal_lanes *v, tal_lanes_bits *fastest) {
  const tal_lanes_bits here = (tal_lanes_bits)(*u * *u + *v * *v) & INT64_MAX, faster = here > *fastest;
  *fastest = (here & faster) | (*fastest & ~faster);
}

TAL_KERNEL int64_t tal_lanes_largest(const tal_lanes_bits *lanes) {
  int64_t largest = (*lanes)[0];
  for (int m = 1; m < 4; m++)
    largest = (*lanes)[m] > largest ? (*lanes)[m] : largest;
  return largest;
}

// Four pairs become two columns.
TAL_KERNEL void tal_lanes_turn_pairs(const tal_lanes_pair p[4], tal_lanes v[2]) {
  tal_lanes a = __builtin_shufflevector(p[0], p[2], 0, 1, 2, 3), b = __builtin_shufflevector(p[1], p[3], 0, 1, 2, 3);
  v[0] = __builtin_shufflevector(a, b, 0, 4, 2, 6);
  v[1] = __builtin_shufflevector(a, b, 1, 5, 3, 7);
}

#endif
