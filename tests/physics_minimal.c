// Minimal boundaries against closed forms (rings of free masses) and identities (packed samples): the imposed history,
// the penalty's decay and its limit, force, torque and power of the correcting forces, the ledger.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "boundary_minimal.h"
#include "engine.h"
#include "physics.h"
#include <float.h>

// ---- rings of free masses ----

// n grains of mass 2 on a circle of radius 3 about (1, 2), without contacts, hardly pressed; `more` closes the stage.
static engine *ring(int n, const char *grain_velocity, double dt, const char *stages) {
  draft *d = draft_begin();
  fputs("grains: {thickness: 0.5, list: [", d->to);
  for (int k = 0; k < n; k++) {
    double angle = 2 * TAL_PI * k / n;
    double x = 3 * cos(angle), y = 3 * sin(angle), vx = 0, vy = 0;
    if (strcmp(grain_velocity, "stretch") == 0) {
      vx = 1e-6 * x;
      vy = -1e-6 * y;
    }
    fprintf(d->to, "%s{x: %.17g, y: %.17g, r: 0.01, mass: 2, vx: %.17g, vy: %.17g}", k ? ", " : "", 1 + x, 2 + y, vx,
            vy);
  }
  fprintf(d->to,
          "]}\ncontact: {normal: linear, stiffness: 1}\ncontinuum: {peel: 1e6, refresh: 7}\n"
          "integrator: {dt: %.17g}\nlimits: {outside: 1}\nstages: [%s]\n",
          dt, stages);
  return engine_start(d);
}

// Where a ring's node k of n would be after an affine motion about its middle.
static void assert_affine(const engine *e, int n, double fxx, double fxy, double fyy, double eps) {
  const tal_grains *g = &e->sim->grains;
  for (int k = 0; k < n; k++) {
    double angle = 2 * TAL_PI * k / n, x = 3 * cos(angle), y = 3 * sin(angle);
    assert_near(g->x[k], 1 + fxx * x + fxy * y, eps, 3);
    assert_near(g->y[k], 2 + fyy * y, eps, 3);
  }
}

// ROUND: a ring at rest follows the imposed history to the last digits: the engineering strain of `compress`, both
// components of a constant-volume `deform`, simple shear of 40 % in ten thousand steps.
static void imposed_history(void **state) {
  (void)state;
  engine *e = ring(24, "", 1e-3, "{kind: deform, pressure: 1e-20, duration: 1, rates: {xx: 0.1, yy: -0.1, xy: 0.05}}");
  engine_finish(e);
  double fxx = 1, fxy = 0, fyy = 1;
  for (int k = 0; k < 1000; k++) {
    fxy += 1e-3 * (0.1 * fxy + 0.05 * fyy);
    fxx *= 1 + 1e-4;
    fyy *= 1 - 1e-4;
  }
  assert_affine(e, 24, fxx, fxy, fyy, 1e-12);
  assert_near(e->sim->run.axial_strain, 1 - exp(-0.1), 1e-5, 1); // and this is what it tends to
  engine_end(e);
  e = ring(30, "", 1e-3, "{kind: deform, pressure: 1e-20, duration: 2, rates: {xx: 0, yy: -0.2}, order: 2}");
  engine_finish(e);
  assert_affine(e, 30, 1, 0, pow(1 - 2e-4, 2000), 1e-12);
  engine_end(e);
  e = ring(17, "", 1e-3, "{kind: shear, pressure: 1e-20, rate: -0.04, strain: 0.4}");
  engine_finish(e);
  assert_int_equal(e->sim->run.step, 10000);
  assert_affine(e, 17, 1, -0.4, 1, 1e-11);
  assert_near(e->sim->run.shear_strain, -0.4, 1e-12, 1);
  engine_end(e);
  e = ring(40, "", 1e-3, "{kind: compress, boundary: minimal, pressure: 1e-20, rate: 0.04, strain: 0.3}");
  engine_finish(e);
  assert_near(e->sim->run.axial_strain, 0.3, 1e-12, 1);
  double low = 9, high = -9;
  for (int k = 0; k < 40; k++) {
    low = fmin(low, e->sim->grains.y[k]);
    high = fmax(high, e->sim->grains.y[k]);
  }
  assert_near(high - low, 6 * 0.7, 1e-12, 6);
  engine_end(e);
}

// ROUND: an impulse sets a ring at rest going; its work is the kinetic energy it leaves, (1/2) m sum (L x)^2, in the
// first row already, and later rows add what the motion needs.
static void work_of_the_start(void **state) {
  (void)state;
  engine *e = ring(24, "", 1e-3, "{kind: deform, pressure: 1e-20, duration: 1, rates: {xx: 0.1, yy: -0.1}}");
  tal_row row = engine_row(e);
  double expected = 0.5 * 2 * 24 * 0.01 * 9 / 2 + 0.5 * 2 * 24 * 0.01 * 9 / 2;
  assert_relative(row.kinetic, expected, 1e-13);
  assert_relative(row.work_minimal, expected, 1e-13);
  assert_true(fabs(row.energy_residual) < 1e-13);
  engine_finish(e);
  row = engine_row(e);
  // what (16) leaves at the end of a run: F^2 dt^2 / (8 m) with F / m = L^2 x there; the first force is nil
  double left = 24 * 2 * 9 * 1e-4 * cosh(0.2) * 1e-6 / 8;
  assert_relative(row.energy_residual * row.work_minimal, -left, 1e-3);
  assert_true(row.kinetic != expected);
  assert_relative(row.work_minimal, row.kinetic, 1e-8);
  engine_end(e);
}

// Amplification per step of an error under a penalty of decay G = lambda dt, the larger root of z^2 + (3G/2 - 1) z -
// G/2.
static double amplification(double g) {
  double half = 0.5 * (1 - 1.5 * g);
  double root = sqrt(half * half + 0.5 * g);
  return fabs(half + root) > fabs(half - root) ? half + root : half - root;
}

// Error of xx after some steps over that a step before.
static double error_ratio(double lambda_dt, int steps, const char *force) {
  // lambda = 2 K / (n m a^2): n = 20 masses of 2 on a radius of 3
  char stage[200];
  const double dt = 1e-3;
  double penalty = lambda_dt / dt * 20 * 2 * 9 / 2;
  snprintf(stage, sizeof stage,
           "{kind: deform, pressure: 1e-20, duration: 10, method: penalty, penalty: %.17g, rates: {xx: 0, yy: 0}%s}",
           penalty, force);
  engine *e = ring(20, "stretch", dt, stage);
  engine_steps(e, steps - 1);
  double before = e->sim->run.gradient_xx;
  engine_step(e);
  double ratio = e->sim->run.gradient_xx / before;
  engine_end(e);
  return ratio;
}

// ROUND: on both sides of the limit lambda dt = 1 an error decays or grows by the root of the scheme with lambda =
// 2K/(n m a^2); for small steps that is exp(-lambda dt). The limit the code finds is that of the ring.
static void penalty_on_a_ring(void **state) {
  (void)state;
  static const double values[] = {0.01, 0.3, 0.9, 0.98};
  for (int k = 0; k < 4; k++) // 1e-6 of strain rate: the ring hardly changes
    assert_near(error_ratio(values[k], 60, ""), amplification(values[k]), 2e-6, 1);
  assert_true(fabs(amplification(0.98)) < 1 && fabs(amplification(1.02)) > 1);
  assert_near(error_ratio(1.02, 100, ", integrator: {force: true}"), amplification(1.02), 2e-6, 1);
  assert_near(error_ratio(0.01, 60, ""), exp(-0.01), 1e-4, 1);
  const bool held[TAL_COMPONENTS] = {true, true, true, false};
  engine *e = ring(20, "", 1e-3, "{kind: deform, pressure: 1e-20, duration: 1, rates: {xx: 0, yy: 0}}");
  double decay = tal_minimal_decay(&e->sim->rows, held, e->sim->grains.inverse_mass, &e->sim->graph.loop);
  assert_relative(decay, 2.0 / (20 * 2 * 9), 1e-12);
  assert_relative(tal_minimal_penalty_limit(decay, 1e-3, (double)INFINITY), 1e3 * 180, 1e-12);
  engine_end(e);
}

// EXACT: a penalty above the limit is refused at the start of its stage with the limit in the message, unless forced;
// left out it is half the limit.
static void penalty_limit(void **state) {
  (void)state;
  engine *e =
      ring(20, "", 1e-3, "{kind: deform, pressure: 1e-20, duration: 1, method: penalty, rates: {xx: 0, yy: 0}}");
  assert_relative(e->sim->run.penalty, 0.5e3 * 180, 1e-12);
  engine_end(e);
  tal_error err = {""};
  draft *d = draft_begin();
  fputs("grains: {thickness: 0.5, list: [{x: 0, y: 0, r: 1, mass: 2}, {x: 3, y: 0, r: 1, mass: 2}, "
        "{x: 0, y: 3, r: 1, mass: 2}]}\ncontact: {normal: linear, stiffness: 1}\ncontinuum: {peel: 9}\n"
        "integrator: {dt: 0.1}\nstages: [{kind: shear, pressure: 1, rate: 1, strain: 1, method: penalty, penalty: "
        "1e9}]\n",
        d->to);
  tal_scene scene;
  tal_sim *sim;
  draft_load(d, &scene);
  assert_int_equal(tal_sim_create(&sim, &scene, &err), TAL_INVALID);
  assert_non_null(strstr(err.text, "penalty = 1e+09 N m s is above its explicit limit"));
  tal_scene_clear(&scene);
}

// ---- packed samples ----

// Soft disks, slightly overlapping, about 300 of them; `shape`: pack's cut; `stages` run from the packing on.
static engine *sample(const char *shape, const char *friction, const char *integrator, const char *stages) {
  draft *d = draft_begin();
  fprintf(d->to,
          "seed: 5\ngrains: {count: 320, radius: {law: uniform, min: 0.5e-3, max: 1e-3}, thickness: 1.5e-3}\n"
          "material: {young: 1e8, density: 2675, %s, damping: 1e-3}\nmass_scaling: 1e4\n"
          "contact: {exponent: 10, vR: 1e-3}\npack: {width: 24e-3%s}\ncontinuum: {refresh: 20}\n"
          "integrator: {%s}\nstages:\n"
          "  - {kind: confine, pressure: 1e5, ramp: 0.05, tolerance: 0.1, unbalanced: 0.1, friction: 0.1}\n%s",
          friction, shape, integrator, stages);
  return engine_start(d);
}

static void to_stage(engine *e, int stage) {
  while (e->sim->run.stage < stage)
    engine_step(e);
}

typedef struct before {
  size_t count;
  int32_t *node;
  double *x, *y;
} before;

static before look(const engine *e) {
  const geo_loop *loop = &e->sim->graph.loop;
  before b = {loop->count, tal_alloc(loop->count, sizeof *b.node), tal_alloc(loop->count, sizeof *b.x),
              tal_alloc(loop->count, sizeof *b.y)};
  for (size_t k = 0; k < loop->count; k++) {
    b.node[k] = loop->node[k];
    b.x[k] = e->sim->grains.x[loop->node[k]];
    b.y[k] = e->sim->grains.y[loop->node[k]];
  }
  return b;
}

// Mean displacement gradient of the loop since `look`, from positions alone.
static geo_tensor gradient_since(before *b, const engine *e) {
  geo_tensor sum = {0, 0, 0, 0};
  double twice = 0;
  for (size_t k = 0; k < b->count; k++) {
    size_t n = (k + 1) % b->count, p = (k + b->count - 1) % b->count;
    geo_vec u = {e->sim->grains.x[b->node[k]] - b->x[k], e->sim->grains.y[b->node[k]] - b->y[k]};
    sum = geo_tensor_add(sum, geo_outer(u, (geo_vec){0.5 * (b->y[n] - b->y[p]), -0.5 * (b->x[n] - b->x[p])}));
    twice += b->x[k] * b->y[n] - b->x[n] * b->y[k];
  }
  free(b->node);
  free(b->x);
  free(b->y);
  return geo_tensor_scale(2 / twice, sum);
}

static const char verlet[] = "scheme: verlet, dt: 2e-5", implicit[] = "scheme: implicit_friction, dt: 2e-5";

// ROUND: in every step of a sheared, packed sample, whatever order and integrator, the mean displacement gradient of
// the loop in force is dt times the imposed rate: L_xy = rate, L_yx = 0; the error that is reported is round-off. The
// loop in force during the step after a refresh is that of before it.
static void every_step_is_as_imposed(void **state) {
  (void)state;
  static const char *const schemes[] = {verlet, implicit, "scheme: two_timescale, dt: 1e-5, m: 2, n: 2, q: 2"};
  for (int order = 0; order <= 4; order += 2) {
    char stages[100];
    snprintf(stages, sizeof stages, "  - {kind: shear, rate: 0.2, strain: 0.01, order: %d}\n", order);
    engine *e = sample(", cut: {shape: circle, radius: 9e-3}", "friction: 0.4", schemes[order / 2], stages);
    to_stage(e, 1);
    for (int k = 0; !tal_sim_done(e->sim); k++) {
      int64_t refreshed = e->sim->run.refresh_step, step = e->sim->run.step;
      before b = look(e);
      double dt = e->sim->dt;
      engine_step(e);
      geo_tensor h = gradient_since(&b, e);
      if (refreshed == step) // the loop that was looked at takes over now
        continue;
      if (k % 17 == 0) {
        tal_row row = engine_row(e);
        assert_true(fabs(row.strain_rate_error_xy) < 1e-14 && isnan(row.strain_rate_error_xx));
        assert_true(isnan(row.strain_rate_error_yy) && row.boundary_rank == order * (order + 7) / 2.0);
      }
      assert_near(h.xy, 0.2 * dt, 1e-9, 0.2 * dt); // positions hold 16 digits, a step moves the last 10
      assert_near(h.yx, 0, 1e-9, 0.2 * dt);
    }
    engine_end(e);
  }
}

// ROUND: what the boundary puts on a confined box under compression, order 3: no net force; torque -2 A h times the
// multiplier of the spin; mean stress p + multipliers; the correcting work is the sum over steps of its power -h A
// lambda : L, and the ledger closes.
static void forces_and_ledger(void **state) {
  (void)state;
  engine *e = sample("", "friction: 0.4", implicit,
                     "  - {kind: compress, boundary: minimal, order: 3, rate: 0.2, strain: 0.02}\n");
  to_stage(e, 1);
  assert_null(tal_walls_plate(&e->sim->walls, +1));
  const tal_grains *g = &e->sim->grains;
  for (int k = 0; !tal_sim_done(e->sim); k++) {
    engine_step(e);
    if (k % 50)
      continue;
    tal_row row = engine_row(e);
    double fx = 0, fy = 0, torque = 0, size = 0, volume = 0;
    for (size_t i = 0; i < g->count; i++) {
      fx += g->bx[i];
      fy += g->by[i];
      torque += g->x[i] * g->by[i] - g->y[i] * g->bx[i];
      size += hypot(g->bx[i], g->by[i]);
    }
    volume = e->sim->rows.area * e->sim->constants.thickness;
    assert_true(fabs(fx) < 1e-12 * size && fabs(fy) < 1e-12 * size);
    assert_near(torque, -2 * volume * row.multiplier_spin, 1e-11, size * 0.03);
    if (e->sim->run.refresh_step == e->sim->run.step) // the area is that of the next loop
      continue;
    assert_relative(row.sigma_xx_boundary, 1e5, 1e-9);
    assert_relative(row.sigma_yy_boundary, 1e5 + row.multiplier_yy, 1e-9);
    assert_near(row.sigma_xy_boundary, row.multiplier_xy, 1e-9, 1e5);
    assert_near(row.energy_residual, 0, 2e-3, 1);
  }
  tal_row row = engine_row(e);
  assert_near(row.axial_strain, 0.02, 1e-12, 1);
  assert_true(row.work_minimal > 0);
  engine_end(e);
}

// ROUND: work only on the strain rate: the correcting forces of order 0 do the power -h A lambda : L(v) on any
// velocities, so on velocities without mean gradient none; checked on random ones.
static void work_on_the_error_alone(void **state) {
  (void)state;
  engine *e = sample("", "friction: 0.4", verlet,
                     "  - {kind: compress, boundary: minimal, method: penalty, rate: 0.2, strain: 0.004}\n");
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  to_stage(e, 1);
  engine_steps(e, 110);
  const tal_rows *rows = &e->sim->rows;
  double *velocity = tal_alloc(2 * rows->nodes, sizeof *velocity), power = 0, size = 0;
  for (size_t k = 0; k < 2 * rows->nodes; k++) {
    velocity[k] = uniform(random, -1, 1);
    power += (rows->force[k] - rows->given[k]) * velocity[k];
    size += fabs((rows->force[k] - rows->given[k]) * velocity[k]);
  }
  geo_tensor l = tal_rows_gradient(rows, velocity);
  const double *m = rows->multiplier, volume = rows->area * rows->thickness;
  double expected = -volume * (m[TAL_XX] * l.xx + m[TAL_YY] * l.yy + m[TAL_XY] * (l.xy + l.yx));
  assert_near(power, expected, 1e-12, size);
  assert_true(m[TAL_XX] == 0 && m[TAL_SPIN] == 0 && m[TAL_YY] != 0);
  tal_row row = engine_row(e); // the penalty leaves an error, and says so
  assert_true(fabs(row.strain_rate_error_yy) > 1e-6 && fabs(row.strain_rate_error_yy) < 0.2);
  engine_finish(e);
  row = engine_row(e);
  assert_near(row.axial_strain, 0.004, 0.2, 0.004);
  assert_near(row.energy_residual, 0, 2e-3, 1);
  free(velocity);
  gsl_rng_free(random);
  engine_end(e);
}

// ROUND: a stress-controlled shear: the mean boundary stress is the asked one in all three components, held rates are
// 0.
static void stresses_are_as_asked(void **state) {
  (void)state;
  engine *e = sample(", cut: {shape: polygon, points: [[-8e-3, -8e-3], [9e-3, -7e-3], [8e-3, 8e-3], [-7e-3, 9e-3]]}",
                     "friction: 0.4", implicit,
                     "  - {kind: deform, duration: 0.004, stresses: {xx: 1.2e5, yy: 0.9e5, xy: 1e4}, order: 1}\n"
                     "  - {kind: deform, duration: 0.004, rates: {yy: -0.1}, stresses: {xy: -1e4}}\n");
  to_stage(e, 1);
  engine_steps(e, 30);
  tal_row row = engine_row(e);
  assert_relative(row.sigma_xx_boundary, 1.2e5, 1e-9);
  assert_relative(row.sigma_yy_boundary, 0.9e5, 1e-9);
  assert_relative(row.sigma_xy_boundary, 1e4, 1e-8);
  assert_true(isnan(row.strain_rate_error_xy) && row.multiplier_xy == 0);
  to_stage(e, 2);
  engine_steps(e, 30);
  row = engine_row(e);
  assert_relative(row.sigma_xx_boundary, 1e5, 1e-9);
  assert_relative(row.sigma_xy_boundary, -1e4, 1e-8);
  assert_true(fabs(row.strain_rate_error_yy) < 1e-14 && row.multiplier_yy != 0);
  assert_near(e->sim->run.gradient_xy - e->sim->run.gradient_yx, 0, 1e-14, 1);
  engine_end(e);
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(imposed_history),          cmocka_unit_test(work_of_the_start),
      cmocka_unit_test(penalty_on_a_ring),        cmocka_unit_test(penalty_limit),
      cmocka_unit_test(every_step_is_as_imposed), cmocka_unit_test(forces_and_ledger),
      cmocka_unit_test(work_on_the_error_alone),  cmocka_unit_test(stresses_are_as_asked),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
