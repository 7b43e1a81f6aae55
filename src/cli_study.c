// talus study STUDY.yaml -o DIR [-t CORES] [--set K=V]... [--plan | --merge] [-q]
#include "cli.h"

#include "files.h"
#include "study_merge.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int print_status(tal_status status, const tal_error *err) {
  if (status == TAL_BAD_INPUT) // the sentence names file and key itself
    fprintf(stderr, "%s\n", err->text);
  else if (status)
    tal_cli_print_error(status, err);
  return (int)status;
}

// Runs that failed and runs that are not there, on stderr. TAL_INVALID when one failed.
static tal_status name_lost(const tal_study_summary *summary) {
  for (size_t r = 0; r < summary->study->run_count; r++) {
    const tal_study_state *state = &summary->results[r].state;
    if (state->status == TAL_RUN_FAILED)
      fprintf(stderr, "talus: run %s failed: %s\n", summary->study->runs[r].id, state->reason);
  }
  if (summary->unfinished)
    fprintf(stderr, "talus: %zu of %zu runs are missing or unfinished: see %s/runs.csv\n", summary->unfinished,
            summary->study->run_count, summary->dir);
  return summary->failed ? TAL_INVALID : TAL_OK;
}

static tal_status write_report(const tal_study_summary *summary, bool quiet, tal_error *err) {
  char path[TAL_PATH_SIZE];
  tal_file_path(path, summary->dir, "study.txt");
  char *report = tal_study_report(summary), *sentence = tal_study_sentence(summary);
  tal_status status = tal_file_replace(path, NULL, report, strlen(report), err);
  fputs(quiet ? sentence : report, stdout);
  free(report);
  free(sentence);
  return status;
}

static tal_status merge(const tal_study *study, const char *dir, const tal_cli_options *options, tal_error *err) {
  tal_study_summary summary;
  tal_study_summary_read(&summary, study, dir);
  tal_status status = tal_study_tables_write(&summary, err);
  if (status == TAL_OK)
    status = write_report(&summary, options->quiet, err);
  int count = 0;
  tal_error figures = {""};
  if (status == TAL_OK && options->figures && tal_study_figures_draw(&summary, &count, &figures))
    status = tal_fail(err, TAL_IO, "figures not drawn: %.900s", figures.text);
  tal_status lost = name_lost(&summary);
  tal_study_summary_clear(&summary);
  return status ? status : lost;
}

static tal_status run(const tal_study *study, const char *dir, const tal_cli_options *options, tal_error *err) {
  char program[TAL_PATH_SIZE];
  tal_status status = tal_program_path(program, sizeof program, err);
  if (status)
    return status;
  const tal_study_options plan = {dir, program, options->threads, options->quiet};
  return tal_study_run_all(study, &plan, err);
}

// There must be a plan to merge by.
static tal_status check_merge(const char *dir, const tal_cli_options *options, tal_error *err) {
  char plan[TAL_PATH_SIZE];
  tal_file_path(plan, dir, "plan.csv");
  if (options->merge && options->plan)
    return tal_fail(err, TAL_BAD_INPUT, "talus study: --merge: stands beside --plan; accepted: one of the two");
  if (options->merge && !tal_file_exists(plan))
    return tal_fail(err, TAL_BAD_INPUT, "talus study: --merge: %s holds no plan.csv; accepted: the folder of a study",
                    dir);
  return TAL_OK;
}

static int work(const tal_study *study, const char *dir, const tal_cli_options *options) {
  tal_error err = {""};
  tal_status status = check_merge(dir, options, &err);
  if (status == TAL_OK)
    status = tal_study_plan_write(study, dir, &err);
  if (status)
    return print_status(status, &err);
  if (options->plan) {
    printf("%s: %zu runs of %zu settings planned: %s/plan.csv, %s/commands.txt\n", study->name, study->run_count,
           study->setting_count, dir, dir);
    return TAL_OK;
  }
  if (!options->merge)
    status = run(study, dir, options, &err);
  if (status == TAL_INTERRUPTED) {
    fprintf(stderr, "talus: interrupted; the same command goes on\n");
    return status;
  }
  if (status)
    return print_status(status, &err);
  status = merge(study, dir, options, &err);
  return status == TAL_INVALID ? (int)status : print_status(status, &err);
}

int tal_cli_study(int argc, char **argv) {
  tal_cli_options options;
  int exit_code;
  const unsigned accepted =
      TAL_CLI_OUT | TAL_CLI_THREADS | TAL_CLI_SET | TAL_CLI_QUIET | TAL_CLI_FIGURES | TAL_CLI_STUDY;
  if (!tal_cli_options_parse(&options, "study", accepted, "STUDY.yaml", argc, argv, &exit_code))
    return exit_code;
  tal_study study;
  tal_scene_errors errors;
  if (tal_study_load(&study, options.argument, options.sets, options.set_count, &errors)) {
    tal_cli_options_clear(&options);
    return tal_cli_print_errors(&errors);
  }
  exit_code = work(&study, options.out ? options.out : study.name, &options);
  tal_study_clear(&study);
  tal_cli_options_clear(&options);
  return exit_code;
}
