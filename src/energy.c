#include "energy.h"

#include "effects.h"
#include "forces.h"
#include "law.h"
#include "step.h"

double tal_energy_kinetic(const tal_grains *g) {
  double sum = 0;
  for (size_t i = 0; i < g->count; i++)
    sum += 0.5 * g->mass[i] * (g->vx[i] * g->vx[i] + g->vy[i] * g->vy[i]) +
           0.5 * g->inertia[i] * g->omega[i] * g->omega[i];
  return sum;
}

double tal_energy_gravity(const tal_grains *g, const double gravity[2]) {
  double sum = 0;
  if (gravity[0] == 0 && gravity[1] == 0)
    return 0;
  for (size_t i = 0; i < g->count; i++) // fixed grains too: what holds them works against their weight
    sum -= g->mass[i] * (gravity[0] * g->x[i] + gravity[1] * g->y[i]);
  return sum;
}

double tal_energy_normal(const tal_sim *sim, const tal_contacts *s, size_t c) {
  if (s->overlap[c] <= 0)
    return 0;
  return sim->effects & TAL_EFFECT_HERTZ ? tal_hertz_energy(s->stiffness[c], s->overlap[c])
                                         : tal_linear_energy(s->stiffness[c], s->overlap[c]);
}

static double spring_energy(const tal_contacts *s, size_t c) {
  return s->spring_stiffness[c] > 0 ? 0.5 * s->spring[c] * s->spring[c] / s->spring_stiffness[c] : 0;
}

double tal_energy_springs(const tal_sim *sim) {
  double sum = 0;
  if (!(sim->effects & TAL_EFFECT_SPRING))
    return 0;
  for (size_t c = 0; c < sim->pairs.count; c++)
    sum += spring_energy(&sim->pairs, c);
  for (size_t c = 0; c < sim->wall_contacts.count; c++)
    sum += spring_energy(&sim->wall_contacts, c);
  return sum;
}

double tal_energy_elastic(const tal_sim *sim) {
  double sum = 0;
  for (size_t c = 0; c < sim->pairs.count; c++)
    sum += tal_energy_normal(sim, &sim->pairs, c);
  for (size_t c = 0; c < sim->wall_contacts.count; c++)
    sum += tal_energy_normal(sim, &sim->wall_contacts, c);
  return sum + tal_energy_springs(sim);
}

// Power of each kind of force on one grain [W].
typedef struct power {
  double friction, damping, boundary, held;
} power;

static power grain_power(const tal_sim *sim, size_t i) {
  const tal_grains *g = &sim->grains;
  tal_resultant f = tal_forces_gather(sim, i);
  power p = {f.friction_x * g->vx[i] + f.friction_y * g->vy[i] + f.torque * g->omega[i],
             f.viscous_x * g->vx[i] + f.viscous_y * g->vy[i], 0, 0};
  if (sim->effects & TAL_EFFECT_BOUNDARY)
    p.boundary = g->bx[i] * g->vx[i] + g->by[i] * g->vy[i];
  if (sim->effects & TAL_EFFECT_HELD) {
    const double *gravity = sim->scene->gravity;
    if (g->inverse_mass[i] == 0)
      p.held -= (g->rx[i] + g->mass[i] * gravity[0]) * g->vx[i] + (g->ry[i] + g->mass[i] * gravity[1]) * g->vy[i];
    if (g->inverse_inertia[i] == 0)
      p.held -= f.torque * g->omega[i];
  }
  return p;
}

static power total_power(const tal_sim *sim) {
  power sum = {0, 0, 0, 0};
  for (size_t i = 0; i < sim->grains.count; i++) {
    power p = grain_power(sim, i);
    sum.friction += p.friction;
    sum.damping += p.damping;
    sum.boundary += p.boundary;
    sum.held += p.held;
  }
  return sum;
}

void tal_energy_credit(tal_sim *sim, double weight) {
  const power p = total_power(sim);
  sim->run.friction_work += weight * p.friction;
  sim->run.damping_work += weight * p.damping;
  sim->run.boundary_work += weight * p.boundary;
  sim->run.held_work += weight * p.held;
  sim->run.correcting_work += weight * sim->run.correcting_power;
  tal_membrane_credit(sim, weight);
}

// Length of what has been credited beyond this instant [s]: at the end of a stage nothing.
static double last_half(const tal_sim *sim) {
  return sim->stage && !sim->run.stage_done ? 0.5 * sim->dt : 0;
}

// Accounts of the grains with the last instant counted half.
static power grain_works(const tal_sim *sim) {
  const tal_run *run = &sim->run;
  const power p = total_power(sim);
  const double half = last_half(sim);
  return (power){run->friction_work - half * p.friction, run->damping_work - half * p.damping,
                 run->boundary_work - half * p.boundary, run->held_work - half * p.held};
}

// What goes through a membrane, with the last instant counted half.
static tal_membrane_power membrane_works(const tal_sim *sim) {
  const tal_run *run = &sim->run;
  const double half = last_half(sim);
  return (tal_membrane_power){.pressure = run->membrane_pressure_work - half * run->membrane_pressure_power,
                              .ends = run->membrane_ends_work - half * run->membrane_ends_power,
                              .grains = run->membrane_grains_work - half * run->membrane_grains_power,
                              .lost = run->membrane_lost_work - half * run->membrane_lost_power};
}

double tal_energy_scale(const tal_sim *sim, const tal_row *row) {
  const tal_run *run = &sim->run;
  return fabs(row->work_walls) + fabs(row->work_pressure) + fabs(row->work_minimal) + fabs(row->work_membrane) +
         fabs(row->work_held) + fabs(row->dissipated_friction) + fabs(row->dissipated_damping) +
         fabs(row->gravity - run->gravity0) + run->kinetic0 + run->elastic0;
}

double tal_energy_of_a_step(const tal_sim *sim) {
  const tal_grains *g = &sim->grains;
  const double dt = tal_step_longest(sim);
  double sum = 0;
  for (size_t i = 0; i < g->count; i++) {
    const tal_resultant f = tal_forces_gather(sim, i);
    const double elastic = hypot(f.elastic_x, f.elastic_y), all = hypot(g->fx[i], g->fy[i]);
    sum +=
        dt * elastic * hypot(g->vx[i], g->vy[i]) + dt * dt * g->inverse_mass[i] * all * (0.125 * all + 0.25 * elastic);
  }
  for (size_t w = 0; w < sim->walls.count; w++) {
    const tal_wall *wall = &sim->walls.wall[w];
    sum += dt * fabs(wall->fx * wall->vx + wall->fy * wall->vy);
  }
  return sum;
}

void tal_energy_row(const tal_sim *sim, tal_row *row) {
  const tal_run *run = &sim->run;
  const power work = grain_works(sim);
  const tal_membrane_power membrane = membrane_works(sim);
  double wall = membrane.ends, wall_friction = 0, wall_damping = 0;
  for (size_t w = 0; w < sim->walls.count; w++) {
    wall += sim->walls.wall[w].work;
    wall_friction += sim->walls.wall[w].friction_work;
    wall_damping += sim->walls.wall[w].damping_work;
  }
  row->kinetic = tal_energy_kinetic(&sim->grains) + tal_membrane_kinetic(&sim->membrane);
  row->elastic = tal_energy_elastic(sim) + tal_membrane_elastic(sim);
  row->gravity = tal_energy_gravity(&sim->grains, sim->scene->gravity);
  row->work_walls = wall;
  row->work_minimal = run->correcting_work - last_half(sim) * run->correcting_power;
  row->work_pressure = work.boundary - row->work_minimal - membrane.grains + membrane.pressure;
  row->work_membrane = run->membrane_brought;
  row->work_held = work.held;
  row->dissipated_friction = wall_friction - work.friction - tal_energy_springs(sim);
  row->dissipated_damping = wall_damping - work.damping + membrane.lost;
  double change = row->kinetic - run->kinetic0 + row->elastic - run->elastic0 + row->gravity - run->gravity0;
  double input = wall + row->work_pressure + row->work_minimal + row->work_membrane + work.held;
  double missing = change + row->dissipated_friction + row->dissipated_damping - input;
  double scale = tal_energy_scale(sim, row);
  row->energy_residual = scale > 0 ? missing / scale : 0;
}
