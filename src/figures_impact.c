#include "figures_impact.h"

#include "figures_gnuplot.h"
#include "files.h"
#include "law.h"

#include <math.h>
#include <stdlib.h>

enum { POINTS = 181, WIDTH = 1500, HEIGHT = 900, FONT = 20 };

// e from 0.999 to below 0.005 for both laws.
static const double least_number = 1e-3, most_number = 30;

tal_status tal_impact_study_of(const tal_scene *scene, const tal_constants *constants, tal_impact_study *study,
                               tal_error *err) {
  bool hertz = tal_normal_law_find(scene->contact.normal)->effects & TAL_EFFECT_HERTZ;
  double speed = isfinite(constants->vR) ? constants->vR : constants->restitution_speed;
  if (hertz && isnan(speed))
    return tal_fail(err, TAL_BAD_INPUT,
                    "%s: contact.vR: is missing, and neither a stage with a rate nor contact.restitution_speed says at "
                    "which speed grains meet; accepted: one of the three",
                    scene->path);
  *study = (tal_impact_study){.name = scene->name,
                              .hertz = hertz,
                              .pair = tal_damping_mean_pair(scene, constants),
                              .speed = isnan(speed) ? 1 : speed,
                              .reference = (double)NAN};
  for (size_t s = scene->stage_count; s-- > 0;)
    if (fabs(scene->stages[s].rate) > 0)
      study->reference = 1 / fabs(scene->stages[s].rate); // the first one's in the end
  return TAL_OK;
}

// Damping (T or c) that belongs to the damping number 1.
static double unit_damping(const tal_scene *scene, const tal_impact_study *study) {
  tal_pair unit = study->pair;
  unit.damping = 1;
  return 1 / tal_damping_number_at(scene, &unit, study->speed);
}

typedef struct point {
  double number, damping, restitution, time; // [-, s or N s/m, -, s]
} point;

static point point_at(const tal_scene *scene, const tal_impact_study *study, double number) {
  tal_pair pair = study->pair;
  pair.damping = number * unit_damping(scene, study);
  tal_impact impact = tal_damping_impact(scene, &pair, study->speed);
  return (point){number, pair.damping, impact.restitution, impact.duration};
}

static point point_of_scene(const tal_scene *scene, const tal_impact_study *study) {
  return point_at(scene, study, tal_damping_number_at(scene, &study->pair, study->speed));
}

// Evenly spaced in the logarithm; the range takes the scene's own value in.
static void points_over_damping(const tal_scene *scene, const tal_impact_study *study, point points[POINTS]) {
  double own = tal_damping_number_at(scene, &study->pair, study->speed);
  double low = log(own > 0 ? fmin(least_number, own / 3) : least_number), high = log(fmax(most_number, 3 * own));
  for (int k = 0; k < POINTS; k++)
    points[k] = point_at(scene, study, exp(low + (high - low) * k / (POINTS - 1)));
}

tal_status tal_impact_study_table(const tal_scene *scene, const tal_impact_study *study, const char *folder,
                                  tal_error *err) {
  char path[TAL_PATH_SIZE], *text = NULL;
  size_t size = 0;
  point points[POINTS];
  points_over_damping(scene, study, points);
  tal_file_path(path, folder, "impact.csv");
  FILE *out = tal_text_begin(&text, &size);
  fprintf(out, "damping_number,damping[%s],restitution,contact_time[s],contact_time_over_t0\n",
          study->hertz ? "s" : "N s/m");
  for (int k = 0; k < POINTS; k++) {
    const point *p = &points[k];
    fprintf(out, "%.17g,%.17g,%.17g,%.17g,", p->number, p->damping, p->restitution, p->time);
    if (isnan(study->reference))
      fprintf(out, "nan\n");
    else
      fprintf(out, "%.17g\n", p->time / study->reference);
  }
  tal_text_end(out);
  tal_status status = tal_file_replace(path, NULL, text, size, err);
  free(text);
  return status;
}

// ---- the picture ----

static void write_points(tal_plot *plot, const char *name, const point *points, int count, double time_unit) {
  FILE *data = tal_plot_data(plot, name);
  for (int k = 0; data && k < count; k++)
    fprintf(data, "%.9g %.9g %.9g\n", points[k].damping, points[k].restitution, points[k].time / time_unit);
  tal_plot_data_end(plot, data);
}

// The curve of columns `x`:`y` and the scene's own point.
static void draw_panel(tal_plot *plot, const char *columns, bool marked) {
  tal_plot_element(plot);
  fprintf(plot->script, "'curve' using %s with lines lw 4 lc rgb '#0072b2'", columns);
  if (marked) {
    tal_plot_element(plot);
    fprintf(plot->script, "'own' using %s with points pt 7 ps 2.2 lc rgb '#d55e00'", columns);
  }
  tal_plot_command_end(plot);
}

static void open_canvas(tal_plot *plot, const tal_impact_study *study, const point *own) {
  FILE *to = plot->script;
  tal_plot_canvas(plot, WIDTH, HEIGHT, FONT);
  fputs("set border 3 lw 2\nset tics nomirror out\nset grid lw 1.5 lc rgb '#dddddd' dt 1\nset key noautotitle\n", to);
  fputs("set label 1 ", to);
  tal_plot_text(to, study->name, 70);
  fprintf(to, " at screen 0.5, screen 0.97 center noenhanced\n");
  fputs("set label 2 'two mean grains", to);
  if (study->hertz)
    fprintf(to, " meeting at %.3g m/s", study->speed);
  if (own->damping > 0)
    fprintf(to, "; the dot is this scene, %s = %.3g %s, e = %.3g", study->hertz ? "T" : "c", own->damping,
            study->hertz ? "s" : "N s/m", own->restitution);
  else
    fputs("; this scene is undamped", to);
  fputs("' at screen 0.5, screen 0.925 center\nset multiplot\n", to);
}

// Left: restitution above, contact time below, over the damping and (top axis) its number; right: P's Fig. 2.1.
static void draw_panels(tal_plot *plot, const tal_impact_study *study, const point points[POINTS], int time_power,
                        bool marked) {
  FILE *to = plot->script;
  const point *first = &points[0], *last = &points[POINTS - 1];
  fputs("set lmargin at screen 0.1\nset rmargin at screen 0.475\nset tmargin at screen 0.79\n"
        "set bmargin at screen 0.475\nset logscale x\nset logscale x2\nset format x ''\nset format x2 '%g'\n"
        "set ylabel 'restitution e' offset 0.7,0\nset yrange [0:1]\nset ytics 0.2\nset x2tics offset 0,-0.3\n",
        to);
  fprintf(to, "set xrange [%.9g:%.9g]\nset x2range [%.9g:%.9g]\nset x2label '%s' offset 0,-0.7\n", first->damping,
          last->damping, first->number, last->number, study->hertz ? "T / τ" : "c / (2 (k m)^{1/2})");
  draw_panel(plot, "1:2", marked);
  fprintf(
      to,
      "unset label\nunset x2tics\nunset x2label\nset tmargin at screen 0.43\nset bmargin at screen 0.135\n"
      "set format x '10^{%%T}'\nset xlabel 'damping %s'\nset ylabel '%s (10^{%d}%s)' offset -0.7,0\nset yrange [0:*]\n"
      "set ytics 1\nset format y '%%g'\n",
      study->hertz ? "T (s)" : "c (N s/m)", isnan(study->reference) ? "contact time" : "contact time / t_0", time_power,
      isnan(study->reference) ? " s" : "");
  draw_panel(plot, "1:3", marked);
  fputs("set lmargin at screen 0.58\nset rmargin at screen 0.975\nset tmargin at screen 0.79\nunset logscale x\n"
        "set format x '%g'\nset xrange [0:1]\nset xlabel 'restitution e'\n",
        to);
  draw_panel(plot, "2:3", marked);
  fputs("unset multiplot\n", to);
}

tal_status tal_impact_study_draw(const tal_scene *scene, const tal_impact_study *study, const char *folder,
                                 tal_error *err) {
  tal_plot plot;
  point points[POINTS], own = point_of_scene(scene, study);
  char path[TAL_PATH_SIZE];
  tal_status status = tal_plot_begin(&plot, folder, err);
  if (status)
    return status;
  points_over_damping(scene, study, points);
  double unit = isnan(study->reference) ? 1 : study->reference;
  int power = (int)floor(log10(points[0].time / unit)); // the contact is longest where damping is least
  unit *= pow(10, power);
  write_points(&plot, "curve", points, POINTS, unit);
  write_points(&plot, "own", &own, 1, unit);
  open_canvas(&plot, study, &own);
  draw_panels(&plot, study, points, power, own.damping > 0);
  tal_file_path(path, folder, "impact.png");
  return tal_plot_finish(&plot, path, err);
}
