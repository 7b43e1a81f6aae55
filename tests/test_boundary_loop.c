// Boundary loop: known shapes, one simple loop for any cloud and limit, areas, normals, mean velocity gradient.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "boundary_loop.h"
#include "delaunay.h"

enum { MAX_POINTS = 2000 };

// A cloud of discs with its triangulation and loop.
typedef struct assembly {
  size_t n;
  double x[MAX_POINTS], y[MAX_POINTS], radius[MAX_POINTS];
  geo_mesh mesh;
  geo_loop loop;
  unsigned char inside[2 * MAX_POINTS];
} assembly;

static uint64_t random_bits(uint64_t *state) {
  uint64_t z = *state += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}

static double random_unit(uint64_t *state) {
  return (double)(random_bits(state) >> 11) * 0x1p-53;
}

static assembly *make_assembly(void) {
  return calloc(1, sizeof(assembly));
}

static void free_assembly(assembly *a) {
  geo_mesh_clear(&a->mesh);
  geo_loop_clear(&a->loop);
  free(a);
}

static void add_disc(assembly *a, double x, double y, double radius) {
  assert_true(a->n < MAX_POINTS);
  a->x[a->n] = x;
  a->y[a->n] = y;
  a->radius[a->n++] = radius;
}

static void add_block(assembly *a, int x0, int y0, int columns, int rows) {
  for (int r = 0; r < rows; r++)
    for (int c = 0; c < columns; c++)
      add_disc(a, x0 + c, y0 + r, 0.5);
}

static void scatter(assembly *a, size_t count, double size, uint64_t *seed) {
  a->n = 0;
  while (a->n < count)
    add_disc(a, size * random_unit(seed), size * random_unit(seed), 0.2 + 0.3 * random_unit(seed));
}

static int peel_beside(assembly *a, const unsigned char *side, double gap_limit) {
  const geo_delaunay_backend *backend = geo_delaunay_backend_find("qhull");
  assert_int_equal(geo_delaunay(backend, a->x, a->y, NULL, a->n, &a->mesh, NULL), GEO_DELAUNAY_OK);
  return geo_loop_peel(&a->loop, &a->mesh, a->x, a->y, a->radius, side, gap_limit, a->inside);
}

static int peel(assembly *a, double gap_limit) {
  return peel_beside(a, NULL, gap_limit);
}

static double turn(const assembly *a, int32_t p, int32_t q, int32_t r) {
  return geo_cross((geo_vec){a->x[q] - a->x[p], a->y[q] - a->y[p]}, (geo_vec){a->x[r] - a->x[p], a->y[r] - a->y[p]});
}

static bool wide(const assembly *a, int32_t i, int32_t j, double limit) {
  return hypot(a->x[i] - a->x[j], a->y[i] - a->y[j]) - a->radius[i] - a->radius[j] > limit;
}

// No two sides cross or touch except neighbours at their common node.
static void check_simple(const assembly *a) {
  size_t n = a->loop.count;
  const int32_t *node = a->loop.node;
  unsigned char seen[MAX_POINTS] = {0};
  assert_true(n >= 3);
  for (size_t k = 0; k < n; k++) {
    assert_false(seen[node[k]]);
    seen[node[k]] = 1;
    assert_true(node[k] >= node[0]);
  }
  for (size_t k = 0; k < n; k++)
    for (size_t m = k + 2; m < n; m++) {
      int32_t p = node[k], q = node[k + 1], r = node[m], s = node[(m + 1) % n];
      if (s == p)
        continue;
      bool apart = turn(a, p, q, r) * turn(a, p, q, s) > 0 || turn(a, r, s, p) * turn(a, r, s, q) > 0;
      bool on_a_line = turn(a, p, q, r) == 0 && turn(a, p, q, s) == 0;
      assert_true(apart || on_a_line);
    }
}

// Identities of one simple loop around triangles: Euler's count, area, normals, and that nothing more can be peeled.
static void check_identities(const assembly *a, double limit) {
  const geo_mesh *mesh = &a->mesh;
  size_t used = 0, outside = 0, triangles = 0;
  unsigned char seen[MAX_POINTS] = {0}, on_loop[MAX_POINTS] = {0};
  double area = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    triangles += a->inside[t];
    if (a->inside[t])
      area += geo_mesh_area(mesh, a->x, a->y, t);
    for (int k = 0; k < 3; k++)
      seen[mesh->corner[t][k]] |= a->inside[t] ? 3 : 1;
  }
  for (size_t i = 0; i < a->n; i++) {
    used += seen[i] != 0;
    outside += seen[i] == 1;
  }
  for (size_t k = 0; k < a->loop.count; k++)
    on_loop[a->loop.node[k]] = 1;
  assert_int_equal(triangles, a->loop.triangle_count);
  assert_int_equal(outside, a->loop.outside_count);
  assert_int_equal(triangles, 2 * (used - a->loop.outside_count) - a->loop.count - 2);
  double enclosed = geo_loop_area(&a->loop, a->x, a->y);
  assert_true(area > 0 && fabs(enclosed - area) < 1e-13 * (double)triangles * area);
  geo_vec sum = {0, 0};
  for (size_t k = 0; k < a->loop.count; k++)
    sum = geo_add(sum, geo_loop_normal(&a->loop, a->x, a->y, k));
  assert_true(geo_norm(sum) < 1e-14 * (double)a->loop.count * sqrt(area));
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    int outer = 0, open = 0;
    bool neck = false;
    for (int k = 0; k < 3 && a->inside[t]; k++) {
      int32_t u = mesh->neighbour[t][k];
      if (u >= 0 && a->inside[u])
        continue;
      outer++;
      open += wide(a, mesh->corner[t][(k + 1) % 3], mesh->corner[t][(k + 2) % 3], limit);
      neck = on_loop[mesh->corner[t][k]];
    }
    assert_false(outer == 1 && open == 1 && !neck);
    assert_false(outer > 1 && open > 1);
  }
}

static void check_loop(const assembly *a, double limit) {
  check_simple(a);
  check_identities(a, limit);
}

// EXACT: a full square block keeps its whole rim, points on straight sides included, counter-clockwise from point 0.
static void block(void **state) {
  (void)state;
  assembly *a = make_assembly();
  add_block(a, 0, 0, 5, 5);
  assert_int_equal(peel(a, 0.2), 0);
  check_loop(a, 0.2);
  const int32_t rim[16] = {0, 1, 2, 3, 4, 9, 14, 19, 24, 23, 22, 21, 20, 15, 10, 5};
  assert_int_equal(a->loop.count, 16);
  assert_memory_equal(a->loop.node, rim, sizeof rim);
  assert_int_equal(a->loop.outside_count, 0);
  assert_int_equal(a->loop.triangle_count, 32);
  assert_true(geo_loop_area(&a->loop, a->x, a->y) == 16);
  geo_vec corner = geo_loop_normal(&a->loop, a->x, a->y, 0), side = geo_loop_normal(&a->loop, a->x, a->y, 1);
  assert_true(corner.x == -0.5 && corner.y == -0.5 && side.x == 0 && side.y == -1);
  free_assembly(a);
}

// EXACT: a 7 x 7 block whose notch, 3 columns wide and 3 rows deep, opens upwards. The hull bridges it; peeled, the
// loop follows its walls and only the two triangles in the notch's corners, with diagonals below the limit, stay.
static void notch(void **state) {
  (void)state;
  assembly *a = make_assembly();
  for (int r = 0; r < 7; r++)
    for (int c = 0; c < 7; c++)
      if (r < 4 || c < 2 || c > 4)
        add_disc(a, c, r, 0.5);
  assert_int_equal(peel(a, 0.5), 0);
  check_loop(a, 0.5);
  assert_true(geo_loop_area(&a->loop, a->x, a->y) == 36 - 12 + 1);
  assert_int_equal(a->loop.outside_count, 0);
  assert_int_equal(peel(a, 0.4), 0);
  check_loop(a, 0.4);
  assert_true(geo_loop_area(&a->loop, a->x, a->y) == 36 - 12);
  assert_int_equal(peel(a, 100), 0);
  check_loop(a, 100);
  assert_true(geo_loop_area(&a->loop, a->x, a->y) == 36);
  free_assembly(a);
}

// EXACT: discs that float off are left outside and change nothing; one within the limit is not.
static void rattlers(void **state) {
  (void)state;
  assembly *a = make_assembly();
  add_block(a, 0, 0, 5, 5);
  add_disc(a, 10.25, 2.125, 0.5);
  add_disc(a, -3, 9, 0.25);
  add_disc(a, 2, -2.25, 0.5);
  assert_int_equal(peel(a, 0.3), 0);
  check_loop(a, 0.3);
  assert_int_equal(a->loop.outside_count, 3);
  assert_int_equal(a->loop.count, 16);
  assert_true(geo_loop_area(&a->loop, a->x, a->y) == 16);
  add_disc(a, 5.125, 2, 0.5); // gap 0.125
  assert_int_equal(peel(a, 0.3), 0);
  check_loop(a, 0.3);
  assert_int_equal(a->loop.outside_count, 3);
  assert_true(a->loop.count == 17 && geo_loop_area(&a->loop, a->x, a->y) > 16);
  free_assembly(a);
}

// EXACT: blocks joined by one grain, by a chain, by nothing, and a tail: the loop stays simple and keeps all of them.
static void necks(void **state) {
  (void)state;
  for (int shape = 0; shape < 4; shape++) {
    assembly *a = make_assembly();
    add_block(a, 0, 0, 4, 4);
    if (shape < 3)
      add_block(a, shape == 0 ? 5 : 12, 0, 4, 4);
    if (shape == 0)
      add_disc(a, 4, 1.5, 0.5);
    for (int c = 4; c < 12 && (shape == 1 || shape == 3); c++)
      add_disc(a, c, 2, 0.5);
    assert_int_equal(peel(a, 0.3), 0);
    check_loop(a, 0.3);
    assert_int_equal(a->loop.outside_count, 0);
    free_assembly(a);
  }
}

// EXACT: two blocks a wide slit apart, narrowest at height 3, stay joined there and nowhere else: longest gaps go
// first.
static void narrowest_bridge(void **state) {
  (void)state;
  assembly *a = make_assembly();
  for (int row = 0; row < 12; row++)
    for (int side = 0; side < 2; side++) {
      double edge = side ? 2.5 + 0.0625 * fabs(row - 3.0) : 0;
      add_disc(a, edge, row, 0.5);
      add_disc(a, edge + (side ? 1 : -1), row, 0.5);
    }
  assert_int_equal(peel(a, 0.6), 0);
  check_loop(a, 0.6);
  assert_int_equal(a->loop.outside_count, 0);
  size_t bridges = 0;
  for (size_t t = 0; t < a->mesh.triangle_count; t++) {
    int right = 0, far = 0;
    for (int k = 0; k < 3; k++) {
      right += a->x[a->mesh.corner[t][k]] > 1;
      far += fabs(a->y[a->mesh.corner[t][k]] - 3) > 1;
    }
    if (!a->inside[t] || right == 0 || right == 3)
      continue;
    bridges++;
    assert_int_equal(far, 0);
  }
  assert_in_range(bridges, 1, 2);
  free_assembly(a);
}

// EXACT: three discs, near and far; a limit nothing survives leaves an empty loop and says so.
static void three(void **state) {
  (void)state;
  assembly *a = make_assembly();
  add_disc(a, 0, 0, 0.5);
  add_disc(a, 1, 0, 0.5);
  add_disc(a, 0, 3, 0.5);
  assert_int_equal(peel(a, 2.5), 0);
  assert_int_equal(a->loop.count, 3);
  assert_int_equal(peel(a, 2.1), 0); // one side wide: the ear has only one wide edge
  assert_int_equal(a->loop.count, 3);
  assert_int_equal(peel(a, 1), -1);
  assert_int_equal(a->loop.count, 0);
  assert_int_equal(a->loop.outside_count, 3);
  assert_int_equal(a->inside[0], 0);
  uint64_t seed = 11;
  scatter(a, 200, 1000, &seed);
  assert_int_equal(peel(a, 1), -1);
  assert_int_equal(a->loop.outside_count, 200);
  free_assembly(a);
}

// Identities on random clouds of all densities and limits, from nothing peeled to hardly anything left.
static void random_clouds(void **state) {
  (void)state;
  uint64_t seed = 5;
  assembly *a = make_assembly();
  size_t outside = 0, peeled = 0;
  for (int trial = 0; trial < 60; trial++) {
    size_t count = 10 + 10 * (size_t)trial;
    scatter(a, count, (0.6 + random_unit(&seed)) * sqrt((double)count), &seed);
    const double limit[] = {0.05, 0.3, 0.8, 2, 10};
    for (size_t k = 0; k < sizeof limit / sizeof *limit; k++) {
      if (peel(a, limit[k]) != 0)
        continue;
      check_loop(a, limit[k]);
      outside += a->loop.outside_count;
      peeled += a->mesh.triangle_count - a->loop.triangle_count;
    }
  }
  assert_true(outside > 100 && peeled > 1000);
  free_assembly(a);
}

// EXACT: the loop is the same whatever order the points come in, and after scaling by a power of two.
static void invariance(void **state) {
  (void)state;
  uint64_t seed = 6;
  assembly *a = make_assembly(), *b = make_assembly();
  for (int trial = 0; trial < 20; trial++) {
    int32_t place[MAX_POINTS];
    scatter(a, 300, 17, &seed);
    b->n = a->n;
    for (size_t i = 0; i < a->n; i++) {
      size_t other = random_bits(&seed) % (i + 1);
      place[i] = place[other];
      place[other] = (int32_t)i;
    }
    for (size_t i = 0; i < a->n; i++) {
      b->x[place[i]] = 0x1p-8 * a->x[i];
      b->y[place[i]] = 0x1p-8 * a->y[i];
      b->radius[place[i]] = 0x1p-8 * a->radius[i];
    }
    assert_int_equal(peel(a, 0.4), 0);
    assert_int_equal(peel(b, 0x1p-8 * 0.4), 0);
    assert_int_equal(a->loop.count, b->loop.count);
    size_t shift = 0;
    while (shift < b->loop.count && b->loop.node[shift] != place[a->loop.node[0]])
      shift++;
    for (size_t k = 0; k < a->loop.count; k++)
      assert_int_equal(place[a->loop.node[k]], b->loop.node[(k + shift) % b->loop.count]);
  }
  free_assembly(a);
  free_assembly(b);
}

static double largest(geo_tensor t) {
  return fmax(fmax(fabs(t.xx), fabs(t.xy)), fmax(fabs(t.yx), fabs(t.yy)));
}

static geo_tensor triangle_gradient(const assembly *a, const double *vx, const double *vy, size_t t) {
  geo_tensor sum = {0, 0, 0, 0};
  for (int k = 0; k < 3; k++) {
    int32_t i = a->mesh.corner[t][k], p = a->mesh.corner[t][(k + 2) % 3], q = a->mesh.corner[t][(k + 1) % 3];
    geo_vec normal = {0.5 * (a->y[q] - a->y[p]), -0.5 * (a->x[q] - a->x[p])};
    sum = geo_tensor_add(sum, geo_outer((geo_vec){vx[i], vy[i]}, normal));
  }
  return geo_tensor_scale(1 / geo_mesh_area(&a->mesh, a->x, a->y, t), sum);
}

// ROUND: an affine velocity field gives its gradient, xy being the derivative of v_x along y; any field gives the area
// mean of the triangles' gradients. Near the origin and at 1000 sizes from it.
static void velocity_gradient(void **state) {
  (void)state;
  uint64_t seed = 8;
  assembly *a = make_assembly();
  static double vx[MAX_POINTS], vy[MAX_POINTS]; // scratch of this test alone
  for (int trial = 0; trial < 20; trial++) {
    scatter(a, 400, 20, &seed);
    for (size_t i = 0; i < a->n; i++)
      a->x[i] += trial % 2 ? 20000 : 0;
    assert_int_equal(peel(a, 0.5), 0);
    const geo_tensor given = {0.3, -1.5, 0.25, 2};
    for (size_t i = 0; i < a->n; i++) {
      vx[i] = 7 + given.xx * a->x[i] + given.xy * a->y[i];
      vy[i] = -4 + given.yx * a->x[i] + given.yy * a->y[i];
    }
    double digits = trial % 2 ? 1e-11 : 1e-13;
    geo_tensor got = geo_loop_velocity_gradient(&a->loop, a->x, a->y, vx, vy);
    assert_true(largest(geo_tensor_add(got, geo_tensor_scale(-1, given))) < digits);
    geo_tensor mean = {0, 0, 0, 0};
    for (size_t i = 0; i < a->n; i++) {
      vx[i] = random_unit(&seed) - 0.5;
      vy[i] = random_unit(&seed) - 0.5;
    }
    double area = geo_loop_area(&a->loop, a->x, a->y);
    for (size_t t = 0; t < a->mesh.triangle_count; t++) {
      double share = geo_mesh_area(&a->mesh, a->x, a->y, t) / area;
      if (a->inside[t])
        mean = geo_tensor_add(mean, geo_tensor_scale(share, triangle_gradient(a, vx, vy, t)));
    }
    got = geo_loop_velocity_gradient(&a->loop, a->x, a->y, vx, vy);
    assert_true(largest(geo_tensor_add(got, geo_tensor_scale(-1, mean))) < digits);
    assert_true(largest(got) > 1e-4);
  }
  free_assembly(a);
}

// EXACT: a loop read back is the loop written.
static void set(void **state) {
  (void)state;
  geo_loop loop;
  geo_loop_init(&loop);
  const int32_t node[4] = {1, 5, 9, 2};
  const double x[10] = {[1] = 0, [5] = 2, [9] = 2, [2] = 0}, y[10] = {[1] = 0, [5] = 0, [9] = 3, [2] = 3};
  geo_loop_set(&loop, node, 4);
  assert_int_equal(loop.count, 4);
  assert_memory_equal(loop.node, node, sizeof node);
  assert_true(geo_loop_area(&loop, x, y) == 6);
  geo_loop_set(&loop, node, 0);
  assert_int_equal(loop.count, 0);
  geo_loop_clear(&loop);
  assert_null(loop.node);
}

// ROUND: a block on four discs, two of them apart. Without a side the loop goes up between them, a trapezium of area 2
// less; along a rigid side it spans the gap, and still takes in a disc a little above the line of its neighbours.
static void rigid_side(void **state) {
  (void)state;
  unsigned char side[28] = {0};
  for (int lifted = 0; lifted < 2; lifted++) {
    assembly *a = make_assembly();
    add_block(a, 0, 1, 6, 4);
    const double x[] = {0, 1, 4, 5};
    for (int k = 0; k < 4; k++) {
      side[a->n] = 1;
      add_disc(a, x[k], lifted && k == 1 ? 0.05 : 0, 0.5);
    }
    assert_int_equal(peel_beside(a, side, 0.5), 0);
    assert_float_equal(geo_loop_area(&a->loop, a->x, a->y), lifted ? 20 - 0.5 * 4 * 0.05 : 20, 1e-13);
    check_simple(a);
    assert_int_equal(peel(a, 0.5), 0);
    assert_float_equal(geo_loop_area(&a->loop, a->x, a->y), lifted ? 18 - 0.5 * 1 * 0.05 - 0.5 * 1 * 0.05 : 18, 1e-13);
    free_assembly(a);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(rigid_side),
      cmocka_unit_test(block),
      cmocka_unit_test(notch),
      cmocka_unit_test(rattlers),
      cmocka_unit_test(necks),
      cmocka_unit_test(three),
      cmocka_unit_test(random_clouds),
      cmocka_unit_test(invariance),
      cmocka_unit_test(velocity_gradient),
      cmocka_unit_test(set),
      cmocka_unit_test(narrowest_bridge),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
