// bands.csv: for each strain window the band of the shear field and that of the rotations. motion.csv: what else moved.
// profiles.csv, correlation.csv, fluctuations.csv and the figures shear-, profile-, fluctuations-NNNNNN.png: of the
// frames of --at. persistence.csv and persistence.png: bands that stay or come and go.
#include "measure_report_bands.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double degrees = 180 / TAL_PI;
// Boxes on which windows are compared, in mean diameters: wide enough for a few grains, narrower than a band.
static const double box_side = 4;

static const char *const field_names[2] = {"shear", "rotation"};

typedef struct state {
  tal_window_plan plan;
  tal_boxes boxes;
  tal_windows windows[2]; // shear, rotation
  tal_earlier kept;       // of frame number kept_frame, where a window begins
  size_t kept_frame;
} state;

static void *create(tal_measuring *run) {
  state *at = tal_alloc(1, sizeof *at);
  tal_window_plan_make(&at->plan, &run->choice, run->strain_step);
  tal_tables_get(&run->tables, "bands.csv",
                 TAL_ROW
                 ",from_frame,from_strain,field,points,found,axis[deg],axis_error[deg],x[m],y[m],place_error[m],"
                 "width[m],width_error[m],width_diameters,base,height,height_error,explained,concentration");
  tal_tables_get(&run->tables, "motion.csv",
                 TAL_ROW ",from_frame,from_strain,grains,mean_shear,mean_dilation,mean_rotation[deg],median_rotation["
                         "deg],rms_rotation[deg],"
                         "rotation_length[m],rotation_length_error[m],rotation_length_diameters,rotation_amplitude,"
                         "velocity_fluctuation[m/s],displacement_fluctuation[m]");
  return at;
}

// ---- fields ----

tal_field tal_shear_field(const tal_part *part, const tal_motion *m) {
  const tal_snapshot *s = part->of;
  tal_field f = tal_field_create(part->cell_count);
  for (size_t k = 0; k < part->cell_count; k++) {
    const size_t t = (size_t)part->cell[k];
    const int32_t *c = s->corner[t];
    if (m->cell[t])
      tal_field_add(&f, (s->x[c[0]] + s->x[c[1]] + s->x[c[2]]) / 3, (s->y[c[0]] + s->y[c[1]] + s->y[c[2]]) / 3,
                    m->shear[t], s->cell_area[t]);
  }
  return f;
}

tal_field tal_rotation_field(const tal_part *part, const tal_motion *m) {
  const tal_snapshot *s = part->of;
  tal_field f = tal_field_create(s->grain_count);
  for (size_t k = 0; k < s->grain_count; k++)
    if (m->known[k])
      tal_field_add(&f, s->x[k], s->y[k], fabs(m->turn[k]), TAL_PI * s->r[k] * s->r[k]);
  return f;
}

// ---- rows ----

static void put_from(const tal_measuring *run, const state *at, const tal_part *part, FILE *out) {
  const size_t from = at->plan.from[run->frame];
  tal_measuring_row(run, part, out);
  fprintf(out, ",%zu", from);
  tal_put(out, run->choice.frames.entry[from].axial_strain);
}

static void put_band(tal_measuring *run, const state *at, const tal_part *part, int which, size_t points,
                     const tal_band *band) {
  FILE *out = tal_tables_get(&run->tables, "bands.csv", "");
  put_from(run, at, part, out);
  fprintf(out, ",%s,%zu,%d", field_names[which], points, band->found);
  const double number[] = {band->axis * degrees,
                           band->axis_error * degrees,
                           band->x,
                           band->y,
                           band->place_error,
                           band->width,
                           band->width_error,
                           part->mean_diameter > 0 ? band->width / part->mean_diameter : 0,
                           band->base,
                           band->height,
                           band->height_error,
                           band->explained,
                           band->concentration};
  for (size_t k = 0; k < sizeof number / sizeof *number; k++)
    tal_put(out, number[k]);
  fputc('\n', out);
}

static void put_profile(tal_measuring *run, const tal_part *part, int which, const char *across, double angle,
                        const tal_field *field) {
  FILE *out = tal_tables_get(&run->tables, "profiles.csv", TAL_ROW ",field,across,s[m],points,mean,standard_error");
  tal_profile p = tal_profile_across(field, angle, part->mean_diameter);
  for (size_t b = 0; b < p.count; b++) {
    if (!p.points[b])
      continue;
    tal_measuring_row(run, part, out);
    fprintf(out, ",%s,%s", field_names[which], across);
    tal_put(out, p.s[b]);
    fprintf(out, ",%zu", p.points[b]);
    tal_put(out, p.mean[b]);
    tal_put(out, p.error[b]);
    fputc('\n', out);
  }
}

static void put_correlation(tal_measuring *run, const tal_part *part, const tal_rotation_correlation *c) {
  FILE *out = tal_tables_get(&run->tables, "correlation.csv", TAL_ROW ",r[m],pairs,rotation,magnitude");
  for (size_t k = 0; k < TAL_CORRELATION_BINS; k++) {
    tal_measuring_row(run, part, out);
    tal_put(out, ((double)k + 0.5) * c->width);
    fprintf(out, ",%zu", c->pairs[k]);
    tal_put(out, c->rotation[k]);
    tal_put(out, c->magnitude[k]);
    fputc('\n', out);
  }
}

// ---- fluctuations ----

tal_fluctuations tal_fluctuations_of(const tal_part *part, const tal_motion *m) {
  const tal_snapshot *s = part->of;
  const size_t n = m->known_count;
  double *all = tal_alloc(6 * n + 1, sizeof *all);
  tal_fluctuations f = {.x = all,
                        .y = all + n,
                        .vx = all + 2 * n,
                        .vy = all + 3 * n,
                        .ux = all + 4 * n,
                        .uy = all + 5 * n,
                        .grain = tal_alloc(n, sizeof(int32_t))};
  for (size_t k = 0; k < s->grain_count; k++) {
    if (!m->known[k])
      continue;
    f.grain[f.count] = (int32_t)k;
    f.x[f.count] = s->x[k], f.y[f.count] = s->y[k];
    f.vx[f.count] = s->vx[k], f.vy[f.count] = s->vy[k];
    f.ux[f.count] = m->dx[k], f.uy[f.count] = m->dy[k];
    f.count++;
  }
  f.velocity = tal_affine_remove(n, f.x, f.y, f.vx, f.vy);
  f.displacement = tal_affine_remove(n, f.x, f.y, f.ux, f.uy);
  return f;
}

static void put_fluctuations(tal_measuring *run, const tal_part *part, const tal_fluctuations *f) {
  FILE *out = tal_tables_get(&run->tables, "fluctuations.csv", TAL_ROW ",id,x[m],y[m],vx[m/s],vy[m/s],ux[m],uy[m]");
  for (size_t k = 0; k < f->count; k++) {
    const double number[] = {f->x[k], f->y[k], f->vx[k], f->vy[k], f->ux[k], f->uy[k]};
    tal_measuring_row(run, part, out);
    fprintf(out, ",%lld", (long long)part->of->id[f->grain[k]]);
    for (size_t c = 0; c < 6; c++)
      tal_put(out, number[c]);
    fputc('\n', out);
  }
}

static void put_motion(tal_measuring *run, const state *at, const tal_part *part, const tal_motion *m,
                       const tal_rotation_correlation *c, const tal_fluctuations *f) {
  FILE *out = tal_tables_get(&run->tables, "motion.csv", "");
  put_from(run, at, part, out);
  fprintf(out, ",%zu", m->known_count);
  const double number[] = {m->mean_shear,
                           m->mean_dilation,
                           m->mean_rotation * degrees,
                           m->median_rotation * degrees,
                           m->rms_rotation * degrees,
                           c->length,
                           c->length_error,
                           c->width > 0 ? c->length / (2 * c->width) : 0,
                           c->amplitude,
                           f->velocity,
                           f->displacement};
  for (size_t k = 0; k < sizeof number / sizeof *number; k++)
    tal_put(out, number[k]);
  fputc('\n', out);
}

// ---- a window ----

static void keep_for_persistence(state *at, const tal_part *part, const tal_motion *m) {
  const size_t n = part->of->grain_count;
  double *mean = tal_alloc(at->boxes.count + 1, sizeof *mean), *magnitude = tal_alloc(n, sizeof *magnitude);
  for (size_t k = 0; k < n; k++)
    magnitude[k] = fabs(m->turn[k]);
  const double *const value[2] = {m->grain_shear, magnitude};
  for (int which = 0; which < 2; which++) {
    at->windows[which].boxes = at->boxes.count;
    tal_boxes_mean(&at->boxes, part->of, m, value[which], mean);
    tal_windows_add(&at->windows[which], mean);
  }
  free(mean);
  free(magnitude);
}

static void measure_window(state *at, tal_measuring *run, const tal_part *part, const tal_motion *m) {
  tal_field field[2] = {tal_shear_field(part, m), tal_rotation_field(part, m)};
  tal_band band[2];
  const tal_rotation_correlation c = tal_rotation_correlate(part, m);
  tal_fluctuations f = tal_fluctuations_of(part, m);
  for (int which = 0; which < 2; which++) {
    band[which] = tal_band_fit(&field[which], part->mean_diameter);
    put_band(run, at, part, which, field[which].count, &band[which]);
  }
  put_motion(run, at, part, m, &c, &f);
  if (run->detail) {
    for (int which = 0; which < 2; which++) {
      put_profile(run, part, which, "band", band[0].axis + TAL_PI / 2, &field[which]);
      put_profile(run, part, which, "x", 0, &field[which]);
      put_profile(run, part, which, "y", TAL_PI / 2, &field[which]);
    }
    put_correlation(run, part, &c);
    put_fluctuations(run, part, &f);
    if (run->options->figures)
      tal_bands_draw(run, part, run->choice.frames.entry[at->plan.from[run->frame]].axial_strain, m, field, band, &f);
  }
  for (int which = 0; which < 2; which++)
    tal_field_clear(&field[which]);
  free(f.x);
  free(f.grain);
}

static void measure_from(state *at, tal_measuring *run, const tal_part *part, const tal_earlier *earlier) {
  tal_motion motion;
  if (at->plan.end[run->frame] && at->plan.from[run->frame] == at->plan.first)
    tal_boxes_lay(&at->boxes, earlier, box_side * part->mean_diameter);
  tal_motion_find(&motion, part, earlier);
  if (at->plan.end[run->frame])
    keep_for_persistence(at, part, &motion);
  measure_window(at, run, part, &motion);
  tal_motion_clear(&motion);
}

// Windows follow each other, so that only a frame of --at that ends none has to read where it began.
static void measure_frame(state *at, tal_measuring *run, const tal_part *part) {
  const size_t from = at->plan.from[run->frame];
  tal_earlier earlier;
  tal_error err;
  tal_status status;
  if (at->kept.id && from == at->kept_frame) {
    measure_from(at, run, part, &at->kept);
    return;
  }
#pragma omp critical(tal_store)
  status = tal_earlier_read(&earlier, run->choice.frames.entry[from].path, &err);
  if (status)
    tal_measure_failed(run, status, &err);
  else
    measure_from(at, run, part, &earlier);
  tal_earlier_clear(&earlier);
}

static void frame(void *context, tal_measuring *run, const tal_part *part) {
  state *at = context;
  if (at->plan.from[run->frame] != SIZE_MAX)
    measure_frame(at, run, part);
  if (run->frame != at->plan.first && !at->plan.end[run->frame])
    return;
  tal_earlier_clear(&at->kept);
  at->kept = tal_earlier_of(part->of);
  at->kept_frame = run->frame;
}

// ---- persistence ----

static void finish(void *context, tal_measuring *run) {
  state *at = context;
  FILE *out =
      tal_tables_get(&run->tables, "persistence.csv", "field,lag,lag_strain,windows,pairs,correlation,standard_error");
  for (int which = 0; which < 2; which++) {
    const tal_windows *windows = &at->windows[which];
    for (size_t lag = 1; lag < windows->count; lag++) {
      const tal_persistence p = tal_windows_persist(windows, lag);
      fprintf(out, "%s,%zu", field_names[which], lag);
      tal_put(out, (double)lag * at->plan.step);
      fprintf(out, ",%zu,%zu", windows->count, p.pairs);
      tal_put(out, p.correlation);
      tal_put(out, p.error);
      fputc('\n', out);
    }
  }
  if (run->options->figures && at->windows[0].count > 1)
    tal_persistence_draw(run, at->windows, at->plan.step);
  for (int which = 0; which < 2; which++)
    tal_windows_clear(&at->windows[which]);
  tal_earlier_clear(&at->kept);
  tal_boxes_clear(&at->boxes);
  tal_window_plan_clear(&at->plan);
  free(at);
}

const tal_measurement tal_measurement_bands = {create, frame, finish};
