// Grain-steps per second on one core in a confined assembly under compression, the share of each phase of a step, and
// what a second thread brings. CPU time of the one thread, median of REPEATS, with all that comes now and then; beside
// it the 10th percentile of single steps, which other programs disturb less. Usage: bench_step [-v NAME] [N ...]: the
// variants whose name begins so (all), the sizes (4000 100000 1000000). bench_step -w FILE N: writes the assembly for
// LAMMPS.
#include "boundary.h"
#include "confined.h"
#include "effects.h"
#include "forces.h"
#include "integrate.h"
#include "step.h"

#include <malloc.h>
#include <omp.h>
#include <stdbool.h>
#include <string.h>
#include <time.h>

enum { REPEATS = 7 };

typedef struct variant {
  const char *name;
  const char *contact; // YAML
  double friction;
  const char *rotation;
  const char *integrator; // YAML
} variant;

static const variant variants[] = {
    {"regularised: hertz, damping, rotation", "{normal: hertz, tangential: regularised, exponent: 20}", 0.45, "true",
     "{dt: 1e-5}"},
    {"spring: hertz, damping, rotation", "{normal: hertz, tangential: spring}", 0.45, "true", "{dt: 1e-5}"},
    {"damping: hertz", "{normal: hertz, tangential: none}", 0, "true", "{dt: 1e-5}"},
    {"linear", "{normal: linear, tangential: none, stiffness: 5e5}", 0, "true", "{dt: 1e-5}"},
    {"implicit: the first, one sweep", "{normal: hertz, tangential: regularised, exponent: 20}", 0.45, "true",
     "{scheme: implicit_friction, dt: 1e-4, sweeps: 1}"},
};

static double cpu_seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int ascending(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static tal_sim *create(const variant *v, int n, tal_scene *scene) {
  tal_sim *sim = confined_assembly(scene, n, 1e-3 * sqrt(n),
                                   ", friction: %g%s}\ncontact: %s\nrotation: %s\nintegrator: %s\n"
                                   "stages: [{kind: compress, pressure: 100e3, rate: 5e-3, strain: 0.2}]\n",
                                   v->friction, strcmp(v->name, "linear") ? ", damping: 0.002" : "", v->contact,
                                   v->rotation, v->integrator);
  tal_sim_watch(sim, false); // as nearly all steps of a run
  return sim;
}

static void steps(tal_sim *sim, int count) {
  tal_error err;
  for (int k = 0; k < count; k++)
    if (tal_sim_step(sim, &err)) {
      fprintf(stderr, "%s\n", err.text);
      exit(1);
    }
}

// Median CPU seconds of `count` calls.
static double phase(void (*body)(tal_sim *), tal_sim *sim, int count) {
  double time[REPEATS];
  for (int r = 0; r < REPEATS; r++) {
    double start = cpu_seconds();
    for (int k = 0; k < count; k++)
      body(sim);
    time[r] = cpu_seconds() - start;
  }
  qsort(time, REPEATS, sizeof *time, ascending);
  return time[REPEATS / 2] / count;
}

static void drift(tal_sim *sim) {
  tal_integrate_drift(sim, 0);
}
static void forces(tal_sim *sim) {
  tal_forces_step(sim, 0, 0, !sim->boundary || sim->boundary->press);
}
static void rebuild(tal_sim *sim) {
  tal_neighbours_rebuild(sim);
  if (sim->effects & TAL_EFFECT_IMPLICIT)
    tal_implicit_list(sim);
}
static void refresh(tal_sim *sim) {
  tal_step_refresh(sim, NULL);
}

// Nanoseconds per grain and step of the limit that issue and documents measure against: a contiguous kernel.
static const double limit = 12;

// Bytes in use by this process.
static double bytes_used(void) {
  struct mallinfo2 now = mallinfo2();
  return (double)now.uordblks + (double)now.hblkhd;
}

static size_t touching(tal_sim *sim) {
  size_t count = 0;
  tal_sim_observe(sim);
  for (size_t c = 0; c < sim->pairs.count; c++)
    count += sim->pairs.overlap[c] > 0;
  return count;
}

// Shares of the phases of a step. A sweep drifts its grains itself where it may; a solve cannot be made apart: it is
// what the implicit scheme's rest is.
static void print_phases(tal_sim *sim, double step, double rebuilds, int count) {
  const bool solves = sim->effects & TAL_EFFECT_IMPLICIT;
  double t_drift = solves ? phase(drift, sim, count) : 0, t_forces = solves ? 0 : phase(forces, sim, count),
         t_list = phase(rebuild, sim, count / 10 + 1) * rebuilds, t_graph = phase(refresh, sim, count / 10 + 1) / 250;
  double rest = step - t_drift - t_forces - t_list - t_graph;
  printf("   %5.1f %6.1f %5.1f %5.1f %5.1f", 100 * t_drift / step, 100 * t_forces / step, 100 * t_list / step,
         100 * t_graph / step, 100 * rest / step);
}

typedef struct timing {
  double mean, best; // seconds per step: median of the means of REPEATS; 10th percentile of single steps
} timing;

static timing time_steps(tal_sim *sim, int count) {
  double *single = tal_alloc((size_t)count, sizeof *single), mean[REPEATS];
  for (int r = 0; r < REPEATS; r++) {
    const double start = cpu_seconds();
    steps(sim, count);
    mean[r] = (cpu_seconds() - start) / count;
  }
  for (int k = 0; k < count; k++) {
    const double start = cpu_seconds();
    steps(sim, 1);
    single[k] = cpu_seconds() - start;
  }
  qsort(single, (size_t)count, sizeof *single, ascending);
  qsort(mean, REPEATS, sizeof *mean, ascending);
  const timing t = {mean[REPEATS / 2], single[count / 10]};
  free(single);
  return t;
}

// Wall time of one thread over that of two, in turns; nan where there is one processor.
static double second_thread(tal_sim *sim, int count) {
  if (omp_get_num_procs() < 2)
    return (double)NAN;
  double ratio[REPEATS];
  for (int r = 0; r < REPEATS; r++) {
    double wall[2];
    for (int t = 0; t < 2; t++) {
      omp_set_num_threads(t + 1);
      steps(sim, 1);
      const double start = omp_get_wtime();
      steps(sim, count);
      wall[t] = omp_get_wtime() - start;
    }
    ratio[r] = wall[0] / wall[1];
  }
  omp_set_num_threads(1);
  qsort(ratio, REPEATS, sizeof *ratio, ascending);
  return ratio[REPEATS / 2];
}

static void measure(const variant *v, int n) {
  tal_scene scene;
  const double before = bytes_used();
  tal_sim *sim = create(v, n, &scene);
  const int count = n < 4000 ? 2000 : (int)(8e6 / n) + 5;
  steps(sim, count < 300 ? count : 300);
  const double bytes = bytes_used() - before, grains = (double)sim->grains.count;
  uint64_t rebuilds = sim->neighbours.rebuilds;
  const timing t = time_steps(sim, count);
  const double ns = 1e9 * t.mean / grains;
  double listed = (double)(sim->neighbours.rebuilds - rebuilds) / ((REPEATS + 1) * count);
  printf("%-38s %8d %7.1f %7.1f %7.1f %7.1f %6.2f %6.2f %6.0f %7.2f", v->name, n, 1e3 / ns, ns, 1e9 * t.best / grains,
         1e9 * t.mean / (double)touching(sim), ns / limit, (double)sim->pairs.count / grains, bytes / grains,
         second_thread(sim, count / 4 + 1));
  print_phases(sim, t.mean, listed, count / 10 + 1);
  printf("\n");
  fflush(stdout);
  tal_sim_free(sim);
  tal_scene_clear(&scene);
}

// The assembly of the spring law as a data file of LAMMPS, for peers.sh.
static int write_data(const char *path, int n) {
  tal_scene scene;
  tal_sim *sim = create(&variants[1], n, &scene);
  steps(sim, 300);
  const tal_grains *g = &sim->grains;
  double low[2] = {(double)INFINITY, (double)INFINITY}, high[2] = {-(double)INFINITY, -(double)INFINITY};
  for (size_t i = 0; i < g->count; i++) {
    low[0] = fmin(low[0], g->x[i] - g->r[i]);
    high[0] = fmax(high[0], g->x[i] + g->r[i]);
    low[1] = fmin(low[1], g->y[i] - g->r[i]);
    high[1] = fmax(high[1], g->y[i] + g->r[i]);
  }
  FILE *to = fopen(path, "w");
  if (!to)
    return 1;
  fprintf(to, "confined assembly\n\n%zu atoms\n1 atom types\n%.9g %.9g xlo xhi\n%.9g %.9g ylo yhi\n", g->count, low[0],
          high[0], low[1], high[1]);
  fprintf(to, "-1e-3 1e-3 zlo zhi\n\nAtoms # sphere\n\n");
  for (size_t i = 0; i < g->count; i++)
    fprintf(to, "%zu 1 %.17g 1 %.17g %.17g 0\n", i + 1, 2 * g->r[i], g->x[i], g->y[i]);
  tal_sim_free(sim);
  tal_scene_clear(&scene);
  return fclose(to) != 0;
}

// The variants whose name begins with `wanted`.
static void measure_all(const char *wanted, int n) {
  for (size_t v = 0; v < sizeof variants / sizeof *variants; v++)
    if (strncmp(variants[v].name, wanted, strlen(wanted)) == 0)
      measure(&variants[v], n);
}

int main(int argc, char **argv) {
  if (argc == 4 && strcmp(argv[1], "-w") == 0)
    return write_data(argv[2], atoi(argv[3]));
  const bool chosen = argc > 2 && strcmp(argv[1], "-v") == 0;
  const char *wanted = chosen ? argv[2] : "";
  const int first = chosen ? 3 : 1;
  omp_set_num_threads(1);
  printf("%-38s %8s %7s %7s %7s %7s %6s %6s %6s %7s   share of a step [%%]\n", "variant", "N", "M gs/s", "ns per",
         "best", "ns per", "over", "slots", "bytes", "second");
  printf("%-38s %8s %7s %7s %7s %7s %6s %6s %6s %7s   drift  sweep  list graph  rest\n", "", "", "", "grain", "steps",
         "contact", "limit", "/grain", "/grain", "thread");
  if (first == argc) {
    measure_all(wanted, 4000);
    measure_all(wanted, 100000);
    measure_all(wanted, 1000000);
  }
  for (int k = first; k < argc; k++)
    measure_all(wanted, atoi(argv[k]));
  return 0;
}
