// Runs gnuplot as a child process. Strings are single-quoted: gnuplot evaluates back-quotes and macros in double-quoted
// text only.
#include "figures_gnuplot.h"

#include "figures_data.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

extern char **environ;

static void remove_folder(char *folder) {
  DIR *list = opendir(folder);
  for (struct dirent *entry; list && (entry = readdir(list));) {
    if (!strcmp(entry->d_name, ".") || !strcmp(entry->d_name, ".."))
      continue;
    char *path = tal_path_join(folder, entry->d_name);
    unlink(path);
    free(path);
  }
  if (list)
    closedir(list);
  rmdir(folder);
}

tal_status tal_plot_begin(tal_plot *plot, const char *folder, tal_error *err) {
  *plot = (tal_plot){.time_limit = 120, .folder = tal_path_join(folder, ".plot-XXXXXX")};
  bool made = mkdtemp(plot->folder) != NULL;
  char *path = tal_path_join(plot->folder, "script");
  plot->script = made ? fopen(path, "w") : NULL;
  tal_status status = TAL_OK;
  if (!plot->script) {
    status = tal_fail(err, TAL_IO, "%s: cannot write figures: %s", folder, strerror(errno));
    if (made)
      rmdir(plot->folder);
    free(plot->folder);
    plot->folder = NULL;
  }
  free(path);
  return status;
}

void tal_plot_canvas(tal_plot *plot, int width, int height, int font) {
  fprintf(plot->script,
          "set encoding utf8\nset terminal pngcairo enhanced rounded background rgb '#ffffff' size %d,%d "
          "font 'DejaVu Sans,%d'\nset output 'figure.png'\n",
          width, height, font);
}

// Length of the well-formed UTF-8 character at `text`, 0 when it is none.
static size_t utf8_length(const unsigned char *text) {
  size_t length = text[0] < 0x80   ? 1
                  : text[0] < 0xc2 ? 0
                  : text[0] < 0xe0 ? 2
                  : text[0] < 0xf0 ? 3
                  : text[0] < 0xf5 ? 4
                                   : 0;
  for (size_t k = 1; k < length; k++)
    if ((text[k] & 0xc0) != 0x80)
      return 0;
  if (text[0] == 0xe0 && length && text[1] < 0xa0)
    return 0; // overlong
  if (text[0] == 0xed && length && text[1] > 0x9f)
    return 0; // surrogate
  if (text[0] == 0xf0 && length && text[1] < 0x90)
    return 0; // overlong
  if (text[0] == 0xf4 && length && text[1] > 0x8f)
    return 0; // beyond U+10FFFF
  return length;
}

void tal_plot_text(FILE *out, const char *text, size_t limit) {
  const unsigned char *at = (const unsigned char *)text;
  fputc('\'', out);
  for (size_t count = 0; *at; count++) {
    if (count == limit) {
      fputs("…", out);
      break;
    }
    size_t length = utf8_length(at);
    bool control = length == 1 && (*at < 0x20 || *at == 0x7f);
    control = control || (length == 2 && at[0] == 0xc2 && at[1] < 0xa0);
    if (length == 0)
      fputc('?', out);
    else if (control)
      fputc(' ', out);
    else if (*at == '\'')
      fputs("’", out); // a doubled quote at the start would end the string in gnuplot 5.4
    else
      fwrite(at, 1, length, out);
    at += length ? length : 1;
  }
  fputc('\'', out);
}

FILE *tal_plot_data(tal_plot *plot, const char *name) {
  char *path = tal_path_join(plot->folder, name);
  FILE *data = fopen(path, "w");
  plot->write_failed |= !data;
  free(path);
  return data;
}

void tal_plot_data_end(tal_plot *plot, FILE *data) {
  if (!data)
    return;
  bool failed = ferror(data) != 0;
  failed |= fclose(data) != 0;
  plot->write_failed |= failed;
}

void tal_plot_element(tal_plot *plot) {
  fputs(plot->drawn++ ? ", \\\n  " : "plot ", plot->script);
}

void tal_plot_command_end(tal_plot *plot) {
  fputc('\n', plot->script);
  plot->drawn = 0;
}

double tal_plot_tick_step(double range, double parts) {
  double raw = range / parts, decade = pow(10, floor(log10(raw))), mantissa = raw / decade;
  return decade * (mantissa < 1.5 ? 1 : mantissa < 3.5 ? 2 : mantissa < 7.5 ? 5 : 10);
}

// Ctrl-C shall reach gnuplot even where the parent catches or blocks it.
static void restore_signals(posix_spawnattr_t *attributes) {
  sigset_t set;
  sigemptyset(&set);
  posix_spawnattr_setsigmask(attributes, &set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGPIPE);
  posix_spawnattr_setsigdefault(attributes, &set);
  posix_spawnattr_setflags(attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
}

// Starts gnuplot in the temporary folder; returns an errno value.
static int start(const tal_plot *plot, pid_t *child) {
  char *const argument[] = {"gnuplot", "-d", "script", NULL};
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addchdir_np(&actions, plot->folder);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "log", O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  restore_signals(&attributes);
  int failed = posix_spawnp(child, argument[0], &actions, &attributes, argument, environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return failed;
}

static double now(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

// Waits for the child to end, at most `limit` seconds; *expired says that it was killed.
static int wait_for(pid_t child, double limit, bool *expired) {
  const struct timespec pause = {.tv_nsec = 5000000};
  double end = now() + limit;
  int result = 0;
  pid_t got;
  while ((got = waitpid(child, &result, WNOHANG)) == 0 || (got < 0 && errno == EINTR)) {
    if (!*expired && now() > end) {
      *expired = true;
      kill(child, SIGKILL);
    }
    nanosleep(&pause, NULL);
  }
  return got < 0 ? -1 : result;
}

// The line of gnuplot's output that says what is wrong, else its last line. False when it said nothing.
static bool read_complaint(const tal_plot *plot, char *text, size_t size) {
  char *path = tal_path_join(plot->folder, "log"), line[512];
  FILE *log = fopen(path, "r");
  bool found = false, spoke = false;
  snprintf(text, size, "no reason given");
  while (log && !found && fgets(line, sizeof line, log)) {
    line[strcspn(line, "\r\n")] = 0;
    char *start_of_text = line + strspn(line, " \t^");
    if (!*start_of_text)
      continue;
    spoke = true;
    found = strstr(line, "line ") && !strstr(line, "warning");
    snprintf(text, size, "%s", start_of_text);
  }
  if (log)
    fclose(log);
  free(path);
  return spoke;
}

// A whole PNG begins with its signature and ends with an IEND chunk.
static bool is_whole_png(const char *path) {
  static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  unsigned char head[8] = {0}, tail[8] = {0};
  FILE *file = fopen(path, "rb");
  if (!file)
    return false;
  bool good = fread(head, 1, 8, file) == 8 && !fseek(file, -8, SEEK_END) && fread(tail, 1, 8, file) == 8;
  fclose(file);
  return good && !memcmp(head, signature, 8) && !memcmp(tail, "IEND", 4);
}

static tal_status judge(const tal_plot *plot, int result, const char *png, tal_error *err) {
  char complaint[400];
  bool spoke = read_complaint(plot, complaint, sizeof complaint);
  // gnuplot catches SIGINT and then ends with a failure but without a word.
  bool caught = WIFEXITED(result) && WEXITSTATUS(result) && !spoke;
  if (caught || (WIFSIGNALED(result) && (WTERMSIG(result) == SIGINT || WTERMSIG(result) == SIGTERM)))
    return tal_fail(err, TAL_INTERRUPTED, "stopped while drawing %s", png);
  if (!WIFEXITED(result) || WEXITSTATUS(result))
    return tal_fail(err, TAL_IO, "%s: gnuplot failed: %s", png, complaint);
  char *made = tal_path_join(plot->folder, "figure.png");
  tal_status status = TAL_OK;
  if (!is_whole_png(made))
    status = tal_fail(err, TAL_IO, "%s: gnuplot made no picture: %s", png, complaint);
  else if (rename(made, png))
    status = tal_fail(err, TAL_IO, "%s: %s", png, strerror(errno));
  free(made);
  return status;
}

static tal_status run(const tal_plot *plot, const char *png, tal_error *err) {
  pid_t child;
  int failed = start(plot, &child);
  if (failed == ENOENT || failed == EACCES)
    return tal_fail(err, TAL_IO,
                    "no figures: the program gnuplot is not installed (Debian: apt-get install gnuplot-nox)");
  if (failed)
    return tal_fail(err, TAL_IO, "no figures: gnuplot could not be started: %s", strerror(failed));
  bool expired = false;
  int result = wait_for(child, plot->time_limit, &expired);
  if (expired)
    return tal_fail(err, TAL_IO, "%s: gnuplot took longer than %g s and was ended", png, plot->time_limit);
  return judge(plot, result, png, err);
}

tal_status tal_plot_finish(tal_plot *plot, const char *png, tal_error *err) {
  tal_plot_data_end(plot, plot->script);
  tal_status status = TAL_OK;
  if (!plot->empty && plot->write_failed)
    status = tal_fail(err, TAL_IO, "%s: could not be written", png);
  else if (!plot->empty)
    status = run(plot, png, err);
  remove_folder(plot->folder);
  free(plot->folder);
  plot->folder = NULL;
  return status;
}
