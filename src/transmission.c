#include "transmission.h"

#include "random.h"

#include <gsl/gsl_fit.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double none = (double)NAN;

// ---- decay ----

enum { ROUNDS = 100 };

// The line ln mean = c0 + c1 r and its covariance for weights of one per variance.
typedef struct line {
  double c0, c1, cov00, cov01, cov11;
} line;

// (R7): the mean that keeps the sum and the first moment of the ratios, by reweighted linear least squares.
static bool settle(const double *r, const double *ratio, size_t count, line *out) {
  double *weight = tal_alloc(2 * count, sizeof *weight), *response = weight + count, sum = 0, change = 1;
  for (size_t k = 0; k < count; k++)
    sum += ratio[k] / (double)count;
  *out = (line){.c0 = log(sum)};
  for (int round = 0; sum > 0 && round < ROUNDS && change > 1e-13; round++) {
    double chi, before = out->c1;
    for (size_t k = 0; k < count; k++) {
      const double value = out->c0 + out->c1 * r[k], mean = exp(fmax(value, -600));
      weight[k] = mean;
      response[k] = value + (ratio[k] - mean) / mean;
    }
    gsl_fit_wlinear(r, 1, weight, 1, response, 1, count, &out->c0, &out->c1, &out->cov00, &out->cov01, &out->cov11,
                    &chi);
    change = fabs(out->c1 - before) / fmax(fabs(out->c1), 1e-300);
  }
  free(weight);
  return sum > 0 && change < 1e-6 && isfinite(out->c0);
}

// (R8): variances of c0 and c1 from the scatter there is, each residual over 1 less its leverage.
static void scatter(const double *r, const double *ratio, size_t count, const line *fit, double variance[2]) {
  double m00 = 0, m01 = 0, m11 = 0;
  for (size_t k = 0; k < count; k++) {
    const double mean = exp(fit->c0 + fit->c1 * r[k]);
    const double leverage = mean * (fit->cov00 + 2 * r[k] * fit->cov01 + r[k] * r[k] * fit->cov11);
    const double e = (ratio[k] - mean) / fmax(1 - leverage, 1e-3);
    m00 += e * e;
    m01 += e * e * r[k];
    m11 += e * e * r[k] * r[k];
  }
  const double c[2][2] = {{fit->cov00, fit->cov01}, {fit->cov01, fit->cov11}};
  for (int p = 0; p < 2; p++)
    variance[p] = c[p][0] * c[p][0] * m00 + 2 * c[p][0] * c[p][1] * m01 + c[p][1] * c[p][1] * m11;
}

bool tal_decay_fit(const double *r, const double *ratio, size_t count, tal_decay *decay) {
  line fit;
  double variance[2];
  *decay = (tal_decay){none, none, none, none, 0};
  if (count < 5 || !settle(r, ratio, count, &fit) || !(fit.c1 < 0))
    return false;
  scatter(r, ratio, count, &fit, variance);
  *decay = (tal_decay){exp(fit.c0), exp(fit.c0) * sqrt(variance[0]), -1 / fit.c1, sqrt(variance[1]) / (fit.c1 * fit.c1),
                       count};
  return true;
}

double tal_influence_radius(const double *r, const double *ratio, size_t count) {
  double furthest = 0;
  for (size_t k = 0; k < count; k++)
    if (ratio[k] >= TAL_INFLUENCE)
      furthest = fmax(furthest, r[k]);
  return furthest;
}

void tal_sector_transmission(const tal_decay *decay, const double *r, const double *ratio, const size_t *sector,
                             size_t points, size_t count, double *transmission, size_t *used) {
  double *expected = tal_alloc(count, sizeof *expected);
  memset(transmission, 0, count * sizeof *transmission);
  if (used)
    memset(used, 0, count * sizeof *used);
  for (size_t k = 0; k < points; k++) {
    transmission[sector[k]] += ratio[k];
    expected[sector[k]] += decay->amplitude * exp(-r[k] / decay->length);
    if (used)
      used[sector[k]]++;
  }
  for (size_t s = 0; s < count; s++)
    transmission[s] = expected[s] > 0 ? transmission[s] / expected[s] : none;
  free(expected);
}

// ---- sectors ----

enum { REPLICATES = 2000, QUANTITIES = 6 };

// Weighted sums over sectors: transmission t, along w, across o.
typedef struct moments {
  double n, t, w, o, tt, ww, oo, tw, to, wo;
} moments;

static void add(moments *m, const tal_sector *s, double weight) {
  const double t = s->transmission, w = s->along, o = s->across;
  m->n += weight;
  m->t += weight * t;
  m->w += weight * w;
  m->o += weight * o;
  m->tt += weight * t * t;
  m->ww += weight * w * w;
  m->oo += weight * o * o;
  m->tw += weight * t * w;
  m->to += weight * t * o;
  m->wo += weight * w * o;
}

static double covariance(double xy, double x, double y, double n) {
  return xy / n - x / n * (y / n);
}

// (R11) from the moments; the quarters' means come in [4] and [5].
static void quantities(const moments *m, const double quarter[2][2], double out[QUANTITIES]) {
  const double vt = covariance(m->tt, m->t, m->t, m->n), vw = covariance(m->ww, m->w, m->w, m->n);
  const double vo = covariance(m->oo, m->o, m->o, m->n);
  const double rw = covariance(m->tw, m->t, m->w, m->n) / sqrt(vt * vw);
  const double ro = covariance(m->to, m->t, m->o, m->n) / sqrt(vt * vo);
  const double both = covariance(m->wo, m->w, m->o, m->n) / sqrt(vw * vo);
  out[0] = rw;
  out[1] = ro;
  out[2] = (rw - both * ro) / (1 - both * both);
  out[3] = (ro - both * rw) / (1 - both * both);
  for (int q = 0; q < 2; q++)
    out[4 + q] = quarter[q][0] > 0 ? quarter[q][1] / quarter[q][0] : none;
}

static int ascending(const void *a, const void *b) {
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static double share_of(double *value, size_t count, double share) {
  qsort(value, count, sizeof *value, ascending);
  return count ? gsl_stats_quantile_from_sorted_data(value, 1, count, share) : none;
}

static bool good(const tal_sector *s) {
  return isfinite(s->transmission) && isfinite(s->along) && isfinite(s->across);
}

static void evaluate(const tal_sector *sector, size_t count, const double *weight, const double limit[2],
                     double out[QUANTITIES]) {
  moments m = {0};
  double quarter[2][2] = {{0}};
  for (size_t k = 0; k < count; k++) {
    const double w = weight ? weight[sector[k].grain] : 1;
    if (!good(&sector[k]) || w == 0)
      continue;
    add(&m, &sector[k], w);
    for (int q = 0; q < 2; q++)
      if (q ? sector[k].across >= limit[1] : sector[k].across <= limit[0]) {
        quarter[q][0] += w;
        quarter[q][1] += w * sector[k].transmission;
      }
  }
  quantities(&m, (const double(*)[2])quarter, out);
}

// Draws samples with return, and within each its grains with return (R12): how often each grain comes up.
static void draw(gsl_rng *random, const size_t *sample, size_t grains, size_t samples, double *weight) {
  memset(weight, 0, grains * sizeof *weight);
  for (size_t k = 0; k < samples; k++) {
    const size_t chosen = samples > 1 ? gsl_rng_uniform_int(random, samples) : 0;
    size_t first = 0, members = 0;
    for (size_t g = 0; g < grains; g++) {
      if (sample[g] == chosen && !members++)
        first = g;
    }
    for (size_t g = 0; g < members; g++) // the grains of a sample stand together
      weight[first + gsl_rng_uniform_int(random, members)] += 1;
  }
}

static size_t largest_of(const size_t *value, size_t count) {
  size_t largest = 0;
  for (size_t k = 0; k < count; k++)
    largest = value[k] > largest ? value[k] : largest;
  return largest;
}

// Quantiles of the replicates, those that are no number left out.
static tal_interval interval(double value, double *replicate, size_t count, double confidence) {
  size_t kept = 0;
  for (size_t k = 0; k < count; k++)
    if (isfinite(replicate[k]))
      replicate[kept++] = replicate[k];
  const double tail = 0.5 * (1 - confidence);
  double low = share_of(replicate, kept, tail);
  return (tal_interval){value, low, kept ? gsl_stats_quantile_from_sorted_data(replicate, 1, kept, 1 - tail) : none};
}

void tal_sector_statistics_of(const tal_sector *sector, size_t count, double confidence, uint64_t seed,
                              tal_sector_statistics *out) {
  *out = (tal_sector_statistics){0};
  double *across = tal_alloc(count, sizeof *across);
  for (size_t k = 0; k < count; k++) {
    if (good(&sector[k]))
      across[out->sectors++] = sector[k].across;
    out->grains = sector[k].grain + 1 > out->grains ? sector[k].grain + 1 : out->grains;
    out->samples = sector[k].sample + 1 > out->samples ? sector[k].sample + 1 : out->samples;
  }
  const double limit[2] = {share_of(across, out->sectors, 0.25), share_of(across, out->sectors, 0.75)};
  free(across);
  double value[QUANTITIES], *replicate[QUANTITIES], each[QUANTITIES];
  evaluate(sector, count, NULL, limit, value);
  const size_t replicates = out->grains >= 3 ? REPLICATES : 0;
  size_t *sample = tal_alloc(out->grains, sizeof *sample);
  double *weight = tal_alloc(out->grains, sizeof *weight);
  for (size_t k = 0; k < count; k++)
    sample[sector[k].grain] = sector[k].sample;
  for (int q = 0; q < QUANTITIES; q++)
    replicate[q] = tal_alloc(REPLICATES, sizeof(double));
  gsl_rng *random = tal_random_stream(seed, TAL_STREAM_BOOTSTRAP);
  for (size_t b = 0; b < replicates; b++) {
    draw(random, sample, out->grains, out->samples, weight);
    evaluate(sector, count, weight, limit, each);
    for (int q = 0; q < QUANTITIES; q++)
      replicate[q][b] = each[q];
  }
  gsl_rng_free(random);
  tal_interval *const into[QUANTITIES] = {&out->along,        &out->across, &out->along_slope,
                                          &out->across_slope, &out->open,   &out->blocked};
  for (int q = 0; q < QUANTITIES; q++) {
    *into[q] = interval(value[q], replicate[q], replicates, confidence);
    free(replicate[q]);
  }
  free(sample);
  free(weight);
}

tal_interval tal_mean_interval(const double *value, const size_t *sample, size_t count, double confidence,
                               uint64_t seed) {
  double *weight = tal_alloc(count, sizeof *weight), *replicate = tal_alloc(REPLICATES, sizeof *replicate);
  const size_t samples = count ? largest_of(sample, count) + 1 : 0, replicates = count >= 3 ? REPLICATES : 0;
  gsl_rng *random = tal_random_stream(seed, TAL_STREAM_BOOTSTRAP);
  double mean = none;
  for (size_t b = 0; b <= replicates && count; b++) {
    if (b)
      draw(random, sample, count, samples, weight);
    double sum = 0, all = 0;
    for (size_t k = 0; k < count; k++) {
      if (!isfinite(value[k]))
        continue;
      const double w = b ? weight[k] : 1;
      sum += w * value[k];
      all += w;
    }
    const double here = all > 0 ? sum / all : none;
    if (b)
      replicate[b - 1] = here;
    else
      mean = here;
  }
  gsl_rng_free(random);
  tal_interval out = interval(mean, replicate, replicates, confidence);
  free(weight);
  free(replicate);
  return out;
}
