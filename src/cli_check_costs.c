// What each effect of a scene costs per step: a ladder of trials on the packed grains, one effect more on each rung.
// The rungs are tried in turns, the fastest of each counts. The trials have a simulation of their own.
#include "cli_check.h"

#include "effects.h"
#include "neighbours.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <time.h>

enum { TURNS = 12, RUNGS = 8 };

typedef struct rung {
  unsigned effects; // of the rungs below, too
  double seconds;   // per step
  char name[96];
} rung;

static const struct {
  unsigned bits;
  const char *name;
} names[] = {{TAL_EFFECT_HERTZ, "hertz"},
             {TAL_EFFECT_DAMPING, "damping"},
             {TAL_EFFECT_REGULARISED, "regularised friction"},
             {TAL_EFFECT_SPRING, "spring friction"},
             {TAL_EFFECT_SPIN, "rotation"},
             {TAL_EFFECT_GRAVITY, "gravity"},
             {TAL_EFFECT_WALLS, "walls or plates"},
             {TAL_EFFECT_BOUNDARY, "boundary forces"},
             {TAL_EFFECT_HELD, "driven grains"},
             {TAL_EFFECT_IMPLICIT, "solved implicitly"}};

void tal_check_effect_names(unsigned effects, char *to, size_t size) {
  size_t used = 0;
  if (size)
    to[0] = '\0';
  for (size_t k = 0; k < sizeof names / sizeof *names && used < size; k++)
    if (effects & names[k].bits)
      used += (size_t)snprintf(to + used, size - used, "%s%s", used ? ", " : "", names[k].name);
}

static double cpu_now(void) {
  struct timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// What comes on in one piece: what is solved implicitly is solved together, and friction turns the grains.
static size_t make_rungs(unsigned all, rung *to) {
  const unsigned solved = TAL_EFFECT_DAMPING | TAL_EFFECT_FRICTION | TAL_EFFECT_SPIN | TAL_EFFECT_IMPLICIT;
  const unsigned groups[] = {TAL_EFFECT_HERTZ,
                             all & TAL_EFFECT_IMPLICIT ? solved : TAL_EFFECT_DAMPING,
                             TAL_EFFECT_FRICTION | TAL_EFFECT_SPIN,
                             TAL_EFFECT_GRAVITY,
                             TAL_EFFECT_WALLS,
                             TAL_EFFECT_BOUNDARY,
                             TAL_EFFECT_HELD};
  size_t count = 0;
  for (size_t k = 0; k < sizeof groups / sizeof *groups; k++) {
    const unsigned below = count ? to[count - 1].effects : 0, more = all & groups[k] & ~below;
    if (k > 0 && !more)
      continue;
    to[count] = (rung){.effects = below | more, .seconds = (double)INFINITY};
    tal_check_effect_names(more, to[count].name, sizeof to[count].name);
    count++;
  }
  return count;
}

static bool try_rung(tal_sim *sim, rung *r, int steps) {
  const unsigned all = sim->effects;
  tal_error err;
  bool fine = !tal_sim_done(sim);
  sim->effects = r->effects;
  tal_neighbours_rebuild(sim); // contacts keep what the effects ask for
  fine = fine && tal_sim_step(sim, &err) == TAL_OK;
  const double started = cpu_now();
  for (int k = 0; k < steps && fine; k++)
    fine = tal_sim_step(sim, &err) == TAL_OK && sim->effects == r->effects;
  if (fine)
    r->seconds = fmin(r->seconds, (cpu_now() - started) / steps);
  sim->effects = all;
  tal_neighbours_rebuild(sim);
  return fine;
}

void tal_check_print_costs(tal_scene *scene, double step_seconds) {
  tal_sim *sim;
  tal_error err;
  for (size_t s = 0; s < scene->stage_count; s++)
    scene->stages[s].integrator.dt *= 1e-3; // lest the packing flies apart without an effect
  omp_set_num_threads(1);
  if (tal_sim_create(&sim, scene, &err))
    return;
  tal_sim_watch(sim, false);
  rung ladder[RUNGS];
  const size_t count = make_rungs(sim->effects, ladder);
  const int steps = (int)fmin(fmax(4e-3 / step_seconds, 2), 1000);
  for (int turn = 0; turn < TURNS; turn++)
    for (size_t k = 0; k < count; k++)
      if (!try_rung(sim, &ladder[k], steps)) {
        tal_sim_free(sim);
        return;
      }
  const double ns = 1e9 / (double)sim->grains.count;
  printf("costs         %.3g ns per grain and step on one core: ", ns * ladder[count - 1].seconds);
  for (size_t k = 0; k < count; k++)
    if (k == 0)
      printf("%s contacts and motion %.3g", *ladder[k].name ? ladder[k].name : "linear", ns * ladder[k].seconds);
    else
      printf(", %s %+.3g", ladder[k].name, ns * (ladder[k].seconds - ladder[k - 1].seconds));
  printf("\n");
  tal_sim_free(sim);
}
