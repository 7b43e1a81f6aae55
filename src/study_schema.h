// The keys of a study file, in the same kind of table as a scene's. Private to study*.c.
#ifndef TAL_STUDY_SCHEMA_H
#define TAL_STUDY_SCHEMA_H

#include "scene_schema.h"
#include "study.h"

// Offsets into tal_study, its dials and its metrics.
const tal_key *tal_study_keys(void);
const tal_key *tal_study_dial_keys(void);
const tal_key *tal_study_metric_keys(void);
// Is `name` a column of series.csv? If not, *near is the one that was probably meant, "" when none is near.
bool tal_study_column_known(const char *name, const char **near);

#endif
