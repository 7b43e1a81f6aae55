// Minimal conditions, eqs (80)-(89). The loop carries the stage's stress; a correcting force on top of it holds the
// imposed components of the mean gradient: exactly, as the multiplier of a constraint on the velocities that move the
// grains (ours), or by a penalty on the error [P 3.2-3.5]. Higher rows hold the shape (order p, ours).
#include "boundary_minimal.h"

#include "boundary.h"
#include "critical.h"
#include "forces.h"
#include "plates.h"
#include "stage.h"
#include "step.h"

#include <gsl/gsl_eigen.h>
#include <string.h>

static bool exact(const tal_sim *sim) {
  return strcmp(tal_sim_stage(sim)->method, "exact") == 0;
}

static tal_boundary_target target_of(const tal_sim *sim) {
  tal_boundary_target target = {0};
  sim->stage->target(sim, tal_sim_stage(sim), &target);
  return target;
}

tal_status tal_minimal_begin(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  (void)err;
  tal_run *run = &sim->run;
  tal_plates_remove(sim);
  sim->boundary = tal_boundary_find("minimal");
  run->pressure = plan->pressure;
  run->penalty = plan->penalty;
  run->axial_start = run->axial_strain;
  tal_rows_clear(&sim->rows); // until the stage's graph is there
  if (!run->strain_begun) {
    run->strain_begun = 1;
    run->log_volume = 0;
    run->refresh_area = 0; // what happened before does not count
  }
  return TAL_OK;
}

void tal_minimal_before_step(tal_sim *sim) {
  tal_run *run = &sim->run;
  run->axial_strain = 1 - (1 - run->axial_strain) * (1 + sim->dt * run->gradient_yy);
  run->shear_strain += sim->dt * (run->gradient_xy + run->gradient_yx);
}

geo_tensor tal_minimal_error(const tal_sim *sim) {
  const tal_run *run = &sim->run;
  tal_boundary_target t = target_of(sim);
  const double none = (double)NAN;
  double xy = 0.5 * (run->gradient_xy + run->gradient_yx - t.gradient.xy - t.gradient.yx);
  xy = t.held[TAL_XY] ? xy : none;
  return (geo_tensor){t.held[TAL_XX] ? run->gradient_xx - t.gradient.xx : none, xy, xy,
                      t.held[TAL_YY] ? run->gradient_yy - t.gradient.yy : none};
}

// ---- limits ----

double tal_minimal_decay(const tal_rows *rows, const bool held[TAL_COMPONENTS], const double *inverse_mass,
                         const geo_loop *loop) {
  double matrix[9] = {0}, value[3];
  for (int a = TAL_XX; a <= TAL_XY; a++)
    for (int b = TAL_XX; b <= TAL_XY; b++) {
      const double *p = rows->row + (size_t)a * 2 * rows->nodes, *q = rows->row + (size_t)b * 2 * rows->nodes;
      double weight = (a == TAL_XY ? sqrt(0.5) : 1) * (b == TAL_XY ? sqrt(0.5) : 1), sum = 0;
      for (size_t k = 0; k < rows->nodes; k++)
        sum += inverse_mass[loop->node[k]] * (p[2 * k] * q[2 * k] + p[2 * k + 1] * q[2 * k + 1]);
      if (held[a] && held[b])
        matrix[3 * a + b] = weight * sum / pow(rows->thickness * rows->area, 2);
    }
  gsl_matrix_view view = gsl_matrix_view_array(matrix, 3, 3);
  gsl_vector_view values = gsl_vector_view_array(value, 3);
  gsl_eigen_symm_workspace *work = gsl_eigen_symm_alloc(3);
  gsl_eigen_symm(&view.matrix, &values.vector, work);
  gsl_eigen_symm_free(work);
  return fmax(value[0], fmax(value[1], value[2]));
}

double tal_minimal_decay_planned(tal_sim *sim, const tal_scene_stage *plan) {
  tal_boundary_target t = {0};
  tal_rows rows;
  if (tal_graph_refresh(&sim->graph, &sim->grains, NULL) != TAL_OK)
    return (double)NAN;
  tal_rows_init(&rows);
  rows.thickness = sim->constants.thickness;
  tal_stage_find(plan->kind)->target(sim, plan, &t);
  tal_rows_refresh(&rows, &sim->graph.loop, sim->grains.x, sim->grains.y, sim->grains.inverse_mass, t.held, 0);
  double decay = tal_minimal_decay(&rows, t.held, sim->grains.inverse_mass, &sim->graph.loop);
  tal_rows_clear(&rows);
  return decay;
}

double tal_minimal_penalty_limit(double decay, double dt, double critical) {
  return fmax(0, (1 / dt - 1 / critical) / decay);
}

static double penalty_limit(const tal_sim *sim) {
  tal_boundary_target t = target_of(sim);
  double decay = tal_minimal_decay(&sim->rows, t.held, sim->grains.inverse_mass, &sim->graph.loop);
  return tal_minimal_penalty_limit(decay, tal_step_longest(sim), tal_critical_step(sim));
}

// ---- forces on the loop ----

static void settle_on_loop(tal_sim *sim, const double *x, const double *y) {
  tal_boundary_target t = target_of(sim);
  sim->rows.thickness = sim->constants.thickness;
  tal_rows_refresh(&sim->rows, &sim->graph.loop, x, y, sim->grains.inverse_mass, t.held,
                   exact(sim) ? (int)tal_sim_stage(sim)->order : 0);
}

static void refreshed(tal_sim *sim) {
  sim->boundary_moved = true;
  settle_on_loop(sim, sim->grains.x, sim->grains.y);
  for (size_t r = TAL_COMPONENTS; r < TAL_ROWS_MOST; r++) // the fields are others now
    sim->rows.multiplier[r] = 0;
  if (!exact(sim) && isnan(sim->run.penalty))
    sim->run.penalty = 0.5 * penalty_limit(sim);
}

static void restored(tal_sim *sim) {
  settle_on_loop(sim, sim->graph.x, sim->graph.y);
}

// Forces of the stress that the stage puts on the loop (80), [2B].
static void given_forces(const tal_sim *sim, geo_tensor stress, double *force) {
  const tal_rows *rows = &sim->rows;
  for (size_t k = 0; k < rows->nodes; k++) {
    geo_vec n = rows->normal[k];
    force[2 * k] = -rows->thickness * (stress.xx * n.x + stress.xy * n.y);
    force[2 * k + 1] = -rows->thickness * (stress.yx * n.x + stress.yy * n.y);
  }
}

// Given and correcting forces into bx, by; the given ones stay in rows.given.
static void write_forces(tal_sim *sim, geo_tensor stress) {
  tal_rows *rows = &sim->rows;
  const int32_t *node = sim->graph.loop.node;
  given_forces(sim, stress, rows->given);
  memcpy(rows->force, rows->given, 2 * rows->nodes * sizeof *rows->force);
  tal_rows_force(rows, rows->force);
  for (size_t k = 0; k < rows->nodes; k++) {
    sim->grains.bx[node[k]] = rows->force[2 * k];
    sim->grains.by[node[k]] = rows->force[2 * k + 1];
  }
}

// (87): the stress K dE / (h A) for the error dE that the velocities seen by the laws leave.
static void penalise(tal_sim *sim, const tal_boundary_target *t) {
  tal_rows *rows = &sim->rows;
  const int32_t *node = sim->graph.loop.node;
  for (size_t k = 0; k < rows->nodes; k++) {
    rows->velocity[2 * k] = sim->grains.ux[node[k]];
    rows->velocity[2 * k + 1] = sim->grains.uy[node[k]];
  }
  geo_tensor is = tal_rows_gradient(rows, rows->velocity);
  const double scale = sim->run.penalty / (rows->thickness * rows->area);
  for (int c = TAL_XX; c <= TAL_XY; c++) {
    double error = tal_component_of((tal_component)c, is) - tal_component_of((tal_component)c, t->gradient);
    rows->multiplier[c] = t->held[c] ? scale * (c == TAL_XY ? 0.5 * error : error) : 0;
  }
}

static void apply(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  tal_rows *rows = &sim->rows;
  tal_boundary_target t = target_of(sim);
  tal_boundary_let_go(sim);
  if (!rows->nodes)
    return;
  tal_rows_move(rows, &sim->graph.loop, g->x, g->y);
  if (!exact(sim))
    penalise(sim, &t);
  write_forces(sim, t.stress);
}

// ---- the correcting forces ----

// (91): what is imposed is there from the first instant on, by the impulse on the loop that costs least kinetic energy;
// its work is what it costs. A penalty starts from the error.
static void start(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  tal_rows *rows = &sim->rows;
  const int32_t *node = sim->graph.loop.node;
  tal_boundary_target t = target_of(sim);
  if (!exact(sim))
    return;
  for (size_t k = 0; k < rows->nodes; k++) {
    rows->velocity[2 * k] = g->vx[node[k]];
    rows->velocity[2 * k + 1] = g->vy[node[k]];
    rows->mobility[k] = g->inverse_mass[node[k]];
  }
  if (!tal_rows_solve(rows, t.held, t.gradient, rows->mobility, rows->velocity))
    return;
  for (size_t k = 0; k < rows->nodes; k++) {
    const int32_t i = node[k];
    const double vx = rows->velocity[2 * k], vy = rows->velocity[2 * k + 1];
    double work = 0.5 * g->mass[i] * ((vx - g->vx[i]) * (vx + g->vx[i]) + (vy - g->vy[i]) * (vy + g->vy[i]));
    sim->run.boundary_work += work;
    sim->run.correcting_work += work;
    g->vx[i] = vx;
    g->vy[i] = vy;
  }
  memset(rows->multiplier, 0, sizeof rows->multiplier);
}

// Contacts and weight of the loop's grains, into rows.other.
static void collect_others(tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  const double *gravity = sim->scene->gravity;
  for (size_t k = 0; k < sim->rows.nodes; k++) {
    int32_t i = sim->graph.loop.node[k];
    tal_resultant f = tal_forces_gather(sim, (size_t)i);
    sim->rows.other[2 * k] = f.elastic_x + f.viscous_x + f.friction_x + g->mass[i] * gravity[0];
    sim->rows.other[2 * k + 1] = f.elastic_y + f.viscous_y + f.friction_y + g->mass[i] * gravity[1];
  }
}

// Velocities of the loop after `kick` seconds of rows.other and the forces `boundary`.
static void kicked(tal_sim *sim, double kick, const double *boundary, double *velocity) {
  const tal_grains *g = &sim->grains;
  const double *other = sim->rows.other;
  for (size_t k = 0; k < sim->rows.nodes; k++) {
    int32_t i = sim->graph.loop.node[k];
    velocity[2 * k] = g->vx[i] + kick * ((other[2 * k] + boundary[2 * k]) * g->inverse_mass[i]);
    velocity[2 * k + 1] = g->vy[i] + kick * ((other[2 * k + 1] + boundary[2 * k + 1]) * g->inverse_mass[i]);
    sim->rows.mobility[k] = kick * g->inverse_mass[i];
  }
}

// Power of the correcting forces at the instant that lies `close` seconds of kick ahead of the velocities (90).
static double correcting_power(tal_sim *sim, double close) {
  tal_rows *rows = &sim->rows;
  double sum = 0;
  kicked(sim, close, rows->force, rows->velocity);
  for (size_t k = 0; k < 2 * rows->nodes; k++)
    sum += (rows->force[k] - rows->given[k]) * rows->velocity[k];
  return sum;
}

static void couple(tal_sim *sim, double kick, bool first) {
  tal_rows *rows = &sim->rows;
  tal_implicit_body *body = sim->implicit.lane.body;
  const int32_t *node = sim->graph.loop.node;
  if (!exact(sim))
    return;
  for (size_t k = 0; k < rows->nodes; k++) {
    rows->velocity[2 * k] = body[node[k]].now[0];
    rows->velocity[2 * k + 1] = body[node[k]].now[1];
    rows->mobility[k] = kick * sim->grains.inverse_mass[node[k]];
  }
  if (first) {
    tal_boundary_target t = target_of(sim);
    sim->run.unsolvable = !tal_rows_set_up(rows, t.held, t.gradient, rows->mobility, &rows->equations);
  }
  if (sim->run.unsolvable)
    return;
  tal_rows_correct(rows, &rows->equations, rows->mobility, rows->velocity);
  for (size_t k = 0; k < rows->nodes; k++) {
    body[node[k]].now[0] = rows->velocity[2 * k];
    body[node[k]].now[1] = rows->velocity[2 * k + 1];
  }
}

static void note_gradient(tal_run *run, geo_tensor coming) {
  run->gradient_xx = coming.xx;
  run->gradient_xy = coming.xy;
  run->gradient_yx = coming.yx;
  run->gradient_yy = coming.yy;
}

// The bodies of the solve hold the velocities at both ends of the kick; the instant is in its middle.
static void coupled(tal_sim *sim, double kick) {
  tal_rows *rows = &sim->rows;
  const tal_implicit_body *body = sim->implicit.lane.body;
  const int32_t *node = sim->graph.loop.node;
  double power = 0;
  couple(sim, kick, false); // takes away the round-off
  write_forces(sim, target_of(sim).stress);
  for (size_t k = 0; k < rows->nodes; k++)
    for (size_t axis = 0; axis < 2; axis++) {
      const double now = body[node[k]].now[axis], before = body[node[k]].before[axis];
      rows->velocity[2 * k + axis] = now;
      power += (rows->force[2 * k + axis] - rows->given[2 * k + axis]) * 0.5 * (before + now);
    }
  note_gradient(&sim->run, tal_rows_gradient(rows, rows->velocity));
  sim->run.correcting_power = power;
}

static void constrain(tal_sim *sim, double close, double open) {
  tal_rows *rows = &sim->rows;
  tal_boundary_target t = target_of(sim);
  const double kick = close + open;
  collect_others(sim);
  if (exact(sim)) {
    kicked(sim, kick, rows->given, rows->velocity);
    sim->run.unsolvable = !tal_rows_solve(rows, t.held, t.gradient, rows->mobility, rows->velocity);
    write_forces(sim, t.stress);
  }
  kicked(sim, kick, rows->force, rows->velocity);
  note_gradient(&sim->run, tal_rows_gradient(rows, rows->velocity));
  sim->run.correcting_power = correcting_power(sim, close);
}

// ---- checks ----

static tal_status check_penalty(const tal_sim *sim, tal_error *err) {
  double limit = penalty_limit(sim);
  if (tal_sim_stage(sim)->integrator.force || sim->run.penalty <= limit)
    return TAL_OK;
  return tal_fail(
      err, TAL_INVALID,
      "penalty = %.4g N m s is above its explicit limit %.4g N m s for dt = %g s at t = %g s (stage %d): the "
      "error would grow; a smaller penalty or dt, or method: exact",
      sim->run.penalty, limit, tal_step_longest(sim), sim->run.time, (int)sim->run.stage);
}

static tal_status check(const tal_sim *sim, tal_error *err) {
  if (sim->run.unsolvable)
    return tal_fail(
        err, TAL_INVALID,
        "the mean velocity gradient cannot be imposed at t = %g s: no grain of the loop can move as it asks",
        sim->run.time);
  const double outside = (double)sim->graph.loop.outside_count, share = outside / (double)sim->grains.count;
  if (share > sim->scene->outside_limit)
    return tal_fail(
        err, TAL_INVALID,
        "%.0f of %zu grains lie outside the loop at t = %g s (limits.outside: %g): the assembly falls apart", outside,
        sim->grains.count, sim->run.time, sim->scene->outside_limit);
  return exact(sim) ? TAL_OK : check_penalty(sim, err);
}

const tal_boundary tal_boundary_minimal = {
    .name = "minimal",
    .help = "no plates: imposed components of the mean velocity gradient of the Delaunay boundary",
    .begin = tal_minimal_begin,
    .refreshed = refreshed,
    .apply = apply,
    .start = start,
    .constrain = constrain,
    .couple = couple,
    .coupled = coupled,
    .restored = restored,
    .check = check};
