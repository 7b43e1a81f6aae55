// 2-vectors and 2x2 tensors, by value. No state, no errors.
#ifndef GEO_VEC_H
#define GEO_VEC_H

#include <math.h>

typedef struct geo_vec {
  double x, y;
} geo_vec;

typedef struct geo_tensor {
  double xx, xy, yx, yy;
} geo_tensor;

static inline geo_vec geo_add(geo_vec a, geo_vec b) {
  return (geo_vec){a.x + b.x, a.y + b.y};
}
static inline geo_vec geo_sub(geo_vec a, geo_vec b) {
  return (geo_vec){a.x - b.x, a.y - b.y};
}
static inline geo_vec geo_scale(double s, geo_vec a) {
  return (geo_vec){s * a.x, s * a.y};
}
static inline double geo_dot(geo_vec a, geo_vec b) {
  return a.x * b.x + a.y * b.y;
}
// z component of a x b: twice the signed area of the triangle (0, a, b), counter-clockwise positive.
static inline double geo_cross(geo_vec a, geo_vec b) {
  return a.x * b.y - a.y * b.x;
}
static inline double geo_norm(geo_vec a) {
  return sqrt(geo_dot(a, a));
}

static inline geo_tensor geo_outer(geo_vec a, geo_vec b) {
  return (geo_tensor){a.x * b.x, a.x * b.y, a.y * b.x, a.y * b.y};
}
static inline geo_tensor geo_tensor_add(geo_tensor a, geo_tensor b) {
  return (geo_tensor){a.xx + b.xx, a.xy + b.xy, a.yx + b.yx, a.yy + b.yy};
}
static inline geo_tensor geo_tensor_scale(double s, geo_tensor a) {
  return (geo_tensor){s * a.xx, s * a.xy, s * a.yx, s * a.yy};
}
static inline double geo_trace(geo_tensor a) {
  return a.xx + a.yy;
}
static inline double geo_contract(geo_tensor a, geo_tensor b) {
  return a.xx * b.xx + a.xy * b.xy + a.yx * b.yx + a.yy * b.yy;
}

#endif
