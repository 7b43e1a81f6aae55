// Again and again: a contact driven to and fro, a crystal sheared a hundred times, crystals strained until they give
// way, centres that nearly coincide.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "engine.h"
#include "hard.h"
#include "physics.h"
#include <float.h>
#include <omp.h>

// ---- one contact ----

typedef struct drive {
  double lost, drift, residual; // [J], [N] change of the force between the first cycle's end and the last's, ledger
} drive;

// A held grain on a wall that moves to and fro by `amplitude` for `cycles`; 4 `quarter` steps a cycle.
static drive to_and_fro(double amplitude, int cycles, int quarter, const char *scheme) {
  draft *d = draft_begin();
  fprintf(d->to,
          "grains: {thickness: 1, list: [{x: 0, y: 0.875, r: 1, fixed: true}, {x: 9, y: 9, r: 1}]}\n"
          "material: {density: 1, friction: 0.5}\ncontact: {normal: linear, stiffness: 1024, tangential: spring, "
          "tangential_ratio: 0.5}\nrotation: false\nwalls: [{from: [-9, 0], to: [9, 0], velocity: [1, 0]}]\n"
          "integrator: {scheme: %s, dt: %.17g}\nstages: [{kind: free, duration: 1e9}]\n",
          scheme, amplitude / quarter);
  engine *e = engine_start(d);
  double first = 0;
  for (int cycle = 0; cycle < cycles; cycle++) {
    static const double way[] = {1, -1, -1, 1};
    for (int part = 0; part < 4; part++) {
      e->sim->walls.wall[0].vx = way[part];
      engine_steps(e, quarter);
    }
    if (cycle == 0) {
      engine_row(e); // brings histories up to date
      first = e->sim->wall_contacts.spring[0];
    }
  }
  const tal_row row = engine_row(e);
  const drive result = {row.dissipated_friction, fabs(e->sim->wall_contacts.spring[0] - first), row.energy_residual};
  engine_end(e);
  return result;
}

// ROUND: the loop of a spring with a cap: nothing is lost up to s = mu fn / kt, beyond it mu fn (A - s) on the first
// way and 2 mu fn (A - s) each time the wall turns; each cycle ends where the last one did.
static void test_contact_cycles(void **state) {
  (void)state;
  static const char *const scheme[] = {"verlet", "implicit_friction"};
  const double cap = 0.5 * 1024 * 0.125, slip = cap / 512;
  const int cycles = (int)hard_size(100, 10000, 100000);
  double loop = 0, drift = 0, lost = 0;
  for (int s = 0; s < 2; s++) {
    const drive small = to_and_fro(0.5 * slip, cycles, 16, scheme[s]),
                large = to_and_fro(4 * slip, cycles, 64, scheme[s]);
    const double exact = cap * (3 * slip + (2.0 * cycles - 1) * 6 * slip + 2 * slip); // the last way ends half way
    loop = fmax(loop, fabs(large.lost / exact - 1));
    drift = fmax(drift, fmax(small.drift, large.drift) / cap);
    lost = fmax(lost, fabs(small.lost) / (0.5 * cap * slip));
    assert_true(fabs(small.residual) < 1e-12 && fabs(large.residual) < 1e-12);
  }
  if (!(loop < 1e-12 && drift == 0 && lost < 2e-3)) // the last step of implicit friction is half booked
    fail_msg("loop %g, drift %g, lost %g", loop, drift, lost);
  hard_report(
      &(hard_row){"shear reversal, one contact", hard_text("%d cycles, amplitude 0.5 and 4 of mu fn / kt", cycles),
                  "hysteresis loop in closed form; each cycle ends where the last did",
                  hard_text("loss to %.0e, drift exactly %g, both schemes", loop, drift),
                  "amplitude mu fn / kt: below nothing is lost", "2 mu fn (A - mu fn / kt) each time it turns"});
}

// ---- a crystal ----

static const double young = 1e6, poisson = 0.3;

// Overlap of touching unit grains under the force.
static double overlap_under(double force) {
  return pow(force / (4.0 / 3 * young / (2 * (1 - poisson * poisson)) * sqrt(0.5)), 2.0 / 3);
}

static engine *crystal(const char *pattern, double gap, int across, const char *more, const char *stages) {
  draft *d = draft_begin();
  fprintf(d->to,
          "grains: {radius: {law: uniform, min: 1, max: 1}, thickness: 1}\n"
          "material: {young: %g, poisson: %g, density: 1, friction: 0.3, damping: 2e-3}\n"
          "pack: {method: lattice, pattern: %s, columns: %d, rows: %d, gap: %.17g}\n"
          "contact: {tangential: spring}\n%sstages:\n%s",
          young, poisson, pattern, across, across, gap, more, stages);
  return engine_start(d);
}

// ROUND: a hundred cycles of +-1e-4 of shear: the ledger closes, nothing wanders off, and what is lost in a cycle does
// not grow.
static void test_crystal_cycles(void **state) {
  (void)state;
  const int cycles = (int)hard_size(20, 100, 1000);
  char *stages = tal_alloc((size_t)cycles + 1, 200), *end = stages;
  for (int k = 0; k < cycles; k++)
    end += sprintf(end, "  - {kind: shear, pressure: 1e3, rate: 2e-3, strain: 1e-4}\n"
                        "  - {kind: shear, pressure: 1e3, rate: -2e-3, strain: 2e-4}\n"
                        "  - {kind: shear, pressure: 1e3, rate: 2e-3, strain: 1e-4}\n");
  engine *e = crystal("triangular, cut: {shape: circle, radius: 8.2}", -overlap_under(2e3 / sqrt(3)), 11,
                      "integrator: {dt: 1e-3}\n", stages);
  free(stages);
  const size_t n = e->sim->grains.count;
  double *x = tal_alloc(n, sizeof *x), *y = tal_alloc(n, sizeof *y), moved = 0, lost[2] = {0};
  tal_row row;
  for (int cycle = 0; cycle < cycles; cycle++) {
    while (!(e->sim->run.stage == 3 * cycle + 2 && e->sim->run.stage_done))
      engine_step(e);
    row = engine_row(e);
    if (cycle == cycles / 2 - 1) {
      memcpy(x, e->sim->grains.x, n * sizeof *x);
      memcpy(y, e->sim->grains.y, n * sizeof *y);
      lost[0] = row.dissipated_friction + row.dissipated_damping;
    }
  }
  lost[1] = row.dissipated_friction + row.dissipated_damping - lost[0];
  for (size_t i = 0; i < n; i++)
    moved = fmax(moved, hypot(e->sim->grains.x[i] - x[i], e->sim->grains.y[i] - y[i]));
  assert_true(lost[1] < 0.5 * lost[0] && fabs(row.energy_residual) < 2e-3 && moved < 2e-3);
  assert_near(row.shear_strain, 0, 1e-15, 1);
  hard_report(
      &(hard_row){hard_text("%d small cycles of a crystal", cycles), "shear +-1e-4 of 62 grains, spring friction",
                  "ledger closes; losses die down (shakedown); nothing wanders",
                  hard_text("residual %.0e; loss in the second half %.2g of the first's; moved %.0e radii in it",
                            row.energy_residual, lost[1] / lost[0], moved),
                  "none found", "-"});
  free(x);
  free(y);
  engine_end(e);
}

// ---- through the bifurcation ----

// ROUND: cocircular cells everywhere, strained until rows buckle: the graph is never broken (the power of the cells is
// that of their boundary to round-off), the strain rate is as imposed, and the two backends give the same bits.
static void test_bifurcation(void **state) {
  (void)state;
  static const char *const pattern[] = {"triangular", "square"}, *const backend[] = {"qhull", "cgal"};
  for (int k = 0; k < 2; k++) {
    engine *both[2] = {NULL};
    double power = 0, rate = 0, ledger = 0, before = 0, dense = 0;
    for (int b = 0; b < 2; b++) {
      if (b && !geo_delaunay_backend_find("cgal"))
        continue;
      char more[200];
      snprintf(more, sizeof more, "continuum: {backend: %s, refresh: 10, peel: 0.3}\nintegrator: {dt: 4e-4}\n",
               backend[b]);
      engine *e = both[b] =
          crystal(pattern[k], -overlap_under(k ? 2e3 : 2e3 / sqrt(3)), (int)hard_size(12, 16, 24), more,
                  "  - {kind: compress, boundary: minimal, pressure: 1e3, rate: 0.05, strain: 0.15}\n");
      while (!tal_sim_done(e->sim)) {
        engine_step(e);
        if (e->sim->run.step % 10)
          continue;
        const tal_row row = engine_row(e);
        power = fmax(power, fabs(row.power_contacts - row.power_boundary) / fmax(fabs(row.power_contacts), 1));
        rate = fmax(rate, fabs(row.strain_rate_error_yy));
        ledger = fmax(ledger, fabs(row.energy_residual));
        dense = fmax(dense, row.solid_fraction);
        if (before == 0)
          before = row.solid_fraction;
      }
    }
    assert_true(power < 1e-10 && rate < 1e-13 && ledger < 0.01 && dense > before + (k ? 0.08 : 0.005));
    hard_report(&(hard_row){hard_text("%s crystal through the bifurcation", pattern[k]),
                            "cocircular cells, compressed by 15 %, minimal boundary",
                            "power of the cells = of their rim; strain rate as imposed; CGAL and qhull: same bits",
                            hard_text("to %.0e and %.0e 1/s; residual %.0e; solid fraction %.3f to %.3f", power, rate,
                                      ledger, before, dense),
                            "none found", "-"});
    if (both[1])
      assert_same_motion(both[0], both[1]);
    engine_end(both[0]);
    if (both[1])
      engine_end(both[1]);
  }
}

// ---- nearly one place ----

static tal_status two_at(double distance, double small, char *said) {
  draft *d = draft_begin();
  fprintf(
      d->to,
      "grains: {thickness: 1, list: [{x: 0, y: 0, r: 1}, {x: %.17g, y: 0, r: %.17g}, {x: 0, y: 2.5, r: 1}, {x: 3, y: "
      "0, r: 1}]}\nmaterial: {young: 1, density: 1}\nintegrator: {dt: 1e-6}\n"
      "stages: [{kind: free, duration: 1e-3}]\n",
      distance, small);
  tal_scene scene;
  tal_sim *sim;
  tal_error err = {""};
  draft_load(d, &scene);
  tal_status status = tal_sim_create(&sim, &scene, &err);
  while (status == TAL_OK && !tal_sim_done(sim))
    status = tal_sim_step(sim, &err);
  tal_row row;
  if (sim)
    tal_sim_row(sim, &row); // with a graph
  snprintf(said, 200, "%.199s", err.text);
  tal_sim_free(sim);
  tal_scene_clear(&scene);
  return status;
}

// EXACT: grains at (nearly) one place are refused as too deep an overlap, never a division by nothing; grains so small
// that their centres nearly coincide, but do not overlap, run, and have a sound graph.
static void test_duplicates(void **state) {
  (void)state;
  char said[200];
  for (double distance = 1e-3; distance > 1e-300; distance *= 1e-20) {
    assert_int_equal(two_at(distance, 1, said), TAL_INVALID);
    assert_non_null(strstr(said, "grain 0 overlaps by "));
  }
  assert_int_equal(two_at(0, 1, said), TAL_BAD_INPUT);
  assert_non_null(strstr(said, "grain"));
  for (double r = 1e-2; r > 1e-10; r *= 1e-2) {
    draft *d = draft_begin();
    fputs("grains:\n  thickness: 1\n  list:\n", d->to);
    for (int i = 0; i < 4; i++)
      for (int j = 0; j < 4; j++) // a large grain, and beside it two small ones, as good as in one place
        fprintf(d->to,
                "  - {x: %d, y: %d, r: 1}\n  - {x: %.17g, y: %.17g, r: %.17g}\n  - {x: %.17g, y: %.17g, r: %.17g}\n",
                3 * i, 3 * j, 3 * i + 1.2, 3.0 * j, r, 3 * i + 1.2 + 2 * r, 3.0 * j, r);
    fputs("material: {young: 1, density: 1}\nlimits: {overlap: 0.5}\nintegrator: {dt: 1e-12}\n"
          "stages: [{kind: free, duration: 1e-10}]\n",
          d->to);
    engine *e = engine_start(d);
    engine_finish(e);
    const tal_row row = engine_row(e);
    assert_true(row.solid_fraction > 0.2 && row.solid_fraction < 0.5);
    assert_true(fabs(row.power_contacts - row.power_boundary) <= 1e-12 * (1 + fabs(row.power_contacts)));
    engine_end(e);
  }
  hard_report(&(hard_row){"nearly duplicate centres", "distance 1e-3 to 0 of a radius; tiny grains 1e-2 to 1e-10",
                          "refused where they overlap; else a sound graph", "as said", "limits.overlap",
                          "exit 3, naming the grain"});
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_contact_cycles),
      cmocka_unit_test(test_crystal_cycles),
      cmocka_unit_test(test_bifurcation),
      cmocka_unit_test(test_duplicates),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
