// Statistics of contact forces: distribution, its exponential tail above the mean and power law below by maximum
// likelihood, share below the mean, participation, mobilised friction. Equations (M9)-(M14). F. Radjai, M. Jean, J.-J.
// Moreau, S. Roux, Phys. Rev. Lett. 77 (1996) 274.
#ifndef TAL_MEASURE_FORCES_H
#define TAL_MEASURE_FORCES_H

#include "measure_snapshot.h"

// Rate of an exponential distribution on [0, inf) by maximum likelihood (M9): the confidence interval is exact, by
// chi-square quantiles with 2 n degrees of freedom. All 0 when there are no values or their sum is 0.
typedef struct tal_rate_fit {
  size_t count;
  double rate, low, high; // 95 %
  double distance;        // Kolmogorov-Smirnov: largest distance of the two distribution functions
  double p;               // of the Anderson-Darling test with fitted rate (M10); small: not an exponential
} tal_rate_fit;

// Sorts value[count] (all >= 0).
tal_rate_fit tal_rate_fit_of(double *value, size_t count);

// Of x = f / <f> over all contacts with f > 0.
typedef struct tal_force_law {
  size_t contacts;
  double mean, deviation; // [N]; sd / mean
  double largest;         // over the mean
  double below_mean;      // share of the contacts
  double participation;   // (sum f)^2 / (n sum f^2): 1 when all are equal
  tal_rate_fit tail;      // x > 1: density ~ exp(-rate x)
  tal_rate_fit power;     // x < 1: density ~ x^(rate - 1)
} tal_force_law;

// force[count], negative ones count by their size.
tal_force_law tal_force_law_of(const double *force, size_t count);

// Bins of x: ten per decade from 1e-3 to 1, then 0.25 wide to 10. The density integrates to 1 over all contacts.
enum { TAL_FORCE_BINS = 66 };
typedef struct tal_force_bin {
  double low, high, density;
  size_t count;
} tal_force_bin;
void tal_force_histogram(const double *force, size_t count, tal_force_bin bin[TAL_FORCE_BINS]);

typedef struct tal_friction_use {
  double ratio;    // mean of |ft| / fn
  double mean;     // mean of |ft| / (mu fn); 0 when mu is 0
  double at_limit; // share of contacts with |ft| >= 0.99 mu fn; 0 when mu is 0
} tal_friction_use;

typedef struct tal_forces {
  tal_force_law normal, tangential;
  tal_friction_use friction;
} tal_forces;

// friction: mu of the contacts.
tal_forces tal_forces_measure(const tal_part *part, double friction);
// The forces of the part's contacts; owned by the caller.
double *tal_part_forces(const tal_part *part, const double *column);

#endif
