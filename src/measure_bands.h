// Shear bands: profiles of a field across the sample, a band's axis, place and width with their uncertainty, and
// whether bands stay from one strain window to the next. Equations (M33)-(M37).
#ifndef TAL_MEASURE_BANDS_H
#define TAL_MEASURE_BANDS_H

#include "base.h"
#include <stdbool.h>

// A field at points, each standing for an area.
typedef struct tal_field {
  size_t count;
  double *x, *y, *value, *weight; // owned; [count] [m], field's unit, [m^2]
} tal_field;
tal_field tal_field_create(size_t capacity); // count 0
void tal_field_add(tal_field *field, double x, double y, double value, double weight);
void tal_field_clear(tal_field *field);

// One straight band: value = base + height exp(-(s - place)^2 / (2 sigma^2)), s across it (M33). Errors by leaving out
// one of eight lengths of the band after the other (jackknife), which counts that neighbouring points are alike (M34).
typedef struct tal_band {
  bool found;               // height above two errors, width from a mean diameter to half of the sample's extent across
  double axis, axis_error;  // [rad] direction along the band, in [0, pi)
  double x, y, place_error; // [m] its point nearest to the middle of the points
  double width, width_error; // [m] full width at half height: 2.3548 sigma
  double base, height, height_error;
  double explained;     // share of the field's weighted variance
  double concentration; // share of the field's integral within the width over the share of area there
} tal_band;
// More than 5000 points are first merged into so many boxes. diameter [m]: mean diameter, the finest scale looked at.
// All 0 when there are fewer than 30 points or no variance.
tal_band tal_band_fit(const tal_field *field, double diameter);

// Means over strips across a direction.
enum { TAL_PROFILE_MOST = 400 };
typedef struct tal_profile {
  size_t count;
  double width;                   // [m] of a strip
  double s[TAL_PROFILE_MOST];     // [m] middle of the strip, along (cos, sin) angle
  double mean[TAL_PROFILE_MOST];  // weighted
  double error[TAL_PROFILE_MOST]; // standard error if points are independent
  size_t points[TAL_PROFILE_MOST];
} tal_profile;
tal_profile tal_profile_across(const tal_field *field, double angle, double strip);

// Fields of successive strain windows on the same material boxes (M35).
typedef struct tal_windows {
  size_t boxes, count; // of the grid; of windows
  double **value;      // owned; [count][boxes] mean of the field over the box's grains, NAN where there are too few
} tal_windows;
void tal_windows_add(tal_windows *windows, const double *box_value);
void tal_windows_clear(tal_windows *windows);
typedef struct tal_persistence {
  size_t pairs;
  double correlation, error; // mean over the pairs of windows `lag` apart, and its standard error
} tal_persistence;
tal_persistence tal_windows_persist(const tal_windows *windows, size_t lag);

#endif
