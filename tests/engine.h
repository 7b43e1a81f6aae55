// Simulations from scene texts, for the tests of the engine. A text is put together in a draft, loaded through a
// temporary file that is gone before the first step, and owned together with its simulation.
#ifndef TAL_TEST_ENGINE_H
#define TAL_TEST_ENGINE_H

#include "sim.h"
#include <gsl/gsl_rng.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// A scene text being written: fprintf(draft.to, ...).
typedef struct draft {
  char *text;
  size_t size;
  FILE *to;
} draft;

typedef struct engine {
  tal_scene scene;
  tal_sim *sim;
} engine;

static inline draft *draft_begin(void) {
  draft *d = tal_alloc(1, sizeof *d);
  d->to = open_memstream(&d->text, &d->size);
  assert_non_null(d->to);
  return d;
}

static inline void draft_free(draft *d) {
  free(d->text);
  free(d);
}

// Loads and frees the draft; a scene that does not load fails the test.
static inline void draft_load(draft *d, tal_scene *scene) {
  const char *base = getenv("TMPDIR");
  char path[400];
  snprintf(path, sizeof path, "%.300s/talus-engine-XXXXXX", base && *base ? base : "/tmp");
  int fd = mkstemp(path);
  assert_true(fd >= 0);
  fclose(d->to);
  assert_int_equal(write(fd, d->text, d->size), d->size);
  close(fd);
  tal_scene_errors errors = {0};
  tal_status status = tal_scene_load(scene, path, NULL, 0, &errors);
  unlink(path);
  if (status != TAL_OK)
    fail_msg("%s\n%s", errors.item[0].text, d->text);
  draft_free(d);
}

// Loads the draft, frees it, packs and computes the first forces.
static inline engine *engine_start(draft *d) {
  engine *e = tal_alloc(1, sizeof *e);
  draft_load(d, &e->scene);
  tal_error err;
  if (tal_sim_create(&e->sim, &e->scene, &err) != TAL_OK)
    fail_msg("%s", err.text);
  return e;
}

static inline void engine_end(engine *e) {
  tal_sim_free(e->sim);
  tal_scene_clear(&e->scene);
  free(e);
}

static inline void engine_step(engine *e) {
  tal_error err;
  if (tal_sim_step(e->sim, &err) != TAL_OK)
    fail_msg("step %lld: %s", (long long)e->sim->run.step, err.text);
}

static inline void engine_steps(engine *e, int count) {
  for (int k = 0; k < count; k++)
    engine_step(e);
}

static inline void engine_finish(engine *e) {
  while (!tal_sim_done(e->sim))
    engine_step(e);
}

static inline tal_row engine_row(engine *e) {
  tal_row row;
  tal_sim_row(e->sim, &row);
  return row;
}

// Everything that moves, bit for bit.
static inline void assert_same_motion(const engine *a, const engine *b) {
  const tal_grains *g = &a->sim->grains, *h = &b->sim->grains;
  assert_int_equal(g->count, h->count);
  const double *of_a[] = {g->x, g->y, g->theta, g->vx, g->vy, g->omega};
  const double *of_b[] = {h->x, h->y, h->theta, h->vx, h->vy, h->omega};
  for (int k = 0; k < 6; k++)
    if (memcmp(of_a[k], of_b[k], g->count * sizeof(double)) != 0)
      fail_msg("array %d of x, y, theta, vx, vy, omega differs at step %lld", k, (long long)a->sim->run.step);
}

static inline double uniform(gsl_rng *random, double low, double high) {
  return low + (high - low) * gsl_rng_uniform(random);
}

// Slope of a least-squares line through (log x, log y).
static inline double log_slope(const double *x, const double *y, int count) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (int k = 0; k < count; k++) {
    double u = log(x[k]), v = log(y[k]);
    sx += u;
    sy += v;
    sxx += u * u;
    sxy += u * v;
  }
  return (count * sxy - sx * sy) / (count * sxx - sx * sx);
}

#endif
