// See measure_tensors.h.
#include "measure_tensors.h"

#include <gsl/gsl_eigen.h>
#include <math.h>

const char *tal_network_name(tal_network network) {
  static const char *const names[] = {"all", "strong", "weak"};
  return names[network];
}

bool tal_network_has(tal_network network, double fn, double mean) {
  return network == TAL_NETWORK_ALL || (network == TAL_NETWORK_STRONG) == (fn > mean);
}

tal_principal tal_principal_of(geo_tensor tensor) {
  double matrix[4] = {tensor.xx, (tensor.xy + tensor.yx) / 2, (tensor.xy + tensor.yx) / 2, tensor.yy};
  double values[2], vectors[4];
  gsl_matrix_view m = gsl_matrix_view_array(matrix, 2, 2), v = gsl_matrix_view_array(vectors, 2, 2);
  gsl_vector_view l = gsl_vector_view_array(values, 2);
  gsl_eigen_symmv_workspace *work = gsl_eigen_symmv_alloc(2);
  gsl_eigen_symmv(&m.matrix, &l.vector, &v.matrix, work);
  gsl_eigen_symmv_free(work);
  const int k = values[1] > values[0];
  double angle = atan2(vectors[2 + k], vectors[k]);
  angle += angle < 0 ? TAL_PI : 0;
  angle -= angle >= TAL_PI ? TAL_PI : 0;
  return (tal_principal){values[k], values[1 - k], angle};
}

// ---- harmonics ----

// The deviatoric tensor [[a, b], [b, -a]] as size and angle.
static tal_anisotropy anisotropy_of(geo_vec a) {
  const tal_principal p = tal_principal_of((geo_tensor){a.x, a.y, a.y, -a.x});
  return p.major > 0 ? (tal_anisotropy){p.major, p.angle} : (tal_anisotropy){0, 0};
}

// Sums for the least-squares line value = mean + slope . (g - mean g) over contacts, g a direction's harmonic.
typedef struct harmonic {
  double n, value;
  geo_vec g, gv;
  geo_tensor gg;
} harmonic;

static void harmonic_add(harmonic *h, geo_vec g, double value) {
  h->n++;
  h->value += value;
  h->g = geo_add(h->g, g);
  h->gv = geo_add(h->gv, geo_scale(value, g));
  h->gg = geo_tensor_add(h->gg, geo_outer(g, g));
}

// The slope, and in *level the value at g = 0. Where the directions do not tell a component (all contacts parallel, a
// square lattice), that component is 0.
static geo_vec harmonic_slope(const harmonic *h, double *level) {
  const geo_vec mean = geo_scale(1 / h->n, h->g);
  const geo_tensor spread =
      geo_tensor_add(geo_tensor_scale(1 / h->n, h->gg), geo_tensor_scale(-1, geo_outer(mean, mean)));
  const geo_vec together = geo_sub(geo_scale(1 / h->n, h->gv), geo_scale(h->value / h->n, mean));
  const tal_principal p = tal_principal_of(spread);
  const geo_vec axis[2] = {{cos(p.angle), sin(p.angle)}, {-sin(p.angle), cos(p.angle)}};
  const double value[2] = {p.major, p.minor};
  geo_vec slope = {0, 0};
  for (int k = 0; k < 2; k++)
    if (value[k] > 1e-12)
      slope = geo_add(slope, geo_scale(geo_dot(together, axis[k]) / value[k], axis[k]));
  *level = h->value / h->n - geo_dot(slope, mean);
  return slope;
}

typedef struct sums {
  double fn, branch;
  geo_tensor contact, length, normal, tangential, stress;
  geo_vec fabric;                // of (cos 2 theta, sin 2 theta)
  harmonic force, lever, couple; // fn, l over g; ft over (-sin, cos) 2 theta
} sums;

static void add_contact(sums *s, const tal_snapshot *at, size_t c) {
  const tal_snapshot_contacts *k = &at->contacts;
  const geo_vec n = {k->nx[c], k->ny[c]}, t = {-n.y, n.x};
  const double fn = k->fn[c], ft = k->ft[c];
  const double l = at->r[k->i[c]] + at->r[k->j[c]] - k->overlap[c];
  const geo_vec g = {n.x * n.x - n.y * n.y, 2 * n.x * n.y};
  const geo_tensor nn = geo_outer(n, n), tn = geo_outer(t, n);
  s->fn += fn;
  s->branch += l;
  s->contact = geo_tensor_add(s->contact, nn);
  s->length = geo_tensor_add(s->length, geo_tensor_scale(l, nn));
  s->normal = geo_tensor_add(s->normal, geo_tensor_scale(fn, nn));
  s->tangential = geo_tensor_add(s->tangential, geo_tensor_scale(ft, tn));
  s->stress = geo_tensor_add(s->stress, geo_tensor_scale(l * fn, nn));
  s->stress = geo_tensor_add(s->stress, geo_tensor_scale(l * ft, tn));
  s->fabric = geo_add(s->fabric, g);
  harmonic_add(&s->force, g, fn);
  harmonic_add(&s->lever, g, l);
  harmonic_add(&s->couple, (geo_vec){-g.y, g.x}, ft);
}

// ---- stress by force and fabric ----

typedef struct harmonics {
  geo_vec c, n, t, l;
  double f0, l0;
} harmonics;

// (M7) per contact, l f0 taken as the harmonics say: the integral of a trigonometric polynomial of degree 8, exact with
// 16 directions.
static geo_tensor relation(const harmonics *h) {
  enum { DIRECTIONS = 16 };
  geo_tensor sum = {0};
  for (int k = 0; k < DIRECTIONS; k++) {
    const double theta = TAL_PI * k / DIRECTIONS;
    const geo_vec n = {cos(theta), sin(theta)}, t = {-n.y, n.x}, g = {cos(2 * theta), sin(2 * theta)};
    const double weight = (1 + geo_dot(h->c, g)) * h->l0 * (1 + geo_dot(h->l, g)) / DIRECTIONS;
    const double fn = h->f0 * (1 + geo_dot(h->n, g)), ft = h->f0 * geo_dot(h->t, (geo_vec){-g.y, g.x});
    sum = geo_tensor_add(sum, geo_tensor_scale(weight * fn, geo_outer(n, n)));
    sum = geo_tensor_add(sum, geo_tensor_scale(weight * ft, geo_outer(t, n)));
  }
  return sum;
}

static double ratio_of(geo_tensor stress) {
  const tal_principal p = tal_principal_of(stress);
  return p.major + p.minor != 0 ? (p.major - p.minor) / (p.major + p.minor) : 0;
}

static geo_tensor symmetric(geo_tensor a) {
  return (geo_tensor){a.xx, (a.xy + a.yx) / 2, (a.xy + a.yx) / 2, a.yy};
}

static void fill_relation(tal_fabric *f, const harmonics *h, geo_tensor measured) {
  const geo_tensor by = relation(h), real = symmetric(measured),
                   difference = geo_tensor_add(by, geo_tensor_scale(-1, real));
  const double size = sqrt(geo_contract(real, real));
  f->stress_ratio = ratio_of(real);
  f->relation_ratio = geo_norm(geo_add(geo_add(h->c, h->n), geo_add(h->t, h->l))) / 2;
  f->relation_full_ratio = ratio_of(by);
  f->relation_full_error = size > 0 ? sqrt(geo_contract(difference, difference)) / size : 0;
}

static tal_fabric finish(const sums *s, double volume) {
  const double n = s->force.n, one = 1 / n, mean_fn = s->fn / n, per_force = mean_fn > 0 ? one / mean_fn : 0;
  tal_fabric f = {.contacts = (size_t)n, .mean_fn = mean_fn, .mean_branch = s->branch / n};
  harmonics h = {.c = geo_scale(2 * one, s->fabric)};
  double none;
  h.n = harmonic_slope(&s->force, &h.f0);
  h.l = harmonic_slope(&s->lever, &h.l0);
  h.t = harmonic_slope(&s->couple, &none);
  h.n = geo_scale(h.f0 > 0 ? 1 / h.f0 : 0, h.n);
  h.t = geo_scale(h.f0 > 0 ? 1 / h.f0 : 0, h.t);
  h.l = geo_scale(h.l0 > 0 ? 1 / h.l0 : 0, h.l);
  f.contact = geo_tensor_scale(one, s->contact);
  f.branch = geo_tensor_scale(one / f.mean_branch, s->length);
  f.normal = geo_tensor_scale(per_force, s->normal);
  f.tangential = geo_tensor_scale(per_force, s->tangential);
  f.a_c = anisotropy_of(h.c);
  f.a_l = anisotropy_of(h.l);
  f.a_n = anisotropy_of(h.n);
  f.a_t = anisotropy_of(h.t);
  f.stress = geo_tensor_scale(volume > 0 ? 1 / volume : 0, s->stress);
  fill_relation(&f, &h, geo_tensor_scale(one, s->stress));
  return f;
}

tal_fabric tal_fabric_measure(const tal_part *part, tal_network network, double thickness) {
  sums s = {0};
  for (size_t k = 0; k < part->contact_count; k++) {
    const size_t c = (size_t)part->contact[k];
    if (tal_network_has(network, part->of->contacts.fn[c], part->mean_fn))
      add_contact(&s, part->of, c);
  }
  return s.force.n > 0 ? finish(&s, part->area * thickness) : (tal_fabric){0};
}
