// Runs gone bad, through the program: each stops with exit 3 and one line that names grain, time, cause and what to
// change, keeps a sound checkpoint, and does the same again when it is resumed.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "engine.h"
#include "hard.h"
#include "inspect.h"
#include "program.h"
#include <omp.h>

typedef struct fault {
  const char *name, *dial, *scene;
  const char *said[4]; // fragments of the line
  const char *limit;
} fault;

#define FREE "stages: [{kind: free, duration: 9}]\n"
// One grain on its way, and nothing else.
#define FLIGHT(v)                                                                                                      \
  "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1}, {x: 0, y: 5, r: 1, vx: " v "}]}\n"                                \
  "material: {young: 1e6, density: 1}\nintegrator: {dt: 1e-3}\n" FREE
// Three grains in a row, pressed by a wall that comes nearer.
#define PRESS                                                                                                          \
  "grains: {thickness: 1, list: [{x: 1, y: 1, r: 1}, {x: 3, y: 1, r: 1}, {x: 5, y: 1, r: 1}]}\n"                       \
  "walls: [{from: [0, -9], to: [0, 9]}, {from: [6.5, -9], to: [6.5, 9], velocity: [-1, 0]}]\n" FREE
// A grain between two fixed ones, displaced, at a step above the critical one.
#define SWING                                                                                                          \
  "grains: {thickness: 1, list: [{x: -1.9, y: 0, r: 1, fixed: true}, {x: 0.01, y: 0, r: 1}, {x: 1.9, y: 0, r: 1, "     \
  "fixed: true}]}\nmaterial: {density: 1}\ncontact: {normal: linear, stiffness: 1e4}\n" FREE

static const fault faults[] = {
    {"not a number",
     "gravity 1e150 m/s^2, limits off",
     FLIGHT("0") "gravity: [1e150, 0]\nlimits: {stride: .inf, world: .inf}\n"
                 "output: {series_every: 0.1, checkpoint_every: 0.1}\n",
     {"grain ", "no finite position or velocity at t = ", "the time step is probably too large",
      "smaller integrator.dt"},
     "1e150"},
    {"stride",
     "speed growing in flight",
     FLIGHT("0") "gravity: [100, 0]\noutput: {series_every: 0.1, checkpoint_every: 0.1}\n",
     {"grain 0 moves 0.5", "at t = 5", "(limits.stride: 0.5)", "lower dt or the speeds"},
     "0.5 of the smallest radius in a step"},
    {"outside the world",
     "a grain in free flight",
     FLIGHT("90") "limits: {world: 100}\noutput: {series_every: 0.1, checkpoint_every: 0.1}\n",
     {"grain 1 is outside the world at t = 2.2", "(limits.world)", "it flew away", "put walls around it"},
     "1e7 mean diameters (here 100)"},
    {"overlap",
     "a wall that presses three grains",
     PRESS "material: {density: 1, young: 3e4}\nintegrator: {dt: 1e-4}\nlimits: {overlap: 0.2}\n"
           "output: {series_every: 0.1, checkpoint_every: 0.1}\n",
     {"grain ", "of the smaller radius at t = 1", "(limits.overlap: 0.2): contacts too soft", "raise material.young"},
     "0.5 of the smaller radius (here 0.2)"},
    {"stiffening",
     "the same; Hertz contacts stiffen",
     PRESS "material: {density: 1, young: 3e4}\nmass_scaling: 1e-2\nintegrator: {dt: 1.5e-3}\nlimits: {overlap: 1}\n"
           "output: {series_every: 0.1, checkpoint_every: 0.1}\n",
     {"above the critical step", "at t = ", "least at grain ", "they stiffen as they are pressed; a smaller dt"},
     "dt = dt_crit, looked at every 100 steps"},
    {"energy residual",
     "dt 1.05 dt_crit, force: true",
     SWING "integrator: {dt: 0.0263, force: true}\nlimits: {stride: .inf}\n"
           "output: {series_every: 0.263, checkpoint_every: 0.263}\n",
     {" J of energy ", "(limits.residual: 0.1)", "grain 1 is the fastest", "lower dt (now 1.05"},
     "0.1 of all energy between two rows"},
};

static void stops(program *p, const fault *f) {
  outcome first, again;
  program_write(p, "s.yaml", f->scene);
  program_run(p, WORDS("run", "s.yaml", "-o", f->name, "-t", "1", "-q"), &first);
  for (int k = 0; k < 4; k++)
    assert_outcome(f->name, &first, 3, f->said[k]);
  char kept[100];
  snprintf(kept, sizeof kept, "; last good checkpoint: %s/checkpoint.h5\n", f->name);
  assert_outcome(f->name, &first, 3, kept);
  assert_int_equal(count_lines(first.err), 1);
  program_run(p, WORDS("verify", f->name), &again);
  assert_outcome(f->name, &again, 0, "");
  program_run(p, WORDS("run", "s.yaml", "-o", f->name, "-t", "1", "-q", "--resume"), &again);
  assert_outcome(f->name, &again, 3, f->said[0]);
  assert_string_equal(first.err, again.err);
}

// EXACT: exit 3, the words, a checkpoint that verifies, and the same end from it.
static void test_faults(void **state) {
  for (size_t k = 0; k < sizeof faults / sizeof *faults; k++) {
    const fault *f = &faults[k];
    stops(*state, f);
    hard_report(&(hard_row){hard_text("detection: %s", f->name), f->dial,
                            "exit 3; grain, time, cause, what to change; checkpoint verified",
                            "as said; resumed, the same", f->limit, "stops"});
  }
}

// EXACT: with the limits at .inf nothing is looked for; a sound run at the same speed relative to its own grains is not
// stopped.
static void test_no_false_alarm(void **state) {
  program *p = *state;
  outcome got;
  program_write(p, "s.yaml", FLIGHT("499") "output: {series_every: 1}\n");
  program_run(p, WORDS("run", "s.yaml", "-o", "fast", "-t", "1", "-q", "--no-figures"), &got);
  assert_outcome("just below the stride", &got, 0, "");
}

// EXACT: a grain that went through a plate, as no run so far has brought it about: put there by hand.
static void test_lost_grain(void **state) {
  (void)state;
  draft *d = draft_begin();
  fputs("grains: {count: 40, radius: {law: uniform, min: 1, max: 1}}\nmaterial: {young: 1e6, density: 1}\n"
        "pack: {width: 12}\nintegrator: {dt: 1e-3}\nlimits: {overlap: 1}\n"
        "stages: [{kind: confine, pressure: 1, ramp: 1}]\n",
        d->to);
  engine *e = engine_start(d);
  tal_error err = {""};
  engine_step(e);
  assert_int_equal(tal_inspect(e->sim, &err), TAL_OK);
  e->sim->grains.y[7] = -3;
  tal_neighbours_rebuild(e->sim);
  e->sim->wall_contacts.count = 0;
  assert_int_equal(tal_inspect(e->sim, &err), TAL_INVALID);
  assert_non_null(strstr(err.text, "was lost through a plate at t = "));
  engine_end(e);
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      program_test(test_faults),
      program_test(test_no_false_alarm),
      cmocka_unit_test(test_lost_grain),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
