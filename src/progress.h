// A progress line on a terminal: bar, stage, strain, steps per second, time left. Silent when stderr is no terminal.
#ifndef TAL_PROGRESS_H
#define TAL_PROGRESS_H

#include "sim.h"

typedef struct tal_progress {
  bool on;            // stderr is a terminal and not -q
  double started;     // [s] monotonic clock
  double last_shown;  // [s]
  int64_t first_step; // of this process
} tal_progress;

void tal_progress_begin(tal_progress *progress, const tal_sim *sim, bool quiet);
// Cheap: looks at the clock and draws at most four times a second.
void tal_progress_show(tal_progress *progress, const tal_sim *sim);
// Simulated time [s] a stage takes, from the keys it has; *open is set when it may take longer.
double tal_progress_nominal_time(const tal_scene_stage *stage, bool *open);
// Seconds as m:ss or h:mm:ss.
void tal_progress_put_time(char *text, size_t size, double seconds);
// Wipes the line.
void tal_progress_end(tal_progress *progress);
// The line itself: `steps` taken by this process in `seconds`. Written to text[size], below 80 columns.
void tal_progress_line(const tal_sim *sim, int64_t steps, double seconds, char *text, size_t size);

#endif
