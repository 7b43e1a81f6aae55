// Figures of series.csv: curves against axial strain, or against time where nothing was compressed. Lines differ in
// colour, lightness and dash, so that they stay apart in grey print.
#include "figures_list.h"

#include <math.h>
#include <string.h>

enum { CURVE_WIDTH = 1300, CURVE_HEIGHT = 950, CURVE_FONT = 26, NAME_LIMIT = 52, SLOTS = 9 };

// Okabe and Ito's colours from dark to light, each with a dash of its own.
static const char *const line_style[SLOTS] = {
    "lc rgb '#000000' dt 1",          "lc rgb '#0072b2' dt (14,6)",     "lc rgb '#d55e00' dt (4,5)",
    "lc rgb '#009e73' dt (14,5,3,5)", "lc rgb '#cc79a7' dt 1",          "lc rgb '#56b4e9' dt (20,8)",
    "lc rgb '#e69f00' dt (7,4)",      "lc rgb '#7f7f7f' dt (20,5,3,5)", "lc rgb '#4b0092' dt (3,8)",
};

// Columns over a range of rows against one of them.
typedef struct curves {
  const tal_table *series;
  size_t begin, end;                // rows
  const double *x;                  // [rows]
  double x_scale;                   // from the file's unit to the axis
  const double *y[SLOTS];           // [rows]
  double scale[SLOTS], base[SLOTS]; // drawn: (y - base) * scale
  const char *label[SLOTS];         // enhanced text of ours
  size_t count;
} curves;

// Largest magnitude of a column; 0 where it is not there.
static double column_reach(const tal_table *series, const char *name) {
  const double *column = tal_table_column(series, name);
  double most = 0;
  for (size_t row = 0; column && row < series->rows; row++)
    most = isfinite(column[row]) ? fmax(most, fabs(column[row])) : most;
  return most;
}

// The row before the first shear.
static size_t shear_begin(const tal_table *series, const double *shear) {
  size_t row = 0;
  while (row + 1 < series->rows && shear[row + 1] == 0)
    row++;
  return row;
}

// The compression against axial strain in %, shearing against shear strain, else everything against time. Returns the
// label of the axis.
static const char *curves_over_strain(curves *set, const tal_figure_data *data) {
  bool strained = data->offers & TAL_NEEDS_STRAIN;
  *set = (curves){.series = &data->series, .end = data->series.rows};
  if (column_reach(&data->series, "shear_strain") > column_reach(&data->series, "axial_strain")) {
    set->x = tal_table_column(&data->series, "shear_strain");
    set->x_scale = 100;
    set->begin = shear_begin(&data->series, set->x);
    return "shear strain (%)";
  }
  set->begin = strained ? data->strain_begin : 0;
  set->x = tal_table_column(&data->series, strained ? "axial_strain" : "time");
  set->x_scale = strained ? 100 : 1;
  return strained ? "axial strain (%)" : "time (s)";
}

// At least two finite points to join.
static bool is_drawable(const curves *set, const double *y) {
  size_t good = 0;
  for (size_t row = set->begin; row < set->end; row++)
    good += isfinite(set->x[row]) && isfinite(y[row]);
  return good >= 2;
}

static void curves_add(curves *set, const char *column, const char *label, double scale) {
  const double *y = tal_table_column(set->series, column);
  if (!y || !set->x || set->count == SLOTS || !is_drawable(set, y))
    return;
  set->y[set->count] = y;
  set->scale[set->count] = scale;
  set->base[set->count] = 0;
  set->label[set->count++] = label;
}

// Largest magnitude of what will be drawn.
static double curves_reach(const curves *set) {
  double most = 0;
  for (size_t k = 0; k < set->count; k++)
    for (size_t row = set->begin; row < set->end; row++)
      most = fmax(most, fabs((set->y[k][row] - set->base[k]) * set->scale[k]));
  return most;
}

// The SI prefix that brings `reach` to at least 1; *scale multiplies the numbers.
static const char *prefix(double reach, double *scale) {
  static const struct {
    const char *text;
    double factor;
  } list[] = {{"G", 1e9}, {"M", 1e6}, {"k", 1e3}, {"", 1}, {"m", 1e-3}, {"µ", 1e-6}, {"n", 1e-9}};
  size_t k = 3;
  if (reach > 0 && isfinite(reach))
    for (k = 0; k < 6 && reach < list[k].factor; k++)
      continue;
  *scale = 1 / list[k].factor;
  return list[k].text;
}

static void write_number(FILE *data, double value, const char *before) {
  if (isfinite(value))
    fprintf(data, "%s%.9g", before, value);
  else
    fprintf(data, "%snan", before);
}

static void curves_write(const curves *set, tal_plot *plot, const char *name) {
  FILE *data = tal_plot_data(plot, name);
  for (size_t row = set->begin; data && row < set->end; row++) {
    write_number(data, set->x[row] * set->x_scale, "");
    for (size_t k = 0; k < set->count; k++)
      write_number(data, (set->y[k][row] - set->base[k]) * set->scale[k], " ");
    fputc('\n', data);
  }
  tal_plot_data_end(plot, data);
}

static void curves_draw(const curves *set, tal_plot *plot, const char *name) {
  double width = set->end - set->begin > 300 ? 3 : 4; // thick lines hide the noise of dense ones
  for (size_t k = 0; k < set->count; k++) {
    tal_plot_element(plot);
    fprintf(plot->script, "'%s' using 1:%zu with lines lw %g %s ", name, k + 2, width, line_style[k]);
    if (set->count > 1)
      fprintf(plot->script, "title '%s'", set->label[k]);
    else
      fputs("notitle", plot->script);
  }
  tal_plot_command_end(plot);
}

// Canvas, axes and the scene's name at the top. The frame leaves room below the name for a key of one line.
static void open_canvas(tal_plot *plot, const tal_figure_data *data, int width, int height) {
  tal_plot_canvas(plot, width, height, CURVE_FONT);
  fputs("set format '%h'\nset border 3 lw 2\nset tics nomirror out\nset grid lw 1.5 lc rgb '#dddddd' dt 1\nset key "
        "noautotitle\n"
        "set label 1 ",
        plot->script);
  tal_plot_text(plot->script, data->facts.name, NAME_LIMIT);
  fprintf(plot->script, " at screen 0.5, screen %.4f center noenhanced\n", 1 - 35.0 / height);
  fprintf(plot->script, "set lmargin at screen %.4f\nset rmargin at screen %.4f\n", 200.0 / width, 1 - 50.0 / width);
  fprintf(plot->script, "set tmargin at screen %.4f\nset bmargin at screen %.4f\n", 1 - 80.0 / height, 135.0 / height);
}

// A key of one line between the name and the frame.
static void key_above(tal_plot *plot, int height) {
  fprintf(plot->script, "set tmargin at screen %.4f\n", 1 - 135.0 / height);
  fprintf(plot->script, "set key at screen 0.5, screen %.4f center center horizontal Left reverse samplen 3\n",
          1 - 92.0 / height);
}

// One curve in one frame; `range` is a gnuplot range for y, "" for its own choice.
static void draw_single(const tal_figure_data *data, tal_plot *plot, const char *column, double scale,
                        const char *y_label, const char *range) {
  curves set;
  const char *x_label = curves_over_strain(&set, data);
  curves_add(&set, column, "", scale);
  if (set.count == 0) {
    plot->empty = true;
    return;
  }
  open_canvas(plot, data, CURVE_WIDTH, CURVE_HEIGHT);
  fprintf(plot->script, "set xlabel '%s'\nset ylabel '%s'\n%s\n", x_label, y_label, range);
  curves_write(&set, plot, "curve");
  curves_draw(&set, plot, "curve");
}

static void draw_stress_ratio(const tal_figure_data *data, tal_plot *plot) {
  draw_single(data, plot, "stress_ratio", 1, "stress ratio σ_{yy} / σ_{xx}", "");
}

static void draw_volumetric_strain(const tal_figure_data *data, tal_plot *plot) {
  draw_single(data, plot, "volumetric_strain", 100, "volumetric strain (%), dilation +",
              "set xzeroaxis lw 2 lc rgb '#808080' dt 1");
}

static void draw_mean_slip(const tal_figure_data *data, tal_plot *plot) {
  draw_single(data, plot, "mean_slip", 1, "mean slip speed / v_R", "set yrange [0:*]");
}

static void draw_confinement(const tal_figure_data *data, tal_plot *plot) {
  curves set = {.series = &data->series, .begin = data->confine_begin, .end = data->confine_end, .x_scale = 1};
  set.x = tal_table_column(&data->series, "time");
  curves_add(&set, "sigma_xx", "σ_{xx}", 1);
  curves_add(&set, "sigma_yy", "σ_{yy}", 1);
  if (set.count == 0) {
    plot->empty = true;
    return;
  }
  double scale, target = data->facts.pressure;
  const char *letter = prefix(isfinite(target) && target > 0 ? target : curves_reach(&set), &scale);
  for (size_t k = 0; k < set.count; k++)
    set.scale[k] = scale;
  open_canvas(plot, data, CURVE_WIDTH, CURVE_HEIGHT);
  key_above(plot, CURVE_HEIGHT);
  fprintf(plot->script, "set xlabel 'time (s)'\nset ylabel 'stress (%sPa), compression +'\nset yrange [*<0:*]\n",
          letter);
  if (isfinite(target)) {
    tal_plot_element(plot);
    fprintf(plot->script, "%.9g with lines lw 8 lc rgb '#b0b0b0' title 'target'", target * scale);
  }
  curves_write(&set, plot, "curve");
  curves_draw(&set, plot, "curve");
}

// The terms of the ledger that are not zero throughout; over a compression their change since it began.
static void energy_terms(curves *set, double reference) {
  static const char *const term[][2] = {
      {"work_walls", "work of plates, walls"},
      {"work_pressure", "work of pressure"},
      {"work_held", "work of held grains"},
      {"dissipated_friction", "lost to friction"},
      {"dissipated_damping", "lost to damping"},
      {"elastic", "elastic"},
      {"kinetic", "kinetic"},
      {"gravity", "gravity"},
  };
  for (size_t k = 0; k < sizeof term / sizeof *term; k++) {
    size_t old = set->count;
    curves_add(set, term[k][0], term[k][1], 1);
    if (set->count == old)
      continue;
    if (reference > 0)
      set->base[old] = set->y[old][set->begin];
    curves one = *set;
    one.count = 1;
    one.y[0] = set->y[old];
    one.base[0] = set->base[old];
    if (!(curves_reach(&one) > 0))
      set->count = old;
  }
}

// Lower panel: the residual in a power of ten that is said on the axis, with few ticks for the small height.
static void draw_residual(curves *residual, tal_plot *plot, const char *x_label) {
  double reach = curves_reach(residual);
  int power = reach > 0 && isfinite(reach) ? 3 * (int)floor(log10(reach) / 3) : 0;
  residual->scale[0] = pow(10, -power);
  fprintf(plot->script, "unset label 1\nset xlabel '%s'\nset ylabel \"residual / work", x_label);
  if (power)
    fprintf(plot->script, "\\n(10^{%d})", power);
  fputs("\"\nset format x '%h'\nset tmargin at screen 0.33\nset bmargin at screen 0.11\n", plot->script);
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (size_t row = residual->begin; row < residual->end; row++) {
    low = fmin(low, residual->y[0][row] * residual->scale[0]);
    high = fmax(high, residual->y[0][row] * residual->scale[0]);
  }
  if (high > low)
    fprintf(plot->script, "set ytics %.3g\n", tal_plot_tick_step(high - low, 3));
  curves_write(residual, plot, "residual");
  curves_draw(residual, plot, "residual");
}

static void draw_energy(const tal_figure_data *data, tal_plot *plot) {
  curves set, residual;
  bool strained = data->offers & TAL_NEEDS_STRAIN;
  const char *x_label = curves_over_strain(&set, data);
  curves_over_strain(&residual, data);
  curves_add(&residual, "energy_residual", "", 1);
  energy_terms(&set, strained);
  if (set.count == 0) {
    plot->empty = true;
    return;
  }
  double scale;
  const char *letter = prefix(curves_reach(&set), &scale);
  for (size_t k = 0; k < set.count; k++)
    set.scale[k] = scale;
  open_canvas(plot, data, CURVE_WIDTH + 350, CURVE_HEIGHT + 300);
  fputs("set multiplot\nset lmargin at screen 0.14\nset rmargin at screen 0.69\nset key at screen 0.71, screen 0.93 "
        "left top vertical Left reverse "
        "samplen 2.4 spacing 1.25\nset xzeroaxis lw 2 lc rgb '#808080' dt 1\n",
        plot->script);
  fprintf(plot->script, "set ylabel '%s (%sJ)'\n", strained ? "energy since compression began" : "energy", letter);
  if (residual.count)
    fputs("set format x ''\nset bmargin at screen 0.39\n", plot->script);
  else
    fprintf(plot->script, "set xlabel '%s'\n", x_label);
  curves_write(&set, plot, "ledger");
  curves_draw(&set, plot, "ledger");
  if (residual.count)
    draw_residual(&residual, plot, x_label);
  fputs("unset multiplot\n", plot->script);
}

// Coordination above, solid fraction below, on one axis.
static void draw_fabric(const tal_figure_data *data, tal_plot *plot) {
  enum { HEIGHT = CURVE_HEIGHT + 250 };
  curves upper, lower;
  const char *x_label = curves_over_strain(&upper, data);
  curves_over_strain(&lower, data);
  curves_add(&upper, "coordination", "all grains", 1);
  curves_add(&upper, "coordination_bearing", "without rattlers", 1);
  curves_add(&lower, "solid_fraction", "", 1);
  if (upper.count == 0 || lower.count == 0) {
    plot->empty = true;
    return;
  }
  open_canvas(plot, data, CURVE_WIDTH, HEIGHT);
  key_above(plot, HEIGHT);
  fputs("set multiplot\nset lmargin at screen 0.175\nset bmargin at screen 0.53\nset format x ''\n"
        "set ylabel 'coordination number'\n",
        plot->script);
  curves_write(&upper, plot, "upper");
  curves_draw(&upper, plot, "upper");
  fprintf(plot->script, "unset label 1\nset format x '%%h'\nset xlabel '%s'\nset ylabel 'solid fraction'\n", x_label);
  fputs("set tmargin at screen 0.49\nset bmargin at screen 0.12\n", plot->script);
  curves_write(&lower, plot, "lower");
  curves_draw(&lower, plot, "lower");
  fputs("unset multiplot\n", plot->script);
}

const tal_figure tal_figure_confinement = {"confinement", "stresses against time with the target pressure",
                                           TAL_NEEDS_CONFINE, draw_confinement};
const tal_figure tal_figure_stress_ratio = {"stress_ratio", "sigma_yy / sigma_xx against axial strain",
                                            TAL_NEEDS_STRAIN, draw_stress_ratio};
const tal_figure tal_figure_volumetric_strain = {"volumetric_strain", "volumetric strain against axial strain",
                                                 TAL_NEEDS_STRAIN, draw_volumetric_strain};
const tal_figure tal_figure_mean_slip = {"mean_slip", "mean slip speed over vR against axial strain", TAL_NEEDS_STRAIN,
                                         draw_mean_slip};
const tal_figure tal_figure_energy = {"energy", "terms of the energy ledger and what it does not close by",
                                      TAL_NEEDS_SERIES, draw_energy};
const tal_figure tal_figure_fabric = {"coordination", "coordination number and solid fraction", TAL_NEEDS_SERIES,
                                      draw_fabric};
