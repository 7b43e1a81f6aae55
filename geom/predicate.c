// Expansion arithmetic behind the two predicates.
// An expansion is a sum of doubles, smallest first, no two overlapping, no zeros; its sign is that of the last one.
#include "predicate.h"

// high + low = a + b exactly, high = fl(a + b).
static inline double two_sum(double a, double b, double *low) {
  double high = a + b;
  double b_part = high - a;
  *low = (a - (high - b_part)) + (b - b_part);
  return high;
}

// The same for |a| >= |b|.
static inline double fast_two_sum(double a, double b, double *low) {
  double high = a + b;
  *low = b - (high - a);
  return high;
}

// high + low = a * b exactly (Dekker: halves of 26 bits).
static inline double two_product(double a, double b, double *low) {
  const double splitter = 0x1p27 + 1;
  double ca = splitter * a, cb = splitter * b;
  double a1 = ca - (ca - a), b1 = cb - (cb - b);
  double a0 = a - a1, b0 = b - b1;
  double high = a * b;
  *low = a0 * b0 - (((high - a1 * b1) - a0 * b1) - a1 * b0);
  return high;
}

// h = e + f; h holds m + n. Returns the length. Merge by magnitude, then sum upwards.
static int expansion_sum(int m, const double *e, int n, const double *f, double *h) {
  int i = 0, j = 0, length = 0;
  double total = 0;
  while (i < m || j < n) {
    double next = j >= n || (i < m && fabs(e[i]) <= fabs(f[j])) ? e[i++] : f[j++];
    double low;
    total = two_sum(total, next, &low);
    if (low != 0)
      h[length++] = low;
  }
  if (total != 0)
    h[length++] = total;
  return length;
}

// h = b e; h holds 2 m.
static int expansion_scale(int m, const double *e, double b, double *h) {
  int length = 0;
  double total = 0;
  for (int i = 0; i < m; i++) {
    double low, product_low, high = two_product(e[i], b, &product_low);
    double sum = two_sum(total, product_low, &low);
    if (low != 0)
      h[length++] = low;
    total = fast_two_sum(high, sum, &low);
    if (low != 0)
      h[length++] = low;
  }
  if (total != 0)
    h[length++] = total;
  return length;
}

// Longest expansions met: lift 18, minor 16, their product 2 * 18 * 16, three of them in the determinant.
enum { SHORT_MAX = 18, TERM_MAX = 576, DETERMINANT_MAX = 3 * TERM_MAX };

typedef struct expansion {
  int length;
  double part[SHORT_MAX];
} expansion;

static expansion difference(double a, double b) {
  double low, high = two_sum(a, -b, &low);
  expansion d;
  d.length = 0;
  if (low != 0)
    d.part[d.length++] = low;
  if (high != 0)
    d.part[d.length++] = high;
  return d;
}

// h = e f; h holds 2 * lengths' product, at most TERM_MAX.
static int expansion_product(const expansion *e, const expansion *f, double *h) {
  double scaled[2 * SHORT_MAX], other[TERM_MAX];
  double *now = h, *next = other;
  int length = 0;
  for (int k = 0; k < f->length; k++) {
    int n = expansion_scale(e->length, e->part, f->part[k], scaled);
    length = expansion_sum(length, now, n, scaled, next);
    double *swap = now;
    now = next;
    next = swap;
  }
  if (now != h)
    for (int k = 0; k < length; k++)
      h[k] = now[k];
  return length;
}

// sign * e f for factors of length 2, as a short expansion.
static expansion short_product(const expansion *e, const expansion *f, double sign) {
  double part[TERM_MAX];
  expansion p;
  p.length = expansion_product(e, f, part);
  for (int k = 0; k < p.length; k++)
    p.part[k] = sign * part[k];
  return p;
}

static expansion short_sum(const expansion *e, const expansion *f) {
  expansion s;
  s.length = expansion_sum(e->length, e->part, f->length, f->part, s.part);
  return s;
}

static expansion cross_exact(const expansion *ax, const expansion *ay, const expansion *bx, const expansion *by) {
  expansion left = short_product(ax, by, 1), right = short_product(ay, bx, -1);
  return short_sum(&left, &right);
}

int geo_orient_exact(geo_site a, geo_site b, geo_site c) {
  expansion ax = difference(a.x, c.x), ay = difference(a.y, c.y);
  expansion bx = difference(b.x, c.x), by = difference(b.y, c.y);
  expansion det = cross_exact(&ax, &ay, &bx, &by);
  return det.length ? geo_sign(det.part[det.length - 1]) : 0;
}

// A row of the determinant: the point relative to d, and its lifted height.
typedef struct exact_row {
  expansion x, y, lift;
} exact_row;

static exact_row exact_row_of(geo_site a, geo_site d) {
  exact_row row = {.x = difference(a.x, d.x), .y = difference(a.y, d.y)};
  expansion xx = short_product(&row.x, &row.x, 1), yy = short_product(&row.y, &row.y, 1);
  expansion square = short_sum(&xx, &yy), weight = difference(d.w, a.w);
  row.lift = short_sum(&square, &weight);
  return row;
}

int geo_conflict_exact(geo_site a, geo_site b, geo_site c, geo_site d) {
  exact_row row[3] = {exact_row_of(a, d), exact_row_of(b, d), exact_row_of(c, d)};
  double now[DETERMINANT_MAX], next[DETERMINANT_MAX], term[TERM_MAX];
  int length = 0;
  for (int k = 0; k < 3; k++) {
    const exact_row *p = &row[(k + 1) % 3], *q = &row[(k + 2) % 3];
    expansion minor = cross_exact(&p->x, &p->y, &q->x, &q->y);
    int n = expansion_product(&row[k].lift, &minor, term);
    length = expansion_sum(length, now, n, term, next);
    for (int i = 0; i < length; i++)
      now[i] = next[i];
  }
  return length ? geo_sign(now[length - 1]) : 0;
}
