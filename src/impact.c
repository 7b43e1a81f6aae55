// The motion is integrated in z = sqrt(overlap) over a stretched time, eq (62): in the time itself the damper starts as
// a square root, which costs any Runge-Kutta formula its order; in the stretched time every rate is a polynomial.
#include "impact.h"

#include "base.h"
#include "law_linear.h"

#include <assert.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>
#include <gsl/gsl_roots.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

static const double greatest_number = 1e90; // beyond it e is below 2e-150

// Overlap^1/2, approach speed or load, time, loss by the damper over b.
enum { ROOT, DRIVE, TIME, LOSS, SIZE };

// Force a z^3 + b z w in units of the impact: a = 1, b = beta for weak damping, a = beta^(-5/3), b = 1 for strong, z
// the root of the overlap, w the approach speed. The force over z is the load u = a z^2 + b w. Weak damping: w is
// integrated; at the end it is of order 1. Strong damping: u is; w then tends to -a z^2, and u would be a difference of
// near equals.
typedef struct motion {
  double a, b;
  bool strong;
} motion;

static double speed(const motion *m, const double *y) {
  return m->strong ? y[DRIVE] - m->a * y[ROOT] * y[ROOT] : y[DRIVE];
}

// Eq (62).
static int rates(double p, const double *y, double *rate, void *data) {
  (void)p;
  const motion *m = data;
  double z = y[ROOT], w = speed(m, y);
  rate[ROOT] = w;
  rate[DRIVE] = m->strong ? 2 * m->a * z * w - 2 * z * z * y[DRIVE] : -2 * z * z * (m->a * z * z + m->b * w);
  rate[TIME] = 2 * z;
  rate[LOSS] = 2 * z * z * w * w;
  return GSL_SUCCESS;
}

// Falls through zero where the contact ends, and stays below it where a step has passed z = 0.
static double load(const motion *m, const double *y) {
  return m->strong ? y[DRIVE] : m->a * y[ROOT] * fabs(y[ROOT]) + m->b * y[DRIVE];
}

// Part of a step, for the root finder: from the state `before` on.
typedef struct part {
  gsl_odeiv2_step *step;
  gsl_odeiv2_system *system;
  const double *before;
  double *after;
} part;

static double load_after(double h, void *data) {
  part *p = data;
  double error[SIZE];
  memcpy(p->after, p->before, SIZE * sizeof *p->after);
  gsl_odeiv2_step_reset(p->step);
  gsl_odeiv2_step_apply(p->step, 0, h, p->after, error, NULL, NULL, p->system);
  return load(p->system->params, p->after);
}

// Root of a function that changes sign between low and high, to round-off.
static double root_between(gsl_function *f, double low, double high) {
  gsl_root_fsolver *solver = gsl_root_fsolver_alloc(gsl_root_fsolver_brent);
  gsl_root_fsolver_set(solver, f, low, high);
  for (int k = 0; k < 200; k++) {
    gsl_root_fsolver_iterate(solver);
    low = gsl_root_fsolver_x_lower(solver);
    high = gsl_root_fsolver_x_upper(solver);
    if (gsl_root_test_interval(low, high, 1e-15, 1e-15) == GSL_SUCCESS)
      break;
  }
  double root = gsl_root_fsolver_root(solver);
  gsl_root_fsolver_free(solver);
  return root;
}

// Puts y at the instant, within the step of length h from `before` to y, at which the force is zero.
static void end_within(gsl_odeiv2_step *step, gsl_odeiv2_system *system, double h, const double *before, double *y) {
  if (load(system->params, y) == 0)
    return;
  part p = {step, system, before, y};
  gsl_function f = {load_after, &p};
  load_after(root_between(&f, 0, h), &p);
}

// From touching to the zero of the force; y becomes the state there.
static void integrate(motion *m, double *y) {
  gsl_odeiv2_system system = {rates, NULL, SIZE, m};
  const double scale[SIZE] = {1, m->a * m->a, 1, 1}; // strong damping: the load runs down to order a^2, then crosses 0
  gsl_odeiv2_step *step = gsl_odeiv2_step_alloc(gsl_odeiv2_step_rk8pd, SIZE);
  gsl_odeiv2_control *control = gsl_odeiv2_control_scaled_new(1e-14, 1e-14, 1, 0, scale, SIZE);
  gsl_odeiv2_evolve *evolve = gsl_odeiv2_evolve_alloc(SIZE);
  double p = 0, h = 1e-2, before[SIZE], from;
  memcpy(y, (const double[SIZE]){[DRIVE] = 1}, SIZE * sizeof *y);
  do {
    from = p;
    memcpy(before, y, sizeof before);
    int status = gsl_odeiv2_evolve_apply(evolve, control, step, &system, &p, HUGE_VAL, &h, y);
    assert(status == GSL_SUCCESS);
    (void)status;
  } while (load(m, y) > 0);
  end_within(step, &system, p - from, before, y);
  gsl_odeiv2_evolve_free(evolve);
  gsl_odeiv2_control_free(control);
  gsl_odeiv2_step_free(step);
}

tal_impact tal_impact_hertz(double damping_number) {
  assert(damping_number >= 0);
  if (damping_number == 0) // eq (63)
    return (tal_impact){1, 0, pow(1.25, 0.4) * 0.8 * sqrt(TAL_PI) * tgamma(0.4) / tgamma(0.9)};
  double beta = fmin(damping_number, greatest_number), y[SIZE];
  bool strong = beta > 1;
  motion m = {.strong = strong, .a = strong ? pow(beta, -5.0 / 3) : 1, .b = strong ? 1 : beta};
  integrate(&m, y);
  double z2 = y[ROOT] * y[ROOT];
  double e = -speed(&m, y);
  double lost = 2 * (m.b * y[LOSS] + 0.4 * m.a * z2 * z2 * y[ROOT]);
  return (tal_impact){e, lost / (1 + e), y[TIME] * (strong ? pow(beta, -2.0 / 3) : 1)};
}

double tal_impact_hertz_time(double stiffness, double reduced_mass, double speed) {
  double length = pow(reduced_mass * (speed * speed) / stiffness, 0.4);
  return length / speed;
}

// ln((1 - e) / e) over ln(beta): nearly a straight line, of slope 1 to 5/3.
static double balance(double log_number) {
  tal_impact impact = tal_impact_hertz(exp(log_number));
  return log(impact.loss) - log(impact.restitution);
}

static double excess(double log_number, void *target) {
  return balance(log_number) - *(double *)target;
}

double tal_impact_hertz_number(double restitution) {
  assert(restitution > 0 && restitution <= 1);
  if (restitution == 1)
    return 0;
  double target = log(1 - restitution) - log(restitution), most = log(greatest_number);
  gsl_function f = {excess, &target};
  if (excess(most, &target) <= 0)
    return greatest_number;
  return exp(root_between(&f, log(1e-17), most));
}

tal_impact tal_impact_linear(double damping_ratio) {
  assert(damping_ratio >= 0);
  double zeta = damping_ratio, side = sqrt(fabs(1 - zeta) * (1 + zeta)), e = tal_linear_restitution(zeta);
  double duration = side > 1e-8 ? 2 * (zeta < 1 ? acos(zeta) : acosh(zeta)) / side : 2; // eq (66)
  return (tal_impact){e, e < 1 ? -expm1(log(e)) : 0, duration};
}
