// See measure_fit.h.
#include "measure_fit.h"

#include <gsl/gsl_blas.h>
#include <gsl/gsl_multifit_nlinear.h>
#include <math.h>
#include <stdlib.h>

typedef struct problem {
  tal_fit_model *model;
  void *context;
  const double *data;
  double *value; // [count] room for the model
} problem;

static int residuals(const gsl_vector *parameter, void *user, gsl_vector *out) {
  const problem *p = user;
  double at[TAL_FIT_MOST];
  for (size_t k = 0; k < parameter->size; k++)
    at[k] = gsl_vector_get(parameter, k);
  p->model(p->context, at, p->value);
  for (size_t k = 0; k < out->size; k++) // a column of the Jacobian has a stride
    gsl_vector_set(out, k, p->value[k] - p->data[k]);
  return GSL_SUCCESS;
}

static void take_errors(tal_fit *fit, size_t parameters, size_t count, gsl_multifit_nlinear_workspace *work) {
  gsl_matrix *covariance = gsl_matrix_alloc(parameters, parameters);
  gsl_multifit_nlinear_covar(gsl_multifit_nlinear_jac(work), 0, covariance);
  const double variance = fit->residual / (double)(count - parameters);
  for (size_t k = 0; k < parameters; k++)
    fit->error[k] = sqrt(fmax(0, gsl_matrix_get(covariance, k, k) * variance));
  gsl_matrix_free(covariance);
}

void tal_fit_solve(tal_fit *fit, size_t parameters, tal_fit_model *model, void *context, const double *data,
                   const double *weight, size_t count) {
  problem p = {model, context, data, tal_alloc(count, sizeof(double))};
  gsl_multifit_nlinear_parameters how = gsl_multifit_nlinear_default_parameters();
  gsl_multifit_nlinear_fdf f = {.f = residuals, .n = count, .p = parameters, .params = &p};
  gsl_multifit_nlinear_workspace *work =
      gsl_multifit_nlinear_alloc(gsl_multifit_nlinear_trust, &how, count, parameters);
  gsl_vector_view start = gsl_vector_view_array(fit->parameter, parameters);
  gsl_vector_const_view weights = gsl_vector_const_view_array(weight, count);
  int info;
  gsl_multifit_nlinear_winit(&start.vector, &weights.vector, &f, work);
  fit->converged = gsl_multifit_nlinear_driver(100, 1e-8, 1e-8, 0, NULL, NULL, &info, work) == GSL_SUCCESS;
  gsl_blas_ddot(gsl_multifit_nlinear_residual(work), gsl_multifit_nlinear_residual(work), &fit->residual);
  take_errors(fit, parameters, count, work);
  for (size_t k = 0; k < parameters; k++)
    fit->parameter[k] = gsl_vector_get(gsl_multifit_nlinear_position(work), k);
  gsl_multifit_nlinear_free(work);
  free(p.value);
}
