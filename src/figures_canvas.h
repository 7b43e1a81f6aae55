// What every map of a frame shares: where the assembly lies on the canvas, axes in mm with equal scale, heading lines
// above it, walls and loop.
#ifndef TAL_FIGURES_CANVAS_H
#define TAL_FIGURES_CANVAS_H

#include "figures_list.h"

typedef struct tal_map {
  double x0, y0, x1, y1;                // [m] drawn range
  double scale;                         // [px/m]
  int width, height;                    // [px] canvas
  int left, top, box_width, box_height; // [px] the box of the axes
} tal_map;

// The range of the frame's grains. Grains alone set it, so that a wall without end does not shrink them.
tal_map tal_map_of_frame(const tal_frame *frame);
// Widens the range to a disc. What is not finite does not count.
void tal_map_include(tal_map *m, double x, double y, double r);
// Fixes scale and canvas for `lines` lines of heading above the box, with room for a colour bar on its right.
void tal_map_fit(tal_map *m, int lines, bool colour_bar);
// Height of heading line `line` in gnuplot's screen coordinates.
double tal_map_line_height(const tal_map *m, int line);
// Terminal, axes, and the scene's name as heading line 0.
void tal_map_open(const tal_map *m, const tal_figure_data *data, tal_plot *plot);
// Another heading line, in our own words: enhanced text without single quotes.
void tal_map_heading(const tal_map *m, tal_plot *plot, int line, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Plot elements: the loop as a closed line of gnuplot's `style`; the walls. Nothing where the frame has none.
void tal_map_loop(const tal_frame *frame, tal_plot *plot, const char *style);
void tal_map_walls(const tal_frame *frame, tal_plot *plot);
// "axial strain 3 %", or the time where there is none; the same for the window from the earlier to the last frame.
void tal_map_state(const tal_figure_data *data, const tal_frame *frame, char text[64]);
void tal_map_window(const tal_figure_data *data, char text[64]);

#endif
