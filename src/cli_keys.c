// talus keys: the schema for people (text, Markdown), editors (JSON Schema) and shells (bash completion).
#include "cli.h"
#include "scene_keys.h"
#include "scene_value.h"

#include <string.h>

static void print_commands(const char *separator) {
  for (const tal_command *c = tal_cli_commands(); c->name; c++)
    printf("%s%s", c->name, separator);
}

// A script to source: commands, options, scene files and folders, and after --set the keys of the schema.
static void print_bash(void) {
  printf("# bash completion for talus: source <(talus keys --bash)\n_talus_keys='\n");
  tal_keys_words(stdout);
  printf("'\n_talus() {\n"
         "  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]}\n"
         "  COMPREPLY=()\n"
         "  if ((COMP_CWORD == 1)); then\n"
         "    COMPREPLY=($(compgen -W \"");
  print_commands(" ");
  printf("--help --version\" -- \"$cur\"))\n"
         "  elif [[ $prev == --set ]]; then\n"
         "    COMPREPLY=($(compgen -S = -W \"$_talus_keys\" -- \"$cur\"))\n"
         "    compopt -o nospace 2>/dev/null\n"
         "  elif [[ $prev == -o || $prev == --out || ${COMP_WORDS[1]} == plot || ${COMP_WORDS[1]} == verify ]]; then\n"
         "    COMPREPLY=($(compgen -d -- \"$cur\"))\n"
         "  elif [[ ${COMP_WORDS[1]} == keys ]]; then\n"
         "    COMPREPLY=($(compgen -W \"--json --markdown --bash $_talus_keys\" -- \"$cur\"))\n"
         "  elif [[ $cur == -* ]]; then\n"
         "    COMPREPLY=($(compgen -W \"-o -t --set --resume -q --no-figures --help\" -- \"$cur\"))\n"
         "  else\n"
         "    COMPREPLY=($(compgen -f -X '!*.y*ml' -- \"$cur\") $(compgen -d -- \"$cur\"))\n"
         "  fi\n"
         "}\ncomplete -F _talus talus\n");
}

static int refuse(const char *word, const char *what) {
  char quoted[84];
  tal_quote(word, 80, quoted, sizeof quoted);
  fprintf(stderr, "talus keys: %s: %s\n", quoted, what);
  return TAL_BAD_INPUT;
}

static int unknown_key(const char *word) {
  char near[128], what[200];
  tal_keys_nearest(word, near, sizeof near);
  snprintf(what, sizeof what, "%s%s%s",
           *near ? "no such key; did you mean " : "no such key; accepted: see `talus keys`", near, *near ? "?" : "");
  return refuse(word, what);
}

static int print_help(void) {
  const tal_command *command = tal_cli_command_find("keys");
  printf("usage: talus keys %s\n%s\n\n", command->synopsis, command->help);
  printf("  KEY          one key (material.young), a group (contact) or a kind (stages.compress)\n"
         "  --json       JSON Schema for editors\n"
         "  --markdown   table for a page\n"
         "  --bash       completion script: source <(talus keys --bash)\n");
  return TAL_OK;
}

int tal_cli_keys(int argc, char **argv) {
  const char *word = argc ? argv[0] : "";
  if (argc > 1)
    return refuse(argv[1], "is one word too many; accepted: one KEY, --json, --markdown or --bash");
  if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0)
    return print_help();
  if (strcmp(word, "--json") == 0)
    tal_keys_json(stdout);
  else if (strcmp(word, "--markdown") == 0)
    tal_keys_markdown(stdout);
  else if (strcmp(word, "--bash") == 0)
    print_bash();
  else if (*word == '-')
    return refuse(word, "is not an option here; accepted: --json, --markdown, --bash");
  else if (!tal_keys_print(stdout, word))
    return unknown_key(word);
  return TAL_OK;
}
