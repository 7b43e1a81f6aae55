// Command table and the options that commands share.
#include "cli.h"

#include "scene_value.h"

#include <getopt.h>
#include <stdlib.h>
#include <string.h>

static const tal_command commands[] = {
    {"run", "SCENE.yaml [-o DIR] [-t THREADS] [--set KEY=VALUE]... [--resume] [-q] [--no-figures]",
     "run a scene; series, fields, checkpoints and figures go to DIR", tal_cli_run},
    {"check", "SCENE.yaml [--set KEY=VALUE]...", "validate a scene and print what a run of it would do", tal_cli_check},
    {"impact", "SCENE.yaml [-o DIR] [--set KEY=VALUE]... [--no-figures]",
     "restitution and contact time of two mean grains over the damping: impact.csv, impact.png", tal_cli_impact},
    {"measure", "DIR [-o OUT] [--at WHEN] [--window A:B] [--region WHERE] [--over STRAIN] [--export FIELD]...",
     "force chains, fabric, force statistics, voids, bands of the stored fields: tables and figures", tal_cli_measure},
    {"plot", "DIR", "draw again every figure the data of a run allows", tal_cli_plot},
    {"study", "STUDY.yaml [-o DIR] [-t CORES] [--set KEY=VALUE]... [--plan | --merge] [-q] [--no-figures]",
     "turn one or two dials of a scene, over seeds; error against cost goes to DIR", tal_cli_study},
    {"verify", "DIR", "check the files of a run against their checksums and each other", tal_cli_verify},
    {"keys", "[KEY] [--json | --markdown | --bash]", "every scene key: type, unit, range, default, meaning",
     tal_cli_keys},
    {NULL, NULL, NULL, NULL}};

const tal_command *tal_cli_commands(void) {
  return commands;
}

const tal_command *tal_cli_command_find(const char *name) {
  for (const tal_command *c = commands; c->name; c++)
    if (strcmp(c->name, name) == 0)
      return c;
  return NULL;
}

void tal_cli_usage(FILE *out) {
  fprintf(out, "usage: talus COMMAND ...\n\n");
  for (const tal_command *c = commands; c->name; c++)
    fprintf(out, "  talus %s %s\n      %s\n", c->name, c->synopsis, c->help);
  fprintf(out, "\n  talus COMMAND --help, talus --version\n");
  fprintf(out, "\nexit code: 0 done, 2 bad input, 3 the run became invalid, 4 file trouble, 75 interrupted (--resume "
               "goes on)\n");
}

typedef struct option_help {
  unsigned accept; // 0: always
  struct option option;
  const char *argument; // NULL: none
  const char *help;
} option_help;

static const option_help table[] = {
    {TAL_CLI_OUT, {"out", required_argument, NULL, 'o'}, "DIR", "folder for the results"},
    {TAL_CLI_THREADS, {"threads", required_argument, NULL, 't'}, "N", "threads; same bits for any number"},
    {TAL_CLI_SET, {"set", required_argument, NULL, 's'}, "KEY=VALUE", "override a scene key, e.g. stages.1.strain=0.1"},
    {TAL_CLI_RESUME, {"resume", no_argument, NULL, 'r'}, NULL, "go on from the folder's last checkpoint"},
    {TAL_CLI_QUIET, {"quiet", no_argument, NULL, 'q'}, NULL, "no progress on the terminal"},
    {TAL_CLI_FIGURES, {"no-figures", no_argument, NULL, 'n'}, NULL, "draw no figures at the end"},
    {TAL_CLI_STUDY, {"plan", no_argument, NULL, 'p'}, NULL, "write the plan and run nothing"},
    {TAL_CLI_STUDY, {"merge", no_argument, NULL, 'm'}, NULL, "run nothing, merge the runs that are there"},
    {TAL_CLI_MEASURE,
     {"at", required_argument, NULL, 'a'},
     "WHEN,...",
     "axial strain, t=TIME, frame=N, first, last, peak, all"},
    {TAL_CLI_MEASURE, {"window", required_argument, NULL, 'w'}, "A:B", "frames from axial strain A to B only"},
    {TAL_CLI_MEASURE, {"region", required_argument, NULL, 'g'}, "WHERE", "X0:X1,Y0:Y1 or disc:X,Y,R [m]"},
    {TAL_CLI_MEASURE, {"over", required_argument, NULL, 'v'}, "STRAIN", "displacements over this axial strain (0.02)"},
    {TAL_CLI_MEASURE, {"angle", required_argument, NULL, 'l'}, "DEGREES", "of force chains (45)"},
    {TAL_CLI_MEASURE, {"export", required_argument, NULL, 'x'}, "FIELD", "write contacts, or contacts/fn ..., as CSV"},
    {0, {"help", no_argument, NULL, 'h'}, NULL, "this text"}};

#define OPTIONS (sizeof table / sizeof *table)

static void print_help(const char *name, unsigned accepted) {
  const tal_command *command = tal_cli_command_find(name);
  printf("usage: talus %s %s\n%s\n\n", name, command ? command->synopsis : "", command ? command->help : "");
  for (size_t i = 0; i < OPTIONS; i++) {
    const option_help *o = &table[i];
    if (o->accept && !(o->accept & accepted))
      continue;
    char shape[40];
    bool letter = strchr("otqh", o->option.val) != NULL;
    snprintf(shape, sizeof shape, "%c%c%s--%s%s%s", letter ? '-' : ' ', letter ? o->option.val : ' ',
             letter ? ", " : "  ", o->option.name, o->argument ? " " : "", o->argument ? o->argument : "");
    printf("  %-24s %s\n", shape, o->help);
  }
}

// Message about one option or argument; always TAL_BAD_INPUT.
static int refuse(const char *name, const char *option, const char *what) {
  char quoted[128];
  tal_quote(option, 120, quoted, sizeof quoted);
  fprintf(stderr, "talus %s: %s: %s\n", name, quoted, what);
  return TAL_BAD_INPUT;
}

static int take_threads(tal_cli_options *options, const char *name, const char *text) {
  int64_t value = 0;
  if (tal_read_whole(text, &value) != TAL_NUMBER_OK || value < 1 || value > 1024) {
    char what[160], quoted[48];
    tal_quote(text, 40, quoted, sizeof quoted);
    snprintf(what, sizeof what, "'%s' is no number of threads; accepted: a whole number from 1 to 1024", quoted);
    return refuse(name, "-t", what);
  }
  options->threads = (int)value;
  return TAL_OK;
}

static const char **place_of(tal_cli_options *options, int letter) {
  switch (letter) {
  case 'a':
    return &options->at;
  case 'w':
    return &options->window;
  case 'g':
    return &options->region;
  case 'v':
    return &options->over;
  case 'l':
    return &options->angle;
  default:
    return NULL;
  }
}

static int take(tal_cli_options *options, const char *name, int letter, const char *value) {
  const char **place = place_of(options, letter);
  if (place)
    *place = value;
  switch (letter) {
  case 'o':
    if (!*value)
      return refuse(name, "-o", "names no folder; accepted: -o DIR");
    options->out = value;
    return TAL_OK;
  case 't':
    return take_threads(options, name, value);
  case 's':
    options->sets[options->set_count++] = value;
    return TAL_OK;
  case 'r':
    options->resume = true;
    return TAL_OK;
  case 'q':
    options->quiet = true;
    return TAL_OK;
  case 'n':
    options->figures = false;
    return TAL_OK;
  case 'p':
    options->plan = true;
    return TAL_OK;
  case 'm':
    options->merge = true;
    return TAL_OK;
  case 'x':
    options->exports[options->export_count++] = value;
    return TAL_OK;
  default:
    return TAL_OK;
  }
}

typedef struct accepted_options {
  struct option longs[OPTIONS + 1];
  char letters[2 * OPTIONS + 2]; // as getopt wants them, ":" in front
} accepted_options;

static accepted_options accepted_of(unsigned accepted) {
  accepted_options a = {.letters = ":"};
  size_t longs = 0, letters = 1;
  for (size_t i = 0; i < OPTIONS; i++) {
    const option_help *o = &table[i];
    if (o->accept && !(o->accept & accepted))
      continue;
    a.longs[longs++] = o->option;
    if (!strchr("otqh", o->option.val))
      continue;
    a.letters[letters++] = (char)o->option.val;
    if (o->option.has_arg)
      a.letters[letters++] = ':';
  }
  return a;
}

// Names the option getopt stumbled over.
static int bad_option(const char *name, int result, char **words) {
  char letter[3] = {'-', (char)optopt, '\0'};
  const char *word = words[optind - 1];
  bool is_long = strncmp(word, "--", 2) == 0;
  if (result == ':')
    return refuse(name, is_long ? word : letter, "needs a value");
  return refuse(name, is_long || !optopt ? word : letter, "is not an option here; accepted: see --help of the command");
}

static bool take_all(tal_cli_options *options, const char *name, unsigned accepted, int count, char **words,
                     int *exit_code) {
  accepted_options a = accepted_of(accepted);
  optind = 0; // starts getopt afresh
  opterr = 0;
  for (int letter; (letter = getopt_long(count, words, a.letters, a.longs, NULL)) != -1;) {
    *exit_code = letter == '?' || letter == ':' ? bad_option(name, letter, words) : take(options, name, letter, optarg);
    if (*exit_code)
      return false;
    if (letter != 'h')
      continue;
    print_help(name, accepted);
    return false;
  }
  return true;
}

bool tal_cli_options_parse(tal_cli_options *options, const char *name, unsigned accepted, const char *argument,
                           int argc, char **argv, int *exit_code) {
  *options = (tal_cli_options){.figures = true};
  *exit_code = TAL_OK;
  options->sets = tal_alloc((size_t)argc + 1, sizeof *options->sets);
  options->exports = tal_alloc((size_t)argc + 1, sizeof *options->exports);
  char **words = tal_alloc((size_t)argc + 2, sizeof *words); // getopt skips the first and reorders the rest
  words[0] = (char[]){"talus"};
  for (int i = 0; i < argc; i++)
    words[i + 1] = argv[i];
  bool good = take_all(options, name, accepted, argc + 1, words, exit_code);
  int left = argc + 1 - optind;
  if (good && left == 1)
    options->argument = words[optind];
  if (good && left != 1) {
    *exit_code = refuse(name, left ? words[optind + 1] : argument, left ? "is one word too many" : "is missing");
    good = false;
  }
  free(words);
  if (!good)
    tal_cli_options_clear(options);
  return good;
}

void tal_cli_options_clear(tal_cli_options *options) {
  free(options->sets);
  free(options->exports);
  *options = (tal_cli_options){0};
}

int tal_cli_print_errors(const tal_scene_errors *errors) {
  for (size_t i = 0; i < errors->count; i++)
    fprintf(stderr, "%s\n", errors->item[i].text);
  return TAL_BAD_INPUT;
}

int tal_cli_print_error(tal_status status, const tal_error *err) {
  fprintf(stderr, "talus: %s\n", err->text);
  return (int)status;
}
