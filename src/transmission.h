// How far a forced grain's spin reaches: decay length, influence radius, transmission per sector, and what the force
// network has to do with it, eqs (R6)-(R10). Numbers in, numbers out.
#ifndef TAL_TRANSMISSION_H
#define TAL_TRANSMISSION_H

#include "base.h"
#include <stdbool.h>

// Share of the forced spin above which a grain counts as influenced [P fig. 4.5].
#define TAL_INFLUENCE 0.05

// (R7) |omega|/omega0 = A exp(-r/l), with standard errors that do not assume equal scatter at all distances (R8).
typedef struct tal_decay {
  double amplitude, amplitude_error;
  double length, length_error; // [unit of r]
  size_t points;               // 0: no fit
} tal_decay;

// Least squares over ratio[k] >= 0 at r[k] > 0. False, with points 0 and NANs, for fewer than five points or where
// nothing decays (no positive length).
bool tal_decay_fit(const double *r, const double *ratio, size_t points, tal_decay *decay);
// (R9): distance of the furthest point whose ratio reaches TAL_INFLUENCE; 0 where none does.
double tal_influence_radius(const double *r, const double *ratio, size_t points);
// (R10): per sector, sum of the ratios over the sum of the fitted decay; NAN for a sector without points. sector[k] <
// count; used[count] (may be NULL): points in each.
void tal_sector_transmission(const tal_decay *decay, const double *r, const double *ratio, const size_t *sector,
                             size_t points, size_t count, double *transmission, size_t *used);

// One observation: a sector of one forced grain of one sample.
typedef struct tal_sector {
  size_t sample, grain;               // clusters: sectors of a grain, grains of a sample
  double transmission, along, across; // each over its mean over the grain's sectors
} tal_sector;

// What the sectors say, with intervals of the bootstrap over samples and their grains (R12).
typedef struct tal_interval {
  double value, low, high;
} tal_interval;

typedef struct tal_sector_statistics {
  size_t sectors, grains, samples;
  tal_interval along, across;             // correlation of the transmission with either
  tal_interval along_slope, across_slope; // standardised regression (R11) on both at once
  tal_interval open, blocked;             // mean transmission where `across` is in its lowest and its highest quarter
} tal_sector_statistics;

// `confidence` in (0, 1). Sectors with a NAN are left out. Fewer than three grains give NAN intervals.
void tal_sector_statistics_of(const tal_sector *sector, size_t count, double confidence, uint64_t seed,
                              tal_sector_statistics *out);
// Mean of value[grain] with the interval of the same bootstrap; sample[grain] says whose it is.
tal_interval tal_mean_interval(const double *value, const size_t *sample, size_t count, double confidence,
                               uint64_t seed);

#endif
