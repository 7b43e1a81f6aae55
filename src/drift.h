// The drift of a handful of grains.
#ifndef TAL_DRIFT_H
#define TAL_DRIFT_H

#include "sim.h"

// Grains drifted at a time.
enum { TAL_DRIFT_GRAINS = 64 };

// First half kick, drift, prediction of the grains [start, start + count), count <= TAL_DRIFT_GRAINS, by dt [s], eqs
// (12)-(14); what the laws shall see goes into the grain records. Returns the square of the largest speed [m^2/s^2] as
// bits, which order like the numbers, NAN above all.
int64_t tal_drift_group(tal_sim *sim, size_t start, int count, double dt);

#endif
