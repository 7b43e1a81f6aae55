// See measure_bands.h.
#include "measure_bands.h"

#include "measure_fit.h"
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- fields ----

tal_field tal_field_create(size_t capacity) {
  double *all = tal_alloc(4 * capacity + 1, sizeof *all);
  return (tal_field){0, all, all + capacity, all + 2 * capacity, all + 3 * capacity};
}

void tal_field_add(tal_field *field, double x, double y, double value, double weight) {
  const size_t k = field->count++;
  field->x[k] = x;
  field->y[k] = y;
  field->value[k] = value;
  field->weight[k] = weight;
}

void tal_field_clear(tal_field *field) {
  free(field->x);
  *field = (tal_field){0};
}

typedef struct summary {
  double weight, x, y, mean, variance, radius; // radius: largest distance from the middle
} summary;

static summary summarise(const tal_field *f) {
  summary s = {0};
  for (size_t k = 0; k < f->count; k++) {
    s.weight += f->weight[k];
    s.x += f->weight[k] * f->x[k];
    s.y += f->weight[k] * f->y[k];
    s.mean += f->weight[k] * f->value[k];
  }
  const double one = s.weight > 0 ? 1 / s.weight : 0;
  s.x *= one, s.y *= one, s.mean *= one;
  for (size_t k = 0; k < f->count; k++) {
    s.variance += one * f->weight[k] * (f->value[k] - s.mean) * (f->value[k] - s.mean);
    s.radius = fmax(s.radius, hypot(f->x[k] - s.x, f->y[k] - s.y));
  }
  return s;
}

// ---- profiles ----

static void strip_range(const tal_field *f, double angle, double range[2]) {
  range[0] = HUGE_VAL;
  range[1] = -HUGE_VAL;
  const double c = cos(angle), d = sin(angle);
  for (size_t k = 0; k < f->count; k++) {
    const double s = f->x[k] * c + f->y[k] * d;
    range[0] = fmin(range[0], s);
    range[1] = fmax(range[1], s);
  }
}

tal_profile tal_profile_across(const tal_field *f, double angle, double strip) {
  tal_profile p = {.width = strip};
  double range[2], weight[TAL_PROFILE_MOST] = {0}, square[TAL_PROFILE_MOST] = {0}, squares[TAL_PROFILE_MOST] = {0};
  strip_range(f, angle, range);
  if (f->count == 0 || !(strip > 0))
    return p;
  p.width = fmax(strip, (range[1] - range[0]) / (TAL_PROFILE_MOST - 1));
  p.count = (size_t)((range[1] - range[0]) / p.width) + 1;
  for (size_t k = 0; k < f->count; k++) {
    const double w = f->weight[k], v = f->value[k];
    const size_t at = (size_t)((f->x[k] * cos(angle) + f->y[k] * sin(angle) - range[0]) / p.width);
    const size_t b = at < p.count ? at : p.count - 1;
    weight[b] += w;
    p.mean[b] += w * v;
    square[b] += w * v * v;
    squares[b] += w * w;
    p.points[b]++;
  }
  for (size_t b = 0; b < p.count; b++) {
    p.s[b] = range[0] + ((double)b + 0.5) * p.width;
    p.mean[b] = weight[b] > 0 ? p.mean[b] / weight[b] : 0;
    const double spread = weight[b] > 0 ? fmax(0, square[b] / weight[b] - p.mean[b] * p.mean[b]) : 0;
    p.error[b] = p.points[b] > 1 ? sqrt(spread * squares[b]) / weight[b] : 0;
  }
  return p;
}

// ---- the band ----

enum { BASE, HEIGHT, PLACE, LOG_SIGMA, ANGLE, PARAMETERS }; // lengths over the mean diameter, from the middle

typedef struct points {
  size_t count;
  const double *x, *y; // [count] over the mean diameter, from the middle
} points;

static void band_model(void *context, const double *p, double *value) {
  const points *at = context;
  const double c = cos(p[ANGLE]), d = sin(p[ANGLE]), narrow = exp(-2 * p[LOG_SIGMA]) / 2;
  for (size_t k = 0; k < at->count; k++) {
    const double s = at->x[k] * c + at->y[k] * d - p[PLACE];
    value[k] = p[BASE] + p[HEIGHT] * exp(-s * s * narrow);
  }
}

// Gauss curves of a set of widths at whole numbers of strips from their middle, cut off where they are nothing.
enum { WIDTHS = 4, REACH = 8 };
static const double sigmas[WIDTHS] = {1, 2, 4, 8};
typedef struct curves {
  double value[WIDTHS][TAL_PROFILE_MOST];
  size_t reach[WIDTHS];
} curves;

static void lay_curves(curves *c, const tal_profile *p) {
  for (size_t w = 0; w < WIDTHS; w++) {
    c->reach[w] = 0;
    for (size_t k = 0; k < p->count && (double)k * p->width <= REACH * sigmas[w]; k++) {
      const double s = (double)k * p->width / sigmas[w];
      c->value[w][k] = exp(-s * s / 2);
      c->reach[w] = k;
    }
  }
}

// For a profile and the curve of one width in the middle of one strip, base and height by linear least squares; n and
// v1 are the sums of the points and of their values. Returns how much of the squares they take away.
static double fit_linear(const tal_profile *p, const curves *c, size_t middle, size_t width, double n, double v1,
                         double parameter[PARAMETERS]) {
  const size_t reach = c->reach[width], first = middle > reach ? middle - reach : 0,
               last = middle + reach < p->count ? middle + reach : p->count - 1;
  double g1 = 0, g2 = 0, gv = 0;
  for (size_t b = first; b <= last; b++) {
    const double g = c->value[width][b < middle ? middle - b : b - middle], wg = (double)p->points[b] * g;
    g1 += wg;
    g2 += wg * g;
    gv += wg * p->mean[b];
  }
  const double spread = g2 - g1 * g1 / n, together = gv - g1 * v1 / n;
  parameter[HEIGHT] = spread > 1e-9 * n ? together / spread : 0;
  parameter[BASE] = (v1 - parameter[HEIGHT] * g1) / n;
  parameter[PLACE] = p->s[middle];
  parameter[LOG_SIGMA] = log(sigmas[width]);
  return parameter[HEIGHT] > 0 ? together * parameter[HEIGHT] : 0;
}

// The best of all directions in steps of 4 degrees, places, and widths.
static void scan(const tal_field *scaled, double parameter[PARAMETERS]) {
  double most = -1, one[PARAMETERS];
  curves *c = tal_alloc(1, sizeof *c);
  for (int k = 0; k < 45; k++) {
    one[ANGLE] = TAL_PI * k / 45;
    const tal_profile p = tal_profile_across(scaled, one[ANGLE], 1);
    double n = 0, v1 = 0;
    for (size_t b = 0; b < p.count; b++) {
      n += (double)p.points[b];
      v1 += (double)p.points[b] * p.mean[b];
    }
    lay_curves(c, &p);
    for (size_t b = 0; b < p.count; b++)
      for (size_t w = 0; w < WIDTHS; w++) {
        const double gain = fit_linear(&p, c, b, w, n, v1, one);
        if (!(gain > most))
          continue;
        most = gain;
        memcpy(parameter, one, sizeof one);
      }
  }
  free(c);
}

static tal_fit solve(const tal_field *scaled, const double start[PARAMETERS]) {
  points at = {scaled->count, scaled->x, scaled->y};
  tal_fit fit = {0};
  memcpy(fit.parameter, start, PARAMETERS * sizeof *start);
  tal_fit_solve(&fit, PARAMETERS, band_model, &at, scaled->value, scaled->weight, scaled->count);
  return fit;
}

enum { LENGTHS = 8 };

// Spread of the parameters when the points of one length of the band after the other count nothing (M34).
static void jackknife(tal_field *scaled, const tal_fit *fit, double error[PARAMETERS]) {
  const size_t n = scaled->count;
  double value[LENGTHS][PARAMETERS], *along = tal_alloc(n, sizeof *along);
  double *weight = memcpy(tal_alloc(n, sizeof *weight), scaled->weight, n * sizeof *weight);
  size_t *order = tal_alloc(n, sizeof *order);
  for (size_t k = 0; k < n; k++)
    along[k] = scaled->y[k] * cos(fit->parameter[ANGLE]) - scaled->x[k] * sin(fit->parameter[ANGLE]);
  gsl_sort_index(order, along, 1, n);
  for (size_t length = 0; length < LENGTHS; length++) {
    memcpy(scaled->weight, weight, n * sizeof *weight);
    for (size_t k = n * length / LENGTHS; k < n * (length + 1) / LENGTHS; k++)
      scaled->weight[order[k]] = 0;
    const tal_fit left = solve(scaled, fit->parameter);
    memcpy(value[length], left.parameter, sizeof value[length]);
  }
  memcpy(scaled->weight, weight, n * sizeof *weight);
  for (size_t p = 0; p < PARAMETERS; p++)
    error[p] = sqrt((LENGTHS - 1.0) * gsl_stats_variance(&value[0][p], PARAMETERS, LENGTHS) * (LENGTHS - 1) / LENGTHS);
  free(along);
  free(weight);
  free(order);
}

// How much more of the field lies within the width than its share of the area says.
static double concentration(const tal_field *scaled, const tal_fit *fit) {
  const double half = sqrt(2 * log(2)) * exp(fit->parameter[LOG_SIGMA]);
  double inside = 0, area = 0, all = 0, whole = 0;
  for (size_t k = 0; k < scaled->count; k++) {
    const double s = scaled->x[k] * cos(fit->parameter[ANGLE]) + scaled->y[k] * sin(fit->parameter[ANGLE]);
    const bool in = fabs(s - fit->parameter[PLACE]) < half;
    inside += in ? scaled->weight[k] * scaled->value[k] : 0;
    area += in ? scaled->weight[k] : 0;
    all += scaled->weight[k] * scaled->value[k];
    whole += scaled->weight[k];
  }
  return area > 0 && all > 0 ? inside / all / (area / whole) : 0;
}

static tal_band band_of(const tal_field *scaled, const tal_fit *fit, const double error[PARAMETERS], summary middle,
                        double diameter, double scale) {
  const double *p = fit->parameter, full = 2 * sqrt(2 * log(2));
  double range[2];
  strip_range(scaled, p[ANGLE], range);
  tal_band band = {.axis_error = error[ANGLE], .place_error = error[PLACE] * diameter};
  band.axis = fmod(fmod(p[ANGLE] + TAL_PI / 2, TAL_PI) + TAL_PI, TAL_PI);
  band.x = middle.x + p[PLACE] * diameter * cos(p[ANGLE]);
  band.y = middle.y + p[PLACE] * diameter * sin(p[ANGLE]);
  band.width = full * exp(p[LOG_SIGMA]) * diameter;
  band.width_error = error[LOG_SIGMA] * band.width;
  band.base = p[BASE] * scale;
  band.height = p[HEIGHT] * scale;
  band.height_error = error[HEIGHT] * scale;
  const summary fitted = summarise(scaled);
  band.explained = fmax(0, 1 - fit->residual / (fitted.variance * fitted.weight));
  band.concentration = concentration(scaled, fit);
  band.found = p[HEIGHT] > 2 * error[HEIGHT] && band.width >= diameter &&
               band.width < 0.5 * (range[1] - range[0]) * diameter && p[PLACE] > range[0] && p[PLACE] < range[1];
  return band;
}

// Points merged into square boxes, about `most` of them, so that the fit's cost does not grow with the sample.
static void merge(tal_field *field, double most) {
  double x[2], y[2];
  strip_range(field, 0, x);
  strip_range(field, TAL_PI / 2, y);
  const double side = sqrt((x[1] - x[0]) * (y[1] - y[0]) / most);
  if ((double)field->count <= most || !(side > 0))
    return;
  const size_t columns = (size_t)((x[1] - x[0]) / side) + 1, rows = (size_t)((y[1] - y[0]) / side) + 1;
  tal_field boxes = tal_field_create(columns * rows);
  for (size_t k = 0; k < field->count; k++) {
    const double w = field->weight[k];
    const size_t b = (size_t)((field->y[k] - y[0]) / side) * columns + (size_t)((field->x[k] - x[0]) / side);
    const size_t at = b < columns * rows ? b : columns * rows - 1;
    boxes.weight[at] += w;
    boxes.x[at] += w * field->x[k];
    boxes.y[at] += w * field->y[k];
    boxes.value[at] += w * field->value[k];
  }
  for (size_t b = 0; b < columns * rows; b++)
    if (boxes.weight[b] > 0)
      tal_field_add(&boxes, boxes.x[b] / boxes.weight[b], boxes.y[b] / boxes.weight[b],
                    boxes.value[b] / boxes.weight[b], boxes.weight[b]);
  tal_field_clear(field);
  *field = boxes;
}

tal_band tal_band_fit(const tal_field *field, double diameter) {
  const summary middle = summarise(field);
  enum { LEAST = 30 };
  if (field->count < LEAST || !(middle.variance > 0) || !(diameter > 0))
    return (tal_band){0};
  const double scale = sqrt(middle.variance);
  tal_field scaled = tal_field_create(field->count);
  for (size_t k = 0; k < field->count; k++)
    tal_field_add(&scaled, (field->x[k] - middle.x) / diameter, (field->y[k] - middle.y) / diameter,
                  field->value[k] / scale, field->weight[k]);
  enum { MOST = 5000 };
  merge(&scaled, MOST);
  double start[PARAMETERS] = {0}, error[PARAMETERS];
  scan(&scaled, start);
  const tal_fit fit = solve(&scaled, start);
  jackknife(&scaled, &fit, error);
  tal_band band = band_of(&scaled, &fit, error, middle, diameter, scale);
  tal_field_clear(&scaled);
  return band;
}

// ---- persistence ----

void tal_windows_add(tal_windows *windows, const double *box_value) {
  double *value = memcpy(tal_alloc(windows->boxes, sizeof *value), box_value, windows->boxes * sizeof *value);
  windows->value = tal_grow(windows->value, windows->count, windows->count + 1, sizeof value);
  windows->value[windows->count++] = value;
}

void tal_windows_clear(tal_windows *windows) {
  for (size_t k = 0; k < windows->count; k++)
    free(windows->value[k]);
  free(windows->value);
  *windows = (tal_windows){0};
}

// Pearson's correlation over the boxes that both have; NAN when there are too few.
static double correlate(const double *a, const double *b, size_t count) {
  enum { LEAST = 8 };
  double *both = tal_alloc(2 * count, sizeof *both), result = (double)NAN;
  size_t n = 0;
  for (size_t k = 0; k < count; k++)
    if (isfinite(a[k]) && isfinite(b[k])) {
      both[n] = a[k];
      both[count + n++] = b[k];
    }
  if (n >= LEAST && gsl_stats_variance(both, 1, n) > 0 && gsl_stats_variance(both + count, 1, n) > 0)
    result = gsl_stats_correlation(both, 1, both + count, 1, n);
  free(both);
  return result;
}

tal_persistence tal_windows_persist(const tal_windows *windows, size_t lag) {
  tal_persistence p = {0};
  double *value = tal_alloc(windows->count + 1, sizeof *value);
  for (size_t k = 0; k + lag < windows->count; k++) {
    const double r = correlate(windows->value[k], windows->value[k + lag], windows->boxes);
    if (isfinite(r))
      value[p.pairs++] = r;
  }
  if (p.pairs)
    p.correlation = gsl_stats_mean(value, 1, p.pairs);
  if (p.pairs > 1)
    p.error = gsl_stats_sd(value, 1, p.pairs) / sqrt((double)p.pairs);
  free(value);
  return p;
}
