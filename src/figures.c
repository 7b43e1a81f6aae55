// The list of figures and the loop that draws them. A figure is added with one descriptor (figures_list.h) and one line
// here.
#include "figures.h"

#include "figures_list.h"
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const tal_figure *const figures[] = {
    &tal_figure_confinement,       //
    &tal_figure_stress_ratio,      //
    &tal_figure_volumetric_strain, //
    &tal_figure_mean_slip,         //
    &tal_figure_energy,            //
    &tal_figure_fabric,            //
    &tal_figure_grains_first,      //
    &tal_figure_grains_confined,   //
    &tal_figure_grains_last,       //
    &tal_figure_displacement,      //
    &tal_figure_rotation,          //
    &tal_figure_cells_L_II,        //
    &tal_figure_cells_pressure,    //
};

static tal_status draw_one(const tal_figure *figure, const tal_figure_data *data, const char *folder, char **png,
                           tal_error *err) {
  tal_plot plot;
  tal_status status = tal_plot_begin(&plot, folder, err);
  if (status)
    return status;
  figure->draw(data, &plot);
  bool empty = plot.empty;
  char *stem = tal_path_join(folder, figure->name);
  size_t length = strlen(stem);
  char *path = tal_grow(stem, length + 1, length + 5, 1);
  memcpy(path + length, ".png", 5);
  status = tal_plot_finish(&plot, path, err);
  if (status || empty) {
    free(path);
    return status;
  }
  *png = path;
  return TAL_OK;
}

typedef struct drawing {
  const char *folder;
  tal_figure_made *made;
  void *user;
  int count;
} drawing;

// Draws what the data allow; goes on after a failure, stops when the user asks for it.
static tal_status draw_all(const tal_figure_data *data, drawing *out, tal_error *err) {
  tal_status first = TAL_OK;
  for (size_t k = 0; k < sizeof figures / sizeof *figures; k++) {
    if ((figures[k]->needs & data->offers) != figures[k]->needs)
      continue;
    tal_error text;
    char *png = NULL;
    tal_status status = draw_one(figures[k], data, out->folder, &png, &text);
    if (status && !first) {
      first = status;
      if (err)
        *err = text;
    }
    if (status == TAL_INTERRUPTED) {
      if (err)
        *err = text;
      return status;
    }
    if (png) {
      out->count++;
      if (out->made)
        out->made(out->user, png);
    }
    free(png);
  }
  return first;
}

tal_status tal_figures_draw_each(const char *dir, tal_figure_made *made, void *user, int *count, tal_error *err) {
  *count = 0;
  tal_figure_data data;
  tal_status status = tal_figure_data_read(&data, dir, err);
  if (data.offers) {
    char *folder = tal_path_join(dir, "figures");
    drawing out = {.folder = folder, .made = made, .user = user};
    tal_error text;
    tal_status drawn = TAL_OK;
    if (mkdir(folder, 0777) && errno != EEXIST)
      drawn = tal_fail(&text, TAL_IO, "%s: %s", folder, strerror(errno));
    else
      drawn = draw_all(&data, &out, &text);
    if (drawn && (!status || drawn == TAL_INTERRUPTED)) {
      status = drawn;
      if (err)
        *err = text;
    }
    *count = out.count;
    free(folder);
  }
  tal_figure_data_clear(&data);
  return status;
}

tal_status tal_figures_draw(const char *dir, int *count, tal_error *err) {
  return tal_figures_draw_each(dir, NULL, NULL, count, err);
}
