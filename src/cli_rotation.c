// talus rotation DIR [--grain ID] [--frame N] [--network N] [--since N] [--reach DIAMETERS] [--no-figures]: tables and
// figures in DIR/rotation.
#include "cli.h"

#include "figures_rotation.h"
#include "rotation.h"

#include <stdlib.h>

static tal_status work(const tal_cli_options *options, tal_error *err) {
  const tal_rotation_options how = {options->grain, options->frame, options->network, options->since, options->reach};
  tal_rotations all;
  tal_status status = tal_rotations_read(&all, options->argument, &how, err);
  if (status)
    return status;
  char *text = tal_rotations_text(&all, &how);
  fputs(text, stdout);
  free(text);
  status = tal_rotations_write(&all, options->argument, err);
  if (status == TAL_OK && options->figures)
    status = tal_rotation_figures(&all, options->argument, &how, err);
  tal_rotations_clear(&all);
  return status;
}

int tal_cli_rotation(int argc, char **argv) {
  tal_cli_options options;
  int exit_code;
  if (!tal_cli_options_parse(&options, "rotation", TAL_CLI_ROTATION | TAL_CLI_FIGURES, "DIR", argc, argv, &exit_code))
    return exit_code;
  tal_error err = {""};
  tal_status status = work(&options, &err);
  if (status)
    tal_cli_print_error(status, &err);
  tal_cli_options_clear(&options);
  return status;
}
