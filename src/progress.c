// See progress.h. Time left is that of this stage plus the nominal length of the later ones; a confine stage ends when
// it has settled, so before and in it the time left is a lower bound, shown as ">".
#include "progress.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { BAR = 20 };

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double tal_progress_nominal_time(const tal_scene_stage *stage, bool *open) {
  if (isfinite(stage->duration) && stage->duration > 0)
    return stage->duration;
  if (isfinite(stage->rate) && stage->rate != 0 && isfinite(stage->strain))
    return fabs(stage->strain / stage->rate);
  if (isfinite(stage->hold))
    return stage->ramp + stage->hold;
  *open = true;
  return isfinite(stage->ramp) ? stage->ramp : 0;
}

// Steps from here to the end of the last stage.
static double steps_left(const tal_sim *sim, double *share, bool *open) {
  const tal_scene *scene = sim->scene;
  double steps = 0;
  for (size_t k = (size_t)sim->run.stage; k < scene->stage_count; k++) {
    const tal_scene_stage *stage = &scene->stages[k];
    double time = tal_progress_nominal_time(stage, open), left = time;
    if (k == (size_t)sim->run.stage) {
      left = fmax(0, time - (sim->run.time - sim->run.stage_start));
      *share = time > 0 ? 1 - left / time : 0;
    }
    if (stage->integrator.dt > 0)
      steps += left / stage->integrator.dt;
  }
  return steps;
}

void tal_progress_put_time(char *text, size_t size, double seconds) {
  if (!(seconds < 360000)) {
    snprintf(text, size, "--:--");
  } else if (seconds < 3600) {
    snprintf(text, size, "%d:%02d", (int)seconds / 60, (int)seconds % 60);
  } else {
    snprintf(text, size, "%d:%02d:%02d", (int)seconds / 3600, (int)seconds / 60 % 60, (int)seconds % 60);
  }
}

void tal_progress_line(const tal_sim *sim, int64_t steps, double seconds, char *text, size_t size) {
  const tal_scene *scene = sim->scene;
  if (tal_sim_done(sim)) {
    snprintf(text, size, "[####################] done");
    return;
  }
  double share = 0;
  bool open = false;
  const double left = steps_left(sim, &share, &open), speed = seconds > 0 ? (double)steps / seconds : 0;
  const tal_scene_stage *stage = &scene->stages[sim->run.stage];
  const int filled = (int)(share * BAR);
  char strain[32] = "", rest[24];
  if (isfinite(stage->rate) && stage->rate != 0) {
    snprintf(strain, sizeof strain, "strain %.4f  ", sim->run.axial_strain);
  }
  tal_progress_put_time(rest, sizeof rest, speed > 0 ? left / speed : HUGE_VAL);
  snprintf(text, size, "[%.*s%.*s] %lld/%zu %.12s  %s%.0f steps/s  %s%s left", filled, "####################",
           BAR - filled, "....................", (long long)sim->run.stage + 1, scene->stage_count, stage->kind, strain,
           speed, open ? ">" : "", rest);
}

void tal_progress_begin(tal_progress *progress, const tal_sim *sim, bool quiet) {
  progress->on = !quiet && isatty(STDERR_FILENO);
  progress->started = progress->last_shown = now();
  progress->first_step = sim->run.step;
}

void tal_progress_show(tal_progress *progress, const tal_sim *sim) {
  if (!progress->on)
    return;
  const double time = now();
  if (time - progress->last_shown < 0.25)
    return;
  progress->last_shown = time;
  char text[160];
  tal_progress_line(sim, sim->run.step - progress->first_step, time - progress->started, text, sizeof text);
  fprintf(stderr, "\r%s\033[K", text);
  fflush(stderr);
}

void tal_progress_end(tal_progress *progress) {
  if (!progress->on)
    return;
  fputs("\r\033[K", stderr);
  fflush(stderr);
  progress->on = false;
}
