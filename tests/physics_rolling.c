// Turning grains: from sliding to rolling, rolling down an incline, gears; closed forms over shapes and both friction
// laws.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "physics.h"

// ---- one grain on a floor ----

// A grain at rest on its elastic overlap d on a rigid floor: the lever arm is r - d throughout.
typedef struct roller {
  bool sphere, hertz;
  bool spring;          // else regularised
  double exponent, vR;  // regularised friction
  double speed, spin;   // at the start
  double along, down;   // gravity
  double dt, duration;  // filled in by the tests
  double mass, inertia; // [kg, kg m^2] from here on filled in by roller_prepare
  double arm;           // [m]
  double slip_mass;     // [kg] force over rate of slip: 1 / (1/m + arm^2/I)
  double tangential;    // [N/m] k_t
} roller;

static const double radius = 1e-3, overlap = 1e-5, density = 2500, thickness = 1.7e-3, friction = 0.4, ratio = 0.8;

static void roller_prepare(roller *s) {
  s->mass = density * TAL_PI * radius * radius * (s->sphere ? 4.0 / 3 * radius : thickness);
  s->inertia = (s->sphere ? 0.4 : 0.5) * s->mass * radius * radius;
  s->arm = radius - overlap;
  s->slip_mass = 1 / (1 / s->mass + s->arm * s->arm / s->inertia);
  s->tangential = ratio * (s->hertz ? 1.5 : 1) * s->mass * s->down / overlap;
}

static void roller_open(physics *p, const roller *s) {
  double weight = s->mass * s->down;
  char normal[100], law[200];
  snprintf(normal, sizeof normal, "normal: linear, stiffness: %.17g", weight / overlap);
  snprintf(law, sizeof law, "tangential: regularised, exponent: %.17g, vR: %.17g", s->exponent, s->vR);
  if (s->hertz)
    snprintf(normal, sizeof normal, "normal: hertz");
  if (s->spring)
    snprintf(law, sizeof law, "tangential: spring, tangential_ratio: %.17g", ratio);
  physics_open(p,
               "grains: {shape: %s, thickness: %.17g, list: [{x: 0, y: %.17g, r: %.17g, vx: %.17g, omega: %.17g}]}\n"
               "material: {young: %.17g, poisson: 0, friction: %.17g, density: %.17g}\ncontact: {%s, %s}\n"
               "gravity: [%.17g, %.17g]\nintegrator: {dt: %.17g}\nstages: [{kind: free, duration: %.17g}]\n"
               "walls: [{from: [-100, 0], to: [100, 0], young: .inf}]\n",
               s->sphere ? "sphere" : "disk", thickness, radius - overlap, radius, s->speed, s->spin,
               0.75 * weight * pow(overlap, -1.5) / sqrt(radius), friction, density, normal, law, s->along, -s->down,
               s->dt, s->duration);
}

// Speed and spin after a tangential impulse [N s] against the motion.
static double speed_after(const roller *s, double impulse) {
  return s->speed - impulse / s->mass;
}
static double spin_after(const roller *s, double impulse) {
  return s->spin - impulse * s->arm / s->inertia;
}

// Impulse [N s] of spring friction on a contact that slips at `slip` > 0: the spring loads (a quarter of an oscillation
// cut short), slides at the Coulomb force `cap` until the slip ends, then oscillates about sticking, undamped.
static double spring_impulse(double slip, double slip_mass, double cap, double stiffness, double time) {
  double w = sqrt(stiffness / slip_mass), full = slip * stiffness / w;
  double loaded = asin(cap / full) / w, left = slip * cos(w * loaded);
  double stops = loaded + slip_mass * left / cap;
  if (time < loaded)
    return full / w * (1 - cos(w * time));
  double impulse = full / w * (1 - cos(w * loaded));
  if (time < stops)
    return impulse + cap * (time - loaded);
  return impulse + cap * (stops - loaded) + cap / w * sin(w * (time - stops));
}

// Closed form: disks and spheres, both normal laws, thrown forward and with backspin: speed and spin at every step
// through loading, sliding and the oscillation about rolling.
static void test_spring_to_rolling(void **state) {
  (void)state;
  for (int variant = 0; variant < 8; variant++) {
    roller s = {.sphere = variant & 1, .hertz = variant & 2, .spring = true, .down = 9.81, .speed = 0.05};
    s.spin = variant & 4 ? 30 : 0;
    roller_prepare(&s);
    double slip = s.speed + s.spin * s.arm, stop = s.slip_mass * slip / (friction * s.mass * s.down);
    s.dt = stop / 20000;
    s.duration = 1.5 * stop;
    physics p;
    roller_open(&p, &s);
    assert_relative(p.sim->grains.mass[0], s.mass, 1e-15);
    assert_relative(p.sim->grains.inertia[0], s.inertia, 1e-15);
    while (!tal_sim_done(p.sim)) {
      physics_step(&p);
      double impulse = spring_impulse(slip, s.slip_mass, friction * s.mass * s.down, s.tangential, p.sim->run.time);
      assert_near(p.sim->grains.vx[0], speed_after(&s, impulse), 2e-6, slip);
      assert_near(p.sim->grains.omega[0] * s.arm, spin_after(&s, impulse) * s.arm, 4e-6, slip);
    }
    physics_close(&p);
  }
}

// Closed form: the regularised slip falls as slip^(1 - 1/c) does, linearly; then the grain rolls at v0 / (1 + I/(m
// a^2)), 2/3 of v0 for a disk and 5/7 for a sphere but for the overlap's share of the lever arm a.
static void test_regularised_to_rolling(void **state) {
  (void)state;
  static const double exponents[] = {2, 5, 20};
  for (int variant = 0; variant < 12; variant++) {
    roller s = {.sphere = variant & 1, .hertz = true, .down = 9.81, .speed = 0.1, .vR = variant & 2 ? 1e-3 : 0.1};
    s.exponent = exponents[variant / 4];
    roller_prepare(&s);
    double q = 1 - 1 / s.exponent, cap = friction * s.mass * s.down;
    double stop = s.slip_mass * pow(s.speed, q) * pow(s.vR, 1 - q) / (q * cap);
    s.dt = stop / 8000;
    s.duration = 1.3 * stop;
    physics p;
    roller_open(&p, &s);
    const tal_grains *g = &p.sim->grains;
    while (p.sim->run.time < 0.98 * stop) {
      physics_step(&p);
      double slip = s.speed * pow(1 - p.sim->run.time / stop, 1 / q), impulse = s.slip_mass * (s.speed - slip);
      assert_near(g->vx[0], speed_after(&s, impulse), 1e-6, s.speed);
      assert_near(g->omega[0] * s.arm, spin_after(&s, impulse) * s.arm, 1e-6, s.speed);
    }
    physics_to_end(&p);
    double rolling = s.speed / (1 + s.inertia / (s.mass * s.arm * s.arm)), chatter = cap * s.dt / s.slip_mass;
    assert_near(g->vx[0], rolling, 1, chatter);
    assert_near(g->omega[0] * s.arm, -rolling, 1, chatter);
    assert_near(rolling, s.speed * (s.sphere ? 5.0 / 7 : 2.0 / 3), 2 * overlap / radius, s.speed);
    // sliding and turning trade the same impulse, to the last bits
    assert_near(s.mass * (s.speed - g->vx[0]) * s.arm, -s.inertia * g->omega[0], 1e-10, s.inertia * rolling / s.arm);
    physics_close(&p);
  }
}

// Closed form: from rest on an incline with the spring, rolling at g sin / (1 + I/(m a^2)) on average, with the
// spring's oscillation about it, at every step.
static void test_spring_down_incline(void **state) {
  (void)state;
  for (int variant = 0; variant < 8; variant++) {
    double angle = 0.05 + 0.07 * (variant / 2);
    roller s = {.sphere = variant & 1, .hertz = true, .spring = true};
    s.along = 9.81 * sin(angle);
    s.down = 9.81 * cos(angle);
    roller_prepare(&s);
    double w = sqrt(s.tangential / s.slip_mass), hold = s.slip_mass * s.along;
    assert_true(2 * hold < friction * s.mass * s.down);
    s.dt = 1e-3 / w;
    s.duration = 20 / w;
    physics p;
    roller_open(&p, &s);
    while (!tal_sim_done(p.sim)) {
      physics_step(&p);
      double time = p.sim->run.time, impulse = hold * (time - sin(w * time) / w);
      assert_near(p.sim->grains.vx[0], s.along * time - impulse / s.mass, 1e-6, s.along / w);
      assert_near(p.sim->grains.omega[0] * s.arm, spin_after(&s, impulse) * s.arm, 1e-6, s.along / w);
    }
    physics_close(&p);
  }
}

// Closed form: with regularised friction the grain comes to roll at a steady small slip vR (ft / mu fn)^c, where
// ft = m g sin / (1 + m a^2/I) and the acceleration is what is left.
static void test_regularised_down_incline(void **state) {
  (void)state;
  for (int variant = 0; variant < 8; variant++) {
    roller s = {.sphere = variant & 1, .hertz = true, .vR = variant & 2 ? 1e-3 : 0.1, .exponent = variant & 4 ? 5 : 2};
    s.along = 9.81 * sin(0.5);
    s.down = 9.81 * cos(0.5);
    roller_prepare(&s);
    double force = s.slip_mass * s.along, slip = s.vR * pow(force / (friction * s.mass * s.down), s.exponent);
    double relaxation = s.exponent * slip * s.slip_mass / force;
    s.dt = fmin(0.02 * relaxation, 1e-4);
    s.duration = 40 * relaxation;
    physics p;
    roller_open(&p, &s);
    physics_to_end(&p);
    const tal_grains *g = &p.sim->grains;
    assert_relative(g->vx[0] + g->omega[0] * s.arm, slip, 1e-7);
    assert_relative(g->fx[0], s.mass * s.along - force, 1e-7);
    assert_relative(g->torque[0], -force * s.arm, 1e-7);
    physics_close(&p);
  }
}

// ---- gears ----

// Two grains of radii 2^-9 and 2^-10 m, held 2^-15 m into each other.
static const double gear_arms[2] = {127.0 / 65536, 63.0 / 65536};

static void gears_open(physics *p, double spin0, double spin1, bool second_fixed, double inertia, bool spring,
                       double dt, double duration) {
  physics_open(p,
               "grains: {list: [{x: 0, y: 0, r: %.17g, omega: %.17g, fixed: true},\n"
               "  {x: %.17g, y: 0, r: %.17g, omega: %.17g, fixed: %s, mass: 1e30, inertia: %.17g}]}\n"
               "material: {young: 1e7, density: 2000, friction: 0.5}\n"
               "contact: {%s}\nintegrator: {dt: %.17g, force: true}\nstages: [{kind: free, duration: %.17g}]\n",
               0x1p-9, spin0, 0x1p-9 + 0x1p-10 - 0x1p-15, 0x1p-10, spin1, second_fixed ? "true" : "false", inertia,
               spring ? "tangential: spring" : "tangential: regularised, exponent: 20, vR: 0.125", dt, duration);
}

static double gear_force(void) { // normal force
  double reduced = 0x1p-19 / (0x1p-9 + 0x1p-10), modulus = 1e7 / (2 * (1 - 0.09));
  return 4.0 / 3 * modulus * sqrt(reduced) * pow(0x1p-15, 1.5);
}

// EXACT: gears that mesh, w_i a_i = -w_j a_j, do not slip: no force across, no torque, nothing to hold them turning.
static void test_meshing_gears(void **state) {
  (void)state;
  for (int spring = 0; spring < 2; spring++) {
    physics p;
    gears_open(&p, 63 * 16, -127 * 16, true, 1, spring, 1e-5, 1e-3);
    physics_to_end(&p);
    tal_observed seen = tal_sim_observe(p.sim);
    assert_int_equal(seen.pairs->count, 1);
    assert_true(seen.pairs->slip[0] == 0 && seen.pairs->ft[0] == 0);
    assert_true(seen.grains->rtorque[0] == 0 && seen.grains->rtorque[1] == 0);
    assert_true(p.sim->run.held_work == 0);
    assert_true(seen.grains->omega[0] == 63 * 16 && seen.grains->omega[1] == -127 * 16);
    physics_close(&p);
  }
}

// Closed form: gears that turn the same way slip at the sum of their rim speeds; friction brakes both, with torques in
// the ratio of the arms.
static void test_grinding_gears(void **state) {
  (void)state;
  for (double spin = 1; spin < 1e4; spin *= 10) {
    for (int sign = -1; sign <= 1; sign += 2) {
      physics p;
      gears_open(&p, sign * spin, sign * 3 * spin, true, 1, false, 1e-5, 1e-3);
      physics_to_end(&p);
      tal_observed seen = tal_sim_observe(p.sim);
      double slip = spin * (gear_arms[0] + 3 * gear_arms[1]);
      double force = 0.5 * gear_force() * pow(slip / 0.125, 1.0 / 20);
      assert_relative(seen.pairs->slip[0], -sign * slip, 1e-13);
      assert_relative(seen.grains->rtorque[0], -sign * force * gear_arms[0], 1e-12);
      assert_relative(seen.grains->rtorque[1], -sign * force * gear_arms[1], 1e-12);
      // what holds the spins puts in what friction takes out
      tal_row row;
      tal_sim_row(p.sim, &row);
      assert_relative(row.work_held, force * slip * p.sim->run.time, 1e-12);
      assert_relative(row.dissipated_friction, row.work_held, 1e-12);
      physics_close(&p);
    }
  }
}

// Closed form: a gear that may only turn is spun up by a driven one and ends in mesh, turning the other way at the
// ratio of the arms: at every step with the spring, up to the last hundredth of the slip with the regularised law.
static void test_driven_gear(void **state) {
  (void)state;
  for (int spring = 0; spring < 2; spring++) {
    double inertia = 1e-9, drive = 64, cap = 0.5 * gear_force(), slip = drive * gear_arms[0];
    double slip_mass = inertia / (gear_arms[1] * gear_arms[1]), q = 0.95;
    double stiffness = 2 * 0.7 / 1.7 * 1.5 * gear_force() / 0x1p-15, stop = slip_mass * slip / cap;
    if (!spring)
      stop *= pow(0.125 / slip, 1 - q) / q;
    physics p;
    gears_open(&p, drive, 0, false, inertia, spring, stop / 20000, 1.4 * stop);
    const tal_grains *g = &p.sim->grains;
    while (!tal_sim_done(p.sim)) {
      physics_step(&p);
      double time = p.sim->run.time, left = 1 - time / stop;
      double impulse = spring ? spring_impulse(slip, slip_mass, cap, stiffness, time)
                              : slip_mass * slip * (left > 0 ? 1 - pow(left, 1 / q) : 1);
      if (spring || fabs(left) > 0.01)
        assert_near(-g->omega[1] * gear_arms[1], impulse / slip_mass, spring ? 2e-6 : 1e-4, slip);
    }
    assert_true(g->omega[0] == drive);
    physics_close(&p);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_spring_to_rolling),   cmocka_unit_test(test_regularised_to_rolling),
      cmocka_unit_test(test_spring_down_incline), cmocka_unit_test(test_regularised_down_incline),
      cmocka_unit_test(test_meshing_gears),       cmocka_unit_test(test_grinding_gears),
      cmocka_unit_test(test_driven_gear)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
