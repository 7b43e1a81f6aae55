// Head-on impact and rest of grains on grains and walls: closed forms over ranges, a high-order reference, orders of
// convergence.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "impact.h"
#include "physics_contact.h"

// Two unequal grains, or the first alone against a plane, meeting at `speed` in elastic contact.
static ode_contact head_on(bool hertz, bool plane, double speed) {
  ode_contact k = {.hertz = hertz, .plane = plane, .K = hertz ? 1e7 : 1e5};
  if (plane) {
    k.i = (ode_grain){.y = 1e-3, .r = 1e-3, .vy = -speed, .mass = 1e-5, .inertia = 5e-12};
  } else {
    k.i = (ode_grain){.x = -1e-3, .r = 1e-3, .vx = 0.4 * speed, .mass = 1e-5, .inertia = 5e-12};
    k.j = (ode_grain){.x = 1.5e-3, .r = 1.5e-3, .vx = -0.6 * speed, .mass = 3e-5, .inertia = 3e-11};
  }
  double m = contact_mass(&k);
  k.length = hertz ? pow(1.25 * m * speed * speed / k.K, 0.4) : speed * sqrt(m / k.K);
  return k;
}

// Duration of the elastic contact: closed forms. Hertz: 4 sqrt(pi) Gamma(2/5) / (5 Gamma(9/10)) = 2.9433 d_max / v.
static double elastic_duration(const ode_contact *k, double speed) {
  double hertz = 0.8 * sqrt(TAL_PI) * tgamma(0.4) / tgamma(0.9);
  return (k->hertz ? hertz : TAL_PI) * k->length / speed;
}

static double leaving_speed(const ode_contact *k, const ode_result *r) {
  return k->plane ? r->vy[0] : r->vx[1] - r->vx[0];
}

// Closed form (tolerance: a second-order step of 1/3000 of the contact): largest overlap (5 m v^2 / (4 K))^(2/5),
// duration 2.9433 d_max / v and no loss of speed, over six decades of speed, grain on grain and on a rigid wall.
static void test_elastic_hertz(void **state) {
  (void)state;
  for (int plane = 0; plane < 2; plane++) {
    for (double speed = 1e-5; speed < 20; speed *= 10) {
      ode_contact k = head_on(true, plane, speed);
      double duration = elastic_duration(&k, speed), dt = duration / 3000;
      ode_result r = contact_run(&k, 2.3 * dt, dt);
      assert_relative(r.overlap, k.length, 1e-6);
      assert_relative(r.time, duration, 1e-6);
      assert_relative(leaving_speed(&k, &r), speed, 1e-6);
    }
  }
}

// Closed form: the same for the linear law, largest overlap v sqrt(m/k), duration pi sqrt(m/k).
static void test_elastic_linear(void **state) {
  (void)state;
  for (int plane = 0; plane < 2; plane++) {
    for (double speed = 1e-4; speed < 20; speed *= 10) {
      ode_contact k = head_on(false, plane, speed);
      double duration = elastic_duration(&k, speed), dt = duration / 3000.4;
      ode_result r = contact_run(&k, 2.3 * dt, dt);
      assert_relative(r.overlap, k.length, 1e-6);
      assert_relative(r.time, duration, 1e-6);
      assert_relative(leaving_speed(&k, &r), speed, 1e-6);
    }
  }
}

// Reference: speed ratio, largest overlap and duration of damped Hertz impacts, four decades of speed and more
// than four of damping T: from e = 0.998 to below 0.02.
static void test_damped_hertz(void **state) {
  (void)state;
  double least = 1, most = 0;
  for (double speed = 1e-3; speed < 20; speed *= 10) {
    for (double damping = 1e-8; damping < 1e-3; damping *= 5) {
      ode_contact k = head_on(true, speed < 5e-2, speed);
      k.C = damping * k.K;
      double duration = elastic_duration(&k, speed), dt = duration / (damping > 1e-5 ? 30000 : 12000);
      ode_result exact = ode_solve(&k, duration, HUGE_VAL), r = contact_run(&k, 3.7 * dt, dt);
      double e = leaving_speed(&k, &exact) / speed;
      assert_near(leaving_speed(&k, &r), speed * e, 1e-6, speed);
      assert_near(r.overlap, exact.overlap, 1e-6, k.length);
      assert_near(r.time, exact.time, 1e-6, duration);
      least = fmin(least, e);
      most = fmax(most, e);
    }
  }
  assert_true(least < 0.02 && most > 0.998);
}

// The contact of a scene whose normal law is the text `law`, stepped until the two have parted; returns the speed
// ratio. The contact of k has no damping of its own.
static double law_run(const ode_contact *k, const char *law, double dt) {
  char i[400], j[400] = "";
  contact_grain_text(i, &k->i, 0);
  if (!k->plane)
    contact_grain_text(j, &k->j, 0);
  physics p;
  physics_open(&p,
               "grains: {list: [%s%s%s]}\ncontact: {%s}\nmaterial: {young: %.17g, poisson: %.17g}\n"
               "%sintegrator: {dt: %.17g}\nlimits: {overlap: 1}\nstages: [{kind: free, duration: %.17g}]\n",
               i, k->plane ? "" : ", ", j, law, contact_young(k), contact_poisson,
               k->plane ? "walls: [{from: [-1e3, 0], to: [1e3, 0], young: .inf}]\n" : "", dt, 2e6 * dt);
  do { // without damping in k: until the two have parted
    physics_step(&p);
    assert_false(tal_sim_done(p.sim));
  } while (contact_state(&p, k).load > 0);
  const tal_grains *g = &p.sim->grains;
  double ratio = k->plane ? -g->vy[0] / k->i.vy : (g->vx[1] - g->vx[0]) / (k->i.vx - k->j.vx);
  physics_close(&p);
  return ratio;
}

// Closed form: the speed ratio asked for by `restitution` is the one delivered, over its range, for grains and walls.
// The contact begins a hair deep: then the dashpot's jump at touching falls on no step, and the order is two.
static void test_linear_restitution(void **state) {
  (void)state;
  static const double wanted[] = {0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 0.97, 1};
  char law[200];
  for (size_t n = 0; n < sizeof wanted / sizeof *wanted; n++) {
    for (int plane = 0; plane < 2; plane++) {
      ode_contact k = head_on(false, plane, 0.7);
      k.i.y -= plane ? 1e-10 * k.length : 0;
      k.j.x -= plane ? 0 : 1e-10 * k.length;
      double dt = elastic_duration(&k, 0.7) / 20000.4;
      snprintf(law, sizeof law, "normal: linear, stiffness: %.17g, restitution: %.17g", k.K, wanted[n]);
      assert_near(law_run(&k, law, dt), wanted[n], 1e-6, 1);
    }
  }
}

// Closed form by definition: with normal: hertz too the ratio asked for is the one delivered at the speed it is asked
// for, from 0.02 to 1, over five decades of speed, for unequal grains and for a grain on a rigid wall; the speed is
// restitution_speed or vR.
static void test_hertz_restitution(void **state) {
  (void)state;
  static const double wanted[] = {0.02, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.99, 1};
  char law[200];
  for (size_t n = 0; n < sizeof wanted / sizeof *wanted; n++) {
    for (int plane = 0; plane < 2; plane++) {
      double speed = pow(10, (double)((n * 3 + (size_t)plane * 2) % 6) - 4);
      ode_contact k = head_on(true, plane, speed);
      double dt = elastic_duration(&k, speed) / (wanted[n] < 0.3 ? 20000 : 8000);
      snprintf(law, sizeof law, "restitution: %.17g, %s: %.17g", wanted[n], n % 2 ? "vR" : "restitution_speed", speed);
      assert_near(law_run(&k, law, dt), wanted[n], 1e-6, 1);
    }
  }
}

// Reference: away from restitution_speed the ratio is that of the law at the damping number scaled by (v/v_e)^(1/5).
static void test_hertz_other_speeds(void **state) {
  (void)state;
  char law[200];
  for (double share = 1e-3; share < 2e3; share *= 10) {
    ode_contact k = head_on(true, false, 0.1);
    double dt = elastic_duration(&k, 0.1) / 15000;
    snprintf(law, sizeof law, "restitution: 0.4, restitution_speed: %.17g", 0.1 / share);
    double e = tal_impact_hertz(tal_impact_hertz_number(0.4) * pow(share, 0.2)).restitution;
    assert_true(share < 1 ? e > 0.4 : e < 0.4 + 1e-12);
    assert_near(law_run(&k, law, dt), e, 1e-6, 1);
  }
}

// ORDER: the engine's restitution tends to the toolbox's as dt^1.5, the order of a damped Hertz impact.
static void test_order_to_toolbox(void **state) {
  (void)state;
  enum { STEPS = 5 };
  ode_contact k = head_on(true, false, 1);
  double tau = k.length / pow(1.25, 0.4), dt[STEPS], error[STEPS]; // k.length: of the elastic contact
  k.C = 0.8 * k.K * tau;
  for (int n = 0; n < STEPS; n++) {
    double sum = 0;
    dt[n] = tau / ((200 << n) + 0.37);
    for (int phase = 0; phase < 8; phase++) {
      ode_result r = contact_run(&k, (phase + 0.5) / 8 * dt[n], dt[n]);
      double off = leaving_speed(&k, &r) - tal_impact_hertz(0.8).restitution;
      sum += off * off / 8;
    }
    error[n] = sqrt(sum);
  }
  assert_near(fitted_order(dt, error, STEPS), 1.5, 0.1, 1);
  assert_true(error[STEPS - 1] < 1e-5);
}

// Closed form: duration 2 acos(z) / (w sqrt(1 - z^2)) and largest overlap v/w exp(-z acos(z) / sqrt(1 - z^2)) of the
// clipped linear contact with damping ratio z, acosh above 1, and the reference integrator agrees with both.
static void test_linear_contact(void **state) {
  (void)state;
  for (double z = 0.01; z < 20; z *= 2.5) {
    ode_contact k = head_on(false, false, 0.7);
    double w = sqrt(k.K / contact_mass(&k)), side = sqrt(fabs(1 - z * z)), angle = z < 1 ? acos(z) : acosh(z);
    k.C = 2 * z * w * contact_mass(&k);
    k.overlap = 1e-12 * k.length;
    k.j.x -= k.overlap;
    double duration = 2 * angle / (w * side), overlap = k.length * exp(-z * angle / side), dt = duration / 40000.4;
    ode_result r = contact_run(&k, 0, dt);
    k.length = overlap;
    ode_result exact = ode_solve(&k, duration, HUGE_VAL);
    assert_relative(exact.time, duration, 1e-10);
    assert_relative(exact.overlap, overlap, 1e-10);
    assert_near(leaving_speed(&k, &exact), 0.7 * exp(-2 * z * angle / side), 1e-10, 0.7);
    assert_relative(r.time, duration, 1e-6);
    assert_relative(r.overlap, overlap, 1e-6);
    assert_near(leaving_speed(&k, &r), 0.7 * exp(-2 * z * angle / side), 1e-6, 0.7);
  }
}

// ---- orders of convergence ----

enum { REFINEMENTS = 5, PHASES = 8 };

// Order of the leaving speed, from its r.m.s. error over PHASES places of the touching within a step. The steps do not
// divide the duration: where they did, errors of beginning and end could cancel. *finest: worst error at the finest dt.
static double impact_order(const ode_contact *k, double duration, int coarsest, double *finest) {
  double dt[REFINEMENTS], error[REFINEMENTS];
  ode_result exact = ode_solve(k, duration, HUGE_VAL);
  for (int n = 0; n < REFINEMENTS; n++) {
    double sum = 0, worst = 0;
    dt[n] = duration / (ldexp(coarsest, n) + 0.37);
    for (int phase = 0; phase < PHASES; phase++) {
      ode_result r = contact_run(k, (phase + 0.5) / PHASES * dt[n], dt[n]);
      double off = leaving_speed(k, &r) - leaving_speed(k, &exact);
      sum += off * off / PHASES;
      worst = fmax(worst, fabs(off));
    }
    error[n] = sqrt(sum);
    *finest = worst;
  }
  return fitted_order(dt, error, REFINEMENTS);
}

// ORDER: whole impacts at 1 m/s. The step rule is of second order between touching and parting; what happens within the
// step of the touching sets the rest (Euler-Maclaurin with an end point singularity t^p gives dt^(p+1)):
// elastic Hertz, force t^1.5: 2.5 (the term of dt^2 returns to zero as the path out mirrors the path in);
// elastic linear, t^1: 2; damped Hertz, t^0.5: 1.5; damped linear, a jump: 1. All but the last within 1e-6.
static void test_order_of_impacts(void **state) {
  (void)state;
  double finest, duration;
  ode_contact k = head_on(true, false, 1);
  duration = elastic_duration(&k, 1);
  assert_near(impact_order(&k, duration, 50, &finest), 2.5, 0.1, 1);
  assert_true(finest < 1e-7);
  double t = k.length;
  k.C = k.K * t;
  assert_near(impact_order(&k, duration, 400, &finest), 1.5, 0.1, 1);
  assert_true(finest < 1e-6);
  k.C = 10 * k.K * t;
  assert_near(impact_order(&k, duration, 400, &finest), 1.5, 0.1, 1);
  assert_true(finest < 1e-6);
  k = head_on(false, false, 1);
  duration = elastic_duration(&k, 1);
  assert_near(impact_order(&k, duration, 100, &finest), 2, 0.1, 1);
  assert_true(finest < 1e-6);
  k.C = 0.4 * sqrt(k.K * contact_mass(&k));
  assert_near(impact_order(&k, duration, 100, &finest), 1, 0.1, 1);
}

// Reference: with steps fine enough the jump of the linear dashpot, too, comes within 1e-6, at its worst phase.
static void test_linear_jump_vanishes(void **state) {
  (void)state;
  ode_contact k = head_on(false, true, 1);
  double duration = elastic_duration(&k, 1), dt = duration / 400000;
  k.C = 0.4 * sqrt(k.K * contact_mass(&k));
  ode_result exact = ode_solve(&k, duration, HUGE_VAL), r = contact_run(&k, 0.99 * dt, dt);
  assert_near(leaving_speed(&k, &r), leaving_speed(&k, &exact), 1e-6, 1);
}

// Error of place and velocity of two grains at a given time, over the largest overlap and 1 m/s.
static double error_at(const ode_contact *k, double time, int steps) {
  physics p;
  ode_result exact = ode_solve(k, time, time);
  contact_open(&p, k, 0, time / steps);
  for (int n = 0; n < steps; n++)
    physics_step(&p);
  const tal_grains *g = &p.sim->grains;
  double off = g->vx[1] - g->vx[0] - leaving_speed(k, &exact);
  double shift = contact_state(&p, k).overlap - exact.overlap_last;
  physics_close(&p);
  return fmax(fabs(off), fabs(shift) / k->length);
}

// ORDER: within a contact (half-way in to past the turning point) nothing is singular: second order in place and
// velocity, elastic and damped, both laws; 1e-6 of the reference and below.
static void test_order_within_contact(void **state) {
  (void)state;
  for (int hertz = 0; hertz < 2; hertz++) {
    for (double damping = 0; damping < 3; damping += 0.5) {
      ode_contact k = head_on(hertz, false, 1);
      double duration = elastic_duration(&k, 1), dt[REFINEMENTS], error[REFINEMENTS];
      k.overlap = 0.5 * k.length;
      k.j.x -= k.overlap;
      k.C = damping * k.K * k.length * (hertz ? 1 : 0.5);
      for (int n = 0; n < REFINEMENTS; n++) {
        dt[n] = 0.4 * duration / (100 << n);
        error[n] = error_at(&k, 0.4 * duration, 100 << n);
      }
      assert_near(fitted_order(dt, error, REFINEMENTS), 2, 0.05, 1);
      assert_true(error[REFINEMENTS - 1] < 1e-6);
    }
  }
}

// ---- walls ----

// ROUND: a grain that meets its mirror image feels, step for step, the normal force of a rigid wall.
static void test_mirror(void **state) {
  (void)state;
  for (double damping = 0; damping < 1e-4; damping = damping * 10 + 1e-7) {
    ode_contact wall = head_on(true, true, 0.8), pair = wall;
    pair.plane = false;
    pair.j = pair.i;
    pair.j.y = -pair.i.y;
    pair.j.vy = -pair.i.vy;
    double deep = wall.length, dt = elastic_duration(&wall, 0.8) / 500;
    pair.K = wall.K / sqrt(8); // same material: K d^1.5 at twice the overlap
    wall.C = damping * wall.K;
    pair.C = damping * pair.K;
    assert_relative(contact_young(&wall), contact_young(&pair), 1e-14);
    physics a, b;
    contact_open(&a, &wall, 0.4 * dt, dt);
    contact_open(&b, &pair, 0.4 * dt, dt);
    double largest = wall.K * deep * sqrt(deep);
    for (int n = 0; n < 700; n++) {
      physics_step(&a);
      physics_step(&b);
      assert_near(b.sim->grains.fy[0], a.sim->grains.fy[0], 1e-10, largest);
      assert_near(b.sim->grains.fy[1], -a.sim->grains.fy[0], 1e-10, largest);
      assert_near(b.sim->grains.vy[0], a.sim->grains.vy[0], 1e-10, 0.8);
    }
    assert_true(a.sim->grains.vy[0] > 0);
    physics_close(&a);
    physics_close(&b);
  }
}

// ROUND: a wall that moves into a grain at rest gives it what the grain gets from a wall at rest.
static void test_moving_wall(void **state) {
  (void)state;
  ode_contact k = head_on(true, true, 0.8);
  k.C = 1e-6 * k.K;
  double duration = elastic_duration(&k, 0.8), dt = duration / 500;
  ode_result still = contact_run(&k, 0.4 * dt, dt);
  physics p;
  physics_open(&p,
               "grains: {list: [{x: 0, y: %.17g, r: 1e-3, mass: 1e-5, inertia: 5e-12}]}\n"
               "material: {young: %.17g, poisson: %.17g, damping: 1e-6}\nintegrator: {dt: %.17g}\n"
               "walls: [{from: [-1e3, 0], to: [1e3, 0], velocity: [0, 0.8], young: .inf}]\n"
               "stages: [{kind: free, duration: %.17g}]\n",
               1e-3 + 0.4 * dt * 0.8, contact_young(&k), contact_poisson, dt, 1.2 * duration);
  physics_to_end(&p);
  assert_relative(p.sim->grains.vy[0], still.vy[0] + 0.8, 1e-10);
  physics_close(&p);
}

// ---- rest ----

typedef struct rest {
  double young, poisson;           // of the grains
  double wall_young, wall_poisson; // of the wall
  double r, mass, gravity;
} rest;

// K of eq (2), from the compliances of the two sides.
static double hertz_stiffness(double compliance, double reduced) {
  return 4.0 / 3 * sqrt(reduced) / compliance;
}

// Two grains, one on the other, on a wall, damped about critically until they rest.
static void check_column(const rest *c) {
  double grain = (1 - c->poisson * c->poisson) / c->young;
  double wall = (1 - c->wall_poisson * c->wall_poisson) / c->wall_young, weight = c->mass * c->gravity;
  double k_wall = hertz_stiffness(grain + wall, c->r), k_pair = hertz_stiffness(2 * grain, c->r / 2);
  double d_wall = pow(2 * weight / k_wall, 2.0 / 3), d_pair = pow(weight / k_pair, 2.0 / 3);
  double w = sqrt(1.5 * k_wall * sqrt(d_wall) / c->mass), dt = 0.01 / w;
  physics p;
  char wall_young[40];
  snprintf(wall_young, sizeof wall_young, isinf(c->wall_young) ? ".inf" : "%.17g", c->wall_young);
  physics_open(&p,
               "grains: {list: [{x: 0, y: %.17g, r: %.17g, mass: %.17g}, {x: 0, y: %.17g, r: %.17g, mass: %.17g}]}\n"
               "material: {young: %.17g, poisson: %.17g, density: 1, damping: %.17g}\ngravity: [0, %.17g]\n"
               "walls: [{from: [-1, 0], to: [1, 0], young: %s, poisson: %.17g}]\n"
               "integrator: {dt: %.17g}\nstages: [{kind: free, duration: %.17g}]\n",
               c->r - 0.8 * d_wall, c->r, c->mass, 3 * c->r - 0.8 * d_wall - d_pair, c->r, c->mass, c->young,
               c->poisson, 3 / w, -c->gravity, wall_young, c->wall_poisson, dt, 200 / w);
  physics_to_end(&p);
  const tal_grains *g = &p.sim->grains;
  double round = 100 * 2.2e-16 * c->r; // places stand still once they creep by under half an ulp a step: / (w dt)
  assert_near(c->r - g->y[0], d_wall, 1e-11 + round / d_wall, d_wall);
  assert_near(2 * c->r - (g->y[1] - g->y[0]), d_pair, 1e-11 + 3 * round / d_pair, d_pair);
  assert_true(fabs(g->vy[0]) * dt < 2.2e-16 * c->r);
  physics_close(&p);
}

// Closed form: overlaps (2 m g / K)^(2/3) and (m g / K)^(2/3) of a column of two, over three decades of weight and of
// the wall's modulus (the wall's formula is the grains' with an infinite radius; a wall of another Poisson's ratio
// too).
static void test_rest(void **state) {
  (void)state;
  for (double gravity = 0.1; gravity < 200; gravity *= 10)
    for (double stiffer = 0.03; stiffer < 50; stiffer *= 10)
      check_column(&(rest){1e8, 0.3, 1e8 * stiffer, 0.1, 1e-3, 1e-5, gravity});
  check_column(&(rest){1e8, 0.3, HUGE_VAL, 0.3, 1e-3, 1e-5, 9.81});
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_elastic_hertz),        cmocka_unit_test(test_elastic_linear),
      cmocka_unit_test(test_damped_hertz),         cmocka_unit_test(test_linear_restitution),
      cmocka_unit_test(test_hertz_restitution),    cmocka_unit_test(test_hertz_other_speeds),
      cmocka_unit_test(test_order_to_toolbox),     cmocka_unit_test(test_linear_contact),
      cmocka_unit_test(test_order_of_impacts),     cmocka_unit_test(test_linear_jump_vanishes),
      cmocka_unit_test(test_order_within_contact), cmocka_unit_test(test_mirror),
      cmocka_unit_test(test_moving_wall),          cmocka_unit_test(test_rest)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
