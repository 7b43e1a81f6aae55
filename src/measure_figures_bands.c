// Figures of bands: see measure_report_bands.h.
#include "measure_report_bands.h"

#include <math.h>
#include <stdlib.h>

static const char *const colours[2] = {"#b2281e", "#0072b2"};
static const char *const names[2] = {"shear strain", "rotation"};

// ---- maps ----

// The axis of a band and its two edges; gnuplot cuts them at the box.
static void draw_band(tal_measure_map *m, const tal_band *band, const char *name, const char *colour) {
  if (!band->found)
    return;
  const double c = cos(band->axis), s = sin(band->axis), reach = hypot(m->map.x1 - m->map.x0, m->map.y1 - m->map.y0);
  FILE *data = tal_plot_data(&m->plot, name);
  for (int side = -1; data && side <= 1; side++) {
    const double x = band->x - side * band->width / 2 * s, y = band->y + side * band->width / 2 * c;
    fprintf(data, "%.9g %.9g\n%.9g %.9g\n\n\n", 1e3 * (x - reach * c), 1e3 * (y - reach * s), 1e3 * (x + reach * c),
            1e3 * (y + reach * s));
  }
  tal_plot_data_end(&m->plot, data);
  for (int side = 0; side < 3; side++) {
    tal_plot_element(&m->plot);
    fprintf(m->plot.script, "'%s' index %d using 1:2 with lines lw 3 dt %d lc rgb '%s'", name, side, side == 1 ? 2 : 1,
            colour);
  }
}

static void heading_of_band(tal_measure_map *m, int line, const char *name, const tal_band *band, double diameter) {
  if (!band->found)
    tal_map_heading(&m->map, &m->plot, line, "%s: no band", name);
  else
    tal_map_heading(&m->map, &m->plot, line, "%s: axis %.1f° ± %.1f°, width %.1f ± %.1f mean diameters", name,
                    band->axis * 180 / TAL_PI, band->axis_error * 180 / TAL_PI, band->width / diameter,
                    band->width_error / diameter);
}

static void draw_shear(tal_measuring *run, const tal_part *part, double from_strain, const tal_motion *motion,
                       const tal_band band[2]) {
  tal_measure_map m;
  double *value = tal_alloc(part->of->cell_count, sizeof *value);
  for (size_t t = 0; t < part->of->cell_count; t++)
    value[t] = motion->cell[t] && motion->mean_shear > 0 ? fmin(6, motion->shear[t] / motion->mean_shear) : (double)NAN;
  if (tal_measure_map_begin(&m, run, "shear strain of cells", 5, true)) {
    tal_map_heading(&m.map, &m.plot, 2, "since axial strain %.3g %%,  mean %.3g %%", 100 * from_strain,
                    100 * motion->mean_shear);
    heading_of_band(&m, 3, "shear", &band[0], part->mean_diameter);
    heading_of_band(&m, 4, "rotation", &band[1], part->mean_diameter);
    fputs("set palette defined (0 '#fbfbfb', 2 '#c9c9c9', 2.0001 '#f0a83c', 4 '#c4461f', 6 '#3b0f2f') maxcolors 256\n"
          "set cbrange [0:6]\nset cblabel 'over the mean'\nset colorbox\nset cbtics 1\nset cbtics add ('≥6' 6)\n",
          m.plot.script);
    tal_measure_map_cells(&m, part->of, value);
    tal_map_walls(&m.data.last, &m.plot);
    draw_band(&m, &band[1], "rotation", colours[1]);
    draw_band(&m, &band[0], "shear", "#1a1a1a");
    tal_measure_map_end(&m, run, "shear");
  }
  free(value);
}

// Ninety percent of the arrows are shorter than 1.5 mean diameters.
static double typical_of(const double *u, const double *v, size_t count) {
  double *size = tal_alloc(count + 1, sizeof *size);
  for (size_t k = 0; k < count; k++)
    size[k] = hypot(u[k], v[k]);
  double low = 0, high = 0;
  for (size_t k = 0; k < count; k++)
    high = fmax(high, size[k]);
  for (int halving = 0; halving < 40; halving++) {
    const double middle = (low + high) / 2;
    size_t below = 0;
    for (size_t k = 0; k < count; k++)
      below += size[k] <= middle;
    if (10 * below < 9 * count)
      low = middle;
    else
      high = middle;
  }
  free(size);
  return high;
}

static void draw_arrows(tal_measuring *run, const tal_part *part, const tal_fluctuations *f, const double *u,
                        const double *v, const char *what, const char *name, const char *legend) {
  tal_measure_map m;
  const double typical = typical_of(u, v, f->count), gain = typical > 0 ? 1.5 * part->mean_diameter / typical : 0;
  const size_t stride = f->count / 6000 + 1;
  if (!(gain > 0) || !tal_measure_map_begin(&m, run, what, 3, false))
    return;
  tal_map_heading(&m.map, &m.plot, 2, "%s", legend);
  FILE *data = tal_plot_data(&m.plot, "arrows");
  for (size_t k = 0; data && k < f->count; k += stride)
    if (hypot(u[k], v[k]) < 5 * typical) // the arrows of grains that fly would cover the rest
      fprintf(data, "%.9g %.9g %.9g %.9g\n", 1e3 * f->x[k], 1e3 * f->y[k], 1e3 * gain * u[k], 1e3 * gain * v[k]);
  tal_plot_data_end(&m.plot, data);
  tal_map_loop(&m.data.last, &m.plot, "lw 2 lc rgb '#909090'");
  tal_plot_element(&m.plot);
  fputs("'arrows' using 1:2:3:4 with vectors head filled size screen 0.008,18 lw 2 lc rgb '#000000'", m.plot.script);
  tal_measure_map_end(&m, run, name);
}

// ---- curves ----

static bool begin_curves(tal_plot *plot, tal_measuring *run, const char *title, const char *x, const char *y) {
  tal_error err;
  const tal_status status = tal_measure_stopped(run) ? TAL_INTERRUPTED : tal_plot_begin(plot, run->out, &err);
  if (status == TAL_INTERRUPTED)
    return false;
  if (status) {
    tal_measure_failed(run, status, &err);
    return false;
  }
  tal_plot_canvas(plot, 1250, 900, 22);
  fprintf(plot->script,
          "set border 3 lw 2 lc rgb '#606060'\nset tics nomirror out textcolor rgb '#000000'\nset key top right Left "
          "reverse samplen 2\nset xlabel '%s'\nset ylabel '%s'\nset lmargin 10\nset rmargin 4\nset tmargin 5\nset "
          "samples 1000\nset title ",
          x, y);
  tal_plot_text(plot->script, run->name, 40);
  fprintf(plot->script, " noenhanced offset 0,1.2\nset label 1 '%s' at graph 0.5, graph 1.03 center font ',18'\n",
          title);
  return true;
}

static void write_profile(tal_plot *plot, const char *name, const tal_field *field, const tal_band *of, double diameter,
                          double *mean) {
  const double angle = of->axis + TAL_PI / 2, middle = of->x * cos(angle) + of->y * sin(angle);
  const tal_profile p = tal_profile_across(field, angle, diameter);
  double sum = 0, weight = 0;
  for (size_t k = 0; k < field->count; k++) {
    sum += field->weight[k] * field->value[k];
    weight += field->weight[k];
  }
  *mean = weight > 0 && sum > 0 ? sum / weight : 1;
  FILE *data = tal_plot_data(plot, name);
  for (size_t b = 0; data && b < p.count; b++)
    if (p.points[b] > 2)
      fprintf(data, "%.9g %.9g %.9g\n", 1e3 * (p.s[b] - middle), p.mean[b] / *mean, p.error[b] / *mean);
  tal_plot_data_end(plot, data);
}

static void draw_profile(tal_measuring *run, const tal_part *part, const tal_field field[2], const tal_band band[2]) {
  tal_plot plot;
  char title[120], name[64];
  snprintf(title, sizeof title, "across the band at %.1f°, axial strain %.3g %%", band[0].axis * 180 / TAL_PI,
           100 * part->of->axial_strain);
  if (!begin_curves(&plot, run, title, "distance from the middle of the band (mm)", "over the mean"))
    return;
  fputs("set yrange [0:*]\nset offsets 0, 0, graph 0.1, 0\n", plot.script);
  double mean[2];
  for (int k = 0; k < 2; k++) {
    const char *const file = k ? "rotation" : "shear";
    write_profile(&plot, file, &field[k], &band[0], part->mean_diameter, &mean[k]);
    tal_plot_element(&plot);
    fprintf(plot.script, "'%s' using 1:2:3 with yerrorlines lw 2 pt 7 ps 0.8 lc rgb '%s' title '%s'", file, colours[k],
            names[k]);
  }
  if (band[0].found) {
    const double sigma = 1e3 * band[0].width / (2 * sqrt(2 * log(2)));
    tal_plot_element(&plot);
    fprintf(
        plot.script,
        "%.9g + %.9g * exp(-x**2 / %.9g) with lines lw 3 dt (12,8) lc rgb '#1a1a1a' title 'fit to the shear strain'",
        band[0].base / mean[0], band[0].height / mean[0], 2 * sigma * sigma);
  }
  tal_plot_command_end(&plot);
  snprintf(name, sizeof name, "profile-%06zu", run->frame);
  tal_measure_plot_end(&plot, run, name);
}

void tal_bands_draw(tal_measuring *run, const tal_part *part, double from_strain, const tal_motion *motion,
                    const tal_field field[2], const tal_band band[2], const tal_fluctuations *f) {
  char legend[120];
  if (part->cell_count)
    draw_shear(run, part, from_strain, motion, band);
  if (field[0].count > 2 && band[0].width > 0)
    draw_profile(run, part, field, band);
  snprintf(legend, sizeof legend, "since axial strain %.3g %%, affine part taken out, rms %.3g mm", 100 * from_strain,
           1e3 * f->displacement);
  draw_arrows(run, part, f, f->ux, f->uy, "displacement fluctuations", "fluctuations", legend);
  snprintf(legend, sizeof legend, "at this instant, affine part taken out, rms %.3g mm/s", 1e3 * f->velocity);
  draw_arrows(run, part, f, f->vx, f->vy, "velocity fluctuations", "velocities", legend);
}

void tal_persistence_draw(tal_measuring *run, const tal_windows windows[2], double step) {
  tal_plot plot;
  char title[120];
  snprintf(title, sizeof title, "windows of %.3g %% axial strain: 1 = the same bands, 0 = others", 100 * step);
  if (!begin_curves(&plot, run, title, step > 0 ? "axial strain between windows (%)" : "windows apart", "correlation"))
    return;
  fputs("set yrange [-0.5:1.1]\nset xrange [0:*]\nset offsets 0, graph 0.05, 0, 0\nset xzeroaxis lw 1 lc rgb "
        "'#909090'\nset key bottom left\n",
        plot.script);
  for (int k = 0; k < 2; k++) {
    const char *const file = k ? "rotation" : "shear";
    FILE *data = tal_plot_data(&plot, file);
    for (size_t lag = 1; data && lag < windows[k].count; lag++) {
      const tal_persistence p = tal_windows_persist(&windows[k], lag);
      if (p.pairs)
        fprintf(data, "%.9g %.9g %.9g\n", (double)lag * (step > 0 ? 100 * step : 1), p.correlation, p.error);
    }
    tal_plot_data_end(&plot, data);
    tal_plot_element(&plot);
    fprintf(plot.script, "'%s' using 1:2:3 with yerrorlines lw 3 pt 7 ps 1.2 lc rgb '%s' title '%s'", file, colours[k],
            names[k]);
  }
  tal_plot_command_end(&plot);
  tal_measure_plot_end(&plot, run, "persistence");
}
