// talus measure DIR: tables and figures of what the stored fields hold. Prints the files made, one per line.
#include "cli.h"

#include "files.h"
#include "measure.h"
#include "scene_value.h"
#include <math.h>
#include <signal.h>
#include <unistd.h>

typedef struct showing {
  bool bar; // stderr is a terminal and not -q
  bool quiet;
} showing;

static void show_progress(void *user, size_t done, size_t of) {
  const showing *show = user;
  if (show->bar)
    fprintf(stderr, done < of ? "\rframe %zu of %zu " : "\r\033[K", done, of);
}

static void print_path(void *user, const char *path) {
  const showing *show = user;
  if (!show->quiet)
    printf("%s\n", path);
}

// Ctrl-C and SIGTERM wait here until they are asked for: between frames, and after a figure. They end gnuplot, which
// blocks nothing, at once.
static void hold_signals(sigset_t *held) {
  sigemptyset(held);
  sigaddset(held, SIGINT);
  sigaddset(held, SIGTERM);
  sigprocmask(SIG_BLOCK, held, NULL);
}

static bool asked_to_stop(void *user) {
  sigset_t waiting;
  (void)user;
  return sigpending(&waiting) == 0 && (sigismember(&waiting, SIGINT) || sigismember(&waiting, SIGTERM));
}

// One line naming the option; TAL_BAD_INPUT.
static int refuse(const char *option, const char *text, const char *accepted) {
  fprintf(stderr, "talus measure: %s: '%.80s' is out of range; accepted: %s\n", option, text, accepted);
  return TAL_BAD_INPUT;
}

static bool read_number(const char *text, double least, double most, double *value) {
  return tal_read_real(text, value) == TAL_NUMBER_OK && *value > least && *value < most;
}

static int take_options(tal_measure_options *to, const tal_cli_options *from) {
  tal_error err;
  if (from->region && tal_region_parse(&to->region, from->region, &err)) {
    fprintf(stderr, "talus measure: --region: %s\n", err.text);
    return TAL_BAD_INPUT;
  }
  if (from->angle && !read_number(from->angle, 0, 90, &to->angle))
    return refuse("--angle", from->angle, "degrees between 0 and 90");
  if (from->over && !read_number(from->over, 0, HUGE_VAL, &to->over))
    return refuse("--over", from->over, "an axial strain > 0");
  to->angle *= TAL_PI / 180;
  to->at = from->at;
  to->window = from->window;
  to->figures = from->figures;
  to->exports = from->exports;
  to->export_count = from->export_count;
  return TAL_OK;
}

static int measure(const tal_cli_options *options, const tal_measure_options *what, bool quiet) {
  char out[TAL_PATH_SIZE];
  tal_measure_counts counts;
  tal_error err;
  tal_file_path(out, options->argument, "measure");
  tal_status status = tal_measure(options->argument, options->out ? options->out : out, what, &counts, &err);
  if (status)
    return tal_cli_print_error(status, &err);
  if (!counts.grains || !counts.contacts)
    fprintf(stderr, "talus: %s: the last frame measured has %zu grains and %zu contacts there\n", options->argument,
            counts.grains, counts.contacts);
  else if (!quiet)
    printf("%s: %zu frames, %zu grains, %zu contacts in the last\n", options->argument, counts.frames, counts.grains,
           counts.contacts);
  return TAL_OK;
}

int tal_cli_measure(int argc, char **argv) {
  tal_cli_options options;
  int exit_code;
  if (!tal_cli_options_parse(&options, "measure", TAL_CLI_OUT | TAL_CLI_QUIET | TAL_CLI_FIGURES | TAL_CLI_MEASURE,
                             "DIR", argc, argv, &exit_code))
    return exit_code;
  showing show = {.bar = !options.quiet && isatty(STDERR_FILENO), .quiet = options.quiet};
  tal_measure_options what = {.progress = show_progress, .made = print_path, .stop = asked_to_stop, .user = &show};
  sigset_t held;
  hold_signals(&held);
  exit_code = take_options(&what, &options);
  if (!exit_code)
    exit_code = measure(&options, &what, options.quiet);
  tal_cli_options_clear(&options);
  return exit_code;
}
