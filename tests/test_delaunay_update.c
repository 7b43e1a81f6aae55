// Updates of a triangulation after its points have moved, against one built from nothing: the same triangles, always.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "delaunay.h"
#include "engine.h"
#include "regular.h"
#include "rim.h"
#include <gsl/gsl_randist.h>
#include <omp.h>

typedef struct cloud {
  size_t n;
  double *x, *y, *w; // w NULL: plain
} cloud;

static cloud make_cloud(size_t n, bool weighted) {
  cloud c = {n, tal_alloc(n, sizeof(double)), tal_alloc(n, sizeof(double)), NULL};
  c.w = weighted ? tal_alloc(n, sizeof(double)) : NULL;
  return c;
}

static void free_cloud(cloud *c) {
  free(c->x);
  free(c->y);
  free(c->w);
}

static void assert_same_triangles(const geo_mesh *a, const geo_mesh *b) {
  assert_int_equal(a->triangle_count, b->triangle_count);
  assert_memory_equal(a->corner, b->corner, a->triangle_count * sizeof *a->corner);
  assert_memory_equal(a->neighbour, b->neighbour, a->triangle_count * sizeof *a->neighbour);
}

// Brings `mesh` up to date and compares; counts changes of the triangles.
static void follow(const cloud *c, geo_mesh *mesh, int *changes) {
  const geo_delaunay_backend *const *backend = geo_delaunay_backends();
  geo_delaunay_report report, fresh_report;
  geo_mesh fresh;
  geo_mesh_init(&fresh);
  uint64_t revision = mesh->revision;
  assert_int_equal(geo_delaunay_update(backend[0], c->x, c->y, c->w, c->n, mesh, &report), GEO_DELAUNAY_OK);
  assert_int_equal(geo_delaunay(backend[0], c->x, c->y, c->w, c->n, &fresh, &fresh_report), GEO_DELAUNAY_OK);
  assert_same_triangles(mesh, &fresh);
  assert_int_equal(report.hidden, fresh_report.hidden);
  *changes += mesh->revision != revision;
  geo_mesh_clear(&fresh);
}

// EXACT: random points that jump about by anything between a millionth and twice their distance.
static void jumps(void **state) {
  (void)state;
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  int changes = 0, kept = 0;
  for (int round = 0; round < 2400; round++) {
    size_t n = 3 + gsl_rng_uniform_int(random, round % 10 ? 40 : 400);
    double size = sqrt((double)n), jump = pow(10, uniform(random, -6, 0.3)), far = round % 3 ? 0 : 1e4;
    cloud c = make_cloud(n, round % 4 == 3);
    geo_mesh mesh;
    geo_mesh_init(&mesh);
    for (size_t i = 0; i < n; i++) {
      c.x[i] = far + uniform(random, 0, size);
      c.y[i] = uniform(random, 0, size);
      if (c.w)
        c.w[i] = uniform(random, 0, 0.3);
    }
    follow(&c, &mesh, &changes);
    changes = 0;
    for (int move = 0; move < 4; move++) {
      for (size_t i = 0; i < n; i++) {
        c.x[i] += gsl_ran_gaussian(random, jump);
        c.y[i] += gsl_ran_gaussian(random, jump);
      }
      follow(&c, &mesh, &changes);
    }
    kept += changes < 4;
    geo_mesh_clear(&mesh);
    free_cloud(&c);
  }
  assert_true(kept > 500);
  gsl_rng_free(random);
}

// EXACT: ties at every edge, before and after: lattices that are sheared, stretched and jolted along their own lines.
static void lattices(void **state) {
  (void)state;
  int changes = 0;
  enum { COLUMNS = 13, ROWS = 9 };
  cloud c = make_cloud(COLUMNS * ROWS, false);
  geo_mesh mesh;
  geo_mesh_init(&mesh);
  for (int move = 0; move < 200; move++) {
    double shear = 0.25 * (move % 9), stretch = move % 5 ? 1 : 0.5;
    for (int i = 0; i < COLUMNS * ROWS; i++) {
      int row = i / COLUMNS, column = i % COLUMNS;
      c.x[i] = column + shear * row + (row == move % 11 ? 0.5 : 0);
      c.y[i] = stretch * row;
    }
    follow(&c, &mesh, &changes);
  }
  assert_true(changes > 20);
  geo_mesh_clear(&mesh);
  free_cloud(&c);
}

// EXACT: a rim of points nearly on one line each side, whose order of heights changes all the time.
static void rims(void **state) {
  (void)state;
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  int changes = 0;
  enum { COUNT = 120, INNER = 60 };
  cloud c = make_cloud(COUNT + INNER, false);
  geo_mesh mesh;
  geo_mesh_init(&mesh);
  for (int i = 0; i < INNER; i++) {
    c.x[COUNT + i] = uniform(random, 0.3, 29.7);
    c.y[COUNT + i] = uniform(random, 0.3, 29.7);
  }
  for (int move = 0; move < 1500; move++) {
    double height = pow(10, -(move % 7));
    for (int i = 0; i < COUNT; i++) {
      double along = i % 30 + uniform(random, 0, 0.3), up = uniform(random, -height, height);
      bool upright = i / 30 % 2;
      c.x[i] = upright ? (i / 60 ? 30 + up : -up) : along;
      c.y[i] = upright ? along : (i / 60 ? 30 + up : -up);
    }
    follow(&c, &mesh, &changes);
  }
  assert_true(changes > 1000);
  geo_mesh_clear(&mesh);
  free_cloud(&c);
  gsl_rng_free(random);
}

// EXACT: points that come to coincide or to lie on one line are found out, and leave the mesh alone.
static void degenerate(void **state) {
  (void)state;
  for (int kind = 0; kind < 3; kind++) {
    double x[] = {0, 1, 1, 0, 0.5, 0.3}, y[] = {0, 0, 1, 1, 0.4, 0.6};
    cloud c = {6, x, y, NULL};
    int changes = 0;
    geo_mesh mesh;
    geo_delaunay_report report;
    geo_mesh_init(&mesh);
    follow(&c, &mesh, &changes);
    size_t triangles = mesh.triangle_count;
    x[4] = kind == 0 ? x[5] : kind == 1 ? x[4] : (double)NAN;
    y[4] = kind == 0 ? y[5] : y[4];
    for (int i = 0; i < 6 && kind == 1; i++)
      y[i] = 2 * x[i], x[2] = 1.5, x[3] = -0.5;
    geo_delaunay_result result = geo_delaunay_update(geo_delaunay_backends()[0], x, y, NULL, 6, &mesh, &report);
    assert_int_equal(result, kind == 0   ? GEO_DELAUNAY_DUPLICATE
                             : kind == 1 ? GEO_DELAUNAY_COLLINEAR
                                         : GEO_DELAUNAY_NOT_FINITE);
    assert_true(report.text[0] != 0 && mesh.revision == 1 && mesh.triangle_count == triangles);
    geo_mesh_clear(&mesh);
  }
}

// EXACT: a mended rim tiles the hull again after moves that turn a sliver over and dent the hull.
static void mending(void **state) {
  (void)state;
  geo_site site[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 1e-4, 0}, {0.5, 1.0001, 0}};
  const int32_t corner[][3] = {{0, 1, 4}, {1, 2, 4}, {2, 5, 4}, {5, 3, 4}, {3, 0, 4}};
  geo_mesh mesh, mended;
  geo_mesh_init(&mesh);
  geo_mesh_init(&mended);
  geo_mesh_set(&mesh, 6, corner, 5);
  size_t hidden;
  site[4].y = -1e-4;  // now on the hull
  site[5].y = 0.9999; // no longer
  assert_false(geo_regular_update(site, 6, &mesh, &hidden));
  assert_true(geo_rim_mend(site, 6, &mesh, &mended));
  assert_int_equal(mended.triangle_count, 5);
  assert_true(geo_regular_update(site, 6, &mended, &hidden));
  geo_mesh_clear(&mesh);
  geo_mesh_clear(&mended);
}

// EXACT: every refresh of a real run, dense sample, plastic bursts included, plain and power.
static void compression(void **state) {
  (void)state;
  for (int power = 0; power < 2; power++) {
    draft *d = draft_begin();
    fprintf(d->to,
            "grains: {count: 240, radius: {law: uniform, min: 0.5e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
            "material: {young: 3e9, poisson: 0.3, density: 2675, friction: 0.3, damping: 0.002}\nmass_scaling: 1e5\n"
            "continuum: {tessellation: %s, refresh: 20}\npack: {method: drop_and_roll, width: 16e-3}\n"
            "integrator: {dt: 5e-5, force: true}\nlimits: {overlap: 0.9}\n"
            "stages: [{kind: compress, pressure: 100e3, rate: 0.3, strain: 0.4}]\n",
            power ? "power" : "delaunay");
    engine *e = engine_start(d);
    tal_graph *graph = &e->sim->graph;
    const tal_grains *g = &e->sim->grains;
    double *weight = tal_alloc(g->count, sizeof *weight);
    for (size_t i = 0; i < g->count; i++)
      weight[i] = g->r[i] * g->r[i];
    int refreshes = 0, changes = 0;
    int64_t last = e->sim->run.refresh_step;
    uint64_t revision = graph->mesh.revision;
    while (!tal_sim_done(e->sim)) {
      engine_step(e);
      if (e->sim->run.refresh_step == last)
        continue;
      geo_mesh fresh;
      geo_mesh_init(&fresh);
      assert_int_equal(geo_delaunay(graph->backend, graph->x, graph->y, power ? weight : NULL, g->count, &fresh, NULL),
                       GEO_DELAUNAY_OK);
      assert_same_triangles(&graph->mesh, &fresh);
      geo_mesh_clear(&fresh);
      refreshes++;
      changes += graph->mesh.revision != revision;
      revision = graph->mesh.revision;
      last = e->sim->run.refresh_step;
    }
    assert_true(refreshes > 1000);
    assert_true(changes > 100);
    free(weight);
    engine_end(e);
  }
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {cmocka_unit_test(jumps),   cmocka_unit_test(lattices),
                                     cmocka_unit_test(rims),    cmocka_unit_test(degenerate),
                                     cmocka_unit_test(mending), cmocka_unit_test(compression)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
