// Grains laid in layers: ids, forces and graph that users see do not know of it, and a list in any order gives an
// order in memory that is good for the hot loop.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "checkpoint.h"
#include "engine.h"
#include "order.h"
#include <gsl/gsl_randist.h>
#include <omp.h>

enum { COLUMNS = 45, ROWS = 48, GRAINS = COLUMNS * ROWS };

static void assert_near(double a, double b, double within) {
  if (!(fabs(a - b) <= within))
    fail_msg("%.17g and %.17g", a, b);
}

typedef struct spot {
  double x, y, r;
} spot;

// A loose lattice, every spot a bit aside, in random order.
static void scatter(spot *all) {
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  for (int k = 0; k < GRAINS; k++)
    all[k] = (spot){1.98e-3 * (k % COLUMNS) + uniform(random, -2e-5, 2e-5),
                    1.98e-3 * (double)(k / COLUMNS) + uniform(random, -2e-5, 2e-5), uniform(random, 0.99e-3, 1e-3)};
  gsl_ran_shuffle(random, all, GRAINS, sizeof *all);
  gsl_rng_free(random);
}

static engine *start(const spot *all, const char *friction, const char *scheme) {
  draft *d = draft_begin();
  fprintf(d->to, "grains:\n  thickness: 2e-3\n  list:\n");
  for (int k = 0; k < GRAINS; k++)
    fprintf(d->to, "  - {x: %.17g, y: %.17g, r: %.17g}\n", all[k].x, all[k].y, all[k].r);
  fprintf(d->to,
          "material: {young: 1e9, poisson: 0.3, density: 2000, friction: 0.5, damping: 1e-4}\nmass_scaling: 1e3\n"
          "contact: {tangential: %s}\nintegrator: {scheme: %s, dt: 1e-5}\ncontinuum: {refresh: 10}\n"
          "walls: [{from: [-1, -1e-3], to: [1, -1e-3]}]\n"
          "stages: [{kind: compress, pressure: 1e4, rate: 0.1, strain: 0.1}]\n",
          friction, scheme);
  return engine_start(d);
}

// EXACT: every id still names the grain of that place in the list; grains in contact are two layers apart at most.
static void ids_are_kept(void **state) {
  (void)state;
  static spot all[GRAINS];
  scatter(all);
  engine *e = start(all, "spring", "verlet");
  const tal_grains *g = &e->sim->grains;
  int32_t *index = tal_order_of_ids(g);
  for (int k = 0; k < GRAINS; k++) {
    assert_int_equal(g->id[index[k]], k);
    assert_true(g->x[index[k]] == all[k].x && g->y[index[k]] == all[k].y && g->r[index[k]] == all[k].r);
  }
  assert_true(e->sim->neighbours.span <= 3 * COLUMNS);
  free(index);
  engine_end(e);
}

// ROUND: contacts seen by id: ascending, normals into i, and their forces add up to each grain's resultant.
static void assert_contacts(const tal_observed *seen) {
  const tal_grains *g = seen->grains;
  double *fx = tal_alloc(g->count, sizeof *fx), *fy = tal_alloc(g->count, sizeof *fy), largest = 0;
  for (size_t c = 0; c < seen->pairs->count; c++) {
    const int32_t i = seen->pairs->i[c], j = seen->pairs->j[c];
    assert_true(i < j);
    assert_true(c == 0 || seen->pairs->i[c - 1] < i || (seen->pairs->i[c - 1] == i && seen->pairs->j[c - 1] < j));
    double dx = g->x[i] - g->x[j], dy = g->y[i] - g->y[j], d = hypot(dx, dy);
    assert_near(seen->pairs->nx[c], dx / d, 1e-14);
    assert_near(seen->pairs->ny[c], dy / d, 1e-14);
    geo_vec f = tal_contact_force(seen->pairs, c);
    fx[i] += f.x, fy[i] += f.y, fx[j] -= f.x, fy[j] -= f.y;
    largest = fmax(largest, hypot(f.x, f.y));
  }
  for (size_t c = 0; c < seen->walls->count; c++) {
    geo_vec f = tal_contact_force(seen->walls, c);
    fx[seen->walls->i[c]] += f.x, fy[seen->walls->i[c]] += f.y;
  }
  assert_true(largest > 0);
  for (size_t i = 0; i < g->count; i++) {
    assert_near(fx[i] + g->bx[i], g->rx[i], 1e-13 * largest);
    assert_near(fy[i] + g->by[i], g->ry[i], 1e-13 * largest);
  }
  free(fx);
  free(fy);
}

// ROUND: what is measured on an instant does not depend on the order of its grains; a frame is in the order of ids.
static void instants_by_id(void **state) {
  (void)state;
  static spot all[GRAINS];
  scatter(all);
  engine *e = start(all, "regularised", "verlet");
  engine_steps(e, 25);
  tal_observed now = tal_sim_driving(e->sim);
  tal_by_id copy;
  tal_by_id_init(&copy, &now);
  for (int k = 0; k < GRAINS; k++)
    assert_int_equal(copy.seen.grains->id[k], k);
  assert_contacts(&copy.seen);
  tal_macro here, there;
  tal_macro_measure(&now, &here);
  tal_macro_measure(&copy.seen, &there);
  assert_int_equal(here.contacts, there.contacts);
  assert_int_equal(here.contacts_off_graph, there.contacts_off_graph);
  assert_near(here.stress.yy / there.stress.yy, 1, 1e-12);
  assert_near(here.stress_boundary.xx / there.stress_boundary.xx, 1, 1e-12);
  assert_near(here.solid_fraction / there.solid_fraction, 1, 1e-12);
  assert_near(here.power_contacts / there.power_contacts, 1, 1e-9);
  tal_by_id_clear(&copy);
  engine_end(e);
}

// EXACT: two threads, and a stop in between, change nothing.
static void same_bits(const spot *all, const char *friction, const char *scheme) {
  char path[] = "/tmp/talus-order-XXXXXX";
  tal_run_files files = {.series_step = -1};
  tal_error err;
  assert_true(close(mkstemp(path)) == 0);
  engine *e = start(all, friction, scheme), *f = start(all, friction, scheme), *h = start(all, friction, scheme);
  engine_steps(e, 40);
  omp_set_num_threads(2);
  engine_steps(f, 25);
  assert_int_equal(tal_checkpoint_write(path, NULL, f->sim, "scene", &files, &err), TAL_OK);
  engine_steps(f, 15);
  omp_set_num_threads(1);
  assert_int_equal(tal_checkpoint_read(path, h->sim, "scene", &files, &err), TAL_OK);
  tal_run_files_clear(&files);
  tal_sim_restored(h->sim);
  engine_steps(h, 15);
  assert_same_motion(e, f);
  assert_same_motion(e, h);
  engine_end(e);
  engine_end(f);
  engine_end(h);
  unlink(path);
}

static void threads_and_stops(void **state) {
  (void)state;
  static spot all[GRAINS];
  scatter(all);
  same_bits(all, "spring", "verlet");
  same_bits(all, "regularised", "implicit_friction");
}

int main(int argc, char **argv) {
  if (argc > 1)
    cmocka_set_test_filter(argv[1]);
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(ids_are_kept),
      cmocka_unit_test(instants_by_id),
      cmocka_unit_test(threads_and_stops),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
