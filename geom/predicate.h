// The two signs that triangulations rest on, exact for every input: a floating-point filter with a proven bound, then
// expansion arithmetic (J. R. Shewchuk, Discrete Comput. Geom. 18, 305-363, 1997).
// Needs round-to-nearest-even and no contraction of a*b + c. Exact as long as nothing under- or overflows: |x|, |y|
// zero or in [2^-200, 2^2], |w| zero or in [2^-450, 2^400].
#ifndef GEO_PREDICATE_H
#define GEO_PREDICATE_H

#include <math.h>

// A weighted point: power of a place p is |p - (x,y)|^2 - w. w = 0 throughout is the plain Delaunay case.
typedef struct geo_site {
  double x, y; // [length]
  double w;    // [length^2]
} geo_site;

// The same signs by expansion arithmetic alone.
int geo_orient_exact(geo_site a, geo_site b, geo_site c);
int geo_conflict_exact(geo_site a, geo_site b, geo_site c, geo_site d);

#define GEO_EPS 0x1p-53 // relative error of one rounded operation

static inline int geo_sign(double value) {
  return (value > 0) - (value < 0);
}

// 1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they lie on one line. Weights play no part.
// Bound: each product carries (1 + EPS)^3, their difference one more: 4 EPS (|l| + |r|) to first order.
static inline int geo_orient(geo_site a, geo_site b, geo_site c) {
  double left = (a.x - c.x) * (b.y - c.y), right = (a.y - c.y) * (b.x - c.x);
  double det = left - right;
  if (fabs(det) > 5 * GEO_EPS * (fabs(left) + fabs(right)))
    return geo_sign(det);
  return geo_orient_exact(a, b, c);
}

// For a, b, c counter-clockwise: 1 if d is in conflict with them (plain: inside their circle; power: the lifted point
// x^2 + y^2 - w lies below their plane), -1 if it is not, 0 if it lies exactly on the circle (plane).
// Bound: a lift carries at most (1 + EPS)^5, a minor (1 + EPS)^4, their product one and the sum of three two more:
// 12 EPS times the sum of the terms' magnitudes to first order. 16 covers the higher orders and the rounding of the
// magnitudes themselves.
static inline int geo_conflict(geo_site a, geo_site b, geo_site c, geo_site d) {
  double ax = a.x - d.x, ay = a.y - d.y, aw = a.w - d.w;
  double bx = b.x - d.x, by = b.y - d.y, bw = b.w - d.w;
  double cx = c.x - d.x, cy = c.y - d.y, cw = c.w - d.w;
  double bxcy = bx * cy, bycx = by * cx, cxay = cx * ay, cyax = cy * ax, axby = ax * by, aybx = ay * bx;
  double aa = ax * ax + ay * ay, bb = bx * bx + by * by, cc = cx * cx + cy * cy;
  double det = (aa - aw) * (bxcy - bycx) + (bb - bw) * (cxay - cyax) + (cc - cw) * (axby - aybx);
  double magnitude = (aa + fabs(aw)) * (fabs(bxcy) + fabs(bycx)) + (bb + fabs(bw)) * (fabs(cxay) + fabs(cyax)) +
                     (cc + fabs(cw)) * (fabs(axby) + fabs(aybx));
  if (fabs(det) > 16 * GEO_EPS * magnitude)
    return geo_sign(det);
  return geo_conflict_exact(a, b, c, d);
}

#endif
