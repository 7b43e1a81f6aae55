// Reference for one contact: the planar motion of two grains (or of a grain and a plane) that meet, integrated with
// GSL's Runge-Kutta-Prince-Dormand 8(9) at tight tolerance. Written from vector mechanics (contact point, v + omega x
// l, torque l x F), not from the engine's formulas. Kinks of the laws (Coulomb cap, clipping at zero, slip that stops)
// are located by halving the step, so that the integrator only sees smooth pieces. Starts at the instant of touching
// (or `overlap` deep) and ends when the normal force has fallen to zero.
#ifndef PHYSICS_ODE_H
#define PHYSICS_ODE_H

#include <assert.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

typedef enum ode_friction { ODE_NONE, ODE_REGULARISED, ODE_SPRING } ode_friction;

typedef struct ode_grain {
  double x, y, r;       // [m]
  double vx, vy, omega; // [m/s, m/s, rad/s]
  double mass, inertia; // [kg, kg m^2]
} ode_grain;

typedef struct ode_contact {
  ode_grain i, j;    // j: not used with a plane
  bool plane;        // the plane y = 0, at rest; grain i above
  bool hertz;        // K d^1.5 + C d^0.5 d', else K d + C d'
  double K, C;       // [N/m^1.5, N s/m^1.5] or [N/m, N s/m]
  ode_friction kind; // friction law
  double mu;         // [-]
  double vR, c;      // [m/s, -] regularised
  double ratio;      // [-] spring: k_t / k_n
  double overlap;    // [m] at the start
  double length;     // [m] order of magnitude of the largest overlap
} ode_contact;

typedef struct ode_result {
  double time;               // [s] of the contact
  double overlap;            // [m] largest
  double overlap_last;       // [m] at the end
  double vx[2], vy[2], w[2]; // [m/s, m/s, rad/s] at the end
  int sliding, sticking;     // steps taken in either state
  double stuck_share;        // largest |ft| / (mu fn) while slip was held at zero (regularised)
} ode_result;

// Variables: displacements since the start, velocities, spins of i then j; then the spring force.
enum { ODE_UX, ODE_UY, ODE_VX, ODE_VY, ODE_W, ODE_BODY, ODE_FT = 2 * ODE_BODY, ODE_SIZE };

// SLIDES: |ft| at the Coulomb cap (spring). HOLDS: slip is zero and ft what keeps it so (regularised, c >= 10), as long
// as that takes less than half of mu fn: the slip left out is below vR / 2^c, and free motion would be too stiff to
// follow.
typedef enum ode_mode { ODE_FREE, ODE_SLIDES, ODE_HOLDS } ode_mode;

typedef struct ode_run {
  const ode_contact *contact;
  ode_mode mode;
  double sign; // of ft while it slides
} ode_run;

// Everything about the contact at one state.
typedef struct ode_state {
  double nx, ny, overlap, approach, slip; // slip: of i against j at the contact point, along t = (-ny, nx)
  double arm_i, arm_j;                    // distance of the contact point from the centres
  double turning;                         // rate at which n turns
  double spins;                           // sum of the spins of those that turn
  double fn, ft, kt;
} ode_state;

static inline void ode_geometry(const ode_contact *k, const double *y, ode_state *s) {
  const double *i = y, *j = y + ODE_BODY;
  if (k->plane) {
    s->nx = 0;
    s->ny = 1;
    s->overlap = k->overlap - i[ODE_UY];
    s->arm_i = k->i.r - s->overlap;
    s->arm_j = 0;
    s->turning = 0;
  } else {
    double x0 = k->i.x - k->j.x, y0 = k->i.y - k->j.y, ux = i[ODE_UX] - j[ODE_UX], uy = i[ODE_UY] - j[ODE_UY];
    double distance0 = hypot(x0, y0), distance = hypot(x0 + ux, y0 + uy);
    s->nx = (x0 + ux) / distance;
    s->ny = (y0 + uy) / distance;
    // change of the distance without cancellation
    s->overlap = k->overlap - (2 * (x0 * ux + y0 * uy) + ux * ux + uy * uy) / (distance + distance0);
    s->arm_i = k->i.r - s->overlap / 2;
    s->arm_j = k->j.r - s->overlap / 2;
    s->turning = (s->nx * (i[ODE_VY] - j[ODE_VY]) - s->ny * (i[ODE_VX] - j[ODE_VX])) / distance;
  }
  s->spins = i[ODE_W] + (k->plane ? 0 : j[ODE_W]);
  // velocities of the two contact points: v + omega x l with l = -arm n for i, +arm n for j
  double ix = i[ODE_VX] + i[ODE_W] * s->arm_i * s->ny, iy = i[ODE_VY] - i[ODE_W] * s->arm_i * s->nx;
  double jx = 0, jy = 0;
  if (!k->plane) {
    jx = j[ODE_VX] - j[ODE_W] * s->arm_j * s->ny;
    jy = j[ODE_VY] + j[ODE_W] * s->arm_j * s->nx;
  }
  s->approach = -((ix - jx) * s->nx + (iy - jy) * s->ny);
  s->slip = -(ix - jx) * s->ny + (iy - jy) * s->nx;
}

// Accelerations by the forces fn n + ft t on i and their opposite on j.
static inline void ode_accelerate(const ode_contact *k, const ode_state *s, double fn, double ft, double *a) {
  double fx = fn * s->nx - ft * s->ny, fy = fn * s->ny + ft * s->nx;
  double ilx = -s->arm_i * s->nx, ily = -s->arm_i * s->ny;
  a[0] = fx / k->i.mass;
  a[1] = fy / k->i.mass;
  a[2] = (ilx * fy - ily * fx) / k->i.inertia;
  a[3] = a[4] = a[5] = 0;
  if (k->plane)
    return;
  double jlx = s->arm_j * s->nx, jly = s->arm_j * s->ny;
  a[3] = -fx / k->j.mass;
  a[4] = -fy / k->j.mass;
  a[5] = -(jlx * fy - jly * fx) / k->j.inertia;
}

// Rate of the slip for these accelerations.
static inline double ode_slip_rate(const ode_contact *k, const ode_state *s, const double *a) {
  double shrinking = k->plane ? s->approach : s->approach / 2; // of the arms
  double rate = -(a[0] - a[3]) * s->ny + (a[1] - a[4]) * s->nx;
  rate += s->approach * s->turning; // t turns by -n
  rate -= a[2] * s->arm_i + a[5] * s->arm_j;
  return rate + s->spins * shrinking;
}

static inline double ode_normal(const ode_contact *k, double overlap, double approach) {
  double d = overlap > 0 ? overlap : 0, root = k->hertz ? sqrt(d) : 1;
  return k->K * d * root + k->C * root * approach;
}

// The tangential force that keeps the slip at zero; the slip rate is linear in it.
static inline double ode_holding_force(const ode_contact *k, const ode_state *s) {
  double a[6], scale = s->fn;
  ode_accelerate(k, s, s->fn, 0, a);
  double without = ode_slip_rate(k, s, a);
  ode_accelerate(k, s, s->fn, scale, a);
  double with = ode_slip_rate(k, s, a);
  return with == without ? 0 : -scale * without / (with - without);
}

static inline void ode_observe(const ode_run *run, const double *y, ode_state *s) {
  const ode_contact *k = run->contact;
  ode_geometry(k, y, s);
  double fn = ode_normal(k, s->overlap, s->approach), cap;
  s->fn = fn > 0 ? fn : 0;
  cap = k->mu * s->fn;
  s->kt = k->ratio * (k->hertz ? 1.5 * k->K * sqrt(s->overlap > 0 ? s->overlap : 0) : k->K);
  s->ft = 0;
  if (k->kind == ODE_REGULARISED) {
    s->ft = -copysign(cap * pow(fabs(s->slip) / k->vR, 1 / k->c), s->slip);
    if (run->mode == ODE_HOLDS)
      s->ft = ode_holding_force(k, s);
  }
  if (k->kind == ODE_SPRING)
    s->ft = run->mode == ODE_SLIDES ? run->sign * cap : y[ODE_FT];
}

// Rate of the spring force off the cap: k_t moves it, a falling k_t takes it along.
static inline double ode_spring_rate(const ode_contact *k, const ode_state *s) {
  double rate = -s->kt * s->slip;
  if (k->hertz && s->approach < 0 && s->overlap > 0)
    rate += s->ft * s->approach / (2 * s->overlap);
  return rate;
}

static inline int ode_rates(double t, const double *y, double *rate, void *data) {
  (void)t;
  const ode_run *run = data;
  ode_state s;
  double a[6];
  ode_observe(run, y, &s);
  ode_accelerate(run->contact, &s, s.fn, s.ft, a);
  for (int b = 0; b < 2; b++) {
    rate[b * ODE_BODY + ODE_UX] = y[b * ODE_BODY + ODE_VX];
    rate[b * ODE_BODY + ODE_UY] = y[b * ODE_BODY + ODE_VY];
    memcpy(rate + b * ODE_BODY + ODE_VX, a + 3 * b, 3 * sizeof *a);
  }
  rate[ODE_FT] = run->contact->kind == ODE_SPRING && run->mode == ODE_FREE ? ode_spring_rate(run->contact, &s) : 0;
  return GSL_SUCCESS;
}

// Rate of the Coulomb cap mu fn.
static inline double ode_cap_rate(const ode_run *run, const ode_state *s) {
  const ode_contact *k = run->contact;
  double a[6], d = s->overlap, root = k->hertz ? sqrt(d) : 1;
  ode_accelerate(k, s, s->fn, s->ft, a);
  double across = s->turning * (k->plane ? 0 : s->arm_i + s->arm_j);
  double rate = -((a[0] - a[3]) * s->nx + (a[1] - a[4]) * s->ny) - across * s->turning; // of the approach
  double force =
      k->hertz ? 1.5 * k->K * root * s->approach + k->C * (0.5 / root * s->approach * s->approach) : k->K * s->approach;
  return k->mu * (force + k->C * root * rate);
}

// What the step from `before` to `y` ran into. TURNS: largest overlap; END: the normal force fell to zero.
typedef enum ode_event { ODE_NOTHING, ODE_TURNS, ODE_SLIP_BEGINS, ODE_SLIP_ENDS, ODE_END } ode_event;

static inline ode_event ode_look(const ode_run *run, const double *before, const double *y) {
  const ode_contact *k = run->contact;
  ode_state was, now;
  ode_observe(run, before, &was);
  ode_observe(run, y, &now);
  if (now.overlap <= 0 || ode_normal(k, now.overlap, now.approach) <= 0)
    return ODE_END;
  if (k->kind == ODE_SPRING && run->mode == ODE_FREE && fabs(now.ft) > k->mu * now.fn)
    return ODE_SLIP_BEGINS;
  if (k->kind == ODE_SPRING && run->mode == ODE_SLIDES &&
      run->sign * ode_spring_rate(k, &now) < ode_cap_rate(run, &now))
    return ODE_SLIP_ENDS;
  if (k->kind == ODE_REGULARISED && k->c >= 10) {
    bool holds = fabs(ode_holding_force(k, &now)) < 0.5 * k->mu * now.fn;
    if (run->mode == ODE_FREE && was.slip * now.slip < 0 && holds)
      return ODE_SLIP_ENDS;
    if (run->mode == ODE_HOLDS && !holds)
      return ODE_SLIP_BEGINS;
  }
  return was.approach > 0 && now.approach <= 0 ? ODE_TURNS : ODE_NOTHING;
}

static inline void ode_switch(ode_run *run, ode_event event, double *y) {
  ode_state s;
  if (event == ODE_TURNS)
    return;
  ode_observe(run, y, &s);
  if (run->contact->kind == ODE_REGULARISED) {
    run->mode = event == ODE_SLIP_ENDS ? ODE_HOLDS : ODE_FREE;
  } else if (event == ODE_SLIP_BEGINS) {
    run->mode = ODE_SLIDES;
    run->sign = y[ODE_FT] > 0 ? 1 : -1;
  } else {
    run->mode = ODE_FREE;
    y[ODE_FT] = s.ft;
  }
}

static inline void ode_begin(const ode_contact *k, double *y) {
  memset(y, 0, ODE_SIZE * sizeof *y);
  const ode_grain *grain[2] = {&k->i, &k->j};
  for (int b = 0; b < (k->plane ? 1 : 2); b++) {
    y[b * ODE_BODY + ODE_VX] = grain[b]->vx;
    y[b * ODE_BODY + ODE_VY] = grain[b]->vy;
    y[b * ODE_BODY + ODE_W] = grain[b]->omega;
  }
}

static inline void ode_scales(const ode_contact *k, double time, double *scale) {
  double speed = k->length / time;
  for (int b = 0; b < 2; b++) {
    scale[b * ODE_BODY + ODE_UX] = scale[b * ODE_BODY + ODE_UY] = k->length;
    scale[b * ODE_BODY + ODE_VX] = scale[b * ODE_BODY + ODE_VY] = speed;
    scale[b * ODE_BODY + ODE_W] = speed / k->i.r;
  }
  scale[ODE_FT] = ode_normal(k, k->length, 0);
}

// `time`: order of magnitude of the contact's duration [s]; `until`: stops there, HUGE_VAL at the end of contact.
static inline ode_result ode_solve(const ode_contact *k, double time, double until) {
  ode_run run = {k, ODE_FREE, 0};
  gsl_odeiv2_system system = {ode_rates, NULL, ODE_SIZE, &run};
  double y[ODE_SIZE], before[ODE_SIZE], scale[ODE_SIZE], t = 0, h = 1e-6 * time;
  ode_begin(k, y);
  ode_scales(k, time, scale);
  gsl_odeiv2_step *step = gsl_odeiv2_step_alloc(gsl_odeiv2_step_rk8pd, ODE_SIZE);
  gsl_odeiv2_control *control = gsl_odeiv2_control_scaled_new(1e-13, 0, 1, 0, scale, ODE_SIZE);
  gsl_odeiv2_evolve *evolve = gsl_odeiv2_evolve_alloc(ODE_SIZE);
  ode_result result = {0};
  double limit = until; // of this step: halved where something happens in it
  for (int steps = 0; t < until && steps < 1000000; steps++) {
    memcpy(before, y, sizeof y);
    double from = t;
    int status = gsl_odeiv2_evolve_apply(evolve, control, step, &system, &t, fmin(limit, until), &h, y);
    assert(status == GSL_SUCCESS);
    (void)status;
    limit = HUGE_VAL;
    ode_event event = ode_look(&run, before, y);
    if (event != ODE_NOTHING && t - from > 1e-14 * time) {
      h = 0.5 * (t - from);
      limit = from + h;
      t = from;
      memcpy(y, before, sizeof y);
      gsl_odeiv2_evolve_reset(evolve);
      gsl_odeiv2_step_reset(step);
      continue;
    }
    ode_state s;
    ode_observe(&run, y, &s);
    result.overlap = fmax(result.overlap, s.overlap);
    result.overlap_last = s.overlap;
    result.sliding += run.mode == ODE_SLIDES || (k->kind == ODE_REGULARISED && run.mode == ODE_FREE);
    result.sticking += run.mode == ODE_HOLDS || (k->kind == ODE_SPRING && run.mode == ODE_FREE);
    if (run.mode == ODE_HOLDS && s.fn > 0)
      result.stuck_share = fmax(result.stuck_share, fabs(s.ft) / (k->mu * s.fn));
    if (event == ODE_END)
      break;
    if (event != ODE_NOTHING) {
      ode_switch(&run, event, y);
      h = 1e-6 * time;
      gsl_odeiv2_evolve_reset(evolve);
      gsl_odeiv2_step_reset(step);
    }
  }
  for (int b = 0; b < 2; b++) {
    result.vx[b] = y[b * ODE_BODY + ODE_VX];
    result.vy[b] = y[b * ODE_BODY + ODE_VY];
    result.w[b] = y[b * ODE_BODY + ODE_W];
  }
  result.time = t;
  gsl_odeiv2_evolve_free(evolve);
  gsl_odeiv2_control_free(control);
  gsl_odeiv2_step_free(step);
  return result;
}

#endif
