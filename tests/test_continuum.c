// The continuum against closed forms on lattices, against brute force, and its three identities on random states.
// Random states obey no equation of motion; the identities need nothing but rx, ry being the sum of the slots.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "continuum.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static const double no_value = (double)NAN;

// ---- A world: grains, slots, graph and what looks at them

typedef struct world {
  tal_grains grains;
  tal_contacts pairs, walls;
  tal_graph graph;
  tal_observed seen;
  size_t columns, rows; // of a lattice
  uint64_t random;
} world;

static void world_init(world *w, size_t n) {
  *w = (world){.random = 88172645463325252u};
  tal_grains_init(&w->grains, n);
  tal_contacts_init(&w->pairs);
  tal_contacts_init(&w->walls);
  tal_graph_init(&w->graph);
  w->seen = (tal_observed){
      .grains = &w->grains, .pairs = &w->pairs, .walls = &w->walls, .graph = &w->graph, .thickness = 0.75, .vR = 0.5};
  for (size_t i = 0; i < n; i++) {
    w->grains.r[i] = 0.5;
    w->grains.mass[i] = w->grains.inverse_mass[i] = w->grains.inertia[i] = w->grains.inverse_inertia[i] = 1;
  }
}

static void world_clear(world *w) {
  tal_grains_clear(&w->grains);
  tal_contacts_clear(&w->pairs);
  tal_contacts_clear(&w->walls);
  tal_graph_clear(&w->graph);
}

// Uniform in [low, high): xorshift, enough for states that may be anything.
static double draw(world *w, double low, double high) {
  w->random ^= w->random << 13;
  w->random ^= w->random >> 7;
  w->random ^= w->random << 17;
  return low + (high - low) * ((double)(w->random >> 11) * 0x1p-53);
}

static size_t add_slot(tal_contacts *slots, int32_t i, int32_t j, geo_vec n, double overlap) {
  size_t c = slots->count;
  tal_contacts_reserve(slots, c + 1);
  slots->count++;
  slots->i[c] = i;
  slots->j[c] = j;
  slots->nx[c] = n.x;
  slots->ny[c] = n.y;
  slots->overlap[c] = overlap;
  slots->fe[c] = slots->fd[c] = slots->ft[c] = slots->slip[c] = 0;
  return c;
}

// A slot with the true normal and overlap of two grains.
static size_t add_pair(world *w, size_t i, size_t j) {
  const tal_grains *g = &w->grains;
  geo_vec branch = {g->x[i] - g->x[j], g->y[i] - g->y[j]};
  double length = geo_norm(branch);
  return add_slot(&w->pairs, (int32_t)i, (int32_t)j, geo_scale(1 / length, branch), g->r[i] + g->r[j] - length);
}

// The same with another overlap and an elastic force.
static void touch(world *w, size_t i, size_t j, double overlap, double fe) {
  size_t c = add_pair(w, i, j);
  w->pairs.overlap[c] = overlap;
  w->pairs.fe[c] = fe;
}

static void press(world *w, int32_t i, geo_vec n, double overlap, double fe) {
  size_t c = add_slot(&w->walls, i, 0, n, overlap);
  w->walls.fe[c] = fe;
}

static void add_force(world *w, int32_t i, geo_vec f) {
  w->grains.rx[i] += f.x;
  w->grains.ry[i] += f.y;
}

// The resultants as the header of grains.h defines them: contacts, walls and boundary forces, gravity left out.
static void gather(world *w) {
  for (size_t i = 0; i < w->grains.count; i++) {
    w->grains.rx[i] = w->grains.bx[i];
    w->grains.ry[i] = w->grains.by[i];
  }
  for (size_t c = 0; c < w->pairs.count; c++) {
    if (w->pairs.overlap[c] <= 0)
      continue;
    geo_vec f = tal_contact_force(&w->pairs, c);
    add_force(w, w->pairs.i[c], f);
    add_force(w, w->pairs.j[c], geo_scale(-1, f));
  }
  for (size_t c = 0; c < w->walls.count; c++)
    if (w->walls.overlap[c] > 0)
      add_force(w, w->walls.i[c], tal_contact_force(&w->walls, c));
}

static void move_affinely(world *w, geo_tensor L, geo_vec drift) {
  for (size_t i = 0; i < w->grains.count; i++) {
    w->grains.vx[i] = L.xx * w->grains.x[i] + L.xy * w->grains.y[i] + drift.x;
    w->grains.vy[i] = L.yx * w->grains.x[i] + L.yy * w->grains.y[i] + drift.y;
  }
}

// ---- Lattices. Node (column, row) at column e1 + row e2; every parallelogram cut along e1 - e2.

static size_t at(const world *w, size_t column, size_t row) {
  return row * w->columns + column;
}

static bool block_keeps(const world *w, size_t margin, size_t column, size_t row) {
  return column >= margin && row >= margin && column + 1 + margin < w->columns && row + 1 + margin < w->rows;
}

// The loop runs round the block that is `margin` nodes inside the lattice; grains out there lie outside the loop.
static size_t block_loop(const world *w, size_t margin, int32_t *node) {
  size_t left = margin, right = w->columns - 1 - margin, bottom = margin, top = w->rows - 1 - margin, count = 0;
  for (size_t c = left; c < right; c++)
    node[count++] = (int32_t)at(w, c, bottom);
  for (size_t r = bottom; r < top; r++)
    node[count++] = (int32_t)at(w, right, r);
  for (size_t c = right; c > left; c--)
    node[count++] = (int32_t)at(w, c, top);
  for (size_t r = top; r > bottom; r--)
    node[count++] = (int32_t)at(w, left, r);
  return count;
}

static void mesh_lattice(world *w, size_t margin) {
  size_t n = w->grains.count, count = 0;
  int32_t(*corner)[3] = tal_alloc(2 * n, sizeof *corner), *node = tal_alloc(n, sizeof *node);
  unsigned char *inside = tal_alloc(2 * n, 1);
  // Last triangles first, largest corner first: restoring must not depend on the order.
  for (size_t k = (w->columns - 1) * (w->rows - 1); k-- > 0;) {
    size_t column = k % (w->columns - 1), row = k / (w->columns - 1);
    int32_t a = (int32_t)at(w, column, row), b = a + 1, c = a + (int32_t)w->columns, d = c + 1;
    memcpy(corner[count], (int32_t[3]){d, c, b}, sizeof *corner);
    inside[count++] = block_keeps(w, margin, column, row);
    memcpy(corner[count], (int32_t[3]){c, a, b}, sizeof *corner);
    inside[count++] = block_keeps(w, margin, column, row);
  }
  size_t nodes = block_loop(w, margin, node);
  tal_graph_restore(&w->graph, n, (const int32_t(*)[3])corner, count, node, nodes, inside, w->grains.x, w->grains.y);
  free(corner);
  free(node);
  free(inside);
}

static void lattice_init(world *w, size_t columns, size_t rows, geo_vec e1, geo_vec e2) {
  world_init(w, columns * rows);
  w->columns = columns;
  w->rows = rows;
  for (size_t row = 0; row < rows; row++)
    for (size_t column = 0; column < columns; column++) {
      w->grains.x[at(w, column, row)] = (double)column * e1.x + (double)row * e2.x;
      w->grains.y[at(w, column, row)] = (double)column * e1.y + (double)row * e2.y;
    }
  mesh_lattice(w, 0);
}

static void square_init(world *w, size_t columns, size_t rows) {
  lattice_init(w, columns, rows, (geo_vec){1, 0}, (geo_vec){0, 1});
}

static void triangular_init(world *w, size_t columns, size_t rows) {
  lattice_init(w, columns, rows, (geo_vec){1, 0}, (geo_vec){0.5, sqrt(3) / 2});
}

// Three unit squares in an L; grain 8 lies outside.
static void ell_init(world *w) {
  const int32_t corner[][3] = {{0, 1, 3}, {1, 4, 3}, {1, 2, 4}, {2, 5, 4}, {3, 4, 6}, {4, 7, 6}, {4, 5, 7}, {5, 8, 7}};
  const unsigned char inside[] = {1, 1, 1, 1, 1, 1, 0, 0};
  const int32_t node[] = {0, 1, 2, 5, 4, 7, 6, 3};
  square_init(w, 3, 3);
  tal_graph_restore(&w->graph, 9, corner, 8, node, 8, inside, w->grains.x, w->grains.y);
}

typedef struct bond {
  double fn, ft;
} bond;

// A touching slot with the given force on every bond along e1 (0), e2 (1) and, if wanted, e1 - e2 (2).
static void bind_lattice(world *w, const bond *along, int directions) {
  for (size_t row = 0; row < w->rows; row++)
    for (size_t column = 0; column < w->columns; column++) {
      size_t a = at(w, column, row), ends[3][2] = {{a, a + 1}, {a, a + w->columns}, {a + 1, a + w->columns}};
      bool there[3] = {column + 1 < w->columns, row + 1 < w->rows, column + 1 < w->columns && row + 1 < w->rows};
      for (int d = 0; d < directions; d++) {
        if (!there[d])
          continue;
        size_t c = add_pair(w, ends[d][0], ends[d][1]);
        w->pairs.overlap[c] = 1e-3;
        w->pairs.fe[c] = 0.75 * along[d].fn;
        w->pairs.fd[c] = 0.25 * along[d].fn;
        w->pairs.ft[c] = along[d].ft;
      }
    }
}

// ---- Comparing

static double largest(geo_tensor a) {
  return fmax(fmax(fabs(a.xx), fabs(a.xy)), fmax(fabs(a.yx), fabs(a.yy)));
}

static geo_tensor minus(geo_tensor a, geo_tensor b) {
  return geo_tensor_add(a, geo_tensor_scale(-1, b));
}

static void assert_tensor(geo_tensor got, geo_tensor want, double tolerance) {
  double error = largest(minus(got, want));
  if (!(error <= tolerance))
    fail_msg("(%.17g %.17g %.17g %.17g) is not (%.17g %.17g %.17g %.17g): off by %g, allowed %g", got.xx, got.xy,
             got.yx, got.yy, want.xx, want.xy, want.yx, want.yy, error, tolerance);
}

static void assert_near(double got, double want, double tolerance) {
  if (!(fabs(got - want) <= tolerance))
    fail_msg("%.17g is not %.17g: off by %g", got, want, fabs(got - want));
}

static geo_tensor cell_L(const tal_cells *cells, size_t c) {
  return (geo_tensor){cells->Lxx[c], cells->Lxy[c], cells->Lyx[c], cells->Lyy[c]};
}

static geo_tensor cell_stress(const tal_cells *cells, size_t c) {
  return (geo_tensor){cells->stress_xx[c], cells->stress_xy[c], cells->stress_yx[c], cells->stress_yy[c]};
}

// ---- Kinematics

// ROUND: in a linear velocity field every cell and the loop have exactly its gradient, wherever the lattice drifts to.
static void affine_velocity_is_exact(void **state) {
  (void)state;
  const geo_tensor L = {0.3, -1.7, 0.4, 0.9};
  for (int kind = 0; kind < 2; kind++) {
    world w;
    kind ? triangular_init(&w, 7, 5) : square_init(&w, 7, 5);
    move_affinely(&w, L, (geo_vec){3, -2});
    tal_cells cells;
    tal_macro macro;
    tal_cells_init(&cells);
    tal_cells_measure(&w.seen, &cells);
    tal_macro_measure(&w.seen, &macro);
    assert_int_equal(cells.count, 2 * 6 * 4);
    for (size_t c = 0; c < cells.count; c++) {
      assert_tensor(cell_L(&cells, c), L, 100 * DBL_EPSILON);
      assert_near(cells.area[c], kind ? sqrt(3) / 4 : 0.5, 20 * DBL_EPSILON);
    }
    assert_tensor(macro.velocity_gradient, L, 100 * DBL_EPSILON);
    assert_near(macro.area, kind ? 24 * sqrt(3) / 2 : 24, 1e-13);
    assert_near(macro.width, kind ? 6 + 4 * 0.5 : 6, 0);
    assert_near(macro.height, kind ? 4 * (sqrt(3) / 2) : 4, 0);
    tal_cells_clear(&cells);
    world_clear(&w);
  }
}

// ROUND: L_II is g/2 in simple shear g, |a - b|/2 in pure stretching, 0 in rotation and in dilation.
static void invariant_of_the_deviator(void **state) {
  (void)state;
  const struct {
    geo_tensor L;
    double L_II;
  } cases[] = {{{0, 0.5, 0, 0}, 0.25},  {{0, 0, -0.5, 0}, 0.25},      {{0.25, 0, 0, 0.25}, 0}, {{0, 1, -1, 0}, 0},
               {{1, 0, 0, -0.5}, 0.75}, {{3, 1, 3, -3}, sqrt(9 + 4)}, {{-2, 0, 0, -2}, 0}};
  world w;
  square_init(&w, 3, 3);
  tal_cells cells;
  tal_cells_init(&cells);
  for (size_t k = 0; k < COUNT(cases); k++) {
    move_affinely(&w, cases[k].L, (geo_vec){0, 0});
    tal_cells_measure(&w.seen, &cells);
    for (size_t c = 0; c < cells.count; c++)
      assert_near(cells.L_II[c], cases[k].L_II, 20 * DBL_EPSILON);
  }
  tal_cells_clear(&cells);
  world_clear(&w);
}

// ROUND: after x = (1 + H) X every cell's strain is sym H about the reference, also for a rotation (cos - 1, not 0).
static void strain_refers_to_the_reference(void **state) {
  (void)state;
  const geo_tensor displacement[] = {
      {0.25, 0.5, -0.125, -0.375}, {cos(0.3) - 1, -sin(0.3), sin(0.3), cos(0.3) - 1}, {0, 0, 0, 0}};
  for (size_t k = 0; k < COUNT(displacement); k++) {
    geo_tensor H = displacement[k];
    world w;
    triangular_init(&w, 4, 4);
    for (size_t i = 0; i < w.grains.count; i++) {
      double x = w.grains.x[i], y = w.grains.y[i];
      w.grains.x[i] += H.xx * x + H.xy * y + 5;
      w.grains.y[i] += H.yx * x + H.yy * y - 5;
    }
    tal_cells cells;
    tal_cells_init(&cells);
    tal_cells_measure(&w.seen, &cells);
    for (size_t c = 0; c < cells.count; c++) {
      assert_near(cells.strain_xx[c], H.xx, 1e-14);
      assert_near(cells.strain_xy[c], (H.xy + H.yx) / 2, 1e-14);
      assert_near(cells.strain_yy[c], H.yy, 1e-14);
    }
    tal_cells_clear(&cells);
    world_clear(&w);
  }
}

// EXACT: a triangle on one line has area 0, NAN where one divides by it, and a gradient of NAN, not infinity.
static void cell_without_area(void **state) {
  (void)state;
  const geo_vec line[3] = {{0, 0}, {1, 1}, {2, 2}}, values[3] = {{0, 0}, {1, 0}, {0, 5}};
  double area = 1;
  geo_tensor L = tal_cell_gradient(line, values, &area);
  assert_true(area == 0 && isnan(L.xx) && isnan(L.xy) && isnan(L.yx) && isnan(L.yy));
}

// ---- Stress

// Number of edges of cell c at the rim.
static int rim_edges(const world *w, const tal_cells *cells, size_t c) {
  int rim = 0;
  for (int k = 0; k < 3; k++) {
    int32_t a = cells->corner[c][k], b = cells->corner[c][(k + 1) % 3], shared[2];
    rim += tal_graph_edge_cells(&w->graph, a < b ? a : b, a < b ? b : a, shared) == 1;
  }
  return rim;
}

// ROUND: equal normal forces f on a triangular lattice of spacing a: sqrt(3) f/(a h) times the unit tensor in every
// cell that has no edge at the rim; the whole block from its number of bonds in each direction.
static void triangular_lattice_under_pressure(void **state) {
  (void)state;
  const double f = 2.5;
  const bond along[3] = {{f, 0}, {f, 0}, {f, 0}};
  world w;
  triangular_init(&w, 8, 6);
  bind_lattice(&w, along, 3);
  tal_cells cells;
  tal_macro macro;
  tal_cells_init(&cells);
  tal_cells_measure(&w.seen, &cells);
  tal_macro_measure(&w.seen, &macro);
  double p = sqrt(3) * f / w.seen.thickness, volume = 7 * 5 * sqrt(3) / 2 * w.seen.thickness;
  int deep = 0;
  for (size_t c = 0; c < cells.count; c++) {
    if (rim_edges(&w, &cells, c))
      continue;
    deep++;
    assert_tensor(cell_stress(&cells, c), (geo_tensor){p, 0, 0, p}, 1e-14 * p);
    assert_near(cells.pressure[c], p, 1e-14 * p);
  }
  assert_int_equal(deep, 2 * 7 * 5 - (2 * (7 + 5) - 2)); // two corner cells have two rim edges each
  double flat = 7 * 6, slant = 8 * 5, back = 7 * 5, s = sqrt(3) / 4;
  geo_tensor whole = {flat + (slant + back) / 4, s * (slant - back), s * (slant - back), 0.75 * (slant + back)};
  assert_tensor(macro.stress, geo_tensor_scale(f / volume, whole), 1e-14 * p);
  geo_tensor fabric = geo_tensor_scale(1 / (flat + slant + back), whole);
  assert_tensor(macro.fabric, fabric, 1e-14);
  assert_near(geo_trace(macro.fabric), 1, 1e-14);
  assert_int_equal(macro.contacts, 42 + 40 + 35);
  assert_int_equal(macro.contacts_off_graph, 0);
  assert_near(macro.coordination, 2.0 * 117 / 48, 1e-15);
  assert_near(macro.mean_force, f, 1e-14);
  tal_cells_clear(&cells);
  world_clear(&w);
}

// ROUND: a square lattice with different forces along x and y, and friction on one family of bonds only. The force a
// plane with normal x transmits along y appears as stress_yx (force first), so raw stress is not symmetric here.
static void square_lattice_with_friction(void **state) {
  (void)state;
  const bond along[2] = {{3, 0.5}, {7, 0}};
  world w;
  square_init(&w, 6, 6);
  bind_lattice(&w, along, 2);
  tal_cells cells;
  tal_cells_init(&cells);
  tal_cells_measure(&w.seen, &cells);
  const geo_tensor want = geo_tensor_scale(1 / w.seen.thickness, (geo_tensor){3, 0, 0.5, 7});
  for (size_t c = 0; c < cells.count; c++)
    if (!rim_edges(&w, &cells, c))
      assert_tensor(cell_stress(&cells, c), want, 1e-14);
  tal_macro macro;
  tal_macro_measure(&w.seen, &macro);
  assert_tensor(macro.stress, geo_tensor_scale(6.0 / 5, want), 1e-14);
  assert_tensor(macro.fabric, (geo_tensor){0.5, 0, 0, 0.5}, 1e-15);
  tal_cells_clear(&cells);
  world_clear(&w);
}

// ROUND: a uniformly pressed block in equilibrium: boundary forces alone give the stress, inertia none; and the
// contacts absorb -f times the sum over bonds of the branch's stretching.
static void block_in_equilibrium(void **state) {
  (void)state;
  const double f = 2, squeeze = -0.01;
  const bond along[3] = {{f, 0}, {f, 0}, {f, 0}};
  world w;
  triangular_init(&w, 9, 7);
  bind_lattice(&w, along, 3);
  gather(&w);
  for (size_t i = 0; i < w.grains.count; i++) {
    w.grains.bx[i] = -w.grains.rx[i];
    w.grains.by[i] = -w.grains.ry[i];
  }
  gather(&w);
  move_affinely(&w, (geo_tensor){squeeze, 0, 0, squeeze}, (geo_vec){0, 0});
  tal_macro macro;
  tal_macro_measure(&w.seen, &macro);
  assert_tensor(macro.stress_boundary, macro.stress, 1e-14 * largest(macro.stress));
  assert_tensor(macro.stress_inertia, (geo_tensor){0, 0, 0, 0}, 1e-14 * largest(macro.stress));
  double power = -f * squeeze * (8 * 7 + 9 * 6 + 8 * 6);
  assert_near(macro.power_contacts, power, 1e-13 * power);
  assert_near(macro.power_boundary, power, 1e-13 * power);
  assert_near(macro.unbalanced, 0, 1e-15);
  world_clear(&w);
}

// ROUND: one force that nothing balances: boundary stress is about the centroid of the loop's area, here of an L.
static void boundary_stress_is_about_the_centroid(void **state) {
  (void)state;
  world w;
  tal_macro macro;
  ell_init(&w);
  w.grains.bx[2] = 3;
  w.grains.by[2] = 5;
  gather(&w);
  tal_macro_measure(&w.seen, &macro);
  geo_vec arm = {2 - 2.5 / 3, 0 - 2.5 / 3};
  geo_tensor want = geo_tensor_scale(-1 / (3 * w.seen.thickness), geo_outer((geo_vec){3, 5}, arm));
  assert_tensor(macro.stress_boundary, want, 1e-15);
  assert_tensor(macro.stress_inertia, geo_tensor_scale(-1, want), 1e-15);
  world_clear(&w);
}

// ROUND: a disc between two forces f along x: 2 f lever/(pi r^2 h) along xx; the lever is r - overlap/2 against a
// grain, r - overlap against a wall.
static void disc_under_two_forces(void **state) {
  (void)state;
  const double f = 3, r = 0.5, overlap = 0.125;
  for (int kind = 0; kind < 2; kind++) {
    world w;
    world_init(&w, 3);
    for (size_t i = 0; i < 3; i++)
      w.grains.x[i] = (double)i * (1 - overlap);
    if (kind == 0) {
      for (size_t i = 0; i < 2; i++)
        touch(&w, i, i + 1, overlap, f);
    } else {
      press(&w, 1, (geo_vec){1, 0}, overlap, f);
      press(&w, 1, (geo_vec){-1, 0}, overlap, f);
      press(&w, 1, (geo_vec){0, 1}, -overlap, 1000); // does not touch
    }
    geo_tensor stress[3];
    tal_grain_stress(&w.seen, stress);
    double lever = kind ? r - overlap : r - overlap / 2, area = TAL_PI * r * r;
    geo_tensor want = {2 * lever * f / (area * w.seen.thickness), 0, 0, 0};
    assert_tensor(stress[1], want, 1e-14 * want.xx);
    assert_tensor(stress[0], geo_tensor_scale(kind ? 0 : 0.5, want), 1e-14 * want.xx);
    world_clear(&w);
  }
}

// ---- Identities on arbitrary states

static geo_vec direction(world *w) {
  double angle = draw(w, 0, 2 * TAL_PI);
  return (geo_vec){cos(angle), sin(angle)};
}

static void random_force(world *w, tal_contacts *slots, size_t c) {
  slots->overlap[c] = draw(w, -0.5, 1);
  slots->fe[c] = draw(w, 0, 10);
  slots->fd[c] = draw(w, -1, 1);
  slots->ft[c] = draw(w, -4, 4);
  slots->slip[c] = draw(w, -1, 1);
}

// Anything goes: forces on edges of the graph and on pairs far from it, touching or not, pressure, walls, held grains.
static void fill_at_random(world *w, const geo_edge *edges, size_t edge_count) {
  size_t n = w->grains.count;
  for (size_t i = 0; i < n; i++) {
    w->grains.vx[i] = draw(w, -1, 1);
    w->grains.vy[i] = draw(w, -1, 1);
    w->grains.omega[i] = draw(w, -1, 1);
    w->grains.mass[i] = draw(w, 0.1, 2);
    w->grains.inverse_mass[i] = draw(w, 0, 1) < 0.2 ? 0 : 1 / w->grains.mass[i];
    w->grains.bx[i] = draw(w, 0, 1) < 0.3 ? draw(w, -5, 5) : 0;
    w->grains.by[i] = draw(w, 0, 1) < 0.3 ? draw(w, -5, 5) : 0;
    if (draw(w, 0, 1) < 0.2)
      random_force(w, &w->walls, add_slot(&w->walls, (int32_t)i, 0, direction(w), 0));
  }
  for (size_t e = 0; e < edge_count; e++)
    random_force(w, &w->pairs, add_pair(w, (size_t)edges[e].i, (size_t)edges[e].j));
  for (size_t k = 0; k < n / 4; k++) {
    size_t i = (size_t)draw(w, 0, (double)n - 1), j = (size_t)draw(w, (double)i + 1, (double)n);
    random_force(w, &w->pairs, add_pair(w, i, j));
  }
  w->seen.gravity[0] = 0.5;
  w->seen.gravity[1] = -9.81;
  gather(w);
}

static void fill_from_mesh(world *w) {
  geo_edge *edges = tal_alloc(3 * w->graph.mesh.triangle_count, sizeof *edges);
  fill_at_random(w, edges, geo_mesh_edges(&w->graph.mesh, edges));
  free(edges);
}

static void assert_cells_sum_to_the_loop(const world *w, const tal_macro *macro) {
  tal_cells cells;
  geo_tensor sum = {0, 0, 0, 0};
  double area = 0;
  tal_cells_init(&cells);
  tal_cells_measure(&w->seen, &cells);
  for (size_t c = 0; c < cells.count; c++) {
    area += cells.area[c];
    sum = geo_tensor_add(sum, geo_tensor_scale(cells.area[c], cell_L(&cells, c)));
  }
  assert_near(area, macro->area, 1e-12 * area);
  assert_tensor(geo_tensor_scale(1 / area, sum), macro->velocity_gradient, 1e-12 * largest(macro->velocity_gradient));
  tal_cells_clear(&cells);
}

// The three identities, and that each side is worth comparing (not nearly zero by accident).
static void assert_identities(const world *w, tal_macro *macro) {
  tal_macro_measure(&w->seen, macro);
  assert_cells_sum_to_the_loop(w, macro);
  geo_tensor outside = geo_tensor_add(macro->stress_boundary, macro->stress_inertia);
  double scale = largest(macro->stress);
  assert_true(scale > 0.1 && largest(macro->stress_inertia) > 0.1 && largest(macro->stress_boundary) > 0.1);
  assert_tensor(outside, macro->stress, 1e-12 * scale);
  assert_true(fabs(macro->power_contacts) > 1);
  assert_near(macro->power_boundary, macro->power_contacts, 1e-12 * fabs(macro->power_contacts));
}

static void jitter(world *w, double amount) {
  for (size_t i = 0; i < w->grains.count; i++) {
    w->grains.x[i] = ldexp(rint(ldexp(w->grains.x[i] + draw(w, -amount, amount), 20)), -20);
    w->grains.y[i] = ldexp(rint(ldexp(w->grains.y[i] + draw(w, -amount, amount), 20)), -20);
  }
}

// ROUND: identities on moved lattices with random forces, with and without grains outside the loop.
static void identities_on_random_states(void **state) {
  (void)state;
  for (uint64_t trial = 0; trial < 20; trial++) {
    world w;
    tal_macro macro;
    triangular_init(&w, 18, 15);
    w.random += trial * 0x9E3779B97F4A7C15u;
    mesh_lattice(&w, trial % 3);
    jitter(&w, 0.2);
    fill_from_mesh(&w);
    assert_identities(&w, &macro);
    assert_true(macro.contacts_off_graph > 20);
    world_clear(&w);
  }
}

// ROUND: identities hold far from the origin and in a moving frame. All coordinates are multiples of 2^-20, so moving
// them is exact: what depends on differences only must keep its bits.
static void identities_far_from_the_origin(void **state) {
  (void)state;
  world w;
  tal_macro here, there;
  triangular_init(&w, 18, 15);
  mesh_lattice(&w, 1);
  jitter(&w, 0.2);
  fill_from_mesh(&w);
  assert_identities(&w, &here);
  for (size_t i = 0; i < w.grains.count; i++) {
    w.grains.x[i] += 0x1p30;
    w.grains.y[i] -= 0x1p29;
    w.grains.vx[i] += 1000;
  }
  assert_identities(&w, &there);
  assert_true(memcmp(&here.stress, &there.stress, sizeof here.stress) == 0);
  assert_true(here.area == there.area && here.solid_fraction == there.solid_fraction);
  assert_near(there.power_contacts, here.power_contacts, 1e-10 * fabs(here.power_contacts));
  world_clear(&w);
}

// ROUND: stress of the assembly = sum over grains of pi r^2 h times the grain's stress, when no wall touches and slots
// carry the true geometry.
static void grain_stresses_sum_to_the_assembly(void **state) {
  (void)state;
  world w;
  triangular_init(&w, 10, 8);
  for (size_t i = 0; i < w.grains.count; i++)
    w.grains.r[i] = draw(&w, 0.55, 0.7);
  jitter(&w, 0.03);
  const bond along[3] = {{2, 0.5}, {1, -0.75}, {4, 0.25}};
  bind_lattice(&w, along, 3);
  for (size_t c = 0; c < w.pairs.count; c++) {
    int32_t i = w.pairs.i[c], j = w.pairs.j[c];
    w.pairs.overlap[c] =
        w.grains.r[i] + w.grains.r[j] - hypot(w.grains.x[i] - w.grains.x[j], w.grains.y[i] - w.grains.y[j]);
    assert_true(w.pairs.overlap[c] > 0);
  }
  geo_tensor *stress = tal_alloc(w.grains.count, sizeof *stress), sum = {0, 0, 0, 0};
  tal_macro macro;
  tal_grain_stress(&w.seen, stress);
  tal_macro_measure(&w.seen, &macro);
  for (size_t i = 0; i < w.grains.count; i++)
    sum = geo_tensor_add(sum, geo_tensor_scale(TAL_PI * w.grains.r[i] * w.grains.r[i], stress[i]));
  assert_tensor(geo_tensor_scale(1 / macro.area, sum), macro.stress, 1e-13 * largest(macro.stress));
  free(stress);
  world_clear(&w);
}

// ---- Counting

// EXACT: rattlers known by construction. A ring of three (0 1 2) bears; 3-4-5 is a chain that hangs from it and falls
// grain by grain; 6 is alone; 7 rests on two walls and bears without a pair; 8 rests on one wall and on 2; 9 touches
// one wall only.
static void coordination_without_rattlers(void **state) {
  (void)state;
  const size_t touching[][2] = {{0, 1}, {0, 2}, {1, 2}, {0, 3}, {3, 4}, {4, 5}, {2, 8}};
  const int32_t on_wall[] = {7, 7, 8, 9};
  world w;
  world_init(&w, 10);
  for (size_t i = 0; i < 10; i++)
    w.grains.x[i] = (double)i;
  for (size_t k = 0; k < COUNT(touching); k++)
    touch(&w, touching[k][0], touching[k][1], 0.1, 1);
  touch(&w, 5, 6, 0, 0); // not in contact
  for (size_t k = 0; k < COUNT(on_wall); k++)
    press(&w, on_wall[k], (geo_vec){0, 1}, 0.1, 1);
  tal_macro macro;
  tal_macro_measure(&w.seen, &macro);
  assert_int_equal(macro.contacts, 7);
  assert_true(macro.coordination == 1.4);
  assert_true(macro.coordination_bearing == 2.0 * 4 / 5); // 0 1 2 7 8 with 01 02 12 28
  world_clear(&w);
}

// Removes rattlers by sweeping over everything until nothing changes.
static double bearing_by_brute_force(const world *w) {
  size_t n = w->grains.count, left = n, contacts = 0;
  int *count = tal_alloc(n, sizeof *count);
  bool *gone = tal_alloc(n, sizeof *gone);
  for (bool changed = true; changed;) {
    changed = false;
    contacts = 0;
    memset(count, 0, n * sizeof *count);
    for (size_t c = 0; c < w->walls.count; c++)
      count[w->walls.i[c]] += w->walls.overlap[c] > 0;
    for (size_t c = 0; c < w->pairs.count; c++) {
      if (w->pairs.overlap[c] <= 0 || gone[w->pairs.i[c]] || gone[w->pairs.j[c]])
        continue;
      contacts++;
      count[w->pairs.i[c]]++;
      count[w->pairs.j[c]]++;
    }
    for (size_t i = 0; i < n; i++)
      if (!gone[i] && count[i] < 2)
        gone[i] = changed = true;
  }
  for (size_t i = 0; i < n; i++)
    left -= gone[i];
  free(count);
  free(gone);
  return left ? 2 * (double)contacts / (double)left : no_value;
}

// EXACT: against brute force on sparse random contact networks, where most of the network falls away in chains.
static void coordination_against_brute_force(void **state) {
  (void)state;
  for (uint64_t trial = 0; trial < 50; trial++) {
    world w;
    square_init(&w, 12, 12);
    w.random += trial * 0x9E3779B97F4A7C15u;
    for (size_t row = 0; row + 1 < 12; row++)
      for (size_t column = 0; column + 1 < 12; column++) {
        size_t a = at(&w, column, row);
        if (draw(&w, 0, 1) < 0.65)
          touch(&w, a, a + 1, draw(&w, -0.1, 1), 1);
        if (draw(&w, 0, 1) < 0.65)
          touch(&w, a, a + 12, draw(&w, -0.1, 1), 1);
      }
    for (int32_t i = 0; i < 144; i += 11)
      press(&w, i, (geo_vec){0, 1}, draw(&w, -1, 1), 1);
    tal_macro macro;
    tal_macro_measure(&w.seen, &macro);
    double want = bearing_by_brute_force(&w);
    assert_true(macro.coordination_bearing == want || (isnan(want) && isnan(macro.coordination_bearing)));
    world_clear(&w);
  }
}

// ROUND: a lattice block of equal discs has the solid fraction of the infinite lattice, pi r^2 over the area of its
// cell: corner, edge and inner grains add up; grains outside the loop do not count.
static void solid_fraction_of_lattices(void **state) {
  (void)state;
  for (size_t margin = 0; margin < 3; margin++) {
    world w;
    tal_macro macro;
    square_init(&w, 9, 7);
    mesh_lattice(&w, margin);
    tal_macro_measure(&w.seen, &macro);
    assert_near(macro.solid_fraction, TAL_PI / 4, 1e-14);
    world_clear(&w);
    triangular_init(&w, 9, 7);
    mesh_lattice(&w, margin);
    tal_macro_measure(&w.seen, &macro);
    assert_near(macro.solid_fraction, TAL_PI / sqrt(12), 1e-14);
    world_clear(&w);
  }
}

// ROUND: an L of three squares: one corner of the loop is reentrant (270 degrees).
static void solid_fraction_at_a_reentrant_corner(void **state) {
  (void)state;
  world w;
  tal_macro macro;
  ell_init(&w);
  assert_int_equal(w.graph.loop.outside_count, 1);
  tal_macro_measure(&w.seen, &macro);
  assert_near(macro.area, 3, 1e-15);
  assert_near(macro.solid_fraction, TAL_PI / 4, 1e-14);
  world_clear(&w);
}

// ROUND: slip, mean force, kinetic energy and unbalanced force of two free grains, one held grain and one slot without
// contact, worked out by hand.
static void means_by_hand(void **state) {
  (void)state;
  world w;
  world_init(&w, 3);
  for (size_t i = 0; i < 3; i++)
    w.grains.x[i] = (double)i;
  w.grains.inverse_mass[2] = 0;
  const double overlap[] = {0.1, 0.1, -0.1}, fe[] = {3, 5, 100}, fd[] = {0, 1, 100}, ft[] = {4, -8, 100};
  const double slip[] = {-0.25, 1, 100};
  for (size_t c = 0; c < 3; c++) {
    add_pair(&w, c / 2, c == 0 ? 1 : 2);
    w.pairs.i[c] = c == 1;
    w.pairs.overlap[c] = overlap[c];
    w.pairs.fe[c] = fe[c];
    w.pairs.fd[c] = fd[c];
    w.pairs.ft[c] = ft[c];
    w.pairs.slip[c] = slip[c];
  }
  const double rx[] = {3, 0, 50}, ry[] = {4, 2, 50}, vx[] = {1, 0, 0}, omega[] = {0, 3, 0};
  for (size_t i = 0; i < 3; i++) {
    w.grains.rx[i] = rx[i];
    w.grains.ry[i] = ry[i];
    w.grains.vx[i] = vx[i];
    w.grains.omega[i] = omega[i];
    w.grains.mass[i] = 4;
    w.grains.inertia[i] = 2;
  }
  w.seen.gravity[1] = -0.5;
  tal_macro macro;
  tal_macro_measure(&w.seen, &macro);
  assert_near(macro.mean_force, (3 + 6) / 2.0, 1e-15);
  assert_near(macro.mean_slip, (0.25 + 1) / 2 / 0.5, 1e-15);
  assert_near(macro.kinetic, 4 * 1 / 2.0 + 2 * 9 / 2.0, 1e-15);
  assert_near(macro.unbalanced, (hypot(3, 4 - 2) + 0) / 2 / ((5 + 10) / 2.0), 1e-15);
  w.seen.vR = no_value;
  tal_macro_measure(&w.seen, &macro);
  assert_true(isnan(macro.mean_slip));
  world_clear(&w);
}

// ---- The graph

// EXACT: every edge lookup against a search through all cells, over all pairs of grains, with cells outside the loop.
static void edges_against_brute_force(void **state) {
  (void)state;
  world w;
  triangular_init(&w, 9, 8);
  mesh_lattice(&w, 1);
  for (int32_t i = 0; i < 72; i++)
    for (int32_t j = i + 1; j < 72; j++) {
      int32_t cell[2] = {-1, -1}, want[2] = {-1, -1};
      size_t found = 0;
      for (size_t c = 0; c < w.graph.cell_count; c++) {
        const int32_t *k = w.graph.mesh.corner[w.graph.cell[c]];
        int hits = (k[0] == i || k[1] == i || k[2] == i) + (k[0] == j || k[1] == j || k[2] == j);
        if (hits == 2)
          want[found++] = (int32_t)c;
      }
      assert_int_equal(tal_graph_edge_cells(&w.graph, i, j, cell), found);
      if (found)
        assert_memory_equal(cell, want, sizeof cell);
    }
  world_clear(&w);
}

// EXACT: a hub with 200 neighbours: all its edges are found, and none that is not there.
static void edges_of_a_hub(void **state) {
  (void)state;
  enum { RIM = 200 };
  int32_t corner[RIM][3], node[RIM], cell[2];
  unsigned char inside[RIM];
  world w;
  world_init(&w, 2 * RIM + 1);
  for (int32_t k = 0; k < RIM; k++) { // even indices are on the rim
    w.grains.x[2 * k + 2] = cos(2 * TAL_PI * k / RIM);
    w.grains.y[2 * k + 2] = sin(2 * TAL_PI * k / RIM);
    node[k] = 2 * k + 2;
    memcpy(corner[k], (int32_t[3]){0, 2 * k + 2, 2 * ((k + 1) % RIM) + 2}, sizeof *corner);
    inside[k] = 1;
  }
  tal_graph_restore(&w.graph, 2 * RIM + 1, (const int32_t(*)[3])corner, RIM, node, RIM, inside, w.grains.x, w.grains.y);
  for (int32_t j = 1; j <= 2 * RIM; j++)
    assert_int_equal(tal_graph_edge_cells(&w.graph, 0, j, cell), j % 2 ? 0 : 2);
  assert_int_equal(tal_graph_edge_cells(&w.graph, 2, 4, cell), 1);
  world_clear(&w);
}

static void scatter(world *w, double size) {
  for (size_t i = 0; i < w->grains.count; i++) {
    w->grains.x[i] = draw(w, 0, size);
    w->grains.y[i] = draw(w, 0, size);
    w->grains.r[i] = draw(w, 0.3, 0.6);
  }
}

// ROUND: identities on Delaunay and power graphs of scattered grains for every backend, a few grains flung far away and
// peeled off; and a graph put back from its parts measures the same bits.
static void refreshed_graph(void **state) {
  (void)state;
  for (const geo_delaunay_backend *const *backend = geo_delaunay_backends(); *backend; backend++)
    for (int power = 0; power < 2; power++) {
      world w;
      tal_error err = {""};
      tal_macro macro, again;
      world_init(&w, 400);
      scatter(&w, 20);
      for (size_t i = 0; i < 5; i++)
        w.grains.x[80 * i] += 100 + 10 * (double)i;
      w.graph.backend = *backend;
      w.graph.power = power;
      w.graph.gap_limit = 1.5;
      assert_int_equal(tal_graph_refresh(&w.graph, &w.grains, &err), TAL_OK);
      assert_true(w.graph.valid && w.graph.loop.outside_count >= 5);
      assert_int_equal(w.graph.loop.triangle_count, w.graph.cell_count);
      jitter(&w, 1e-3);
      fill_from_mesh(&w);
      assert_identities(&w, &macro);
      assert_true(macro.width < 21 && macro.height < 21);
      tal_graph copy;
      tal_graph_init(&copy);
      const tal_graph *g = &w.graph;
      tal_graph_restore(&copy, g->grain_count, (const int32_t(*)[3])g->mesh.corner, g->mesh.triangle_count,
                        g->loop.node, g->loop.count, g->inside, g->x, g->y);
      assert_int_equal(copy.loop.triangle_count, g->loop.triangle_count);
      assert_int_equal(copy.loop.outside_count, g->loop.outside_count);
      w.seen.graph = &copy;
      tal_macro_measure(&w.seen, &again);
      assert_true(again.power_contacts == macro.power_contacts && again.power_boundary == macro.power_boundary &&
                  again.solid_fraction == macro.solid_fraction);
      tal_graph_clear(&copy);
      world_clear(&w);
    }
}

// EXACT: no assembly, no crash: a reason, an invalid graph, NAN where a loop is needed, and counts that stay right.
static void states_without_a_loop(void **state) {
  (void)state;
  const struct {
    size_t n;
    double step_y, gap_limit;
  } cases[] = {{0, 0, 9}, {1, 0, 9}, {2, 1, 9}, {3, 0, 9}, {7, 0.5, 9}, {3, 0.5, -10}};
  for (size_t k = 0; k < COUNT(cases); k++) {
    world w;
    tal_error err = {""};
    tal_macro macro;
    tal_cells cells;
    world_init(&w, cases[k].n);
    for (size_t i = 0; i < cases[k].n; i++) {
      w.grains.x[i] = (double)i;
      w.grains.y[i] = k == 5 ? (double)(i * i) : cases[k].step_y * (double)i;
    }
    if (cases[k].n > 1)
      touch(&w, 0, 1, 0.1, 1);
    w.graph.gap_limit = cases[k].gap_limit;
    assert_int_equal(tal_graph_refresh(&w.graph, &w.grains, &err), TAL_INVALID);
    assert_true(!w.graph.valid && strlen(err.text) > 10);
    tal_macro_measure(&w.seen, &macro);
    assert_true(isnan(macro.area) && isnan(macro.stress.xx) && isnan(macro.stress_boundary.yy) &&
                isnan(macro.velocity_gradient.xy) && isnan(macro.power_boundary) && isnan(macro.solid_fraction));
    assert_int_equal(macro.contacts, cases[k].n > 1);
    assert_int_equal(macro.contacts_off_graph, cases[k].n > 1);
    assert_true(cases[k].n ? macro.coordination == 2.0 * (cases[k].n > 1) / (double)cases[k].n
                           : isnan(macro.coordination));
    assert_true(isnan(macro.coordination_bearing));
    if (cases[k].n < 2)
      assert_true(isnan(macro.mean_force) && isnan(macro.fabric.xx) && isnan(macro.unbalanced));
    tal_cells_init(&cells);
    tal_cells_measure(&w.seen, &cells);
    assert_int_equal(cells.count, 0);
    tal_cells_clear(&cells);
    tal_grain_stress(&w.seen, (geo_tensor[8]){{0}});
    world_clear(&w);
  }
}

// EXACT: a failed refresh spoils the old loop, the next good one mends it.
static void refresh_after_failure(void **state) {
  (void)state;
  world w;
  tal_macro macro;
  square_init(&w, 4, 4);
  w.grains.x[5] = no_value;
  assert_int_equal(tal_graph_refresh(&w.graph, &w.grains, NULL), TAL_INVALID);
  tal_macro_measure(&w.seen, &macro);
  assert_true(isnan(macro.area));
  w.grains.x[5] = 1;
  assert_int_equal(tal_graph_refresh(&w.graph, &w.grains, NULL), TAL_OK);
  tal_macro_measure(&w.seen, &macro);
  assert_true(macro.area == 9);
  world_clear(&w);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(affine_velocity_is_exact),
      cmocka_unit_test(invariant_of_the_deviator),
      cmocka_unit_test(strain_refers_to_the_reference),
      cmocka_unit_test(cell_without_area),
      cmocka_unit_test(triangular_lattice_under_pressure),
      cmocka_unit_test(square_lattice_with_friction),
      cmocka_unit_test(block_in_equilibrium),
      cmocka_unit_test(boundary_stress_is_about_the_centroid),
      cmocka_unit_test(disc_under_two_forces),
      cmocka_unit_test(identities_on_random_states),
      cmocka_unit_test(identities_far_from_the_origin),
      cmocka_unit_test(grain_stresses_sum_to_the_assembly),
      cmocka_unit_test(coordination_without_rattlers),
      cmocka_unit_test(coordination_against_brute_force),
      cmocka_unit_test(solid_fraction_of_lattices),
      cmocka_unit_test(solid_fraction_at_a_reentrant_corner),
      cmocka_unit_test(means_by_hand),
      cmocka_unit_test(edges_against_brute_force),
      cmocka_unit_test(edges_of_a_hub),
      cmocka_unit_test(refreshed_graph),
      cmocka_unit_test(states_without_a_loop),
      cmocka_unit_test(refresh_after_failure),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
