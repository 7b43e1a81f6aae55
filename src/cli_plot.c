// talus plot DIR: draws every figure that the data of a run allow and prints the files made, one per line.
#include "cli.h"

#include "figures.h"

#include <signal.h>

static void print_path(void *user, const char *path) {
  fprintf(user, "%s\n", path);
  fflush(user);
}

int tal_cli_plot(int argc, char **argv) {
  tal_cli_options options;
  int exit_code;
  if (!tal_cli_options_parse(&options, "plot", 0, "DIR", argc, argv, &exit_code))
    return exit_code;
  signal(SIGINT, SIG_IGN); // Ctrl-C ends gnuplot, which comes back as TAL_INTERRUPTED with the temporary files removed
  tal_error err;
  int count;
  tal_status status = tal_figures_draw_each(options.argument, print_path, stdout, &count, &err);
  if (status)
    tal_cli_print_error(status, &err);
  else if (count == 0)
    fprintf(stderr, "talus: %s: nothing to draw yet\n", options.argument);
  tal_cli_options_clear(&options);
  return (int)status;
}
