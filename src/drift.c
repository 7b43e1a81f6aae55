// A vector loop over a handful of grains; their records are turned four at a time.
#include "drift.h"

#include "effects.h"
#include "lanes.h"
#include "root.h"

enum { GRAINS = TAL_DRIFT_GRAINS };

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

int64_t tal_drift_group(tal_sim *sim, size_t start, int count, double dt) {
  if (!(sim->effects & TAL_EFFECT_SPIN))
    return drift(&sim->grains, sim->grain_records, start, count, dt, 0);
  if (!(sim->effects & TAL_EFFECT_SPRING))
    return drift(&sim->grains, sim->grain_records, start, count, dt, TAL_EFFECT_SPIN);
  return drift(&sim->grains, sim->grain_records, start, count, dt, TAL_EFFECT_SPIN | TAL_EFFECT_SPRING);
}
