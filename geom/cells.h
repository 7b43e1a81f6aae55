// Bucket grid over discs: every pair whose gap is below a margin, in O(n).
#ifndef GEO_CELLS_H
#define GEO_CELLS_H

#include <stddef.h>
#include <stdint.h>

typedef struct geo_pairs {
  size_t count, capacity;
  int32_t (*pair)[2]; // owned; [count][2], i < j, ascending by (i, j)
} geo_pairs;

void geo_pairs_init(geo_pairs *pairs);
void geo_pairs_clear(geo_pairs *pairs);
// Room for `capacity` pairs; and no more than there are.
void geo_pairs_reserve(geo_pairs *pairs, size_t capacity);
void geo_pairs_fit(geo_pairs *pairs);

// All pairs i < j with |x_i - x_j| < r_i + r_j + margin [length] (compared as squares), sorted by (i, j). The margin
// may be negative. Memory O(n) whatever the extent; sizes may differ by 100 and more without quadratic cost. Returns 0,
// or -1 and no pairs when a number is not finite.
int geo_cells_pairs(const double *x, const double *y, const double *r, size_t n, double margin, geo_pairs *pairs);

#endif
