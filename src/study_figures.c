// One figure per metric: error against cost, both logarithmic, with the frontier, the noise floor and the error asked
// for. An error below the axis (or none at all) stands at its foot as a triangle.
#include "figures_gnuplot.h"
#include "files.h"
#include "study_merge.h"
#include "study_words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 1300, HEIGHT = 1000, FONT = 24, STYLES = 7, LABEL = 28, MOST_LABELS = 60 };

// Okabe and Ito's colours, each with a mark of its own: hollow, filled on the frontier.
static const struct {
  const char *colour;
  int hollow, filled;
} style[STYLES] = {{"#0072b2", 6, 7},   {"#d55e00", 4, 5},   {"#009e73", 8, 9}, {"#cc79a7", 12, 13},
                   {"#000000", 14, 15}, {"#e69f00", 10, 11}, {"#56b4e9", 6, 7}};

// What one figure shows.
typedef struct picture {
  const tal_study_summary *s;
  size_t m;
  double scale;          // from the metric's unit to the axis: 1, or to per cent of the reference's mean
  double low, high;      // range of errors
  double floor, unclear; // median standard error of the differences, and half width of their interval
  double least, most;    // range of costs
} picture;

static bool drawable(const picture *p, size_t k) {
  return k != p->s->study->reference_setting && p->s->lines[k].cpu_time > 0 &&
         isfinite(tal_study_cell_of(p->s, k, p->m)->difference.mean);
}

static double error_of(const picture *p, size_t k) {
  return p->scale * fabs(tal_study_cell_of(p->s, k, p->m)->difference.mean);
}

// Median over the settings drawn.
static double median_of(const picture *p, bool half) {
  double *list = tal_alloc(p->s->study->setting_count, sizeof *list);
  size_t n = 0;
  for (size_t k = 0; k < p->s->study->setting_count; k++) {
    const tal_difference *d = &tal_study_cell_of(p->s, k, p->m)->difference;
    const double value = p->scale * (half ? d->half : d->error);
    if (drawable(p, k) && isfinite(value))
      list[n++] = value;
  }
  const double median = tal_median(list, n);
  free(list);
  return median;
}

static double bar_of(const picture *p, size_t k) {
  const double error = p->scale * tal_study_cell_of(p->s, k, p->m)->difference.error;
  return isfinite(error) ? error : 0;
}

static double limit_of(const picture *p) {
  return p->scale * tal_study_limit(p->s, p->m);
}

static void stretch(picture *p, double error) {
  if (!(error > 0) || !isfinite(error))
    return;
  p->low = fmin(p->low, error);
  p->high = fmax(p->high, error);
}

// False when there is nothing to see.
static bool measure(picture *p) {
  const tal_study *study = p->s->study;
  const double mean = fabs(tal_study_cell_of(p->s, study->reference_setting, p->m)->estimate.mean);
  p->scale = study->metrics[p->m].relative && mean > 0 ? 100 / mean : 1;
  p->low = p->least = HUGE_VAL;
  p->high = p->most = 0;
  size_t count = 0;
  for (size_t k = 0; k < p->s->study->setting_count; k++) {
    const double cost = p->s->lines[k].cpu_time;
    const bool reference = k == p->s->study->reference_setting && cost > 0;
    if (!reference && !drawable(p, k))
      continue;
    p->least = fmin(p->least, cost);
    p->most = fmax(p->most, cost);
    if (reference)
      continue;
    stretch(p, error_of(p, k));
    stretch(p, error_of(p, k) + bar_of(p, k));
    count++;
  }
  p->floor = median_of(p, false);
  p->unclear = median_of(p, true);
  stretch(p, p->floor);
  stretch(p, p->unclear);
  stretch(p, limit_of(p));
  if (p->high == 0)
    p->low = 0.1, p->high = 1; // every setting gives the reference's bits
  // What lies far below the noise means nothing.
  if (p->floor > 0)
    p->low = fmax(p->low, p->floor / 20);
  p->low /= 1.6;
  p->high *= 2.2;
  p->least /= 1.4;
  p->most *= 1.7;
  return count > 0;
}

// ---- frame ----

// Ticks at 1, 2 and 5 times the powers of ten; at the powers alone over more than three of them.
static void ticks(FILE *out, char axis, double low, double high) {
  static const double part[] = {1, 2, 5};
  const bool few = high / low > 1000;
  const char *comma = "";
  fprintf(out, "set %ctics (", axis);
  for (int power = (int)floor(log10(low)); power <= (int)ceil(log10(high)); power++)
    for (int k = 0; k < (few ? 1 : 3); k++) {
      const double value = part[k] * pow(10, power);
      const bool plain = power >= -2 && power <= 3;
      if (value < low || value > high)
        continue;
      if (plain)
        fprintf(out, "%s'%g' %.9g", comma, value, value);
      else if (k)
        fprintf(out, "%s'%g·10^{%d}' %.9g", comma, part[k], power, value);
      else
        fprintf(out, "%s'10^{%d}' %.9g", comma, power, value);
      comma = ", ";
    }
  fputs(")\n", out);
}

// Title, and what the marks are labelled with.
static void put_title(const picture *p, FILE *out) {
  const tal_study *study = p->s->study;
  char text[200];
  snprintf(text, sizeof text, "%.80s", study->name);
  if (study->dials[0].key)
    snprintf(text, sizeof text, "%.80s (marks: %.40s)", study->name, study->dials[0].name);
  fputs("set label 1 ", out);
  tal_plot_text(out, text, 64);
  fprintf(out, " at screen 0.5, screen %.4f center noenhanced\n", 1 - 35.0 / HEIGHT);
}

static void open_canvas(const picture *p, tal_plot *plot) {
  const tal_study *study = p->s->study;
  FILE *out = plot->script;
  tal_plot_canvas(plot, WIDTH, HEIGHT, FONT);
  fputs("set border 3 lw 2\nset tics nomirror out\nset grid lw 1.5 lc rgb '#dddddd' dt 1\nset logscale xy\n"
        "set key noautotitle\n",
        out);
  put_title(p, out);
  fprintf(out, "set lmargin at screen 0.145\nset rmargin at screen 0.95\nset tmargin at screen %.4f\n",
          1 - 205.0 / HEIGHT);
  fprintf(out,
          "set bmargin at screen 0.13\nset key at screen 0.55, screen %.4f center center horizontal Left reverse "
          "samplen 2.5 maxrows 3 font ',%d' noenhanced\n",
          1 - 125.0 / HEIGHT, FONT - 5);
  ticks(out, 'x', p->least, p->most);
  ticks(out, 'y', p->low, p->high);
  fprintf(out, "set xrange [%.9g:%.9g]\nset yrange [%.9g:%.9g]\n", p->least, p->most, p->low, p->high);
  fprintf(out, "set xlabel 'cost: CPU seconds of a run%s'\n", study->cost_stage_count ? ", in the stages counted" : "");
  fputs("set ylabel ", out);
  const char *name = study->metrics[p->m].name;
  char text[120];
  snprintf(text, sizeof text, "|error| of %.80s%s", name, p->scale == 1 ? "" : " (% of the reference)");
  tal_plot_text(out, text, 70);
  fprintf(out, " noenhanced font ',%d'\n", strlen(text) > 44 ? FONT - 6 : FONT - 2);
}

// A grey band from the foot of the axis up to `top`.
static void band(const picture *p, tal_plot *plot, int number, double top, const char *colour) {
  if (top > p->low)
    fprintf(plot->script,
            "set object %d rectangle from graph 0, first %.9g to graph 1, first %.9g behind fc rgb '%s' fs solid "
            "noborder\n",
            number, p->low, fmin(top, p->high), colour);
}

static void mark_reference(const picture *p, tal_plot *plot) {
  const tal_study *study = p->s->study;
  const double cost = p->s->lines[study->reference_setting].cpu_time;
  char text[120];
  if (!(cost > 0))
    return;
  fprintf(plot->script, "set arrow 1 from %.9g, graph 0 to %.9g, graph 1 nohead lw 3 dt (8,6) lc rgb '#606060'\n", cost,
          cost);
  snprintf(text, sizeof text, "reference: %.90s", study->settings[study->reference_setting].label);
  fputs("set label 2 ", plot->script);
  tal_plot_text(plot->script, text, 50);
  fprintf(plot->script,
          " at %.9g, graph 0.98 right rotate by 90 offset -0.9,0 font ',%d' tc rgb '#606060' noenhanced\n", cost,
          FONT - 5);
}

static void mark_limit(const picture *p, tal_plot *plot) {
  const tal_study_metric *metric = &p->s->study->metrics[p->m];
  const double limit = limit_of(p);
  if (!(limit > 0))
    return;
  fprintf(plot->script,
          "set arrow 2 from graph 0, first %.9g to graph 1, first %.9g nohead lw 3 dt (3,5) lc rgb '#a00000'\n", limit,
          limit);
  fprintf(plot->script,
          "set label 3 'within %.3g%s' at graph 0.01, first %.9g left offset 0,0.6 font ',%d' tc rgb "
          "'#a00000'\n",
          metric->relative ? 100 * metric->within : metric->within, metric->relative ? " %" : "", limit, FONT - 5);
}

// ---- points ----

static size_t style_of(const picture *p, size_t k) {
  return p->s->study->dial_count > 1 ? p->s->study->settings[k].value[1] % STYLES : 0;
}

// Names of the points: what the first dial was turned to.
static void name_points(const picture *p, tal_plot *plot) {
  const tal_study *study = p->s->study;
  int number = 10;
  for (size_t k = 0; k < study->setting_count && number < 10 + MOST_LABELS; k++) {
    if (!drawable(p, k))
      continue;
    fprintf(plot->script, "set label %d ", number);
    tal_plot_text(plot->script, study->dials[0].value[study->settings[k].value[0]].label, LABEL);
    fprintf(plot->script, " at %.9g, %.9g left offset 0.8,%s font ',%d' tc rgb '%s' front noenhanced\n",
            p->s->lines[k].cpu_time, fmax(error_of(p, k), p->low * 1.12),
            number % 2 && error_of(p, k) > 3 * p->low ? "-0.7" : "0.7", FONT - 6, style[style_of(p, k)].colour);
    number++;
  }
}

// x, y, low end and high end of the bar.
static void put_point(const picture *p, FILE *data, size_t k) {
  const double error = error_of(p, k), bar = bar_of(p, k);
  fprintf(data, "%.9g %.9g %.9g %.9g\n", p->s->lines[k].cpu_time, fmax(error, p->low * 1.12), fmax(error - bar, p->low),
          fmax(error + bar, p->low));
}

typedef enum kind { ALL, OFF_FRONTIER, ON_FRONTIER, BELOW } kind;

static bool is_kind(const picture *p, size_t k, kind wanted) {
  const bool below = error_of(p, k) < p->low * 1.12;
  switch (wanted) {
  case ALL:
    return true;
  case BELOW:
    return below;
  default:
    return !below && tal_study_cell_of(p->s, k, p->m)->frontier == (wanted == ON_FRONTIER);
  }
}

// The points of one kind and one value of the second dial into a file of their own; how many.
static size_t write_points(const picture *p, tal_plot *plot, const char *name, size_t second, kind wanted) {
  FILE *data = tal_plot_data(plot, name);
  size_t count = 0;
  for (size_t k = 0; data && k < p->s->study->setting_count; k++) {
    if (!drawable(p, k) || !is_kind(p, k, wanted))
      continue;
    if (p->s->study->dial_count > 1 && p->s->study->settings[k].value[1] != second)
      continue;
    put_point(p, data, k);
    count++;
  }
  tal_plot_data_end(plot, data);
  return count;
}

static void draw_kind(const picture *p, tal_plot *plot, size_t second, kind wanted) {
  static const char *const word[] = {"all", "off", "on", "below"};
  char name[40];
  snprintf(name, sizeof name, "%s%zu", word[wanted], second);
  const char *colour = style[second % STYLES].colour;
  if (!write_points(p, plot, name, second, wanted))
    return;
  tal_plot_element(plot);
  if (wanted == ALL) {
    if (p->s->study->dials[0].key)
      fprintf(plot->script, "'%s' using 1:2 with lines lw 1.5 dt (2,4) lc rgb '%s', ", name, colour);
    fprintf(plot->script, "'%s' using 1:2:3:4 with yerrorbars lw 2 pt 0 lc rgb '%s'", name, colour);
    return;
  }
  const int mark = wanted == BELOW         ? 10
                   : wanted == ON_FRONTIER ? style[second % STYLES].filled
                                           : style[second % STYLES].hollow;
  fprintf(plot->script, "'%s' using 1:2 with points ps 2.6 lw 3 pt %d lc rgb '%s'", name, mark, colour);
}

// The stairs below which no setting came.
static void draw_frontier(const picture *p, tal_plot *plot) {
  FILE *data = tal_plot_data(plot, "frontier");
  double last = -1;
  for (size_t count = 0; data && count < p->s->study->setting_count; count++) {
    size_t next = SIZE_MAX; // the cheapest that is dearer than the last
    for (size_t k = 0; k < p->s->study->setting_count; k++)
      if (drawable(p, k) && tal_study_cell_of(p->s, k, p->m)->frontier && p->s->lines[k].cpu_time > last &&
          (next == SIZE_MAX || p->s->lines[k].cpu_time < p->s->lines[next].cpu_time))
        next = k;
    if (next == SIZE_MAX)
      break;
    put_point(p, data, next);
    last = p->s->lines[next].cpu_time;
  }
  tal_plot_data_end(plot, data);
  tal_plot_element(plot);
  fputs("'frontier' using 1:2 with steps lw 3 lc rgb '#000000' title 'frontier'", plot->script);
}

static void legend(const picture *p, tal_plot *plot) {
  const tal_study *study = p->s->study;
  if (p->floor > 0) {
    tal_plot_element(plot);
    fputs("NaN with lines lw 16 lc rgb '#c4c4c4' title 'noise: 1 standard error'", plot->script);
  }
  if (p->unclear > 0) {
    tal_plot_element(plot);
    fprintf(plot->script, "NaN with lines lw 16 lc rgb '#e6e6e6' title 'not told from 0 (%g %%)'",
            100 * study->confidence);
  }
  for (size_t j = 0; study->dial_count > 1 && j < study->dials[1].count; j++) {
    char text[120];
    const tal_study_value *value = &study->dials[1].value[j];
    snprintf(text, sizeof text, "%.40s%s%.60s", value->named ? "" : study->dials[1].name, value->named ? "" : "=",
             value->label);
    tal_plot_element(plot);
    fprintf(plot->script, "NaN with points ps 2.2 lw 3 pt %d lc rgb '%s' title ", style[j % STYLES].filled,
            style[j % STYLES].colour);
    tal_plot_text(plot->script, text, 40);
  }
}

static void draw(const picture *p, tal_plot *plot) {
  const tal_study *study = p->s->study;
  open_canvas(p, plot);
  band(p, plot, 1, p->unclear, "#e6e6e6");
  band(p, plot, 2, p->floor, "#c4c4c4");
  mark_reference(p, plot);
  mark_limit(p, plot);
  name_points(p, plot);
  draw_frontier(p, plot);
  const size_t seconds = study->dial_count > 1 ? study->dials[1].count : 1;
  for (size_t j = 0; j < seconds; j++)
    for (kind wanted = ALL; wanted <= BELOW; wanted++)
      draw_kind(p, plot, j, wanted);
  legend(p, plot);
  tal_plot_command_end(plot);
}

static tal_status draw_one(const picture *p, const char *folder, tal_error *err) {
  tal_tree words = {0};
  tal_plot plot;
  tal_status status = tal_plot_begin(&plot, folder, err);
  if (status)
    return status;
  draw(p, &plot);
  status = tal_plot_finish(
      &plot,
      tal_words_format(&words, "%s/error_%s.png", folder, tal_words_slug(&words, p->s->study->metrics[p->m].name)),
      err);
  tal_tree_clear(&words);
  return status;
}

tal_status tal_study_figures_draw(const tal_study_summary *summary, int *count, tal_error *err) {
  char folder[TAL_PATH_SIZE];
  *count = 0;
  tal_file_path(folder, summary->dir, "figures");
  tal_status status = tal_folder_create(folder, err);
  for (size_t m = 0; m < summary->study->metric_count && status == TAL_OK; m++) {
    picture p = {.s = summary, .m = m};
    if (!measure(&p))
      continue;
    status = draw_one(&p, folder, err);
    *count += status == TAL_OK;
  }
  return status;
}
