// See measure_motion.h.
#include "measure_motion.h"

#include "measure_fit.h"
#include "store.h"
#include <gsl/gsl_multifit.h>
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- the earlier instant ----

static double *read_reals(tal_store *store, const char *name, size_t count) {
  double *value = tal_alloc(count, sizeof *value);
  tal_store_get(store, TAL_ARRAY(name, NULL, value, count));
  return value;
}

tal_status tal_earlier_read(tal_earlier *earlier, const char *path, tal_error *err) {
  *earlier = (tal_earlier){0};
  tal_store store;
  tal_status status = tal_store_open(&store, path, err);
  if (status)
    return status;
  earlier->time = tal_store_get_number(&store, "time");
  earlier->axial_strain = tal_store_get_number(&store, "axial_strain");
  tal_store_group(&store, "grains");
  const size_t n = earlier->count = tal_store_rows(&store, "id");
  earlier->id = tal_alloc(n, sizeof *earlier->id);
  tal_store_get(&store, TAL_ARRAY("id", NULL, earlier->id, n));
  earlier->x = read_reals(&store, "x", n);
  earlier->y = read_reals(&store, "y", n);
  earlier->theta = read_reals(&store, "theta", n);
  status = tal_store_status(&store, err);
  tal_store_close(&store);
  if (status)
    tal_earlier_clear(earlier);
  return status;
}

tal_earlier tal_earlier_of(const tal_snapshot *s) {
  const size_t n = s->grain_count, size = n * sizeof(double);
  return (tal_earlier){.time = s->time,
                       .axial_strain = s->axial_strain,
                       .count = n,
                       .id = memcpy(tal_alloc(n, sizeof *s->id), s->id, n * sizeof *s->id),
                       .x = memcpy(tal_alloc(n, sizeof(double)), s->x, size),
                       .y = memcpy(tal_alloc(n, sizeof(double)), s->y, size),
                       .theta = memcpy(tal_alloc(n, sizeof(double)), s->theta, size)};
}

void tal_earlier_clear(tal_earlier *earlier) {
  free(earlier->id);
  free(earlier->x);
  free(earlier->y);
  free(earlier->theta);
  *earlier = (tal_earlier){0};
}

// ---- grains and cells ----

static void match_grains(tal_motion *m, const tal_part *part, const tal_earlier *e) {
  const tal_snapshot *s = part->of;
  for (size_t k = 0, at = 0; k < s->grain_count; k++) {
    while (at < e->count && e->id[at] < s->id[k])
      at++;
    if (at == e->count || e->id[at] != s->id[k])
      continue;
    m->dx[k] = s->x[k] - e->x[at];
    m->dy[k] = s->y[k] - e->y[at];
    m->dtheta[k] = s->theta[k] - e->theta[at];
    m->matched[k] = true;
    m->known[k] = part->grain[k];
    m->known_count += m->known[k];
  }
}

static void cap_rotations(tal_motion *m, size_t count) {
  double *size = tal_alloc(m->known_count, sizeof *size), square = 0;
  size_t n = 0;
  for (size_t k = 0; k < count; k++)
    if (m->known[k])
      size[n++] = fabs(m->dtheta[k]);
  if (n)
    gsl_sort(size, 1, n);
  const double cap = n ? gsl_stats_quantile_from_sorted_data(size, 1, n, 0.98) : 0;
  m->median_rotation = n ? gsl_stats_median_from_sorted_data(size, 1, n) : 0;
  for (size_t k = 0; k < count; k++) {
    m->turn[k] = copysign(fmin(cap, fabs(m->dtheta[k])), m->dtheta[k]);
    if (!m->known[k])
      continue;
    m->mean_rotation += m->turn[k] / (double)n;
    square += m->turn[k] * m->turn[k] / (double)n;
  }
  m->rms_rotation = sqrt(square);
  free(size);
}

// Strain of a triangle from the displacements of its corners, on the shape it had before (M28). False where that shape
// was flat or turned over: such a cell has come to be since.
static bool strain_cell(const tal_motion *m, const tal_snapshot *s, size_t t, double *shear, double *dilation) {
  const int32_t *c = s->corner[t];
  double x[3], y[3];
  for (int k = 0; k < 3; k++) {
    x[k] = s->x[c[k]] - m->dx[c[k]];
    y[k] = s->y[c[k]] - m->dy[c[k]];
  }
  const double twice = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
  double xx = 0, xy = 0, yx = 0, yy = 0;
  for (int k = 0; k < 3; k++) { // gradient of the corner's shape function
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    const double gx = (y[a] - y[b]) / twice, gy = (x[b] - x[a]) / twice;
    xx += m->dx[c[k]] * gx, xy += m->dx[c[k]] * gy;
    yx += m->dy[c[k]] * gx, yy += m->dy[c[k]] * gy;
  }
  *shear = hypot(xx - yy, xy + yx);
  *dilation = xx + yy;
  return twice > 0.2 * s->cell_area[t];
}

static void strain_cells(tal_motion *m, const tal_part *part) {
  const tal_snapshot *s = part->of;
  double area = 0, *around = tal_alloc(s->grain_count, sizeof *around);
  for (size_t k = 0; k < part->cell_count; k++) {
    const size_t t = (size_t)part->cell[k];
    const int32_t *c = s->corner[t];
    const double a = s->cell_area[t];
    // The corners may lie outside the region; they only have to be known then and now.
    m->cell[t] =
        m->matched[c[0]] && m->matched[c[1]] && m->matched[c[2]] && strain_cell(m, s, t, &m->shear[t], &m->dilation[t]);
    if (!m->cell[t])
      continue;
    area += a;
    m->mean_shear += a * m->shear[t];
    m->mean_dilation += a * m->dilation[t];
    for (int corner = 0; corner < 3; corner++) {
      around[c[corner]] += a;
      m->grain_shear[c[corner]] += a * m->shear[t];
    }
  }
  for (size_t k = 0; k < s->grain_count; k++)
    m->grain_shear[k] = around[k] > 0 ? m->grain_shear[k] / around[k] : 0;
  m->mean_shear = area > 0 ? m->mean_shear / area : 0;
  m->mean_dilation = area > 0 ? m->mean_dilation / area : 0;
  free(around);
}

void tal_motion_find(tal_motion *m, const tal_part *part, const tal_earlier *earlier) {
  const size_t n = part->of->grain_count, cells = part->of->cell_count;
  *m = (tal_motion){.dx = tal_alloc(n, sizeof(double)),
                    .dy = tal_alloc(n, sizeof(double)),
                    .dtheta = tal_alloc(n, sizeof(double)),
                    .known = tal_alloc(n, sizeof(bool)),
                    .matched = tal_alloc(n, sizeof(bool)),
                    .shear = tal_alloc(cells, sizeof(double)),
                    .dilation = tal_alloc(cells, sizeof(double)),
                    .cell = tal_alloc(cells, sizeof(bool)),
                    .turn = tal_alloc(n, sizeof(double)),
                    .grain_shear = tal_alloc(n, sizeof(double))};
  match_grains(m, part, earlier);
  cap_rotations(m, n);
  strain_cells(m, part);
}

void tal_motion_clear(tal_motion *m) {
  void *const owned[] = {m->dx,      m->dy,    m->dtheta,   m->turn, m->known,
                         m->matched, m->shear, m->dilation, m->cell, m->grain_shear};
  for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
    free(owned[k]);
  *m = (tal_motion){0};
}

// ---- correlation of rotations ----

// Known grains in square buckets half as wide as the longest distance, row after row.
typedef struct buckets {
  size_t columns, rows, *first; // [columns * rows + 1]
  int32_t *grain;               // owned, as first
  double width;
} buckets;

static size_t bucket_of(double x, double low, double width, size_t count) {
  const size_t k = (size_t)fmax(0, (x - low) / width);
  return k < count ? k : count - 1;
}

static buckets fill_buckets(const tal_part *part, const tal_motion *m, double width) {
  const tal_snapshot *s = part->of;
  double x0 = HUGE_VAL, x1 = -HUGE_VAL, y0 = HUGE_VAL, y1 = -HUGE_VAL;
  for (size_t k = 0; k < s->grain_count; k++) {
    if (!m->known[k])
      continue;
    x0 = fmin(x0, s->x[k]), x1 = fmax(x1, s->x[k]);
    y0 = fmin(y0, s->y[k]), y1 = fmax(y1, s->y[k]);
  }
  // Grains that flew off must not make the grid large: its ends are open.
  buckets b = {.columns = (size_t)fmin(1000, 1 + (x1 - x0) / width),
               .rows = (size_t)fmin(1000, 1 + (y1 - y0) / width),
               .width = width};
  b.first = tal_alloc(b.columns * b.rows + 2, sizeof *b.first);
  b.grain = tal_alloc(m->known_count, sizeof *b.grain);
  for (int filling = 0; filling < 2; filling++) {
    for (size_t k = 0; k < s->grain_count; k++) {
      if (!m->known[k])
        continue;
      const size_t at = bucket_of(s->y[k], y0, width, b.rows) * b.columns + bucket_of(s->x[k], x0, width, b.columns);
      if (filling)
        b.grain[b.first[at + 1]++] = (int32_t)k;
      else
        b.first[at + 2]++;
    }
    for (size_t at = 2; !filling && at < b.columns * b.rows + 2; at++)
      b.first[at] += b.first[at - 1];
  }
  return b;
}

// Of the grains in the order of the buckets, so that a run of them lies together in memory.
typedef struct correlating {
  const double *x, *y, *rotation, *magnitude; // rotations less their means
  double limit;                               // squared
  tal_rotation_correlation *out;
} correlating;

static void pair_run(const correlating *c, size_t a, size_t begin, size_t end) {
  for (size_t b = begin; b < end; b++) {
    const double dx = c->x[a] - c->x[b], dy = c->y[a] - c->y[b], square = dx * dx + dy * dy;
    if (square >= c->limit)
      continue;
    const double r = sqrt(square) / c->out->width; // hypot took half of the time
    const size_t k = r < TAL_CORRELATION_BINS ? (size_t)r : TAL_CORRELATION_BINS - 1;
    c->out->pairs[k]++;
    c->out->rotation[k] += c->rotation[a] * c->rotation[b];
    c->out->magnitude[k] += c->magnitude[a] * c->magnitude[b];
  }
}

// Each pair once: with what follows in the bucket and in the two beside it, and with five buckets of either row ahead.
static void pair_buckets(const correlating *c, const buckets *b, size_t row, size_t column) {
  const size_t here = row * b->columns + column, left = column > 2 ? column - 2 : 0,
               right = column + 2 < b->columns ? column + 2 : b->columns - 1;
  for (size_t p = b->first[here]; p < b->first[here + 1]; p++) {
    pair_run(c, p, p + 1, b->first[row * b->columns + right + 1]);
    for (size_t ahead = row + 1; ahead <= row + 2 && ahead < b->rows; ahead++)
      pair_run(c, p, b->first[ahead * b->columns + left], b->first[ahead * b->columns + right + 1]);
  }
}

static void pair_all(const buckets *b, const tal_snapshot *s, const double *rotation, const double *magnitude,
                     tal_rotation_correlation *out) {
  const size_t n = b->first[b->columns * b->rows];
  double *all = tal_alloc(4 * n + 1, sizeof *all);
  for (size_t k = 0; k < n; k++) {
    all[k] = s->x[b->grain[k]];
    all[n + k] = s->y[b->grain[k]];
    all[2 * n + k] = rotation[b->grain[k]];
    all[3 * n + k] = magnitude[b->grain[k]];
  }
  const correlating c = {all, all + n, all + 2 * n, all + 3 * n, 4 * b->width * b->width, out};
  for (size_t row = 0; row < b->rows; row++)
    for (size_t column = 0; column < b->columns; column++)
      pair_buckets(&c, b, row, column);
  free(all);
}

static void decay(void *context, const double *parameter, double *value) {
  const double *r = context;
  for (size_t k = 0; k < TAL_CORRELATION_BINS; k++)
    value[k] = parameter[0] * exp(-r[k] / exp(parameter[1]));
}

static void fit_decay(tal_rotation_correlation *c) {
  double r[TAL_CORRELATION_BINS], weight[TAL_CORRELATION_BINS];
  size_t used = 0;
  for (size_t k = 0; k < TAL_CORRELATION_BINS; k++) {
    r[k] = ((double)k + 0.5) / 2; // in mean diameters
    weight[k] = (double)c->pairs[k];
    used += c->pairs[k] > 0;
  }
  if (used < 4)
    return;
  tal_fit fit = {.parameter = {0.5, log(2)}};
  tal_fit_solve(&fit, 2, decay, r, c->magnitude, weight, TAL_CORRELATION_BINS);
  const double diameter = 2 * c->width, length = exp(fit.parameter[1]);
  // No decay within the bins, or no correlation to decay: no length.
  if (!fit.converged || !(fit.parameter[0] > 2 * fit.error[0]) || !(length < TAL_CORRELATION_BINS) || length < 0.05)
    return;
  c->amplitude = fit.parameter[0];
  c->length = length * diameter;
  c->length_error = fit.error[1] * c->length;
}

// Values of the known grains less their mean; returns their variance.
static double centre(const tal_motion *m, size_t count, double *value) {
  const double n = (double)m->known_count;
  double mean = 0, square = 0;
  for (size_t k = 0; k < count; k++)
    mean += m->known[k] ? value[k] / n : 0;
  for (size_t k = 0; k < count; k++) {
    value[k] -= mean;
    square += m->known[k] ? value[k] * value[k] / n : 0;
  }
  return square;
}

tal_rotation_correlation tal_rotation_correlate(const tal_part *part, const tal_motion *m) {
  const tal_snapshot *s = part->of;
  tal_rotation_correlation c = {.width = part->mean_diameter / 2};
  if (m->known_count < 2)
    return c;
  double *rotation = tal_alloc(s->grain_count, sizeof *rotation),
         *magnitude = tal_alloc(s->grain_count, sizeof *magnitude);
  for (size_t k = 0; k < s->grain_count; k++) {
    rotation[k] = m->turn[k];
    magnitude[k] = fabs(m->turn[k]);
  }
  const double v = centre(m, s->grain_count, rotation), w = centre(m, s->grain_count, magnitude);
  buckets b = fill_buckets(part, m, TAL_CORRELATION_BINS * c.width / 2);
  pair_all(&b, s, rotation, magnitude, &c);
  for (size_t k = 0; k < TAL_CORRELATION_BINS; k++) {
    c.rotation[k] = c.pairs[k] && v > 0 ? c.rotation[k] / ((double)c.pairs[k] * v) : 0;
    c.magnitude[k] = c.pairs[k] && w > 0 ? c.magnitude[k] / ((double)c.pairs[k] * w) : 0;
  }
  if (w > 0)
    fit_decay(&c);
  free(rotation);
  free(magnitude);
  free(b.first);
  free(b.grain);
  return c;
}

// ---- affine part ----

// Distances from the mean point; returns their scale.
static double centred(size_t count, const double *x, double *from_mean) {
  double mean = 0, most = 0;
  for (size_t k = 0; k < count; k++)
    mean += x[k] / (double)count;
  for (size_t k = 0; k < count; k++) {
    from_mean[k] = x[k] - mean;
    most = fmax(most, fabs(from_mean[k]));
  }
  return most;
}

double tal_affine_remove(size_t count, const double *x, const double *y, double *u, double *v) {
  if (count < 3) {
    for (size_t k = 0; k < count; k++)
      u[k] = v[k] = 0;
    return 0;
  }
  double *at = tal_alloc(2 * count, sizeof *at), squares, sum = 0;
  const double sx = centred(count, x, at), sy = centred(count, y, at + count), scale = fmax(sx, sy);
  gsl_matrix *basis = gsl_matrix_alloc(count, 3), *covariance = gsl_matrix_alloc(3, 3);
  gsl_vector *coefficient = gsl_vector_alloc(3), *left = gsl_vector_alloc(count);
  gsl_multifit_linear_workspace *work = gsl_multifit_linear_alloc(count, 3);
  size_t rank;
  for (size_t k = 0; k < count; k++) {
    gsl_matrix_set(basis, k, 0, 1);
    gsl_matrix_set(basis, k, 1, scale > 0 ? at[k] / scale : 0);
    gsl_matrix_set(basis, k, 2, scale > 0 ? at[count + k] / scale : 0);
  }
  double *const field[2] = {u, v};
  for (int d = 0; d < 2; d++) {
    gsl_vector_view value = gsl_vector_view_array(field[d], count);
    gsl_multifit_linear_tsvd(basis, &value.vector, 1e-10, coefficient, covariance, &squares, &rank, work);
    gsl_multifit_linear_residuals(basis, &value.vector, coefficient, left);
    gsl_vector_memcpy(&value.vector, left);
    for (size_t k = 0; k < count; k++)
      sum += field[d][k] * field[d][k];
  }
  gsl_multifit_linear_free(work);
  gsl_vector_free(left);
  gsl_vector_free(coefficient);
  gsl_matrix_free(covariance);
  gsl_matrix_free(basis);
  free(at);
  return sqrt(sum / (double)count);
}
