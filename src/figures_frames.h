// The field frames DIR/fields/NNNNNN.h5 as the figures need them: grains, contacts, walls, beads, cells,
// loop.
#ifndef TAL_FIGURES_FRAMES_H
#define TAL_FIGURES_FRAMES_H

#include "base.h"

typedef struct tal_frame_entry {
  char *path;          // owned
  double time;         // [s]
  double axial_strain; // [-] compression positive
} tal_frame_entry;

typedef struct tal_frame_list {
  size_t count;
  tal_frame_entry *entry; // owned; [count] in the order of their numbers
} tal_frame_list;

// One frame. A group that is missing in the file has count 0. Indices are checked: below the counts.
typedef struct tal_frame {
  double time, axial_strain;
  size_t grain_count;
  int64_t *id;               // owned; [grain_count] ascending
  double *x, *y, *r, *theta; // owned; [grain_count] [m], [rad]
  double *omega;             // owned; [grain_count] [rad/s]; NAN where the file has none
  size_t contact_count;      // grain-grain, overlap beyond round-off
  int64_t *i, *j;            // owned; [contact_count] grain indices
  double *fn;                // owned; [contact_count] normal force [N]
  double *ft;                // owned; [contact_count] tangential force [N]; NAN where the file has none
  size_t wall_count;         // walls and plates there at this time
  double (*wall)[4];         // owned; [wall_count] x0 y0 x1 y1 [m]; a plate as wide as the grains lie
  size_t bead_count;         // of a membrane
  double *bx, *by, *br;      // owned; [bead_count] [m]
  size_t cell_count;
  int64_t *corner[3]; // owned; [cell_count] grain indices
  double *L_II;       // owned; [cell_count] [1/s]
  double *pressure;   // owned; [cell_count] [Pa]
  double *area;       // owned; [cell_count] [m^2]
  size_t loop_count;
  int64_t *loop; // owned; [loop_count] grain indices, counter-clockwise
} tal_frame;

// Lists the frames of a run with their times. A folder without frames gives count 0 and TAL_OK. A frame that cannot be
// opened is left out and reported (TAL_IO) after the others were listed; *list is good in either case.
tal_status tal_frame_list_read(tal_frame_list *list, const char *dir, tal_error *err);
void tal_frame_list_clear(tal_frame_list *list);
// TAL_IO when the file cannot be read or contradicts itself; *frame is empty then.
tal_status tal_frame_read(tal_frame *frame, const char *path, tal_error *err);
void tal_frame_clear(tal_frame *frame);

#endif
