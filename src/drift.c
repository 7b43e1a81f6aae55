// Four grains at a time; what the laws see of them is turned into records while it is at hand. Arrays of grains are
// whole cache lines, zeros beyond the last grain, which stay zeros.
#include "drift.h"

#include "effects.h"
#include "lanes.h"

#include <string.h>

enum { GRAINS = TAL_DRIFT_GRAINS };

// A record of each of four grains, as lanes.
typedef struct four {
  union {
    struct {
      tal_lanes x, y, ux, uy;
    };
    tal_lanes first[4];
  };
  union {
    struct {
      tal_lanes hx, hy, spin, r_spin; // zero where the effects leave them out
    };
    tal_lanes second[4];
  };
} four;

TAL_KERNEL void write_four(four *f, tal_grain_record *record) {
  tal_lanes_turn(f->first);
  tal_lanes_turn(f->second);
  for (int m = 0; m < 4; m++) {
    *(tal_lanes *)&record[m].x = f->first[m];
    *(tal_lanes *)&record[m].hx = f->second[m];
  }
}

// Spin and angle; the spin that the laws see.
TAL_KERNEL void turn_four(const tal_grains *g, size_t i, double dt, four *f, unsigned effects) {
  const tal_lanes turn = 0.5 * dt * (TAL_LANES_AT(g->torque, i) * TAL_LANES_AT(g->inverse_inertia, i));
  const tal_lanes turned = TAL_LANES_AT(g->omega, i) + turn;
  TAL_LANES_AT(g->theta, i) += dt * turned;
  TAL_LANES_AT(g->omega, i) = turned;
  f->spin = turned;
  if (!(effects & TAL_EFFECT_SPRING))
    f->spin += turn;
  f->r_spin = f->spin * TAL_LANES_AT(g->r, i);
}

TAL_KERNEL void drift_four(const tal_grains *g, size_t i, double dt, four *f, tal_lanes_bits *fastest,
                           unsigned effects) {
  const tal_lanes inverse_mass = TAL_LANES_AT(g->inverse_mass, i);
  const tal_lanes kick_x = 0.5 * dt * (TAL_LANES_AT(g->fx, i) * inverse_mass);
  const tal_lanes kick_y = 0.5 * dt * (TAL_LANES_AT(g->fy, i) * inverse_mass);
  const tal_lanes u = TAL_LANES_AT(g->vx, i) + kick_x, v = TAL_LANES_AT(g->vy, i) + kick_y;
  *f = (four){
      .x = TAL_LANES_AT(g->x, i) + dt * u, .y = TAL_LANES_AT(g->y, i) + dt * v, .ux = u + kick_x, .uy = v + kick_y};
  if (effects & TAL_EFFECT_SPIN)
    turn_four(g, i, dt, f, effects);
  if (effects & TAL_EFFECT_SPRING) { // nobody else asks for the middle of the step
    f->hx = u;
    f->hy = v;
  }
  TAL_LANES_AT(g->x, i) = f->x;
  TAL_LANES_AT(g->y, i) = f->y;
  TAL_LANES_AT(g->vx, i) = u;
  TAL_LANES_AT(g->vy, i) = v;
  if (fastest)
    tal_lanes_fastest(&u, &v, fastest);
}

// What the laws see, for who works out their forces later.
TAL_KERNEL void remember_four(const tal_grains *g, size_t i, const four *f, unsigned effects) {
  TAL_LANES_AT(g->ux, i) = f->ux;
  TAL_LANES_AT(g->uy, i) = f->uy;
  if (effects & TAL_EFFECT_SPIN)
    TAL_LANES_AT(g->spin, i) = f->spin;
}

TAL_KERNEL int64_t drift(const tal_grains *g, size_t start, int count, double dt, bool remembers,
                         tal_grain_record *record, unsigned effects) {
  tal_lanes_bits fastest = {0};
  for (int k = 0; k < count; k += 4) {
    four f;
    drift_four(g, start + (size_t)k, dt, &f, record ? NULL : &fastest, effects);
    if (remembers)
      remember_four(g, start + (size_t)k, &f, effects);
    if (record)
      write_four(&f, record + k);
  }
  return tal_lanes_largest(&fastest);
}

TAL_KERNEL void write_records(const tal_grains *g, size_t start, int count, tal_grain_record *record,
                              unsigned effects) {
  for (int k = 0; k < count; k += 4) {
    const size_t i = start + (size_t)k;
    four f = {.x = TAL_LANES_AT(g->x, i),
              .y = TAL_LANES_AT(g->y, i),
              .ux = TAL_LANES_AT(g->ux, i),
              .uy = TAL_LANES_AT(g->uy, i)};
    if (effects & TAL_EFFECT_SPRING) {
      f.hx = TAL_LANES_AT(g->vx, i);
      f.hy = TAL_LANES_AT(g->vy, i);
    }
    if (effects & TAL_EFFECT_SPIN) {
      f.spin = TAL_LANES_AT(g->spin, i);
      f.r_spin = f.spin * TAL_LANES_AT(g->r, i);
    }
    write_four(&f, record + k);
  }
}

#define EVERY_VARIANT ONE(0) ONE(TAL_EFFECT_SPIN) ONE(TAL_EFFECT_SPRING) ONE(TAL_EFFECT_SPIN | TAL_EFFECT_SPRING)

static int64_t drift_any(const tal_sim *sim, const tal_grains *g, size_t start, int count, double dt,
                         tal_grain_record *record) {
  const bool remembers = sim->remembers;
  switch (sim->effects & (TAL_EFFECT_SPIN | TAL_EFFECT_SPRING)) {
#define ONE(mask)                                                                                                      \
  case (mask):                                                                                                         \
    return drift(g, start, count, dt, remembers, record, (mask));
    EVERY_VARIANT
#undef ONE
  }
  return 0;
}

int64_t tal_drift_group(tal_sim *sim, size_t start, int count, double dt, tal_grain_record *record) {
  return drift_any(sim, &sim->grains, start, count, dt, record);
}

void tal_drift_records(const tal_sim *sim, size_t start, int count, tal_grain_record *record) {
  switch (sim->effects & (TAL_EFFECT_SPIN | TAL_EFFECT_SPRING)) {
#define ONE(mask)                                                                                                      \
  case (mask):                                                                                                         \
    write_records(&sim->grains, start, count, record, (mask));                                                         \
    break;
    EVERY_VARIANT
#undef ONE
  }
}

void tal_drift_foresee(const tal_sim *sim, size_t start, int count, double dt, tal_grain_record *record) {
  enum { MOVED = 9 };
  tal_grains copy = sim->grains;
  double **const field[MOVED] = {&copy.x,     &copy.y,  &copy.theta, &copy.vx,  &copy.vy,
                                 &copy.omega, &copy.ux, &copy.uy,    &copy.spin};
  double moved[MOVED][GRAINS] __attribute__((aligned(64))) = {{0}};
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
  drift_any(sim, &copy, 0, count, dt, record);
}
