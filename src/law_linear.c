#include "law_linear.h"

#include <assert.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_roots.h>
#include <math.h>

double tal_linear_restitution(double zeta) {
  if (zeta <= 0)
    return 1;
  if (fabs(zeta - 1) < 1e-8)
    return exp(-2 + 4.0 / 3 * (1 - zeta)); // series about zeta = 1
  if (zeta < 1)
    return exp(-2 * zeta * acos(zeta) / sqrt((1 - zeta) * (1 + zeta)));
  return exp(-2 * zeta * acosh(zeta) / sqrt((zeta - 1) * (zeta + 1)));
}

static double excess(double log_zeta, void *log_restitution) {
  return log(tal_linear_restitution(exp(log_zeta))) - *(double *)log_restitution;
}

double tal_linear_damping_ratio(double restitution) {
  assert(restitution > 0 && restitution <= 1);
  if (restitution == 1)
    return 0;
  double target = log(restitution);
  gsl_function f = {excess, &target};
  gsl_root_fsolver *solver = gsl_root_fsolver_alloc(gsl_root_fsolver_brent);
  // e falls monotonically: zeta from 1e-17 (e = 1 - 3e-17) to 1e160 (e = 0 in double)
  gsl_root_fsolver_set(solver, &f, log(1e-17), log(1e150));
  for (int k = 0; k < 200; k++) {
    gsl_root_fsolver_iterate(solver);
    if (gsl_root_test_interval(gsl_root_fsolver_x_lower(solver), gsl_root_fsolver_x_upper(solver), 0, 1e-15) ==
        GSL_SUCCESS)
      break;
  }
  double zeta = exp(gsl_root_fsolver_root(solver));
  gsl_root_fsolver_free(solver);
  return zeta;
}
