// Collects the messages of a scene: the ten first in file order, whatever the order in which they are found; those of
// --set come last. Private to scene*.c and study*.c.
#ifndef TAL_SCENE_REPORT_H
#define TAL_SCENE_REPORT_H

#include "scene.h"
#include "scene_yaml.h"

typedef struct tal_report {
  const char *file;
  tal_scene_errors *errors;
  int line[10]; // sort key of each message
} tal_report;

// "FILE:LINE: key: what" or, for a node of --set, "--set KEY=VALUE: key: what". `at` may be NULL: line 1. `key` may be
// "": left out.
void tal_report_add(tal_report *report, const tal_node *at, const char *key, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Same for a line of the file (0: "FILE: what") or, where `override` is given, of --set.
void tal_report_text(tal_report *report, int line, const char *override, const char *key, const char *what);
// A message that names its place itself; after all others. The same message is kept only once, here and above.
void tal_report_line(tal_report *report, const char *text);

#endif
