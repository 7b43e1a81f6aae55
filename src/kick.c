// A vector loop over a handful of grains; the work of this step's forces: dt f . v is the exact discrete work of a
// force that acts over the two half kicks around the instant of v [eq (16)].
#include "kick.h"

// Adds the wall slots of the grains, in the order of the walls.
static void add_walls(const tal_sim *sim, tal_force_block *sums, size_t start, int count) {
  const tal_contacts *s = &sim->wall_contacts;
  const int32_t *first = sim->neighbours.wall_first;
  double(*sum)[TAL_BLOCK] = sums->force;
  for (int32_t c = first[start]; c < first[start + (size_t)count]; c++) {
    size_t k = (size_t)s->i[c] - start;
    sum[0][k] += s->fe[c] * s->nx[c];
    sum[1][k] += s->fe[c] * s->ny[c];
    sum[2][k] += s->fd[c] * s->nx[c];
    sum[3][k] += s->fd[c] * s->ny[c];
    sum[4][k] -= s->ft[c] * s->ny[c];
    sum[5][k] += s->ft[c] * s->nx[c];
    sum[6][k] += s->ft[c];
    sum[7][k] += s->ft[c] * s->overlap[c];
  }
}

TAL_KERNEL void kick(tal_sim *sim, const tal_force_block *sums, size_t start, int count, double dt, double credit,
                     unsigned effects) {
  tal_grains *g = &sim->grains;
  const double *restrict ex = sums->force[0], *restrict ey = sums->force[1], *restrict dx = sums->force[2];
  const double *restrict dy = sums->force[3], *restrict tx = sums->force[4], *restrict ty = sums->force[5];
  const double *restrict ft = sums->force[6], *restrict fh = sums->force[7];
  const double *restrict r = g->r + start, *restrict mass = g->mass + start;
  const double *restrict inverse_mass = g->inverse_mass + start, *restrict inverse_inertia = g->inverse_inertia + start;
  const double *restrict bx = g->bx + start, *restrict by = g->by + start;
  double *restrict vx = g->vx + start, *restrict vy = g->vy + start, *restrict omega = g->omega + start;
  double *restrict fx = g->fx + start, *restrict fy = g->fy + start, *restrict torque = g->torque + start;
  double *restrict friction_work = g->friction_work + start, *restrict damping_work = g->damping_work + start;
  double *restrict boundary_work = g->boundary_work + start, *restrict held_work = g->held_work + start;
  const double gravity_x = sim->scene->gravity[0], gravity_y = sim->scene->gravity[1], half = 0.5 * dt;
#pragma omp simd
  for (int k = 0; k < count; k++) {
    double x = ex[k] + dx[k], y = ey[k] + dy[k];
    if (effects & TAL_EFFECT_FRICTION) {
      x += tx[k];
      y += ty[k];
    }
    if (effects & TAL_EFFECT_BOUNDARY) {
      x += bx[k];
      y += by[k];
    }
    if (effects & TAL_EFFECT_GRAVITY) {
      x += mass[k] * gravity_x;
      y += mass[k] * gravity_y;
    }
    double u = vx[k] + half * (x * inverse_mass[k]), v = vy[k] + half * (y * inverse_mass[k]);
    fx[k] = x;
    fy[k] = y;
    vx[k] = u;
    vy[k] = v;
    double friction_power = effects & TAL_EFFECT_FRICTION ? tx[k] * u + ty[k] * v : 0, held_power = 0;
    if (effects & TAL_EFFECT_SPIN) {
      double turn = effects & TAL_EFFECT_FRICTION ? fh[k] - r[k] * ft[k] : 0;
      double spin = omega[k] + half * (turn * inverse_inertia[k]);
      torque[k] = turn;
      omega[k] = spin;
      friction_power += turn * spin;
      if (effects & TAL_EFFECT_HELD)
        held_power -= inverse_inertia[k] == 0 ? turn * spin : 0;
    }
    if (effects & TAL_EFFECT_FRICTION)
      friction_work[k] += credit * friction_power;
    if (effects & TAL_EFFECT_DAMPING)
      damping_work[k] += credit * (dx[k] * u + dy[k] * v);
    if (effects & TAL_EFFECT_BOUNDARY)
      boundary_work[k] += credit * (bx[k] * u + by[k] * v);
    if (effects & TAL_EFFECT_HELD) {
      held_power -= inverse_mass[k] == 0 ? x * u + y * v : 0;
      held_work[k] += credit * held_power;
    }
  }
}

// Every combination, so that what is absent costs nothing; but held motion, which takes the mask at run time.
#define DAMPED_OR_NOT(mask)  ONE(mask) ONE((mask) | TAL_EFFECT_DAMPING)
#define PRESSED_OR_NOT(mask) DAMPED_OR_NOT(mask) DAMPED_OR_NOT((mask) | TAL_EFFECT_BOUNDARY)
#define HEAVY_OR_NOT(mask)   PRESSED_OR_NOT(mask) PRESSED_OR_NOT((mask) | TAL_EFFECT_GRAVITY)
#define TURNS_OR_NOT(mask)   HEAVY_OR_NOT(mask) HEAVY_OR_NOT((mask) | TAL_EFFECT_SPIN)
#define EVERY_VARIANT        TURNS_OR_NOT(0) TURNS_OR_NOT(TAL_EFFECT_REGULARISED)

void tal_kick(tal_sim *sim, tal_force_block *sums, size_t start, int count, double dt, double credit) {
  unsigned effects = sim->effects & (TAL_EFFECT_DAMPING | TAL_EFFECT_SPIN | TAL_EFFECT_GRAVITY | TAL_EFFECT_BOUNDARY |
                                     TAL_EFFECT_HELD);
  if (sim->effects & TAL_EFFECT_FRICTION)
    effects |= TAL_EFFECT_REGULARISED; // either law: the forces are there
  if (sim->effects & TAL_EFFECT_WALLS)
    add_walls(sim, sums, start, count);
  switch (effects) {
#define ONE(mask)                                                                                                      \
  case (mask):                                                                                                         \
    kick(sim, sums, start, count, dt, credit, (mask));                                                                 \
    break;
    EVERY_VARIANT
  default:
    kick(sim, sums, start, count, dt, credit, effects);
  }
}
