// talus impact SCENE.yaml [-o DIR] [--set K=V]... [--no-figures]: restitution and contact time of two mean grains over
// the damping, as a table and a picture.
#include "cli.h"

#include "figures_impact.h"
#include "files.h"

static int write_study(const tal_scene *scene, const char *folder, bool figure, tal_error *err) {
  tal_sim *sim;
  tal_status status = tal_sim_create(&sim, scene, err);
  tal_impact_study study;
  if (status == TAL_OK)
    status = tal_impact_study_of(scene, &sim->constants, &study, err);
  tal_sim_free(sim);
  if (status == TAL_OK)
    status = tal_folder_create(folder, err);
  if (status == TAL_OK)
    status = tal_impact_study_table(scene, &study, folder, err);
  if (status == TAL_OK)
    printf("%s/impact.csv\n", folder);
  if (status == TAL_OK && figure && (status = tal_impact_study_draw(scene, &study, folder, err)) == TAL_OK)
    printf("%s/impact.png\n", folder);
  return status;
}

int tal_cli_impact(int argc, char **argv) {
  tal_cli_options options;
  int exit_code;
  if (!tal_cli_options_parse(&options, "impact", TAL_CLI_OUT | TAL_CLI_SET | TAL_CLI_FIGURES, "SCENE.yaml", argc, argv,
                             &exit_code))
    return exit_code;
  tal_scene scene;
  tal_scene_errors errors;
  if (tal_scene_load(&scene, options.argument, options.sets, options.set_count, &errors)) {
    tal_cli_options_clear(&options);
    return tal_cli_print_errors(&errors);
  }
  tal_error err;
  exit_code = write_study(&scene, options.out ? options.out : scene.name, options.figures, &err);
  if (exit_code)
    fprintf(stderr, "%s%s\n", exit_code == TAL_BAD_INPUT ? "" : "talus: ", err.text);
  tal_scene_clear(&scene);
  tal_cli_options_clear(&options);
  return exit_code;
}
