// See boundary_rows.h; derivation in docs/method.md, chapter 6. Fields come from Airy functions P_a(X) P_b(Y), products
// of Legendre polynomials in coordinates scaled to the loop: same span as the monomials, far better conditioned.
#include "boundary_rows.h"

#include "base.h"

#include <gsl/gsl_integration.h>
#include <gsl/gsl_linalg.h>
#include <stdlib.h>
#include <string.h>

// E of (83): the uniform stress of each component.
static const geo_tensor unit[TAL_COMPONENTS] = {{1, 0, 0, 0}, {0, 0, 0, 1}, {0, 1, 1, 0}, {0, -1, 1, 0}};

double tal_component_of(tal_component k, geo_tensor gradient) {
  return geo_contract(unit[k], gradient);
}

void tal_rows_init(tal_rows *rows) {
  *rows = (tal_rows){0};
}

static void forget(tal_rows *rows) {
  free(rows->normal);
  free(rows->shape);
  free(rows->row);
  free(rows->velocity);
  free(rows->force);
  free(rows->given);
  free(rows->other);
  free(rows->mobility);
}

void tal_rows_clear(tal_rows *rows) {
  forget(rows);
  tal_rows_init(rows);
}

static double product(const double *a, const double *b, size_t count) {
  double sum = 0;
  for (size_t k = 0; k < count; k++)
    sum += a[k] * b[k];
  return sum;
}

static void add_scaled(double *to, double scale, const double *from, size_t count) {
  for (size_t k = 0; k < count; k++)
    to[k] += scale * from[k];
}

// ---- geometry ----

static void measure_normals(tal_rows *rows, const geo_loop *loop, const double *x, const double *y) {
  rows->area = geo_loop_area(loop, x, y);
  for (size_t k = 0; k < rows->nodes; k++)
    rows->normal[k] = geo_loop_normal(loop, x, y, k);
}

static void component_rows(tal_rows *rows) {
  for (size_t c = 0; c < TAL_COMPONENTS; c++) {
    double *row = rows->row + c * 2 * rows->nodes;
    for (size_t k = 0; k < rows->nodes; k++) {
      geo_vec n = rows->normal[k];
      row[2 * k] = -rows->thickness * (unit[c].xx * n.x + unit[c].xy * n.y);
      row[2 * k + 1] = -rows->thickness * (unit[c].yx * n.x + unit[c].yy * n.y);
    }
  }
}

// Takes the mean stress and the torque out of forces on the loop: row - M N / A, M the moment tensor (84).
static void take_mean_out(const tal_rows *rows, const geo_loop *loop, const double *x, const double *y, double *row) {
  geo_tensor moment = {0};
  const double x0 = x[loop->node[0]], y0 = y[loop->node[0]];
  for (size_t k = 0; k < rows->nodes; k++) {
    geo_vec force = {row[2 * k], row[2 * k + 1]}, arm = {x[loop->node[k]] - x0, y[loop->node[k]] - y0};
    moment = geo_tensor_add(moment, geo_outer(force, arm));
  }
  moment = geo_tensor_scale(1 / rows->area, moment);
  for (size_t k = 0; k < rows->nodes; k++) {
    geo_vec n = rows->normal[k];
    row[2 * k] -= moment.xx * n.x + moment.xy * n.y;
    row[2 * k + 1] -= moment.yx * n.x + moment.yy * n.y;
  }
}

void tal_rows_move(tal_rows *rows, const geo_loop *loop, const double *x, const double *y) {
  measure_normals(rows, loop, x, y);
  component_rows(rows);
  double *higher = rows->row + TAL_COMPONENTS * 2 * rows->nodes;
  if (rows->rank)
    memcpy(higher, rows->shape, rows->rank * 2 * rows->nodes * sizeof *higher);
  for (size_t j = 0; j < rows->rank; j++)
    take_mean_out(rows, loop, x, y, higher + j * 2 * rows->nodes);
}

geo_tensor tal_rows_gradient(const tal_rows *rows, const double *velocity) {
  geo_tensor sum = {0};
  for (size_t k = 1; k < rows->nodes; k++) { // relative to the first node: fewer digits are lost
    geo_vec v = {velocity[2 * k] - velocity[0], velocity[2 * k + 1] - velocity[1]};
    sum = geo_tensor_add(sum, geo_outer(v, rows->normal[k]));
  }
  return geo_tensor_scale(1 / rows->area, sum);
}

void tal_rows_force(const tal_rows *rows, double *force) {
  for (size_t r = 0; r < TAL_COMPONENTS + rows->rank; r++)
    if (rows->multiplier[r] != 0)
      add_scaled(force, rows->multiplier[r], rows->row + r * 2 * rows->nodes, 2 * rows->nodes);
}

// ---- fields ----

// Box of a loop: centre and half extents.
typedef struct box {
  double x, y, width, height;
} box;

static box box_of(const geo_loop *loop, const double *x, const double *y) {
  double left = x[loop->node[0]], right = left, low = y[loop->node[0]], high = low;
  for (size_t k = 1; k < loop->count; k++) {
    left = fmin(left, x[loop->node[k]]);
    right = fmax(right, x[loop->node[k]]);
    low = fmin(low, y[loop->node[k]]);
    high = fmax(high, y[loop->node[k]]);
  }
  return (box){0.5 * (left + right), 0.5 * (low + high), 0.5 * (right - left), 0.5 * (high - low)};
}

// Legendre polynomials and their first two derivatives at s.
static void legendre(double s, int most, double *p, double *dp, double *ddp) {
  p[0] = 1;
  dp[0] = ddp[0] = ddp[1] = 0;
  p[1] = s;
  dp[1] = 1;
  for (int n = 1; n < most; n++) {
    p[n + 1] = ((2 * n + 1) * s * p[n] - n * p[n - 1]) / (n + 1);
    dp[n + 1] = dp[n - 1] + (2 * n + 1) * p[n];
    ddp[n + 1] = ddp[n - 1] + (2 * n + 1) * dp[n];
  }
}

// Adds what the stress of every field does on a piece of edge k: at the point `at` from the box's centre, with the
// outward normal times length n, the share s of it at the edge's end (85).
static void add_point(const tal_rows *rows, double *field, const box *b, geo_vec at, geo_vec n, size_t k, double s,
                      int order) {
  double px[TAL_ORDER_MOST + 3], dx[TAL_ORDER_MOST + 3], ddx[TAL_ORDER_MOST + 3];
  double py[TAL_ORDER_MOST + 3], dy[TAL_ORDER_MOST + 3], ddy[TAL_ORDER_MOST + 3];
  const size_t next = k + 1 == rows->nodes ? 0 : k + 1, length = 2 * rows->nodes;
  const double slender = b->width / b->height; // sizes of the same order whatever the box
  legendre(at.x / b->width, order + 2, px, dx, ddx);
  legendre(at.y / b->height, order + 2, py, dy, ddy);
  for (int degree = 3; degree <= order + 2; degree++)
    for (int i = 0; i <= degree; i++, field += length) {
      const int j = degree - i;
      double xx = px[i] * ddy[j] * slender, yy = ddx[i] * py[j] / slender, xy = -dx[i] * dy[j];
      geo_vec force = {-(xx * n.x + xy * n.y), -(xy * n.x + yy * n.y)};
      field[2 * k] += (1 - s) * force.x;
      field[2 * k + 1] += (1 - s) * force.y;
      field[2 * next] += s * force.x;
      field[2 * next + 1] += s * force.y;
    }
}

// Forces of the fields on the nodes, [fields][2B]: exact integrals, the fields are polynomials.
static double *field_forces(const tal_rows *rows, const geo_loop *loop, const double *x, const double *y, int order) {
  double *field = tal_alloc(rows->fields * 2 * rows->nodes, sizeof *field);
  const box b = box_of(loop, x, y);
  const size_t points = (size_t)(order + 3) / 2; // degree order + 1 along an edge
  gsl_integration_glfixed_table *gauss = gsl_integration_glfixed_table_alloc(points);
  for (size_t k = 0; k < rows->nodes; k++) {
    int32_t from = loop->node[k], to = loop->node[k + 1 == rows->nodes ? 0 : k + 1];
    geo_vec edge = {x[to] - x[from], y[to] - y[from]};
    for (size_t g = 0; g < points; g++) {
      double s, weight;
      gsl_integration_glfixed_point(0, 1, g, &s, &weight, gauss);
      geo_vec at = {x[from] - b.x + s * edge.x, y[from] - b.y + s * edge.y}, n = {weight * edge.y, -weight * edge.x};
      add_point(rows, field, &b, at, n, k, s, order);
    }
  }
  gsl_integration_glfixed_table_free(gauss);
  return field;
}

// Rows in the metric of the masses, as columns of a matrix with at least as many rows as columns.
static gsl_matrix *weighted(const tal_rows *rows, const double *of, size_t count, const double *root) {
  const size_t length = 2 * rows->nodes;
  gsl_matrix *matrix = gsl_matrix_calloc(length > count ? length : count, count);
  for (size_t j = 0; j < count; j++)
    for (size_t k = 0; k < length; k++)
      gsl_matrix_set(matrix, k, j, of[j * length + k] * root[k / 2]);
  return matrix;
}

static double column_product(const gsl_matrix *a, size_t i, const gsl_matrix *b, size_t j) {
  double sum = 0;
  for (size_t k = 0; k < a->size1 && k < b->size1; k++)
    sum += gsl_matrix_get(a, k, i) * gsl_matrix_get(b, k, j);
  return sum;
}

static void subtract_column(gsl_matrix *a, size_t i, double share, const gsl_matrix *b, size_t j) {
  for (size_t k = 0; k < a->size1 && k < b->size1; k++)
    gsl_matrix_set(a, k, i, gsl_matrix_get(a, k, i) - share * gsl_matrix_get(b, k, j));
}

// Makes column i of a unit; returns 1 / its length. One not longer than `least` is nothing: it becomes 0.
static double make_unit(gsl_matrix *a, size_t i, double least) {
  double length = sqrt(column_product(a, i, a, i)), inverse = length > least ? 1 / length : 0;
  for (size_t k = 0; k < a->size1; k++)
    gsl_matrix_set(a, k, i, gsl_matrix_get(a, k, i) * inverse);
  return inverse;
}

// Takes out of the fields what the held components do already (Gram and Schmidt, twice is enough).
static void take_components_out(const tal_rows *rows, const bool held[TAL_COMPONENTS], const double *root,
                                gsl_matrix *fields) {
  gsl_matrix *base = weighted(rows, rows->row, TAL_COMPONENTS, root);
  for (size_t c = 0; c < TAL_COMPONENTS; c++) {
    if (!held[c])
      continue;
    for (size_t b = 0; b < c; b++)
      if (held[b])
        subtract_column(base, c, column_product(base, b, base, c), base, b);
    make_unit(base, c, 0);
    for (int twice = 0; twice < 2; twice++)
      for (size_t j = 0; j < fields->size2; j++)
        subtract_column(fields, j, column_product(base, c, fields, j), base, c);
  }
  gsl_matrix_free(base);
}

// Mixes the fields by the singular value decomposition of their weighted forces; keeps what is above the cutoff (86).
// `whole`: length of the longest field before its mean was taken out.
static void keep_independent(tal_rows *rows, const double *field, double whole, const bool held[TAL_COMPONENTS],
                             const double *root) {
  const size_t count = rows->fields, length = 2 * rows->nodes;
  gsl_matrix *matrix = weighted(rows, field, count, root), *right = gsl_matrix_alloc(count, count);
  gsl_vector *value = gsl_vector_alloc(count), *scale = gsl_vector_alloc(count), *work = gsl_vector_alloc(count);
  for (size_t j = 0; j < count; j++)
    gsl_vector_set(scale, j, make_unit(matrix, j, 1e-9 * whole));
  take_components_out(rows, held, root, matrix);
  gsl_linalg_SV_decomp(matrix, right, value, work);
  const double limit = TAL_ROWS_CUTOFF * fmax(1, gsl_vector_get(value, 0)), size = rows->thickness * sqrt(rows->area);
  for (rows->rank = 0; rows->rank < count && gsl_vector_get(value, rows->rank) > limit; rows->rank++) {
    double *shape = rows->shape + rows->rank * length;
    memset(shape, 0, length * sizeof *shape);
    for (size_t k = 0; k < count; k++) {
      double share = gsl_vector_get(scale, k) * gsl_matrix_get(right, k, rows->rank);
      add_scaled(shape, size * share / gsl_vector_get(value, rows->rank), field + k * length, length);
    }
  }
  gsl_vector_free(work);
  gsl_vector_free(scale);
  gsl_vector_free(value);
  gsl_matrix_free(right);
  gsl_matrix_free(matrix);
}

static double weighted_length(const tal_rows *rows, const double *row, const double *root) {
  double sum = 0;
  for (size_t k = 0; k < 2 * rows->nodes; k++)
    sum += row[k] * root[k / 2] * row[k] * root[k / 2];
  return sqrt(sum);
}

static void reserve(tal_rows *rows, size_t nodes, int order) {
  forget(rows);
  rows->nodes = nodes;
  rows->rank = 0;
  rows->fields = (size_t)(order * (order + 7) / 2);
  rows->normal = tal_alloc(nodes, sizeof *rows->normal);
  rows->shape = tal_alloc(rows->fields * 2 * nodes, sizeof *rows->shape);
  rows->row = tal_alloc((TAL_COMPONENTS + rows->fields) * 2 * nodes, sizeof *rows->row);
  rows->velocity = tal_alloc(2 * nodes, sizeof *rows->velocity);
  rows->force = tal_alloc(2 * nodes, sizeof *rows->force);
  rows->given = tal_alloc(2 * nodes, sizeof *rows->given);
  rows->other = tal_alloc(2 * nodes, sizeof *rows->other);
  rows->mobility = tal_alloc(nodes, sizeof *rows->mobility);
}

void tal_rows_refresh(tal_rows *rows, const geo_loop *loop, const double *x, const double *y,
                      const double *inverse_mass, const bool held[TAL_COMPONENTS], int order) {
  reserve(rows, loop->count, order);
  measure_normals(rows, loop, x, y);
  component_rows(rows);
  if (!rows->fields)
    return;
  double *field = field_forces(rows, loop, x, y, order), *root = tal_alloc(rows->nodes, sizeof *root), most = 0;
  for (size_t k = 0; k < rows->nodes; k++)
    most = fmax(most, inverse_mass[loop->node[k]]);
  for (size_t k = 0; k < rows->nodes && most > 0; k++)
    root[k] = sqrt(inverse_mass[loop->node[k]] / most);
  double whole = 0;
  for (size_t j = 0; j < rows->fields; j++) {
    whole = fmax(whole, weighted_length(rows, field + j * 2 * rows->nodes, root));
    take_mean_out(rows, loop, x, y, field + j * 2 * rows->nodes);
  }
  keep_independent(rows, field, whole, held, root);
  free(root);
  free(field);
}

// ---- solving ----

static double mobile_product(const tal_rows *rows, size_t a, size_t b, const double *mobility) {
  const double *p = rows->row + a * 2 * rows->nodes, *q = rows->row + b * 2 * rows->nodes;
  double sum = 0;
  for (size_t k = 0; k < rows->nodes; k++)
    sum += mobility[k] * (p[2 * k] * q[2 * k] + p[2 * k + 1] * q[2 * k + 1]);
  return sum;
}

bool tal_rows_set_up(const tal_rows *rows, const bool held[TAL_COMPONENTS], geo_tensor target, const double *mobility,
                     tal_row_equations *s) {
  double first = 0;
  s->count = 0;
  for (size_t r = 0; r < TAL_COMPONENTS + rows->rank; r++) {
    if (r < TAL_COMPONENTS && !held[r])
      continue;
    double square = mobile_product(rows, r, r, mobility);
    if (!(square > 0) || !isfinite(square))
      return false;
    s->aim[s->count] =
        r < TAL_COMPONENTS ? -rows->thickness * rows->area * tal_component_of((tal_component)r, target) : 0;
    first = s->count ? first : square;
    s->scale[s->count] = sqrt(first / square); // a ratio: the same bits in any units
    s->row[s->count++] = r;
  }
  for (size_t a = 0; a < s->count; a++)
    for (size_t b = 0; b <= a; b++)
      s->matrix[a * s->count + b] = s->matrix[b * s->count + a] =
          s->scale[a] * s->scale[b] * mobile_product(rows, s->row[a], s->row[b], mobility);
  if (!s->count)
    return true;
  gsl_matrix_view matrix = gsl_matrix_view_array(s->matrix, s->count, s->count);
  gsl_vector_view tau = gsl_vector_view_array(s->tau, s->count);
  gsl_linalg_QR_decomp(&matrix.matrix, &tau.vector);
  return true;
}

void tal_rows_correct(tal_rows *rows, tal_row_equations *s, const double *mobility, double *velocity) {
  double missing[TAL_ROWS_MOST];
  if (!s->count)
    return;
  const size_t length = 2 * rows->nodes;
  for (size_t a = 0; a < s->count; a++)
    missing[a] = s->scale[a] * (s->aim[a] - product(rows->row + s->row[a] * length, velocity, length));
  gsl_matrix_view matrix = gsl_matrix_view_array(s->matrix, s->count, s->count);
  gsl_vector_view tau = gsl_vector_view_array(s->tau, s->count), x = gsl_vector_view_array(missing, s->count);
  gsl_linalg_QR_svx(&matrix.matrix, &tau.vector, &x.vector);
  for (size_t a = 0; a < s->count; a++) {
    const double *row = rows->row + s->row[a] * length, more = s->scale[a] * missing[a];
    rows->multiplier[s->row[a]] += more;
    for (size_t k = 0; k < length; k++)
      velocity[k] += more * mobility[k / 2] * row[k];
  }
}

bool tal_rows_solve(tal_rows *rows, const bool held[TAL_COMPONENTS], geo_tensor target, const double *mobility,
                    double *velocity) {
  tal_row_equations s;
  memset(rows->multiplier, 0, sizeof rows->multiplier);
  if (!tal_rows_set_up(rows, held, target, mobility, &s))
    return false;
  for (int pass = 0; pass < 2; pass++) // the second takes away the round-off of the first
    tal_rows_correct(rows, &s, mobility, velocity);
  return true;
}
