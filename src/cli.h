// The program's commands and what they share. A command is one line of the table in cli_options.c and one file
// cli_<name>.c.
#ifndef TAL_CLI_H
#define TAL_CLI_H

#include "scene.h"
#include <stdbool.h>
#include <stdio.h>

#ifndef TAL_VERSION
#define TAL_VERSION "unknown"
#endif

// Each gets the words after the command word (argv[0] is the first of them) and returns the exit code.
int tal_cli_run(int argc, char **argv);
int tal_cli_check(int argc, char **argv);
int tal_cli_impact(int argc, char **argv);
int tal_cli_plot(int argc, char **argv);
int tal_cli_verify(int argc, char **argv);
int tal_cli_keys(int argc, char **argv);
int tal_cli_study(int argc, char **argv);
int tal_cli_measure(int argc, char **argv);

typedef struct tal_command {
  const char *name;
  const char *synopsis; // what follows the name
  const char *help;     // one line
  int (*run)(int argc, char **argv);
} tal_command;

// Ended by a NULL name.
const tal_command *tal_cli_commands(void);
// NULL if unknown.
const tal_command *tal_cli_command_find(const char *name);
// The list of commands, for `talus --help` and for an empty command line.
void tal_cli_usage(FILE *out);

// Options a command may accept, or'ed together.
typedef enum tal_cli_accept {
  TAL_CLI_OUT = 1,      // -o, --out DIR
  TAL_CLI_THREADS = 2,  // -t, --threads N
  TAL_CLI_SET = 4,      // --set KEY=VALUE, repeated
  TAL_CLI_RESUME = 8,   // --resume
  TAL_CLI_QUIET = 16,   // -q, --quiet
  TAL_CLI_FIGURES = 32, // --no-figures
  TAL_CLI_STUDY = 64,   // --plan, --merge
  TAL_CLI_MEASURE = 128 // --at, --window, --region, --over, --angle, --export
} tal_cli_accept;

typedef struct tal_cli_options {
  const char *argument; // the one word that is no option: SCENE or DIR
  const char *out;      // NULL when not given
  int threads;          // 0 when not given
  const char **sets;    // owned list of KEY=VALUE
  size_t set_count;
  bool resume, quiet;
  bool figures;                                    // true unless --no-figures
  bool plan, merge;                                // study: only write the plan, only merge
  const char *at, *window, *region, *over, *angle; // measure; NULL when not given
  const char **exports;                            // owned list of fields
  size_t export_count;
} tal_cli_options;

// Parses the words after the command `name`, which accepts the options of `accepted` and needs exactly one argument,
// called `argument` in messages ("SCENE.yaml", "DIR"). Returns true to go on (then tal_cli_options_clear in the end);
// false when the command is over: help was asked for, or a message names the wrong option on stderr; *exit_code is set.
bool tal_cli_options_parse(tal_cli_options *options, const char *name, unsigned accepted, const char *argument,
                           int argc, char **argv, int *exit_code);
void tal_cli_options_clear(tal_cli_options *options);

// Each message on its own line of stderr. Returns TAL_BAD_INPUT.
int tal_cli_print_errors(const tal_scene_errors *errors);
// "talus: <sentence>" on stderr; returns `status`.
int tal_cli_print_error(tal_status status, const tal_error *err);

#endif
