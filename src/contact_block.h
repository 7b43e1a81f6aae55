// Contacts in blocks: the records of two grains in, the forces of a block of slots out, one array per member. The
// contact law (law.h) is instantiated here.
#ifndef TAL_CONTACT_BLOCK_H
#define TAL_CONTACT_BLOCK_H

#include "lanes.h"
#include "law.h"
#include "sim.h"

// Slots taken at a time.
enum { TAL_BLOCK = 64 };

// What a block of contacts answers with; of friction and damping only where the law has them.
typedef struct tal_force_block {
  double x[TAL_BLOCK], y[TAL_BLOCK];             // normal into i
  double elastic[TAL_BLOCK], viscous[TAL_BLOCK]; // [N] along the normal: elastic force, the rest
  double friction[TAL_BLOCK];                    // [N] along t = (-y, x)
  double half_overlap[TAL_BLOCK];                // [m]
} __attribute__((aligned(64))) tal_force_block;

// A force record as two vectors.
typedef struct tal_force_halves {
  tal_lanes first, second;
} tal_force_halves;

// What one sweep over the slots has in common.
typedef struct tal_sweep {
  double dt;    // [s] moves the tangential springs; 0: none
  bool moves;   // histories are written
  bool drifts;  // grains drift by dt before their contacts are worked out; else they have
  unsigned law; // effects that the law looks at
  double friction;
  double damping_time; // [s] damping over stiffness; NAN: each slot its own damping
  tal_law_constants constants;
} tal_sweep;

static inline void *tal_at(const void *first, uint32_t bytes) {
  return (char *)(uintptr_t)first + bytes;
}

tal_sweep tal_sweep_of(const tal_sim *sim, double dt);
// Forces of the grain-grain slots [start, start + count), 0 < count <= TAL_BLOCK, from the records at their seats,
// which are read in whole fours.
void tal_contact_block(tal_sim *sim, const tal_sweep *sweep, const tal_grain_record *record, const tal_seat *at,
                       size_t start, int count, tal_force_block *out);

// Slip speed of i against j along t = (-ny, nx) with the lever arms r - d/2, eq (9): speeds is r_i w_i + r_j w_j, spins
// is w_i + w_j.
TAL_KERNEL double tal_slip_speed(double nx, double ny, double ux, double uy, double half_overlap, double speeds,
                                 double spins, unsigned effects) {
  double slip = nx * uy - ny * ux;
  if (effects & TAL_EFFECT_SPIN)
    slip -= speeds - half_overlap * spins;
  return slip;
}

// The records of slots k ... k + 3, two vectors of four members each; what the effects leave out is zero.
TAL_KERNEL void tal_force_block_turn(const tal_force_block *b, int k, tal_lanes first[4], tal_lanes second[4],
                                     unsigned effects) {
  const tal_lanes x = *(const tal_lanes *)&b->x[k], y = *(const tal_lanes *)&b->y[k];
  const tal_lanes fe = *(const tal_lanes *)&b->elastic[k];
  for (int m = 0; m < 4; m++)
    first[m] = second[m] = (tal_lanes){0};
  first[0] = fe * x;
  first[1] = fe * y;
  if (effects & TAL_EFFECT_DAMPING) {
    const tal_lanes fd = *(const tal_lanes *)&b->viscous[k];
    first[2] = fd * x;
    first[3] = fd * y;
  }
  if (effects & TAL_EFFECT_FRICTION) {
    const tal_lanes ft = *(const tal_lanes *)&b->friction[k];
    second[0] = -ft * y;
    second[1] = ft * x;
    second[2] = ft;
    second[3] = ft * *(const tal_lanes *)&b->half_overlap[k];
  }
  tal_lanes_turn(first);
  tal_lanes_turn(second);
}

#endif
