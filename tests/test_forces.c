// The hot loop against the plain way: a step that kicks grains as their contacts are done gives the bits of a sweep
// that keeps every force followed by sums grain by grain, for every law, order of the grains and number of threads.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "engine.h"
#include "forces.h"
#include "integrate.h"
#include "kick.h"
#include "walls_load.h"
#include <omp.h>

enum { COLUMNS = 25, GRAINS = 1200, STEPS = 40 };

typedef struct layout {
  const char *name;
  int stride;     // the k-th grain of the list stands at place k * stride modulo GRAINS
  double pitch;   // [m] distance of the places
  int with_giant; // one grain that touches very many
} layout;

static engine *crowd(const layout *l, const char *contact) {
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  draft *d = draft_begin();
  fputs("grains:\n  thickness: 1\n  list:\n", d->to);
  for (int k = 0; k < GRAINS; k++) {
    int place = k * l->stride % GRAINS;
    fprintf(d->to, "  - {x: %.17g, y: %.17g, r: %.17g, vx: %.17g, vy: %.17g, fixed: %s}\n",
            l->pitch * (place % COLUMNS + 0.5) + uniform(random, -0.1, 0.1),
            l->pitch * (place / COLUMNS + 0.5) + uniform(random, -0.1, 0.1), uniform(random, 0.6, 1),
            uniform(random, -5, 5), uniform(random, -5, 5), k % 97 == 5 ? "true" : "false");
  }
  if (l->with_giant)
    fprintf(d->to, "  - {x: -500, y: 30, r: 499.9}\n");
  fprintf(d->to,
          "material: {young: 1e5, density: 1, friction: 0.5}\ncontact: %s\ngravity: [-2, -9]\nlimits: {overlap: 1}\n"
          "walls: [{from: [-1, -0.5], to: [203, -0.5]}, {from: [-0.5, 0], to: [-0.5, 290]}]\n"
          "integrator: {dt: 1e-3, force: true}\nstages: [{kind: free, duration: 1}]\n",
          contact);
  gsl_rng_free(random);
  return engine_start(d);
}

static void plain_step(tal_sim *sim) {
  sim->dt_next = sim->dt;
  if (sim->walls.count)
    tal_walls_drift(sim);
  tal_integrate_drift(sim, sim->dt);
  tal_forces_sweep(sim, sim->dt);
  tal_forces_finish_step(sim, sim->dt, tal_integrate_credit(sim));
  tal_integrate_end(sim);
}

// In one pass over memory where that may be.
static void hot_step(tal_sim *sim) {
  sim->dt_next = sim->dt;
  tal_integrate_verlet_step(sim);
}

// Nobody remembers what the laws saw in a step that was not watched.
static bool forgotten(const engine *e, const char *member) {
  return !e->sim->remembers && (!strcmp(member, "ux") || !strcmp(member, "uy") || !strcmp(member, "spin"));
}

static void assert_same_arrays(const engine *a, const engine *b, const char *name) {
#define X(type, member, unit, kept, meaning)                                                                           \
  if (a->sim->grains.member && b->sim->grains.member && !forgotten(a, #member) &&                                      \
      memcmp(a->sim->grains.member, b->sim->grains.member, a->sim->grains.count * sizeof(type)) != 0)                  \
    fail_msg("%s: %s differs", name, #member);
  TAL_GRAIN_FIELDS(X)
#undef X
#define X(type, member, unit, meaning)                                                                                 \
  if (memcmp(&a->sim->run.member, &b->sim->run.member, sizeof(type)) != 0)                                             \
    fail_msg("%s: %s of the run differs", name, #member);
  TAL_RUN_FIELDS(X)
#undef X
}

// The forces of the last step, asked for afterwards.
static void assert_same_contacts(engine *a, engine *b, const char *name) {
  tal_contacts *p = &a->sim->pairs, *q = &b->sim->pairs;
  tal_forces_expand(a->sim);
  tal_forces_expand(b->sim);
  assert_int_equal(p->count, q->count);
#define X(type, member, unit, kept, meaning)                                                                           \
  assert_true(!p->member == !q->member); /* of what a law does not need there is none */                               \
  if (p->member && memcmp(p->member, q->member, p->count * sizeof(type)) != 0)                                         \
    fail_msg("%s: %s of the slots differs", name, #member);
  TAL_CONTACT_FIELDS(X)
#undef X
}

static void compare(const layout *l, const char *contact, int threads) {
  engine *plain = crowd(l, contact), *hot = crowd(l, contact);
  char name[200];
  snprintf(name, sizeof name, "%s, %s, %d threads", l->name, contact, threads);
  size_t pairs = 0;
  for (int s = 0; s < STEPS; s++) {
    omp_set_num_threads(1);
    plain_step(plain->sim);
    omp_set_num_threads(threads);
    hot_step(hot->sim);
    pairs += hot->sim->pairs.count;
    assert_same_arrays(plain, hot, name);
    if (s % 10 == 9)
      assert_same_contacts(plain, hot, name);
  }
  omp_set_num_threads(1);
  assert_true(pairs > STEPS * GRAINS / 100);
  engine_end(plain);
  engine_end(hot);
}

// EXACT.
static void same_bits_as_the_plain_way(void **state) {
  (void)state;
  static const char *const laws[] = {
      "{tangential: regularised, vR: 0.01}", "{tangential: spring}",
      "{normal: linear, stiffness: 1e4, restitution: 0.7, tangential: regularised, vR: 0.01}",
      "{normal: linear, stiffness: 1e4, tangential: none}"};
  static const layout layouts[] = {{"row by row", 1, 1.6, 0},
                                   {"scrambled", 7, 1.6, 0},
                                   {"upside down", GRAINS - 1, 1.6, 0},
                                   {"sparse", 1, 1.9, 0},
                                   {"with a giant", 1, 1.6, 1}};
  for (size_t k = 0; k < sizeof laws / sizeof *laws; k++)
    for (size_t l = 0; l < sizeof layouts / sizeof *layouts; l++)
      for (int threads = 1; threads <= 3; threads += 2)
        compare(&layouts[l], laws[k], threads);
}

// EXACT: with no pair at all, and with one.
static void lonely_grains(void **state) {
  (void)state;
  for (int gap = 0; gap < 2; gap++) {
    engine *e[2];
    for (int k = 0; k < 2; k++) {
      draft *d = draft_begin();
      fprintf(d->to,
              "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1, vx: 1}, {x: %g, y: 0, r: 1}, {x: 30, y: 0, r: 1}]}\n"
              "material: {young: 1e5, density: 1, friction: 0.5}\ncontact: {tangential: spring}\ngravity: [0, -1]\n"
              "integrator: {dt: 1e-3}\nstages: [{kind: free, duration: 1}]\n",
              gap ? 5 : 1.99);
      e[k] = engine_start(d);
      assert_int_equal(e[k]->sim->pairs.count, !gap);
    }
    for (int s = 0; s < STEPS; s++) {
      plain_step(e[0]->sim);
      hot_step(e[1]->sim);
      assert_same_arrays(e[0], e[1], "lonely");
    }
    assert_true(e[1]->sim->grains.vy[2] != 0);
    engine_end(e[0]);
    engine_end(e[1]);
  }
}

// EXACT: a step in one pass over memory against one that drifts everything before it looks at a contact; plates and
// pressure with it, refreshes of the graph, rebuilds of the list. The one is watched now and then only: its forces are
// the others' all the same, and its motion is that of a run that is watched always.
static void one_pass_or_two(void **state) {
  (void)state;
  static const char *const laws[] = {"{tangential: regularised}", "{tangential: spring}", "{tangential: none}"};
  for (size_t k = 0; k < sizeof laws / sizeof *laws; k++)
    for (int threads = 1; threads <= 3; threads++) {
      engine *e[2];
      int at_once = 0;
      for (int m = 0; m < 2; m++) {
        draft *d = draft_begin();
        fprintf(d->to,
                "grains: {count: 2500, radius: {law: uniform, min: 0.5e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
                "pack: {method: drop_and_roll, width: 40e-3}\nmass_scaling: 1e5\ncontinuum: {refresh: 50}\n"
                "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.4}\ncontact: %s\n"
                "integrator: {dt: 1e-5}\nstages: [{kind: compress, pressure: 100e3, rate: 0.5, strain: 0.2}]\n",
                laws[k]);
        e[m] = engine_start(d);
      }
      omp_set_num_threads(threads);
      for (int s = 0; s < 400; s++) {
        tal_error err;
        at_once += !isnan(e[0]->sim->next_stride);
        const bool watched = s % 20 == 19;
        tal_sim_watch(e[0]->sim, watched);
        assert_int_equal(tal_sim_step(e[0]->sim, &err), TAL_OK);
        e[1]->sim->next_stride = (double)NAN; // two passes
        assert_int_equal(tal_sim_step(e[1]->sim, &err), TAL_OK);
        assert_same_arrays(e[0], e[1], laws[k]);
        if (watched)
          assert_same_contacts(e[0], e[1], laws[k]);
      }
      omp_set_num_threads(1);
      assert_true(at_once > 350 && e[0]->sim->neighbours.rebuilds == e[1]->sim->neighbours.rebuilds);
      engine_end(e[0]);
      engine_end(e[1]);
    }
}

static size_t handfuls_pressed(const tal_sim *sim) {
  size_t count = 0;
  for (size_t i = 0; i < sim->grains.count; i++)
    if (sim->grains.bx[i] != 0 || sim->grains.by[i] != 0)
      assert_true(sim->pressed[i / TAL_KICK_GRAINS]);
  for (size_t k = 0; k <= sim->grains.count / TAL_KICK_GRAINS; k++)
    count += sim->pressed[k];
  return count;
}

// EXACT: boundary forces are read where the boundary acts only; to read them everywhere is the same. Rows of grains are
// longer than a handful, so that there are handfuls inside; refreshes of the graph, and a stage without a boundary
// between two with one.
static void boundary_forces_where_there_are_some(void **state) {
  (void)state;
  engine *e[2];
  size_t least = SIZE_MAX;
  for (int m = 0; m < 2; m++) {
    draft *d = draft_begin();
    fputs("grains: {radius: {law: uniform, min: 0.75e-3, max: 0.75e-3}, thickness: 1.5e-3}\n"
          "pack: {method: lattice, columns: 200, rows: 9, gap: -2e-6}\nmass_scaling: 1e5\ncontinuum: {refresh: 20}\n"
          "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.4}\ncontact: {tangential: spring}\n"
          "integrator: {dt: 1e-5}\nstages: [{kind: compress, pressure: 100e3, rate: 0.5, strain: 1e-3},\n"
          "  {kind: free, duration: 0.5e-3}, {kind: compress, pressure: 50e3, rate: 0.5, strain: 2e-3}]\n",
          d->to);
    e[m] = engine_start(d);
  }
  for (int s = 0; s < 400; s++) {
    tal_error err;
    assert_int_equal(tal_sim_step(e[0]->sim, &err), TAL_OK);
    memset(e[1]->sim->pressed, 1, e[1]->sim->grains.count / TAL_KICK_GRAINS + 1);
    assert_int_equal(tal_sim_step(e[1]->sim, &err), TAL_OK);
    assert_same_arrays(e[0], e[1], "pressed");
    const size_t pressed = handfuls_pressed(e[0]->sim);
    least = pressed < least ? pressed : least;
  }
  assert_int_equal(e[0]->sim->run.stage, 2);
  assert_in_range(least, 10, 20); // of 29
  engine_end(e[0]);
  engine_end(e[1]);
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {cmocka_unit_test(same_bits_as_the_plain_way), cmocka_unit_test(one_pass_or_two),
                                     cmocka_unit_test(boundary_forces_where_there_are_some),
                                     cmocka_unit_test(lonely_grains)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
