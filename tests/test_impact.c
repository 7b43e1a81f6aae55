// The impact toolbox: closed forms, series and published values of the damped Hertz impact, an independent integration
// in other variables, the inverse; the damping that a scene's `restitution` gives to its contacts.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "damping.h"
#include "impact.h"
#include "law_linear.h"
#include "physics.h"
#include "physics_ode.h"

#include <float.h>
#include <gsl/gsl_sf_gamma.h>

// ---- Hertz ----

// First coefficient of e = 1 - C1 beta + ..., from the first-order loss 2 beta x (integral of sqrt(x) x' dx): a beta
// function.
static double first_coefficient(void) {
  return 0.8 * pow(1.25, 0.6) * gsl_sf_beta(0.6, 1.5);
}

// ROUND: without damping e = 1, nothing is lost, the duration is the closed form 2.9433 (5/4)^0.4; the integrated
// motion tends to it.
static void test_elastic(void **state) {
  (void)state;
  tal_impact none = tal_impact_hertz(0);
  assert_true(none.restitution == 1 && none.loss == 0);
  // integral of dx / x' over the way in and out: 2 (5/4)^0.4 (2/5) B(2/5, 1/2)
  double closed = 0.8 * pow(1.25, 0.4) * gsl_sf_beta(0.4, 0.5);
  assert_relative(none.duration, closed, 1e-14);
  assert_relative(none.duration / pow(1.25, 0.4), 2.94327, 2e-6);
  for (double beta = 1e-13; beta < 1e-9; beta *= 10) {
    tal_impact weak = tal_impact_hertz(beta);
    assert_relative(weak.duration, closed, 1e-12 + beta);
    assert_relative(weak.restitution, 1, 1e-13 + 2 * beta);
    assert_relative(weak.loss, first_coefficient() * beta, 1e-12 + beta);
  }
}

// ROUND: the loss by the damper and the overlap left over account for the kinetic energy: e + loss = 1.
static void test_energy(void **state) {
  (void)state;
  for (double beta = 1e-12; beta < 1e12; beta *= 1.7) {
    tal_impact impact = tal_impact_hertz(beta);
    assert_near(impact.restitution + impact.loss, 1, 1e-13, 1);
  }
}

// ORDER: the series of Ramirez, Poeschel, Brilliantov and Schwager (1999) and, with the force clipped at zero, of
// Schwager and Poeschel (2008): e = 1 - C1 beta + (3/5) C1^2 beta^2 + (4/15) beta^(5/2) - ...; cut off after each term,
// what is left falls as the next power of beta, the last as beta^3.
static void test_weak_series(void **state) {
  (void)state;
  enum { POINTS = 6 };
  const double c1 = first_coefficient(), order[] = {1, 2, 2.5, 3};
  assert_near(c1, 1.15344, 1e-5, 1); // as published
  assert_near(0.6 * c1 * c1, 0.79826, 1e-5, 1);
  for (int terms = 0; terms < 4; terms++) {
    double number[POINTS], left[POINTS];
    for (int k = 0; k < POINTS; k++) {
      double b = number[k] = 1e-3 * pow(0.5, k);
      const double term[] = {c1 * b, -0.6 * c1 * c1 * b * b, -4.0 / 15 * b * b * sqrt(b)};
      left[k] = tal_impact_hertz(b).loss;
      for (int t = 0; t < terms; t++)
        left[k] -= term[t];
      left[k] = fabs(left[k]);
    }
    assert_near(fitted_order(number, left, POINTS), order[terms], 0.02, 1);
  }
}

// Published: the Pade approximant of Mueller and Poeschel (2011), fitted by them to the exact series, is everywhere
// within 0.009 of e and within 1e-5 where less than 5 % is lost; beta is the square of their v*.
static void test_published(void **state) {
  (void)state;
  for (double b = 1e-4; b < 1e4; b *= 1.3) {
    double v = sqrt(b);
    double pade = (1 + 0.501086 * v) / (1 + 0.501086 * v + b * (1.15345 + v * (0.577977 + v * 0.532178)));
    double e = tal_impact_hertz(b).restitution;
    assert_near(e, pade, e > 0.95 ? 1e-5 : 0.009, 1);
  }
}

// ORDER: strong damping by a matched expansion, ours: with s = beta^(-5/3) and z0 = (3/2)^(1/3),
// e = z0^2 s (1 - 2 s ln(1/s) / z0 + O(s)): half of the logarithm is lost while the speed runs down to s, half while
// the contact creeps apart until the force is zero. So the relative correction over s is a straight line in ln(1/s) of
// slope 2/z0.
static void test_strong_limit(void **state) {
  (void)state;
  enum { POINTS = 8 };
  double x[POINTS], y[POINTS], c0, c1, cov00, cov01, cov11, sum;
  for (int k = 0; k < POINTS; k++) {
    double beta = 300 * pow(1.6, k), s = pow(beta, -5.0 / 3);
    x[k] = -log(s);
    y[k] = (1 - tal_impact_hertz(beta).restitution / (pow(1.5, 2.0 / 3) * s)) / s;
  }
  gsl_fit_linear(x, 1, y, 1, POINTS, &c0, &c1, &cov00, &cov01, &cov11, &sum);
  assert_relative(c1, 2 * pow(1.5, -1.0 / 3), 1e-3);
  assert_relative(tal_impact_hertz(1e60).restitution, pow(1.5, 2.0 / 3) * 1e-100, 1e-12);
}

// EXACT: more damping, a smaller e, a larger loss (as long as 1 - e is not 1 to round-off) and a shorter contact, over
// thirty decades.
static void test_monotone(void **state) {
  (void)state;
  tal_impact before = tal_impact_hertz(0);
  for (double beta = 1e-11; beta < 1e19; beta *= 1.1) {
    tal_impact now = tal_impact_hertz(beta);
    assert_true(now.restitution < before.restitution && now.duration < before.duration);
    assert_true(now.restitution < 1e-12 || now.loss > before.loss);
    before = now;
  }
}

// Reference: the planar two-body motion integrated in its own variables, with K, masses, speed and T each over decades:
// e and the contact time are those of the one number T / tau, the time in units of tau.
static void test_reference(void **state) {
  (void)state;
  double least = 1, most = 0;
  for (int k = 0; k < 40; k++) {
    double speed = pow(10, (k * 7 % 11) / 2.0 - 4), mass = pow(10, (k * 5 % 9) / 2.0 - 6);
    ode_contact c = {.hertz = true, .plane = k % 2, .K = pow(10, 5 + (k * 3 % 7) / 2.0)};
    c.i = (ode_grain){.y = 1, .r = 1, .vy = -speed, .mass = mass, .inertia = mass};
    c.j = (ode_grain){.r = 1, .y = -1, .mass = 3 * mass, .inertia = mass};
    double reduced = c.plane ? mass : 0.75 * mass, tau = tal_impact_hertz_time(c.K, reduced, speed);
    double beta = pow(10, k / 12.0 - 2);
    c.C = beta * tau * c.K;
    c.length = speed * tau;
    ode_result exact = ode_solve(&c, 3 * tau, HUGE_VAL);
    tal_impact impact = tal_impact_hertz(beta);
    double e = (exact.vy[0] - exact.vy[1]) / speed;
    assert_near(impact.restitution, e, 2e-11, 1);
    assert_relative(impact.duration, exact.time / tau, 1e-9);
    least = fmin(least, e);
    most = fmax(most, e);
  }
  assert_true(least < 0.02 && most > 0.98);
}

// ROUND: the inverse over the range of e; where e is near 1 the loss is what can be compared. Limits: 0 for e = 1, the
// closed form for e -> 0, held where e leaves the range of double.
static void test_number(void **state) {
  (void)state;
  assert_true(tal_impact_hertz_number(1) == 0);
  for (double e = 1e-12; 1 - e > 1e-9; e = e < 0.5 ? e * 1.9 : 1 - (1 - e) / 1.9) {
    tal_impact impact = tal_impact_hertz(tal_impact_hertz_number(e));
    assert_relative(impact.restitution, e, 1e-12);
    assert_relative(impact.loss, 1 - e, 1e-12);
  }
  assert_relative(tal_impact_hertz_number(1e-120), pow(1.5, 0.4) * 1e72, 1e-12);
  assert_true(tal_impact_hertz_number(5e-324) == 1e90);
  double next = tal_impact_hertz_number(1 - DBL_EPSILON / 2);
  assert_relative(next, DBL_EPSILON / 2 / first_coefficient(), 1e-9);
}

// ---- linear ----

// Closed forms: e of eq (5), duration pi without damping, 2 at zeta = 1, and on both sides of it that of the
// reference integrator.
static void test_linear(void **state) {
  (void)state;
  tal_impact none = tal_impact_linear(0), one = tal_impact_linear(1);
  assert_true(none.restitution == 1 && none.loss == 0);
  assert_relative(none.duration, TAL_PI, 1e-15);
  assert_relative(one.duration, 2, 1e-15);
  assert_relative(one.restitution, exp(-2), 1e-14);
  static const double ratio[] = {1e-3, 0.1, 0.5, 0.99, 0.999999, 1.000001, 1.01, 2, 10};
  for (size_t k = 0; k < sizeof ratio / sizeof *ratio; k++) {
    ode_contact c = {.plane = true, .K = 1, .C = 2 * ratio[k], .length = 1, .overlap = 1e-13};
    c.i = (ode_grain){.y = 1, .r = 1, .vy = -1, .mass = 1, .inertia = 1};
    ode_result exact = ode_solve(&c, 3, HUGE_VAL);
    tal_impact impact = tal_impact_linear(ratio[k]);
    assert_relative(impact.duration, exact.time, 1e-9);
    assert_near(impact.restitution, exact.vy[0], 1e-10, 1);
    assert_relative(impact.loss, 1 - exact.vy[0], 1e-8);
  }
  assert_relative(tal_impact_linear(1e-12).loss, TAL_PI * 1e-12, 1e-3);
}

// ---- scenes ----

#define PAIR "grains: {list: [{x: 0, y: 0, r: 1e-3}, {x: 2.5e-3, y: 0, r: 1.2e-3}], thickness: 1e-3}\n"

// ROUND: `restitution` gives every pair, whatever its stiffness and mass, the damping number of e at the given speed,
// vR by default; mass scaling is in the mass; a contact of two immovable bodies is not damped.
static void test_scene_damping(void **state) {
  (void)state;
  static const char *const speeds[] = {"restitution_speed: 0.3", "vR: 0.3", "vR: 7, restitution_speed: 0.3"};
  for (size_t n = 0; n < 3; n++) {
    physics p;
    physics_open(&p,
                 PAIR "material: {young: 1e8, density: 2000}\nmass_scaling: 50\n"
                      "contact: {restitution: 0.35, %s}\nintegrator: {dt: 1e-7}\nstages: []\n",
                 speeds[n]);
    for (double mass = 1e-9; mass < 1; mass *= 100) {
      tal_pair pair = {.stiffness = 3e5 / sqrt(mass), .reduced_mass = mass};
      const tal_constants *k = &p.sim->constants;
      pair.damping = tal_damping_coefficient(&p.scene, k, pair.stiffness, mass) / pair.stiffness;
      assert_relative(tal_damping_impact(&p.scene, &pair, 0.3).restitution, 0.35, 1e-12);
      // e falls with v^(1/5) [Ramirez et al.]: at 32 times the speed the damping number is twice as large
      assert_relative(tal_damping_number_at(&p.scene, &pair, 32 * 0.3), 2 * k->damping_number, 1e-12);
      assert_true(tal_damping_coefficient(&p.scene, k, pair.stiffness, 0) == 0);
    }
    tal_pair mean = tal_damping_mean_pair(&p.scene, &p.sim->constants);
    assert_relative(mean.reduced_mass, 50 * 2000 * 1e-3 * TAL_PI * (1e-6 + 1.44e-6) / 4, 1e-13);
    assert_relative(tal_damping_impact(&p.scene, &mean, 0.3).restitution, 0.35, 1e-12);
    physics_close(&p);
  }
}

// EXACT: what is not damped costs nothing: restitution 1 leaves the damping out of the effects, for both laws.
static void test_undamped_effects(void **state) {
  (void)state;
  static const struct {
    const char *contact;
    bool damped;
  } rows[] = {{"{restitution: 1}", false},
              {"{restitution: 0.999, restitution_speed: 1}", true},
              {"{normal: linear, stiffness: 1e4, restitution: 1}", false},
              {"{normal: linear, stiffness: 1e4, restitution: 0.999}", true},
              {"{normal: linear, stiffness: 1e4}", false},
              {"{}", false}};
  for (size_t n = 0; n < sizeof rows / sizeof *rows; n++) {
    physics p;
    physics_open(&p, PAIR "material: {young: 1e8, density: 2000}\ncontact: %s\nintegrator: {dt: 1e-7}\nstages: []\n",
                 rows[n].contact);
    assert_int_equal((p.sim->effects & TAL_EFFECT_DAMPING) != 0, rows[n].damped);
    assert_int_equal(tal_damping_any(&p.scene), rows[n].damped);
    physics_close(&p);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_elastic),       cmocka_unit_test(test_energy),          cmocka_unit_test(test_weak_series),
      cmocka_unit_test(test_published),     cmocka_unit_test(test_strong_limit),    cmocka_unit_test(test_monotone),
      cmocka_unit_test(test_reference),     cmocka_unit_test(test_number),          cmocka_unit_test(test_linear),
      cmocka_unit_test(test_scene_damping), cmocka_unit_test(test_undamped_effects)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
