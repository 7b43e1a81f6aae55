// Conservation and symmetry of the motion: momentum, angular momentum, the motion seen from a turned, mirrored or
// moving frame, and backwards in time.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "effects.h"
#include "engine.h"
#include <float.h>
#include <omp.h>

// ---- a cloud of grains that falls into itself ----

typedef struct cloud_grain {
  double x, y, r, vx, vy, omega;
} cloud_grain;

// side x side grains on a jittered grid about the origin (a power of two apart), moving inward and at random.
static cloud_grain *cloud(int side, double drift) {
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  cloud_grain *g = tal_alloc((size_t)(side * side), sizeof *g);
  for (int k = 0; k < side * side; k++) {
    double x = 2.25 * (k % side - 0.5 * (side - 1)), y = 2.25 * (k / side - 0.5 * (side - 1));
    g[k] = (cloud_grain){.x = x + uniform(random, -0.1, 0.1),
                         .y = y + uniform(random, -0.1, 0.1),
                         .r = uniform(random, 0.5, 1),
                         .vx = uniform(random, -1, 1) - 0.4 * x + drift,
                         .vy = uniform(random, -1, 1) - 0.4 * y,
                         .omega = uniform(random, -3, 3)};
  }
  gsl_rng_free(random);
  return g;
}

static engine *start_cloud(const cloud_grain *g, int count, const char *rest) {
  draft *d = draft_begin();
  fprintf(d->to, "grains:\n  thickness: 1\n  list:\n");
  for (int k = 0; k < count; k++)
    fprintf(d->to, "  - {x: %.17g, y: %.17g, r: %.17g, vx: %.17g, vy: %.17g, omega: %.17g}\n", g[k].x, g[k].y, g[k].r,
            g[k].vx, g[k].vy, g[k].omega);
  fputs(rest, d->to);
  return engine_start(d);
}

#define STAGE "integrator: {dt: 1e-3}\nstages: [{kind: free, duration: 100}]\n"

static const char *const laws[] = {
    "material: {young: 1e5, density: 1, friction: 0.5, damping: 2e-3}\ncontact: {vR: 1e-2}\n" STAGE,
    "material: {young: 1e5, density: 1, friction: 0.5, damping: 2e-3}\ncontact: {tangential: spring}\n" STAGE,
    "material: {density: 1, friction: 0.5}\ncontact: {normal: linear, stiffness: 3e4, damping: 5, vR: 1e-2}\n" STAGE,
    "material: {density: 1, friction: 0.5}\n"
    "contact: {normal: linear, stiffness: 3e4, restitution: 0.6, tangential: spring}\n" STAGE,
    "material: {young: 1e5, density: 1}\n" STAGE,
};
enum { LAWS = sizeof laws / sizeof *laws };

typedef struct momenta {
  double x, y, angular;               // momentum [kg m/s], angular momentum about the origin [kg m^2/s]
  double linear_scale, angular_scale; // sums of the sizes of their parts
} momenta;

static momenta momenta_of(const tal_grains *g) {
  momenta p = {0};
  for (size_t i = 0; i < g->count; i++) {
    double px = g->mass[i] * g->vx[i], py = g->mass[i] * g->vy[i], spin = g->inertia[i] * g->omega[i];
    p.x += px;
    p.y += py;
    p.angular += g->x[i] * py - g->y[i] * px + spin;
    p.linear_scale += hypot(px, py);
    p.angular_scale += hypot(g->x[i], g->y[i]) * hypot(px, py) + fabs(spin);
  }
  return p;
}

// ROUND: forces are equal and opposite and the torques of a contact make up for its lever arms, so momentum and angular
// momentum keep to the round-off of the sums, a random walk over the steps.
static void momentum_and_angular_momentum(void **state) {
  (void)state;
  const int steps = 4000;
  cloud_grain *g = cloud(14, 0.3);
  for (int k = 0; k < LAWS; k++) {
    engine *e = start_cloud(g, 14 * 14, laws[k]);
    momenta before = momenta_of(&e->sim->grains);
    double kinetic = engine_row(e).kinetic, worst = 0, turned = 0;
    for (int s = 0; s < steps; s++) {
      engine_step(e);
      momenta now = momenta_of(&e->sim->grains);
      worst = fmax(worst, hypot(now.x - before.x, now.y - before.y) / before.linear_scale);
      turned = fmax(turned, fabs(now.angular - before.angular) / before.angular_scale);
    }
    tal_row row = engine_row(e);
    if (e->sim->effects & TAL_EFFECT_DAMPING)
      assert_true(row.dissipated_damping > 0.05 * kinetic); // they did collide
    if (e->sim->effects & TAL_EFFECT_FRICTION)
      assert_true(row.dissipated_friction > 0.02 * kinetic);
    double walk = 4 * sqrt((double)steps) * DBL_EPSILON;
    if (!(worst < walk && turned < walk))
      fail_msg("law %d: momentum %.3g, angular momentum %.3g of %.3g", k, worst, turned, walk);
    engine_end(e);
  }
  free(g);
}

// ---- other frames ----

static void assert_mapped(const engine *e, const engine *f, double xx, double xy, double yx, double yy, double spin) {
  const tal_grains *g = &e->sim->grains, *h = &f->sim->grains;
  for (size_t i = 0; i < g->count; i++) {
    assert_true(h->x[i] == xx * g->x[i] + xy * g->y[i] && h->y[i] == yx * g->x[i] + yy * g->y[i]);
    assert_true(h->vx[i] == xx * g->vx[i] + xy * g->vy[i] && h->vy[i] == yx * g->vx[i] + yy * g->vy[i]);
    assert_true(h->theta[i] == spin * g->theta[i] && h->omega[i] == spin * g->omega[i]);
  }
}

// The cloud in a box of four walls, one of them moving, with gravity, all put through the linear map.
static engine *start_mapped(const cloud_grain *g, int count, const char *law, const double m[4], double spin) {
  static const double walls[4][6] = {
      {-14, -13, 14, -13, 0.25, 3}, {14, -13, 14, 13, -3, 0.5}, {14, 13, -14, 13, 0, 0}, {-14, 13, -14, -13, 0, 0}};
  char *text = NULL;
  size_t size = 0;
  FILE *to = open_memstream(&text, &size);
  fputs("walls:\n", to);
  for (int w = 0; w < 4; w++) {
    const double *p = walls[w];
    fprintf(to, "  - {from: [%.17g, %.17g], to: [%.17g, %.17g], velocity: [%.17g, %.17g]}\n", m[0] * p[0] + m[1] * p[1],
            m[2] * p[0] + m[3] * p[1], m[0] * p[2] + m[1] * p[3], m[2] * p[2] + m[3] * p[3], m[0] * p[4] + m[1] * p[5],
            m[2] * p[4] + m[3] * p[5]);
  }
  fprintf(to, "gravity: [%.17g, %.17g]\nlimits: {overlap: 0.7}\n%s", m[0] * 3 + m[1] * -8, m[2] * 3 + m[3] * -8, law);
  fclose(to);
  cloud_grain *mapped = tal_alloc((size_t)count, sizeof *mapped);
  for (int k = 0; k < count; k++)
    mapped[k] = (cloud_grain){m[0] * g[k].x + m[1] * g[k].y,   m[2] * g[k].x + m[3] * g[k].y,   g[k].r,
                              m[0] * g[k].vx + m[1] * g[k].vy, m[2] * g[k].vx + m[3] * g[k].vy, spin * g[k].omega};
  engine *e = start_cloud(mapped, count, text);
  free(mapped);
  free(text);
  return e;
}

// EXACT: the laws know no direction, so a frame turned by a right angle, or a mirrored one, sees the mapped bits; with
// walls, gravity, both kinds of friction and rotation.
static void turned_and_mirrored_frames(void **state) {
  (void)state;
  static const double same[4] = {1, 0, 0, 1}, maps[3][4] = {{0, -1, 1, 0}, {-1, 0, 0, 1}, {0, 1, 1, 0}};
  static const double spins[3] = {1, -1, -1};
  cloud_grain *g = cloud(10, 0);
  for (int k = 0; k < LAWS; k++)
    for (int m = 0; m < 3; m++) {
      engine *e = start_mapped(g, 100, laws[k], same, 1), *f = start_mapped(g, 100, laws[k], maps[m], spins[m]);
      for (int s = 0; s < 12; s++) {
        engine_steps(e, 100);
        engine_steps(f, 100);
        assert_mapped(e, f, maps[m][0], maps[m][1], maps[m][2], maps[m][3], spins[m]);
      }
      tal_row row = engine_row(e);
      assert_true(row.work_walls > 1000);
      engine_end(e);
      engine_end(f);
    }
  free(g);
}

// EXACT: two grains side by side under a third, thrown at a floor: whatever happens, the left half is the mirror image
// of the right one, and the third stays in the middle without turning.
static void mirror_symmetric_set_up(void **state) {
  (void)state;
  static const cloud_grain pile[3] = {
      {-1.0625, 1, 1, 0.5, -3, -2}, {1.0625, 1, 1, -0.5, -3, 2}, {0, 3, 0.75, 0, -5, 0}};
  for (int k = 0; k < LAWS; k++) {
    char rest[400];
    snprintf(rest, sizeof rest, "walls: [{from: [-50, -1], to: [50, -1]}]\ngravity: [0, -10]\n%s", laws[k]);
    engine *e = start_cloud(pile, 3, rest);
    const tal_grains *g = &e->sim->grains;
    double apart = 0, least = (double)INFINITY;
    for (int s = 0; s < 3000; s++) {
      engine_step(e);
      assert_true(g->x[0] == -g->x[1] && g->y[0] == g->y[1] && g->vx[0] == -g->vx[1] && g->vy[0] == g->vy[1]);
      assert_true(g->theta[0] == -g->theta[1] && g->omega[0] == -g->omega[1]);
      assert_true(g->x[2] == 0 && g->vx[2] == 0 && g->omega[2] == 0);
      apart = fmax(apart, g->x[1]);
      least = fmin(least, g->y[2]);
    }
    assert_true(apart > 1.1 && least < 1.5); // driven apart by the third
    engine_end(e);
  }
}

// ROUND: seen from a frame that moves along, the motion is the same: positions are rounded differently, and collisions
// of round grains blow that up by a factor each (about 2 path / radius), so a short run of few collisions is compared.
static void moving_frame(void **state) {
  (void)state;
  const double u = 3, v = -5;
  cloud_grain *g = cloud(6, 0), *moving = cloud(6, 0);
  for (int i = 0; i < 36; i++) {
    moving[i].vx += u;
    moving[i].vy += v;
  }
  for (int k = 0; k < LAWS; k++) {
    engine *e = start_cloud(g, 36, laws[k]);
    engine *f = start_cloud(moving, 36, laws[k]);
    engine_steps(e, 800);
    engine_steps(f, 800);
    double t = e->sim->run.time, worst = 0;
    for (size_t i = 0; i < 36; i++)
      worst = fmax(worst, hypot(f->sim->grains.x[i] - u * t - e->sim->grains.x[i],
                                f->sim->grains.y[i] - v * t - e->sim->grains.y[i]));
    if (!(worst < 1e-9)) // 1e5 times the round-off of a coordinate
      fail_msg("law %d: %.3g apart", k, worst);
    assert_true(engine_row(e).overlap_max > 0);
    engine_end(e);
    engine_end(f);
  }
  free(g);
  free(moving);
}

// ROUND: velocity Verlet with forces of position alone runs backwards to where it came from.
static void backwards_in_time(void **state) {
  (void)state;
  cloud_grain *g = cloud(5, 0);
  engine *e = start_cloud(g, 25, laws[4]);
  engine_steps(e, 1500);
  tal_grains *now = &e->sim->grains;
  double gone = 0, back = 0;
  for (size_t i = 0; i < 25; i++) {
    gone = fmax(gone, hypot(now->vx[i] - g[i].vx, now->vy[i] - g[i].vy));
    now->vx[i] = -now->vx[i];
    now->vy[i] = -now->vy[i];
  }
  engine_steps(e, 1500);
  for (size_t i = 0; i < 25; i++)
    back = fmax(back, hypot(now->x[i] - g[i].x, now->y[i] - g[i].y));
  assert_true(gone > 1);
  if (!(back < 1e-9))
    fail_msg("came back %.3g away", back);
  engine_end(e);
  free(g);
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(momentum_and_angular_momentum),
      cmocka_unit_test(turned_and_mirrored_frames),
      cmocka_unit_test(mirror_symmetric_set_up),
      cmocka_unit_test(moving_frame),
      cmocka_unit_test(backwards_in_time),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
