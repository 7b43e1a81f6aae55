// See measure_windows.h.
#include "measure_windows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- windows ----

static size_t last_before(const tal_frame_choice *choice, size_t frame) {
  for (size_t k = frame; k-- > 0;)
    if (choice->in[k])
      return k;
  return SIZE_MAX;
}

static double strain_of(const tal_frame_choice *choice, size_t frame) {
  return choice->frames.entry[frame].axial_strain;
}

// The last frame before anything is strained; the first frame of the window when all are.
static size_t begin_of(const tal_frame_choice *choice) {
  size_t first = SIZE_MAX;
  for (size_t k = 0; k < choice->frames.count; k++)
    if (choice->in[k] && (first == SIZE_MAX || !(strain_of(choice, k) > 0)))
      first = k;
  return first;
}

static void plan_ends(tal_window_plan *plan, const tal_frame_choice *choice) {
  size_t before = plan->first;
  for (size_t k = plan->first + 1; k < choice->frames.count; k++) {
    if (!choice->in[k])
      continue;
    const size_t next = k + 1 < choice->frames.count && choice->in[k + 1] ? k + 1 : k;
    // The frame nearest to a full step: it overshoots by less than the next one would.
    const double here = strain_of(choice, k) - strain_of(choice, before),
                 there = strain_of(choice, next) - strain_of(choice, before);
    if (plan->step > 0 && here < plan->step * (1 - 1e-6) && !(fabs(here - plan->step) < fabs(there - plan->step)))
      continue;
    plan->end[k] = true;
    plan->from[k] = before;
    before = k;
  }
}

void tal_window_plan_make(tal_window_plan *plan, const tal_frame_choice *choice, double step) {
  const size_t n = choice->frames.count;
  double most = -HUGE_VAL, least = HUGE_VAL;
  *plan = (tal_window_plan){tal_alloc(n, sizeof(size_t)), tal_alloc(n, sizeof(bool)), begin_of(choice), step};
  for (size_t k = 0; k < n; k++) {
    plan->from[k] = SIZE_MAX;
    most = choice->in[k] ? fmax(most, strain_of(choice, k)) : most;
    least = choice->in[k] ? fmin(least, strain_of(choice, k)) : least;
  }
  if (!(most > least)) {
    plan->step = 0;
    for (plan->first = 0; !choice->in[plan->first];)
      plan->first++;
  }
  plan_ends(plan, choice);
  for (size_t k = 0; k < n; k++) {
    if (!choice->detail[k] || plan->from[k] != SIZE_MAX)
      continue;
    // Not from a frame before the begin: in what came before, grains moved for other reasons.
    const size_t near = plan->step > 0 ? tal_frame_nearest(choice, strain_of(choice, k) - step) : SIZE_MAX;
    const size_t before = near < plan->first ? plan->first : near;
    const bool strained = near != SIZE_MAX && before < k && strain_of(choice, before) < strain_of(choice, k);
    plan->from[k] = strained ? before : last_before(choice, k);
  }
}

void tal_window_plan_clear(tal_window_plan *plan) {
  free(plan->from);
  free(plan->end);
  *plan = (tal_window_plan){0};
}

// ---- boxes ----

void tal_boxes_lay(tal_boxes *boxes, const tal_earlier *e, double side) {
  double x0 = HUGE_VAL, x1 = -HUGE_VAL, y0 = HUGE_VAL, y1 = -HUGE_VAL;
  *boxes = (tal_boxes){
      .grains = e->count, .id = tal_alloc(e->count, sizeof(int64_t)), .box = tal_alloc(e->count, sizeof(int32_t))};
  for (size_t k = 0; k < e->count; k++) {
    x0 = fmin(x0, e->x[k]), x1 = fmax(x1, e->x[k]);
    y0 = fmin(y0, e->y[k]), y1 = fmax(y1, e->y[k]);
  }
  if (e->count == 0 || !(side > 0))
    return;
  enum { MOST = 1000 }; // a grain that flew off must not make the grid large
  const size_t columns = (size_t)fmin(MOST, (x1 - x0) / side + 1), rows = (size_t)fmin(MOST, (y1 - y0) / side + 1);
  boxes->count = columns * rows;
  for (size_t k = 0; k < e->count; k++) {
    const size_t column = (size_t)fmin((double)columns - 1, (e->x[k] - x0) / side),
                 row = (size_t)fmin((double)rows - 1, (e->y[k] - y0) / side);
    boxes->id[k] = e->id[k];
    boxes->box[k] = (int32_t)(row * columns + column);
  }
}

void tal_boxes_clear(tal_boxes *boxes) {
  free(boxes->id);
  free(boxes->box);
  *boxes = (tal_boxes){0};
}

void tal_boxes_mean(const tal_boxes *boxes, const tal_snapshot *s, const tal_motion *m, const double *value,
                    double *mean) {
  enum { LEAST = 3 };
  size_t *grains = tal_alloc(boxes->count, sizeof *grains);
  memset(mean, 0, boxes->count * sizeof *mean);
  for (size_t k = 0, at = 0; k < s->grain_count; k++) {
    while (at < boxes->grains && boxes->id[at] < s->id[k])
      at++;
    if (at == boxes->grains || boxes->id[at] != s->id[k] || !m->known[k])
      continue;
    mean[boxes->box[at]] += value[k];
    grains[boxes->box[at]]++;
  }
  for (size_t b = 0; b < boxes->count; b++)
    mean[b] = grains[b] >= LEAST ? mean[b] / (double)grains[b] : (double)NAN;
  free(grains);
}
