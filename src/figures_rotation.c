#include "figures_rotation.h"

#include "figures_canvas.h"
#include "files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 1400, HEIGHT = 1000, FONT = 24, SHELLS = 40, BINS = 10 };

typedef struct subject {
  const tal_rotations *all;
  const tal_rotation *one;
  tal_frame frame; // of the one
  double reach;
  const char *name;
} subject;

// ---- spins over distance ----

static void distance_axes(tal_plot *plot, double most) {
  tal_plot_canvas(plot, WIDTH, HEIGHT, FONT);
  fprintf(plot->script,
          "set logscale y\nset yrange [1e-4:2]\nset format y '10^{%%L}'\nset xrange [0:%g]\n"
          "set xlabel 'distance from the forced grain (mean diameters)'\nset ylabel '|ω| / ω_0'\n"
          "set border 3 lw 2 lc rgb '#606060'\nset tics nomirror out\nset key top right spacing 1.2\n",
          most);
  fprintf(plot->script, "set arrow 1 from 0, %g to %g, %g nohead dt 2 lw 2 lc rgb '#707070'\n", TAL_INFLUENCE, most,
          TAL_INFLUENCE);
}

static double furthest_shown(const subject *s) {
  return fmin(SHELLS, ceil(1.6 * s->reach));
}

static void put_shells(FILE *data, const tal_rotation *a) {
  for (size_t k = 0; data && k < SHELLS; k++) {
    const double ratio = tal_rotation_shell(a, k);
    if (ratio > 0)
      fprintf(data, "%g %.6g\n", (double)k + 0.5, ratio);
  }
  if (data)
    fputc('\n', data);
}

static void draw_transmission_one(const subject *s, tal_plot *plot) {
  const tal_rotation *a = s->one;
  distance_axes(plot, furthest_shown(s));
  FILE *data = tal_plot_data(plot, "points");
  for (size_t k = 0; data && k < a->points; k++)
    if (a->ratio[k] > 0)
      fprintf(data, "%.6g %.6g\n", a->r[k], a->ratio[k]);
  tal_plot_data_end(plot, data);
  data = tal_plot_data(plot, "shells");
  put_shells(data, a);
  tal_plot_data_end(plot, data);
  tal_plot_element(plot);
  fputs("'points' using 1:2 with points pt 7 ps 0.7 lc rgb '#8fb3d9' title 'one grain'", plot->script);
  tal_plot_element(plot);
  fputs("'shells' using 1:2 with linespoints pt 5 ps 1.2 lw 3 lc rgb '#1b2a5c' title 'mean of a shell'", plot->script);
  if (a->decay.points) {
    tal_plot_element(plot);
    fprintf(plot->script,
            "[0:%g] %.9g*exp(-x/%.9g) with lines lw 4 lc rgb '#d55e00' title '%.2f exp(-r/l), l = %.2f ± %.2f'",
            s->reach, a->decay.amplitude, a->decay.length, a->decay.amplitude, a->decay.length, a->decay.length_error);
  }
  tal_plot_command_end(plot);
}

static void draw_transmission_all(const subject *s, tal_plot *plot) {
  distance_axes(plot, furthest_shown(s));
  FILE *data = tal_plot_data(plot, "each");
  for (size_t g = 0; g < s->all->count; g++)
    put_shells(data, &s->all->item[g]);
  tal_plot_data_end(plot, data);
  data = tal_plot_data(plot, "mean");
  for (size_t k = 0; data && k < SHELLS; k++) {
    double sum = 0;
    size_t count = 0;
    for (size_t g = 0; g < s->all->count; g++) {
      const double ratio = tal_rotation_shell(&s->all->item[g], k);
      if (isfinite(ratio)) {
        sum += ratio;
        count++;
      }
    }
    if (count)
      fprintf(data, "%g %.6g\n", (double)k + 0.5, sum / (double)count);
  }
  tal_plot_data_end(plot, data);
  tal_plot_element(plot);
  fputs("'each' using 1:2 with lines lw 1 lc rgb '#a8b8cc' title 'one forced grain, means of shells'", plot->script);
  tal_plot_element(plot);
  fprintf(plot->script, "'mean' using 1:2 with linespoints pt 7 ps 1.4 lw 4 lc rgb '#d55e00' title 'mean of %zu'",
          s->all->count);
  tal_plot_command_end(plot);
}

// ---- map ----

// Lines from centre to centre in classes of width, half the mean force each.
static void draw_chains(const tal_frame *frame, tal_plot *plot, const tal_map *m, double mean) {
  enum { CLASSES = 12 };
  for (size_t k = 1; k < CLASSES; k++) {
    char name[32];
    size_t used = 0;
    snprintf(name, sizeof name, "chains%zu", k);
    FILE *data = tal_plot_data(plot, name);
    for (size_t c = 0; data && c < frame->contact_count; c++) {
      const double ratio = fmin(2 * frame->fn[c] / mean, CLASSES - 1);
      const size_t i = (size_t)frame->i[c], j = (size_t)frame->j[c];
      if ((size_t)ratio != k || frame->x[i] < m->x0 || frame->x[i] > m->x1 || frame->y[i] < m->y0 ||
          frame->y[i] > m->y1)
        continue;
      used++;
      fprintf(data, "%.9g %.9g\n%.9g %.9g\n\n", 1e3 * frame->x[i], 1e3 * frame->y[i], 1e3 * frame->x[j],
              1e3 * frame->y[j]);
    }
    tal_plot_data_end(plot, data);
    if (!used)
      continue;
    tal_plot_element(plot);
    fprintf(plot->script, "'%s' using 1:2 with lines lw %.2f lc rgb '#0a6e4f'", name, 1.6 * (double)k);
  }
}

static double mean_force(const tal_frame *frame) {
  double sum = 0;
  for (size_t c = 0; c < frame->contact_count; c++)
    sum += frame->fn[c];
  return sum / (double)frame->contact_count;
}

static bool *bearing(const tal_frame *frame, double mean) {
  size_t *count = tal_alloc(frame->grain_count, sizeof *count);
  bool *bears = tal_alloc(frame->grain_count, sizeof *bears);
  for (size_t c = 0; c < frame->contact_count; c++)
    if (frame->fn[c] > 1e-6 * mean) {
      count[frame->i[c]]++;
      count[frame->j[c]]++;
    }
  for (size_t k = 0; k < frame->grain_count; k++)
    bears[k] = count[k] >= 2;
  free(count);
  return bears;
}

// Spins of the grains that bear on a logarithmic scale, the forced grain black, rattlers white [P fig. 4.4a].
static void draw_map(const subject *s, tal_plot *plot) {
  const tal_rotation *a = s->one;
  const tal_frame *frame = &s->frame;
  if (!(fabs(a->omega) > 0) || !frame->contact_count) {
    plot->empty = true;
    return;
  }
  tal_map m = {a->x, a->y, a->x, a->y, .top = 0};
  tal_map_include(&m, a->x, a->y, (s->reach + 0.5) * a->diameter);
  tal_map_fit(&m, 2, true);
  tal_figure_data heading = {.facts = {.name = (char *)(uintptr_t)s->name}};
  tal_map_open(&m, &heading, plot);
  tal_map_heading(&m, plot, 1, "grain %lld turned at %.3g rad/s; lines: f_n above half its mean", (long long)a->grain,
                  a->omega);
  fputs("set palette defined (0 '#fbfbfb', 1 '#f3dcc0', 2 '#eaa45c', 3 '#b3361f', 3.7 '#4a0d2a') maxcolors 256\n"
        "set cbrange [0.001:1]\nset logscale cb\nset format cb '10^{%L}'\nset cblabel '|ω| / ω_0'\nset colorbox\n",
        plot->script);
  const double mean = mean_force(frame);
  bool *bears = bearing(frame, mean);
  FILE *grains = tal_plot_data(plot, "grains"), *rattlers = tal_plot_data(plot, "rattlers");
  for (size_t k = 0; grains && rattlers && k < frame->grain_count; k++) {
    const double x = frame->x[k], y = frame->y[k], r = frame->r[k];
    if (x < m.x0 - r || x > m.x1 + r || y < m.y0 - r || y > m.y1 + r || frame->id[k] == a->grain)
      continue;
    fprintf(bears[k] ? grains : rattlers, "%.9g %.9g %.6g %.6g\n", 1e3 * x, 1e3 * y, 1e3 * r,
            fmax(fabs(frame->omega[k] / a->omega), 1e-3));
  }
  fprintf(rattlers, "1e9 1e9 1 1\n"); // an empty file is an error
  tal_plot_data_end(plot, grains);
  tal_plot_data_end(plot, rattlers);
  free(bears);
  size_t self = 0;
  while (frame->id[self] != a->grain)
    self++;
  tal_plot_element(plot);
  fputs("'grains' using 1:2:3:4 with circles lc palette fs solid border lc rgb '#a0a0a0'", plot->script);
  tal_plot_element(plot);
  fputs("'rattlers' using 1:2:3 with circles lc rgb '#c8c8c8' fs empty border lc rgb '#c8c8c8'", plot->script);
  draw_chains(frame, plot, &m, mean);
  FILE *forced = tal_plot_data(plot, "forced");
  fprintf(forced, "%.9g %.9g %.6g\n", 1e3 * a->x, 1e3 * a->y, 1e3 * frame->r[self]);
  tal_plot_data_end(plot, forced);
  tal_plot_element(plot);
  fputs("'forced' using 1:2:3 with circles lc rgb '#000000' fs solid border lc rgb '#000000'", plot->script);
  tal_plot_command_end(plot);
}

// ---- rose ----

static void draw_rose(const subject *s, tal_plot *plot) {
  const tal_rotation *a = s->one;
  double most = 0;
  for (int k = 0; k < TAL_ROSE; k++)
    most = fmax(most, a->rose[k]);
  if (!(most > 0)) {
    plot->empty = true;
    return;
  }
  tal_plot_canvas(plot, 1100, 1100, FONT);
  fprintf(plot->script,
          "set size ratio -1\nset xrange [%g:%g]\nset yrange [%g:%g]\nunset border\nunset tics\nset key outside bottom "
          "center horizontal\n",
          -1.15 * most, 1.15 * most, -1.15 * most, 1.15 * most);
  const double step = tal_plot_tick_step(most, 3);
  for (int k = 1; k * step <= most * 1.05; k++) {
    fprintf(plot->script, "set object %d circle at 0,0 size %g fs empty border lc rgb '#c0c0c0' back\n", k, k * step);
    fprintf(plot->script, "set label %d '%g' at 0, %g offset 0.3,0.5 tc rgb '#808080' font ',%d'\n", k, k * step,
            k * step, FONT - 6);
  }
  FILE *data = tal_plot_data(plot, "rose");
  for (int k = 0; data && k < TAL_ROSE; k++) {
    const double width = 2 * TAL_PI / TAL_ROSE;
    fputs("0 0\n", data);
    for (int j = 0; j <= 4; j++)
      fprintf(data, "%.6g %.6g\n", a->rose[k] * cos((k + j / 4.0) * width), a->rose[k] * sin((k + j / 4.0) * width));
    fputs("0 0\n\n", data);
  }
  tal_plot_data_end(plot, data);
  data = tal_plot_data(plot, "axes");
  for (int k = 0; data && k < 2; k++) {
    const double length = 1.1 * most * fmax(0, a->value[k]) / fmax(a->value[0], 1e-300);
    fprintf(data, "%.6g %.6g\n%.6g %.6g\n\n", -length * a->axis[k].x, -length * a->axis[k].y, length * a->axis[k].x,
            length * a->axis[k].y);
  }
  tal_plot_data_end(plot, data);
  tal_plot_element(plot);
  fprintf(plot->script,
          "'rose' using 1:2 with filledcurves closed fs solid 0.8 border lc rgb '#1b2a5c' lc rgb '#8fb3d9' title 'W of "
          "%d degrees'",
          360 / TAL_ROSE);
  tal_plot_element(plot);
  fputs("'axes' using 1:2 with lines lw 4 lc rgb '#c4261f' title 'axes of Sym(T), by eigenvalue'", plot->script);
  tal_plot_command_end(plot);
}

// ---- distributions ----

static void put_histogram(tal_plot *plot, const char *name, const subject *s, bool influence, double width) {
  size_t bin[200] = {0};
  for (size_t g = 0; g < s->all->count; g++) {
    const double value = influence ? s->all->item[g].influence : s->all->item[g].decay.length;
    if ((influence || tal_rotation_transmits(&s->all->item[g])) && value >= 0 && value / width < 199)
      bin[(size_t)(value / width)]++;
  }
  FILE *data = tal_plot_data(plot, name);
  for (size_t k = 0; data && k < 200; k++)
    if (bin[k])
      fprintf(data, "%.6g %.6g\n", ((double)k + 0.5) * width, (double)bin[k]);
  tal_plot_data_end(plot, data);
}

static void draw_lengths(const subject *s, tal_plot *plot) {
  tal_plot_canvas(plot, WIDTH, HEIGHT, FONT);
  fputs("set xlabel 'mean diameters'\nset ylabel 'forced grains'\nset yrange [0:*]\nset xrange [0:*]\n"
        "set border 3 lw 2 lc rgb '#606060'\nset tics nomirror out\nset key top right\nset style fill solid 0.6\n",
        plot->script);
  put_histogram(plot, "length", s, false, 0.25);
  put_histogram(plot, "influence", s, true, 1);
  tal_plot_element(plot);
  fprintf(plot->script,
          "'influence' using 1:2:(0.9) with boxes lc rgb '#e8b488' title 'influence radius (5 %%), mean %.2f [%.2f, "
          "%.2f]'",
          s->all->influence.value, s->all->influence.low, s->all->influence.high);
  tal_plot_element(plot);
  fprintf(plot->script,
          "'length' using 1:2:(0.22) with boxes lc rgb '#3b6ea8' title 'decay length, mean %.2f [%.2f, %.2f]'",
          s->all->length.value, s->all->length.low, s->all->length.high);
  tal_plot_command_end(plot);
}

typedef struct pair {
  double x, y;
} pair;

static int by_x(const void *a, const void *b) {
  const double x = ((const pair *)a)->x, y = ((const pair *)b)->x;
  return (x > y) - (x < y);
}

// Means of the transmission over tenths of the sectors in the order of what the chains do.
static void put_tenths(tal_plot *plot, const char *name, const subject *s, bool across) {
  const size_t most = s->all->count * TAL_SECTORS;
  pair *point = tal_alloc(most, sizeof *point);
  size_t count = 0;
  for (size_t g = 0; g < s->all->count; g++) {
    const tal_rotation *a = &s->all->item[g];
    const double *value = across ? a->across : a->along;
    double mean = 0;
    for (int k = 0; k < TAL_SECTORS; k++)
      mean += value[k] / TAL_SECTORS;
    for (int k = 0; k < TAL_SECTORS; k++)
      if (isfinite(a->transmission[k]) && mean > 0 && tal_rotation_transmits(a))
        point[count++] = (pair){value[k] / mean, a->transmission[k]};
  }
  qsort(point, count, sizeof *point, by_x);
  FILE *data = tal_plot_data(plot, name);
  for (size_t b = 0; data && b < BINS; b++) {
    const size_t from = b * count / BINS, to = (b + 1) * count / BINS, n = to - from;
    double x = 0, y = 0, squares = 0;
    for (size_t k = from; k < to; k++) {
      x += point[k].x / (double)n;
      y += point[k].y / (double)n;
      squares += point[k].y * point[k].y / (double)n;
    }
    if (n > 1)
      fprintf(data, "%.6g %.6g %.6g\n", x, y, sqrt(fmax(0, squares - y * y) / (double)(n - 1)));
  }
  tal_plot_data_end(plot, data);
  free(point);
}

static void draw_sectors(const subject *s, tal_plot *plot) {
  tal_plot_canvas(plot, WIDTH, HEIGHT, FONT);
  fprintf(
      plot->script,
      "set xlabel 'strength of the sector over the mean of the grain'\nset ylabel 'transmission of the sector (mean "
      "1)'\nset border 3 lw 2 lc rgb '#606060'\nset tics nomirror out\nset key outside top center vertical\n"
      "set xrange [0:*]\n"
      "set arrow 1 from graph 0, first 1 to graph 1, first 1 nohead dt 2 lw 2 lc rgb '#909090'\n");
  put_tenths(plot, "along", s, false);
  put_tenths(plot, "across", s, true);
  const tal_sector_statistics *t = &s->all->sectors;
  tal_plot_element(plot);
  fprintf(plot->script,
          "'along' using 1:2:3 with yerrorlines pt 7 ps 1.6 lw 3 lc rgb '#3b6ea8' title 'chains along (W): correlation "
          "%.2f [%.2f, %.2f]'",
          t->along.value, t->along.low, t->along.high);
  tal_plot_element(plot);
  fprintf(plot->script,
          "'across' using 1:2:3 with yerrorlines pt 5 ps 1.6 lw 3 lc rgb '#d55e00' title 'strong chains across: "
          "correlation %.2f [%.2f, %.2f]'",
          t->across.value, t->across.low, t->across.high);
  tal_plot_command_end(plot);
}

// ---- all ----

typedef struct drawing {
  const char *name;
  void (*draw)(const subject *s, tal_plot *plot);
} drawing;

static tal_status draw(const drawing *what, const subject *s, const char *folder, tal_error *err) {
  tal_plot plot;
  char png[TAL_PATH_SIZE];
  tal_file_path(png, folder, what->name);
  tal_status status = tal_plot_begin(&plot, folder, err);
  if (status)
    return status;
  what->draw(s, &plot);
  return tal_plot_finish(&plot, png, err);
}

tal_status tal_rotation_figures(const tal_rotations *all, const char *dir, const tal_rotation_options *options,
                                tal_error *err) {
  static const drawing of_one[] = {
      {"map.png", draw_map}, {"rose.png", draw_rose}, {"transmission.png", draw_transmission_one}};
  static const drawing of_all[] = {
      {"transmission.png", draw_transmission_all}, {"lengths.png", draw_lengths}, {"sectors.png", draw_sectors}};
  const drawing *list = all->count == 1 ? of_one : of_all;
  char folder[TAL_PATH_SIZE];
  tal_run_facts facts;
  subject s = {.all = all, .one = &all->item[0], .reach = options->reach};
  tal_status status = TAL_OK;
  tal_file_path(folder, dir, "rotation");
  tal_run_facts_read(&facts, s.one->run);
  s.name = facts.name;
  if (all->count == 1) {
    tal_rotation again;
    status = tal_rotation_read(&again, s.one->run, options, &s.frame, err);
    tal_rotation_clear(&again);
  }
  const size_t count = all->count == 1 && !s.one->decay.points ? 2 : 3; // without spins: no curve
  for (size_t k = 0; k < count && status == TAL_OK; k++)
    status = draw(&list[k], &s, folder, err);
  tal_frame_clear(&s.frame);
  tal_run_facts_clear(&facts);
  return status;
}
