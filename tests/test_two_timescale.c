// Two time scales [P 2.4]: counts of table 2.1, order of convergence, ledger, end of a stage, resuming inside a cycle.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "checkpoint.h"
#include "critical.h"
#include "physics_contact.h"

// A grain on a linear floor that carries it, sliding: the normal force is the weight throughout.
static void open_slider(physics *p, const char *integrator, double duration) {
  physics_open(p,
               "grains: {list: [{x: 0, y: 0.99, r: 1, vx: 3, mass: 2, inertia: 1}]}\nrotation: false\n"
               "material: {friction: 0.4, density: 1}\ngravity: [0, -10]\n"
               "contact: {normal: linear, stiffness: 2000, tangential: regularised, exponent: 3, vR: 1}\n"
               "walls: [{from: [-100, 0], to: [100, 0], young: .inf}]\n"
               "integrator: {%s}\nstages: [{kind: free, duration: %.17g}]\n",
               integrator, duration);
}

// EXACT: evaluations of the forces over ten cycles are those of table 2.1: N_S / (m (1 + q)) fewer than small steps.
static void test_counts(void **state) {
  (void)state;
  static const struct {
    int m, n, q;
    double gain; // as printed in table 2.1, to four decimals
  } table[] = {{2, 20, 5, 4.1667}, {2, 15, 10, 2.2727}, {2, 10, 15, 1.5625}, {5, 5, 5, 1.6667}};
  for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
    physics p;
    char text[120];
    snprintf(text, sizeof text, "scheme: two_timescale, dt: 1e-4, m: %d, n: %d, q: %d", table[k].m, table[k].n,
             table[k].q);
    open_slider(&p, text, 500e-4);
    physics_to_end(&p);
    assert_int_equal(p.sim->run.step, 500);
    int64_t evaluations = p.sim->run.force_evaluations - 1; // the first one is the start's
    assert_int_equal(evaluations, 10 * table[k].m * (1 + table[k].q));
    assert_near(500.0 / (double)evaluations, table[k].gain, 0.5e-4, 1);
    physics_close(&p);
  }
}

// EXACT: with n = 1 every step is a small one: the bits of verlet.
static void test_small_steps_only(void **state) {
  (void)state;
  physics a, b;
  open_slider(&a, "scheme: verlet, dt: 1e-3", 0.5);
  open_slider(&b, "scheme: two_timescale, dt: 1e-3, m: 3, n: 1, q: 4", 0.5);
  physics_to_end(&a);
  physics_to_end(&b);
  assert_memory_equal(a.sim->grains.x, b.sim->grains.x, sizeof(double));
  assert_memory_equal(a.sim->grains.vx, b.sim->grains.vx, sizeof(double));
  assert_memory_equal(&a.sim->run.friction_work, &b.sim->run.friction_work, sizeof(double));
  physics_close(&a);
  physics_close(&b);
}

// EXACT: a stage ends after round(duration/dt) small steps, the last long step cut short; times are whole small steps.
static void test_end(void **state) {
  (void)state;
  for (int steps = 1; steps < 60; steps += 7) {
    physics p;
    open_slider(&p, "scheme: two_timescale, dt: 1e-3, m: 2, n: 7, q: 3", 1e-3 * steps);
    while (!tal_sim_done(p.sim)) {
      physics_step(&p);
      assert_true(p.sim->run.time == (double)p.sim->run.step * 1e-3);
    }
    assert_int_equal(p.sim->run.step, steps);
    physics_close(&p);
  }
}

// ORDER: what the slider loses is what friction took, at every instant of the cycle, up to the second order in which
// the kinetic energy at an instant differs from that of the kicks around it. Counting each force over its own step
// alone is of first order here.
static void test_ledger(void **state) {
  (void)state;
  double dt[4], error[4];
  for (int r = 0; r < 4; r++) {
    physics p;
    char text[120];
    dt[r] = 2e-3 / (1 << r);
    error[r] = 0;
    snprintf(text, sizeof text, "scheme: two_timescale, dt: %.17g, m: 2, n: 7, q: 3", dt[r]);
    open_slider(&p, text, 0.4);
    while (!tal_sim_done(p.sim)) {
      tal_row row;
      physics_step(&p);
      tal_sim_row(p.sim, &row);
      error[r] = fmax(error[r], fabs(row.dissipated_friction - 9 + row.kinetic));
    }
    assert_true(p.sim->grains.vx[0] < 2); // it has lost a good part
    physics_close(&p);
  }
  double order = fitted_order(dt, error, 4);
  if (!(order > 1.9 && order < 2.3))
    fail_msg("order %.3f, errors %g %g %g %g", order, error[0], error[1], error[2], error[3]);
}

// ORDER: a damped Hertz impact against the high-order reference, by steps of 4 dt and three of dt: second order.
static void test_order(void **state) {
  (void)state;
  ode_contact k = {.hertz = true, .K = 1e7, .C = 60, .kind = ODE_REGULARISED, .mu = 0.3, .vR = 1, .c = 2};
  k.i = (ode_grain){.x = -1e-3, .r = 1e-3, .vx = 0.8, .vy = 0.5, .mass = 1e-5, .inertia = 5e-12};
  k.j = (ode_grain){.x = 1.5e-3, .r = 1.5e-3, .vx = -0.2, .vy = -0.4, .mass = 3e-5, .inertia = 3e-11};
  double m = contact_mass(&k), length = pow(1.25 * m / k.K, 0.4), time = 2.9433 * length, dt[5], error[5];
  k.length = length;
  k.overlap = 0.3 * length; // starting at the square-root onset of damping would cost half an order
  k.j.x -= k.overlap;
  const double until = 0.3 * time;
  ode_result exact = ode_solve(&k, time, until);
  for (int r = 0; r < 5; r++) {
    physics p;
    char i[400], j[400], law[800];
    dt[r] = until / (70 << r);
    contact_grain_text(i, &k.i, 0);
    contact_grain_text(j, &k.j, 0);
    contact_law_text(law, &k);
    physics_open(&p,
                 "grains: {list: [%s, %s]}\n%sintegrator: {scheme: two_timescale, dt: %.17g, m: 1, n: 4, q: 3}\n"
                 "limits: {overlap: 1}\nstages: [{kind: free, duration: %.17g}]\n",
                 i, j, law, dt[r], until);
    physics_to_end(&p);
    const tal_grains *g = &p.sim->grains;
    error[r] = hypot(g->vx[0] - exact.vx[0], g->vy[0] - exact.vy[0]);
    physics_close(&p);
  }
  double order = fitted_order(dt, error, 5);
  if (!(order > 1.8 && order < 2.6))
    fail_msg("order %.3f, errors %g %g %g %g %g", order, error[0], error[1], error[2], error[3], error[4]);
}

// EXACT: put back inside a cycle, a run goes on to the same bits.
static void test_resume_inside_a_cycle(void **state) {
  (void)state;
  for (int steps = 0; steps < 9; steps++) {
    physics a, b;
    tal_error err = {""};
    char path[] = "/tmp/talus-two-XXXXXX";
    const char *integrator = "scheme: two_timescale, dt: 1e-3, m: 2, n: 5, q: 3";
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    open_slider(&a, integrator, 0.3);
    open_slider(&b, integrator, 0.3);
    for (int s = 0; s < steps; s++)
      physics_step(&a);
    tal_run_files files = {.series_step = -1, .tracks_step = -1};
    char *text = tal_scene_text(&a.scene);
    assert_int_equal(tal_checkpoint_write(path, NULL, a.sim, text, &files, &err), TAL_OK);
    assert_int_equal(tal_checkpoint_read(path, b.sim, text, &files, &err), TAL_OK);
    tal_run_files_clear(&files);
    free(text);
    unlink(path);
    tal_sim_restored(b.sim);
    physics_to_end(&a);
    physics_to_end(&b);
    assert_int_equal(a.sim->run.step, b.sim->run.step);
    assert_int_equal(a.sim->run.force_evaluations, b.sim->run.force_evaluations);
    assert_memory_equal(a.sim->grains.x, b.sim->grains.x, sizeof(double));
    assert_memory_equal(a.sim->grains.vx, b.sim->grains.vx, sizeof(double));
    assert_memory_equal(&a.sim->run.friction_work, &b.sim->run.friction_work, sizeof(double));
    physics_close(&a);
    physics_close(&b);
  }
}

// Closed form: undamped linear contact of reduced mass 2 on a wall: dt_crit = 2 sqrt(m/k). n dt just above it is
// refused by the scene alone, n dt just below is not.
static void test_long_step_above_the_limit(void **state) {
  (void)state;
  const double critical = 2 * sqrt(2.0 / 2000);
  physics p;
  char text[120];
  snprintf(text, sizeof text, "scheme: two_timescale, dt: %.17g, m: 2, n: 10, q: 2", 0.099 * critical);
  open_slider(&p, text, 0.01);
  assert_relative(tal_critical_step(p.sim), critical, 1e-12);
  tal_row row;
  tal_sim_row(p.sim, &row);
  assert_relative(row.dt_ratio, 0.99, 1e-12);
  for (size_t s = 0; s < p.scene.stage_count; s++)
    p.scene.stages[s].integrator.dt = 0.101 * critical;
  tal_sim *refused;
  tal_error err;
  assert_int_equal(tal_sim_create(&refused, &p.scene, &err), TAL_BAD_INPUT);
  assert_non_null(strstr(err.text, "n dt = "));
  assert_null(refused);
  physics_close(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_counts),
                                     cmocka_unit_test(test_small_steps_only),
                                     cmocka_unit_test(test_end),
                                     cmocka_unit_test(test_ledger),
                                     cmocka_unit_test(test_order),
                                     cmocka_unit_test(test_resume_inside_a_cycle),
                                     cmocka_unit_test(test_long_step_above_the_limit)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
