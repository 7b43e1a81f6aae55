#include "directional.h"

#include "base.h"

#include <gsl/gsl_eigen.h>
#include <stdbool.h>
#include <string.h>

// A segment as the grain sees it.
typedef struct seen {
  geo_vec s, b;    // unit vectors to its middle and along it, s.b >= 0 (R3)
  double distance; // |s| [mean diameters]
  double weight;   // f / <f> / |s|
} seen;

// Below this share of |s||b| the product s.b is round-off: a tie.
static const double tie = 1e-12;

// (R3): b points outwards; across (a tie) it points counter-clockwise about the grain.
static geo_vec orient(geo_vec s, geo_vec b) {
  const double outwards = geo_dot(s, b);
  const double sense = fabs(outwards) > tie ? outwards : geo_cross(s, b);
  return sense < 0 ? geo_scale(-1, b) : b;
}

// False where segment c is out of reach or its middle is at the grain's centre.
static bool look(const tal_network *n, geo_vec from, double reach, size_t c, seen *out) {
  const geo_vec a = {n->x[n->i[c]], n->y[n->i[c]]}, e = {n->x[n->j[c]], n->y[n->j[c]]};
  const geo_vec s = geo_scale(1 / n->diameter, geo_sub(geo_scale(0.5, geo_add(a, e)), from)), b = geo_sub(e, a);
  const double distance = geo_norm(s), length = geo_norm(b);
  if (!(distance <= reach) || distance < tie || !(length > 0) || !(n->mean_force > 0))
    return false;
  out->s = geo_scale(1 / distance, s);
  out->b = orient(out->s, geo_scale(1 / length, b));
  out->distance = distance;
  out->weight = n->f[c] / n->mean_force / distance;
  return true;
}

geo_tensor tal_directional_tensor(const tal_network *network, geo_vec from, double reach, size_t *segments) {
  geo_tensor sum = {0, 0, 0, 0};
  size_t count = 0;
  for (size_t c = 0; c < network->contacts; c++) {
    seen k;
    if (!look(network, from, reach, c, &k))
      continue;
    sum = geo_tensor_add(sum, geo_tensor_scale(k.weight, geo_outer(k.s, k.b)));
    count++;
  }
  if (segments)
    *segments = count;
  return sum;
}

void tal_directional_axes(geo_tensor t, double value[2], geo_vec axis[2]) {
  double matrix[4] = {t.xx, 0.5 * (t.xy + t.yx), 0.5 * (t.xy + t.yx), t.yy}, vectors[4];
  gsl_matrix_view a = gsl_matrix_view_array(matrix, 2, 2), v = gsl_matrix_view_array(vectors, 2, 2);
  gsl_vector_view values = gsl_vector_view_array(value, 2);
  gsl_eigen_symmv_workspace *work = gsl_eigen_symmv_alloc(2);
  gsl_eigen_symmv(&a.matrix, &values.vector, &v.matrix, work);
  gsl_eigen_symmv_sort(&values.vector, &v.matrix, GSL_EIGEN_SORT_VAL_DESC);
  gsl_eigen_symmv_free(work);
  for (int k = 0; k < 2; k++) {
    const double x = vectors[k], y = vectors[2 + k], sign = x < 0 || (x == 0 && y < 0) ? -1 : 1;
    axis[k] = (geo_vec){sign * x, sign * y};
  }
}

size_t tal_directional_sector(double x, double y, size_t count) {
  double turn = atan2(y, x) / (2 * TAL_PI);
  turn -= floor(turn);
  const size_t k = (size_t)(turn * (double)count);
  return k < count ? k : 0; // -1e-20 of a turn is none
}

void tal_directional_rose(const tal_network *network, geo_vec from, double reach, size_t count, double *along,
                          double *across) {
  memset(along, 0, count * sizeof *along);
  if (across)
    memset(across, 0, count * sizeof *across);
  for (size_t c = 0; c < network->contacts; c++) {
    seen k;
    if (!look(network, from, reach, c, &k))
      continue;
    const size_t sector = tal_directional_sector(k.s.x, k.s.y, count);
    along[sector] += k.weight * geo_dot(k.s, k.b);
    if (across && network->f[c] > network->mean_force)
      across[sector] += k.weight * fabs(geo_cross(k.s, k.b));
  }
}
