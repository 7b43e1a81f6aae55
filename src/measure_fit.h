// Weighted nonlinear least squares with GSL's trust-region Levenberg-Marquardt, derivatives by differences.
#ifndef TAL_MEASURE_FIT_H
#define TAL_MEASURE_FIT_H

#include "base.h"
#include <stdbool.h>

enum { TAL_FIT_MOST = 8 }; // parameters

// value[count] of the model with these parameters.
typedef void tal_fit_model(void *context, const double *parameter, double *value);

typedef struct tal_fit {
  double parameter[TAL_FIT_MOST]; // in: the start; out: the minimum
  double error[TAL_FIT_MOST];     // standard errors if the residuals are independent
  double residual;                // weighted sum of squares
  bool converged;
} tal_fit;

// data[count], weight[count] >= 0, count > parameters.
void tal_fit_solve(tal_fit *fit, size_t parameters, tal_fit_model *model, void *context, const double *data,
                   const double *weight, size_t count);

#endif
