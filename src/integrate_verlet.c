// Velocity Verlet with the velocities that the laws see predicted for the instant of the positions, eqs (12)-(15):
// second order also with velocity-dependent forces. Laws read with half-step velocities would be of first order.
#include "integrate.h"

#include "boundary.h"
#include "effects.h"
#include "forces.h"
#include "lanes.h"
#include "neighbours.h"
#include "root.h"
#include "walls_load.h"

// Grains taken at a time.
enum { GRAINS = 64, PARALLEL_FROM = 2000 };

// Members of the grain records, one array each.
typedef struct record_block {
  double member[8][GRAINS];
} __attribute__((aligned(64))) record_block;

static void write_records(const record_block *b, tal_grain_record *record, int count) {
  for (int k = 0; k < count; k += 4) {
    tal_lanes first[4], second[4];
    for (int m = 0; m < 4; m++) {
      first[m] = *(const tal_lanes *)&b->member[m][k];
      second[m] = *(const tal_lanes *)&b->member[4 + m][k];
    }
    tal_lanes_turn(first);
    tal_lanes_turn(second);
    for (int m = 0; m < 4 && k + m < count; m++) {
      *(tal_lanes *)&record[k + m].x = first[m];
      *(tal_lanes *)&record[k + m].hx = second[m];
    }
  }
}

// First half kick, drift, prediction of `count` grains; what the laws shall see goes into the records. Returns the
// square of the largest speed [m^2/s^2] as bits, which order like the numbers, NAN above all.
TAL_KERNEL int64_t drift(tal_grains *g, tal_grain_record *record, size_t start, int count, double dt,
                         unsigned effects) {
  record_block b;
  double *restrict rx = b.member[0], *restrict ry = b.member[1], *restrict ux = b.member[2];
  double *restrict uy = b.member[3], *restrict hx = b.member[4], *restrict hy = b.member[5];
  double *restrict spins = b.member[6], *restrict r_spin = b.member[7];
  const double *restrict fx = g->fx + start, *restrict fy = g->fy + start, *restrict torque = g->torque + start;
  const double *restrict inverse_mass = g->inverse_mass + start, *restrict inverse_inertia = g->inverse_inertia + start;
  const double *restrict r = g->r + start;
  double *restrict x = g->x + start, *restrict y = g->y + start, *restrict theta = g->theta + start;
  double *restrict vx = g->vx + start, *restrict vy = g->vy + start, *restrict omega = g->omega + start;
  const double half = 0.5 * dt;
  int64_t fastest = 0;
#pragma omp simd reduction(max : fastest)
  for (int k = 0; k < count; k++) {
    double kick_x = half * (fx[k] * inverse_mass[k]), kick_y = half * (fy[k] * inverse_mass[k]);
    double u = vx[k] + kick_x, v = vy[k] + kick_y, spin = 0;
    if (effects & TAL_EFFECT_SPIN) {
      double turn = half * (torque[k] * inverse_inertia[k]);
      double turned = omega[k] + turn;
      theta[k] += dt * turned;
      omega[k] = turned;
      spin = effects & TAL_EFFECT_SPRING ? turned : turned + turn;
    }
    x[k] = rx[k] = x[k] + dt * u;
    y[k] = ry[k] = y[k] + dt * v;
    vx[k] = hx[k] = u;
    vy[k] = hy[k] = v;
    ux[k] = u + kick_x;
    uy[k] = v + kick_y;
    spins[k] = spin;
    r_spin[k] = r[k] * spin;
    int64_t speed = (int64_t)(tal_bits(u * u + v * v) & INT64_MAX);
    fastest = speed > fastest ? speed : fastest;
  }
  write_records(&b, record + start, count);
  return fastest;
}

static int64_t drift_variant(tal_sim *sim, size_t start, int count, double dt) {
  if (!(sim->effects & TAL_EFFECT_SPIN))
    return drift(&sim->grains, sim->grain_records, start, count, dt, 0);
  if (!(sim->effects & TAL_EFFECT_SPRING))
    return drift(&sim->grains, sim->grain_records, start, count, dt, TAL_EFFECT_SPIN);
  return drift(&sim->grains, sim->grain_records, start, count, dt, TAL_EFFECT_SPIN | TAL_EFFECT_SPRING);
}

// Returns what no grain has moved further than [m].
static double drift_all(tal_sim *sim, double dt) {
  const size_t count = sim->grains.count;
  int64_t fastest = 0;
#pragma omp parallel for schedule(static) reduction(max : fastest) if (count > PARALLEL_FROM)
  for (size_t start = 0; start < count; start += GRAINS) {
    int64_t here = drift_variant(sim, start, (int)(count - start < GRAINS ? count - start : GRAINS), dt);
    fastest = here > fastest ? here : fastest;
  }
  return (1 + 1e-9) * dt * sqrt(tal_double((uint64_t)fastest)); // what rounds off on the way is less
}

void tal_integrate_drift(tal_sim *sim, double dt) {
  const double moved = drift_all(sim, dt);
  if (sim->effects & TAL_EFFECT_WALLS)
    tal_walls_drift(sim);
  if (sim->boundary && sim->boundary->drift)
    sim->boundary->drift(sim, dt);
  if (tal_neighbours_stale(sim, moved))
    tal_neighbours_rebuild(sim);
  if (sim->boundary)
    sim->boundary->apply(sim);
}

// Where the boundary imposes something it has to know the forces of the contacts first.
void tal_integrate_forces(tal_sim *sim) {
  const double credit = tal_integrate_credit(sim);
  if (!sim->boundary || !sim->boundary->constrain) {
    tal_forces_step(sim, sim->dt, credit);
    return;
  }
  tal_forces_sweep(sim, sim->dt);
  sim->boundary->constrain(sim, 0.5 * sim->dt, 0.5 * sim->dt_next);
  sim->run.correcting_work += credit * sim->run.correcting_power;
  tal_forces_finish_step(sim, sim->dt, credit);
}

void tal_integrate_end(tal_sim *sim) {
  if (sim->boundary && sim->boundary->finish)
    sim->boundary->finish(sim, sim->dt, tal_integrate_credit(sim));
  if (sim->effects & TAL_EFFECT_WALLS)
    tal_walls_take_loads(sim, sim->dt);
}

void tal_integrate_verlet_step(tal_sim *sim) {
  tal_integrate_drift(sim, sim->dt);
  tal_integrate_forces(sim);
  tal_integrate_end(sim);
}

const tal_integrator tal_verlet = {.name = "verlet",
                                   .help = "velocity Verlet, second order, velocities synchronised for the laws",
                                   .advance = tal_integrate_verlet_step};
