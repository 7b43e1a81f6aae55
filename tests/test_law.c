// Contact laws point by point against their formulas, the stored energies against quadrature, and the speed ratio of
// the clipped linear law against an integrated motion.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "law.h"

#include <float.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_integration.h>
#include <gsl/gsl_odeiv2.h>
#include <stdbool.h>

static const tal_law_constants constants = {.inverse_vR = 1 / 0.02, .inverse_exponent = 0.05, .tangential_ratio = 0.8};

static bool near(double value, double expected, double tolerance) {
  return fabs(value - expected) <= tolerance * fabs(expected);
}

// ROUND: K = 4/3 Ebar sqrt(Reff) with 1/Ebar = sum (1 - nu^2)/E: like materials Ebar = E/(2(1 - nu^2)), a rigid side
// doubles it, the order of the sides does not matter; grain and mirror image carry the force of the rigid wall.
static void test_hertz_stiffness(void **state) {
  (void)state;
  for (double young = 1e6; young < 1e12; young *= 100) {
    for (double nu = 0; nu < 0.5; nu += 0.15) {
      double modulus = young / (1 - nu * nu), r = 1e-3;
      double like = tal_hertz_stiffness(modulus, modulus, r / 2), rigid = tal_hertz_stiffness(modulus, HUGE_VAL, r);
      assert_true(near(like, 4.0 / 3 * young / (2 * (1 - nu * nu)) * sqrt(r / 2), 4 * DBL_EPSILON));
      assert_true(near(rigid, 4.0 / 3 * modulus * sqrt(r), 4 * DBL_EPSILON));
      assert_true(near(like * pow(2, 1.5), rigid, 4 * DBL_EPSILON));
      double unlike = 4.0 / 3 / ((1 - nu * nu) / young + (1 - 0.04) / 7e9) * sqrt(r);
      assert_true(near(tal_hertz_stiffness(modulus, 7e9 / 0.96, r), unlike, 4 * DBL_EPSILON));
      assert_true(tal_hertz_stiffness(modulus, 7e9, r) == tal_hertz_stiffness(7e9, modulus, r));
    }
  }
}

// ROUND: elastic and viscous force over overlaps, approach speeds and both laws; fe + fd is clipped at zero, nothing
// acts across a gap.
static void test_normal_force(void **state) {
  (void)state;
  for (int hertz = 0; hertz < 2; hertz++) {
    unsigned effects = TAL_EFFECT_DAMPING | (hertz ? TAL_EFFECT_HERTZ : 0);
    for (double overlap = 1e-12; overlap < 1e-2; overlap *= 3) {
      for (double approach = -3; approach <= 3; approach += 0.25) {
        tal_meeting m = {.overlap = overlap, .approach = approach, .stiffness = 1e9, .damping = 2e4};
        tal_law_force f = tal_contact_law(m, constants, effects);
        double elastic = 1e9 * (hertz ? pow(overlap, 1.5) : overlap);
        double sum = elastic + 2e4 * (hertz ? sqrt(overlap) : 1) * approach;
        assert_true(near(f.fe, elastic, 4 * DBL_EPSILON));
        assert_true(fabs(f.fe + f.fd - fmax(sum, 0)) <= 8 * DBL_EPSILON * (elastic + fabs(sum - elastic)));
        assert_true(f.fe + f.fd >= 0);
        m.overlap = -overlap;
        f = tal_contact_law(m, constants, effects);
        assert_true(f.fe == 0 && f.fd == 0 && f.ft == 0);
      }
    }
  }
}

typedef struct potential {
  bool hertz;
  double stiffness;
} potential;

static double elastic_force(double overlap, void *data) {
  const potential *p = data;
  return p->hertz ? tal_hertz_elastic(p->stiffness, overlap, sqrt(overlap)) : tal_linear_elastic(p->stiffness, overlap);
}

// Quadrature: the stored energy is the integral of the elastic force, the slope its derivative.
static void test_energy_and_slope(void **state) {
  (void)state;
  gsl_integration_workspace *work = gsl_integration_workspace_alloc(200);
  for (int hertz = 0; hertz < 2; hertz++) {
    potential p = {hertz, 3e8};
    for (double overlap = 1e-9; overlap < 1e-2; overlap *= 10) {
      gsl_function f = {elastic_force, &p};
      double integral, error;
      gsl_integration_qag(&f, 0, overlap, 0, 1e-12, 200, GSL_INTEG_GAUSS61, work, &integral, &error);
      double energy = hertz ? tal_hertz_energy(p.stiffness, overlap) : tal_linear_energy(p.stiffness, overlap);
      assert_true(near(energy, integral, 1e-11));
      double h = 1e-4 * overlap, rise = elastic_force(overlap + h, &p) - elastic_force(overlap - h, &p);
      double slope = hertz ? tal_hertz_slope(p.stiffness, sqrt(overlap)) : p.stiffness;
      assert_true(near(slope, rise / (2 * h), 1e-8));
    }
  }
  gsl_integration_workspace_free(work);
}

// ROUND (powl; tolerance of root.h and three products): mu fn (|s|/vR)^(1/c) against the slip, with the full normal
// force, damped part included.
static void test_regularised(void **state) {
  (void)state;
  unsigned effects = TAL_EFFECT_HERTZ | TAL_EFFECT_DAMPING | TAL_EFFECT_REGULARISED;
  for (double c = 1; c < 200; c *= 2.7) {
    tal_law_constants k = {.inverse_vR = 1 / 0.02, .inverse_exponent = 1 / c};
    for (double slip = 1e-15; slip < 1e3; slip *= 7) {
      for (int sign = -1; sign <= 1; sign += 2) {
        tal_meeting m = {.overlap = 1e-6, .approach = 0.3, .slip = sign * slip};
        m.stiffness = 1e9, m.damping = 2e4, m.friction = 0.45;
        tal_law_force f = tal_contact_law(m, k, effects);
        double x = slip * k.inverse_vR;
        double expected = -sign * 0.45 * (f.fe + f.fd) * (double)powl((long double)x, (long double)k.inverse_exponent);
        assert_true(f.fe + f.fd > 2 * f.fe);
        assert_true(near(f.ft, expected, (8 + 1.7 * fabs(log(x)) / c) * DBL_EPSILON));
      }
    }
  }
}

// EXACT: at rest no force; at a slip of vR the Coulomb force; a clipped contact carries none.
static void test_regularised_marks(void **state) {
  (void)state;
  tal_law_constants k = {.inverse_vR = 8, .inverse_exponent = 0.05};
  tal_meeting m = {.overlap = 0.25, .stiffness = 8, .friction = 0.5, .damping = 4};
  unsigned effects = TAL_EFFECT_DAMPING | TAL_EFFECT_REGULARISED;
  assert_true(tal_contact_law(m, k, effects).ft == 0);
  m.slip = 0.125;
  assert_true(tal_contact_law(m, k, effects).ft == -1);
  m.slip = -0.125;
  assert_true(tal_contact_law(m, k, effects).ft == 1);
  m.approach = -10;
  assert_true(tal_contact_law(m, k, effects).ft == 0);
}

// ROUND: at constant stiffness a plain spring; never beyond the cap on either side; back from the cap at once.
static void test_spring_path(void **state) {
  (void)state;
  double force = 0, slip = 0;
  for (int n = 0; n < 60; n++) {
    force = tal_spring_force(force, 100, 100, 1e-3, 1e9);
    slip += 1e-3;
    assert_true(near(force, -100 * slip, 64 * DBL_EPSILON));
  }
  for (int n = 0; n < 60; n++)
    force = tal_spring_force(force, 100, 100, 1e-3, 7);
  assert_true(force == -7);
  assert_true(near(tal_spring_force(force, 100, 100, -1e-3, 7), -6.9, 4 * DBL_EPSILON));
  assert_true(tal_spring_force(force, 100, 100, -1, 7) == 7);
  assert_true(tal_spring_force(force, 100, 100, 0, 0) == 0);
}

// ROUND: a change of stiffness alone never stores energy: falling, force and stiffness fall together (same elongation);
// rising, the force stays. With slip, the elongation while it falls, the mean stiffness while it rises, that of now
// where the contact is new.
static void test_spring_stiffness(void **state) {
  (void)state;
  for (double now = 1; now < 1e4; now *= 1.7) {
    double before = 100, force = 3, held = tal_spring_force(force, before, now, 0, 1e9);
    assert_true(held * held / now <= force * force / before * (1 + 4 * DBL_EPSILON));
    assert_true(now < before ? near(held / now, force / before, 4 * DBL_EPSILON) : held == force);
    double moved = tal_spring_force(force, before, now, 1e-3, 1e9);
    double expected = now < before ? now * (force / before - 1e-3) : force - 0.5 * (before + now) * 1e-3;
    assert_true(near(moved, expected, 1e-12));
    assert_true(near(tal_spring_force(0, 0, now, 1e-3, 1e9), -1e-3 * now, 4 * DBL_EPSILON));
  }
  assert_true(tal_spring_force(3, 100, 0, 0.1, 0) == 0);
}

// ROUND: the law's tangential stiffness is the ratio times the tangent normal stiffness; the cap is mu times the full
// normal force.
static void test_spring_in_law(void **state) {
  (void)state;
  for (int hertz = 0; hertz < 2; hertz++) {
    unsigned effects = TAL_EFFECT_DAMPING | TAL_EFFECT_SPRING | (hertz ? TAL_EFFECT_HERTZ : 0);
    tal_meeting m = {.overlap = 4e-6, .stiffness = 1e8, .damping = 1e2, .friction = 0.3, .approach = 0.1};
    tal_law_force rest = tal_contact_law(m, constants, effects);
    double slope = hertz ? 1.5 * 1e8 * 2e-3 : 1e8;
    assert_true(rest.ft == 0);
    assert_true(near(rest.spring_stiffness, 0.8 * slope, 8 * DBL_EPSILON));
    m.slip_distance = 1e-9;
    assert_true(near(tal_contact_law(m, constants, effects).ft, -1e-9 * 0.8 * slope, 8 * DBL_EPSILON));
    m.slip_distance = -1;
    assert_true(near(tal_contact_law(m, constants, effects).ft, 0.3 * (rest.fe + rest.fd), 8 * DBL_EPSILON));
  }
}

// EXACT: the registries; effects of a law are those that it alone sets.
static void test_registries(void **state) {
  (void)state;
  assert_int_equal(tal_normal_law_find("hertz")->effects, TAL_EFFECT_HERTZ);
  assert_int_equal(tal_normal_law_find("linear")->effects, 0);
  assert_int_equal(tal_tangential_law_find("regularised")->effects, TAL_EFFECT_REGULARISED);
  assert_int_equal(tal_tangential_law_find("spring")->effects, TAL_EFFECT_SPRING);
  assert_int_equal(tal_tangential_law_find("none")->effects, 0);
  assert_null(tal_normal_law_find("Hertz"));
  assert_null(tal_tangential_law_find("hertz"));
  tal_choice choice[8];
  assert_int_equal(tal_normal_law_choices(choice, 8), 2);
  assert_int_equal(tal_tangential_law_choices(choice, 8), 3);
}

// ---- speed ratio of the linear law ----

// d'' = -(d + 2 z d') in units of the contact, with no clipping: the motion up to the zero of the force.
static int oscillate(double t, const double *y, double *rate, void *data) {
  (void)t;
  rate[0] = y[1];
  rate[1] = -y[0] - 2 * *(double *)data * y[1];
  return GSL_SUCCESS;
}

// Speed at the first zero of the force: Runge-Kutta up to the step that crosses it, then halves of that step.
static double integrated_restitution(double z) {
  gsl_odeiv2_system system = {oscillate, NULL, 2, &z};
  gsl_odeiv2_step *step = gsl_odeiv2_step_alloc(gsl_odeiv2_step_rk8pd, 2);
  double y[2] = {0, 1}, next[2], error[2], h = 0.01 / (1 + z);
  for (int halvings = 0; halvings < 60;) {
    next[0] = y[0];
    next[1] = y[1];
    gsl_odeiv2_step_apply(step, 0, h, next, error, NULL, NULL, &system);
    bool crossed = next[0] + 2 * z * next[1] < 0;
    if (crossed || halvings > 0) {
      h /= 2;
      halvings++;
    }
    y[0] = crossed ? y[0] : next[0];
    y[1] = crossed ? y[1] : next[1];
  }
  gsl_odeiv2_step_free(step);
  return -y[1];
}

// Integrated motion: eq (5) over five decades of the damping ratio, through critical damping to e below 1e-4.
static void test_linear_restitution(void **state) {
  (void)state;
  for (double z = 1e-3; z < 100; z *= 1.4)
    assert_true(near(tal_linear_restitution(z), integrated_restitution(z), 1e-10));
  static const double about_one[] = {0.9, 0.99, 0.9999, 0.99999999, 1, 1.00000001, 1.0001, 1.01, 1.1};
  for (size_t k = 0; k < sizeof about_one / sizeof *about_one; k++)
    assert_true(near(tal_linear_restitution(about_one[k]), integrated_restitution(about_one[k]), 1e-10));
}

// ROUND: no damping, no loss; falls with damping; e^-2 at critical damping; far beyond it e ~ (2 z)^-2.
static void test_linear_restitution_limits(void **state) {
  (void)state;
  assert_true(tal_linear_restitution(0) == 1);
  assert_true(near(tal_linear_restitution(1), exp(-2), 4 * DBL_EPSILON));
  assert_true(near(1 - tal_linear_restitution(1e-6), acos(-1) * 1e-6, 1e-5));
  assert_true(near(tal_linear_restitution(1e6), 0.25e-12, 1e-9));
  double before = 1;
  for (double z = 1e-6; z < 1e6; z *= 1.05) {
    double now = tal_linear_restitution(z);
    assert_true(now < before);
    before = now;
  }
}

// ROUND: the inverse over the range of e, from barely damped to barely leaving.
static void test_linear_damping_ratio(void **state) {
  (void)state;
  assert_true(tal_linear_damping_ratio(1) == 0);
  for (double e = 1e-12; e < 1; e = e < 0.5 ? e * 1.3 : 1 - (1 - e) / 1.3) {
    double z = tal_linear_damping_ratio(e);
    assert_true(near(tal_linear_restitution(z), e, 1e-12));
    if (1 - e < 1e-9)
      break;
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_hertz_stiffness),
                                     cmocka_unit_test(test_normal_force),
                                     cmocka_unit_test(test_energy_and_slope),
                                     cmocka_unit_test(test_regularised),
                                     cmocka_unit_test(test_regularised_marks),
                                     cmocka_unit_test(test_spring_path),
                                     cmocka_unit_test(test_spring_stiffness),
                                     cmocka_unit_test(test_spring_in_law),
                                     cmocka_unit_test(test_registries),
                                     cmocka_unit_test(test_linear_restitution),
                                     cmocka_unit_test(test_linear_restitution_limits),
                                     cmocka_unit_test(test_linear_damping_ratio)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
