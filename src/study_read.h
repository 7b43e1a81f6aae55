// From the study file's tree to its parts, before any scene is looked at. Private to study*.c.
#ifndef TAL_STUDY_READ_H
#define TAL_STUDY_READ_H

#include "scene_report.h"
#include "study.h"

// Reads what the table of keys does not: dials' values, sets, seeds, the reference, within. Reports what is wrong.
void tal_study_read(tal_study *study, tal_report *report);
// Appends one key; `text` lives in the study's tree.
void tal_study_sets_add(tal_study_sets *sets, tal_study_set set);

#endif
