// See measure_figures.h. gnuplot reads the tables themselves: it works in a folder inside that of the tables. A figure
// is added with one entry of the list.
#include "measure_figures.h"

#include "measure_map.h"
#include <math.h>

enum { MOST_CURVES = 5 };

typedef struct curve {
  const char *y;              // gnuplot's expression, columns by name
  const char *title;          //
  const char *where, *equals; // only rows with this text in this column; NULL: all rows
} curve;

typedef struct figure {
  const char *name, *table, *title, *ylabel, *settings;
  const char *x, *xlabel; // NULL: over axial strain or time; else per frame of --at, the curve's y over this column
  curve curves[MOST_CURVES];
} figure;

static const figure figures[] = {
    {"anisotropy",
     "tensors.csv",
     "anisotropy of contacts, normal forces, tangential forces, branches",
     "anisotropy",
     "set yrange [0:*]",
     NULL,
     NULL,
     {{"column(\"a_c\")", "a_c", "network", "all"},
      {"column(\"a_n\")", "a_n", "network", "all"},
      {"column(\"a_t\")", "a_t", "network", "all"},
      {"column(\"a_l\")", "a_l", "network", "all"},
      {"column(\"a_c\")", "a_c, strong contacts", "network", "strong"}}},
    {"relation",
     "tensors.csv",
     "stress ratio (s_1 - s_2)/(s_1 + s_2) and what force and fabric say",
     "stress ratio",
     "set yrange [0:*]",
     NULL,
     NULL,
     {{"column(\"stress_ratio\")", "measured", "network", "all"},
      {"column(\"relation_ratio\")", "half the sum of anisotropies", "network", "all"},
      {"column(\"relation_full_ratio\")", "with their products", "network", "all"},
      {"column(\"stress_ratio\")", "strong contacts", "network", "strong"},
      {"column(\"stress_ratio\")", "weak contacts", "network", "weak"}}},
    {"forces",
     "forces.csv",
     "normal forces and friction",
     "share",
     "set yrange [0:1]",
     NULL,
     NULL,
     {{"column(\"below_mean\")", "contacts below the mean force", "force", "normal"},
      {"column(\"participation\")", "participation", "force", "normal"},
      {"column(\"mobilised\")", "mobilised friction", "force", "normal"},
      {"column(\"at_friction_limit\")", "contacts at the friction limit", "force", "normal"}}},
    {"force_exponents",
     "forces.csv",
     "tail exp(-β f/⟨f⟩) above the mean, power law (f/⟨f⟩)^α below",
     "exponent",
     "",
     NULL,
     NULL,
     {{"column(\"tail_rate\")", "β normal", "force", "normal"},
      {"column(\"tail_rate\")", "β tangential", "force", "tangential"},
      {"column(\"power_exponent\")", "α normal", "force", "normal"},
      {"column(\"power_exponent\")", "α tangential", "force", "tangential"}}},
    {"chains",
     "chains.csv",
     "force chains",
     "grains, chains, percent",
     "set yrange [0:*]",
     NULL,
     NULL,
     {{"column(\"mean_grains\")", "mean grains of a chain", NULL, NULL},
      {"100*column(\"chains\")/column(\"bearing_grains\")", "chains in 100 bearing grains", NULL, NULL},
      {"column(\"segments\")>0?100*column(\"buckled\")/column(\"segments\"):NaN",
       "percent of segments buckled since the frame before", NULL, NULL}}},
    {"coordination",
     "voids.csv",
     "coordination and void polygons",
     "contacts",
     "set yrange [0:*]",
     NULL,
     NULL,
     {{"column(\"coordination\")", "contacts of a grain", NULL, NULL},
      {"column(\"coordination_bearing\")", "without rattlers", NULL, NULL},
      {"column(\"mean_sides\")", "contacts around a void", NULL, NULL}}},
    {"chain_lengths",
     "chain_lengths.csv",
     "length of force chains",
     "chains",
     "set logscale y",
     "column(\"grains\")",
     "grains of a chain",
     {{"column(\"chains\")>0?column(\"chains\"):NaN", "", NULL, NULL}}},
    {"correlation",
     "correlation.csv",
     "correlation of the size of rotations",
     "correlation",
     "set xzeroaxis lw 1 lc rgb '#909090'",
     "1e3*column(\"r[m]\")",
     "distance (mm)",
     {{"column(\"pairs\")>30?column(\"magnitude\"):NaN", "", NULL, NULL}}},
};

static const char *const colours[] = {"#1a1a1a", "#0072b2", "#d55e00", "#009e73",
                                      "#cc79a7", "#7a7a7a", "#56b4e9", "#e69f00"};
enum { COLOURS = sizeof colours / sizeof *colours };

static bool is_strained(const tal_measuring *run) {
  for (size_t k = 0; k < run->choice.frames.count; k++)
    if (run->choice.in[k] && run->choice.frames.entry[k].axial_strain > 0)
      return true;
  return false;
}

static void open_canvas(tal_plot *plot, const tal_measuring *run, const figure *f, const char *xlabel) {
  tal_plot_canvas(plot, 1250, 900, 22);
  fprintf(
      plot->script,
      "set datafile separator ','\nset datafile missing NaN\nset border 3 lw 2 lc rgb '#606060'\nset tics nomirror out "
      "textcolor rgb '#000000'\n"
      "set key outside bottom center Left reverse samplen 2 maxrows 3 font ',18'\nset bmargin 7.5\nset xlabel '%s' "
      "offset 0,0.3\nset "
      "ylabel '%s' "
      "noenhanced\nset lmargin 11\nset rmargin 4\nset tmargin 5\n%s\nset label 1 '%s' at graph 0.5, graph 1.04 center "
      "font ',18' noenhanced\nset title ",
      xlabel, f->ylabel, f->settings, f->title);
  tal_plot_text(plot->script, run->name, 40);
  fputs(" noenhanced offset 0,1.2\n", plot->script);
}

static void draw_over_strain(tal_plot *plot, const tal_measuring *run, const figure *f) {
  const bool strained = is_strained(run);
  open_canvas(plot, run, f, strained ? "axial strain (%)" : "time (s)");
  for (int k = 0; k < MOST_CURVES && f->curves[k].y; k++) {
    const curve *c = &f->curves[k];
    tal_plot_element(plot);
    fprintf(plot->script, "'../%s' using (%s):(", f->table,
            strained ? "100*column(\"axial_strain\")" : "column(\"time[s]\")");
    if (strained) // the confinement would stand above zero strain
      fputs("column(\"axial_strain\")<=0?NaN:", plot->script);
    if (c->where)
      fprintf(plot->script, "strcol(\"%s\") ne \"%s\"?NaN:", c->where, c->equals);
    fprintf(plot->script, "%s) with linespoints lw 3 pt 7 ps 0.6 lc rgb '%s' title '%s' noenhanced", c->y,
            colours[k % COLOURS], c->title);
  }
}

static void draw_per_frame(tal_plot *plot, const tal_measuring *run, const figure *f) {
  int drawn = 0;
  open_canvas(plot, run, f, f->xlabel);
  for (size_t k = 0; k < run->choice.frames.count; k++) {
    if (!run->choice.detail[k] || drawn == COLOURS)
      continue;
    tal_plot_element(plot);
    fprintf(plot->script,
            "'../%s' using (%s):(column(\"frame\")!=%zu?NaN:%s) with linespoints lw 3 pt 7 ps 1 lc rgb '%s' title "
            "'axial strain %.3g %%, t = %.4g s'",
            f->table, f->x, k, f->curves[0].y, colours[drawn++], 100 * run->choice.frames.entry[k].axial_strain,
            run->choice.frames.entry[k].time);
  }
}

void tal_measure_curves_draw(tal_measuring *run) {
  for (size_t k = 0; k < sizeof figures / sizeof *figures && !tal_measure_stopped(run); k++) {
    const figure *f = &figures[k];
    tal_plot plot;
    tal_error err;
    const tal_status status = tal_plot_begin(&plot, run->out, &err);
    if (status) {
      tal_measure_failed(run, status, &err);
      return;
    }
    if (f->x)
      draw_per_frame(&plot, run, f);
    else
      draw_over_strain(&plot, run, f);
    tal_plot_command_end(&plot);
    tal_measure_plot_end(&plot, run, f->name);
  }
}
