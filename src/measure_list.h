// What a measurement of `talus measure` is: a constant descriptor at the end of its measure_report_*.c and one line in
// the list of measure.c.
#ifndef TAL_MEASURE_LIST_H
#define TAL_MEASURE_LIST_H

#include "figures_gnuplot.h"
#include "measure.h"
#include "measure_facts.h"
#include "measure_select.h"
#include "measure_tables.h"

// One run of the command; borrowed by the measurements.
typedef struct tal_measuring {
  const char *dir, *out;
  const tal_measure_options *options;
  tal_measure_facts facts;
  tal_frame_choice choice;
  tal_tables tables;
  char *name;         // owned; of the scene
  size_t frame;       // the one at hand
  bool detail;        // it is named by --at
  double strain_step; // options->over or its default
  tal_status status;  // the first failure of a figure; the rest goes on
  tal_error err;
} tal_measuring;

typedef struct tal_measurement {
  void *(*create)(tal_measuring *run);
  void (*frame)(void *state, tal_measuring *run, const tal_part *part);
  void (*finish)(void *state, tal_measuring *run); // also frees the state
} tal_measurement;

extern const tal_measurement tal_measurement_tensors, tal_measurement_forces, tal_measurement_chains,
    tal_measurement_voids, tal_measurement_bands, tal_measurement_export;

// Begins a row: frame, time, axial strain.
void tal_measuring_row(const tal_measuring *run, const tal_part *part, FILE *table);
// The columns that tal_measuring_row writes.
#define TAL_ROW "frame,time[s],axial_strain"

#endif
