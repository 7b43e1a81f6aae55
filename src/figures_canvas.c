// Canvas, heading, walls and loop of a map. The canvas follows the shape of the assembly, so that axes are equal.
#include "figures_canvas.h"

#include <math.h>
#include <stdarg.h>

enum { BOX_WIDTH = 1250, BOX_HEIGHT = 1500, LEAST_BOX = 420, LEAST_CANVAS = 1000, FONT = 24, NAME_LIMIT = 40 };

void tal_map_include(tal_map *m, double x, double y, double r) {
  if (!isfinite(x) || !isfinite(y) || !isfinite(r))
    return;
  m->x0 = fmin(m->x0, x - r);
  m->x1 = fmax(m->x1, x + r);
  m->y0 = fmin(m->y0, y - r);
  m->y1 = fmax(m->y1, y + r);
}

tal_map tal_map_of_frame(const tal_frame *frame) {
  tal_map m = {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL, .top = 0};
  for (size_t k = 0; k < frame->grain_count; k++)
    tal_map_include(&m, frame->x[k], frame->y[k], frame->r[k]);
  for (size_t k = 0; k < frame->bead_count; k++)
    tal_map_include(&m, frame->bx[k], frame->by[k], frame->br[k]);
  if (!(m.x1 > m.x0))
    m.x0 = m.y0 = 0, m.x1 = m.y1 = 1e-3;
  return m;
}

static void widen(double *low, double *high, double least) {
  double lack = least - (*high - *low);
  if (lack <= 0)
    return;
  *low -= lack / 2;
  *high += lack / 2;
}

void tal_map_fit(tal_map *m, int lines, bool colour_bar) {
  double pad = 0.02 * fmax(m->x1 - m->x0, m->y1 - m->y0);
  m->x0 -= pad, m->x1 += pad, m->y0 -= pad, m->y1 += pad;
  m->scale = fmin(BOX_WIDTH / (m->x1 - m->x0), BOX_HEIGHT / (m->y1 - m->y0));
  widen(&m->x0, &m->x1, LEAST_BOX / m->scale);
  widen(&m->y0, &m->y1, LEAST_BOX / m->scale);
  m->box_width = (int)lround((m->x1 - m->x0) * m->scale);
  m->box_height = (int)lround((m->y1 - m->y0) * m->scale);
  int right = colour_bar ? 270 : 60, inner = 190 + m->box_width + right;
  m->width = inner > LEAST_CANVAS ? inner : LEAST_CANVAS;
  m->left = 190 + (m->width - inner) / 2;
  m->top = 40 + 44 * lines;
  m->height = m->top + m->box_height + 135;
}

double tal_map_line_height(const tal_map *m, int line) {
  return 1 - (40.0 + 44 * line) / m->height;
}

static void heading_position(const tal_map *m, tal_plot *plot, int line) {
  fprintf(plot->script, " at screen %.5f, screen %.5f center front ", (m->left + 0.5 * m->box_width) / m->width,
          tal_map_line_height(m, line));
}

void tal_map_open(const tal_map *m, const tal_figure_data *data, tal_plot *plot) {
  FILE *out = plot->script;
  tal_plot_canvas(plot, m->width, m->height, FONT);
  fprintf(out, "set lmargin at screen %.6f\nset rmargin at screen %.6f\n", (double)m->left / m->width,
          (double)(m->left + m->box_width) / m->width);
  fprintf(out, "set tmargin at screen %.6f\nset bmargin at screen %.6f\n", 1 - (double)m->top / m->height,
          1 - (double)(m->top + m->box_height) / m->height);
  fprintf(out, "set xrange [%.9g:%.9g]\nset yrange [%.9g:%.9g]\n", 1e3 * m->x0, 1e3 * m->x1, 1e3 * m->y0, 1e3 * m->y1);
  double step =
      1e3 * tal_plot_tick_step(1 / m->scale, 1.0 / 170); // about 170 px from tick to tick, the same on both axes
  fprintf(out, "set xtics %.9g\nset ytics %.9g\n", step, step);
  fputs("set format '%h'\nunset key\nset clip two\nset border 15 lw 2 lc rgb '#606060'\nset tics nomirror out "
        "textcolor rgb '#000000'\n"
        "set xlabel 'x (mm)'\nset ylabel 'y (mm)'\nset label 1 ",
        out);
  tal_plot_text(out, data->facts.name, NAME_LIMIT);
  heading_position(m, plot, 0);
  fputs("noenhanced\n", out);
}

void tal_map_heading(const tal_map *m, tal_plot *plot, int line, const char *format, ...) {
  va_list args;
  va_start(args, format);
  fprintf(plot->script, "set label %d '", line + 1);
  vfprintf(plot->script, format, args);
  va_end(args);
  fputc('\'', plot->script);
  heading_position(m, plot, line);
  fprintf(plot->script, "font ',%d'\n", FONT - 4);
}

static void write_points(tal_plot *plot, const char *name, const double (*line)[4], size_t count) {
  FILE *data = tal_plot_data(plot, name);
  for (size_t k = 0; data && k < count; k++)
    fprintf(data, "%.9g %.9g\n%.9g %.9g\n\n", 1e3 * line[k][0], 1e3 * line[k][1], 1e3 * line[k][2], 1e3 * line[k][3]);
  tal_plot_data_end(plot, data);
}

void tal_map_loop(const tal_frame *frame, tal_plot *plot, const char *style) {
  if (frame->loop_count < 3)
    return;
  FILE *data = tal_plot_data(plot, "loop");
  for (size_t k = 0; data && k <= frame->loop_count; k++) {
    size_t node = (size_t)frame->loop[k % frame->loop_count];
    fprintf(data, "%.9g %.9g\n", 1e3 * frame->x[node], 1e3 * frame->y[node]);
  }
  tal_plot_data_end(plot, data);
  tal_plot_element(plot);
  fprintf(plot->script, "'loop' using 1:2 with lines %s", style);
}

void tal_map_walls(const tal_frame *frame, tal_plot *plot) {
  if (frame->wall_count == 0)
    return;
  write_points(plot, "walls", (const double(*)[4])frame->wall, frame->wall_count);
  tal_plot_element(plot);
  fputs("'walls' using 1:2 with lines lw 7 lc rgb '#7a7a7a'", plot->script);
}

void tal_map_state(const tal_figure_data *data, const tal_frame *frame, char text[64]) {
  bool strained = data->last.axial_strain > 0 && frame->axial_strain >= 0;
  if (strained && frame->axial_strain > 0)
    snprintf(text, 64, "axial strain %.3g %%", 100 * frame->axial_strain);
  else if (strained)
    snprintf(text, 64, "t = %.4g s, before compression", frame->time);
  else
    snprintf(text, 64, "t = %.4g s", frame->time);
}

void tal_map_window(const tal_figure_data *data, char text[64]) {
  double from = data->earlier.axial_strain, to = data->last.axial_strain;
  if (to > from)
    snprintf(text, 64, "axial strain %.3g %% → %.3g %%", 100 * from, 100 * to);
  else
    snprintf(text, 64, "t = %.4g s → %.4g s", data->earlier.time, data->last.time);
}
