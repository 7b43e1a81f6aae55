#include "sim.h"

#include "boundary.h"
#include "boundary_minimal.h"
#include "critical.h"
#include "damping.h"
#include "effects.h"
#include "energy.h"
#include "forced.h"
#include "forces.h"
#include "hot.h"
#include "inspect.h"
#include "integrate.h"
#include "order.h"
#include "stage.h"
#include "step.h"

#include <gsl/gsl_statistics_double.h>
#include <stdlib.h>

static double mean(const double *value, size_t count) {
  double sum = 0;
  for (size_t k = 0; k < count; k++)
    sum += value[k];
  return sum / (double)count;
}

static double plane_modulus(double young, double poisson) {
  return young / (1 - poisson * poisson);
}

// The rate that sets vR: of the first stage that has one, NAN without.
static double first_rate(const tal_scene *scene) {
  for (size_t s = 0; s < scene->stage_count; s++)
    if (fabs(scene->stages[s].rate) > 0)
      return fabs(scene->stages[s].rate);
  return (double)NAN;
}

static void set_constants(tal_sim *sim) {
  const tal_scene *scene = sim->scene;
  tal_constants *k = &sim->constants;
  const double nu = scene->material.poisson;
  k->mean_mass = mean(sim->grains.mass, sim->grains.count);
  k->vR = isnan(scene->contact.vR) ? 2 * first_rate(scene) * k->mean_radius : scene->contact.vR;
  k->modulus = plane_modulus(scene->material.young, nu);
  k->skin = scene->skin * 2 * k->mean_radius;
  k->tangential_ratio =
      isnan(scene->contact.tangential_ratio) ? 2 * (1 - nu) / (2 - nu) : scene->contact.tangential_ratio;
  k->damping_number = tal_damping_number(scene);
  k->restitution_speed = isnan(scene->contact.restitution_speed) ? k->vR : scene->contact.restitution_speed;
}

static void add_wall(tal_sim *sim, const tal_scene_wall *plan) {
  const tal_material *material = &sim->scene->material;
  tal_wall *wall = tal_walls_add(&sim->walls);
  wall->x0 = plan->from[0];
  wall->y0 = plan->from[1];
  wall->x1 = plan->to[0];
  wall->y1 = plan->to[1];
  wall->vx = plan->velocity[0];
  wall->vy = plan->velocity[1];
  wall->from_time = plan->from_time;
  wall->until_time = plan->until_time;
  wall->modulus = plane_modulus(isnan(plan->young) ? material->young : plan->young,
                                isnan(plan->poisson) ? material->poisson : plan->poisson);
  wall->friction = isnan(plan->friction) ? material->friction : plan->friction;
}

static tal_status make_grains(tal_sim *sim, tal_error *err) {
  const tal_scene *scene = sim->scene;
  tal_packing packing;
  tal_status status = tal_pack(scene, &packing, err);
  if (status)
    return status;
  sim->constants.mean_radius = mean(packing.r, packing.count);
  sim->constants.least_radius = gsl_stats_min(packing.r, 1, packing.count);
  sim->constants.thickness = isnan(scene->grains.thickness) ? 2 * sim->constants.mean_radius : scene->grains.thickness;
  tal_packing_grains(&packing, scene, sim->constants.thickness, &sim->grains);
  tal_order_grains(&sim->grains);
  sim->packing_solid_fraction = packing.solid_fraction;
  sim->packing_coordination = packing.coordination;
  sim->packing_overlap = packing.largest_overlap;
  tal_packing_clear(&packing);
  return TAL_OK;
}

static void set_graph(tal_sim *sim) {
  const tal_scene_continuum *plan = &sim->scene->continuum;
  tal_graph_init(&sim->graph);
  sim->graph.backend = geo_delaunay_backend_find(plan->backend);
  sim->graph.power = plan->power;
  sim->graph.edges_on_demand = true;
  sim->graph.gap_limit = plan->peel * 2 * sim->constants.mean_radius;
}

// Reduced mass of the heaviest two bodies that can meet; walls and fixed grains do not move.
static double heaviest_reduced_mass(const tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  double first = 0, second = 0;
  bool immovable = sim->walls.count > 0;
  for (size_t i = 0; i < g->count; i++) {
    if (g->inverse_mass[i] == 0)
      immovable = true;
    double mass = g->inverse_mass[i] == 0 ? 0 : g->mass[i];
    if (mass > first) {
      second = first;
      first = mass;
    } else if (mass > second) {
      second = mass;
    }
  }
  return immovable ? first : second > 0 ? first * second / (first + second) : first;
}

// A step that no contact of the scene could bear.
static tal_status check_scene_step(const tal_sim *sim, tal_error *err) {
  const tal_scene *scene = sim->scene;
  const double mass = heaviest_reduced_mass(sim);
  for (size_t s = 0; s < scene->stage_count; s++) {
    const tal_scene_integrator *plan = &scene->stages[s].integrator;
    const bool damped = !tal_integrator_find(plan->scheme)->implicit;
    const double critical = tal_critical_step_scene(scene, &sim->constants, mass, damped);
    const double longest = (double)tal_integrate_longest(plan);
    if (plan->force || !(longest * plan->dt > critical))
      continue;
    return tal_fail(
        err, TAL_BAD_INPUT,
        "%s:%d: integrator.dt: %s%g s is above the critical step of the contacts; accepted: at most %.4g s, or "
        "force: true at your own risk",
        scene->path, scene->line_dt, longest > 1 ? "n dt = " : "", longest * plan->dt, critical / longest);
  }
  return TAL_OK;
}

tal_status tal_sim_create(tal_sim **out, const tal_scene *scene, tal_error *err) {
  *out = NULL;
  tal_sim *sim = tal_alloc(1, sizeof *sim);
  sim->scene = scene;
  sim->next_stride = (double)NAN;
  sim->hot = tal_hot_best();
  tal_status status = make_grains(sim, err);
  if (status) {
    tal_sim_free(sim);
    return status;
  }
  set_constants(sim);
  set_graph(sim);
  for (size_t w = 0; w < scene->wall_count; w++)
    add_wall(sim, &scene->walls[w]);
  if ((status = tal_forced_check(sim, err)) || (status = check_scene_step(sim, err))) {
    tal_sim_free(sim);
    return status;
  }
  sim->friction = scene->material.friction;
  sim->dt = scene->integrator.dt;
  sim->watched = true;
  tal_step_effects(sim);
  tal_neighbours_rebuild(sim);
  tal_sim_observe(sim);
  sim->run.kinetic0 = tal_energy_kinetic(&sim->grains);
  sim->run.elastic0 = tal_energy_elastic(sim);
  sim->run.gravity0 = tal_energy_gravity(&sim->grains, scene->gravity);
  sim->run.rest = (double)INFINITY;
  status = tal_inspect(sim, err);
  if (status == TAL_OK && scene->stage_count)
    status = tal_step_begin_stage(sim, err);
  if (status) {
    tal_sim_free(sim);
    return status;
  }
  *out = sim;
  return TAL_OK;
}

void tal_sim_free(tal_sim *sim) {
  if (!sim)
    return;
  tal_grains_clear(&sim->grains);
  tal_contacts_clear(&sim->pairs);
  tal_contacts_clear(&sim->wall_contacts);
  tal_walls_clear(&sim->walls);
  tal_neighbours_clear(&sim->neighbours);
  tal_implicit_clear(&sim->implicit);
  tal_rows_clear(&sim->rows);
  tal_membrane_clear(&sim->membrane);
  free(sim->grain_records);
  free(sim->force_records);
  free(sim->sums);
  free(sim->rings);
  free(sim->loop_centre);
  free(sim->powers);
  free(sim->pressed);
  tal_graph_clear(&sim->graph);
  free(sim);
}

const tal_scene_stage *tal_sim_stage(const tal_sim *sim) {
  const tal_scene *scene = sim->scene;
  if (!scene->stage_count)
    return NULL;
  size_t stage = (size_t)sim->run.stage < scene->stage_count ? (size_t)sim->run.stage : scene->stage_count - 1;
  return &scene->stages[stage];
}

bool tal_sim_done(const tal_sim *sim) {
  return sim->scene->stage_count == 0 || (sim->run.stage_done && (size_t)sim->run.stage + 1 >= sim->scene->stage_count);
}

void tal_sim_watch(tal_sim *sim, bool watched) {
  sim->watched = watched;
}

tal_observed tal_sim_observe(tal_sim *sim) {
  tal_forces_see_now(sim);
  if (sim->boundary && sim->graph.valid)
    sim->boundary->apply(sim);
  if (sim->effects & TAL_EFFECT_IMPLICIT)
    tal_implicit_observe(sim);
  else
    tal_forces_sweep(sim, 0);
  return tal_sim_driving(sim);
}

tal_observed tal_sim_driving(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  tal_forces_expand(sim);
  tal_forces_resultants(sim);
  tal_graph_index_edges(&sim->graph);
  return (tal_observed){.grains = g,
                        .pairs = &sim->pairs,
                        .walls = &sim->wall_contacts,
                        .graph = &sim->graph,
                        .gravity = {sim->scene->gravity[0], sim->scene->gravity[1]},
                        .thickness = sim->constants.thickness,
                        .vR = sim->constants.vR};
}

// Where nothing keeps the graph fresh it is built for the row; failing (too few grains) leaves it invalid.
static void fresh_graph(tal_sim *sim) {
  if (!tal_step_keeps_graph(sim))
    tal_graph_refresh(&sim->graph, &sim->grains, NULL);
}

static double volumetric_strain(const tal_sim *sim) {
  const tal_run *run = &sim->run;
  if (!run->strain_begun)
    return 0;
  double area = geo_loop_area(&sim->graph.loop, sim->grains.x, sim->grains.y);
  return exp(run->log_volume + log(area / run->refresh_area)) - 1;
}

static double plate_load(const tal_sim *sim, int side) {
  const tal_wall *plate = tal_walls_plate(&sim->walls, side);
  return plate ? -side * plate->fy : (double)NAN;
}

static double plate_shear(const tal_sim *sim, int side) {
  const tal_wall *plate = tal_walls_plate(&sim->walls, side);
  return plate ? plate->fx : (double)NAN;
}

static void row_minimal(const tal_sim *sim, tal_row *row) {
  const double none = (double)NAN, *multiplier = sim->rows.multiplier;
  const bool minimal = sim->boundary == &tal_boundary_minimal;
  geo_tensor error = minimal ? tal_minimal_error(sim) : (geo_tensor){none, none, none, none};
  row->multiplier_xx = minimal ? multiplier[TAL_XX] : none;
  row->multiplier_yy = minimal ? multiplier[TAL_YY] : none;
  row->multiplier_xy = minimal ? multiplier[TAL_XY] : none;
  row->multiplier_spin = minimal ? multiplier[TAL_SPIN] : none;
  row->strain_rate_error_xx = error.xx;
  row->strain_rate_error_yy = error.yy;
  row->strain_rate_error_xy = error.xy;
  row->boundary_rank = minimal ? (double)sim->rows.rank : none;
  row->outside = sim->graph.valid ? (double)sim->graph.loop.outside_count : none;
}

static void row_macro(const tal_macro *macro, tal_row *row) {
  row->sigma_xx = macro->stress.xx;
  row->sigma_yy = macro->stress.yy;
  row->sigma_xy = 0.5 * (macro->stress.xy + macro->stress.yx);
  row->sigma_xx_boundary = macro->stress_boundary.xx;
  row->sigma_yy_boundary = macro->stress_boundary.yy;
  row->sigma_xy_boundary = 0.5 * (macro->stress_boundary.xy + macro->stress_boundary.yx);
  row->sigma_xx_inertia = macro->stress_inertia.xx;
  row->sigma_yy_inertia = macro->stress_inertia.yy;
  row->sigma_xy_inertia = 0.5 * (macro->stress_inertia.xy + macro->stress_inertia.yx);
  row->stress_ratio = macro->stress.yy / macro->stress.xx;
  row->coordination = macro->coordination;
  row->coordination_bearing = macro->coordination_bearing;
  row->solid_fraction = macro->solid_fraction;
  row->fabric_xx = macro->fabric.xx;
  row->fabric_xy = macro->fabric.xy;
  row->fabric_yy = macro->fabric.yy;
  row->mean_slip = macro->mean_slip;
  row->unbalanced = macro->unbalanced;
  row->power_contacts = macro->power_contacts;
  row->power_boundary = macro->power_boundary;
}

void tal_sim_row(tal_sim *sim, tal_row *row) {
  const tal_run *run = &sim->run;
  const tal_scene_stage *plan = tal_sim_stage(sim);
  fresh_graph(sim);
  tal_observed seen = tal_sim_driving(sim);
  tal_macro macro;
  tal_macro_measure(&seen, &macro);
  int64_t grain;
  *row = (tal_row){.time = run->time, .step = (double)run->step, .stage = (double)run->stage};
  row->axial_strain = run->axial_strain;
  row->shear_strain = run->shear_strain;
  row->volumetric_strain = volumetric_strain(sim);
  row_macro(&macro, row);
  row_minimal(sim, row);
  row->plate_bottom = plate_load(sim, +1);
  row->plate_top = plate_load(sim, -1);
  row->plate_bottom_shear = plate_shear(sim, +1);
  row->plate_top_shear = plate_shear(sim, -1);
  row->membrane_tension = sim->membrane.count ? 0 : (double)NAN;
  for (size_t b = 0; b < sim->membrane.count; b++)
    row->membrane_tension = fmax(row->membrane_tension, sim->membrane.tension[b]);
  tal_implicit_save(sim); // springs hold energy
  tal_energy_row(sim, row);
  row->dt_ratio = tal_step_longest(sim) / tal_critical_step(sim);
  double rate = plan && fabs(plan->rate) > 0 ? fabs(plan->rate) : first_rate(sim->scene);
  row->phi = tal_quasistatic_coefficient(sim, rate, 0.5 * (row->sigma_xx + row->sigma_yy), macro.height);
  row->psi = 2 * sim->constants.mean_radius / macro.height;
  row->overlap_max = tal_largest_overlap(sim, &grain);
}

void tal_sim_restored(tal_sim *sim) {
  const tal_scene_stage *plan = tal_sim_stage(sim);
  sim->stage = plan ? tal_stage_find(plan->kind) : NULL;
  sim->boundary = NULL;
  sim->boundary_moved = true;
  tal_boundary_let_go(sim); // what the first stage's pressed
  sim->next_stride = (double)NAN;
  if (plan && !sim->run.stage_begun)
    sim->stage = NULL;
  if (sim->stage) {
    sim->dt = tal_step_length(sim, sim->run.stage_step);
    sim->friction = isnan(plan->friction) ? sim->scene->material.friction : plan->friction;
    if (plan->pressure > 0)
      sim->boundary = tal_boundary_find(plan->boundary ? plan->boundary : "pressure");
  }
  if (sim->boundary && sim->boundary->restored)
    sim->boundary->restored(sim);
  tal_step_effects(sim);
  tal_neighbours_restore(sim);
  tal_sim_observe(sim); // overlaps: a wall that vanishes in the next step takes its contacts' energy along
}
