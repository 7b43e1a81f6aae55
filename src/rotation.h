// What `talus rotation` finds out: the force network around a grain and how far its forced spin reaches, for one run or
// for all runs of forced grains below a folder. Reads field frames and run.json, writes tables; figures are in
// figures_rotation.h.
#ifndef TAL_ROTATION_H
#define TAL_ROTATION_H

#include "directional.h"
#include "figures_frames.h"
#include "transmission.h"

enum { TAL_ROSE = 36, TAL_SECTORS = 12 };

typedef struct tal_rotation_options {
  int64_t grain;   // -1: the forced one
  int64_t frame;   // number of the field frame, -1: the last
  int64_t network; // number of the frame whose forces count, -1: the same frame
  int64_t since;   // spins as mean rates since that frame, -1: those of the instant
  double reach;    // R [mean diameters]
} tal_rotation_options;

// One grain and what lies around it. Distances r in mean diameters.
typedef struct tal_rotation {
  char *run;     // owned; its folder
  size_t sample; // which confined state it began from
  int64_t grain;
  bool forced;
  double x, y;               // [m]
  double omega;              // [rad/s] of the instant, or the mean since the frame asked for
  double time;               // [s] of the frame
  double diameter;           // [m] mean
  double rim;                // [mean diameters] to the nearest grain of the loop; NAN without a loop
  size_t contacts;           // of the grain
  double load;               // sum of the forces on its contacts over <f>, in the network looked at
  size_t rattlers;           // of the assembly: grains with fewer than two contacts, left out below
  size_t points;             // all other grains that bear
  double *r, *angle, *ratio; // owned; [points] |omega| over that of the forced grain
  size_t segments;           // within reach
  geo_tensor tensor;
  double value[2];
  geo_vec axis[2];
  double rose[TAL_ROSE];
  tal_decay decay;  // points 0: not forced, or no fit
  double influence; // [mean diameters] NAN where nothing is forced
  double along[TAL_SECTORS], across[TAL_SECTORS], transmission[TAL_SECTORS];
  size_t used[TAL_SECTORS];
} tal_rotation;

// Looks at one run. `frame` may be NULL; else it is filled and the caller's. TAL_BAD_INPUT when the run has no such
// grain or frame, or no grain is forced and none is named; TAL_IO.
tal_status tal_rotation_read(tal_rotation *rotation, const char *dir, const tal_rotation_options *options,
                             tal_frame *frame, tal_error *err);
void tal_rotation_clear(tal_rotation *rotation);

// Does its spin reach any other grain (R9)? One that slips on all its contacts has no decay length to speak of.
static inline bool tal_rotation_transmits(const tal_rotation *rotation) {
  return rotation->influence > 0;
}

typedef struct tal_rotations {
  size_t count, samples;
  tal_rotation *item; // owned; sample by sample
  double confidence;  // of all intervals
  size_t transmitting;
  tal_interval share;                            // of the forced grains that transmit
  tal_interval load, load_others;                // mean load of those that do and of those that do not
  tal_interval length, influence;                // means over those that do [mean diameters]
  double length_low, length_median, length_high; // quantiles 5, 50, 95 %
  tal_sector_statistics sectors;
} tal_rotations;

// Every finished run of a forced grain in or below `dir`. TAL_BAD_INPUT when there is none; TAL_IO. A sample is the
// folder that holds `runs/`, else the run's own.
tal_status tal_rotations_read(tal_rotations *all, const char *dir, const tal_rotation_options *options, tal_error *err);
void tal_rotations_clear(tal_rotations *all);
// Mean ratio of the grains in the shell [k, k+1) of a rotation; NAN where there are none.
double tal_rotation_shell(const tal_rotation *rotation, size_t k);

// dir/rotation/{forced,sectors,shells}.csv, and points.csv for a single grain (docs/formats.md). TAL_IO.
tal_status tal_rotations_write(const tal_rotations *all, const char *dir, tal_error *err);
// What was found, for people; owned by the caller.
char *tal_rotations_text(const tal_rotations *all, const tal_rotation_options *options);

#endif
