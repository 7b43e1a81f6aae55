// Runs 250 steps of one small scene, for counting their instructions (run.sh): costs NAME. Without a name it prints the
// names, one a line: a scene each, which differs from another by one effect. The grains are a confined assembly at
// rest; steps are so short that they stay there.
#include "../bench/confined.h"
#include "effects.h"
#include "output.h"
#include "sim.h"
#include "step.h"

#include <ftw.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { GRAINS = 1000, WARM = 20, STEPS = 250 };

typedef struct variant {
  const char *name;
  const char *material; // YAML, after friction
  double friction;
  const char *contact, *more, *integrator, *stage; // YAML
} variant;

#define HERTZ       "normal: hertz, "
#define LINEAR      "normal: linear, stiffness: 5e5, "
#define NONE        "tangential: none"
#define REGULARISED "tangential: regularised, vR: 7.5e-6"
#define SPRING      "tangential: spring"
#define DAMPED      ", damping: 0.002"
#define VERLET      "dt: 1e-9"
#define IMPLICIT    "scheme: implicit_friction, dt: 1e-9, sweeps: 1"
#define FREE        "kind: free, duration: 1"
#define COMPRESS    "kind: compress, pressure: 100e3, rate: 5e-3, strain: 0.2, boundary: "
#define STILL       "rotation: false\n"

static const variant variants[] = {
    {"hertz", "", 0, HERTZ NONE, "", VERLET, FREE},
    {"linear", "", 0, LINEAR NONE, "", VERLET, FREE},
    {"hertz, damping", DAMPED, 0, HERTZ NONE, "", VERLET, FREE},
    {"linear, damping", "", 0, LINEAR "damping: 3, " NONE, "", VERLET, FREE},
    {"hertz, regularised", "", 0.45, HERTZ REGULARISED, STILL, VERLET, FREE},
    {"hertz, spring", "", 0.45, HERTZ SPRING, STILL, VERLET, FREE},
    {"hertz, damping, regularised", DAMPED, 0.45, HERTZ REGULARISED, STILL, VERLET, FREE},
    {"hertz, damping, regularised, rotation", DAMPED, 0.45, HERTZ REGULARISED, "", VERLET, FREE},
    {"hertz, damping, spring, rotation", DAMPED, 0.45, HERTZ SPRING, "", VERLET, FREE},
    {"the same, gravity", DAMPED, 0.45, HERTZ REGULARISED, "gravity: [0, -9.81]\n", VERLET, FREE},
    {"the same, two walls", DAMPED, 0.45, HERTZ REGULARISED,
     "walls: [{from: [-1, 0], to: [1, 0]}, {from: [0, 1], to: [0, -1]}]\n", VERLET, FREE},
    {"the same, pressure", DAMPED, 0.45, HERTZ REGULARISED, "", VERLET, COMPRESS "pressure"},
    {"the same, pressure, a row", DAMPED, 0.45, HERTZ REGULARISED, "", VERLET, COMPRESS "pressure"},
    {"the same, pressure, a row and a frame", DAMPED, 0.45, HERTZ REGULARISED, "", VERLET, COMPRESS "pressure"},
    {"the same, membrane", DAMPED, 0.45, HERTZ REGULARISED, "", VERLET,
     COMPRESS "membrane, membrane: {stiffness: 1e6}"},
    {"the same, minimal exact", DAMPED, 0.45, HERTZ REGULARISED, "", VERLET, COMPRESS "minimal, method: exact"},
    {"the same, minimal of order 3", DAMPED, 0.45, HERTZ REGULARISED, "", VERLET,
     COMPRESS "minimal, method: exact, order: 3"},
    {"the same, minimal penalty", DAMPED, 0.45, HERTZ REGULARISED, "", VERLET, COMPRESS "minimal, method: penalty"},
    {"implicit regularised, damping", DAMPED, 0.45, HERTZ REGULARISED, "", IMPLICIT, FREE},
    {"implicit spring, damping", DAMPED, 0.45, HERTZ SPRING, "", IMPLICIT, FREE},
    {"implicit regularised, damping, pressure", DAMPED, 0.45, HERTZ REGULARISED, "", IMPLICIT, COMPRESS "pressure"},
    // Effects named and nil: as if they were not named.
    {"nil damping", ", damping: 0", 0, HERTZ NONE, "", VERLET, FREE},
    {"nil friction", "", 0, HERTZ REGULARISED, "", VERLET, FREE},
    {"nil spring friction", "", 0, HERTZ SPRING, "", VERLET, FREE},
    {"nil gravity", "", 0, HERTZ NONE, "gravity: [0, 0]\n", VERLET, FREE},
    {"implicit and nothing to solve", "", 0, HERTZ NONE, "", IMPLICIT, FREE},
};

static void give_up(const char *why) {
  fprintf(stderr, "costs: %s\n", why);
  exit(1);
}

static tal_sim *create(const variant *v, tal_scene *scene) {
  return confined_assembly(scene, GRAINS, 32e-3,
                           ", friction: %g%s}\ncontact: {%s}\n%sintegrator: {%s}\nstages: [{%s}]\n", v->friction,
                           v->material, v->contact, v->more, v->integrator, v->stage);
}

// What is counted, found by its name: steps and, where there is an output, what is written then.
void measured_steps(tal_sim *sim, tal_output *output, bool frame);
__attribute__((noinline)) void measured_steps(tal_sim *sim, tal_output *output, bool frame) {
  tal_error err;
  tal_status status = TAL_OK;
  for (int k = 0; k < STEPS && !status; k++) {
    tal_sim_watch(sim, output && k == STEPS - 1);
    status = tal_sim_step(sim, &err);
  }
  if (!status && output) {
    tal_row row;
    tal_sim_row(sim, &row);
    status = tal_output_row(output, &row, &err);
    if (!status && frame)
      status = tal_output_fields(output, sim, &err);
  }
  if (status)
    give_up(err.text);
}

static int remove_file(const char *path, const struct stat *info, int kind, struct FTW *at) {
  (void)info, (void)kind, (void)at;
  return remove(path);
}

static void run(const variant *v) {
  tal_scene scene;
  tal_error err;
  tal_sim *sim = create(v, &scene);
  for (int k = 0; k < WARM; k++)
    if (tal_sim_step(sim, &err))
      give_up(err.text);
  char dir[] = "/tmp/talus-costs-XXXXXX";
  tal_output *output = NULL;
  if (strstr(v->name, "a row") && (!mkdtemp(dir) || tal_output_create(&output, dir, &scene, &err)))
    give_up("no folder to write to");
  measured_steps(sim, output, strstr(v->name, "a frame") != NULL);
  if (output) {
    tal_output_close(output);
    nftw(dir, remove_file, 8, FTW_DEPTH | FTW_PHYS);
  }
  tal_sim_free(sim);
  tal_scene_clear(&scene);
}

int main(int argc, char **argv) {
  omp_set_num_threads(1);
  for (size_t v = 0; v < sizeof variants / sizeof *variants; v++)
    if (argc < 2)
      printf("%s\n", variants[v].name);
    else if (strcmp(argv[1], variants[v].name) == 0) {
      run(&variants[v]);
      return 0;
    }
  return argc >= 2;
}
