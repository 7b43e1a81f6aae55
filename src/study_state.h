// What a run of a study has come to, read from its folder DIR/runs/ID and its log DIR/logs/ID.log. Private to study*.c.
#ifndef TAL_STUDY_STATE_H
#define TAL_STUDY_STATE_H

#include "study.h"

typedef enum tal_study_status {
  TAL_RUN_MISSING,
  TAL_RUN_UNFINISHED, // begun, can be resumed or is at work
  TAL_RUN_DONE,
  TAL_RUN_FAILED
} tal_study_status;

typedef struct tal_study_state {
  tal_study_status status;
  bool final;         // would fail again: not worth another try
  char reason[400];   // one line, "" when done
  double cpu_time;    // [s] of the stages whose cost counts; NAN unless done
  double grain_steps; // of the same
} tal_study_state;

tal_study_state tal_study_state_read(const tal_study *study, const tal_study_run *run, const char *dir);
// "missing", "unfinished", "done", "failed".
const char *tal_study_status_name(tal_study_status status);
// DIR/logs/ID.log: what the run wrote to stdout and stderr.
void tal_study_log(char *path, size_t size, const char *dir, const tal_study_run *run);

#endif
