// Mesh: canonical form, adjacency, edges, areas; and the identities of vec.h.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "mesh.h"
#include "vec.h"

static uint64_t random_bits(uint64_t *state) {
  uint64_t z = *state += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}

static double random_unit(uint64_t *state) {
  return (double)(random_bits(state) >> 11) * 0x1p-53;
}

// A rows x columns grid of points, every square cut from its first corner to its last.
static size_t grid_triangles(int rows, int columns, int32_t (*corner)[3]) {
  size_t count = 0;
  for (int r = 0; r + 1 < rows; r++)
    for (int c = 0; c + 1 < columns; c++) {
      int32_t i = r * columns + c;
      memcpy(corner[count++], (int32_t[3]){i, i + 1, i + columns + 1}, sizeof *corner);
      memcpy(corner[count++], (int32_t[3]){i, i + columns + 1, i + columns}, sizeof *corner);
    }
  return count;
}

// EXACT: two triangles over four points, everything written out.
static void two_triangles(void **state) {
  (void)state;
  geo_mesh mesh;
  geo_mesh_init(&mesh);
  const int32_t corner[2][3] = {{3, 1, 2}, {1, 3, 0}};
  geo_mesh_set(&mesh, 4, corner, 2);
  const int32_t expected[2][3] = {{0, 1, 3}, {1, 2, 3}}, beside[2][3] = {{1, -1, -1}, {-1, 0, -1}};
  assert_int_equal(mesh.triangle_count, 2);
  assert_memory_equal(mesh.corner, expected, sizeof expected);
  assert_memory_equal(mesh.neighbour, beside, sizeof beside);
  geo_edge edge[6];
  assert_int_equal(geo_mesh_edges(&mesh, edge), 5);
  const geo_edge edges[5] = {{0, 1, 0, -1}, {0, 3, 0, -1}, {1, 2, 1, -1}, {1, 3, 0, 1}, {2, 3, 1, -1}};
  assert_memory_equal(edge, edges, sizeof edges);
  geo_mesh_clear(&mesh);
}

// EXACT: the result does not depend on the order or rotation of the triangles given.
static void order_does_not_matter(void **state) {
  (void)state;
  enum { ROWS = 12, COLUMNS = 9, COUNT = 2 * (ROWS - 1) * (COLUMNS - 1) };
  int32_t corner[COUNT][3];
  assert_int_equal(grid_triangles(ROWS, COLUMNS, corner), COUNT);
  geo_mesh first, second;
  geo_mesh_init(&first);
  geo_mesh_init(&second);
  geo_mesh_set(&first, ROWS * COLUMNS, (const int32_t(*)[3])corner, COUNT);
  uint64_t seed = 7;
  for (int trial = 0; trial < 20; trial++) {
    for (size_t t = COUNT - 1; t > 0; t--) {
      size_t u = random_bits(&seed) % (t + 1), turn = random_bits(&seed) % 3;
      int32_t moved[3];
      memcpy(moved, corner[t], sizeof moved);
      memcpy(corner[t], corner[u], sizeof moved);
      for (size_t k = 0; k < 3; k++)
        corner[u][k] = moved[(k + turn) % 3];
    }
    geo_mesh_set(&second, ROWS * COLUMNS, (const int32_t(*)[3])corner, COUNT);
    assert_memory_equal(first.corner, second.corner, sizeof corner);
    assert_memory_equal(first.neighbour, second.neighbour, sizeof corner);
  }
  assert_int_equal(first.revision, 1);
  assert_int_equal(second.revision, 20);
  geo_mesh_clear(&first);
  geo_mesh_clear(&second);
}

// EXACT: neighbours name each other across the reversed edge; edges ascend, carry their triangles and obey Euler.
static void adjacency_is_mutual(void **state) {
  (void)state;
  enum { ROWS = 15, COLUMNS = 20, COUNT = 2 * (ROWS - 1) * (COLUMNS - 1) };
  int32_t corner[COUNT][3];
  geo_mesh mesh;
  geo_mesh_init(&mesh);
  geo_mesh_set(&mesh, ROWS * COLUMNS, (const int32_t(*)[3])corner, grid_triangles(ROWS, COLUMNS, corner));
  size_t rim = 0;
  for (int32_t t = 0; t < COUNT; t++)
    for (int k = 0; k < 3; k++) {
      int32_t u = mesh.neighbour[t][k], m = 0;
      rim += u < 0;
      if (u < 0)
        continue;
      while (m < 3 && mesh.neighbour[u][m] != t)
        m++;
      assert_in_range(m, 0, 2);
      assert_int_equal(mesh.corner[t][(k + 1) % 3], mesh.corner[u][(m + 2) % 3]);
      assert_int_equal(mesh.corner[t][(k + 2) % 3], mesh.corner[u][(m + 1) % 3]);
    }
  assert_int_equal(rim, 2 * (ROWS - 1) + 2 * (COLUMNS - 1));
  geo_edge *edge = malloc(3 * COUNT * sizeof *edge);
  size_t edges = geo_mesh_edges(&mesh, edge);
  assert_int_equal(ROWS * COLUMNS + COUNT, edges + 1);
  for (size_t e = 0; e < edges; e++) {
    assert_true(edge[e].i < edge[e].j && (edge[e].u < 0 || edge[e].t < edge[e].u));
    if (e > 0)
      assert_true(edge[e - 1].i < edge[e].i || (edge[e - 1].i == edge[e].i && edge[e - 1].j < edge[e].j));
    for (int side = 0; side < 2; side++) {
      int32_t t = side ? edge[e].u : edge[e].t, has = 0;
      if (t < 0)
        continue;
      for (int k = 0; k < 3; k++)
        has += mesh.corner[t][k] == edge[e].i || mesh.corner[t][k] == edge[e].j;
      assert_int_equal(has, 2);
    }
  }
  free(edge);
  geo_mesh_clear(&mesh);
}

// EXACT: a hub with a hundred thousand neighbours (one smallest point for all edges).
static void hub(void **state) {
  (void)state;
  enum { COUNT = 100000 };
  int32_t(*corner)[3] = malloc(COUNT * sizeof *corner);
  for (int32_t t = 0; t < COUNT; t++)
    memcpy(corner[t], (int32_t[3]){t + 1, (t + 1) % COUNT + 1, 0}, sizeof *corner);
  geo_mesh mesh;
  geo_mesh_init(&mesh);
  geo_mesh_set(&mesh, COUNT + 1, (const int32_t(*)[3])corner, COUNT);
  for (int32_t t = 0; t < COUNT; t++) {
    assert_int_equal(mesh.corner[t][1], t + 1);
    assert_int_equal(mesh.neighbour[t][0], -1);
    assert_int_equal(mesh.neighbour[t][1], (t + 1) % COUNT);
    assert_int_equal(mesh.neighbour[t][2], (t + COUNT - 1) % COUNT);
  }
  geo_edge *edge = malloc(3 * COUNT * sizeof *edge);
  assert_int_equal(geo_mesh_edges(&mesh, edge), 2 * COUNT);
  for (int32_t e = 0; e < COUNT; e++)
    assert_true(edge[e].i == 0 && edge[e].j == e + 1 && edge[e].u >= 0);
  free(edge);
  free(corner);
  geo_mesh_clear(&mesh);
}

// EXACT: a mesh may shrink, and may be empty.
static void empty(void **state) {
  (void)state;
  geo_mesh mesh;
  geo_mesh_init(&mesh);
  const int32_t corner[1][3] = {{2, 0, 1}};
  geo_edge edge[3];
  geo_mesh_set(&mesh, 3, corner, 1);
  geo_mesh_set(&mesh, 3, corner, 0);
  assert_int_equal(mesh.triangle_count, 0);
  assert_int_equal(mesh.revision, 2);
  assert_int_equal(geo_mesh_edges(&mesh, edge), 0);
  geo_mesh_clear(&mesh);
  assert_null(mesh.corner);
}

// ROUND: area of one triangle against base times height, its sign, and a polygon's fan against n/2 sin(2 pi/n).
static void area(void **state) {
  (void)state;
  enum { COUNT = 100 };
  const double pi = 3.14159265358979323846;
  double x[COUNT] = {1, 4, 2}, y[COUNT] = {1, 1, 6};
  const int32_t one[2][3] = {{0, 1, 2}, {0, 2, 1}};
  geo_mesh mesh;
  geo_mesh_init(&mesh);
  geo_mesh_set(&mesh, 3, one, 2);
  assert_true(geo_mesh_area(&mesh, x, y, 0) == 7.5);
  assert_true(geo_mesh_area(&mesh, x, y, 1) == -7.5);
  int32_t corner[COUNT - 2][3];
  for (int32_t k = 0; k < COUNT; k++) {
    x[k] = cos(2 * pi * k / COUNT);
    y[k] = sin(2 * pi * k / COUNT);
    if (k + 2 < COUNT)
      memcpy(corner[k], (int32_t[3]){0, k + 1, k + 2}, sizeof *corner);
  }
  geo_mesh_set(&mesh, COUNT, (const int32_t(*)[3])corner, COUNT - 2);
  double sum = 0;
  for (size_t t = 0; t < mesh.triangle_count; t++)
    sum += geo_mesh_area(&mesh, x, y, t);
  assert_true(fabs(sum - 0.5 * COUNT * sin(2 * pi / COUNT)) < 100 * 2.2e-16 * sum);
  geo_mesh_clear(&mesh);
}

// ROUND: Lagrange's identity and the products of tensors.
static void vectors(void **state) {
  (void)state;
  uint64_t seed = 3;
  for (int trial = 0; trial < 1000; trial++) {
    geo_vec a = {random_unit(&seed) - 0.5, random_unit(&seed) - 0.5};
    geo_vec b = {random_unit(&seed) - 0.5, random_unit(&seed) - 0.5};
    double dot = geo_dot(a, b), cross = geo_cross(a, b), both = geo_dot(a, a) * geo_dot(b, b);
    assert_true(fabs(dot * dot + cross * cross - both) < 8 * 2.2e-16 * both);
    assert_true(fabs(geo_norm(geo_scale(3, a)) - 3 * geo_norm(a)) < 8 * 2.2e-16);
    assert_true(geo_trace(geo_outer(a, b)) == dot);
    geo_tensor aa = geo_outer(a, a), ab = geo_outer(a, b);
    assert_true(fabs(geo_contract(aa, ab) - geo_dot(a, a) * dot) < 8 * 2.2e-16);
    assert_true(geo_trace(geo_tensor_add(aa, geo_tensor_scale(-1, aa))) == 0);
    assert_true(geo_norm(geo_sub(geo_add(a, b), geo_add(b, a))) == 0);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(two_triangles),
      cmocka_unit_test(order_does_not_matter),
      cmocka_unit_test(adjacency_is_mutual),
      cmocka_unit_test(hub),
      cmocka_unit_test(empty),
      cmocka_unit_test(area),
      cmocka_unit_test(vectors),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
