// The drift of a handful of grains, and what the contact laws see of them afterwards.
#ifndef TAL_DRIFT_H
#define TAL_DRIFT_H

#include "root.h"
#include "sim.h"

// Grains drifted at a time.
enum { TAL_DRIFT_GRAINS = 64 };

// First half kick, drift, prediction of the grains [start, start + count), count <= TAL_DRIFT_GRAINS, by dt [s], eqs
// (12)-(14), and their records where `record` is not NULL. Without records returns the square of the largest speed
// [m^2/s^2] as bits, which order like the numbers, NAN above all; else 0: who asks for records has it from the kick.
// Where sim->remembers, what the laws are going to see is left in ux, uy, spin too. Here and below start is a multiple
// of four, and records are written up to the next multiple of four.
int64_t tal_drift_group(tal_sim *sim, size_t start, int count, double dt, tal_grain_record *record);
// What no grain moves further than [m] when that is the largest: what rounds off on the way is less.
static inline double tal_drift_stride(double dt, int64_t fastest) {
  return (1 + 1e-9) * dt * sqrt(tal_double((uint64_t)fastest));
}

// Records of drifted grains, record[0] that of grain `start`. hx, hy are the velocities as they stand: those of the
// middle of the step until the kick, later of no use but to an observer, who moves no spring.
void tal_drift_records(const tal_sim *sim, size_t start, int count, tal_grain_record *record);
// The same of grains that have not drifted yet and stay where they are.
void tal_drift_foresee(const tal_sim *sim, size_t start, int count, double dt, tal_grain_record *record);

#endif
