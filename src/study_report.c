// The report of a study for people: what is there, a table per metric, and one sentence: the cheapest setting within
// the error that the study asks for, and which bias its seeds exclude.
#include "study_merge.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// "3.1 %" of the reference's mean where the study asks for a share, else "0.031".
static void put_error(FILE *out, const tal_study_summary *s, size_t m, double error, const char *format) {
  const tal_study_metric *metric = &s->study->metrics[m];
  const double mean = tal_study_cell_of(s, s->study->reference_setting, m)->estimate.mean;
  fprintf(out, format, metric->relative ? 100 * error / fabs(mean) : error);
  fputs(metric->relative ? " %" : "", out);
}

static bool asks(const tal_study_summary *s, size_t m) {
  return isfinite(s->study->metrics[m].within);
}

static bool asks_any(const tal_study_summary *s) {
  for (size_t m = 0; m < s->study->metric_count; m++)
    if (asks(s, m))
      return true;
  return false;
}

// Is the setting within every error asked for: by its mean, or (shown) with what its seeds exclude? Where none is
// asked for: can it not be told from the reference?
static bool within(const tal_study_summary *s, size_t setting, bool shown) {
  const bool any = asks_any(s);
  for (size_t m = 0; m < s->study->metric_count; m++) {
    const tal_difference *d = &tal_study_cell_of(s, setting, m)->difference;
    if (any && asks(s, m) && !((shown ? d->bound : fabs(d->mean)) <= tal_study_limit(s, m)))
      return false;
    if (!any && !(fabs(d->mean) <= d->half))
      return false;
  }
  return true;
}

// SIZE_MAX: none.
static size_t cheapest(const tal_study_summary *s, bool shown) {
  size_t best = SIZE_MAX;
  for (size_t k = 0; k < s->study->setting_count; k++) {
    if (k == s->study->reference_setting || !isfinite(s->lines[k].cpu_time) || !within(s, k, shown))
      continue;
    if (best == SIZE_MAX || s->lines[k].cpu_time < s->lines[best].cpu_time)
      best = k;
  }
  return best;
}

static void put_limits(FILE *out, const tal_study_summary *s) {
  const char *between = "";
  for (size_t m = 0; m < s->study->metric_count; m++) {
    if (!asks(s, m))
      continue;
    fputs(between, out);
    put_error(out, s, m, tal_study_limit(s, m), "%.3g");
    fprintf(out, " in %s", s->study->metrics[m].name);
    between = ", ";
  }
}

static void put_bounds(FILE *out, const tal_study_summary *s, size_t setting) {
  const bool any = asks_any(s);
  const char *between = "";
  for (size_t m = 0; m < s->study->metric_count; m++) {
    const tal_difference *d = &tal_study_cell_of(s, setting, m)->difference;
    if (any && !asks(s, m))
      continue;
    fputs(between, out);
    between = ", ";
    if (isnan(d->bound))
      fputs("none", out);
    else
      put_error(out, s, m, d->bound, "%.2g");
    fprintf(out, " in %s (found ", s->study->metrics[m].name);
    put_error(out, s, m, d->mean, "%+.2g");
    fputs(")", out);
  }
}

static void put_cost(FILE *out, const tal_study_summary *s, size_t setting) {
  const double cost = s->lines[setting].cpu_time, reference = s->lines[s->study->reference_setting].cpu_time;
  fprintf(out, "%s, %.3g CPU s a run", s->study->settings[setting].label, cost);
  if (isfinite(reference))
    fprintf(out, ", %.3g times %s than the reference (%s, %.3g s)",
            reference >= cost ? reference / cost : cost / reference, reference >= cost ? "cheaper" : "dearer",
            s->study->settings[s->study->reference_setting].label, reference);
}

static size_t seeds_of(const tal_study_summary *s, size_t setting) {
  size_t least = SIZE_MAX;
  for (size_t m = 0; m < s->study->metric_count; m++) {
    const tal_difference *d = &tal_study_cell_of(s, setting, m)->difference;
    if ((!asks_any(s) || asks(s, m)) && d->n < least)
      least = d->n;
  }
  return least == SIZE_MAX ? 0 : least;
}

static void put_exclusion(FILE *out, const tal_study_summary *s, size_t setting) {
  const size_t n = seeds_of(s, setting);
  if (n < 2) {
    fputs("; one seed excludes no bias", out);
    return;
  }
  fprintf(out, "; %zu seeds exclude (Student's t, %g %%) a bias beyond ", n, 100 * s->study->confidence);
  put_bounds(out, s, setting);
}

// The setting nearest to what is asked for: the least of the largest share of an error asked for.
static size_t nearest(const tal_study_summary *s) {
  size_t best = SIZE_MAX;
  double least = HUGE_VAL;
  for (size_t k = 0; k < s->study->setting_count; k++) {
    double worst = 0;
    for (size_t m = 0; m < s->study->metric_count; m++) {
      const double part = fabs(tal_study_cell_of(s, k, m)->difference.mean) / tal_study_limit(s, m);
      if (asks(s, m))
        worst = isnan(part) ? HUGE_VAL : fmax(worst, part);
    }
    if (k == s->study->reference_setting || !(worst < least))
      continue;
    best = k;
    least = worst;
  }
  return best;
}

static void put_sentence(FILE *out, const tal_study_summary *s) {
  const bool any = asks_any(s);
  const size_t shown = any ? cheapest(s, true) : SIZE_MAX, likely = cheapest(s, false), near = nearest(s);
  if (shown != SIZE_MAX) {
    fputs("Cheapest setting shown to be within ", out);
    put_limits(out, s);
    fputs(" of the reference: ", out);
    put_cost(out, s, shown);
    put_exclusion(out, s, shown);
    if (likely != shown)
      fprintf(out, "; by its means alone %s (%.3g s) is within too", s->study->settings[likely].label,
              s->lines[likely].cpu_time);
  } else if (likely != SIZE_MAX) {
    fputs(any ? "By its means alone the cheapest setting within "
              : "Cheapest setting that cannot be told from the "
                "reference",
          out);
    if (any) {
      put_limits(out, s);
      fputs(" of the reference", out);
    }
    fputs(": ", out);
    put_cost(out, s, likely);
    put_exclusion(out, s, likely);
    fputs(any ? ": more than is asked for, so more seeds are needed to show it" : "", out);
  } else if (any && near != SIZE_MAX) {
    fputs("No setting but the reference is within ", out);
    put_limits(out, s);
    fputs("; the nearest: ", out);
    put_cost(out, s, near);
    put_exclusion(out, s, near);
  } else {
    fputs(any || s->done == 0 ? "Too few finished runs to compare any setting with the reference"
                              : "Every setting differs from the reference by more than its seeds explain",
          out);
  }
  fputs(".\n", out);
}

char *tal_study_sentence(const tal_study_summary *summary) {
  char *text = NULL;
  size_t size;
  FILE *out = tal_text_begin(&text, &size);
  put_sentence(out, summary);
  tal_text_end(out);
  return text;
}

// ---- the rest of the report ----

static int label_width(const tal_study *study) {
  size_t width = 7;
  for (size_t k = 0; k < study->setting_count; k++)
    if (strlen(study->settings[k].label) > width)
      width = strlen(study->settings[k].label);
  return width > 60 ? 60 : (int)width;
}

static void put_metric(FILE *out, const tal_study_summary *s, size_t m) {
  const tal_study *study = s->study;
  const int width = label_width(study);
  char beyond[40];
  snprintf(beyond, sizeof beyond, "excl. %g %%", 100 * study->confidence);
  fprintf(out, "\n%s\n  %-*s %9s %4s %12s %9s %12s %9s %12s\n", study->metrics[m].name, width, "setting", "CPU s", "n",
          "mean", "+-", "error", "+-", beyond);
  for (size_t k = 0; k < study->setting_count; k++) {
    const tal_study_cell *cell = tal_study_cell_of(s, k, m);
    fprintf(out, "%c %-*.60s %9.3g %4zu %12.5g %9.2g ", cell->frontier ? '*' : ' ', width, study->settings[k].label,
            s->lines[k].cpu_time, cell->estimate.n, cell->estimate.mean, cell->estimate.error);
    if (k == study->reference_setting)
      fputs("   reference\n", out);
    else
      fprintf(out, "%12.3g %9.2g %12.2g\n", cell->difference.mean, cell->difference.error, cell->difference.bound);
  }
}

static void put_lost(FILE *out, const tal_study_summary *s) {
  for (size_t r = 0; r < s->study->run_count; r++) {
    const tal_study_result *result = &s->results[r];
    if (result->state.status != TAL_RUN_DONE)
      fprintf(out, "%-10s %s: %s\n", tal_study_status_name(result->state.status), s->study->runs[r].id,
              result->state.reason);
    else if (*result->note)
      fprintf(out, "%-10s %s: %s\n", "note", s->study->runs[r].id, result->note);
  }
}

char *tal_study_report(const tal_study_summary *summary) {
  const tal_study *study = summary->study;
  char *text = NULL;
  size_t size;
  FILE *out = tal_text_begin(&text, &size);
  fprintf(out, "%s: %zu of %zu runs done, %zu failed, %zu unfinished or missing; reference %s\n", study->name,
          summary->done, study->run_count, summary->failed, summary->unfinished,
          study->settings[study->reference_setting].label);
  put_lost(out, summary);
  for (size_t m = 0; m < study->metric_count; m++)
    put_metric(out, summary, m);
  fputs("(* on the frontier of error against cost; +- one standard error; excl.: a larger bias is excluded)\n\n", out);
  put_sentence(out, summary);
  tal_text_end(out);
  return text;
}
