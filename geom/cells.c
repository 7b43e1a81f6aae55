// Pairs of discs by bucket grids, one per size class, so that small discs never search buckets made for large ones of
// their own kind. A disc's reach is its radius plus half the margin; two discs are a pair only if they are closer than
// the sum of their reaches. Class 0 holds the largest reaches, class k those down to 2^-(k+1) of the largest. A bucket
// is at least twice as wide as the largest reach of its class, so a disc finds all partners of its own and of coarser
// classes in 3 x 3 buckets, and each pair is found once, from its finer disc.
// A grid is dense (a table of buckets) where the class fills its bounding box, else sparse (discs sorted by bucket,
// found by bisection; buckets a power of two wide, so that bucket numbers are exact however far out a disc lies).
#include "cells.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "memory.h"

enum { CLASS_COUNT = 16 };

typedef struct entry {
  double x, y, r;
  int64_t column, row; // bucket
  int32_t id;
} entry;

typedef struct grid {
  entry *entry; // [count] row by row, column by column
  size_t count;
  double x0, y0, width;  // bucket (c, r) starts at (x0 + c width, y0 + r width)
  int64_t columns, rows; // dense only
  size_t *start;         // dense only, else NULL: [columns * rows + 1] first entry of each bucket
} grid;

typedef struct span {
  size_t begin, end;
} span;

void geo_pairs_init(geo_pairs *pairs) {
  *pairs = (geo_pairs){0};
}

void geo_pairs_clear(geo_pairs *pairs) {
  free(pairs->pair);
  geo_pairs_init(pairs);
}

void geo_pairs_reserve(geo_pairs *pairs, size_t capacity) {
  if (capacity <= pairs->capacity)
    return;
  pairs->pair = geo_resize(pairs->pair, capacity, sizeof *pairs->pair);
  pairs->capacity = capacity;
}

void geo_pairs_fit(geo_pairs *pairs) {
  pairs->pair = geo_resize(pairs->pair, pairs->count, sizeof *pairs->pair);
  pairs->capacity = pairs->count;
}

// Of numbers: fmin and fmax, which know what is none, are calls.
static double least(double a, double b) {
  return a < b ? a : b;
}

static double most(double a, double b) {
  return a > b ? a : b;
}

// ---- grids ----

static int64_t bucket_of(double x, double x0, double width) {
  const double last = 0x1p62, bucket = floor((x - x0) / width);
  return (int64_t)most(-last, least(last, bucket));
}

static int compare_buckets(const void *a, const void *b) {
  const entry *p = a, *q = b;
  if (p->row != q->row)
    return p->row < q->row ? -1 : 1;
  if (p->column != q->column)
    return p->column < q->column ? -1 : 1;
  return p->id < q->id ? -1 : p->id > q->id;
}

static void assign_buckets(grid *g) {
  for (size_t e = 0; e < g->count; e++) {
    g->entry[e].column = bucket_of(g->entry[e].x, g->x0, g->width);
    g->entry[e].row = bucket_of(g->entry[e].y, g->y0, g->width);
  }
}

static void make_sparse(grid *g) {
  int exponent;
  frexp(g->width, &exponent); // width < 2^exponent
  g->x0 = g->y0 = 0;
  g->width = ldexp(1, exponent);
  assign_buckets(g);
  qsort(g->entry, g->count, sizeof *g->entry, compare_buckets);
}

static void make_dense(grid *g) {
  assign_buckets(g);
  size_t buckets = (size_t)(g->columns * g->rows);
  g->start = geo_zeroed(buckets + 1, sizeof *g->start);
  for (size_t e = 0; e < g->count; e++)
    g->start[g->entry[e].row * g->columns + g->entry[e].column + 1]++;
  for (size_t b = 0; b < buckets; b++)
    g->start[b + 1] += g->start[b];
  entry *sorted = geo_resize(NULL, g->count, sizeof *sorted);
  for (size_t e = g->count; e-- > 0;) // from the end, so that ids ascend within a bucket
    sorted[--g->start[g->entry[e].row * g->columns + g->entry[e].column + 1]] = g->entry[e];
  for (size_t b = 0; b < buckets; b++)
    g->start[b] = g->start[b + 1];
  g->start[buckets] = g->count;
  free(g->entry);
  g->entry = sorted;
}

// `reach` is the largest of the entries. Discs without reach pair with coarser ones only: they get no grid (width 0).
static void make_grid(grid *g, double reach) {
  if (g->count == 0 || reach == 0)
    return;
  double x1 = g->entry[0].x, y1 = g->entry[0].y;
  g->x0 = x1;
  g->y0 = y1;
  for (size_t e = 1; e < g->count; e++) {
    g->x0 = least(g->x0, g->entry[e].x);
    g->y0 = least(g->y0, g->entry[e].y);
    x1 = most(x1, g->entry[e].x);
    y1 = most(y1, g->entry[e].y);
  }
  g->width = 2 * reach * (1 + 1e-6); // the rest covers rounding of bucket numbers
  double columns = floor((x1 - g->x0) / g->width) + 1, rows = floor((y1 - g->y0) / g->width) + 1;
  if (!(columns * rows <= 4 * (double)g->count + 64)) {
    make_sparse(g);
    return;
  }
  g->columns = (int64_t)columns;
  g->rows = (int64_t)rows;
  make_dense(g);
}

// First entry at or after bucket (column, row) of a sparse grid.
static size_t bisect(const grid *g, int64_t column, int64_t row) {
  size_t low = 0, high = g->count;
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    const entry *e = &g->entry[middle];
    if (e->row < row || (e->row == row && e->column < column))
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

// Entries of buckets first .. last of a row.
static span entries_of(const grid *g, int64_t first, int64_t last, int64_t row) {
  if (!g->start)
    return (span){bisect(g, first, row), bisect(g, last + 1, row)};
  if (row < 0 || row >= g->rows || last < 0 || first >= g->columns)
    return (span){0, 0};
  if (first < 0)
    first = 0;
  if (last >= g->columns)
    last = g->columns - 1;
  return (span){g->start[row * g->columns + first], g->start[row * g->columns + last + 1]};
}

// ---- pairs ----

typedef struct search {
  double margin;
  size_t *partners; // [n + 1] number of pairs by smaller id
  geo_pairs found;  // as they come
} search;

static void test_span(search *s, const entry *a, const grid *g, span range) {
  for (size_t e = range.begin; e < range.end; e++) {
    const entry *b = &g->entry[e];
    double dx = a->x - b->x, dy = a->y - b->y, near = a->r + b->r + s->margin;
    if (!(near > 0 && dx * dx + dy * dy < near * near))
      continue;
    if (s->found.count == s->found.capacity) {
      s->found.capacity = geo_capacity(s->found.capacity, s->found.count + 1);
      s->found.pair = geo_resize(s->found.pair, s->found.capacity, sizeof *s->found.pair);
    }
    int32_t *pair = s->found.pair[s->found.count++];
    pair[0] = a->id < b->id ? a->id : b->id;
    pair[1] = a->id < b->id ? b->id : a->id;
    s->partners[pair[0]]++;
  }
}

// Within a class each pair is met from its earlier entry: the rest of its bucket and the next one, then the row above.
static void search_own(search *s, const grid *g) {
  if (g->width == 0)
    return;
  for (size_t k = 0; k < g->count; k++) {
    const entry *a = &g->entry[k];
    span beside = entries_of(g, a->column, a->column + 1, a->row);
    test_span(s, a, g, (span){k + 1, beside.end});
    test_span(s, a, g, entries_of(g, a->column - 1, a->column + 1, a->row + 1));
  }
}

static void search_coarser(search *s, const grid *fine, const grid *coarse) {
  if (coarse->count == 0)
    return;
  for (size_t k = 0; k < fine->count; k++) {
    const entry *a = &fine->entry[k];
    int64_t column = bucket_of(a->x, coarse->x0, coarse->width), row = bucket_of(a->y, coarse->y0, coarse->width);
    for (int64_t up = -1; up <= 1; up++)
      test_span(s, a, coarse, entries_of(coarse, column - 1, column + 1, row + up));
  }
}

// Sorts by counting on the smaller id; a disc's few partners by insertion.
static void sort_pairs(search *s, size_t n, geo_pairs *pairs) {
  geo_pairs_reserve(pairs, geo_capacity(pairs->capacity, s->found.count));
  pairs->count = s->found.count;
  size_t sum = 0;
  for (size_t i = 0; i <= n; i++) {
    size_t here = s->partners[i];
    s->partners[i] = sum;
    sum += here;
  }
  for (size_t c = 0; c < s->found.count; c++)
    memcpy(pairs->pair[s->partners[s->found.pair[c][0]]++], s->found.pair[c], sizeof *pairs->pair);
  for (size_t c = 1; c < pairs->count; c++) {
    int32_t i = pairs->pair[c][0], j = pairs->pair[c][1];
    size_t at = c;
    for (; at > 0 && pairs->pair[at - 1][0] == i && pairs->pair[at - 1][1] > j; at--)
      pairs->pair[at][1] = pairs->pair[at - 1][1];
    pairs->pair[at][1] = j;
  }
}

static double reach_of(double r, double margin) {
  return most(0, r + 0.5 * margin);
}

// 0 for reaches in (largest / 2, largest], one more per halving.
static int class_of(double reach, double largest) {
  int exponent;
  if (reach > 0.5 * largest)
    return 0;
  if (!(reach > 0))
    return CLASS_COUNT - 1;
  double fraction = frexp(largest / reach, &exponent);
  int class = exponent - 1 + (fraction >= 1);
  return class < CLASS_COUNT ? class : CLASS_COUNT - 1;
}

// Copies the discs into their classes' grids.
static void fill_grids(grid g[CLASS_COUNT], const double *x, const double *y, const double *r, size_t n, double margin,
                       double largest) {
  double reach[CLASS_COUNT] = {0};
  for (size_t i = 0; i < n; i++)
    g[class_of(reach_of(r[i], margin), largest)].count++;
  for (int k = 0; k < CLASS_COUNT; k++) {
    g[k].entry = g[k].count ? geo_resize(NULL, g[k].count, sizeof *g[k].entry) : NULL;
    g[k].count = 0;
  }
  for (size_t i = 0; i < n; i++) {
    double own = reach_of(r[i], margin);
    int k = class_of(own, largest);
    reach[k] = most(reach[k], own);
    g[k].entry[g[k].count++] = (entry){.x = x[i], .y = y[i], .r = r[i], .id = (int32_t)i};
  }
  for (int k = 0; k < CLASS_COUNT; k++)
    make_grid(&g[k], reach[k]);
}

int geo_cells_pairs(const double *x, const double *y, const double *r, size_t n, double margin, geo_pairs *pairs) {
  double largest = 0;
  pairs->count = 0;
  if (!isfinite(margin))
    return -1;
  for (size_t i = 0; i < n; i++) {
    if (!isfinite(x[i]) || !isfinite(y[i]) || !isfinite(r[i]))
      return -1;
    largest = most(largest, reach_of(r[i], margin));
  }
  if (!(largest > 0))
    return 0;
  grid g[CLASS_COUNT] = {0};
  fill_grids(g, x, y, r, n, margin, largest);
  search s = {.margin = margin, .partners = geo_zeroed(n + 1, sizeof *s.partners)};
  for (int k = 0; k < CLASS_COUNT; k++) {
    search_own(&s, &g[k]);
    for (int m = 0; m < k; m++)
      search_coarser(&s, &g[k], &g[m]);
  }
  sort_pairs(&s, n, pairs);
  for (int k = 0; k < CLASS_COUNT; k++) {
    free(g[k].entry);
    free(g[k].start);
  }
  free(s.partners);
  free(s.found.pair);
  return 0;
}
