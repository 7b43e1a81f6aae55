// At rest under load: a column of a thousand grains, a grain wedged between two plates, creep under a steady load.
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

// Grains of unit radius, density and thickness.
static const double mass = TAL_PI, poisson = 0.3;

// K of Hertz' law for like materials and the reduced radius, from Hertz' formula.
static double hertz(double young, double reduced) {
  return 4.0 / 3 * young / (2 * (1 - poisson * poisson)) * sqrt(reduced);
}

static double overlap_under(double force, double stiffness) {
  return pow(force / stiffness, 2.0 / 3);
}

// ---- column ----

// `count` grains on each other at the overlaps at which each carries what lies on it.
static draft *column(int count, double young, double gravity, double dt, double damping) {
  draft *d = draft_begin();
  double y = 0;
  fputs("grains:\n  thickness: 1\n  list:\n", d->to);
  for (int k = 0; k < count; k++) {
    const double load = (count - k) * mass * gravity, reach = k ? 2 : 1;
    y += reach - overlap_under(load, hertz(young, k ? 0.5 : 1));
    fprintf(d->to, "  - {x: 0, y: %.17g, r: 1}\n", y);
  }
  fprintf(d->to,
          "material: {young: %.17g, density: 1, poisson: 0.3, friction: 0.3, damping: %.17g}\n"
          "contact: {tangential: spring}\ngravity: [0, %.17g]\nwalls: [{from: [-9, 0], to: [9, 0]}]\n"
          "integrator: {dt: %.17g}\nstages: [{kind: free, duration: 1e9}]\n",
          young, damping, -gravity, dt);
  return d;
}

// Largest deviation of a contact's force from the weight above it, over what one digit of the coordinates makes of it.
static double off_profile(engine *e, int count, double young, double gravity) {
  tal_sim_driving(e->sim);
  const tal_contacts *s = &e->sim->pairs;
  const tal_grains *g = &e->sim->grains;
  double worst = 0;
  for (size_t c = 0; c < s->count; c++) {
    if (s->overlap[c] <= 0)
      continue;
    const int64_t a = g->id[s->i[c]], b = g->id[s->j[c]], upper = a > b ? a : b;
    const double load = ((double)count - (double)upper) * mass * gravity, stiffness = hertz(young, 0.5);
    const double digit = 1.5 * stiffness * sqrt(overlap_under(load, stiffness)) * 2.0 * count * DBL_EPSILON;
    worst = fmax(worst, fabs(s->fe[c] + s->fd[c] - load) / digit);
  }
  return worst;
}

static double kinetic(const engine *e) {
  double sum = 0;
  const tal_grains *g = &e->sim->grains;
  for (size_t i = 0; i < g->count; i++)
    sum += 0.5 * g->mass[i] * (g->vx[i] * g->vx[i] + g->vy[i] * g->vy[i]);
  return sum;
}

// The sentence with which the scene is refused, NULL when it is not.
static const char *refused(draft *d) {
  static tal_error err;
  tal_scene scene;
  tal_sim *sim;
  draft_load(d, &scene);
  const tal_status status = tal_sim_create(&sim, &scene, &err);
  tal_sim_free(sim);
  tal_scene_clear(&scene);
  return status == TAL_OK ? NULL : err.text;
}

// ROUND: each contact carries the weight above it to the digits of the coordinates, for as long as one likes: nothing
// creeps, nothing leaves the line, and the kinetic energy stays that of the last digit.
static void test_column(void **state) {
  (void)state;
  const int count = 1000;
  const double young = 1e7, dt = 5e-4;
  const int64_t steps = hard_size(4000, 1000000, 10000000);
  engine *e = engine_start(column(count, young, 1, dt, 1e-3));
  double top = -1, first_top = 0, worst = off_profile(e, count, young, 1), early = 0, late = 0;
  for (size_t i = 0; i < e->sim->grains.count; i++)
    first_top = fmax(first_top, e->sim->grains.y[i]);
  for (int64_t n = 0; n < steps; n++) {
    engine_step(e);
    if (n % (steps / 40))
      continue;
    worst = fmax(worst, off_profile(e, count, young, 1));
    double *most = n < steps / 2 ? &early : &late;
    *most = fmax(*most, kinetic(e));
  }
  for (size_t i = 0; i < e->sim->grains.count; i++) {
    assert_true(e->sim->grains.x[i] == 0);
    top = fmax(top, e->sim->grains.y[i]);
  }
  engine_end(e);
  const double sunk = fabs(top - first_top) / (2.0 * count * DBL_EPSILON);
  // rounded places are not quite those of equilibrium: each contact may give by a digit
  assert_true(worst < 4 && sunk < 2 * sqrt(count) && late < 4 * early && early < 1e-16 * mass * count);
  const double limit = hertz(young, 0.5) * pow(0.5, 1.5) / (mass * (count - 1)); // the lowest pair is the deepest
  assert_true(refused(column(count, young, 0.999 * limit, 1e-5, 0)) == NULL);
  assert_non_null(refused(column(count, young, 1.001 * limit, 1e-5, 0)));
  hard_report(&(hard_row){hard_text("column of %d grains", count), hard_text("at rest for %.0e steps", (double)steps),
                          "each contact bears the weight above; nothing sinks, nothing heats",
                          hard_text("off by %.1g last digits of y; top sank by %.0g; kinetic energy %.0e to %.0e J",
                                    worst, sunk, early, late),
                          hard_text("%.3g times the weight: overlap 0.5 at the foot", limit),
                          "exit 3: limits.overlap names the grain"});
}

// ---- wedge ----

static draft *wedge(double degrees, double young, double friction, double dt) {
  const double angle = degrees * TAL_PI / 180, load = mass / (2 * sin(angle));
  const double overlap = overlap_under(load, hertz(young, 1)), height = (1 - overlap) / sin(angle);
  const double x = 3 * height * sin(angle), y = 3 * height * cos(angle);
  draft *d = draft_begin();
  fprintf(d->to,
          "grains: {thickness: 1, list: [{x: 0, y: %.17g, r: 1}]}\n"
          "material: {young: %.17g, density: 1, poisson: 0.3, friction: %g, damping: 2e-3}\n%s"
          "gravity: [0, -1]\nwalls: [{from: [%.17g, %.17g], to: [0, 0]}, {from: [0, 0], to: [%.17g, %.17g]}]\n"
          "integrator: {dt: %.17g}\nstages: [{kind: free, duration: 1e9}]\n",
          height, young, friction, friction > 0 ? "contact: {tangential: spring}\n" : "", -x, y, x, y, dt);
  return d;
}

// ROUND: without friction the two plates bear W / (2 sin a) each, however narrow the wedge, until the grain is squeezed
// to limits.overlap.
static void test_wedge(void **state) {
  (void)state;
  static const double degrees[] = {45, 10, 1, 0.1, 0.01, 0.001};
  const double young = 1e6;
  double worst = 0;
  for (int k = 0; k < 6; k++) {
    engine *e = engine_start(wedge(degrees[k], young, 0, 1e-4));
    engine_steps(e, (int)hard_size(2000, 200000, 1000000));
    tal_sim_driving(e->sim);
    for (int c = 0; c < 2; c++)
      worst = fmax(worst, fabs(e->sim->wall_contacts.fe[c] * 2 * sin(degrees[k] * TAL_PI / 180) / mass - 1));
    engine_end(e);
  }
  assert_true(worst < 1e-11);
  const double limit = asin(mass / (2 * hertz(young, 1) * pow(0.5, 1.5))) * 180 / TAL_PI;
  assert_true(refused(wedge(1.001 * limit, young, 0, 1e-4)) == NULL);
  assert_non_null(strstr(refused(wedge(0.999 * limit, young, 0, 1e-4)), "limits.overlap"));
  hard_report(&(hard_row){"grain wedged between two plates", "half angle 45 to 0.001 degrees, no friction",
                          "each plate bears W / (2 sin a)", hard_text("to %.0e", worst),
                          hard_text("%.2g degrees: overlap 0.5, as in closed form", limit), "exit 3: limits.overlap"});
}

// Does the grain stay when its weight is taken away bit by bit?
static bool stays_locked(double degrees, double friction) {
  engine *e = engine_start(wedge(degrees, 1e6, friction, 1e-3));
  const int steps = 20000;
  for (int n = 1; n <= 2 * steps; n++) {
    e->scene.gravity[1] = fmin(0, (double)n / steps - 1);
    engine_step(e);
  }
  int64_t grain;
  const bool stays = tal_largest_overlap(e->sim, &grain) > 0;
  engine_end(e);
  return stays;
}

// ROUND: a wedged grain locks itself where tan a < mu, and comes out where it is not.
static void test_self_locking(void **state) {
  (void)state;
  static const double friction[] = {0.1, 0.5, 2};
  double worst = 0;
  for (int k = 0; k < 3; k++) {
    const double exact = atan(friction[k]) * 180 / TAL_PI;
    double below = 0.8 * exact, above = fmin(1.2 * exact, 80);
    assert_true(stays_locked(below, friction[k]) && !stays_locked(above, friction[k]));
    for (int64_t n = hard_size(4, 10, 14); n > 0; n--) {
      const double middle = 0.5 * (below + above);
      *(stays_locked(middle, friction[k]) ? &below : &above) = middle;
    }
    worst = fmax(worst, fabs(0.5 * (below + above) / exact - 1));
  }
  assert_true(worst < 0.03);
  hard_report(&(hard_row){"wedged grain locks itself", "friction 0.1, 0.5, 2; the angle bisected",
                          "locked where tan a < mu", hard_text("the angle found is atan(mu) to %.0e", worst),
                          "tan a = mu", "the grain comes out"});
}

// ---- creep ----

// Speed of a grain that cannot roll on a slope, gravity 1, after it has settled.
static double slope_speed(double friction, double exponent, double tangent, const char *scheme, double dt) {
  draft *d = draft_begin();
  const double cosine = 1 / sqrt(1 + tangent * tangent), overlap = overlap_under(mass * cosine, hertz(1e6, 1));
  fprintf(d->to,
          "grains: {thickness: 1, list: [{x: 0, y: %.17g, r: 1}]}\n"
          "material: {young: 1e6, density: 1, poisson: 0.3, friction: %.17g, damping: 2e-3}\n"
          "contact: {tangential: regularised, exponent: %.17g, vR: 0.1}\nrotation: false\ngravity: [%.17g, %.17g]\n"
          "walls: [{from: [-99, 0], to: [99, 0]}]\nintegrator: {scheme: %s, dt: %.17g}\n"
          "stages: [{kind: free, duration: 9}]\n",
          1 - overlap, friction, exponent, tangent * cosine, -cosine, scheme, dt);
  engine *e = engine_start(d);
  engine_finish(e);
  const double speed = e->sim->grains.vx[0];
  engine_end(e);
  return speed;
}

// ROUND: under a steady load the regularised law creeps at vR (tan a / mu)^c, and at no other speed, for any exponent;
// explicit friction follows as long as its own limit (27) allows. Without friction the grain falls freely.
static void test_creep(void **state) {
  (void)state;
  static const double friction[] = {0.45, 2};
  double implicit = 0, verlet = 0, chatter = 0, stuck = 0;
  for (int m = 0; m < 2; m++) {
    const double mu = friction[m];
    for (double c = 5; c <= 20; c *= 4)
      verlet = fmax(verlet, fabs(slope_speed(mu, c, 0.8 * mu, "verlet", 1e-3) / (0.1 * pow(0.8, c)) - 1));
    for (double c = 5; c <= 125; c *= 5)
      implicit =
          fmax(implicit, fabs(slope_speed(mu, c, 0.8 * mu, "implicit_friction", 1e-3) / (0.1 * pow(0.8, c)) - 1));
    chatter = fmax(chatter, fabs(slope_speed(mu, 500, 0.8 * mu, "verlet", 1e-3)));
    stuck = fmax(stuck, fabs(slope_speed(mu, 500, 0.8 * mu, "implicit_friction", 1e-3)));
  }
  const double freely = fabs(slope_speed(0, 20, 1, "verlet", 1e-3) / 9 * sqrt(2) - 1);
  assert_true(implicit < 1e-5 && verlet < 1e-7 && stuck < 1e-15 && chatter < 2e-3 && freely < 1e-11);
  hard_report(&(hard_row){
      "creep under a steady load", "exponent c 5 to 500, friction 0, 0.45, 2",
      "speed vR (tan a / mu)^c; free fall without friction",
      hard_text("implicit to %.0e up to c = 125, %.0e m/s at 500 (1e-50 exactly); verlet to %.0e up to 20", implicit,
                stuck, verlet),
      "explicit friction: its own step (27), warned of", hard_text("verlet, c = 500: chatters at %.0e m/s", chatter)});
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_column),
      cmocka_unit_test(test_wedge),
      cmocka_unit_test(test_self_locking),
      cmocka_unit_test(test_creep),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
