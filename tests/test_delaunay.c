// Triangulations: exact oracles on integer coordinates, both backends, ties, far-off and degenerate clouds, errors.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "delaunay.h"
#include "predicate.h"
#include "regular.h"

__extension__ typedef __int128 wide; // exact for the determinants of the integer clouds below

typedef struct cloud {
  size_t n;
  double *x, *y, *w;
  bool weighted;
} cloud;

static uint64_t random_bits(uint64_t *state) {
  uint64_t z = *state += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}

static double random_unit(uint64_t *state) {
  return (double)(random_bits(state) >> 11) * 0x1p-53;
}

static cloud make_cloud(size_t n) {
  return (cloud){n, calloc(n, sizeof(double)), calloc(n, sizeof(double)), calloc(n, sizeof(double)), false};
}

static void free_cloud(cloud *c) {
  free(c->x);
  free(c->y);
  free(c->w);
}

static cloud uniform_cloud(size_t n, double size, uint64_t *seed) {
  cloud c = make_cloud(n);
  for (size_t i = 0; i < n; i++) {
    c.x[i] = size * random_unit(seed);
    c.y[i] = size * random_unit(seed);
  }
  return c;
}

static cloud square_lattice(size_t columns, size_t rows) {
  cloud c = make_cloud(columns * rows);
  for (size_t i = 0; i < c.n; i++) {
    c.x[i] = (double)(i % columns);
    c.y[i] = (double)(i / columns);
  }
  return c;
}

static cloud triangular_lattice(size_t columns, size_t rows) {
  cloud c = square_lattice(columns, rows);
  for (size_t i = 0; i < c.n; i++) {
    if (i / columns % 2)
      c.x[i] += 0.5;
    c.y[i] *= sqrt(0.75);
  }
  return c;
}

// Distinct integer points in [0, range)^2, weights in [0, weight_range).
static cloud integer_cloud(size_t n, uint64_t range, uint64_t weight_range, uint64_t *seed) {
  cloud c = make_cloud(n);
  c.weighted = weight_range > 0;
  for (size_t i = 0; i < n; i++) {
    bool fresh = false;
    while (!fresh) {
      c.x[i] = (double)(random_bits(seed) % range);
      c.y[i] = (double)(random_bits(seed) % range);
      fresh = true;
      for (size_t j = 0; j < i; j++)
        fresh = fresh && (c.x[i] != c.x[j] || c.y[i] != c.y[j]);
    }
    if (c.weighted)
      c.w[i] = (double)(random_bits(seed) % weight_range);
  }
  return c;
}

static geo_delaunay_result triangulate(const geo_delaunay_backend *backend, const cloud *c, geo_mesh *mesh,
                                       geo_delaunay_report *report) {
  return geo_delaunay(backend, c->x, c->y, c->weighted ? c->w : NULL, c->n, mesh, report);
}

static void assert_same_triangles(const geo_mesh *a, const geo_mesh *b) {
  assert_int_equal(a->triangle_count, b->triangle_count);
  assert_memory_equal(a->corner, b->corner, a->triangle_count * sizeof *a->corner);
  assert_memory_equal(a->neighbour, b->neighbour, a->triangle_count * sizeof *a->neighbour);
}

// By every backend built in, with the same answer. `mesh` is initialised here.
static geo_delaunay_report by_all_backends(const cloud *c, geo_mesh *mesh) {
  geo_delaunay_report report, other_report;
  geo_mesh other;
  geo_mesh_init(mesh);
  geo_mesh_init(&other);
  const geo_delaunay_backend *const *backend = geo_delaunay_backends();
  assert_int_equal(triangulate(backend[0], c, mesh, &report), GEO_DELAUNAY_OK);
  assert_string_equal(report.text, "");
  for (size_t k = 1; backend[k]; k++) {
    assert_int_equal(triangulate(backend[k], c, &other, &other_report), GEO_DELAUNAY_OK);
    assert_same_triangles(mesh, &other);
    assert_int_equal(report.hidden, other_report.hidden);
  }
  geo_mesh_clear(&other);
  return report;
}

static bool is_edge(const geo_mesh *mesh, int32_t i, int32_t j) {
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int k = 0; k < 3; k++) {
      int32_t a = mesh->corner[t][k], b = mesh->corner[t][(k + 1) % 3];
      if ((a == i && b == j) || (a == j && b == i))
        return true;
    }
  return false;
}

// V - E + T = 1, E = 3V - 3 - B, T = 2V - 2 - B, all points used but the hidden ones. Returns B.
static size_t check_counts(const geo_mesh *mesh, size_t n, size_t hidden) {
  size_t triangles = mesh->triangle_count, rim = 0, points = 0;
  geo_edge *edge = malloc(3 * triangles * sizeof *edge);
  unsigned char *seen = calloc(n, 1);
  size_t edges = geo_mesh_edges(mesh, edge);
  for (size_t e = 0; e < edges; e++) {
    rim += edge[e].u < 0;
    points += !seen[edge[e].i] + !seen[edge[e].j];
    seen[edge[e].i] = seen[edge[e].j] = 1;
  }
  free(edge);
  free(seen);
  assert_int_equal(points, n - hidden);
  assert_int_equal(points + triangles, edges + 1);
  assert_int_equal(edges, 3 * points - 3 - rim);
  assert_int_equal(triangles, 2 * points - 2 - rim);
  return rim;
}

// ---- exact oracles on integer coordinates ----

static wide cross_exact(const cloud *c, int32_t i, int32_t j, int32_t k) {
  wide ax = (wide)(c->x[j] - c->x[i]), ay = (wide)(c->y[j] - c->y[i]);
  wide bx = (wide)(c->x[k] - c->x[i]), by = (wide)(c->y[k] - c->y[i]);
  return ax * by - ay * bx;
}

// Positive if d lies inside the circle of triangle t (power: below its plane).
static wide conflict_exact(const cloud *c, const int32_t t[3], int32_t d) {
  wide px[3], py[3], lift[3];
  for (int k = 0; k < 3; k++) {
    px[k] = (wide)(c->x[t[k]] - c->x[d]);
    py[k] = (wide)(c->y[t[k]] - c->y[d]);
    lift[k] = px[k] * px[k] + py[k] * py[k] - (wide)(c->w[t[k]] - c->w[d]);
  }
  return lift[0] * (px[1] * py[2] - px[2] * py[1]) + lift[1] * (px[2] * py[0] - px[0] * py[2]) +
         lift[2] * (px[0] * py[1] - px[1] * py[0]);
}

// Whether i -> j is an edge of the hull: nothing to its right, nothing between its ends.
static bool on_hull(const cloud *c, int32_t i, int32_t j) {
  for (int32_t k = 0; k < (int32_t)c->n; k++) {
    if (k == i || k == j)
      continue;
    wide side = cross_exact(c, i, j, k);
    double ahead = (c->x[i] - c->x[k]) * (c->x[j] - c->x[k]) + (c->y[i] - c->y[k]) * (c->y[j] - c->y[k]);
    if (side < 0 || (side == 0 && ahead < 0))
      return false;
  }
  return i != j;
}

// Twice the hull's area and the number of points on its rim, straight sides included, straight from the definition.
static wide hull_exact(const cloud *c, size_t *rim) {
  wide area = 0;
  *rim = 0;
  for (int32_t i = 0; i < (int32_t)c->n; i++)
    for (int32_t j = 0; j < (int32_t)c->n; j++) {
      if (!on_hull(c, i, j))
        continue;
      area += (wide)c->x[i] * (wide)c->y[j] - (wide)c->y[i] * (wide)c->x[j];
      ++*rim;
    }
  return area;
}

// The definition itself: positive triangles that fill the hull, no point in conflict with any; a tied pair of triangles
// shares its smallest index (the fan).
static void check_exactly(const cloud *c, const geo_mesh *mesh) {
  size_t rim;
  wide area = 0, hull = hull_exact(c, &rim);
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const int32_t *corner = mesh->corner[t];
    wide twice = cross_exact(c, corner[0], corner[1], corner[2]);
    assert_true(twice > 0);
    area += twice;
    for (int32_t d = 0; d < (int32_t)c->n; d++)
      if (d != corner[0] && d != corner[1] && d != corner[2])
        assert_true(conflict_exact(c, corner, d) <= 0);
    for (int k = 0; k < 3; k++) {
      int32_t u = mesh->neighbour[t][k];
      if (u < 0)
        continue;
      int32_t d = mesh->corner[u][mesh->neighbour[u][0] == (int32_t)t   ? 0
                                  : mesh->neighbour[u][1] == (int32_t)t ? 1
                                                                        : 2];
      if (conflict_exact(c, corner, d) == 0)
        assert_int_equal(corner[0], mesh->corner[u][0]);
    }
  }
  assert_true(area == hull);
}

// EXACT: empty circles by brute force; few points on few places give every kind of tie and straight rim.
static void empty_circles(void **state) {
  (void)state;
  uint64_t seed = 1;
  const uint64_t range[] = {4, 6, 10, 30, 1000, 1u << 20};
  for (size_t r = 0; r < sizeof range / sizeof *range; r++)
    for (int trial = 0; trial < 60; trial++) {
      size_t n = range[r] < 10 ? 5 + (size_t)trial % (range[r] * range[r] - 5) : 5 + (size_t)trial;
      cloud c = integer_cloud(n, range[r], 0, &seed);
      geo_mesh mesh;
      geo_mesh_init(&mesh);
      geo_delaunay_result result = triangulate(geo_delaunay_backends()[0], &c, &mesh, NULL);
      geo_mesh_clear(&mesh);
      assert_true(result == GEO_DELAUNAY_OK || (result == GEO_DELAUNAY_COLLINEAR && n < 8));
      if (result == GEO_DELAUNAY_OK) {
        geo_delaunay_report report = by_all_backends(&c, &mesh);
        size_t rim;
        hull_exact(&c, &rim);
        assert_int_equal(report.hidden, 0);
        assert_int_equal(check_counts(&mesh, n, 0), rim);
        check_exactly(&c, &mesh);
      }
      geo_mesh_clear(&mesh);
      free_cloud(&c);
    }
}

// EXACT: the power triangulation by brute force, hidden points and coplanar lifted points among them.
static void power_planes(void **state) {
  (void)state;
  uint64_t seed = 2;
  const uint64_t range[] = {5, 8, 30, 1000, 1u << 20}, weights[] = {2, 4, 16, 100, 1000000};
  size_t hidden = 0;
  for (size_t r = 0; r < sizeof range / sizeof *range; r++)
    for (size_t s = 0; s < sizeof weights / sizeof *weights; s++)
      for (int trial = 0; trial < 20; trial++) {
        cloud c = integer_cloud(5 + (size_t)trial, range[r], weights[s], &seed);
        geo_mesh mesh;
        geo_delaunay_report report = by_all_backends(&c, &mesh);
        check_counts(&mesh, c.n, report.hidden);
        check_exactly(&c, &mesh);
        hidden += report.hidden;
        geo_mesh_clear(&mesh);
        free_cloud(&c);
      }
  assert_true(hidden > 1000);
}

// EXACT: a site whose lifted point lies in the others' plane, within a face or on the rim, has a cell without interior
// and is hidden; the least bit of weight more makes it a vertex, less hides it as well.
static void cells_without_interior(void **state) {
  (void)state;
  for (int more = -1; more <= 1; more++) {
    cloud c = make_cloud(6);
    const double x[] = {0, 1, 1, 2, 2, 0}, y[] = {0, 1, 0, 0, 2, 2}, w[] = {0, -2, -1, 0, 0, 0};
    c.weighted = true;
    for (int i = 0; i < 6; i++) {
      c.x[i] = x[i];
      c.y[i] = y[i];
      c.w[i] = w[i] + (i == 1 || i == 2 ? more * 0x1p-50 : 0);
    }
    geo_mesh mesh;
    assert_int_equal(by_all_backends(&c, &mesh).hidden, more > 0 ? 0 : 2);
    const int32_t fan[2][3] = {{0, 3, 4}, {0, 4, 5}};
    if (more <= 0)
      assert_memory_equal(mesh.corner, fan, sizeof fan);
    assert_int_equal(mesh.triangle_count, more > 0 ? 5 : 2);
    geo_mesh_clear(&mesh);
    free_cloud(&c);
  }
}

// EXACT: equal weights change nothing, whatever their size and sign.
static void equal_weights(void **state) {
  (void)state;
  uint64_t seed = 3;
  const double weight[] = {0, 0.25, 1e6, -1e6};
  for (size_t k = 0; k < sizeof weight / sizeof *weight; k++) {
    cloud c = k % 2 ? square_lattice(12, 9) : uniform_cloud(300, 1000, &seed);
    geo_mesh plain, power;
    by_all_backends(&c, &plain);
    c.weighted = true;
    for (size_t i = 0; i < c.n; i++)
      c.w[i] = weight[k];
    assert_int_equal(by_all_backends(&c, &power).hidden, 0);
    assert_same_triangles(&plain, &power);
    geo_mesh_clear(&plain);
    geo_mesh_clear(&power);
    free_cloud(&c);
  }
}

// ---- lattices, rims, far away ----

// EXACT: a square lattice in any numbering: each square is cut from its smallest index, the rim keeps all its points;
// the same at spacing 0.1, where round-off and not the rule decides, in counts; and far from the origin.
static void square_lattices(void **state) {
  (void)state;
  enum { COLUMNS = 30, ROWS = 20 };
  uint64_t seed = 4;
  for (int trial = 0; trial < 8; trial++) {
    cloud c = square_lattice(COLUMNS, ROWS);
    int32_t place[ROWS * COLUMNS];
    for (size_t i = 0; i < c.n; i++) {
      size_t other = trial ? random_bits(&seed) % (i + 1) : i;
      place[i] = place[other];
      place[other] = (int32_t)i;
    }
    for (size_t i = 0; i < c.n; i++) {
      c.x[place[i]] = (double)(i % COLUMNS) + (trial > 4 ? 1e9 : 0);
      c.y[place[i]] = (double)(i / COLUMNS) - (trial > 6 ? 1e9 : 0);
    }
    int32_t expected[2 * (ROWS - 1) * (COLUMNS - 1)][3];
    size_t count = 0;
    for (size_t i = 0; i + COLUMNS < c.n; i++) {
      if (i % COLUMNS == COLUMNS - 1)
        continue;
      int32_t square[4] = {place[i], place[i + 1], place[i + COLUMNS + 1], place[i + COLUMNS]}, least = 0;
      for (int k = 1; k < 4; k++)
        if (square[k] < square[least])
          least = k;
      for (int k = 1; k < 3; k++, count++)
        for (int m = 0; m < 3; m++)
          expected[count][m] = square[(least + (m ? m + k - 1 : 0)) % 4];
    }
    geo_mesh mesh, wanted;
    geo_mesh_init(&wanted);
    geo_mesh_set(&wanted, c.n, (const int32_t(*)[3])expected, count);
    by_all_backends(&c, &mesh);
    assert_same_triangles(&mesh, &wanted);
    for (size_t i = 0; i < c.n; i++) {
      c.x[i] *= 0.1;
      c.y[i] *= 0.1;
    }
    geo_mesh_clear(&mesh);
    by_all_backends(&c, &mesh);
    check_counts(&mesh, c.n, 0);
    geo_mesh_clear(&mesh);
    geo_mesh_clear(&wanted);
    free_cloud(&c);
  }
}

// EXACT counts: triangular lattice; its rim by counting: all of the bottom and top row, every other point at the sides.
static void triangular_lattices(void **state) {
  (void)state;
  enum { COLUMNS = 24, ROWS = 31 };
  for (int far = 0; far < 3; far++) {
    cloud c = triangular_lattice(COLUMNS, ROWS);
    for (size_t i = 0; i < c.n; i++) {
      c.x[i] += far > 0 ? 1e6 : 0;
      c.y[i] -= far > 1 ? 1e9 : 0;
    }
    geo_mesh mesh;
    by_all_backends(&c, &mesh);
    size_t rim = check_counts(&mesh, c.n, 0);
    if (far < 2)
      assert_int_equal(rim, 2 * COLUMNS + (ROWS + 1) / 2 - 2 + (ROWS - 1) / 2);
    size_t short_edges = 0;
    geo_edge *edge = malloc(3 * mesh.triangle_count * sizeof *edge);
    size_t edges = geo_mesh_edges(&mesh, edge);
    for (size_t e = 0; e < edges; e++)
      short_edges += hypot(c.x[edge[e].i] - c.x[edge[e].j], c.y[edge[e].i] - c.y[edge[e].j]) < 1.001;
    assert_int_equal(short_edges, ROWS * (COLUMNS - 1) + (ROWS - 1) * (2 * COLUMNS - 1));
    free(edge);
    geo_mesh_clear(&mesh);
    free_cloud(&c);
  }
}

// EXACT: sides that are straight, or straight but for the last bit, with the counts of a valid triangulation; all
// points on one circle; two rows; a nearly straight strip.
static void rims(void **state) {
  (void)state;
  uint64_t seed = 5;
  for (int kind = 0; kind < 6; kind++)
    for (int trial = 0; trial < 10; trial++) {
      size_t n = 20 + 40 * (size_t)trial;
      cloud c = uniform_cloud(n, 1, &seed);
      for (size_t i = 0; i < n; i++) {
        double along = kind == 1 ? (double)i / 64 : random_unit(&seed), bits = (double)(random_bits(&seed) % 5) - 2;
        if (kind < 3 && i % 2) {
          c.x[i] = i % 8 == 1 ? 0 : i % 8 == 3 ? 1 : along;
          c.y[i] = i % 8 == 5 ? 0 : i % 8 == 7 ? 1 : along;
          if (kind == 2)
            c.y[i] += 0x1p-52 * bits;
          if (kind == 2)
            c.x[i] += 0x1p-52 * bits * 3;
        }
        if (kind == 3)
          c.x[i] = cos(6.283185307179586 * along);
        if (kind == 3)
          c.y[i] = sin(6.283185307179586 * along);
        if (kind == 4)
          c.y[i] = (double)(i % 2);
        if (kind == 5)
          c.y[i] = c.x[i] / 3;
      }
      geo_mesh mesh;
      by_all_backends(&c, &mesh);
      size_t rim = check_counts(&mesh, n, 0);
      if (kind == 4)
        assert_int_equal(rim, n);
      geo_mesh_clear(&mesh);
      free_cloud(&c);
    }
}

// EXACT: the same triangles at the origin and far from it (the coordinates shifted without rounding), one axis or both.
static void far_away(void **state) {
  (void)state;
  uint64_t seed = 6;
  const double offset[] = {1e6, -1e9, 0x1p40};
  for (int weighted = 0; weighted < 2; weighted++)
    for (size_t k = 0; k < sizeof offset / sizeof *offset; k++)
      for (int axes = 1; axes < 4; axes++) {
        cloud c = integer_cloud(400, 20000, 0, &seed);
        c.weighted = weighted;
        for (size_t i = 0; i < c.n; i++) {
          c.x[i] /= 1024;
          c.y[i] /= 1024;
          c.w[i] = (double)(random_bits(&seed) % 1024) / 1024;
        }
        geo_mesh near, far;
        by_all_backends(&c, &near);
        for (size_t i = 0; i < c.n; i++) {
          if (axes & 1)
            c.x[i] += offset[k];
          if (axes & 2)
            c.y[i] += offset[k];
        }
        by_all_backends(&c, &far);
        assert_same_triangles(&near, &far);
        geo_mesh_clear(&near);
        geo_mesh_clear(&far);
        free_cloud(&c);
      }
}

// ---- invariance ----

// EXACT: translation by any vector, rotation, scaling by powers of two and renumbering leave the triangles of a random
// cloud, plain and weighted. (Random clouds have no ties.)
static void invariance(void **state) {
  (void)state;
  uint64_t seed = 7;
  for (int trial = 0; trial < 40; trial++) {
    cloud c = uniform_cloud(300, 10, &seed), moved = make_cloud(300);
    c.weighted = moved.weighted = trial % 2;
    double angle = 6.283185307179586 * random_unit(&seed), dx = 100 * random_unit(&seed),
           scale = ldexp(1, 3 * trial - 60);
    int32_t place[300];
    for (size_t i = 0; i < c.n; i++) {
      c.w[i] = 0.25 * random_unit(&seed);
      size_t other = random_bits(&seed) % (i + 1);
      place[i] = place[other];
      place[other] = (int32_t)i;
    }
    geo_mesh mesh, other, renamed;
    by_all_backends(&c, &mesh);
    for (int kind = 0; kind < 4; kind++) {
      for (size_t i = 0; i < c.n; i++) {
        size_t at = kind == 3 ? (size_t)place[i] : i;
        double x = c.x[i], y = c.y[i];
        moved.x[at] = kind == 0 ? x + dx : kind == 1 ? x * cos(angle) - y * sin(angle) : kind == 2 ? x * scale : x;
        moved.y[at] = kind == 0 ? y - 2 * dx : kind == 1 ? x * sin(angle) + y * cos(angle) : kind == 2 ? y * scale : y;
        moved.w[at] = kind == 2 ? c.w[i] * scale * scale : c.w[i];
      }
      by_all_backends(&moved, &other);
      geo_mesh_init(&renamed);
      int32_t(*corner)[3] = malloc(mesh.triangle_count * sizeof *corner);
      for (size_t t = 0; t < mesh.triangle_count; t++)
        for (int k = 0; k < 3; k++)
          corner[t][k] = kind == 3 ? place[mesh.corner[t][k]] : mesh.corner[t][k];
      geo_mesh_set(&renamed, c.n, (const int32_t(*)[3])corner, mesh.triangle_count);
      assert_same_triangles(&other, &renamed);
      free(corner);
      geo_mesh_clear(&renamed);
      geo_mesh_clear(&other);
    }
    geo_mesh_clear(&mesh);
    free_cloud(&c);
    free_cloud(&moved);
  }
}

// EXACT: coordinates down to 1e-300 and up to 1e300 give the triangles they give at 1.
static void extreme_sizes(void **state) {
  (void)state;
  uint64_t seed = 8;
  for (int exponent = -980; exponent <= 980; exponent += 245) {
    cloud c = integer_cloud(200, 64, 0, &seed);
    geo_mesh at_one, there;
    by_all_backends(&c, &at_one);
    for (size_t i = 0; i < c.n; i++) {
      c.x[i] = ldexp(c.x[i], exponent);
      c.y[i] = ldexp(c.y[i], exponent);
    }
    by_all_backends(&c, &there);
    assert_same_triangles(&at_one, &there);
    geo_mesh_clear(&at_one);
    geo_mesh_clear(&there);
    free_cloud(&c);
  }
}

// ---- touching disks ----

// Two disks of radius 1 that touch, and a small disk on either side that touches both.
static cloud pinched_pair(double ratio) {
  double r = 1 / ratio, height = sqrt((1 + r) * (1 + r) - 1);
  const double x[] = {-1, 1, 0, 0, -4, 4}, y[] = {0, 0, height, -height, 0.1, -0.1}, radius[] = {1, 1, r, r, 1, 1};
  cloud c = make_cloud(6);
  for (size_t i = 0; i < 6; i++) {
    c.x[i] = x[i];
    c.y[i] = y[i];
    c.w[i] = radius[i] * radius[i];
  }
  return c;
}

// Closed form: the big disks keep their edge below size ratio 1 + sqrt(2) and lose it above; in power they keep it.
static void pinched(void **state) {
  (void)state;
  const double ratio[] = {1, 1.5, 2.3, 2.41, 2.414, 2.415, 2.42, 2.6, 5, 50};
  for (size_t k = 0; k < sizeof ratio / sizeof *ratio; k++) {
    cloud c = pinched_pair(ratio[k]);
    geo_mesh mesh;
    by_all_backends(&c, &mesh);
    assert_int_equal(is_edge(&mesh, 0, 1), ratio[k] < 1 + sqrt(2));
    geo_mesh_clear(&mesh);
    c.weighted = true;
    by_all_backends(&c, &mesh);
    assert_true(is_edge(&mesh, 0, 1));
    geo_mesh_clear(&mesh);
    free_cloud(&c);
  }
}

// Grows a cluster without overlaps: each new disk touches two earlier ones, listed in `touch`.
static cloud grow_cluster(size_t n, double ratio, int32_t (*touch)[2], size_t *touches, uint64_t *seed) {
  cloud c = make_cloud(n);
  double *radius = malloc(n * sizeof *radius);
  *touches = 1;
  touch[0][0] = 0;
  touch[0][1] = 1;
  radius[0] = radius[1] = ratio;
  c.x[1] = 2 * ratio;
  for (size_t k = 2; k < n;) {
    size_t i = random_bits(seed) % k, j = random_bits(seed) % k;
    double r = random_bits(seed) % 2 ? 1 : 1 + (ratio - 1) * random_unit(seed);
    double a = radius[i] + r, b = radius[j] + r, dx = c.x[j] - c.x[i], dy = c.y[j] - c.y[i], d = hypot(dx, dy);
    if (i == j || d >= a + b)
      continue;
    double along = (a * a - b * b + d * d) / (2 * d), up = sqrt(a * a - along * along);
    double x = c.x[i] + (along * dx - up * dy) / d, y = c.y[i] + (along * dy + up * dx) / d;
    bool free_place = true;
    for (size_t m = 0; m < k && free_place; m++)
      free_place = hypot(x - c.x[m], y - c.y[m]) > (radius[m] + r) * (1 - 1e-14);
    if (!free_place)
      continue;
    c.x[k] = x;
    c.y[k] = y;
    radius[k] = r;
    for (int side = 0; side < 2; side++) {
      touch[*touches][0] = (int32_t)(side ? i : j);
      touch[(*touches)++][1] = (int32_t)k;
    }
    k++;
  }
  for (size_t k = 0; k < n; k++)
    c.w[k] = radius[k] * radius[k];
  free(radius);
  return c;
}

// In clusters of touching disks every touching pair is an edge: plain up to ratio 2.4, power at any ratio. At ratio 8
// plain loses some, so the test can tell.
static void touching_disks(void **state) {
  (void)state;
  enum { N = 120 };
  uint64_t seed = 9;
  const double ratio[] = {1.5, 2.4, 4, 8};
  size_t lost[4] = {0};
  for (size_t k = 0; k < 4; k++)
    for (int trial = 0; trial < 10; trial++) {
      int32_t touch[2 * N][2];
      size_t touches;
      cloud c = grow_cluster(N, ratio[k], touch, &touches, &seed);
      geo_mesh plain, power;
      by_all_backends(&c, &plain);
      c.weighted = true;
      by_all_backends(&c, &power);
      for (size_t t = 0; t < touches; t++) {
        lost[k] += !is_edge(&plain, touch[t][0], touch[t][1]);
        assert_true(is_edge(&power, touch[t][0], touch[t][1]));
      }
      geo_mesh_clear(&plain);
      geo_mesh_clear(&power);
      free_cloud(&c);
    }
  assert_int_equal(lost[0] + lost[1], 0);
  assert_true(lost[3] > 0);
}

// ---- size, errors, parts ----

// EXACT: a hundred thousand points, random and (weighted) perturbed lattice.
static void many(void **state) {
  (void)state;
  uint64_t seed = 10;
  for (int weighted = 0; weighted < 2; weighted++) {
    cloud c = weighted ? square_lattice(400, 250) : uniform_cloud(100000, 300, &seed);
    c.weighted = weighted;
    for (size_t i = 0; i < c.n && weighted; i++) {
      c.x[i] += 0.3 * random_unit(&seed);
      c.y[i] += 0.3 * random_unit(&seed);
      c.w[i] = 0.25 * random_unit(&seed);
    }
    geo_mesh mesh;
    geo_delaunay_report report = by_all_backends(&c, &mesh);
    check_counts(&mesh, c.n, report.hidden);
    geo_mesh_clear(&mesh);
    free_cloud(&c);
  }
}

// EXACT: three points, either way round, even where their triangle is as thin as can be.
static void three_points(void **state) {
  (void)state;
  const double height[] = {1, -1, 1e-9, -5e-324, 1e-60};
  for (size_t k = 0; k < sizeof height / sizeof *height; k++) {
    cloud c = make_cloud(3);
    c.x[1] = 1;
    c.x[2] = 0.25;
    c.y[2] = height[k];
    geo_mesh mesh;
    geo_mesh_init(&mesh);
    if (fabs(height[k]) > 1e-61) {
      by_all_backends(&c, &mesh);
      const int32_t up[3] = {0, 1, 2}, down[3] = {0, 2, 1};
      assert_int_equal(mesh.triangle_count, 1);
      assert_memory_equal(mesh.corner[0], height[k] > 0 ? up : down, sizeof up);
    } else {
      assert_int_equal(triangulate(geo_delaunay_backends()[0], &c, &mesh, NULL), GEO_DELAUNAY_COLLINEAR);
    }
    geo_mesh_clear(&mesh);
    free_cloud(&c);
  }
}

static void expect_error(const cloud *c, geo_delaunay_result result, int32_t first, int32_t second, const char *text) {
  for (const geo_delaunay_backend *const *backend = geo_delaunay_backends(); *backend; backend++) {
    geo_mesh mesh;
    geo_mesh_init(&mesh);
    const int32_t kept[1][3] = {{0, 1, 2}};
    geo_mesh_set(&mesh, 3, kept, 1);
    geo_delaunay_report report;
    assert_int_equal(triangulate(*backend, c, &mesh, &report), result);
    assert_int_equal(report.first, first);
    assert_int_equal(report.second, second);
    assert_non_null(strstr(report.text, text));
    assert_int_equal(triangulate(*backend, c, &mesh, NULL), result);
    assert_true(mesh.revision == 1 && mesh.triangle_count == 1);
    geo_mesh_clear(&mesh);
  }
}

// EXACT: every error, what it reports, and that the mesh stays as it was.
static void errors(void **state) {
  (void)state;
  uint64_t seed = 11;
  cloud c = uniform_cloud(100, 1, &seed);
  c.n = 2;
  expect_error(&c, GEO_DELAUNAY_TOO_FEW, -1, -1, "at least three");
  c.n = 100;
  c.x[71] = c.x[17];
  c.y[71] = c.y[17];
  c.x[80] = c.x[60];
  c.y[80] = c.y[60];
  expect_error(&c, GEO_DELAUNAY_DUPLICATE, 17, 71, "points 17 and 71 coincide");
  c.weighted = true;
  c.w[17] = 1;
  expect_error(&c, GEO_DELAUNAY_DUPLICATE, 17, 71, "points 17 and 71 coincide");
  c.w[17] = (double)INFINITY;
  expect_error(&c, GEO_DELAUNAY_NOT_FINITE, 17, -1, "point 17");
  c.weighted = false;
  c.x[40] = (double)NAN;
  expect_error(&c, GEO_DELAUNAY_NOT_FINITE, 40, -1, "point 40");
  for (size_t i = 0; i < c.n; i++) {
    c.x[i] = 1 + 3 * (double)i;
    c.y[i] = 5 - 7 * (double)i;
    c.w[i] = i == 5 ? 1e200 : 0;
  }
  expect_error(&c, GEO_DELAUNAY_COLLINEAR, -1, -1, "one line");
  c.weighted = true;
  expect_error(&c, GEO_DELAUNAY_NOT_FINITE, 5, -1, "weight of point 5");
  c.weighted = false;
  c.x[0] = c.y[0] = 0;
  c.x[1] = -0.0;
  c.y[1] = 0;
  expect_error(&c, GEO_DELAUNAY_DUPLICATE, 0, 1, "points 0 and 1");
  free_cloud(&c);
}

// The registry: qhull is always there, cgal where built in and then first; unknown names are not found.
static void registry(void **state) {
  (void)state;
  assert_non_null(geo_delaunay_backend_find("qhull"));
  assert_null(geo_delaunay_backend_find("voronoi"));
  assert_non_null(geo_delaunay_backends()[0]);
  if (!geo_delaunay_backend_find("cgal"))
    skip(); // then the agreement of backends has not been tested either
  assert_string_equal(geo_delaunay_backends()[0]->name, "cgal");
  assert_string_equal(geo_delaunay_backends()[1]->name, "qhull");
}

// The right triangulation of the first half of the points, as a candidate for all of them.
static void half_triangulated(const cloud *c, geo_mesh *mesh) {
  cloud half = *c;
  half.n = c->n / 2;
  geo_mesh part;
  by_all_backends(&half, &part);
  geo_mesh_set(mesh, c->n, (const int32_t(*)[3])part.corner, part.triangle_count);
  geo_mesh_clear(&part);
}

// A backend that looks at what it is given and then fails.
static geo_delaunay_result inspect(const double *x, const double *y, const double *weight, size_t n, geo_mesh *mesh,
                                   geo_delaunay_report *report) {
  (void)mesh;
  double largest = 0;
  for (size_t i = 0; i < n; i++)
    largest = fmax(largest, fmax(fabs(x[i]), fabs(y[i])));
  assert_true(largest >= 1 && largest < 2);
  assert_true(x[1] - x[0] == y[2] - y[0] && weight[1] == (x[1] - x[0]) * (x[1] - x[0]));
  assert_true(fabs(x[0]) <= 2 * fabs(x[1] - x[0]) && fabs(y[0]) <= 2 * fabs(y[2] - y[0]));
  snprintf(report->text, sizeof report->text, "inspected");
  return GEO_DELAUNAY_BACKEND;
}

// EXACT: a backend gets centred coordinates of size 1, their differences and weights to scale; when it fails its words
// are passed on and the mesh stays.
static void what_a_backend_gets(void **state) {
  (void)state;
  const geo_delaunay_backend fake = {"fake", "", inspect};
  const double offset[] = {0, 3, -3, 1000, 1e9, -1e12};
  for (size_t k = 0; k < sizeof offset / sizeof *offset; k++) {
    const double x[3] = {offset[k], offset[k] + 7, offset[k]}, y[3] = {-offset[k], -offset[k], 7 - offset[k]};
    const double weight[3] = {0, 49, 0};
    geo_mesh mesh;
    geo_mesh_init(&mesh);
    geo_delaunay_report report;
    assert_int_equal(geo_delaunay(&fake, x, y, weight, 3, &mesh, &report), GEO_DELAUNAY_BACKEND);
    assert_string_equal(report.text, "inspected");
    assert_int_equal(mesh.revision, 0);
  }
}

// EXACT: the repair reaches the same triangles from nothing, from rubbish, from half the sites (the rest missing,
// inside and outside) and from the wrong triangulation (plain for weighted sites: vertices to hide, edges to flip).
static void repair(void **state) {
  (void)state;
  uint64_t seed = 12;
  for (int trial = 0; trial < 40; trial++) {
    cloud c = trial % 4 == 3 ? square_lattice(15, 15) : integer_cloud(200, trial % 4 ? 1000 : 40, 0, &seed);
    geo_mesh candidate, expected;
    by_all_backends(&c, &candidate);
    c.weighted = true;
    double most = trial % 8 < 4 ? 2 : 200;
    for (size_t i = 0; i < c.n; i++)
      c.w[i] = floor(most * random_unit(&seed));
    size_t hidden = by_all_backends(&c, &expected).hidden;
    geo_site *site = malloc(c.n * sizeof *site);
    for (size_t i = 0; i < c.n; i++)
      site[i] = (geo_site){c.x[i] / 1024, c.y[i] / 1024, c.w[i] / (1 << 20)};
    int32_t rubbish[100][3];
    for (size_t t = 0; t < 100; t++)
      for (size_t k = 0; k < 3; k++)
        rubbish[t][k] = (int32_t)(random_bits(&seed) % c.n);
    for (int kind = 0; kind < 4; kind++) {
      if (kind == 3)
        half_triangulated(&c, &candidate);
      else if (kind)
        geo_mesh_set(&candidate, c.n, (const int32_t(*)[3])rubbish, kind == 1 ? 100 : 0);
      assert_int_equal(geo_regular_repair(site, c.n, &candidate), hidden);
      assert_same_triangles(&candidate, &expected);
    }
    free(site);
    geo_mesh_clear(&candidate);
    geo_mesh_clear(&expected);
    free_cloud(&c);
  }
}

// EXACT: predicates on and beside lines and circles, a last bit or less away, against integers and closed forms.
static void predicates(void **state) {
  (void)state;
  uint64_t seed = 13;
  const geo_site a = {1, 0, 0}, b = {0, 1, 0}, c = {-1, 0, 0};
  assert_int_equal(geo_conflict(a, b, c, (geo_site){0, -1, 0}), 0);
  assert_int_equal(geo_conflict(a, b, c, (geo_site){0x1p-100, -1, 0}), -1);
  assert_int_equal(geo_conflict(a, b, c, (geo_site){0x1p-100, -1 + 0x1p-53, 0}), 1);
  assert_int_equal(geo_conflict(a, b, c, (geo_site){0, -1, 0x1p-200}), 1);
  assert_int_equal(geo_conflict(a, b, c, (geo_site){0, -1, -0x1p-200}), -1);
  assert_int_equal(geo_conflict(a, b, c, (geo_site){0x1p-100, -1, 0x1p-200}), 0);
  const geo_site p = {1, 1, 0}, q = {-1, -1, 0};
  assert_int_equal(geo_orient(q, p, (geo_site){0x1p-180, 0x1p-180, 0}), 0);
  assert_int_equal(geo_orient(q, p, (geo_site){0x1p-180, 0x1p-181, 0}), -1);
  assert_int_equal(geo_orient(q, p, (geo_site){-0x1p-180, 0x1p-190, 0}), 1);
  // Lattice points of a circle of radius 5 * 13 * 17 * 29 * 37, each moved by at most one unit.
  const double leg[5][2] = {{3, 4}, {5, 12}, {8, 15}, {20, 21}, {12, 35}};
  for (int trial = 0; trial < 20000; trial++) {
    cloud on = make_cloud(4);
    geo_site s[4];
    for (size_t i = 0; i < 4; i++) {
      double x = 1, y = 0;
      for (int k = 0; k < 5; k++) {
        double u = leg[k][0], v = random_bits(&seed) % 2 ? leg[k][1] : -leg[k][1], turned = x * u - y * v;
        y = x * v + y * u;
        x = turned;
      }
      on.x[i] = x + (double)(random_bits(&seed) % 8 == 0);
      on.y[i] = y - (double)(random_bits(&seed) % 8 == 0);
      on.w[i] = (double)(random_bits(&seed) % 3);
      s[i] = (geo_site){on.x[i] * 0x1p-22, on.y[i] * 0x1p-22, on.w[i] * 0x1p-44};
    }
    const int32_t triangle[3] = {0, 1, 2};
    wide turn = cross_exact(&on, 0, 1, 2), conflict = conflict_exact(&on, triangle, 3);
    assert_int_equal(geo_orient(s[0], s[1], s[2]), (turn > 0) - (turn < 0));
    assert_int_equal(geo_conflict(s[0], s[1], s[2], s[3]), (conflict > 0) - (conflict < 0));
    free_cloud(&on);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(predicates),
      cmocka_unit_test(repair),
      cmocka_unit_test(registry),
      cmocka_unit_test(empty_circles),
      cmocka_unit_test(power_planes),
      cmocka_unit_test(equal_weights),
      cmocka_unit_test(square_lattices),
      cmocka_unit_test(triangular_lattices),
      cmocka_unit_test(rims),
      cmocka_unit_test(far_away),
      cmocka_unit_test(invariance),
      cmocka_unit_test(extreme_sizes),
      cmocka_unit_test(pinched),
      cmocka_unit_test(touching_disks),
      cmocka_unit_test(many),
      cmocka_unit_test(three_points),
      cmocka_unit_test(errors),
      cmocka_unit_test(cells_without_interior),
      cmocka_unit_test(what_a_backend_gets),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
