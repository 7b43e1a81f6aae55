// talus check SCENE.yaml [--set K=V]...: validates, packs, and prints what the run would be and cost. Writes nothing.
#include "cli.h"

#include "boundary_minimal.h"
#include "cli_check.h"
#include "critical.h"
#include "damping.h"
#include "effects.h"
#include "integrate.h"
#include "run.h"
#include "sim.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static void print_effects(const tal_sim *sim) {
  char names[256];
  tal_check_effect_names(sim->effects, names, sizeof names);
  printf("effects       %s%s", sim->effects & TAL_EFFECT_HERTZ ? "" : "linear contact, ", names);
  printf("  (first stage)\nkernel        %s, mask %u\n", sim->scene->integrator.scheme, sim->effects & TAL_EFFECT_LAW);
}

// Bytes of grains and slots while someone looks at them.
static double memory(const tal_sim *sim) {
  double grain = 0, slot = 0;
#define X(type, name, unit, kept, meaning) grain += sizeof(type);
  TAL_GRAIN_FIELDS(X)
#undef X
#define X(type, name, unit, kept, meaning) slot += sizeof(type);
  TAL_CONTACT_FIELDS(X)
#undef X
  const double graph = 2 * (3 + 3) * sizeof(int32_t) + 2 * sizeof(double) + 2; // per grain: two cells, references
  grain += sizeof(tal_grain_record) + sizeof(int32_t);
  slot += sizeof(tal_force_record) + 2 * sizeof(int32_t);
  return (double)sim->grains.count * (grain + graph) + (double)sim->pairs.capacity * slot;
}

static double clock_now(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// Steps of a stage; a confine stage is taken as twice its ramp.
static double planned_steps(const tal_scene_stage *stage) {
  double duration = stage->duration > 0 ? stage->duration : 0;
  if (stage->ramp > 0)
    duration = 2 * stage->ramp;
  if (stage->strain > 0)
    duration = stage->strain / fabs(stage->rate);
  return duration / stage->integrator.dt;
}

// Steps per second here, from a short trial on the packed grains.
static double measured_rate(tal_sim *sim) {
  double started = clock_now(), took = 0;
  const int64_t first = sim->run.step;
  tal_sim_watch(sim, false);
  while (took < 0.5 && !tal_sim_done(sim)) {
    for (int k = 0; k < 20; k++)
      if (tal_sim_step(sim, NULL))
        return (double)(sim->run.step - first) / (clock_now() - started);
    took = clock_now() - started;
  }
  return took > 0 ? (double)(sim->run.step - first) / took : (double)NAN;
}

static double first_pressure(const tal_scene *scene) {
  for (size_t s = 0; s < scene->stage_count; s++)
    if (scene->stages[s].pressure > 0)
      return scene->stages[s].pressure;
  return (double)NAN;
}

static double first_rate(const tal_scene *scene) {
  for (size_t s = 0; s < scene->stage_count; s++)
    if (fabs(scene->stages[s].rate) > 0)
      return fabs(scene->stages[s].rate);
  return (double)NAN;
}

static double packed_height(const tal_grains *g) {
  double bottom = (double)INFINITY, top = -(double)INFINITY;
  for (size_t i = 0; i < g->count; i++) {
    bottom = fmin(bottom, g->y[i] - g->r[i]);
    top = fmax(top, g->y[i] + g->r[i]);
  }
  return top - bottom;
}

// The damped law in figures: two mean grains that meet at `speed`; its name, "any speed" where it makes no difference.
static void print_impact(const tal_sim *sim, const char *where, double speed) {
  const tal_scene *scene = sim->scene;
  tal_pair pair = tal_damping_mean_pair(scene, &sim->constants);
  tal_impact impact = tal_damping_impact(scene, &pair, speed);
  printf("impact        two mean grains at %s: e %.4g, contact %.4g s", where, impact.restitution, impact.duration);
  if (isfinite(first_rate(scene)))
    printf(" = %.3g t0", impact.duration * first_rate(scene));
  if (pair.damping > 0)
    printf(" (damping %.4g %s, %s %.4g)", pair.damping, sim->effects & TAL_EFFECT_HERTZ ? "s" : "N s/m",
           sim->effects & TAL_EFFECT_HERTZ ? "T/tau" : "zeta", tal_damping_number_at(scene, &pair, speed));
  printf("\n");
}

static void print_impacts(const tal_sim *sim) {
  const tal_constants *k = &sim->constants;
  char where[80];
  if (!(sim->effects & TAL_EFFECT_HERTZ)) {
    print_impact(sim, "any speed", 1);
    return;
  }
  if (isfinite(k->vR)) {
    snprintf(where, sizeof where, "vR = %.4g m/s", k->vR);
    print_impact(sim, where, k->vR);
  }
  if (isfinite(sim->scene->contact.restitution_speed)) {
    snprintf(where, sizeof where, "restitution_speed = %.4g m/s", k->restitution_speed);
    print_impact(sim, where, k->restitution_speed);
  }
}

static bool any_listed_mass(const tal_scene *scene) {
  for (size_t i = 0; i < scene->grains.list_count; i++)
    if (!isnan(scene->grains.list[i].mass))
      return true;
  return false;
}

// phi of each stage that has a rate, and how far mass scaling is from breaking it.
static void print_quasistatic(const tal_sim *sim, double height) {
  const tal_scene *scene = sim->scene;
  double psi = 2 * sim->constants.mean_radius / height;
  for (size_t s = 0; s < scene->stage_count; s++) {
    const tal_scene_stage *stage = &scene->stages[s];
    double pressure = stage->pressure > 0 ? stage->pressure : first_pressure(scene);
    if (!(fabs(stage->rate) > 0) || isnan(pressure))
      continue;
    double phi = tal_quasistatic_coefficient(sim, fabs(stage->rate), pressure, height);
    printf("phi, psi      %.4g (quasi-static well below 1), %.4g (size, 2R/L) in stage %zu", phi, psi, s);
    if (!any_listed_mass(scene))
      printf("; phi is %g at mass_scaling %.3g", TAL_QUASISTATIC_LIMIT,
             scene->mass_scaling * TAL_QUASISTATIC_LIMIT / phi);
    printf("\n");
    if (phi > TAL_QUASISTATIC_LIMIT)
      printf("warning       stage %zu is not quasi-static: phi above %g; lower mass_scaling or rate\n", s,
             TAL_QUASISTATIC_LIMIT);
  }
}

static void print_numbers(const tal_sim *sim) {
  const tal_scene *scene = sim->scene;
  const tal_constants *k = &sim->constants;
  double height = packed_height(&sim->grains), pressure = first_pressure(scene);
  printf("grains        %zu, mean radius %.5g m, thickness %.5g m, mean mass %.5g kg (scaled by %g)\n",
         sim->grains.count, k->mean_radius, k->thickness, k->mean_mass, scene->mass_scaling);
  printf("packing       height %.5g m, solid fraction %.4f, coordination %.3f, largest overlap %.2g m\n", height,
         sim->packing_solid_fraction, sim->packing_coordination, sim->packing_overlap);
  if (isfinite(k->vR))
    printf("vR            %.5g m/s\n", k->vR);
  const double dt = (double)tal_integrate_longest(&scene->integrator) * scene->integrator.dt;
  double now = tal_critical_step(sim),
         confined = tal_critical_step_scene(scene, k, k->mean_mass / 2, !(sim->effects & TAL_EFFECT_IMPLICIT));
  printf("dt/dt_crit    %.3g on the packed grains", dt / now);
  if (isfinite(confined))
    printf(", %.3g for two mean grains under the load of the scene", dt / confined);
  printf("\n");
  double friction = tal_friction_step(sim, pressure);
  if (isfinite(friction) && !(sim->effects & TAL_EFFECT_IMPLICIT))
    printf("friction      explicit steps above %.3g s chatter by more than vR; dt is %.3g times that\n", friction,
           dt / friction);
  print_impacts(sim);
  print_quasistatic(sim, height);
}

// What the explicit step lets a penalty be, for the loop of the packing; contacts take their share of it later.
static void print_penalties(tal_sim *sim) {
  for (size_t s = 0; s < sim->scene->stage_count; s++) {
    const tal_scene_stage *stage = &sim->scene->stages[s];
    if (!stage->method || strcmp(stage->method, "penalty") != 0)
      continue;
    const double dt = (double)tal_integrate_longest(&stage->integrator) * stage->integrator.dt;
    double limit = tal_minimal_penalty_limit(tal_minimal_decay_planned(sim, stage), dt, (double)INFINITY);
    printf("penalty       stage %zu: explicit limit K < %.4g N m s at dt = %g s, less what contacts take", s, limit,
           dt);
    if (isnan(stage->penalty))
      printf("; half of what is left is taken\n");
    else
      printf("; K is %.3g times that\n", stage->penalty / limit);
  }
}

static bool same_cost(const tal_scene_integrator *a, const tal_scene_integrator *b) {
  const bool tolerance = a->tolerance == b->tolerance || (isnan(a->tolerance) && isnan(b->tolerance));
  return strcmp(a->scheme, b->scheme) == 0 && a->m == b->m && a->n == b->n && a->q == b->q && a->sweeps == b->sweeps &&
         tolerance;
}

// The same for another integrator than the first stage's, tried there; the first's where that cannot be.
static double rate_with(const tal_scene *scene, const tal_scene_integrator *integrator, double first) {
  tal_scene tried = *scene;
  tried.stages = tal_alloc(scene->stage_count, sizeof *tried.stages);
  memcpy(tried.stages, scene->stages, scene->stage_count * sizeof *tried.stages);
  tried.stages[0].integrator = *integrator; // the others stay: vR follows from their rates
  tal_sim *sim;
  double rate = (double)NAN;
  if (!tal_sim_create(&sim, &tried, NULL)) {
    rate = measured_rate(sim);
    tal_sim_free(sim);
  }
  free(tried.stages);
  return rate > 0 ? rate : first;
}

static void print_cost(tal_sim *sim, tal_scene *scene) {
  double steps = 0, seconds = 0, grains = (double)sim->grains.count;
  printf("memory        %.3g MB for grains, contacts and graph\n", 1e-6 * memory(sim));
  if (scene->stage_count == 0)
    return;
  tal_run_threads(sim->grains.count, 0);
  double *rate = tal_alloc(scene->stage_count, sizeof *rate); // steps per second of each stage
  const double first = measured_rate(sim);
  for (size_t s = 0; s < scene->stage_count; s++) {
    const tal_scene_stage *stage = &scene->stages[s];
    const double planned = planned_steps(stage);
    size_t like = 0; // the first stage of this cost
    while (!same_cost(&stage->integrator, &scene->stages[like].integrator))
      like++;
    rate[s] = s == 0 ? first : like < s ? rate[like] : rate_with(scene, &stage->integrator, first);
    seconds += planned > 0 ? planned / rate[s] : 0;
    steps += planned;
  }
  free(rate);
  if (steps == 0)
    return;
  printf("time          %.3g steps, %.3g million grain-steps/s in a trial: about %.3g s\n", steps,
         1e-6 * steps / seconds * grains, seconds);
  tal_check_print_costs(scene, 1 / first);
}

int tal_cli_check(int argc, char **argv) {
  tal_cli_options options;
  int exit_code;
  if (!tal_cli_options_parse(&options, "check", TAL_CLI_SET, "SCENE.yaml", argc, argv, &exit_code))
    return exit_code;
  tal_scene scene;
  tal_scene_errors errors;
  tal_error err;
  tal_sim *sim;
  if (tal_scene_load(&scene, options.argument, options.sets, options.set_count, &errors)) {
    tal_cli_options_clear(&options);
    return tal_cli_print_errors(&errors);
  }
  exit_code = tal_sim_create(&sim, &scene, &err);
  if (exit_code) {
    fprintf(stderr, "%s%s\n", exit_code == TAL_BAD_INPUT ? "" : "talus: ", err.text);
  } else {
    printf("scene         %s: valid\n", options.argument);
    print_effects(sim);
    print_numbers(sim);
    print_penalties(sim);
    print_cost(sim, &scene);
    tal_sim_free(sim);
  }
  tal_scene_clear(&scene);
  tal_cli_options_clear(&options);
  return exit_code;
}
