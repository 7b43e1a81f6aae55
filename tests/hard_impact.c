// Impacts ten thousand times as fast, restitution next to none and complete, and the small grain that must not stick
// between large ones.
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

// ---- speed ----

static const double poisson = 0.3, reduced_mass = TAL_PI / 2;

static double stiffness_of(double young) {
  return 4.0 / 3 * young / (2 * (1 - poisson * poisson)) * sqrt(0.5);
}

// Hertz: the largest overlap of two unit grains that meet at `speed`, and how long they touch.
static double deepest(double young, double speed) {
  return pow(1.25 * reduced_mass * speed * speed / stiffness_of(young), 0.4);
}

static double duration(double young, double speed) {
  return 2.943275 * deepest(young, speed) / speed;
}

typedef struct bounce {
  double restitution, overlap, momentum;
  bool stopped; // by a limit
} bounce;

// Head-on; steps of `dt` until they are apart.
static bounce collide(const char *laws, const char *scheme, double young, double speed, double dt) {
  draft *d = draft_begin();
  fprintf(d->to,
          "grains: {thickness: 1, list: [{x: -1.001, y: 0, r: 1, vx: %.17g}, {x: 1.001, y: 0, r: 1, vx: %.17g}]}\n"
          "material: {young: %.17g, poisson: 0.3, density: 1}\n%s"
          "integrator: {scheme: %s, dt: %.17g}\nstages: [{kind: free, duration: %.17g}]\n",
          0.75 * speed, -0.25 * speed, young, laws, scheme, dt, 1e7 * dt);
  engine *e = engine_start(d);
  const tal_grains *g = &e->sim->grains;
  bounce b = {0};
  tal_error err;
  for (bool met = false;;) {
    const double overlap = 2 - (g->x[1] - g->x[0]);
    b.overlap = fmax(b.overlap, overlap);
    met = met || overlap > 0;
    if ((met && overlap < 0) || (b.stopped = tal_sim_step(e->sim, &err) != TAL_OK))
      break;
  }
  b.restitution = (g->vx[1] - g->vx[0]) / speed;
  b.momentum = fabs(g->vx[0] + g->vx[1] - 0.5 * speed) / speed;
  if (b.stopped)
    assert_non_null(strstr(err.text, "limits.overlap"));
  engine_end(e);
  return b;
}

// ORDER: the closed forms of an elastic impact (largest overlap, speed of return) at speeds over four decades; twice
// the largest is stopped.
static void test_speeds(void **state) {
  (void)state;
  const double young = 1e8, fastest = sqrt(stiffness_of(young) * pow(0.45, 2.5) / (1.25 * reduced_mass));
  double overlap = 0, returned = 0, momentum = 0;
  for (double speed = fastest; speed > 0.99e-4 * fastest; speed /= 10) {
    const bounce b = collide("", "verlet", young, speed, duration(young, speed) / 1000);
    assert_false(b.stopped);
    overlap = fmax(overlap, fabs(b.overlap / deepest(young, speed) - 1));
    returned = fmax(returned, fabs(b.restitution - 1));
    momentum = fmax(momentum, b.momentum);
  }
  // one step for all, as a run has it
  const double dt = duration(young, fastest) / 20;
  const bounce slow = collide("", "verlet", young, 1e-4 * fastest, dt),
               fast = collide("", "verlet", young, fastest, dt);
  const bounce beyond = collide("", "verlet", young, 2 * fastest, dt); // some ten steps deep
  assert_true(overlap < 1e-5 && returned < 1e-6 && momentum < 1e-13 && beyond.stopped);
  assert_true(fabs(slow.restitution - 1) < 1e-5 && fabs(fast.restitution - 1) < 1e-3);
  hard_report(&(hard_row){"impact speeds over 1e4", "elastic impacts to an overlap of 0.45",
                          "largest overlap and speed of return in closed form, momentum",
                          hard_text("to %.0e, %.0e, %.0e; with 20 steps to the shortest impact %.0e", overlap, returned,
                                    momentum, fabs(fast.restitution - 1)),
                          "overlap 0.5 of the radius", "exit 3"});
}

// ---- restitution ----

// Largest relative error of the delivered restitution with T / part as the step, T the duration of an undamped impact.
static double restitution_error(double wanted, bool linear, double part) {
  static const char *const scheme[] = {"verlet", "implicit_friction"};
  const double young = 1e6, T = linear ? TAL_PI * sqrt(reduced_mass / 1e5) : duration(young, 1);
  char laws[200];
  if (linear)
    snprintf(laws, sizeof laws, "contact: {normal: linear, stiffness: 1e5, restitution: %g}\n", wanted);
  else
    snprintf(laws, sizeof laws, "contact: {restitution: %g, restitution_speed: 1}\n", wanted);
  double worst = 0;
  for (int s = 0; s < 2; s++)
    worst = fmax(worst, fabs(collide(laws, scheme[s], young, 1, T / part).restitution / wanted - 1));
  return worst;
}

// ORDER: restitution 0.02 and 1 is what two grains deliver, both laws, both schemes.
static void test_restitution(void **state) {
  (void)state;
  double least[2] = {0}, coarse[2] = {0};
  for (int linear = 0; linear < 2; linear++)
    for (int k = 0; k < 2; k++) {
      least[k] = fmax(least[k], restitution_error(k ? 1 : 0.02, linear, 10000));
      coarse[k] = fmax(coarse[k], restitution_error(k ? 1 : 0.02, linear, 100));
    }
  assert_true(least[0] < 1e-3 && coarse[0] < 0.2 && least[1] < 1e-9 && coarse[1] < 1e-5);
  hard_report(
      &(hard_row){"restitution 0.02 and 1", "step 1/100 to 1/10000 of an impact; both laws and schemes",
                  "the ratio of speeds that was asked for",
                  hard_text("0.02: to %.0e (%.0e); 1: to %.0e (%.0e)", least[0], coarse[0], least[1], coarse[1]),
                  "0 < e <= 1; dt_crit falls with the damping", "refused; stopped by dt_crit"});
}

// ---- a small grain on large ones ----

// Gravity 1, turned by `tilt` from straight down.
static void tilt_gravity(engine *e, double tilt) {
  e->scene.gravity[0] = sin(tilt);
  e->scene.gravity[1] = -cos(tilt);
}

// Half the angle between the normals of a unit grain that lies in the notch of two of radius `ratio`, half a radius
// apart.
static double notch_angle(double ratio) {
  return asin((ratio + 0.25) / (ratio + 1));
}

// Is a unit grain in the notch still there after gravity has been turned by `tilt`?
static bool rests_in_notch(double ratio, double tilt, const char *scheme) {
  const double a = notch_angle(ratio), x = ratio + 0.25;
  draft *d = draft_begin();
  fprintf(d->to,
          "grains: {thickness: 1, list: [{x: %.17g, y: 0, r: %.17g, fixed: true}, {x: %.17g, y: 0, r: %.17g, fixed: "
          "true}, {x: 0, y: %.17g, r: 1}]}\nmaterial: {young: 1e6, density: 1, friction: %.17g, damping: 5e-3}\n"
          "contact: {tangential: spring}\ngravity: [0, -1]\nintegrator: {scheme: %s, dt: 1e-3}\n"
          "stages: [{kind: free, duration: 1e9}]\n",
          -x, ratio, x, ratio, (ratio + 1) * cos(a), 0.5 / tan(a), scheme);
  engine *e = engine_start(d);
  const tal_grains *g = &e->sim->grains;
  size_t small = 0;
  while (g->inverse_mass[small] == 0)
    small++;
  const double x0 = g->x[small], y0 = g->y[small];
  const int steps = 10000;
  bool rests = true;
  for (int n = 1; n <= 2 * steps && rests; n++) {
    tilt_gravity(e, tilt * fmin(1, (double)n / steps));
    engine_step(e);
    rests = hypot(g->x[small] - x0, g->y[small] - y0) < 0.05;
  }
  engine_end(e);
  return rests;
}

// ROUND: with friction below cot a two supports hold a grain until gravity points past the lower one, and not longer,
// whatever the size ratio: statics. Positions and velocities of different instants would let a small grain stick.
static void test_sticking(void **state) {
  (void)state;
  static const double ratio[] = {1, 3, 10, 100};
  static const char *const scheme[] = {"verlet", "implicit_friction"};
  double worst = 0;
  for (int k = 0; k < 4; k++)
    for (int s = 0; s < 2; s++) {
      const double a = notch_angle(ratio[k]);
      double below = 0.9 * a, above = 1.1 * a;
      assert_true(rests_in_notch(ratio[k], below, scheme[s]) && !rests_in_notch(ratio[k], above, scheme[s]));
      for (int64_t n = hard_size(1, 6, 8); n > 0; n--) {
        const double middle = 0.5 * (below + above);
        *(rests_in_notch(ratio[k], middle, scheme[s]) ? &below : &above) = middle;
      }
      worst = fmax(worst, fabs(0.5 * (below + above) / a - 1));
    }
  assert_true(worst < 0.06);
  hard_report(&(hard_row){"small grain between large ones", "size ratio 1, 3, 10, 100; gravity turned, bisected",
                          "held until gravity points past the lower support (statics), no false sticking",
                          hard_text("the angle found is the exact one to %.0e, at every ratio, both schemes", worst),
                          "tilt = half the angle between the supports", "it rolls off"});
}

// Speed squared of a unit disk that has rolled down a fixed one of radius `ratio` from 30 to 45 degrees, over that of
// pure rolling, (4/3) g (1 + ratio) (cos 30 - cos 45).
static double rolled(double ratio, const char *scheme, double dt) {
  const double from = TAL_PI / 6, to = TAL_PI / 4;
  const double reduced = ratio / (1 + ratio), K = 4.0 / 3 * 1e6 / (2 * (1 - poisson * poisson)) * sqrt(reduced);
  const double away = 1 + ratio - pow(TAL_PI * cos(from) / K, 2.0 / 3);
  draft *d = draft_begin();
  fprintf(d->to,
          "grains: {thickness: 1, list: [{x: 0, y: 0, r: %.17g, fixed: true}, {x: %.17g, y: %.17g, r: 1}]}\n"
          "material: {young: 1e6, density: 1, friction: 2, damping: 5e-3}\ncontact: {tangential: spring}\n"
          "gravity: [0, -1]\nintegrator: {scheme: %s, dt: %.17g}\nstages: [{kind: free, duration: 1e9}]\n",
          ratio, away * sin(from), away * cos(from), scheme, dt);
  engine *e = engine_start(d);
  const tal_grains *g = &e->sim->grains;
  const size_t small = g->r[0] == 1 && g->inverse_mass[0] > 0 ? 0 : 1;
  while (atan2(g->x[small], g->y[small]) < to)
    engine_step(e);
  const double square = g->vx[small] * g->vx[small] + g->vy[small] * g->vy[small];
  const double angle = atan2(g->x[small], g->y[small]);
  engine_end(e);
  return square / (4.0 / 3 * (1 + ratio) * (cos(from) - cos(angle)));
}

// ROUND: a disk rolls down a larger one as mechanics says, to the share that the contacts give way.
static void test_rolling(void **state) {
  (void)state;
  double worst = 0;
  for (double ratio = 1; ratio < 1001; ratio *= 10)
    for (int s = 0; s < 2; s++)
      worst = fmax(worst, fabs(rolled(ratio, s ? "verlet" : "implicit_friction", 2e-3) - 1));
  assert_true(worst < 1e-2);
  hard_report(&(hard_row){"small grain rolling on a large one", "size ratio 1 to 1000, both schemes",
                          "v^2 = (4/3) g (R + r) (cos a0 - cos a), pure rolling", hard_text("to %.0e", worst),
                          "none found", "contacts give way: an overlap's share"});
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_speeds),
      cmocka_unit_test(test_restitution),
      cmocka_unit_test(test_sticking),
      cmocka_unit_test(test_rolling),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
