#include "forced.h"

#include "random.h"

#include <gsl/gsl_randist.h>
#include <stdlib.h>
#include <string.h>

// ---- which grain ----

// The grains of a slot, from the centres as they stand: overlaps are kept only where someone looks.
static bool touch(const tal_grains *g, int32_t i, int32_t j) {
  const double dx = g->x[i] - g->x[j], dy = g->y[i] - g->y[j], reach = g->r[i] + g->r[j];
  return dx * dx + dy * dy < reach * reach;
}

void tal_forced_contacts(const tal_sim *sim, int *count) {
  const tal_contacts *s = &sim->pairs, *w = &sim->wall_contacts;
  memset(count, 0, sim->grains.count * sizeof *count);
  for (size_t c = 0; c < s->count; c++)
    if (touch(&sim->grains, s->i[c], s->j[c])) {
      count[s->i[c]]++;
      count[s->j[c]]++;
    }
  for (size_t c = 0; c < w->count; c++)
    count[w->i[c]] += w->overlap[c] > 0;
}

// The nearest to the mean of all centres; rattlers only where nothing bears.
static tal_status nearest(const tal_sim *sim, size_t *index, tal_error *err) {
  const tal_grains *g = &sim->grains;
  int *touching = tal_alloc(g->count, sizeof *touching);
  double x = 0, y = 0, best[2] = {HUGE_VAL, HUGE_VAL};
  size_t found[2] = {0, 0};
  tal_forced_contacts(sim, touching);
  for (size_t i = 0; i < g->count; i++) {
    x += g->x[i] / (double)g->count;
    y += g->y[i] / (double)g->count;
  }
  for (size_t i = 0; i < g->count; i++) {
    const double distance = hypot(g->x[i] - x, g->y[i] - y);
    const int bears = touching[i] >= 2;
    if (g->inverse_mass[i] == 0 || !(distance < best[bears]))
      continue;
    best[bears] = distance;
    found[bears] = i;
  }
  free(touching);
  *index = isfinite(best[1]) ? found[1] : found[0];
  if (!isfinite(best[0]) && !isfinite(best[1]))
    return tal_fail(err, TAL_INVALID, "stages[%d].grain: no grain can be turned: all are fixed", (int)sim->run.stage);
  return TAL_OK;
}

static bool find(const tal_grains *g, int64_t id, size_t *index) {
  for (size_t i = 0; i < g->count; i++)
    if (g->id[i] == id) {
      *index = i;
      return true;
    }
  return false;
}

tal_status tal_forced_choose(const tal_sim *sim, const tal_scene_stage *plan, size_t *index, tal_error *err) {
  if (!plan->grain.count)
    return nearest(sim, index, err);
  if (find(&sim->grains, plan->grain.ids[0], index))
    return TAL_OK;
  return tal_fail(err, TAL_INVALID, "stages[%d].grain: %lld is no grain", (int)sim->run.stage,
                  (long long)plan->grain.ids[0]);
}

static tal_status refuse(const tal_sim *sim, size_t stage, tal_error *err, const char *what) {
  const tal_scene *scene = sim->scene;
  char line[24] = "";
  if (scene->stages[stage].line)
    snprintf(line, sizeof line, "%d:", scene->stages[stage].line);
  return tal_fail(err, TAL_BAD_INPUT, "%s:%s stages[%zu].grain: %s", scene->path, line, stage, what);
}

tal_status tal_forced_check(const tal_sim *sim, tal_error *err) {
  const tal_scene *scene = sim->scene;
  char what[120];
  for (size_t s = 0; s < scene->stage_count; s++)
    for (size_t k = 0; k < scene->stages[s].grain.count; k++) {
      const long long id = scene->stages[s].grain.ids[k];
      size_t index;
      if (!find(&sim->grains, id, &index)) {
        snprintf(what, sizeof what, "%lld is no grain; accepted: ids from 0 to %zu", id, sim->grains.count - 1);
        return refuse(sim, s, err, what);
      }
      if (sim->grains.inverse_mass[index] == 0) {
        snprintf(what, sizeof what, "%lld is a fixed grain: it keeps its spin; accepted: grains that are free", id);
        return refuse(sim, s, err, what);
      }
    }
  return TAL_OK;
}

// Distance [m] to the nearest node of the loop.
static double to_loop(const tal_sim *sim, size_t i) {
  const tal_grains *g = &sim->grains;
  double least = HUGE_VAL;
  for (size_t k = 0; sim->graph.valid && k < sim->graph.loop.count; k++) {
    const int32_t j = sim->graph.loop.node[k];
    least = fmin(least, hypot(g->x[i] - g->x[j], g->y[i] - g->y[j]));
  }
  return least;
}

static int ascending(const void *a, const void *b) {
  const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
  return (x > y) - (x < y);
}

tal_status tal_forced_draw(tal_sim *sim, const tal_scene_stage *plan, int64_t **ids, size_t *count, tal_error *err) {
  const tal_grains *g = &sim->grains;
  const double margin = plan->grain.margin * 2 * sim->constants.mean_radius;
  *count = plan->grain.count ? plan->grain.count : (size_t)plan->grain.random;
  *ids = tal_alloc(*count, sizeof **ids);
  if (plan->grain.count) {
    memcpy(*ids, plan->grain.ids, *count * sizeof **ids);
    return TAL_OK;
  }
  int *touching = tal_alloc(g->count, sizeof *touching);
  int64_t *fit = tal_alloc(g->count, sizeof *fit);
  size_t fits = 0;
  tal_forced_contacts(sim, touching);
  for (size_t i = 0; i < g->count; i++)
    if (g->inverse_mass[i] > 0 && touching[i] >= 2 && to_loop(sim, i) >= margin)
      fit[fits++] = g->id[i];
  free(touching);
  qsort(fit, fits, sizeof *fit, ascending); // the draw knows nothing of the order in memory
  if (fits >= *count) {
    gsl_rng *random = tal_random_stream(sim->scene->seed, TAL_STREAM_FORCED);
    gsl_ran_choose(random, *ids, *count, fit, fits, sizeof *fit);
    gsl_rng_free(random);
    qsort(*ids, *count, sizeof **ids, ascending);
  }
  free(fit);
  if (fits >= *count)
    return TAL_OK;
  char what[200];
  snprintf(what, sizeof what,
           "only %zu grains bear and lie at least %g mean diameters within the loop; accepted: random up to %zu, or a "
           "smaller margin",
           fits, plan->grain.margin, fits);
  free(*ids);
  *ids = NULL;
  return refuse(sim, (size_t)(plan - sim->scene->stages), err, what);
}

// ---- turning it ----

void tal_forced_take(tal_sim *sim, size_t index) {
  tal_grains *g = &sim->grains;
  sim->run.forced = (int64_t)index + 1;
  g->inverse_inertia[index] = 0;
  sim->run.held_work -= 0.5 * g->inertia[index] * g->omega[index] * g->omega[index];
  g->omega[index] = 0;
  g->torque[index] = 0;
}

void tal_forced_release(tal_sim *sim) {
  if (!sim->run.forced)
    return;
  const size_t i = (size_t)sim->run.forced - 1;
  sim->grains.inverse_inertia[i] = 1 / sim->grains.inertia[i];
  sim->run.forced = 0;
}

void tal_forced_turn(tal_sim *sim, double omega) {
  tal_grains *g = &sim->grains;
  const size_t i = (size_t)sim->run.forced - 1;
  const double before = g->omega[i];
  sim->run.held_work += 0.5 * g->inertia[i] * (omega - before) * (omega + before);
  g->theta[i] -= 0.5 * sim->dt * (omega - before); // the step adds dt omega
  g->omega[i] = omega;
}

void tal_forced_warning(const tal_sim *sim, char *text, size_t size) {
  *text = '\0';
  if (!sim->run.forced)
    return;
  const size_t i = (size_t)sim->run.forced - 1;
  const long long id = sim->grains.id[i];
  int *touching = tal_alloc(sim->grains.count, sizeof *touching);
  tal_forced_contacts(sim, touching);
  if (touching[i] < 2)
    snprintf(text, size,
             "the forced grain %lld is a rattler (%d contacts): there is next to nothing to transmit its spin", id,
             touching[i]);
  else if (to_loop(sim, i) == 0)
    snprintf(text, size, "the forced grain %lld lies on the rim: grains surround it on one side only", id);
  free(touching);
}
