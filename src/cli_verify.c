// talus verify DIR: one line per finding on stdout, then what is sound. Exit 0, 4 when something is damaged, 2 when DIR
// holds no run.
#include "cli.h"

#include "verify.h"

static void print_finding(void *context, bool damage, const char *sentence) {
  (void)context;
  printf("%s: %s\n", damage ? "damaged" : "note", sentence);
}

int tal_cli_verify(int argc, char **argv) {
  tal_cli_options options;
  int exit_code;
  if (!tal_cli_options_parse(&options, "verify", 0, "DIR", argc, argv, &exit_code))
    return exit_code;
  tal_verify_counts counts;
  tal_error err;
  tal_status status = tal_verify(options.argument, print_finding, NULL, &counts, &err);
  if (status == TAL_BAD_INPUT) {
    tal_cli_print_error(status, &err);
  } else {
    printf("%s: %zu rows, %zu frames, %zu checkpoints sound, %zu damaged\n", options.argument, counts.rows,
           counts.frames, counts.checkpoints, counts.damages);
  }
  tal_cli_options_clear(&options);
  return (int)status;
}
