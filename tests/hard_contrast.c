// Unlike grains: size ratios to 1:100, masses to 1e6, stiffnesses to 1e4, speeds to 1e4 fold, restitution 0.02 and 1.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "critical.h"
#include "engine.h"
#include "hard.h"
#include "physics.h"
#include <float.h>
#include <omp.h>

// ---- size ratio ----

// A grain of unit radius in the middle of `count` small ones that fly at it, from a ring in random order.
static engine *shower(double ratio, int count, const char *scheme) {
  draft *d = draft_begin();
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  const double r = 1 / ratio;
  fputs("grains:\n  thickness: 1\n  list:\n  - {x: 0, y: 0, r: 1, omega: 0.5}\n", d->to);
  for (int k = 0; k < count; k++) {
    const double a = 2 * TAL_PI * k / count, away = 1 + 3 * r * uniform(random, 1, 2), speed = -uniform(random, 0.5, 1);
    fprintf(d->to, "  - {x: %.17g, y: %.17g, r: %.17g, vx: %.17g, vy: %.17g}\n", away * cos(a), away * sin(a),
            r * uniform(random, 0.9, 1), speed * cos(a) + uniform(random, -0.2, 0.2),
            speed * sin(a) + uniform(random, -0.2, 0.2));
  }
  gsl_rng_free(random);
  fprintf(d->to,
          "material: {young: 1e5, density: 1, friction: 0.5, damping: 1e-5}\ncontact: {tangential: spring}\n"
          "integrator: {scheme: %s, dt: %.17g}\nstages: [{kind: free, duration: %.17g}]\n",
          scheme, 2e-3 / ratio, 12.0 / ratio);
  return engine_start(d);
}

typedef struct totals {
  double px, py, spin, scale; // momentum, angular momentum, sum of |m v|
} totals;

static totals sum_up(const engine *e) {
  const tal_grains *g = &e->sim->grains;
  totals t = {0};
  for (size_t i = 0; i < g->count; i++) {
    t.px += g->mass[i] * g->vx[i];
    t.py += g->mass[i] * g->vy[i];
    t.spin += g->mass[i] * (g->x[i] * g->vy[i] - g->y[i] * g->vx[i]) + g->inertia[i] * g->omega[i];
    t.scale += g->mass[i] * hypot(g->vx[i], g->vy[i]);
  }
  return t;
}

// Touching pairs that every pair of grains shows, less those that the list of neighbours knows.
static int missed(engine *e) {
  const tal_grains *g = &e->sim->grains;
  tal_sim_driving(e->sim);
  int there = 0, known = 0;
  for (size_t i = 0; i < g->count; i++)
    for (size_t j = i + 1; j < g->count; j++)
      there += hypot(g->x[i] - g->x[j], g->y[i] - g->y[j]) < g->r[i] + g->r[j];
  for (size_t c = 0; c < e->sim->pairs.count; c++)
    known += e->sim->pairs.overlap[c] > 0;
  return there - known;
}

// ROUND: momentum and angular momentum to round-off, the ledger closes, no contact is missed.
static void test_size_ratio(void **state) {
  (void)state;
  static const double ratio[] = {20, 100};
  static const char *const scheme[] = {"verlet", "implicit_friction"};
  double momentum = 0, spin = 0, ledger = 0;
  int lost = 0;
  for (int k = 0; k < 2; k++)
    for (int s = 0; s < 2; s++) {
      const int count = hard_form() ? 3 * (int)ratio[k] : 60;
      engine *e = shower(ratio[k], count, scheme[s]);
      const totals before = sum_up(e);
      for (int n = 0; !tal_sim_done(e->sim); n++) {
        engine_step(e);
        lost += n % 500 ? 0 : abs(missed(e));
      }
      const totals after = sum_up(e);
      const tal_row row = engine_row(e);
      momentum = fmax(momentum, hypot(after.px - before.px, after.py - before.py) / before.scale);
      spin = fmax(spin, fabs(after.spin - before.spin) / before.scale);
      ledger = fmax(ledger, fabs(row.energy_residual));
      engine_end(e);
    }
  assert_true(momentum < 1e-12 && spin < 1e-10 && ledger < 1e-4 && lost == 0);
  hard_report(&(hard_row){"size ratio 1:20 and 1:100", "a grain under a shower of 60 and of 300",
                          "momentum, angular momentum, ledger; no contact missed (every pair looked at)",
                          hard_text("to %.0e, %.0e, %.0e; none missed", momentum, spin, ledger),
                          "none for the motion; see the graph", "next row"});
}

// Two touching grains of unit radius with a small one in the notch on either side: is their contact an edge?
static bool contact_is_edge(double ratio, const char *tessellation) {
  const double r = 1 / ratio, height = sqrt((1 + r) * (1 + r) - 1);
  draft *d = draft_begin();
  fprintf(d->to,
          "grains: {thickness: 1, list: [{x: -1, y: 0, r: 1}, {x: 1, y: 0, r: 1}, {x: 0, y: %.17g, r: %.17g}, "
          "{x: 0, y: %.17g, r: %.17g}]}\nmaterial: {young: 1, density: 1}\ncontinuum: {tessellation: %s}\n"
          "integrator: {dt: 1e-3}\nstages: [{kind: free, duration: 1}]\n",
          height, r, -height, r, tessellation);
  engine *e = engine_start(d);
  tal_row row;
  tal_sim_row(e->sim, &row); // builds the graph
  const geo_mesh *mesh = &e->sim->graph.mesh;
  bool found = false;
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int k = 0; k < 3; k++) {
      const int64_t a = e->sim->grains.id[mesh->corner[t][k]], b = e->sim->grains.id[mesh->corner[t][(k + 1) % 3]];
      found = found || a + b == 1;
    }
  engine_end(e);
  return found;
}

// EXACT: two touching grains always share a Delaunay edge up to the size ratio 1 + sqrt(2), a power edge at any.
static void test_contacts_as_edges(void **state) {
  (void)state;
  double below = 1.5, above = 4;
  assert_true(contact_is_edge(below, "delaunay") && !contact_is_edge(above, "delaunay"));
  for (int n = 0; n < 40; n++) {
    const double middle = 0.5 * (below + above);
    *(contact_is_edge(middle, "delaunay") ? &below : &above) = middle;
  }
  assert_relative(below, 1 + sqrt(2), 1e-9);
  for (double ratio = 1.5; ratio < 1e4; ratio *= 2)
    assert_true(contact_is_edge(ratio, "power"));
  hard_report(&(hard_row){"contacts as edges of the graph", "size ratio 1.5 to 4, bisected; power graph to 1e4",
                          "touching grains share an edge: below 1 + sqrt 2, or in the power graph",
                          hard_text("Delaunay up to %.9f; power: all", below), "size ratio 2.414213562",
                          "contact not in the cells' stress; take tessellation: power"});
}

// ---- mass ratio ----

enum { CHAIN = 5 };

// A light grain between two heavy ones between two fixed ones, linear contacts of stiffness 1, overlaps 0.1, in the
// fastest mode: the light one goes one way, the heavy ones the other. Masses 1 and `ratio`.
typedef struct chain {
  double frequency, light, heavy; // [rad/s] and amplitudes [m]
} chain;

static chain fastest_mode(double ratio) {
  // m x'' = -2 (x - X), M X'' = -(X - x) - X
  const double a = 2, b = 2 / ratio, c = 1 / ratio, root = sqrt((a - b) * (a - b) + 4 * a * c);
  const double square = 0.5 * (a + b + root);
  return (chain){.frequency = sqrt(square), .light = 1e-3, .heavy = 1e-3 * (a - square) / a};
}

static engine *chain_start(double ratio, double dt) {
  const chain mode = fastest_mode(ratio);
  const double x[CHAIN] = {-3.8, -1.9 + mode.heavy, mode.light, 1.9 + mode.heavy, 3.8};
  draft *d = draft_begin();
  fputs("grains:\n  thickness: 1\n  list:\n", d->to);
  for (int k = 0; k < CHAIN; k++)
    fprintf(d->to, "  - {x: %.17g, y: 0, r: 1, mass: %.17g, fixed: %s}\n", x[k], k == 2 ? 1 : ratio,
            k % 4 ? "false" : "true");
  fprintf(d->to,
          "contact: {normal: linear, stiffness: 1}\nintegrator: {dt: %.17g, force: true}\n"
          "stages: [{kind: free, duration: 1e9}]\n",
          dt);
  return engine_start(d);
}

// ROUND: x_n = x_0 cos(2 n asin(omega dt / 2)), exact for the scheme; the critical step is that of the light grain.
static void test_mass_ratio(void **state) {
  (void)state;
  const double ratio = 1e6, frequency = fastest_mode(ratio).frequency;
  const int64_t steps = hard_size(10000, 1000000, 10000000);
  double worst = 0, sharp = 0;
  for (double share = 0.1; share < 1; share += 0.4) {
    engine *e = chain_start(ratio, share * 2 / frequency);
    sharp = tal_critical_step(e->sim) * frequency / 2;
    for (int64_t n = 1; n <= steps; n++) {
      engine_step(e);
      worst = fmax(worst, fabs(e->sim->grains.x[2] - 1e-3 * cos(2 * (double)n * asin(share))) / 1e-3);
    }
    engine_end(e);
  }
  engine *e = chain_start(ratio, 1.001 * 2 / frequency);
  engine_steps(e, 200);
  assert_true(fabs(e->sim->grains.x[2]) > 0.01 && worst < 4 * DBL_EPSILON / 1e-3 * (double)steps);
  assert_true(sharp <= 1 && sharp > 1 - 1e-6);
  engine_end(e);
  hard_report(&(hard_row){
      "mass ratio 1e6", "a light grain between heavy ones, dt 0.1 to 0.9 dt_crit",
      "x_n = x_0 cos(2 n asin(w dt/2)), w of the fastest mode in closed form",
      hard_text("off by %.0e x_0 after %.0e steps; bound on dt is %.7f of the true", worst, (double)steps, sharp),
      "dt = 2/w of the light grain", "at 1.001: grows tenfold in 200 steps"});
}

// ---- stiffness ratio ----

// ROUND: a grain squeezed between a rigid and a soft wall comes to rest where Hertz' laws give one force on both sides.
static void test_stiffness_ratio(void **state) {
  (void)state;
  double worst = 0;
  for (double ratio = 1e4; ratio < 1e7; ratio *= 1e2) {
    const double young = 1e6, plane = young / (1 - 0.09), squeeze = 0.1; // E / (1 - nu^2); (d1 + d2)
    const double hard = 4.0 / 3 * plane, soft = 4.0 / 3 * plane / (1 + ratio), part = pow(soft / hard, 2.0 / 3);
    const double in_soft = squeeze / (1 + part), force = soft * pow(in_soft, 1.5);
    const double slope = 1.5 * (hard * sqrt(squeeze - in_soft) + soft * sqrt(in_soft));
    draft *d = draft_begin();
    fprintf(d->to,
            "grains: {thickness: 1, list: [{x: 0, y: 0.99999, r: 1}]}\n"
            "material: {young: %.17g, poisson: 0.3, density: 1, damping: %.17g}\n"
            "walls: [{from: [-9, 0], to: [9, 0], young: .inf}, {from: [-9, 1.9], to: [9, 1.9], young: %.17g}]\n"
            "integrator: {dt: %.17g}\nstages: [{kind: free, duration: 1e9}]\n",
            young, 0.5 * sqrt(TAL_PI / slope), young / ratio, 0.2 * sqrt(TAL_PI / slope));
    engine *e = engine_start(d);
    engine_steps(e, 3000);
    tal_sim_driving(e->sim);
    for (int c = 0; c < 2; c++)
      worst = fmax(worst, fabs(e->sim->wall_contacts.fe[c] / force - 1));
    engine_end(e);
  }
  assert_true(worst < 1e-10);
  hard_report(&(hard_row){"stiffness ratio 1e4 and 1e6", "a grain between a rigid and a soft wall",
                          "one force on both sides, Hertz in closed form", hard_text("to %.0e", worst),
                          "dt_crit is that of the stiff side", "stiffening: exit 3"});
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_size_ratio),
      cmocka_unit_test(test_contacts_as_edges),
      cmocka_unit_test(test_mass_ratio),
      cmocka_unit_test(test_stiffness_ratio),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
