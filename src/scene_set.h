// Overrides of --set put into the tree before anything is read. Private to scene*.c and study*.c.
#ifndef TAL_SCENE_SET_H
#define TAL_SCENE_SET_H

#include "scene_report.h"

// Applies "KEY=VALUE" (KEY: words and list indices joined by dots, stages.1.strain or stages[1].strain; VALUE: a YAML
// scalar, list or mapping) to the tree. Parents that are missing are made. Reports what cannot be applied.
void tal_scene_set(tal_tree *tree, const char *override, tal_report *report);

#endif
