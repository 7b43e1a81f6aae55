// forces.csv: statistics of normal and tangential forces frame by frame. force_pdf.csv: their distributions in the
// frames of --at.
#include "measure_map.h"

#include <math.h>
#include <stdlib.h>

static const char header[] = TAL_ROW
    ",force,contacts,mean[N],deviation,largest,below_mean,participation,tail_count,tail_rate,tail_low,tail_high,"
    "tail_distance,tail_p,power_count,power_exponent,power_low,power_high,power_distance,power_p,friction_ratio,"
    "mobilised,at_friction_limit";

// The exponent of a density is its rate in ln x less 1.
static void put_fit(FILE *out, tal_rate_fit fit, double less) {
  const double shift = fit.rate > 0 ? less : 0;
  fprintf(out, ",%zu", fit.count);
  tal_put(out, fit.rate - shift);
  tal_put(out, fit.low - shift);
  tal_put(out, fit.high - shift);
  tal_put(out, fit.distance);
  tal_put(out, fit.p);
}

static void put_law(tal_measuring *run, const tal_part *part, FILE *out, const char *force, const tal_force_law *law,
                    tal_friction_use use) {
  tal_measuring_row(run, part, out);
  fprintf(out, ",%s,%zu", force, law->contacts);
  tal_put(out, law->mean);
  tal_put(out, law->deviation);
  tal_put(out, law->largest);
  tal_put(out, law->below_mean);
  tal_put(out, law->participation);
  put_fit(out, law->tail, 0);
  put_fit(out, law->power, 1);
  tal_put(out, use.ratio);
  tal_put(out, use.mean);
  tal_put(out, use.at_limit);
  fputc('\n', out);
}

static void put_histogram(tal_measuring *run, const tal_part *part, const char *force, const double *column) {
  FILE *out = tal_tables_get(&run->tables, "force_pdf.csv", TAL_ROW ",force,low,high,contacts,density");
  tal_force_bin bin[TAL_FORCE_BINS];
  double *value = tal_part_forces(part, column);
  tal_force_histogram(value, part->contact_count, bin);
  free(value);
  for (size_t k = 0; k < TAL_FORCE_BINS; k++) {
    tal_measuring_row(run, part, out);
    fprintf(out, ",%s,%.6g,%.6g,%zu", force, bin[k].low, bin[k].high, bin[k].count);
    tal_put(out, bin[k].density);
    fputc('\n', out);
  }
}

// ---- the figure ----

static void write_points(tal_plot *plot, const char *name, const double *force, size_t count) {
  tal_force_bin bin[TAL_FORCE_BINS];
  tal_force_histogram(force, count, bin);
  FILE *data = tal_plot_data(plot, name);
  for (size_t k = 0; data && k < TAL_FORCE_BINS; k++)
    if (bin[k].count > 1)
      fprintf(data, "%.9g %.9g\n", sqrt(bin[k].low * bin[k].high), bin[k].density);
  tal_plot_data_end(plot, data);
}

// Points and the two laws, each with the weight of the contacts it was fitted to.
static void draw_law(tal_plot *plot, const char *name, const tal_force_law *law, const char *colour) {
  const double n = (double)law->contacts, tail = (double)law->tail.count / n, power = (double)law->power.count / n;
  tal_plot_element(plot);
  fprintf(plot->script, "'%s' using 1:2 with points pt 7 ps 1.2 lc rgb '%s' title '%s'", name, colour, name);
  if (law->tail.count > 1) {
    tal_plot_element(plot);
    fprintf(plot->script,
            "[x=1:10] %.9g * exp(-%.9g * (x - 1)) with lines lw 3 lc rgb '%s' title 'exp(-β f/⟨f⟩), β = %.3g (%.3g to "
            "%.3g)'",
            tail * law->tail.rate, law->tail.rate, colour, law->tail.rate, law->tail.low, law->tail.high);
  }
  if (law->power.count > 1) {
    tal_plot_element(plot);
    fprintf(plot->script,
            "[x=1e-3:1] %.9g * x**(%.9g) with lines lw 3 dt (12,8) lc rgb '%s' title '(f/⟨f⟩)^α, α = %.3g (%.3g to "
            "%.3g)'",
            power * law->power.rate, law->power.rate - 1, colour, law->power.rate - 1, law->power.low - 1,
            law->power.high - 1);
  }
}

static void draw(tal_measuring *run, const tal_part *part, const tal_forces *f) {
  tal_plot plot;
  tal_error err;
  char name[40];
  if (tal_measure_stopped(run))
    return;
  const tal_status status = tal_plot_begin(&plot, run->out, &err);
  if (status) {
    tal_measure_failed(run, status, &err);
    return;
  }
  tal_plot_canvas(&plot, 1250, 1000, 22);
  fprintf(plot.script,
          "set border 3 lw 2 lc rgb '#606060'\nset tics nomirror out textcolor rgb '#000000'\nset key outside bottom "
          "center Left reverse samplen 2 maxrows 3 noenhanced font ',18'\nset bmargin 7.5\nset logscale y\nset format "
          "y '10^{%%L}'\nset xlabel 'f / "
          "⟨f⟩' offset 0,0.3\nset ylabel 'probability density'\nset xrange [0:8]\nset yrange [1e-4:10]\nset samples "
          "1000\nset tmargin "
          "5\nset label 1 'contact forces, axial strain %.3g %%, %.3g %% of the normal ones below the mean' at graph "
          "0.5, graph 1.04 center font ',18'\nset title ",
          100 * part->of->axial_strain, 100 * f->normal.below_mean);
  tal_plot_text(plot.script, run->name, 40);
  fputs(" noenhanced offset 0,1.2\n", plot.script);
  double *fn = tal_part_forces(part, part->of->contacts.fn), *ft = tal_part_forces(part, part->of->contacts.ft);
  write_points(&plot, "normal", fn, part->contact_count);
  write_points(&plot, "tangential", ft, part->contact_count);
  draw_law(&plot, "normal", &f->normal, "#b2281e");
  if (f->tangential.contacts)
    draw_law(&plot, "tangential", &f->tangential, "#0072b2");
  tal_plot_command_end(&plot);
  snprintf(name, sizeof name, "force_pdf-%06zu", run->frame);
  tal_measure_plot_end(&plot, run, name);
  free(fn);
  free(ft);
}

static void frame(void *state, tal_measuring *run, const tal_part *part) {
  (void)state;
  FILE *out = tal_tables_get(&run->tables, "forces.csv", header);
  const tal_forces f = tal_forces_measure(part, tal_measure_facts_friction(&run->facts, part->of->stage));
  put_law(run, part, out, "normal", &f.normal, f.friction);
  put_law(run, part, out, "tangential", &f.tangential, f.friction);
  if (!run->detail)
    return;
  put_histogram(run, part, "normal", part->of->contacts.fn);
  put_histogram(run, part, "tangential", part->of->contacts.ft);
  if (run->options->figures && f.normal.contacts > 1 && f.normal.deviation > 1e-6)
    draw(run, part, &f);
}

const tal_measurement tal_measurement_forces = {NULL, frame, NULL};
