// See measure_map.h.
#include "measure_map.h"

#include "figures_data.h"
#include "files.h"
#include <math.h>
#include <stdlib.h>

void tal_measure_failed(tal_measuring *run, tal_status status, const tal_error *err) {
  if (run->status)
    return;
  run->status = status;
  run->err = *err;
}

bool tal_measure_stopped(tal_measuring *run) {
  const tal_measure_options *options = run->options;
  if (run->status != TAL_INTERRUPTED && options->stop && options->stop(options->user))
    run->status = tal_fail(&run->err, TAL_INTERRUPTED, "%s: stopped", run->dir);
  return run->status == TAL_INTERRUPTED;
}

void tal_measure_plot_end(tal_plot *plot, tal_measuring *run, const char *name) {
  char file[80], path[TAL_PATH_SIZE];
  tal_error err;
  snprintf(file, sizeof file, "%.70s.png", name);
  tal_file_path(path, run->out, file);
  const bool empty = plot->empty;
  const tal_status status = tal_plot_finish(plot, path, &err);
  if (status)
    tal_measure_failed(run, status, &err);
  else if (!empty && run->options->made)
    run->options->made(run->options->user, path);
}

bool tal_measure_map_begin(tal_measure_map *m, tal_measuring *run, const char *what, int lines, bool colour_bar) {
  char state[64];
  tal_error err;
  *m = (tal_measure_map){.data.facts.name = run->name};
  if (tal_measure_stopped(run))
    return false;
  tal_status status = tal_frame_read(&m->data.last, run->choice.frames.entry[run->frame].path, &err);
  if (status || m->data.last.grain_count == 0) {
    tal_frame_clear(&m->data.last);
    if (status)
      tal_measure_failed(run, status, &err);
    return false;
  }
  status = tal_plot_begin(&m->plot, run->out, &err);
  if (status) {
    tal_frame_clear(&m->data.last);
    tal_measure_failed(run, status, &err);
    return false;
  }
  m->map = tal_map_of_frame(&m->data.last);
  tal_map_fit(&m->map, lines, colour_bar);
  tal_map_open(&m->map, &m->data, &m->plot);
  tal_map_state(&m->data, &m->data.last, state);
  tal_map_heading(&m->map, &m->plot, 1, "%s, %s", what, state);
  return true;
}

void tal_measure_map_end(tal_measure_map *m, tal_measuring *run, const char *name) {
  char numbered[70];
  tal_plot_command_end(&m->plot);
  snprintf(numbered, sizeof numbered, "%.50s-%06zu", name, run->frame);
  tal_measure_plot_end(&m->plot, run, numbered);
  tal_frame_clear(&m->data.last);
}

void tal_measure_map_discs(tal_measure_map *m, const tal_snapshot *s) {
  FILE *data = tal_plot_data(&m->plot, "discs");
  for (size_t k = 0; data && k < s->grain_count; k++)
    fprintf(data, "%.9g %.9g %.6g\n", 1e3 * s->x[k], 1e3 * s->y[k], 1e3 * s->r[k]);
  tal_plot_data_end(&m->plot, data);
  tal_plot_element(&m->plot);
  fprintf(m->plot.script, "'discs' using 1:2:3 with circles lc rgb '#ececec' fs solid %s",
          s->grain_count > 20000 ? "noborder" : "border lc rgb '#c4c4c4'");
}

// gnuplot draws one width per element, so forces fall into classes a quarter of the mean wide, the last one open.
void tal_measure_map_contacts(tal_measure_map *m, const tal_snapshot *s, const int32_t *contact, size_t count,
                              double mean, double width, const char *name, const char *colour) {
  enum { CLASSES = 32 };
  FILE *data[CLASSES] = {0};
  char file[48];
  for (size_t k = 0; k < count && mean > 0; k++) {
    const int32_t c = contact[k], i = s->contacts.i[c], j = s->contacts.j[c];
    const size_t class = (size_t)fmin(CLASSES - 1, fmax(0, 4 * s->contacts.fn[c] / mean));
    snprintf(file, sizeof file, "%.30s%zu", name, class);
    if (!data[class])
      data[class] = tal_plot_data(&m->plot, file);
    if (data[class])
      fprintf(data[class], "%.9g %.9g\n%.9g %.9g\n\n", 1e3 * s->x[i], 1e3 * s->y[i], 1e3 * s->x[j], 1e3 * s->y[j]);
  }
  for (size_t class = 0; class < CLASSES; class ++) {
    if (!data[class])
      continue;
    tal_plot_data_end(&m->plot, data[class]);
    tal_plot_element(&m->plot);
    fprintf(m->plot.script, "'%.30s%zu' using 1:2 with lines lw %.3f lc rgb '%s'", name, class,
            width * ((double)class + 0.5) / 4, colour);
  }
}

void tal_measure_map_cells(tal_measure_map *m, const tal_snapshot *s, const double *value) {
  FILE *data = tal_plot_data(&m->plot, "cells");
  for (size_t t = 0; data && t < s->cell_count; t++) {
    if (!isfinite(value[t]))
      continue;
    for (int k = 0; k < 3; k++)
      fprintf(data, "%.9g %.9g %.5g\n", 1e3 * s->x[s->corner[t][k]], 1e3 * s->y[s->corner[t][k]], value[t]);
    fputc('\n', data);
  }
  tal_plot_data_end(&m->plot, data);
  tal_plot_element(&m->plot);
  fputs("'cells' using 1:2:3 with filledcurves closed fs solid noborder fc palette", m->plot.script);
}
