// forces.csv: statistics of normal and tangential forces frame by frame. force_pdf.csv: their distributions in the
// frames of --at.
#include "measure_list.h"

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
}

const tal_measurement tal_measurement_forces = {NULL, frame, NULL};
