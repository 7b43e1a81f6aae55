// Small scenes for the physics tests: a scene text becomes a simulation that is stepped and thrown away.
#ifndef PHYSICS_H
#define PHYSICS_H

#include "scene_files.h"
#include "sim.h"
#include <gsl/gsl_fit.h>
#include <math.h>
#include <omp.h>
#include <stdarg.h>

typedef struct physics {
  tal_scene scene;
  tal_sim *sim;
} physics;

// The scene of a printf format; nothing stays on disk.
__attribute__((format(printf, 2, 3))) static inline void physics_open(physics *p, const char *format, ...) {
  char text[4096];
  va_list arguments;
  va_start(arguments, format);
  int size = vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  assert_true(size > 0 && (size_t)size < sizeof text);
  omp_set_num_threads(1); // two grains
  scene_folder folder = scene_folder_create();
  tal_scene_errors errors = {0};
  tal_status status = load_text(&folder, text, &p->scene, &errors);
  scene_folder_remove(&folder);
  if (status != TAL_OK)
    fail_msg("%s\n%s", errors.item[0].text, text);
  tal_error err;
  if (tal_sim_create(&p->sim, &p->scene, &err) != TAL_OK)
    fail_msg("%s\n%s", err.text, text);
}

static inline void physics_step(physics *p) {
  tal_error err;
  if (tal_sim_step(p->sim, &err) != TAL_OK)
    fail_msg("%s", err.text);
}

static inline void physics_to_end(physics *p) {
  while (!tal_sim_done(p->sim))
    physics_step(p);
}

static inline void physics_close(physics *p) {
  tal_sim_free(p->sim);
  tal_scene_clear(&p->scene);
}

// Slope of log(error) over log(dt).
static inline double fitted_order(const double *dt, const double *error, size_t count) {
  double x[32], y[32], c0, c1, cov00, cov01, cov11, sum;
  assert_true(count >= 4 && count <= 32);
  for (size_t k = 0; k < count; k++) {
    assert_true(error[k] > 0);
    x[k] = log(dt[k]);
    y[k] = log(error[k]);
  }
  gsl_fit_linear(x, 1, y, 1, count, &c0, &c1, &cov00, &cov01, &cov11, &sum);
  return c1;
}

// |value - expected| <= tolerance * scale, with both in the message.
#define assert_near(value, expected, tolerance, scale)                                                                 \
  do {                                                                                                                 \
    double near_value = (value), near_expected = (expected), near_scale = (scale);                                     \
    double near_error = fabs((near_value - near_expected) / near_scale);                                               \
    if (!(near_error <= (tolerance)))                                                                                  \
      fail_msg("%s = %.17g, expected %.17g: off by %.3g, allowed %.3g", #value, near_value, near_expected, near_error, \
               (double)(tolerance));                                                                                   \
  } while (0)
#define assert_relative(value, expected, tolerance) assert_near(value, expected, tolerance, expected)

#endif
