// The plan on disk: DIR/plan.csv, one line per run, and DIR/commands.txt, one command per line for any scheduler. A
// plan may grow (more seeds, values, metrics), but a run that is there keeps its scene.
#include "figures_data.h"
#include "files.h"
#include "study.h"
#include "study_words.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void tal_study_folder(char *path, size_t size, const char *dir, const tal_study_run *run) {
  snprintf(path, size, "%s/runs/%s", dir, run->id);
}

char **tal_study_words(const tal_study *study, const tal_study_run *run, const char *dir) {
  const tal_study_sets *own = &study->settings[run->setting].sets;
  const size_t count = study->common.count + own->count, most = 2 * count + 14;
  char **words = tal_alloc(most, sizeof *words), folder[TAL_PATH_SIZE], seed[32];
  size_t n = 0;
  tal_study_folder(folder, sizeof folder, dir, run);
  snprintf(seed, sizeof seed, "seed=%lld", (long long)run->seed);
  const char *const head[] = {"run", study->scene_path, "-o", folder, "-t", "1", "-q", "--no-figures"};
  for (size_t k = 0; k < sizeof head / sizeof *head; k++)
    words[n++] = tal_strdup(head[k]);
  if (study->from) {
    words[n++] = tal_strdup("--from");
    words[n++] = tal_strdup(study->from);
  }
  for (size_t k = 0; k <= count; k++) {
    words[n++] = tal_strdup("--set");
    words[n++] = tal_strdup(k < study->common.count ? study->common.item[k].text
                            : k < count             ? own->item[k - study->common.count].text
                                                    : seed);
  }
  return words;
}

void tal_study_words_free(char **words) {
  for (size_t k = 0; words[k]; k++)
    free(words[k]);
  free(words);
}

static void put_command(FILE *out, const tal_study *study, const tal_study_run *run, const char *dir) {
  char **words = tal_study_words(study, run, dir);
  fputs("talus", out);
  for (size_t k = 0; words[k]; k++) {
    fputc(' ', out);
    tal_words_shell(out, words[k]);
  }
  tal_study_words_free(words);
}

static char *commands_text(const tal_study *study, const char *dir, size_t *size) {
  char *text = NULL;
  FILE *out = tal_text_begin(&text, size);
  for (size_t r = 0; r < study->run_count; r++) {
    put_command(out, study, &study->runs[r], dir);
    fputc('\n', out);
  }
  tal_text_end(out);
  return text;
}

static char *plan_text(const tal_study *study, const char *dir, size_t *size) {
  char *text = NULL;
  FILE *out = tal_text_begin(&text, size);
  fputs("id,scene_hash,seed,nominal_steps,setting", out);
  for (size_t d = 0; d < study->dial_count; d++) {
    fputc(',', out);
    tal_words_csv(out, study->dials[d].name);
  }
  fputs(",command\n", out);
  for (size_t r = 0; r < study->run_count; r++) {
    const tal_study_run *run = &study->runs[r];
    const tal_study_setting *setting = &study->settings[run->setting];
    fprintf(out, "%s,%016" PRIx64 ",%lld,%.0f,", run->id, run->scene, (long long)run->seed, run->steps);
    tal_words_csv(out, setting->label);
    for (size_t d = 0; d < study->dial_count; d++) {
      fputc(',', out);
      if (setting->value[d] != TAL_STUDY_OWN)
        tal_words_csv(out, study->dials[d].value[setting->value[d]].label);
    }
    fputc(',', out);
    char *command = NULL;
    size_t length;
    FILE *line = tal_text_begin(&command, &length);
    put_command(line, study, run, dir);
    tal_text_end(line);
    tal_words_csv(out, command);
    free(command);
    fputc('\n', out);
  }
  tal_text_end(out);
  return text;
}

// ---- the plan that is there ----

// The scene's hash in the line of a run: "ID,HASH,...".
static bool line_of_run(const char *text, const char *id, uint64_t *hash) {
  const size_t length = strlen(id);
  for (const char *line = text; line; line = strchr(line, '\n')) {
    line += *line == '\n';
    if (strncmp(line, id, length) != 0 || line[length] != ',')
      continue;
    *hash = strtoull(line + length + 1, NULL, 16);
    return true;
  }
  return false;
}

static tal_status check_old_plan(const tal_study *study, const char *path, tal_error *err) {
  unsigned char *text;
  size_t size;
  if (!tal_file_exists(path))
    return TAL_OK;
  tal_status status = tal_file_read(path, &text, &size, err);
  if (status)
    return status;
  text = tal_grow(text, size, size + 1, 1);
  for (size_t r = 0; r < study->run_count && !status; r++) {
    uint64_t hash;
    if (line_of_run((const char *)text, study->runs[r].id, &hash) && hash != study->runs[r].scene)
      status = tal_fail(err, TAL_BAD_INPUT,
                        "%s: run %s was planned with another scene: the study or its scene has changed; accepted: "
                        "another folder, or remove this one",
                        path, study->runs[r].id);
  }
  free(text);
  return status;
}

tal_status tal_study_plan_write(const tal_study *study, const char *dir, tal_error *err) {
  char plan[TAL_PATH_SIZE], commands[TAL_PATH_SIZE], runs[TAL_PATH_SIZE];
  tal_file_path(plan, dir, "plan.csv");
  tal_file_path(commands, dir, "commands.txt");
  tal_file_path(runs, dir, "runs");
  tal_status status = check_old_plan(study, plan, err);
  if (status == TAL_OK)
    status = tal_folder_create(runs, err);
  size_t size;
  char *text = plan_text(study, dir, &size);
  if (status == TAL_OK)
    status = tal_file_replace(plan, NULL, text, size, err);
  free(text);
  text = commands_text(study, dir, &size);
  if (status == TAL_OK)
    status = tal_file_replace(commands, NULL, text, size, err);
  free(text);
  return status;
}
