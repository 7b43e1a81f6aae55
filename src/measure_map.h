// What the maps of `talus measure` share: the frame at hand on a canvas, lines as wide as forces, and a name for the
// file.
#ifndef TAL_MEASURE_MAP_H
#define TAL_MEASURE_MAP_H

#include "figures_canvas.h"
#include "measure_list.h"

typedef struct tal_measure_map {
  tal_plot plot;
  tal_figure_data data; // facts and the frame, read again for its walls, beads and loop
  tal_map map;
  bool open;
} tal_measure_map;

// Begins a map of the frame at hand with `lines` heading lines, the first two being the scene's name and `what` with
// the state. False when it cannot (reported in run) or there are no grains.
bool tal_measure_map_begin(tal_measure_map *m, tal_measuring *run, const char *what, int lines, bool colour_bar);
// Ends the plot command, draws OUT/name-NNNNNN.png.
void tal_measure_map_end(tal_measure_map *m, tal_measuring *run, const char *name);

// Elements. Grains as discs of one colour; the lines of contacts, in classes of width by force over `mean`, the mean
// one `width` px wide.
void tal_measure_map_discs(tal_measure_map *m, const tal_snapshot *s);
void tal_measure_map_contacts(tal_measure_map *m, const tal_snapshot *s, const int32_t *contact, size_t count,
                              double mean, double width, const char *name, const char *colour);
// Cells filled by value[cell_count] with the palette; NAN leaves a cell out.
void tal_measure_map_cells(tal_measure_map *m, const tal_snapshot *s, const double *value);

// A figure that is no map: begin with tal_plot_begin on run->out; this ends it as OUT/name.png and tells.
void tal_measure_plot_end(tal_plot *plot, tal_measuring *run, const char *name);
// Whether the user wants no more frames and figures.
bool tal_measure_stopped(tal_measuring *run);
// Keeps the first failure.
void tal_measure_failed(tal_measuring *run, tal_status status, const tal_error *err);

#endif
