// Figures of field frames: force chains, displacements, rotations, cells. Palettes have monotone lightness. 100,000
// grains draw in seconds: few plot elements, each over one data file.
#include "figures_canvas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A border tells neighbours apart; where discs are a few pixels it would be all there is to see.
static const char *disc_border(size_t count) {
  return count > 20000 ? "noborder" : "border lc rgb '#a0a0a0'";
}

static void draw_discs(const tal_frame *frame, tal_plot *plot) {
  FILE *data = tal_plot_data(plot, "discs");
  for (size_t k = 0; data && k < frame->grain_count; k++)
    fprintf(data, "%.9g %.9g %.6g\n", 1e3 * frame->x[k], 1e3 * frame->y[k], 1e3 * frame->r[k]);
  tal_plot_data_end(plot, data);
  tal_plot_element(plot);
  fprintf(plot->script, "'discs' using 1:2:3 with circles lc rgb '#dcdcdc' fs solid %s",
          disc_border(frame->grain_count));
}

static void draw_beads(const tal_frame *frame, tal_plot *plot) {
  if (!frame->bead_count)
    return;
  FILE *data = tal_plot_data(plot, "beads");
  for (size_t k = 0; data && k < frame->bead_count; k++)
    fprintf(data, "%.9g %.9g %.6g\n", 1e3 * frame->bx[k], 1e3 * frame->by[k], 1e3 * frame->br[k]);
  tal_plot_data_end(plot, data);
  tal_plot_element(plot);
  fputs("'beads' using 1:2:3 with circles lc rgb '#7a7a7a' fs solid border lc rgb '#4d4d4d'", plot->script);
}

static double mean_of(const double *value, size_t count) {
  double sum = 0;
  size_t good = 0;
  for (size_t k = 0; k < count; k++)
    if (isfinite(value[k]))
      sum += value[k], good++;
  return good ? sum / (double)good : 0;
}

// Lines from centre to centre; gnuplot draws one width per element, so forces fall into classes a quarter of the mean
// wide, the last one open.
static void draw_chains(const tal_frame *frame, tal_plot *plot, double mean, double mean_width) {
  enum { CLASSES = 32 };
  size_t used[CLASSES] = {0};
  FILE *data[CLASSES] = {0};
  char name[32];
  for (size_t c = 0; c < frame->contact_count; c++) {
    double ratio = frame->fn[c] / mean;
    if (!(ratio > 0))
      continue;
    size_t k = ratio < CLASSES / 4 - 0.25 ? (size_t)(ratio * 4) : CLASSES - 1, i = (size_t)frame->i[c],
           j = (size_t)frame->j[c];
    snprintf(name, sizeof name, "chains%zu", k);
    if (!used[k]++)
      data[k] = tal_plot_data(plot, name);
    if (!data[k])
      continue;
    fprintf(data[k], "%.9g %.9g\n%.9g %.9g\n\n", 1e3 * frame->x[i], 1e3 * frame->y[i], 1e3 * frame->x[j],
            1e3 * frame->y[j]);
  }
  for (size_t k = 0; k < CLASSES; k++) {
    if (!used[k])
      continue;
    tal_plot_data_end(plot, data[k]);
    tal_plot_element(plot);
    fprintf(plot->script, "'chains%zu' using 1:2 with lines lw %.3f lc rgb '#1b2a5c'", k,
            mean_width * ((double)k + 0.5) / 4);
  }
}

static void draw_grains(const tal_figure_data *data, const tal_frame *frame, tal_plot *plot) {
  char state[64];
  if (frame->grain_count == 0) {
    plot->empty = true;
    return;
  }
  tal_map m = tal_map_of_frame(frame);
  double mean = mean_of(frame->fn, frame->contact_count), diameter = 2 * mean_of(frame->r, frame->grain_count);
  bool forces = mean > 0;
  tal_map_fit(&m, forces ? 3 : 2, false);
  tal_map_open(&m, data, plot);
  tal_map_state(data, frame, state);
  tal_map_heading(&m, plot, 1, "%s, %s", forces ? "contact forces" : "grains", state);
  if (forces)
    tal_map_heading(&m, plot, 2, "line width ∝ f_n,  ⟨f_n⟩ = %.3g N", mean);
  draw_discs(frame, plot);
  draw_beads(frame, plot);
  tal_map_walls(frame, plot);
  if (forces)
    draw_chains(frame, plot, mean, 0.1 * diameter * m.scale);
  tal_map_loop(frame, plot, "lw 2 lc rgb '#d55e00'");
  tal_plot_command_end(plot);
}

static void draw_grains_first(const tal_figure_data *data, tal_plot *plot) {
  draw_grains(data, &data->first, plot);
}

static void draw_grains_confined(const tal_figure_data *data, tal_plot *plot) {
  draw_grains(data, &data->confined, plot);
}

static void draw_grains_last(const tal_figure_data *data, tal_plot *plot) {
  draw_grains(data, &data->last, plot);
}

static int ascending(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

// The value below which `share` of the magnitudes lie; 0 when there are none.
static double quantile(const double *value, size_t count, double share) {
  double *sorted = tal_alloc(count, sizeof *sorted);
  size_t good = 0;
  for (size_t k = 0; k < count; k++)
    if (isfinite(value[k]))
      sorted[good++] = fabs(value[k]);
  qsort(sorted, good, sizeof *sorted, ascending);
  double result = good ? sorted[(size_t)ceil(share * (double)(good - 1))] : 0;
  free(sorted);
  return result;
}

// Arrows from the earlier positions, one grain in `stride`.
static void write_arrows(tal_plot *plot, const tal_window *window, const double *dx, const double *dy, size_t stride,
                         double gain) {
  FILE *data = tal_plot_data(plot, "arrows");
  for (size_t k = 0; data && k < window->count; k += stride)
    if (isfinite(dx[k]) && isfinite(dy[k]))
      fprintf(data, "%.9g %.9g %.9g %.9g\n", 1e3 * window->x[k], 1e3 * window->y[k], 1e3 * gain * dx[k],
              1e3 * gain * dy[k]);
  tal_plot_data_end(plot, data);
  tal_plot_element(plot);
  fputs("'arrows' using 1:2:3:4 with vectors head filled size screen 0.008,18 lw 2 lc rgb '#000000'", plot->script);
}

// A bar as long as `length` is drawn, at the left of heading line 3.
static void reference_arrow(const tal_map *m, tal_plot *plot, double length, double gain) {
  double pixels = length * gain * m->scale, y = tal_map_line_height(m, 3);
  double from = m->left + 0.5 * m->box_width - 185 - pixels;
  fprintf(plot->script,
          "set arrow 1 from screen %.6f, screen %.6f to screen %.6f, screen %.6f head filled size screen 0.010,18 "
          "lw 3 lc rgb '#000000' front\n",
          from / m->width, y, (from + pixels) / m->width, y);
}

static void draw_displacement(const tal_figure_data *data, tal_plot *plot) {
  const tal_window *window = &data->window;
  size_t n = window->count, bytes = n * sizeof(double), stride = n / 6000 + 1;
  double *dx = memcpy(tal_alloc(n, sizeof *dx), window->dx, bytes);
  double *dy = memcpy(tal_alloc(n, sizeof *dy), window->dy, bytes);
  double *size = tal_alloc(n, sizeof *size);
  char text[64];
  double from = data->earlier.axial_strain, to = data->last.axial_strain;
  tal_affine affine = tal_affine_fit(n, window->x, window->y, dx, dy, (from - to) / (1 - from));
  tal_affine_subtract(affine, n, window->x, window->y, dx, dy);
  for (size_t k = 0; k < n; k++)
    size[k] = hypot(dx[k], dy[k]);
  tal_map m = tal_map_of_frame(&data->earlier);
  double spacing = sqrt((m.x1 - m.x0) * (m.y1 - m.y0) * (double)stride / (double)n), typical = quantile(size, n, 0.9);
  // Ticks of 1, 2, 5 make the gain a number to remember and the reference a round length.
  double gain = typical > 0 ? tal_plot_tick_step(1.1 * spacing / typical, 1) : 1;
  double reference = tal_plot_tick_step(typical > 0 ? typical : spacing, 1);
  // Room for the arrows too, except for grains that flew off.
  for (size_t k = 0; k < n; k += stride)
    if (size[k] <= 4 * typical)
      tal_map_include(&m, window->x[k] + gain * dx[k], window->y[k] + gain * dy[k], 0);
  tal_map_fit(&m, 4, false);
  tal_map_open(&m, data, plot);
  tal_map_heading(&m, plot, 1, "displacement relative to affine, uniform ε_{yy}");
  tal_map_window(data, text);
  if (stride == 1)
    tal_map_heading(&m, plot, 2, "%s", text);
  else
    tal_map_heading(&m, plot, 2, "%s, 1 grain in %zu", text, stride);
  tal_map_heading(&m, plot, 3, "= %.3g mm,  drawn × %g", 1e3 * reference, gain);
  reference_arrow(&m, plot, reference, gain);
  tal_map_loop(&data->earlier, plot, "lw 2 lc rgb '#909090'");
  write_arrows(plot, window, dx, dy, stride, gain);
  tal_plot_command_end(plot);
  free(dx);
  free(dy);
  free(size);
}

// Cividis [Nunez, Anderton, Renslow 2018], whose lightness rises evenly; the middle grey stands for no rotation.
static void draw_rotation(const tal_figure_data *data, tal_plot *plot) {
  const tal_window *window = &data->window;
  char text[64];
  double degree = 180 / TAL_PI, reach = degree * quantile(window->dtheta, window->count, 0.98);
  double step = reach > 0 ? tal_plot_tick_step(reach, 2.5) : 1;
  reach = step * fmax(1, ceil(reach / step - 1e-9));
  tal_map m = tal_map_of_frame(&data->last);
  tal_map_fit(&m, 3, true);
  tal_map_open(&m, data, plot);
  tal_map_heading(&m, plot, 1, "rotation of grains, counter-clockwise +");
  tal_map_window(data, text);
  tal_map_heading(&m, plot, 2, "%s", text);
  fputs("set palette defined (0 '#00224e', 1 '#123570', 2 '#3b496c', 3 '#575d6d', 4 '#707173', 5 '#8a8678', "
        "6 '#a59c74', 7 '#c3b369', 8 '#fee838') maxcolors 256\n",
        plot->script);
  fprintf(plot->script,
          "set cbrange [%.9g:%.9g]\nset cbtics %.9g\nset cblabel 'rotation (degrees)' offset 1\nset colorbox\n", -reach,
          reach, step);
  FILE *out = tal_plot_data(plot, "discs");
  // Earlier position plus displacement is the position in the last frame.
  for (size_t k = 0; out && k < window->count; k++)
    fprintf(out, "%.9g %.9g %.6g %.6g\n", 1e3 * (window->x[k] + window->dx[k]), 1e3 * (window->y[k] + window->dy[k]),
            1e3 * window->r[k], degree * window->dtheta[k]);
  tal_plot_data_end(plot, out);
  tal_plot_element(plot);
  fprintf(plot->script, "'discs' using 1:2:3:4 with circles lc palette fs solid %s", disc_border(window->count));
  tal_map_walls(&data->last, plot);
  tal_plot_command_end(plot);
}

// A map of a cell value over its area-weighted mean. Up to `shade` times the mean pale greys, beyond it a colour scale
// that ends at `most`: the cells that P shades stand out, and lightness falls throughout.
typedef struct cell_map {
  const double *value; // [cell_count]
  double shade, most;
  const char *what, *ratio, *symbol, *unit;
  double unit_scale; // from SI to `unit`
} cell_map;

static double mean_over_area(const tal_frame *frame, const double *value) {
  double sum = 0, area = 0;
  for (size_t k = 0; k < frame->cell_count; k++) {
    if (!isfinite(value[k]) || !isfinite(frame->area[k]))
      continue;
    sum += value[k] * frame->area[k];
    area += frame->area[k];
  }
  return area > 0 ? sum / area : 0;
}

static void write_cells(tal_plot *plot, const tal_frame *frame, const double *value, double mean) {
  FILE *out = tal_plot_data(plot, "cells");
  for (size_t k = 0; out && k < frame->cell_count; k++) {
    if (!isfinite(value[k]))
      continue;
    for (int c = 0; c < 3; c++) {
      size_t node = (size_t)frame->corner[c][k];
      fprintf(out, "%.9g %.9g %.5g\n", 1e3 * frame->x[node], 1e3 * frame->y[node], value[k] / mean);
    }
    fputc('\n', out);
  }
  tal_plot_data_end(plot, out);
}

static void draw_cells(const tal_figure_data *data, tal_plot *plot, const cell_map *cells) {
  char state[64];
  const tal_frame *frame = &data->last;
  double mean = mean_over_area(frame, cells->value);
  if (!(mean > 0)) {
    plot->empty = true;
    return;
  }
  tal_map m = tal_map_of_frame(frame);
  tal_map_fit(&m, 3, true);
  tal_map_open(&m, data, plot);
  tal_map_state(data, frame, state);
  tal_map_heading(&m, plot, 1, "%s", cells->what);
  tal_map_heading(&m, plot, 2, "%s,  ⟨%s⟩ = %.3g %s", state, cells->symbol, mean * cells->unit_scale, cells->unit);
  fprintf(plot->script,
          "set palette defined (0 '#fbfbfb', %g '#c9c9c9', %g '#f0a83c', %g '#c4461f', %g '#3b0f2f') maxcolors 256\n"
          "set cbrange [0:%g]\nset cblabel '%s'\nset colorbox\nset cbtics 1\nset cbtics add ('%g' %g, '≥%g' %g)\n",
          cells->shade, cells->shade * 1.0001, cells->shade + 0.4 * (cells->most - cells->shade), cells->most,
          cells->most, cells->ratio, cells->shade, cells->shade, cells->most, cells->most);
  write_cells(plot, frame, cells->value, mean);
  tal_plot_element(plot);
  fputs("'cells' using 1:2:3 with filledcurves closed fs solid noborder fc palette", plot->script);
  tal_map_walls(frame, plot);
  tal_map_loop(frame, plot, "lw 1.5 lc rgb '#404040'");
  tal_plot_command_end(plot);
}

static void draw_cells_L_II(const tal_figure_data *data, tal_plot *plot) {
  const cell_map cells = {data->last.L_II,     2,        6,        "deviatoric strain rate of cells",
                          "L_{II} / ⟨L_{II}⟩", "L_{II}", "s^{-1}", 1};
  draw_cells(data, plot, &cells);
}

static void draw_cells_pressure(const tal_figure_data *data, tal_plot *plot) {
  const cell_map cells = {data->last.pressure, 1.75, 5, "pressure of cells", "p / ⟨p⟩", "p", "kPa", 1e-3};
  draw_cells(data, plot, &cells);
}

const tal_figure tal_figure_grains_first = {"grains_first", "grains and contact forces in the first frame",
                                            TAL_NEEDS_FRAME, draw_grains_first};
const tal_figure tal_figure_grains_confined = {"grains_confined", "the same in the last frame before the compression",
                                               TAL_NEEDS_FRAME, draw_grains_confined};
const tal_figure tal_figure_grains_last = {"grains", "grains and contact forces in the last frame", TAL_NEEDS_FRAME,
                                           draw_grains_last};
const tal_figure tal_figure_displacement = {"displacement",
                                            "displacements relative to affine over a window of strain [P fig. 2.6]",
                                            TAL_NEEDS_STRAINED_WINDOW, draw_displacement};
const tal_figure tal_figure_rotation = {"rotation", "rotation of the grains over the same window", TAL_NEEDS_WINDOW,
                                        draw_rotation};
const tal_figure tal_figure_cells_L_II = {"cells_L_II", "deviatoric velocity gradient of the cells [P fig. 3.10]",
                                          TAL_NEEDS_CELLS, draw_cells_L_II};
const tal_figure tal_figure_cells_pressure = {"cells_pressure", "pressure of the cells [P fig. 3.11]", TAL_NEEDS_CELLS,
                                              draw_cells_pressure};
