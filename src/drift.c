// A vector loop over a handful of grains; their records are turned four at a time.
#include "drift.h"

#include "effects.h"
#include "lanes.h"
#include "root.h"

#include <string.h>

enum { GRAINS = TAL_DRIFT_GRAINS };

TAL_KERNEL int64_t drift(const tal_grains *g, size_t start, int count, double dt, unsigned effects) {
  const double *restrict fx = g->fx + start, *restrict fy = g->fy + start, *restrict torque = g->torque + start;
  const double *restrict inverse_mass = g->inverse_mass + start, *restrict inverse_inertia = g->inverse_inertia + start;
  double *restrict x = g->x + start, *restrict y = g->y + start, *restrict theta = g->theta + start;
  double *restrict vx = g->vx + start, *restrict vy = g->vy + start, *restrict omega = g->omega + start;
  double *restrict ux = g->ux + start, *restrict uy = g->uy + start, *restrict spin = g->spin + start;
  const double half = 0.5 * dt;
  int64_t fastest = 0;
#pragma omp simd reduction(max : fastest)
  for (int k = 0; k < count; k++) {
    double kick_x = half * (fx[k] * inverse_mass[k]), kick_y = half * (fy[k] * inverse_mass[k]);
    double u = vx[k] + kick_x, v = vy[k] + kick_y;
    if (effects & TAL_EFFECT_SPIN) {
      double turn = half * (torque[k] * inverse_inertia[k]);
      double turned = omega[k] + turn;
      theta[k] += dt * turned;
      omega[k] = turned;
      spin[k] = effects & TAL_EFFECT_SPRING ? turned : turned + turn;
    }
    x[k] += dt * u;
    y[k] += dt * v;
    vx[k] = u;
    vy[k] = v;
    ux[k] = u + kick_x;
    uy[k] = v + kick_y;
    int64_t speed = tal_speed_bits(u, v);
    fastest = speed > fastest ? speed : fastest;
  }
  return fastest;
}

static int64_t drift_any(const tal_grains *g, unsigned effects, size_t start, int count, double dt) {
  if (!(effects & TAL_EFFECT_SPIN))
    return drift(g, start, count, dt, 0);
  if (!(effects & TAL_EFFECT_SPRING))
    return drift(g, start, count, dt, TAL_EFFECT_SPIN);
  return drift(g, start, count, dt, TAL_EFFECT_SPIN | TAL_EFFECT_SPRING);
}

int64_t tal_drift_group(tal_sim *sim, size_t start, int count, double dt) {
  return drift_any(&sim->grains, sim->effects, start, count, dt);
}

static tal_grain_record record_of(const tal_grains *g, size_t i, unsigned effects) {
  const double spin = effects & TAL_EFFECT_SPIN ? g->spin[i] : 0;
  return (tal_grain_record){g->x[i], g->y[i], g->ux[i], g->uy[i], g->vx[i], g->vy[i], spin, g->r[i] * spin};
}

// Members of the records of grains i ... i + 3.
TAL_KERNEL void write_four(const tal_grains *g, size_t i, tal_grain_record *record, unsigned effects) {
  const double *field[6] = {g->x, g->y, g->ux, g->uy, g->vx, g->vy};
  tal_lanes first[4], second[4] = {{0}, {0}, {0}, {0}};
  for (int m = 0; m < 4; m++)
    first[m] = *(const tal_lanes *)&field[m][i];
  for (int m = 0; m < 2 && effects & TAL_EFFECT_SPRING; m++) // nobody else asks for the middle of the step
    second[m] = *(const tal_lanes *)&field[4 + m][i];
  if (effects & TAL_EFFECT_SPIN) {
    second[2] = *(const tal_lanes *)&g->spin[i];
    second[3] = second[2] * *(const tal_lanes *)&g->r[i];
  }
  tal_lanes_turn(first);
  tal_lanes_turn(second);
  for (int m = 0; m < 4; m++) {
    *(tal_lanes *)&record[m].x = first[m];
    *(tal_lanes *)&record[m].hx = second[m];
  }
}

static void write_records(const tal_grains *g, unsigned effects, size_t start, int count, tal_grain_record *record) {
  const int whole = count & ~3;
  const unsigned both = TAL_EFFECT_SPIN | TAL_EFFECT_SPRING;
  if ((effects & both) == both)
    for (int k = 0; k < whole; k += 4)
      write_four(g, start + (size_t)k, record + k, both);
  else if (effects & TAL_EFFECT_SPRING)
    for (int k = 0; k < whole; k += 4)
      write_four(g, start + (size_t)k, record + k, TAL_EFFECT_SPRING);
  else if (effects & TAL_EFFECT_SPIN)
    for (int k = 0; k < whole; k += 4)
      write_four(g, start + (size_t)k, record + k, TAL_EFFECT_SPIN);
  else
    for (int k = 0; k < whole; k += 4)
      write_four(g, start + (size_t)k, record + k, 0);
  for (int k = whole; k < count; k++)
    record[k] = record_of(g, start + (size_t)k, effects);
}

void tal_drift_records(const tal_sim *sim, size_t start, int count, tal_grain_record *record) {
  write_records(&sim->grains, sim->effects, start, count, record);
}

void tal_drift_foresee(const tal_sim *sim, size_t start, int count, double dt, tal_grain_record *record) {
  enum { MOVED = 9 };
  tal_grains copy = sim->grains;
  double **const field[MOVED] = {&copy.x,     &copy.y,  &copy.theta, &copy.vx,  &copy.vy,
                                 &copy.omega, &copy.ux, &copy.uy,    &copy.spin};
  double moved[MOVED][GRAINS] __attribute__((aligned(64)));
  for (int m = 0; m < MOVED; m++) {
    memcpy(moved[m], *field[m] + start, (size_t)count * sizeof(double));
    *field[m] = moved[m];
  }
  copy.fx += start;
  copy.fy += start;
  copy.torque += start;
  copy.inverse_mass += start;
  copy.inverse_inertia += start;
  copy.r += start;
  drift_any(&copy, sim->effects, 0, count, dt);
  write_records(&copy, sim->effects, 0, count, record);
}
