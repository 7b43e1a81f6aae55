// Messages of a scene in file order: an insertion into a list of ten, so a scene with a million errors costs no memory.
#include "scene_report.h"

#include "scene_value.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define MOST (sizeof((tal_scene_errors *)NULL)->item / sizeof(tal_error))

// Slot for a message of this line, later ones moved up; NULL when ten earlier ones are there.
static tal_error *make_room(tal_report *report, int line) {
  tal_scene_errors *errors = report->errors;
  size_t at = errors->count;
  while (at && report->line[at - 1] > line)
    at--;
  if (at == MOST)
    return NULL;
  if (errors->count < MOST)
    errors->count++;
  for (size_t i = errors->count - 1; i > at; i--) {
    errors->item[i] = errors->item[i - 1];
    report->line[i] = report->line[i - 1];
  }
  report->line[at] = line;
  return &errors->item[at];
}

static void keep(tal_report *report, int line, const tal_error *message) {
  for (size_t i = 0; i < report->errors->count; i++)
    if (strcmp(report->errors->item[i].text, message->text) == 0)
      return;
  tal_error *slot = make_room(report, line);
  if (slot)
    *slot = *message;
}

void tal_report_line(tal_report *report, const char *text) {
  tal_error message;
  tal_fail(&message, TAL_BAD_INPUT, "%s", text);
  keep(report, INT_MAX, &message);
}

void tal_report_text(tal_report *report, int line, const char *override, const char *key, const char *what) {
  tal_error message;
  char place[400], quoted[104];
  if (override) {
    tal_quote(override, 100, quoted, sizeof quoted);
    snprintf(place, sizeof place, "--set %s", quoted);
  } else if (line) {
    snprintf(place, sizeof place, "%.300s:%d", report->file, line);
  } else {
    snprintf(place, sizeof place, "%.300s", report->file);
  }
  tal_fail(&message, TAL_BAD_INPUT, "%s: %s%s%s", place, key, *key ? ": " : "", what);
  keep(report, override ? INT_MAX : line, &message);
}

void tal_report_add(tal_report *report, const tal_node *at, const char *key, const char *format, ...) {
  char what[600];
  va_list args;
  va_start(args, format);
  vsnprintf(what, sizeof what, format, args);
  va_end(args);
  tal_report_text(report, at ? at->line : 1, at ? at->override : NULL, key, what);
}
