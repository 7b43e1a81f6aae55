// What a figure is: a constant descriptor at the end of figures_curves.c or figures_maps.c and one line in the list of
// figures.c. What the figures share of a run is read once.
#ifndef TAL_FIGURES_LIST_H
#define TAL_FIGURES_LIST_H

#include "figures_affine.h"
#include "figures_data.h"
#include "figures_frames.h"
#include "figures_gnuplot.h"

// What a figure needs of the run.
enum {
  TAL_NEEDS_SERIES = 1,          // at least two rows
  TAL_NEEDS_STRAIN = 2,          // at least two rows from the start of the first compression on
  TAL_NEEDS_CONFINE = 4,         // at least two rows before it
  TAL_NEEDS_FRAME = 8,           // a frame with grains
  TAL_NEEDS_CELLS = 16,          // the last frame has cells
  TAL_NEEDS_WINDOW = 32,         // two frames of the same grains at different times
  TAL_NEEDS_STRAINED_WINDOW = 64 // and at different axial strains
};

// The same grains in two frames, in the order of their ids.
typedef struct tal_window {
  size_t count;
  double *x, *y, *r;        // owned; [count] at the earlier frame [m]
  double *dx, *dy, *dtheta; // owned; [count] later - earlier [m], [rad]
} tal_window;

typedef struct tal_figure_data {
  tal_run_facts facts;
  tal_table series;    // 0 rows when there is no series.csv
  size_t strain_begin; // first row of the compression; `rows` when there is none
  size_t confine_begin, confine_end;
  tal_frame_list frames;
  // grain_count 0: no such frame, or the same as `last`. `confined` is the latest unstrained one of a compressed run
  // unless that is the first; `earlier` begins the window that ends with `last`.
  tal_frame first, confined, earlier, last;
  tal_window window;
  unsigned offers; // mask of what the run can meet
} tal_figure_data;

// Reads everything. What cannot be read is left out of *data and reported: TAL_BAD_INPUT when `dir` holds no run,
// else TAL_IO or TAL_BAD_INPUT with *data good for what remains.
tal_status tal_figure_data_read(tal_figure_data *data, const char *dir, tal_error *err);
void tal_figure_data_clear(tal_figure_data *data);

typedef struct tal_figure {
  const char *name; // of the file, without .png
  const char *help;
  unsigned needs;
  void (*draw)(const tal_figure_data *data, tal_plot *plot); // writes script and data files, or sets plot->empty
} tal_figure;

extern const tal_figure tal_figure_confinement, tal_figure_stress_ratio, tal_figure_volumetric_strain,
    tal_figure_mean_slip, tal_figure_energy, tal_figure_fabric;
extern const tal_figure tal_figure_grains_first, tal_figure_grains_confined, tal_figure_grains_last,
    tal_figure_displacement, tal_figure_rotation, tal_figure_cells_L_II, tal_figure_cells_pressure;

#endif
