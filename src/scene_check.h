// Rules that join several keys: defaults found from other keys, and combinations that make no sense. Private to
// scene*.c.
#ifndef TAL_SCENE_CHECK_H
#define TAL_SCENE_CHECK_H

#include "scene_report.h"

// Between the two passes: fills the defaults that depend on other keys. Reports a compress stage that finds no
// pressure.
void tal_scene_resolve(tal_scene *scene, tal_node *root, tal_report *report);
// After them: reports impossible combinations and what is missing because of another key.
void tal_scene_check(const tal_scene *scene, tal_node *root, tal_report *report);
// Is any coefficient of friction (material, wall, stage) above zero?
bool tal_scene_any_friction(const tal_scene *scene);

#endif
