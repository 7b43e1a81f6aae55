// See verify.h.
#include "verify.h"

#include "output_parts.h"
#include "store.h"
#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

typedef struct checker {
  const char *dir;
  tal_finding *finding;
  void *context;
  tal_verify_counts *counts;
  int64_t series_bytes, tracks_bytes; // lengths found
  int64_t series_kept, tracks_kept;   // --resume cuts them back to these, INT64_MAX: it does not
  size_t frame_files;                 // fields/NNNNNN.h5 numbered without a gap from 0
} checker;

__attribute__((format(printf, 3, 4))) static void report(checker *c, bool damage, const char *format, ...) {
  char sentence[TAL_PATH_SIZE + 1024];
  va_list args;
  va_start(args, format);
  vsnprintf(sentence, sizeof sentence, format, args);
  va_end(args);
  *(damage ? &c->counts->damages : &c->counts->notes) += 1;
  if (c->finding)
    c->finding(c->context, damage, sentence);
}

static bool is_there(const checker *c, const char *name) {
  char path[TAL_PATH_SIZE];
  tal_file_path(path, c->dir, name);
  return tal_file_exists(path);
}

// ---- CSV ----

typedef struct row_rule {
  const char *name;   // file
  const char *header; // expected, with its line end
  size_t step_column; // 0: none
  size_t same_time;   // rows that share one time
  int64_t kept;       // bytes that --resume keeps
} row_rule;

static const char mends[] = "; --resume mends it";

typedef struct row_state {
  size_t row;
  double time, step;
} row_state;

static size_t count_columns(const char *line) {
  size_t columns = 1;
  for (; *line && *line != '\n'; line++)
    columns += *line == ',';
  return columns;
}

// Reads the numbers of one line: how many there are, 0 when something is no number. The first two are kept.
static size_t read_row(const char *line, double first[2]) {
  for (size_t column = 0;; column++) {
    char *end;
    double value = strtod(line, &end);
    // strtod would skip white space, line ends too.
    if (isspace((unsigned char)*line) || end == line || (*end != ',' && *end != '\n'))
      return 0;
    if (column < 2)
      first[column] = value;
    if (*end == '\n')
      return column + 1;
    line = end + 1;
  }
}

static void check_row(checker *c, const row_rule *rule, row_state *state, const char *line, size_t columns) {
  double first[2] = {0, 0};
  const size_t row = state->row++;
  if (read_row(line, first) != columns) {
    report(c, true, "%s:%zu: not a row of %zu numbers", rule->name, row + 2, columns);
    return;
  }
  const bool opens = row % rule->same_time == 0;
  if (row > 0 && !(opens ? first[0] > state->time : first[0] == state->time)) {
    report(c, true, "%s:%zu: time %.9g follows %.9g", rule->name, row + 2, first[0], state->time);
  } else if (row > 0 && rule->step_column && !(first[1] > state->step)) {
    report(c, true, "%s:%zu: step %.9g follows %.9g", rule->name, row + 2, first[1], state->step);
  } else {
    c->counts->rows += rule->step_column > 0;
  }
  state->time = first[0];
  state->step = first[1];
}

static void check_lines(checker *c, const row_rule *rule, char *text, size_t size) {
  const size_t columns = count_columns(rule->header), header = strlen(rule->header);
  if (strncmp(text, rule->header, header) != 0) {
    report(c, true, "%s:1: the header is not the one this version writes", rule->name);
    return;
  }
  if (strlen(text) < size) {
    report(c, true, "%s: holds zero bytes", rule->name);
    return;
  }
  row_state state = {0, 0, 0};
  bool mended = false; // a kill in the middle of a row
  for (char *line = text + header; *line;) {
    char *end = strchr(line, '\n');
    mended = line - text >= rule->kept;
    if (!end) {
      report(c, !mended, "%s:%zu: the last line is torn%s", rule->name, state.row + 2, mended ? mends : "");
      return;
    }
    check_row(c, rule, &state, line, columns);
    line = end + 1;
  }
  if (state.row % rule->same_time)
    report(c, !mended, "%s: the last time lacks some grains%s", rule->name, mended ? mends : "");
}

// Returns the length of the file, -1 when it cannot be read.
static int64_t check_csv(checker *c, const row_rule *rule) {
  char path[TAL_PATH_SIZE];
  unsigned char *text;
  size_t size;
  tal_error why;
  tal_file_path(path, c->dir, rule->name);
  if (tal_file_read(path, &text, &size, &why) != TAL_OK) {
    report(c, true, "%s", why.text);
    return -1;
  }
  check_lines(c, rule, (char *)text, size); // tal_file_read leaves a zero byte behind the content
  free(text);
  return (int64_t)size;
}

// Rows of tracks.csv up to where the time changes.
static size_t tracks_per_time(const checker *c) {
  char path[TAL_PATH_SIZE];
  unsigned char *text;
  size_t size, rows = 0;
  tal_file_path(path, c->dir, "tracks.csv");
  if (tal_file_read(path, &text, &size, NULL) != TAL_OK)
    return 1;
  const char *line = strchr((const char *)text, '\n');
  double time = line ? strtod(line + 1, NULL) : 0;
  for (; line && line[1] && strtod(line + 1, NULL) == time; line = strchr(line + 1, '\n'))
    rows++;
  free(text);
  return rows ? rows : 1;
}

// What an unfinished run goes on from.
static void find_kept(checker *c) {
  char path[TAL_PATH_SIZE];
  tal_checkpoint_head head;
  c->series_kept = c->tracks_kept = INT64_MAX;
  tal_file_path(path, c->dir, is_there(c, "checkpoint.h5") ? "checkpoint.h5" : "checkpoint.prev.h5");
  if (tal_checkpoint_peek(path, &head, NULL) != TAL_OK)
    return;
  if (!head.complete) {
    c->series_kept = head.files.series_bytes;
    c->tracks_kept = head.files.tracks_bytes;
  }
  tal_run_files_clear(&head.files);
}

static void check_tables(checker *c) {
  char *header = tal_series_header();
  const row_rule series = {"series.csv", header, 1, 1, c->series_kept};
  c->series_bytes = check_csv(c, &series);
  free(header);
  if (!is_there(c, "tracks.csv"))
    return;
  const row_rule tracks = {"tracks.csv", tal_tracks_header, 0, tracks_per_time(c), c->tracks_kept};
  c->tracks_bytes = check_csv(c, &tracks);
}

// ---- frames ----

static bool check_frame(checker *c, const char *name, double *time) {
  static const char *const groups[] = {"grains", "contacts", "wall_contacts", "walls", "cells", "loop"};
  char path[TAL_PATH_SIZE];
  tal_store store;
  tal_error why;
  tal_file_path(path, c->dir, name);
  if (tal_store_open(&store, path, &why) != TAL_OK) {
    report(c, true, "%s", why.text);
    return false;
  }
  *time = tal_store_get_number(&store, "time");
  for (size_t k = 0; k < sizeof groups / sizeof *groups; k++)
    tal_store_group(&store, groups[k]);
  bool well = tal_store_status(&store, &why) == TAL_OK;
  tal_store_close(&store);
  if (!well)
    report(c, true, "%s", why.text);
  return well;
}

// How many fields/NNNNNN.h5 there are, gaps or not.
static size_t count_frame_files(const checker *c) {
  char path[TAL_PATH_SIZE];
  size_t count = 0;
  tal_file_path(path, c->dir, "fields");
  DIR *entries = opendir(path);
  for (struct dirent *entry; entries && (entry = readdir(entries));) {
    size_t digits = strspn(entry->d_name, "0123456789");
    count += digits >= 6 && strcmp(entry->d_name + digits, ".h5") == 0;
  }
  if (entries)
    closedir(entries);
  return count;
}

static void check_frames(checker *c) {
  const size_t files = count_frame_files(c);
  double last = 0, time = 0;
  bool before = false;
  for (size_t k = 0, found = 0; found < files; k++) {
    char name[32];
    snprintf(name, sizeof name, TAL_FRAME_NAME, k);
    if (!is_there(c, name)) {
      report(c, true, "%s is missing, %zu later frames are there", name, files - found);
      break;
    }
    c->frame_files = ++found;
    if (!check_frame(c, name, &time))
      continue;
    if (before && !(time > last))
      report(c, true, "%s: time %.9g follows %.9g", name, time, last);
    c->counts->frames++;
    before = true;
    last = time;
  }
}

static void check_index(checker *c) {
  char path[TAL_PATH_SIZE];
  tal_store store;
  tal_error why;
  tal_file_path(path, c->dir, "fields.h5");
  if (!tal_file_exists(path)) {
    if (c->frame_files)
      report(c, true, "fields.h5 is missing, there are %zu frames", c->frame_files);
    return;
  }
  if (tal_store_open(&store, path, &why) != TAL_OK) {
    report(c, true, "%s", why.text);
    return;
  }
  tal_store_group(&store, "frames");
  const size_t linked = tal_store_rows(&store, NULL);
  for (size_t k = 0; k < linked; k++) {
    char link[32], file[32];
    snprintf(link, sizeof link, "%06zu", k);
    snprintf(file, sizeof file, TAL_FRAME_NAME, k);
    if (!tal_store_links_to(&store, link, file)) {
      report(c, true, "fields.h5: /frames/%s does not link to %s", link, file);
    } else if (!is_there(c, file)) {
      report(c, true, "fields.h5 links to %s, which is missing", file);
    }
  }
  tal_store_close(&store);
  // A kill between a frame and its link.
  if (linked < c->frame_files) {
    report(c, false, "fields.h5 links %zu frames of %zu; --resume mends it", linked, c->frame_files);
  }
  if (!is_there(c, "fields.xdmf"))
    report(c, true, "fields.xdmf is missing");
}

// ---- checkpoints ----

static void check_lengths(checker *c, const char *name, const tal_run_files *files) {
  if (c->series_bytes >= 0 && c->series_bytes < files->series_bytes) {
    report(c, true, "series.csv has %lld bytes, %s was written with %lld", (long long)c->series_bytes, name,
           (long long)files->series_bytes);
  }
  if (c->tracks_bytes >= 0 && c->tracks_bytes < files->tracks_bytes) {
    report(c, true, "tracks.csv has %lld bytes, %s was written with %lld", (long long)c->tracks_bytes, name,
           (long long)files->tracks_bytes);
  }
  if (c->frame_files < files->frame_count) {
    report(c, true, "there are %zu frames, %s was written with %zu", c->frame_files, name, files->frame_count);
  }
}

// True when the run was complete at that checkpoint.
static bool check_checkpoint(checker *c, const char *name) {
  char path[TAL_PATH_SIZE];
  tal_checkpoint_head head;
  tal_error why;
  tal_file_path(path, c->dir, name);
  if (tal_checkpoint_peek(path, &head, &why) != TAL_OK) {
    report(c, true, "%s", why.text);
    return true;
  }
  c->counts->checkpoints++;
  check_lengths(c, name, &head.files);
  const bool complete = head.complete;
  if (complete && c->series_bytes > head.files.series_bytes) {
    report(c, true, "series.csv goes on after the end of the run in %s", name);
  }
  tal_run_files_clear(&head.files);
  return complete;
}

static void check_checkpoints(checker *c) {
  if (is_there(c, "checkpoint.h5")) {
    if (!check_checkpoint(c, "checkpoint.h5"))
      report(c, false, "the run is not finished: go on with --resume");
  } else {
    report(c, false, "there is no checkpoint.h5");
  }
  if (is_there(c, "checkpoint.prev.h5"))
    check_checkpoint(c, "checkpoint.prev.h5");
}

static void check_lock(checker *c) {
  char path[TAL_PATH_SIZE];
  tal_file_path(path, c->dir, ".lock");
  int fd = open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0)
    return;
  if (flock(fd, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    report(c, false, "a run is at work here: what it writes just now may look unfinished");
  }
  close(fd);
}

tal_status tal_verify(const char *dir, tal_finding *finding, void *context, tal_verify_counts *counts, tal_error *err) {
  *counts = (tal_verify_counts){0};
  checker c = {.dir = dir, .finding = finding, .context = context, .counts = counts, .series_bytes = -1};
  if (!is_there(&c, "series.csv") && !is_there(&c, "checkpoint.h5") && !is_there(&c, "run.json")) {
    return tal_fail(err, TAL_BAD_INPUT, "%s holds no run", dir);
  }
  check_lock(&c);
  find_kept(&c);
  check_tables(&c);
  check_frames(&c);
  check_index(&c);
  check_checkpoints(&c);
  if (!is_there(&c, "run.json"))
    report(&c, false, "there is no run.json");
  return counts->damages ? TAL_IO : TAL_OK;
}
