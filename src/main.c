// The program: finds the command and hands over. Everything else is in cli_*.c.
#include "cli.h"
#include "scene_value.h"

#include <string.h>

static int no_command(const char *word) {
  char quoted[48];
  tal_quote(word, 40, quoted, sizeof quoted);
  fprintf(stderr, "talus: %s: unknown %s; accepted: ", quoted, *word == '-' ? "option" : "command");
  for (const tal_command *c = tal_cli_commands(); c->name; c++)
    fprintf(stderr, "%s, ", c->name);
  fprintf(stderr, "--help, --version\n");
  return TAL_BAD_INPUT;
}

static int dispatch(int argc, char **argv) {
  if (argc < 2) {
    tal_cli_usage(stderr);
    return TAL_BAD_INPUT;
  }
  if (strcmp(argv[1], "--version") == 0) {
    printf("talus %s\n", TAL_VERSION);
    return TAL_OK;
  }
  if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
    tal_cli_usage(stdout);
    return TAL_OK;
  }
  const tal_command *command = tal_cli_command_find(argv[1]);
  return command ? command->run(argc - 2, argv + 2) : no_command(argv[1]);
}

int main(int argc, char **argv) {
  int code = dispatch(argc, argv);
  if ((fflush(stdout) || ferror(stdout)) && code == TAL_OK) {
    fprintf(stderr, "talus: standard output: cannot be written\n");
    return TAL_IO;
  }
  return code;
}
