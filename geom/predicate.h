// The two signs that triangulations rest on, exact for every input: a floating-point filter with a proven bound, then
// expansion arithmetic (J. R. Shewchuk, Discrete Comput. Geom. 18, 305-363, 1997).
// Exact as long as nothing under- or overflows: |x|, |y| zero or in [2^-200, 2^2], |w| zero or in [2^-450, 2^400].
#ifndef GEO_PREDICATE_H
#define GEO_PREDICATE_H

// A weighted point: power of a place p is |p - (x,y)|^2 - w. w = 0 throughout is the plain Delaunay case.
typedef struct geo_site {
  double x, y; // [length]
  double w;    // [length^2]
} geo_site;

// 1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they lie on one line. Weights play no part.
int geo_orient(geo_site a, geo_site b, geo_site c);

// For a, b, c counter-clockwise: 1 if d is in conflict with them (plain: inside their circle; power: the lifted point
// x^2 + y^2 - w lies below their plane), -1 if it is not, 0 if it lies exactly on the circle (plane).
int geo_conflict(geo_site a, geo_site b, geo_site c, geo_site d);

#endif
