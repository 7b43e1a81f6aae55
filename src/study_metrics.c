// See study_metrics.h.
#include "study_metrics.h"

#include "figures_frames.h"
#include "files.h"

#include <gsl/gsl_multifit.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- series ----

// A column beside the one it is taken along, from where that begins to change.
typedef struct curve {
  const double *s, *f;
  size_t count;
} curve;

static tal_status curve_of(curve *out, const tal_study_metric *metric, const tal_table *series, tal_error *why) {
  const char *along = metric->along_time ? "time" : "axial_strain";
  const double *s = tal_table_column(series, along), *f = tal_table_column(series, metric->column);
  if (!s || !f)
    return tal_fail(why, TAL_BAD_INPUT, "no column %s in series.csv", s ? metric->column : along);
  size_t first = 0;
  while (!metric->along_time && first + 1 < series->rows && !(s[first + 1] > s[first]))
    first++;
  *out = (curve){s + first, f + first, series->rows - first};
  if (out->count > 1)
    return TAL_OK;
  return tal_fail(why, TAL_BAD_INPUT, "series.csv: %s", series->rows < 2 ? "fewer than two rows" : "no strain");
}

// A stage ends within a step of its strain: a thousandth beyond the ends still counts as the end.
static bool reaches(const curve *c, double s) {
  const double slack = 1e-3 * fmax(fabs(s), fabs(c->s[c->count - 1]));
  return s >= c->s[0] - slack && s <= c->s[c->count - 1] + slack;
}

// The straight line through the rows around s.
static double value_at(const curve *c, double s) {
  size_t k = 1;
  if (s <= c->s[0])
    return c->f[0];
  while (k < c->count && c->s[k] < s)
    k++;
  if (k == c->count)
    return c->f[k - 1];
  const double part = (s - c->s[k - 1]) / (c->s[k] - c->s[k - 1]);
  return part == 1 ? c->f[k] : c->f[k - 1] + part * (c->f[k] - c->f[k - 1]);
}

static double mean_over(const curve *c, double from, double to) {
  double s = from, f = value_at(c, from), sum = 0;
  for (size_t k = 0; k < c->count; k++) {
    if (!(c->s[k] > from) || !(c->s[k] < to))
      continue;
    sum += (c->s[k] - s) * (c->f[k] + f) / 2;
    s = c->s[k];
    f = c->f[k];
  }
  sum += (to - s) * (value_at(c, to) + f) / 2;
  return sum / (to - from);
}

// The row of the largest value times `sign` in the window; count when there is none.
static size_t extreme(const curve *c, double from, double to, double sign) {
  size_t best = c->count;
  for (size_t k = 0; k < c->count; k++) {
    if (c->s[k] < from || c->s[k] > to || isnan(c->f[k]))
      continue;
    if (best == c->count || sign * c->f[k] > sign * c->f[best])
      best = k;
  }
  return best;
}

static double take(const tal_study_metric *metric, const curve *c, double from, double to) {
  const bool peak = metric->take == TAL_TAKE_PEAK || metric->take == TAL_TAKE_PEAK_AT;
  if (metric->take == TAL_TAKE_VALUE)
    return value_at(c, metric->at);
  if (metric->take == TAL_TAKE_MEAN)
    return mean_over(c, from, to);
  const size_t k = extreme(c, from, to, peak ? 1 : -1);
  if (k == c->count)
    return (double)NAN;
  return metric->take == TAL_TAKE_PEAK || metric->take == TAL_TAKE_TROUGH ? c->f[k] : c->s[k];
}

tal_status tal_metric_of_series(const tal_study_metric *metric, const tal_table *series, double *value,
                                tal_error *why) {
  curve c;
  *value = (double)NAN;
  tal_status status = curve_of(&c, metric, series, why);
  if (status)
    return status;
  const double last = c.s[c.count - 1], from = isnan(metric->from) ? c.s[0] : metric->from;
  const double to = isnan(metric->to) ? last : metric->to;
  const double need[2] = {metric->take == TAL_TAKE_VALUE ? metric->at : from,
                          metric->take == TAL_TAKE_VALUE ? metric->at : to};
  if (!reaches(&c, need[0]) || !reaches(&c, need[1]))
    return tal_fail(why, TAL_BAD_INPUT, "series.csv goes from %g to %g, not to %g", c.s[0], last,
                    reaches(&c, need[0]) ? need[1] : need[0]);
  *value = take(metric, &c, from, to);
  if (isfinite(*value))
    return TAL_OK;
  return tal_fail(why, TAL_BAD_INPUT, "%s has no meaning there", metric->column);
}

// ---- displacement fluctuations ----

// One component: w - (a + b x + c y), by least squares.
static void remove_plane(const gsl_matrix *base, double *w, size_t n) {
  gsl_multifit_linear_workspace *work = gsl_multifit_linear_alloc(n, 3);
  gsl_vector *c = gsl_vector_alloc(3), *rest = gsl_vector_alloc(n);
  gsl_matrix *cov = gsl_matrix_alloc(3, 3);
  gsl_vector_view view = gsl_vector_view_array(w, n);
  double chisq;
  gsl_multifit_linear(base, &view.vector, c, cov, &chisq, work);
  gsl_multifit_linear_residuals(base, &view.vector, c, rest);
  gsl_vector_memcpy(&view.vector, rest);
  gsl_matrix_free(cov);
  gsl_vector_free(rest);
  gsl_vector_free(c);
  gsl_multifit_linear_free(work);
}

void tal_fluctuation_of(const double *x, const double *y, double *dx, double *dy, size_t n) {
  if (n < 4) {
    for (size_t k = 0; k < n; k++)
      dx[k] = dy[k] = 0;
    return;
  }
  double mx = 0, my = 0, size = 0;
  for (size_t k = 0; k < n; k++) {
    mx += x[k] / (double)n;
    my += y[k] / (double)n;
  }
  for (size_t k = 0; k < n; k++)
    size = fmax(size, fmax(fabs(x[k] - mx), fabs(y[k] - my)));
  gsl_matrix *base = gsl_matrix_alloc(n, 3);
  for (size_t k = 0; k < n; k++) {
    gsl_matrix_set(base, k, 0, 1);
    gsl_matrix_set(base, k, 1, size > 0 ? (x[k] - mx) / size : 0);
    gsl_matrix_set(base, k, 2, size > 0 ? (y[k] - my) / size : 0);
  }
  remove_plane(base, dx, n);
  remove_plane(base, dy, n);
  gsl_matrix_free(base);
}

// Grains that are corners of cells; all where there are no cells. Owned by the caller.
static bool *corners(const tal_frame *frame) {
  bool *is = tal_alloc(frame->grain_count + 1, sizeof *is);
  for (size_t t = 0; t < frame->cell_count; t++)
    for (int k = 0; k < 3; k++)
      is[frame->corner[k][t]] = true;
  for (size_t i = 0; i < frame->grain_count && !frame->cell_count; i++)
    is[i] = true;
  return is;
}

static void fill(tal_fluctuation *out, const tal_frame *a, const tal_frame *b) {
  const size_t most = a->grain_count + 1;
  bool *in_a = corners(a), *in_b = corners(b);
  double *x = tal_alloc(most, sizeof *x), *y = tal_alloc(most, sizeof *y);
  out->id = tal_alloc(most, sizeof *out->id);
  out->u = tal_alloc(most, sizeof *out->u);
  out->v = tal_alloc(most, sizeof *out->v);
  for (size_t i = 0, j = 0; i < a->grain_count && j < b->grain_count;) {
    if (a->id[i] != b->id[j]) {
      *(a->id[i] < b->id[j] ? &i : &j) += 1;
      continue;
    }
    const bool finite = isfinite(a->x[i]) && isfinite(a->y[i]) && isfinite(b->x[j]) && isfinite(b->y[j]);
    if (in_a[i] && in_b[j] && finite) {
      x[out->count] = a->x[i];
      y[out->count] = a->y[i];
      out->id[out->count] = a->id[i];
      out->u[out->count] = b->x[j] - a->x[i];
      out->v[out->count++] = b->y[j] - a->y[i];
    }
    i++, j++;
  }
  out->start = tal_hash(x, out->count * sizeof *x) ^ (3 * tal_hash(y, out->count * sizeof *y));
  tal_fluctuation_of(x, y, out->u, out->v, out->count);
  free(in_a);
  free(in_b);
  free(x);
  free(y);
}

// The frame nearest to `place`, of equally near ones the last; NAN: the first strained window's begin, or the end.
static const tal_frame_entry *nearest(const tal_frame_list *list, bool time, double place) {
  const tal_frame_entry *best = NULL;
  double off = 0;
  for (size_t k = 0; k < list->count; k++) {
    const double s = time ? list->entry[k].time : list->entry[k].axial_strain;
    if (isnan(s) || (best && fabs(s - place) > off))
      continue;
    best = &list->entry[k];
    off = fabs(s - place);
  }
  return best;
}

static double place_of(const tal_frame_entry *entry, bool time) {
  return time ? entry->time : entry->axial_strain;
}

static tal_status read_pair(tal_fluctuation *out, const tal_frame_entry *begin, const tal_frame_entry *end,
                            tal_error *why) {
  tal_frame a = {0}, b = {0};
  tal_status status = tal_frame_read(&a, begin->path, why);
  if (status == TAL_OK)
    status = tal_frame_read(&b, end->path, why);
  if (status == TAL_OK)
    fill(out, &a, &b);
  tal_frame_clear(&a);
  tal_frame_clear(&b);
  return status;
}

tal_status tal_fluctuation_read(tal_fluctuation *out, const tal_study_metric *metric, const char *dir, tal_error *why) {
  tal_frame_list list;
  *out = (tal_fluctuation){0};
  tal_status status = tal_frame_list_read(&list, dir, why);
  const bool time = metric->along_time;
  const tal_frame_entry *last = nearest(&list, time, HUGE_VAL);
  const double from = isnan(metric->from) ? 0 : metric->from;
  const tal_frame_entry *begin = nearest(&list, time, from);
  const tal_frame_entry *end = isnan(metric->to) ? last : nearest(&list, time, metric->to);
  if (status == TAL_OK && (!begin || !end || begin == end))
    status = tal_fail(why, TAL_BAD_INPUT, "no two frames for the window; give output.fields_every");
  if (status == TAL_OK) {
    const double to = isnan(metric->to) ? place_of(end, time) : metric->to, slack = (to - from) / 20;
    if (fabs(place_of(begin, time) - from) > slack || fabs(place_of(end, time) - to) > slack)
      status = tal_fail(why, TAL_BAD_INPUT,
                        "the frames nearest to %g and %g stand at %g and %g; give a shorter "
                        "output.fields_every",
                        from, to, place_of(begin, time), place_of(end, time));
  }
  if (status == TAL_OK)
    status = read_pair(out, begin, end, why);
  tal_frame_list_clear(&list);
  return status;
}

void tal_fluctuation_clear(tal_fluctuation *fluctuation) {
  free(fluctuation->id);
  free(fluctuation->u);
  free(fluctuation->v);
  *fluctuation = (tal_fluctuation){0};
}

double tal_fluctuation_correlation(const tal_fluctuation *a, const tal_fluctuation *b) {
  double aa = 0, bb = 0, ab = 0;
  size_t common = 0;
  for (size_t i = 0, j = 0; i < a->count && j < b->count;) {
    if (a->id[i] != b->id[j]) {
      *(a->id[i] < b->id[j] ? &i : &j) += 1;
      continue;
    }
    aa += a->u[i] * a->u[i] + a->v[i] * a->v[i];
    bb += b->u[j] * b->u[j] + b->v[j] * b->v[j];
    ab += a->u[i] * b->u[j] + a->v[i] * b->v[j];
    i++, j++, common++;
  }
  return common > 1 && aa > 0 && bb > 0 ? ab / sqrt(aa * bb) : (double)NAN;
}
