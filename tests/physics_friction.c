// Friction of single contacts: oblique impact against a high-order reference, sliding to rest, creep and hold on an
// incline; closed forms over ranges, orders of convergence.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "physics_contact.h"

// ---- oblique impact ----

// Grain 0 hits a plane, or grain 1 along a line at 0.7 rad, at 1 m/s; across it moves at `tangential`, with spins.
static ode_contact oblique(bool hertz, bool plane, double tangential, double spin) {
  ode_contact k = {.hertz = hertz, .plane = plane, .K = hertz ? 1e7 : 1e5, .mu = 0.3};
  double c = cos(0.7), s = sin(0.7);
  if (plane) {
    k.i = (ode_grain){.y = 1e-3, .r = 1e-3, .vy = -1, .vx = tangential, .omega = spin, .mass = 1e-5, .inertia = 5e-12};
  } else {
    k.i = (ode_grain){.x = -1e-3 * c, .y = -1e-3 * s, .r = 1e-3, .omega = spin, .mass = 1e-5, .inertia = 5e-12};
    k.i.vx = 0.4 * c - tangential * s;
    k.i.vy = 0.4 * s + tangential * c;
    k.j = (ode_grain){.x = 1.5e-3 * c, .y = 1.5e-3 * s, .r = 1.5e-3, .mass = 3e-5, .inertia = 3e-11};
    k.j.vx = -0.6 * c;
    k.j.vy = -0.6 * s;
    k.j.omega = -0.3 * spin;
  }
  k.length = hertz ? pow(1.25 * contact_mass(&k) / k.K, 0.4) : sqrt(contact_mass(&k) / k.K);
  return k;
}

static double duration(const ode_contact *k) {
  return (k->hertz ? 2.9433 : TAL_PI) * k->length;
}

// Viscous part of the normal force, a fraction of the elastic one.
static void damp(ode_contact *k, double fraction) {
  k->C = fraction * k->K * k->length;
}

// The linear laws jump at touching (dashpot: the force; spring: its rate): where that is not the point, the contact
// begins a hair deep, so that the jump falls on no step.
static void begin_deep(ode_contact *k, double depth) {
  k->overlap = depth;
  if (k->plane)
    k->i.y -= depth;
  k->j.x -= depth * cos(0.7);
  k->j.y -= depth * sin(0.7);
}

static double larger(double a, double b) {
  return a > b ? a : isnan(a) ? a : b;
} // not a number stays it

// Largest error of velocities and rim speeds [m/s].
static double difference(const ode_contact *k, const ode_result *a, const ode_result *b) {
  double worst = 0;
  for (int g = 0; g < (k->plane ? 1 : 2); g++) {
    worst = larger(fabs(a->vx[g] - b->vx[g]), worst);
    worst = larger(fabs(a->vy[g] - b->vy[g]), worst);
    worst = larger((g ? k->j.r : k->i.r) * fabs(a->w[g] - b->w[g]), worst);
  }
  return worst;
}

typedef struct regime {
  bool slides, sticks;
} regime;

// The engine's state after the impact within 1e-6 m/s of the reference's; which regimes the contact went through.
static regime check_impact(ode_contact k, int steps) {
  if (!k.hertz)
    begin_deep(&k, 1e-9 * k.length);
  double time = duration(&k), dt = time / (steps + 0.37);
  ode_result exact = ode_solve(&k, time, HUGE_VAL), r = contact_run(&k, k.hertz ? 0.4 * dt : 0, dt);
  double error = difference(&k, &r, &exact);
  if (!(error <= 1e-6))
    fail_msg("%s %s C %g law %d c %g: off by %g m/s", k.plane ? "plane" : "pair", k.hertz ? "hertz" : "linear", k.C,
             k.kind, k.c, error);
  return (regime){exact.sliding > 0, exact.sticking > 0};
}

// Reference: the planar problem with regularised friction, three degrees of freedom per grain: grain and plane, two
// grains; both normal laws, damped or not; c = 1 (viscous), 2, 20; slip that stops within the contact (slow) and slip
// that lasts (fast), grains spinning.
static void test_oblique_regularised(void **state) {
  (void)state;
  static const double exponents[] = {1, 2, 20};
  int stuck = 0, slid = 0;
  for (int variant = 0; variant < 16; variant++) {
    bool fast = variant & 1;
    ode_contact k = oblique(variant & 2, variant & 4, fast ? 3 : 0.2, fast ? 200 : -50);
    damp(&k, variant & 8 ? 0.3 : 0);
    k.kind = ODE_REGULARISED;
    k.vR = 0.05;
    for (int e = 0; e < 3; e++) {
      k.c = exponents[e];
      regime seen = check_impact(k, 10000);
      stuck += seen.sticks;
      slid += seen.slides && !seen.sticks;
    }
  }
  assert_true(stuck >= 8 && slid >= 8);
}

// Reference: the same with the tangential spring, slip that sticks, slides, and turns back.
static void test_oblique_spring(void **state) {
  (void)state;
  int stuck = 0, slid = 0, both = 0;
  static const double across[] = {0.05, 0.2, 0.5, 3};
  for (int variant = 0; variant < 32; variant++) {
    double tangential = across[variant & 3];
    ode_contact k = oblique(variant & 4, variant & 8, tangential, tangential > 1 ? 200 : -50);
    damp(&k, variant & 16 ? 0.3 : 0);
    k.kind = ODE_SPRING;
    k.ratio = 0.8235;
    regime seen = check_impact(k, 16000);
    both += seen.sticks && seen.slides;
    stuck += seen.sticks;
    slid += seen.slides;
  }
  assert_true(both >= 8 && stuck >= 16 && slid >= 16);
}

// ROUND: a spring-friction contact that slides from first to last carries tangential mu times normal momentum;
// its torque acts with an arm between r and r less the largest overlap.
static void test_gross_sliding(void **state) {
  (void)state;
  for (double tangential = 3; tangential < 1e3; tangential *= 4) {
    ode_contact k = oblique(true, true, tangential, 0);
    k.kind = ODE_SPRING;
    k.ratio = 0.8235;
    ode_result r = contact_run(&k, 0, duration(&k) / 500);
    assert_near(tangential - r.vx[0], 0.3 * (r.vy[0] + 1), 1e-11, 1);
    double arm = r.w[0] * k.i.inertia / ((r.vx[0] - tangential) * k.i.mass);
    assert_true(arm < k.i.r && arm > k.i.r - k.length);
  }
}

enum { REFINEMENTS = 5, PHASES = 4 };

// Order of the state after the impact, from r.m.s. errors over places of the touching within a step.
static double order_after(const ode_contact *k, int coarsest) {
  double dt[REFINEMENTS], error[REFINEMENTS];
  ode_result exact = ode_solve(k, duration(k), HUGE_VAL);
  for (int n = 0; n < REFINEMENTS; n++) {
    dt[n] = duration(k) / (ldexp(coarsest, n) + 0.37);
    double sum = 0;
    for (int phase = 0; phase < PHASES; phase++) {
      ode_result r = contact_run(k, (phase + 0.5) / PHASES * dt[n], dt[n]);
      double off = difference(k, &r, &exact);
      sum += off * off / PHASES;
    }
    error[n] = sqrt(sum);
  }
  return fitted_order(dt, error, REFINEMENTS);
}

// Order of the state at 0.6 of the duration of a contact that begins 0.3 of its largest overlap deep.
static double order_within(ode_contact k, double *finest) {
  double dt[REFINEMENTS], error[REFINEMENTS], time = 0.6 * duration(&k);
  begin_deep(&k, 0.3 * k.length);
  ode_result exact = ode_solve(&k, duration(&k), time);
  for (int n = 0; n < REFINEMENTS; n++) {
    int steps = 100 << n;
    physics p;
    ode_result r = {0};
    dt[n] = time / steps;
    contact_open(&p, &k, 0, dt[n]);
    for (int step = 0; step < steps; step++)
      physics_step(&p);
    contact_motion(&p, &r);
    physics_close(&p);
    error[n] = difference(&k, &r, &exact);
  }
  *finest = error[REFINEMENTS - 1];
  return fitted_order(dt, error, REFINEMENTS);
}

// ORDER: sliding and viscous friction within a contact are smooth: second order, with damping too.
static void test_order_of_smooth_friction(void **state) {
  (void)state;
  for (int variant = 0; variant < 8; variant++) {
    double finest;
    ode_contact k = oblique(variant & 1, variant & 2, 3, 200);
    k.kind = ODE_REGULARISED;
    k.vR = 0.05;
    k.c = variant & 4 ? 20 : 1;
    damp(&k, 0.3);
    assert_near(order_within(k, &finest), 2, 0.1, 1);
    assert_true(finest < 1e-6);
  }
}

// ORDER: whole impacts. Regularised, Hertz: the touching leaves dt^1.5 with damping (force as t^0.5). Spring, Hertz:
// the tangential stiffness as t^0.5 leaves dt^1.5 in the sticking contact; the slip over a step is taken with the lever
// arms of its end, which adds a small term of first order. Spring, linear: the stiffness is there at once and the
// slip of the whole step counts: first order.
static void test_order_of_impacts(void **state) {
  (void)state;
  ode_contact k = oblique(true, false, 3, 200);
  k.kind = ODE_REGULARISED;
  k.vR = 0.05;
  k.c = 20;
  assert_near(order_after(&k, 100), 2, 0.15, 1);
  damp(&k, 0.3);
  assert_near(order_after(&k, 400), 1.5, 0.1, 1);
  k = oblique(true, true, 0.2, -50);
  k.kind = ODE_SPRING;
  k.ratio = 0.8235;
  double order = order_after(&k, 100);
  assert_true(order > 1.3);
  k = oblique(false, true, 0.2, -50);
  k.kind = ODE_SPRING;
  k.ratio = 0.8235;
  order = order_after(&k, 100);
  assert_true(order > 0.95);
}

// ---- a grain that slides and does not turn ----

typedef struct slider {
  double exponent, vR; // regularised friction
  double friction;
  double gravity[2];
  double speed; // along the floor, at the start
  double belt;  // speed of the floor
  double dt, duration;
  const char *tangential; // other law in place of the regularised one
} slider;

static const double slider_radius = 1e-3, slider_overlap = 1e-5, slider_mass = 1e-5;

// A grain at rest on its elastic overlap on a rigid floor; the floor's friction is not the grains'.
static void slider_open(physics *p, const slider *s) {
  double weight = -slider_mass * s->gravity[1],
         modulus = 0.75 * weight * pow(slider_overlap, -1.5) / sqrt(slider_radius);
  char law[200];
  snprintf(law, sizeof law, "tangential: regularised, exponent: %.17g, vR: %.17g", s->exponent, s->vR);
  physics_open(p,
               "grains: {list: [{x: 0, y: %.17g, r: %.17g, mass: %.17g, vx: %.17g}]}\nrotation: false\n"
               "material: {young: %.17g, poisson: 0, friction: 0.9, density: 1}\ncontact: {%s}\n"
               "gravity: [%.17g, %.17g]\nintegrator: {dt: %.17g}\nstages: [{kind: free, duration: %.17g}]\n"
               "walls: [{from: [-100, 0], to: [100, 0], velocity: [%.17g, 0], young: .inf, friction: %.17g}]\n",
               slider_radius - slider_overlap, slider_radius, slider_mass, s->speed, modulus,
               s->tangential ? s->tangential : law, s->gravity[0], s->gravity[1], s->dt, s->duration, s->belt,
               s->friction);
}

// v' = -mu g (v/vR)^(1/c): v^(1 - 1/c) falls linearly and is gone at t_stop.
static double stopping_time(const slider *s) {
  double q = 1 - 1 / s->exponent;
  return pow(s->speed, q) * pow(s->vR, 1 / s->exponent) / (q * -s->friction * s->gravity[1]);
}

static double sliding_speed(const slider *s, double time) {
  if (s->exponent == 1)
    return s->speed * exp(s->friction * s->gravity[1] * time / s->vR);
  return s->speed * pow(1 - time / stopping_time(s), 1 / (1 - 1 / s->exponent));
}

// Closed form: the speed all the way to rest, and the time of stopping, over exponents and three decades of vR. Then
// explicit friction chatters by no more than the slip that the full force makes in a step.
static void test_stopping(void **state) {
  (void)state;
  static const double exponents[] = {1.5, 2, 3, 5, 20, 100};
  for (int e = 0; e < 6; e++) {
    for (double vR = 1e-3; vR < 2; vR *= 10) {
      slider s = {.exponent = exponents[e], .vR = vR, .friction = 0.5, .gravity = {0, -9.81}, .speed = 0.1};
      double stop = stopping_time(&s), time = 0;
      s.dt = stop / 4000;
      s.duration = 1.1 * stop;
      physics p;
      slider_open(&p, &s);
      const tal_grains *g = &p.sim->grains;
      for (int step = 1; step <= 3999; step++) {
        physics_step(&p);
        time = p.sim->run.time;
        double exact = sliding_speed(&s, time);
        if (exact > 1e-2 * s.speed)
          assert_near(g->vx[0], exact, 1e-5, s.speed);
      }
      physics_to_end(&p);
      double step = 0.5 * 9.81 * s.dt; // change of speed by the Coulomb force
      assert_true(fabs(g->vx[0]) < step);
      physics_close(&p);
    }
  }
}

// Closed form, c = 1: exponential approach to rest with the time vR / (mu g).
static void test_viscous_stopping(void **state) {
  (void)state;
  for (double vR = 0.01; vR < 20; vR *= 10) {
    double tau = vR / (0.5 * 9.81);
    slider s = {.exponent = 1, .vR = vR, .friction = 0.5, .gravity = {0, -9.81}, .speed = 0.1};
    s.dt = fmin(1e-4, tau / 2000);
    s.duration = fmin(5 * tau, 0.1);
    physics p;
    slider_open(&p, &s);
    physics_to_end(&p);
    assert_near(p.sim->grains.vx[0], sliding_speed(&s, p.sim->run.time), 1e-6, s.speed);
    physics_close(&p);
  }
}

// ORDER: the speed at 0.6 of the stopping time is of second order, from 1/50 to 1/800 of that time.
static void test_order_of_sliding(void **state) {
  (void)state;
  static const double exponents[] = {1.5, 3, 20};
  for (int e = 0; e < 3; e++) {
    slider s = {.exponent = exponents[e], .vR = 0.05, .friction = 0.5, .gravity = {0, -9.81}, .speed = 0.1};
    double dt[REFINEMENTS], error[REFINEMENTS];
    s.duration = 0.6 * stopping_time(&s);
    for (int n = 0; n < REFINEMENTS; n++) {
      physics p;
      s.dt = dt[n] = s.duration / (30 << n);
      slider_open(&p, &s);
      physics_to_end(&p);
      error[n] = fabs(p.sim->grains.vx[0] - sliding_speed(&s, s.duration));
      physics_close(&p);
    }
    assert_near(fitted_order(dt, error, REFINEMENTS), 2, 0.05, 1);
  }
}

// ROUND: a belt that starts under a grain at rest drives it as a floor at rest stops a grain that slides.
static void test_belt(void **state) {
  (void)state;
  slider floor = {.exponent = 20, .vR = 0.05, .friction = 0.5, .gravity = {0, -9.81}, .speed = 0.1, .dt = 1e-5};
  floor.duration = 0.5 * stopping_time(&floor);
  slider belt = floor;
  belt.speed = 0;
  belt.belt = -0.1;
  physics a, b;
  slider_open(&a, &floor);
  slider_open(&b, &belt);
  while (!tal_sim_done(a.sim)) {
    physics_step(&a);
    physics_step(&b);
    assert_near(b.sim->grains.vx[0], a.sim->grains.vx[0] - 0.1, 1e-12, 0.1);
  }
  physics_close(&a);
  physics_close(&b);
}

// Closed form: on an incline a grain that cannot turn creeps at vR (tan(angle) / mu)^c, below and above the friction
// angle; exponents, angles and three decades of vR.
static void test_creep(void **state) {
  (void)state;
  static const double exponents[] = {1, 2, 5, 20};
  for (int e = 0; e < 4; e++) {
    for (double share = 0.35; share < 1.2; share += 0.25) {
      for (double vR = 1e-5; vR < 0.02; vR *= 10) {
        double angle = atan(0.5 * share), slip = vR * pow(share, exponents[e]);
        double relaxation = exponents[e] * slip / (9.81 * sin(angle));
        slider s = {.exponent = exponents[e], .vR = vR, .friction = 0.5};
        s.gravity[0] = 9.81 * sin(angle);
        s.gravity[1] = -9.81 * cos(angle);
        s.dt = fmin(0.1 * relaxation, 4e-4);
        s.duration = 40 * relaxation;
        physics p;
        slider_open(&p, &s);
        physics_to_end(&p);
        assert_relative(p.sim->grains.vx[0], slip, 1e-9);
        physics_close(&p);
      }
    }
  }
}

static const char spring_law[] = "tangential: spring, tangential_ratio: 0.8";

// Frequency [rad/s] of the slider on its tangential spring.
static double spring_frequency(double gravity_down) {
  return sqrt(0.8 * 1.5 * gravity_down / slider_overlap); // k_t = 0.8 * 3/2 fn / d
}

// Closed form: below the friction angle the spring holds: x = g sin / w^2 (1 - cos wt), no creep.
static void test_hold(void **state) {
  (void)state;
  for (double angle = 0.02; angle < 0.24; angle += 0.05) {
    slider s = {.friction = 0.5, .gravity = {9.81 * sin(angle), -9.81 * cos(angle)}, .tangential = spring_law};
    double w = spring_frequency(-s.gravity[1]), sag = s.gravity[0] / (w * w);
    s.dt = 2e-3 / w;
    s.duration = 40 / w;
    physics p;
    slider_open(&p, &s);
    while (!tal_sim_done(p.sim)) {
      physics_step(&p);
      assert_near(p.sim->grains.x[0], sag * (1 - cos(w * p.sim->run.time)), 1e-5, sag);
    }
    physics_close(&p);
  }
}

// Closed form: beyond the friction angle the spring yields when mu g cos = w^2 x, then g (sin - mu cos) accelerates.
static void test_slide_down(void **state) {
  (void)state;
  for (double angle = 0.6; angle < 1.4; angle += 0.2) {
    slider s = {.friction = 0.5, .gravity = {9.81 * sin(angle), -9.81 * cos(angle)}, .tangential = spring_law};
    double w = spring_frequency(-s.gravity[1]), down = s.gravity[0], hold = -0.5 * s.gravity[1];
    double yield = acos(1 - hold / down) / w, speed = down / w * sin(w * yield);
    s.dt = 1e-3 / w;
    s.duration = 20 / w;
    physics p;
    slider_open(&p, &s);
    physics_to_end(&p);
    double exact = speed + (down - hold) * (p.sim->run.time - yield);
    assert_relative(p.sim->grains.vx[0], exact, 1e-6);
    physics_close(&p);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_oblique_regularised),
                                     cmocka_unit_test(test_oblique_spring),
                                     cmocka_unit_test(test_gross_sliding),
                                     cmocka_unit_test(test_order_of_smooth_friction),
                                     cmocka_unit_test(test_order_of_impacts),
                                     cmocka_unit_test(test_stopping),
                                     cmocka_unit_test(test_viscous_stopping),
                                     cmocka_unit_test(test_order_of_sliding),
                                     cmocka_unit_test(test_belt),
                                     cmocka_unit_test(test_creep),
                                     cmocka_unit_test(test_hold),
                                     cmocka_unit_test(test_slide_down)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
