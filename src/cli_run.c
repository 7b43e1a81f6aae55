// talus run SCENE.yaml [-o DIR] [-t THREADS] [--set K=V]... [--resume] [--from DIR] [-q] [--no-figures]
#include "cli.h"

#include "ensemble.h"
#include "figures.h"
#include "files.h"
#include "run.h"

#include <math.h>

static void print_summary(const tal_run_result *result, const char *dir) {
  const tal_row *row = &result->row;
  printf("%s: t = %g s, %.0f steps, %.3g s, %.3g million grain-steps/s\n", dir, row->time, row->step, result->wall_time,
         1e-6 * result->grain_steps_per_second);
  if (isfinite(row->sigma_xx))
    printf(
        "  stress      sigma_xx %.5g Pa, sigma_yy %.5g Pa; from boundary forces %.5g, %.5g Pa, inertia %.2g, %.2g Pa\n",
        row->sigma_xx, row->sigma_yy, row->sigma_xx_boundary, row->sigma_yy_boundary, row->sigma_xx_inertia,
        row->sigma_yy_inertia);
  if (row->axial_strain > 0)
    printf("  strain      axial %.4g, volumetric %.4g (dilation positive)\n", row->axial_strain,
           row->volumetric_strain);
  printf("  energy      residual %.2g of the total work; friction %.4g J, damping %.4g J\n", row->energy_residual,
         row->dissipated_friction, row->dissipated_damping);
  printf("  accuracy    dt/dt_crit %.3g", row->dt_ratio);
  if (isfinite(row->phi))
    printf(", phi %.3g, psi %.3g", row->phi, row->psi);
  printf("\n");
}

static int draw_figures(const char *dir) {
  tal_error err;
  int count = 0;
  tal_status status = tal_figures_draw(dir, &count, &err);
  if (status) {
    fprintf(stderr, "talus: figures not drawn: %s\n", err.text);
    return status;
  }
  printf("  figures     %d in %s/figures\n", count, dir);
  return TAL_OK;
}

static int finish(tal_status status, const tal_run_result *result, const tal_cli_options *options, const char *dir,
                  const tal_error *err) {
  switch (status) {
  case TAL_OK:
    if (result->already_done) {
      printf("%s: the run is complete, nothing to resume\n", dir);
      return TAL_OK;
    }
    if (!options->quiet)
      print_summary(result, dir);
    return options->figures ? draw_figures(dir) : TAL_OK;
  case TAL_INTERRUPTED:
    fprintf(stderr, "talus: interrupted; go on with: talus run %s -o %s --resume\n", options->argument, dir);
    return status;
  case TAL_INVALID:
    fprintf(stderr, "talus: %s", err->text);
    if (result->checkpoint)
      fprintf(stderr, "; last good checkpoint: %s/checkpoint.h5", dir);
    fprintf(stderr, "\n");
    return status;
  case TAL_IO:
    fprintf(stderr, "talus: %s", err->text);
    if (result->checkpoint)
      fprintf(stderr, "; go on from the last checkpoint with: talus run %s -o %s --resume", options->argument, dir);
    fprintf(stderr, "\n");
    return status;
  case TAL_BAD_INPUT: // the sentence names file, line and key itself
    fprintf(stderr, "%s\n", err->text);
    return status;
  default:
    return tal_cli_print_error(status, err);
  }
}

// The runs of many forced grains, once the state they begin from is there.
static int make_ensemble(const tal_scene *scene, const tal_cli_options *options, const char *dir) {
  char program[TAL_PATH_SIZE];
  tal_error err = {""};
  tal_ensemble_result result;
  tal_status status = tal_program_path(program, sizeof program, &err);
  const tal_ensemble_options how = {dir, program, options->sets, options->set_count, options->threads, options->quiet};
  if (status == TAL_OK)
    status = tal_ensemble_run(scene, &how, &result, &err);
  if (status == TAL_INTERRUPTED)
    fprintf(stderr, "talus: interrupted; go on with: talus run %s -o %s --resume\n", options->argument, dir);
  else if (status == TAL_BAD_INPUT)
    fprintf(stderr, "%s\n", err.text);
  else if (status)
    tal_cli_print_error(status, &err);
  if (status)
    return status;
  printf("%s/runs: %zu of %zu forced grains done\n", dir, result.grains - result.failed - result.unfinished,
         result.grains);
  if (result.failed)
    fprintf(stderr, "talus: %zu forced grains failed, the first is %s\n", result.failed, result.reason);
  return result.failed ? TAL_INVALID : TAL_OK;
}

static int run_all(const tal_scene *scene, const tal_cli_options *options, const char *dir) {
  const bool many = tal_ensemble_asked(scene);
  const tal_scene confined = many ? tal_ensemble_confined(scene) : *scene;
  const tal_run_options plan = {dir, options->threads, options->resume, options->quiet, options->from};
  tal_run_result result = {0};
  tal_error err = {""};
  tal_status status = many ? tal_ensemble_check(scene, &err) : TAL_OK;
  if (status == TAL_OK)
    status = tal_run_scene(&confined, &plan, &result, &err);
  int exit_code =
      many && status == TAL_OK && result.already_done ? TAL_OK : finish(status, &result, options, dir, &err);
  return many && exit_code == TAL_OK ? make_ensemble(scene, options, dir) : exit_code;
}

int tal_cli_run(int argc, char **argv) {
  tal_cli_options options;
  int exit_code;
  const unsigned accepted =
      TAL_CLI_OUT | TAL_CLI_THREADS | TAL_CLI_SET | TAL_CLI_RESUME | TAL_CLI_QUIET | TAL_CLI_FIGURES | TAL_CLI_FROM;
  if (!tal_cli_options_parse(&options, "run", accepted, "SCENE.yaml", argc, argv, &exit_code))
    return exit_code;
  tal_scene scene;
  tal_scene_errors errors;
  if (tal_scene_load(&scene, options.argument, options.sets, options.set_count, &errors)) {
    tal_cli_options_clear(&options);
    return tal_cli_print_errors(&errors);
  }
  const char *dir = options.out ? options.out : scene.name;
  exit_code = run_all(&scene, &options, dir);
  tal_scene_clear(&scene);
  tal_cli_options_clear(&options);
  return exit_code;
}
