// study.csv and runs.csv (docs/formats.md).
#include "files.h"
#include "study_merge.h"
#include "study_words.h"

#include <math.h>
#include <stdlib.h>

static void put_number(FILE *out, double value) {
  fputc(',', out);
  tal_words_number(out, value);
}

static void put_dial_names(FILE *out, const tal_study *study) {
  for (size_t d = 0; d < study->dial_count; d++) {
    fputc(',', out);
    tal_words_csv(out, study->dials[d].name);
  }
}

static void put_setting(FILE *out, const tal_study *study, const tal_study_setting *setting) {
  tal_words_csv(out, setting->label);
  for (size_t d = 0; d < study->dial_count; d++) {
    fputc(',', out);
    if (setting->value[d] != TAL_STUDY_OWN)
      tal_words_csv(out, study->dials[d].value[setting->value[d]].label);
  }
}

static void put_cell(FILE *out, const tal_study_summary *s, size_t k, size_t m) {
  const tal_study *study = s->study;
  const tal_study_cell *cell = tal_study_cell_of(s, k, m);
  const tal_study_line *line = &s->lines[k];
  const tal_difference *d = &cell->difference;
  const bool reference = k == study->reference_setting;
  const double mean = tal_study_cell_of(s, study->reference_setting, m)->estimate.mean;
  put_setting(out, study, &study->settings[k]);
  fputc(',', out);
  tal_words_csv(out, study->metrics[m].name);
  fprintf(out, ",%s,%zu", reference ? "yes" : "no", cell->estimate.n);
  put_number(out, cell->estimate.mean);
  put_number(out, cell->estimate.error);
  put_number(out, d->mean);
  put_number(out, d->error);
  put_number(out, d->mean / fabs(mean));
  fprintf(out, ",%s,%zu", d->paired ? "paired" : "means", d->n);
  put_number(out, d->freedom);
  put_number(out, d->bound);
  put_number(out, tal_study_limit(s, m));
  fprintf(out, ",%s", cell->frontier ? "yes" : "no");
  put_number(out, line->cpu_time);
  put_number(out, line->grain_steps);
  fprintf(out, ",%zu,%zu,%zu,", line->done, line->failed, line->unfinished);
  tal_words_csv(out, line->first_not_done ? line->first_not_done->state.reason : "");
  fputc('\n', out);
}

static void put_study(FILE *out, const tal_study_summary *s) {
  fputs("setting", out);
  put_dial_names(out, s->study);
  fputs(",metric,reference,n,mean,standard_error,error,error_standard_error,error_relative,difference,n_difference,"
        "freedom,excluded_beyond,within,frontier,cpu_time[s],grain_steps,done,failed,unfinished,reason\n",
        out);
  for (size_t m = 0; m < s->study->metric_count; m++)
    for (size_t k = 0; k < s->study->setting_count; k++)
      put_cell(out, s, k, m);
}

static void put_runs(FILE *out, const tal_study_summary *s) {
  const tal_study *study = s->study;
  fputs("id,setting", out);
  put_dial_names(out, study);
  fputs(",seed,status,cpu_time[s],grain_steps", out);
  for (size_t m = 0; m < study->metric_count; m++) {
    fputc(',', out);
    tal_words_csv(out, study->metrics[m].name);
  }
  fputs(",reason\n", out);
  for (size_t r = 0; r < study->run_count; r++) {
    const tal_study_run *run = &study->runs[r];
    const tal_study_result *result = &s->results[r];
    fprintf(out, "%s,", run->id);
    put_setting(out, study, &study->settings[run->setting]);
    fprintf(out, ",%lld,%s", (long long)run->seed, tal_study_status_name(result->state.status));
    put_number(out, result->state.cpu_time);
    put_number(out, result->state.grain_steps);
    for (size_t m = 0; m < study->metric_count; m++)
      put_number(out, s->values[r * study->metric_count + m]);
    fputc(',', out);
    tal_words_csv(out, *result->state.reason ? result->state.reason : result->note);
    fputc('\n', out);
  }
}

static tal_status write_table(const tal_study_summary *s, const char *name,
                              void (*put)(FILE *, const tal_study_summary *), tal_error *err) {
  char path[TAL_PATH_SIZE], *text = NULL;
  size_t size;
  FILE *out = tal_text_begin(&text, &size);
  put(out, s);
  tal_text_end(out);
  tal_file_path(path, s->dir, name);
  tal_status status = tal_file_replace(path, NULL, text, size, err);
  free(text);
  return status;
}

tal_status tal_study_tables_write(const tal_study_summary *summary, tal_error *err) {
  tal_status status = write_table(summary, "runs.csv", put_runs, err);
  return status ? status : write_table(summary, "study.csv", put_study, err);
}
