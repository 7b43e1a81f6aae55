#include "critical.h"

#include "boundary.h"
#include "damping.h"
#include "effects.h"
#include "law.h"

#include <stdlib.h>
#include <string.h>

// (lambda/4) dt^2 + gamma dt = 1 with lambda = k/m and gamma = c/m: where the amplification of verlet with predicted
// velocities reaches -1.
static double limit(double lambda, double gamma) {
  if (lambda <= 0)
    return gamma > 0 ? 1 / gamma : (double)INFINITY;
  double half = 2 * gamma / lambda;
  return 4 / lambda / (half + sqrt(half * half + 4 / lambda));
}

double tal_critical_step_pair(double stiffness, double damping, double reduced_mass) {
  return limit(stiffness / reduced_mass, damping / reduced_mass);
}

typedef struct pair_gap {
  double reach, square; // sum of the radii; square of the distance
} pair_gap;

// Of a grain-grain slot, from the centres as they stand.
static pair_gap pair_of(const tal_sim *sim, size_t c) {
  const tal_grains *g = &sim->grains;
  const int32_t i = sim->pairs.i[c], j = sim->pairs.j[c];
  double dx = g->x[i] - g->x[j], dy = g->y[i] - g->y[j];
  return (pair_gap){g->r[i] + g->r[j], dx * dx + dy * dy};
}

static bool touches(pair_gap gap) {
  return gap.square < gap.reach * gap.reach;
}

// What the slopes of all slots have in common.
typedef struct slopes {
  bool hertz, damped, own; // own: each slot has a damping of its own
  double damping_time;     // [s] damping over stiffness, else
} slopes;

static slopes slopes_of(const tal_sim *sim, const tal_contacts *s) {
  // solved damping is stable for any step
  const bool damped = (sim->effects & TAL_EFFECT_DAMPING) && !(sim->effects & TAL_EFFECT_IMPLICIT);
  return (slopes){.hertz = sim->effects & TAL_EFFECT_HERTZ,
                  .damped = damped,
                  .own = s->damping != NULL,
                  .damping_time = tal_damping_time_of_slots(sim)};
}

// Tangent stiffness and damping of a touching slot.
static inline void slot_slopes(slopes of, const tal_contacts *s, size_t c, double overlap, double *stiffness,
                               double *damping) {
  const double root = of.hertz ? sqrt(overlap) : 1, own = of.own ? s->damping[c] : of.damping_time * s->stiffness[c];
  *stiffness = of.hertz ? tal_hertz_slope(s->stiffness[c], root) : s->stiffness[c];
  *damping = of.damped ? own * root : 0;
}

// How much stiffer than the normal spring the tangential one is to grain i, turning included; at least 1.
static double sideways(const tal_sim *sim, size_t i) {
  const tal_grains *g = &sim->grains;
  double turning = sim->effects & TAL_EFFECT_SPIN ? 1 + g->mass[i] * g->r[i] * g->r[i] / g->inertia[i] : 1;
  return fmax(1, sim->constants.tangential_ratio * turning);
}

// Tangent stiffness and damping of all contacts of each grain.
static void add_up(const tal_sim *sim, double (*sum)[2]) {
  const tal_contacts *s = &sim->pairs, *w = &sim->wall_contacts;
  const slopes of_pairs = slopes_of(sim, s), of_walls = slopes_of(sim, w);
  double k, d;
  for (size_t c = 0; c < s->count; c++) { // without a branch: which slots touch is hard to foresee
    const pair_gap gap = pair_of(sim, c);
    const double overlap = gap.reach - sqrt(gap.square), share = touches(gap);
    slot_slopes(of_pairs, s, c, overlap > 0 ? overlap : 0, &k, &d);
    k *= share;
    d *= share;
    sum[s->i[c]][0] += k;
    sum[s->i[c]][1] += d;
    sum[s->j[c]][0] += k;
    sum[s->j[c]][1] += d;
  }
  for (size_t c = 0; c < w->count; c++) {
    if (w->overlap[c] <= 0)
      continue;
    slot_slopes(of_walls, w, c, w->overlap[c], &k, &d);
    sum[w->i[c]][0] += k;
    sum[w->i[c]][1] += d;
  }
  if (sim->effects & TAL_EFFECT_SPRING && !(sim->effects & TAL_EFFECT_IMPLICIT))
    for (size_t i = 0; i < sim->grains.count; i++)
      sum[i][0] *= sideways(sim, i);
}

typedef struct least_step {
  double step;
  int64_t grain;
} least_step;

// A limit is worked out only where its polynomial says that it is below the least so far.
static bool below(double lambda, double gamma, double step) {
  return isfinite(step) ? (0.25 * lambda * step + gamma) * step > 1 : lambda > 0 || gamma > 0;
}

double tal_critical_step_where(const tal_sim *sim, int64_t *grain) {
  const tal_grains *g = &sim->grains;
  const tal_contacts *s = &sim->pairs, *w = &sim->wall_contacts;
  double(*sum)[2] = tal_alloc(g->count, sizeof *sum);
  least_step least = {(double)INFINITY, -1};
  add_up(sim, sum);
  if (sim->boundary && sim->boundary->critical)
    least.step = sim->boundary->critical(sim, sum);
  for (size_t i = 0; i < g->count; i++) {
    sum[i][0] *= g->inverse_mass[i];
    sum[i][1] *= g->inverse_mass[i];
  }
  for (size_t c = 0; c < s->count; c++) {
    const double *a = sum[s->i[c]], *b = sum[s->j[c]];
    if (below(a[0] + b[0], a[1] + b[1], least.step) && touches(pair_of(sim, c)))
      least = (least_step){limit(a[0] + b[0], a[1] + b[1]), g->id[s->i[c]]};
  }
  for (size_t c = 0; c < w->count; c++) {
    const double *a = sum[w->i[c]];
    if (w->overlap[c] > 0 && below(a[0], a[1], least.step))
      least = (least_step){limit(a[0], a[1]), g->id[w->i[c]]};
  }
  free(sum);
  *grain = least.grain;
  return least.step;
}

double tal_critical_step(const tal_sim *sim) {
  int64_t grain;
  return tal_critical_step_where(sim, &grain);
}

double tal_quasistatic_coefficient(const tal_sim *sim, double rate, double pressure, double height) {
  const tal_constants *k = &sim->constants;
  double force = pressure * 2 * k->mean_radius * k->thickness;
  return k->mean_mass * (rate * height / 2) * rate / force * sqrt(2 * (double)sim->grains.count);
}

double tal_largest_overlap(const tal_sim *sim, int64_t *grain) {
  const tal_grains *g = &sim->grains;
  const tal_contacts *s = &sim->pairs, *w = &sim->wall_contacts;
  double largest = 0;
  *grain = -1;
  for (size_t c = 0; c < s->count; c++) {
    const pair_gap gap = pair_of(sim, c);
    const double ri = g->r[s->i[c]], rj = g->r[s->j[c]], smaller = ri < rj ? ri : rj;
    const double within = gap.reach - largest * smaller;
    if (within > 0 && gap.square < within * within) {
      largest = (gap.reach - sqrt(gap.square)) / smaller;
      *grain = g->id[s->i[c]];
    }
  }
  for (size_t c = 0; c < w->count; c++) {
    const double share = w->overlap[c] / g->r[w->i[c]];
    if (share > largest) {
      largest = share;
      *grain = g->id[w->i[c]];
    }
  }
  return largest;
}

// Overlap of two mean grains that carry the mean contact force p 2R h of a confined assembly [P 2.2].
static double confined_slope(const tal_scene *scene, const tal_constants *k, double pressure, double *damping) {
  double stiffness = tal_hertz_stiffness(k->modulus, k->modulus, k->mean_radius / 2);
  double overlap = pow(pressure * 2 * k->mean_radius * k->thickness / stiffness, 2.0 / 3);
  *damping = tal_damping_coefficient(scene, k, stiffness, k->mean_mass / 2) * sqrt(overlap);
  return tal_hertz_slope(stiffness, sqrt(overlap));
}

double tal_critical_step_scene(const tal_scene *scene, const tal_constants *k, double reduced_mass, bool damped) {
  if (strcmp(scene->contact.normal, "linear") == 0) {
    double stiffness = scene->contact.stiffness;
    double damping = damped ? tal_damping_coefficient(scene, k, stiffness, reduced_mass) : 0;
    return tal_critical_step_pair(stiffness, damping, reduced_mass);
  }
  double least = (double)INFINITY;
  for (size_t s = 0; s < scene->stage_count; s++) {
    if (!(scene->stages[s].pressure > 0))
      continue;
    double damping, slope = confined_slope(scene, k, scene->stages[s].pressure, &damping);
    least = fmin(least, tal_critical_step_pair(slope, damped ? damping : 0, k->mean_mass / 2));
  }
  return least;
}

double tal_friction_step(const tal_sim *sim, double pressure) {
  const tal_constants *k = &sim->constants;
  double cap = sim->scene->material.friction * pressure * 2 * k->mean_radius * k->thickness;
  if (strcmp(sim->scene->contact.tangential, "regularised") != 0 || !(cap > 0))
    return (double)INFINITY;
  // two free grains: the slip answers a tangential force with 2 (1/m + R^2/I)
  double turning = sim->scene->grains.shape == TAL_DISK ? 2 : 2.5;
  double answer = 2 * (1 + (sim->scene->rotation ? turning : 0));
  return k->vR * k->mean_mass / (answer * cap);
}
