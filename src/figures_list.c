// Reads once what the figures share: series, first and last frame, and the window of two frames for displacements.
#include "figures_list.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// Keeps the first failure and its sentence.
static void keep_first(tal_status *status, tal_error *err, tal_status new_status, const tal_error *new_err) {
  if (*status || !new_status)
    return;
  *status = new_status;
  if (err)
    *err = *new_err;
}

// The row before the first one that is strained, or that row itself when it is the first.
static size_t find_strain_begin(const tal_table *series) {
  const double *strain = tal_table_column(series, "axial_strain");
  for (size_t row = 0; strain && row < series->rows; row++)
    if (fabs(strain[row]) > 0)
      return row ? row - 1 : 0; // nan is no strain
  return series->rows;
}

// The rows of the first confine stage; where run.json does not tell, all rows before the compression.
static void find_confine(tal_figure_data *data) {
  const double *stage = tal_table_column(&data->series, "stage");
  data->confine_end = data->strain_begin < data->series.rows ? data->strain_begin + 1 : 0;
  if (data->facts.confine_stage < 0 || !stage)
    return;
  size_t row = 0;
  while (row < data->series.rows && stage[row] < (double)data->facts.confine_stage)
    row++;
  data->confine_begin = row;
  while (row < data->series.rows && stage[row] <= (double)data->facts.confine_stage)
    row++;
  data->confine_end = row;
}

// The frame that begins the window: the latest one at least 2 % of axial strain before the last; when the run was not
// strained that far, the latest of the least strained; when it was not strained at all, the first.
static size_t window_begin(const tal_frame_list *frames) {
  const double span = 0.0199; // frames do not fall on round strains exactly
  double end = frames->entry[frames->count - 1].axial_strain;
  size_t best = 0;
  for (size_t k = 0; k + 1 < frames->count; k++)
    if (end - frames->entry[k].axial_strain >= span)
      best = k;
  if (end - frames->entry[best].axial_strain >= span)
    return best;
  for (size_t k = 0; k + 1 < frames->count; k++)
    if (frames->entry[k].axial_strain <= frames->entry[best].axial_strain)
      best = k;
  return frames->entry[best].axial_strain < end ? best : 0;
}

// The latest unstrained frame when a strained one follows; 0 when there is none.
static size_t confined_frame(const tal_frame_list *frames) {
  for (size_t k = 0; k + 1 < frames->count; k++)
    if (!(frames->entry[k].axial_strain > 0) && frames->entry[k + 1].axial_strain > 0)
      return k;
  return 0;
}

// Pairs the grains of two frames by id; both lists ascend.
static void pair_grains(tal_window *window, const tal_frame *a, const tal_frame *b) {
  size_t most = a->grain_count < b->grain_count ? a->grain_count : b->grain_count;
  double **const arrays[] = {&window->x, &window->y, &window->r, &window->dx, &window->dy, &window->dtheta};
  for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
    *arrays[k] = tal_alloc(most, sizeof(double));
  for (size_t p = 0, q = 0; p < a->grain_count && q < b->grain_count;) {
    if (a->id[p] < b->id[q])
      p++;
    else if (a->id[p] > b->id[q])
      q++;
    else {
      size_t n = window->count++;
      window->x[n] = a->x[p];
      window->y[n] = a->y[p];
      window->r[n] = a->r[p];
      window->dx[n] = b->x[q] - a->x[p];
      window->dy[n] = b->y[q] - a->y[p];
      window->dtheta[n] = b->theta[q] - a->theta[p];
      p++, q++;
    }
  }
}

static tal_status read_frames(tal_figure_data *data, const char *dir, tal_error *err) {
  tal_error text;
  tal_status status = TAL_OK;
  keep_first(&status, err, tal_frame_list_read(&data->frames, dir, &text), &text);
  size_t count = data->frames.count;
  if (count == 0)
    return status;
  keep_first(&status, err, tal_frame_read(&data->last, data->frames.entry[count - 1].path, &text), &text);
  if (count == 1)
    return status;
  keep_first(&status, err, tal_frame_read(&data->first, data->frames.entry[0].path, &text), &text);
  size_t confined = confined_frame(&data->frames);
  if (confined > 0)
    keep_first(&status, err, tal_frame_read(&data->confined, data->frames.entry[confined].path, &text), &text);
  const char *begin = data->frames.entry[window_begin(&data->frames)].path;
  keep_first(&status, err, tal_frame_read(&data->earlier, begin, &text), &text);
  pair_grains(&data->window, &data->earlier, &data->last);
  return status;
}

static unsigned find_offers(const tal_figure_data *data) {
  unsigned offers = 0;
  if (data->series.rows >= 2)
    offers |= TAL_NEEDS_SERIES;
  if (data->strain_begin + 2 <= data->series.rows)
    offers |= TAL_NEEDS_STRAIN;
  if (data->confine_begin + 2 <= data->confine_end)
    offers |= TAL_NEEDS_CONFINE;
  if (data->last.grain_count)
    offers |= TAL_NEEDS_FRAME;
  if (data->last.cell_count)
    offers |= TAL_NEEDS_CELLS;
  if (data->window.count == 0 || !(data->last.time > data->earlier.time))
    return offers;
  offers |= TAL_NEEDS_WINDOW;
  if (data->last.axial_strain > data->earlier.axial_strain)
    offers |= TAL_NEEDS_STRAINED_WINDOW;
  return offers;
}

tal_status tal_figure_data_read(tal_figure_data *data, const char *dir, tal_error *err) {
  *data = (tal_figure_data){0};
  tal_error text;
  tal_status status = TAL_OK;
  char *path = tal_path_join(dir, "series.csv");
  bool has_series = access(path, F_OK) == 0;
  if (has_series)
    keep_first(&status, err, tal_table_read(&data->series, path, &text), &text);
  free(path);
  tal_status frames_status = read_frames(data, dir, &text);
  keep_first(&status, err, frames_status, &text);
  if (!has_series && !frames_status && data->frames.count == 0)
    return tal_fail(err, TAL_BAD_INPUT, "%s: holds no run (neither series.csv nor field frames)", dir);
  tal_run_facts_read(&data->facts, dir);
  data->strain_begin = find_strain_begin(&data->series);
  find_confine(data);
  data->offers = find_offers(data);
  return status;
}

static void window_clear(tal_window *window) {
  free(window->x);
  free(window->y);
  free(window->r);
  free(window->dx);
  free(window->dy);
  free(window->dtheta);
}

void tal_figure_data_clear(tal_figure_data *data) {
  tal_run_facts_clear(&data->facts);
  tal_table_clear(&data->series);
  tal_frame_list_clear(&data->frames);
  tal_frame_clear(&data->first);
  tal_frame_clear(&data->confined);
  tal_frame_clear(&data->last);
  tal_frame_clear(&data->earlier);
  window_clear(&data->window);
  *data = (tal_figure_data){0};
}
