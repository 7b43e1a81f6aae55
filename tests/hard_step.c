// The time step from a hundredth of the critical one to three times it. A grain between two fixed ones under linear
// contacts is the oscillator for which everything is known in closed form.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "critical.h"
#include "engine.h"
#include "hard.h"
#include "physics.h"
#include "program.h"
#include <float.h>
#include <omp.h>

static const double stiffness = 1e4, overlap = 0.1, amplitude = 1e-3;

// Of the grain between the two: both contacts act on it.
static double frequency(void) {
  return sqrt(2 * stiffness / TAL_PI);
}

// The step at which that oscillator is no longer stable, eq (26), for the damping ratio zeta of the pair of contacts.
static double critical_step(double zeta) {
  return 2 / frequency() * (sqrt(4 * zeta * zeta + 1) - 2 * zeta);
}

#define SWING                                                                                                          \
  "grains: {thickness: 1, list: [{x: %.17g, y: 0, r: 1, fixed: true}, {x: %.17g, y: 0, r: 1}, {x: %.17g, y: 0, r: 1, " \
  "fixed: true}]}\nmaterial: {density: 1}\ncontact: {normal: linear, stiffness: 1e4, damping: %.17g}\n"                \
  "integrator: {scheme: %s, dt: %.17g, force: true}\nstages: [{kind: free, duration: 1e9}]\n"

// The grain displaced by the amplitude, at rest.
static void swing_open(physics *p, double zeta, const char *scheme, double dt) {
  const double damping = zeta * frequency() * TAL_PI; // c_1 + c_2 = 2 zeta omega m
  physics_open(p, SWING, overlap - 2, amplitude, 2 - overlap, damping, scheme, dt);
}

// ROUND: below the critical step x_n = x_0 cos(2 n asin(dt/dt_crit)), the exact solution of the scheme; what is off is
// the round-off of n steps.
static void test_below(void **state) {
  (void)state;
  static const double share[] = {0.01, 0.1, 0.5, 0.9, 0.99, 0.999};
  static const char *const scheme[] = {"verlet", "implicit_friction"};
  const int64_t steps = hard_size(10000, 1000000, 10000000);
  double worst = 0;
  for (size_t k = 0; k < sizeof share / sizeof *share; k++)
    for (int s = 0; s < 2; s++) {
      physics p;
      swing_open(&p, 0, scheme[s], share[k] * critical_step(0));
      for (int64_t n = 1; n <= steps; n++) {
        physics_step(&p);
        const double exact = amplitude * cos(2 * (double)n * asin(share[k]));
        worst = fmax(worst, fabs(p.sim->grains.x[1] - exact) / amplitude);
      }
      physics_close(&p);
    }
  const double digit = DBL_EPSILON / amplitude; // of the coordinates that make the overlap, in each step
  assert_true(worst < 4 * digit * (double)steps);
  hard_report(&(hard_row){"time step below critical", "dt 0.01 to 0.999 dt_crit, both schemes",
                          "x_n = x_0 cos(2 n asin(dt/dt_crit)), exact for the scheme",
                          hard_text("off by %.1g x_0 after %.0e steps", worst, (double)steps), "dt_crit", "next rows"});
}

static int64_t growth_steps(void) {
  return hard_size(4000, 20000, 400000);
}

// Does the swing grow within some thousand steps?
static bool grows(double zeta, const char *scheme, double dt) {
  physics p;
  swing_open(&p, zeta, scheme, dt);
  bool grown = false;
  tal_error err;
  for (int64_t n = 0; n < growth_steps() && !grown; n++)
    grown = tal_sim_step(p.sim, &err) != TAL_OK || fabs(p.sim->grains.x[1]) > 1.5 * amplitude;
  physics_close(&p);
  return grown;
}

static double largest_stable(double zeta, const char *scheme) {
  double below = 0.3 * critical_step(zeta), above = 3 * critical_step(0);
  assert_true(!grows(zeta, scheme, below) && grows(zeta, scheme, above));
  while (above - below > 1e-7 * below) {
    double middle = 0.5 * (below + above);
    *(grows(zeta, scheme, middle) ? &above : &below) = middle;
  }
  return 0.5 * (below + above);
}

// ROUND: the largest stable step, by bisection, is the critical step that the engine knows; with implicit damping it is
// that of the undamped contact.
static void test_limit(void **state) {
  (void)state;
  static const double zeta[] = {0, 0.1, 0.5, 1};
  double worst = 0, implicit_least = HUGE_VAL;
  for (int k = 0; k < 4; k++) {
    physics p;
    swing_open(&p, zeta[k], "verlet", critical_step(zeta[k]) / 2);
    assert_relative(tal_critical_step(p.sim), critical_step(zeta[k]), 1e-9);
    physics_close(&p);
    worst = fmax(worst, fabs(largest_stable(zeta[k], "verlet") / critical_step(zeta[k]) - 1));
    implicit_least = fmin(implicit_least, largest_stable(zeta[k], "implicit_friction") / critical_step(0));
  }
  const double seen = 4.0 / (double)growth_steps(); // slower growth is not seen
  assert_true(worst < seen && implicit_least > 1 - seen);
  hard_report(&(hard_row){
      "time step at critical", "bisected, damping ratio 0 to 1", "stable up to the closed form (26), not beyond",
      hard_text("verlet: 1 to %.0e; implicit damping: %.4f of the undamped or more", worst, implicit_least),
      "dt/dt_crit = 1", "the swing grows"});
}

// The last row of a series: its residual; how many rows there are.
static double last_residual(program *p, const char *name, int *rows) {
  size_t size;
  char *series = program_read(p, name, &size), *line = series;
  assert_non_null(series);
  int column = 0;
  for (char *c = series; strncmp(c, "energy_residual", 15) != 0; c++)
    column += *c == ',';
  *rows = count_lines(series) - 1;
  for (int k = 0; k < *rows; k++)
    line = strchr(line, '\n') + 1;
  for (int k = 0; k < column; k++)
    line = strchr(line, ',') + 1;
  const double value = strtod(line, NULL);
  free(series);
  return value;
}

// A bed of grains that settles under gravity, linear contacts: dt_crit of the deepest grains is known beforehand to
// some 20 %.
#define BED                                                                                                            \
  "seed: 2\ngrains: {count: 60, radius: {law: uniform, min: 1, max: 1.2}, thickness: 1}\n"                             \
  "material: {density: 1, friction: 0.3}\ncontact: {normal: linear, stiffness: 1e5, restitution: 0.8, vR: 1e-2}\n"     \
  "gravity: [0, -10]\npack: {width: 16}\nwalls: [{from: [-99, 0], to: [99, 0]}, {from: [0, -1], to: [0, 99]}, "        \
  "{from: [16, -1], to: [16, 99]}]\nintegrator: {scheme: %s, dt: %.17g%s}\nstages: [{kind: free, duration: %.17g}]\n"  \
  "output: {series_every: %.17g, checkpoint_every: 9}\n"

// The critical step of the packing [s], as the program says it when it refuses a larger one.
static double refused(program *p, const char *scheme) {
  char text[2000];
  outcome got;
  snprintf(text, sizeof text, BED, scheme, 1e-2, "", 9.0, 1.0);
  program_write(p, "s.yaml", text);
  program_run(p, WORDS("run", "s.yaml", "-o", "refused"), &got);
  assert_outcome("refused", &got, 3, "is above the critical step ");
  return strtod(strstr(got.err, "critical step ") + strlen("critical step "), NULL);
}

typedef struct ending {
  int rows, code;
  double residual; // of the last row
  char reason[700];
} ending;

static ending bed_runs(program *p, const char *scheme, double dt, bool force) {
  char text[2000], dir[60], series[80];
  const double steps = (double)hard_size(2000, 5000, 100000);
  outcome got;
  snprintf(text, sizeof text, BED, scheme, dt, force ? ", force: true" : "", steps * dt, 5 * dt);
  program_write(p, "s.yaml", text);
  snprintf(dir, sizeof dir, "%s-%.4g", scheme, dt);
  snprintf(series, sizeof series, "%s/series.csv", dir);
  program_run(p, WORDS("run", "s.yaml", "-o", dir, "-t", "1", "-q", "--no-figures"), &got);
  ending end = {.code = got.code};
  end.residual = last_residual(p, series, &end.rows);
  snprintf(end.reason, sizeof end.reason, "%.699s", got.err);
  return end;
}

// EXACT: above the critical step a scene is refused; with integrator.force it runs, and either the ledger goes on
// closing (the critical step is a bound from below, and dampers help) or the run stops with the reason. No row is
// garbage.
static void test_above(void **state) {
  static const double share[] = {0.5, 1.2, 1.5, 2, 3};
  static const char *const scheme[] = {"verlet", "implicit_friction"};
  double worst = 0, first_stopped = HUGE_VAL;
  for (int s = 0; s < 2; s++) {
    const double critical = refused(*state, scheme[s]);
    for (size_t k = 0; k < sizeof share / sizeof *share; k++) {
      const ending end = bed_runs(*state, scheme[s], share[k] * critical, share[k] > 1);
      worst = fmax(worst, fabs(end.residual));
      assert_true(share[k] > 1 ? end.code == 0 || end.code == 3 : end.code == 0);
      assert_true(share[k] < 2 || end.code == 3);
      assert_true(end.code == 0 || (strstr(end.reason, "grain ") && strstr(end.reason, "lower dt")));
      first_stopped = end.code == 3 ? fmin(first_stopped, share[k]) : first_stopped;
    }
  }
  assert_true(worst < 0.2);
  hard_report(&(hard_row){"time step above critical", "dt 0.5 to 3 dt_crit of a settling bed, both schemes",
                          "refused; with integrator.force no row of the series is garbage",
                          hard_text("largest residual written %.2g; first stopped at %g dt_crit", worst, first_stopped),
                          "1 to 2 dt_crit: the bound is one from below", "exit 3 with the reason within a few rows"});
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_below),
      cmocka_unit_test(test_limit),
      program_test(test_above),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
