// The energy ledger: it closes to second order in the time step for two bodies under every force there is, within a
// stated share for a thousand grains, and its parts agree with sums made independently.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "effects.h"
#include "energy.h"
#include "engine.h"
#include <float.h>
#include <omp.h>

// ---- two bodies ----

typedef struct two_bodies {
  const char *name, *text;
  double until; // [s]
} two_bodies;

#define MEET                                                                                                           \
  "grains: {thickness: 1, list: [{x: -0.6, y: 0, r: 0.5, vx: 2, vy: 0.25, omega: 3}, "                                 \
  "{x: 0.5, y: 0.3, r: 0.4, vx: -1, omega: 1}]}\n"
#define DROP   "grains: {thickness: 1, list: [{x: 0.1, y: 0.55, r: 0.5, vx: 1.5, vy: -2, omega: 1}]}\n"
#define FLOOR  "walls: [{from: [-9, 0], to: [9, 0]}]\n"
#define FREE   "stages: [{kind: free, duration: 1}]\n"
#define RUBBER "material: {young: 1e4, density: 1, friction: 0.4, damping: 4e-3}\n"

static const two_bodies cases[] = {
    {"elastic", MEET "material: {young: 1e4, density: 1}\n" FREE, 0.2},
    {"elastic linear", MEET "material: {density: 1}\ncontact: {normal: linear, stiffness: 2e3}\n" FREE, 0.2},
    {"damped", MEET "material: {young: 1e4, density: 1, damping: 4e-3}\n" FREE, 0.2},
    {"damped linear", MEET "material: {density: 1}\ncontact: {normal: linear, stiffness: 2e3, restitution: 0.5}\n" FREE,
     0.2},
    {"regularised", MEET RUBBER "contact: {vR: 0.5, exponent: 2}\n" FREE, 0.2},
    {"spring", MEET RUBBER "contact: {tangential: spring}\n" FREE, 0.2},
    {"spring linear",
     MEET "material: {density: 1, friction: 0.4}\n"
          "contact: {normal: linear, stiffness: 2e3, damping: 1, tangential: spring}\n" FREE,
     0.2},
    {"spins held", MEET RUBBER "rotation: false\ncontact: {tangential: spring}\n" FREE, 0.2},
    {"gravity and floor", DROP FLOOR RUBBER "gravity: [1, -9]\ncontact: {vR: 0.5, exponent: 2}\n" FREE, 0.5},
    {"gravity and floor, spring", DROP FLOOR RUBBER "gravity: [1, -9]\ncontact: {tangential: spring}\n" FREE, 0.5},
    {"end of a wall",
     DROP "walls: [{from: [-9, 0], to: [0, 0]}]\n" RUBBER "gravity: [0, -9]\ncontact: {tangential: spring}\n" FREE,
     0.5},
    {"moving wall",
     DROP "walls: [{from: [-9, 0], to: [9, 0], velocity: [-1, 1.5]}]\n" RUBBER
          "gravity: [1, -9]\ncontact: {tangential: spring}\n" FREE,
     0.5},
    {"vanishing wall",
     DROP "walls: [{from: [-9, 0], to: [9, 0], velocity: [-1, 1.5], until_time: 0.0625}]\n" RUBBER
          "contact: {tangential: spring}\n" FREE,
     0.2},
    {"appearing wall",
     DROP "walls: [{from: [-9, 0.15], to: [9, 0.15], from_time: 0.03125}]\n" RUBBER
          "contact: {tangential: spring}\n" FREE,
     0.2},
    {"spinning fixed grain",
     "grains: {thickness: 1, list: [{x: 0, y: 0, r: 0.5, omega: 20, fixed: true}, {x: 0.05, y: 0.92, r: 0.4}]}\n" RUBBER
     "gravity: [0, -9]\ncontact: {vR: 0.5, exponent: 2}\n" FREE,
     0.4},
    {"moving fixed grain",
     "grains: {thickness: 1, list: [{x: 0, y: 0, r: 0.5, vx: 1, vy: 2, fixed: true}, {x: 0.3, y: 0.92, r: "
     "0.4}]}\n" RUBBER "gravity: [0, -9]\ncontact: {tangential: spring}\n" FREE,
     0.4},
    {"two stages",
     MEET RUBBER "contact: {vR: 0.5, exponent: 2}\n"
                 "stages: [{kind: free, duration: 0.125}, {kind: free, duration: 1}]\n",
     0.2},
};
enum { CASES = sizeof cases / sizeof *cases, LEVELS = 6 };

static void assert_close(double value, double expected, double tolerance) {
  if (!(fabs(value - expected) <= tolerance))
    fail_msg("%.17g instead of %.17g, off by %.3g of %.3g", value, expected, fabs(value - expected), tolerance);
}

static engine *start(const char *text, double dt) {
  draft *d = draft_begin();
  fprintf(d->to, "%sintegrator: {dt: %.17g}\n", text, dt);
  return engine_start(d);
}

static tal_row ledger(engine *e) {
  tal_row row = {0};
  tal_sim_driving(e->sim);
  tal_energy_row(e->sim, &row);
  return row;
}

// Largest residual over the run.
static double worst_residual(const two_bodies *c, double dt) {
  engine *e = start(c->text, dt);
  double worst = 0, elastic = 0;
  while (e->sim->run.time < c->until - 0.5 * dt) {
    engine_step(e);
    tal_row row = ledger(e);
    worst = fmax(worst, fabs(row.energy_residual));
    elastic = fmax(elastic, row.elastic);
  }
  assert_true(elastic > 0.01); // they met
  engine_end(e);
  return worst;
}

// ORDER: the residual is what the elastic forces lose to the finite step, of second order; six steps, each half the one
// before.
static void residual_is_of_second_order(void **state) {
  (void)state;
  int failed = 0;
  for (int k = 0; k < CASES; k++) {
    double dt[LEVELS], residual[LEVELS];
    for (int level = 0; level < LEVELS; level++) {
      dt[level] = ldexp(1, -11 - level);
      residual[level] = worst_residual(&cases[k], dt[level]);
    }
    double slope = log_slope(dt, residual, LEVELS);
    if (slope > 1.8 && residual[LEVELS - 1] < 1e-5)
      continue;
    print_error("%s: order %.3g, residuals %.3g ... %.3g\n", cases[k].name, slope, residual[0], residual[LEVELS - 1]);
    failed++;
  }
  assert_int_equal(failed, 0);
}

// ---- many grains ----

// Grains at random on a jittered grid in a box; one side moves in, the floor rubs to and fro past them.
static void put_box(FILE *to, int columns, int rows, double speed) {
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  fprintf(to, "grains:\n  thickness: 1\n  list:\n");
  for (int k = 0; k < columns * rows; k++) {
    bool fixed = k % 37 == 20; // it keeps its velocity: what holds it works
    double most = fixed ? 0.1 : speed;
    fprintf(to, "  - {x: %.17g, y: %.17g, r: %.17g, vx: %.17g, vy: %.17g, omega: %.17g, fixed: %s}\n",
            2.2 * (k % columns + 0.5) + uniform(random, -0.1, 0.1),
            2.2 * (k / columns + 0.5) + uniform(random, -0.1, 0.1), uniform(random, 0.5, 1),
            uniform(random, -most, most), uniform(random, -most, most), uniform(random, -speed, speed),
            fixed ? "true" : "false");
  }
  double width = 2.2 * columns, height = 2.2 * rows;
  fprintf(to,
          "walls:\n  - {from: [-99, 0], to: [%g, 0], velocity: [0.5, 0], friction: 0.7}\n"
          "  - {from: [%g, -1], to: [%g, %g], velocity: [-0.7, 0]}\n"
          "  - {from: [0, -1], to: [0, %g], until_time: 0.8}\n  - {from: [-3, 0], to: [-3, %g], from_time: 0.4}\n",
          width + 99, width, width, 3 * height, 3 * height, 3 * height);
  gsl_rng_free(random);
}

#define SAND "material: {young: 4e5, density: 1, friction: 0.5, damping: 2e-3}\n"

// Losses of the contacts as they stand [W], from slip and approach speeds of the pairs and walls: friction, damping.
typedef struct losses {
  double friction, damping;
} losses;

static losses losses_now(const tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  const tal_contacts *s = &sim->pairs;
  losses sum = {0};
  for (size_t c = 0; c < s->count; c++) {
    int32_t i = s->i[c], j = s->j[c];
    double closing = -(s->nx[c] * (g->vx[i] - g->vx[j]) + s->ny[c] * (g->vy[i] - g->vy[j]));
    sum.friction -= s->ft[c] * s->slip[c];
    sum.damping += s->fd[c] * closing;
  }
  s = &sim->wall_contacts;
  for (size_t c = 0; c < s->count; c++) {
    const tal_wall *wall = &sim->walls.wall[s->j[c]];
    int32_t i = s->i[c];
    double closing = -(s->nx[c] * (g->vx[i] - wall->vx) + s->ny[c] * (g->vy[i] - wall->vy));
    sum.friction -= s->ft[c] * s->slip[c];
    sum.damping += s->fd[c] * closing;
  }
  return sum;
}

// ROUND: what the ledger says was lost is the sum over steps and contacts of force times slip and of viscous force
// times approach, worked out here from the contacts; the ledger works it out from the grains and the walls. Springs
// keep what they hold. Sums of 1e6 terms.
static void losses_are_those_of_the_contacts(void **state) {
  (void)state;
  static const char *const laws[] = {"contact: {vR: 1e-2}\n", "contact: {tangential: spring}\n"};
  for (int k = 0; k < 2; k++) {
    draft *d = draft_begin();
    put_box(d->to, 10, 10, 5);
    fprintf(d->to, SAND "%sgravity: [1, -10]\nintegrator: {dt: 1e-3}\nstages: [{kind: free, duration: 2}]\n", laws[k]);
    engine *e = engine_start(d);
    losses now = losses_now(e->sim), sum = {0.5 * now.friction, 0.5 * now.damping};
    while (!tal_sim_done(e->sim)) {
      engine_step(e);
      tal_sim_driving(e->sim);
      now = losses_now(e->sim);
      sum.friction += now.friction;
      sum.damping += now.damping;
    }
    double dt = e->sim->dt, springs = tal_energy_springs(e->sim);
    double friction = dt * (sum.friction - 0.5 * now.friction) - springs;
    double damping = dt * (sum.damping - 0.5 * now.damping);
    tal_row row = ledger(e);
    assert_true(row.dissipated_friction > 100 && row.dissipated_damping > 100);
    assert_true((springs > 0.1) == (k == 1));
    assert_close(row.dissipated_friction, friction, 1e-11 * friction);
    assert_close(row.dissipated_damping, damping, 1e-11 * damping);
    engine_end(e);
  }
}

// ROUND: stored energies against sums over all pairs and walls with the closed forms of eq (18).
static void stored_energies(void **state) {
  (void)state;
  draft *d = draft_begin();
  put_box(d->to, 8, 8, 5);
  fprintf(d->to, SAND "contact: {tangential: spring}\ngravity: [1, -10]\nintegrator: {dt: 1e-3}\n"
                      "stages: [{kind: free, duration: 2}]\n");
  engine *e = engine_start(d);
  engine_steps(e, 1500);
  tal_row row = ledger(e);
  const tal_grains *g = &e->sim->grains;
  const double modulus = 4e5 / (1 - 0.3 * 0.3) / 2; // both sides alike
  double elastic = tal_energy_springs(e->sim), kinetic = 0, gravity = 0;
  for (size_t i = 0; i < g->count; i++) {
    double mass = TAL_PI * g->r[i] * g->r[i];
    kinetic += mass / 2 * (pow(g->vx[i], 2) + pow(g->vy[i], 2) + pow(g->r[i] * g->omega[i], 2) / 2);
    gravity += mass * (10 * g->y[i] - g->x[i]);
    for (size_t j = 0; j < i; j++) {
      double overlap = g->r[i] + g->r[j] - hypot(g->x[i] - g->x[j], g->y[i] - g->y[j]);
      double stiffness = 4.0 / 3 * modulus * sqrt(g->r[i] * g->r[j] / (g->r[i] + g->r[j]));
      elastic += overlap > 0 ? 2.0 / 5 * stiffness * pow(overlap, 2.5) : 0;
    }
    double side = e->sim->walls.wall[1].x0; // it has come in
    double beyond[3] = {g->r[i] - g->y[i], g->r[i] - (side - g->x[i]), g->r[i] - 3 - g->x[i]};
    for (int w = 0; w < 3; w++) // floor, moving side, the wall that appeared
      elastic += beyond[w] > 0 ? 2.0 / 5 * 4.0 / 3 * modulus * sqrt(g->r[i]) * pow(beyond[w], 2.5) : 0;
  }
  assert_true(elastic > 1 && kinetic > 1);
  assert_close(row.elastic, elastic, 1e-11 * elastic);
  assert_close(row.kinetic, kinetic, 1e-13 * kinetic);
  assert_close(row.gravity, gravity, 1e-13 * fabs(gravity));
  engine_end(e);
}

// Residual at most `share` at every 50th step from `first` on and at the end.
static void assert_closes(engine *e, int first, double share) {
  double damping = 0, worst = 0;
  for (int s = 1; !tal_sim_done(e->sim); s++) {
    engine_step(e);
    if (s % 50 && !tal_sim_done(e->sim))
      continue;
    tal_row row = ledger(e);
    assert_true(row.dissipated_damping >= damping);
    damping = row.dissipated_damping;
    if (s >= first)
      worst = fmax(worst, fabs(row.energy_residual));
  }
  if (!(worst <= share))
    fail_msg("residual %.3g", worst);
}

// MODEL: a thousand grains that fall in a box whose walls move, come and go.
static void thousand_grains_in_a_box(void **state) {
  (void)state;
  static const char *const laws[] = {"contact: {vR: 1e-2}\n", "contact: {tangential: spring}\n"};
  for (int k = 0; k < 2; k++) {
    draft *d = draft_begin();
    put_box(d->to, 40, 25, 1);
    fprintf(d->to, SAND "%sgravity: [1, -10]\nintegrator: {dt: 2e-4}\nstages: [{kind: free, duration: 1.5}]\n",
            laws[k]);
    engine *e = engine_start(d);
    assert_closes(e, 50, 1e-4);
    engine_end(e);
  }
}

// MODEL: confinement and compression, both kinds of friction.
static void biaxial_test(void **state) {
  (void)state;
  static const char *const laws[] = {"regularised", "spring"};
  for (int k = 0; k < 2; k++) {
    draft *d = draft_begin();
    fprintf(d->to,
            "grains: {count: 150, radius: {law: uniform, min: 0.5e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
            "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\nmass_scaling: 1e5\n"
            "contact: {tangential: %s}\npack: {method: drop_and_roll, width: 16e-3}\nintegrator: {dt: 1e-5}\n"
            "stages: [{kind: confine, pressure: 100e3, ramp: 0.3, friction: 0.1, tolerance: 0.1, unbalanced: 0.1, "
            "integrator: {dt: 2e-5}}, {kind: compress, rate: 5e-2, strain: 0.01}]\n",
            laws[k]);
    engine *e = engine_start(d);
    assert_closes(e, 2000, 1e-4);
    engine_end(e);
  }
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(residual_is_of_second_order),
      cmocka_unit_test(losses_are_those_of_the_contacts),
      cmocka_unit_test(stored_energies),
      cmocka_unit_test(thousand_grains_in_a_box),
      cmocka_unit_test(biaxial_test),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
