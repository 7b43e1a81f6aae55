#include "rotation.h"

#include "figures_data.h"
#include "files.h"

#include <fts.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Share of the mean force below which a contact does not bear.
static const double hair = 1e-6;

// ---- one grain ----

static double mean_of(const double *value, size_t count) {
  return count ? gsl_stats_mean(value, 1, count) : (double)NAN;
}

static double *forces(const tal_frame *frame) {
  double *f = tal_alloc(frame->contact_count + 1, sizeof *f);
  for (size_t c = 0; c < frame->contact_count; c++)
    f[c] = isnan(frame->ft[c]) ? frame->fn[c] : hypot(frame->fn[c], frame->ft[c]);
  return f;
}

static size_t *bearing_contacts(const tal_frame *frame, const double *f, double mean) {
  size_t *count = tal_alloc(frame->grain_count, sizeof *count);
  for (size_t c = 0; c < frame->contact_count; c++) {
    if (!(f[c] > hair * mean))
      continue;
    count[frame->i[c]]++;
    count[frame->j[c]]++;
  }
  return count;
}

static void collect_points(tal_rotation *a, const tal_frame *frame, size_t self, const size_t *contacts) {
  const size_t n = frame->grain_count;
  a->r = tal_alloc(n, sizeof *a->r);
  a->angle = tal_alloc(n, sizeof *a->angle);
  a->ratio = tal_alloc(n, sizeof *a->ratio);
  for (size_t k = 0; k < n; k++) {
    if (contacts[k] < 2) {
      a->rattlers++;
      continue;
    }
    if (k == self)
      continue;
    const double x = frame->x[k] - a->x, y = frame->y[k] - a->y;
    a->r[a->points] = hypot(x, y) / a->diameter;
    a->angle[a->points] = atan2(y, x);
    a->ratio[a->points++] = fabs(frame->omega[k] / a->omega);
  }
}

static void look_at_network(tal_rotation *a, const tal_frame *frame, const double *f, double mean, geo_vec from,
                            double reach) {
  const tal_network network = {frame->x, frame->y, frame->i, frame->j, f, frame->contact_count, mean, a->diameter};
  a->tensor = tal_directional_tensor(&network, from, reach, &a->segments);
  tal_directional_axes(a->tensor, a->value, a->axis);
  tal_directional_rose(&network, from, reach, TAL_ROSE, a->rose, NULL);
  tal_directional_rose(&network, from, reach, TAL_SECTORS, a->along, a->across);
}

// The points within reach come first then, in the order they had.
static size_t within_reach(const tal_rotation *a, double reach, double *r, double *ratio, size_t *sector) {
  size_t near = 0;
  for (size_t k = 0; k < a->points; k++) {
    if (!(a->r[k] <= reach))
      continue;
    r[near] = a->r[k];
    ratio[near] = a->ratio[k];
    sector[near++] = tal_directional_sector(cos(a->angle[k]), sin(a->angle[k]), TAL_SECTORS);
  }
  return near;
}

static void look_at_spins(tal_rotation *a, double reach) {
  double *r = tal_alloc(a->points, sizeof *r), *ratio = tal_alloc(a->points, sizeof *ratio);
  size_t *sector = tal_alloc(a->points, sizeof *sector);
  const size_t near = within_reach(a, reach, r, ratio, sector);
  a->influence = tal_influence_radius(a->r, a->ratio, a->points);
  if (tal_decay_fit(r, ratio, near, &a->decay))
    tal_sector_transmission(&a->decay, r, ratio, sector, near, TAL_SECTORS, a->transmission, a->used);
  else
    for (int k = 0; k < TAL_SECTORS; k++)
      a->transmission[k] = (double)NAN;
  free(r);
  free(ratio);
  free(sector);
}

static double distance_to_rim(const tal_rotation *a, const tal_frame *frame) {
  double least = HUGE_VAL;
  for (size_t k = 0; k < frame->loop_count; k++)
    least = fmin(least, hypot(frame->x[frame->loop[k]] - a->x, frame->y[frame->loop[k]] - a->y));
  return isfinite(least) ? least / a->diameter : (double)NAN;
}

// `network`: the frame whose forces count; its grains are those of `frame`.
static tal_status measure(tal_rotation *a, const tal_frame *frame, const tal_frame *network,
                          const tal_rotation_options *options, tal_error *err) {
  size_t self = 0;
  while (self < frame->grain_count && frame->id[self] != a->grain)
    self++;
  if (self == frame->grain_count)
    return tal_fail(err, TAL_BAD_INPUT, "%s: %lld is no grain of that run", a->run, (long long)a->grain);
  a->time = frame->time;
  a->x = frame->x[self];
  a->y = frame->y[self];
  a->omega = frame->omega[self];
  if (isnan(a->omega))
    return tal_fail(err, TAL_BAD_INPUT, "%s: the frame has no spins", a->run);
  a->diameter = 2 * mean_of(frame->r, frame->grain_count);
  a->rim = distance_to_rim(a, frame);
  double *f = forces(frame), mean = mean_of(f, frame->contact_count);
  size_t *contacts = bearing_contacts(frame, f, mean);
  a->contacts = contacts[self];
  double *g = forces(network), mean_there = mean_of(g, network->contact_count);
  for (size_t c = 0; c < network->contact_count; c++)
    if (network->i[c] == (int64_t)self || network->j[c] == (int64_t)self)
      a->load += g[c] / mean_there;
  look_at_network(a, network, g, mean_there, (geo_vec){network->x[self], network->y[self]}, options->reach);
  free(g);
  collect_points(a, frame, self, contacts);
  a->influence = (double)NAN;
  for (int k = 0; k < TAL_SECTORS; k++)
    a->transmission[k] = (double)NAN;
  if (a->forced && a->omega != 0)
    look_at_spins(a, options->reach);
  free(f);
  free(contacts);
  return TAL_OK;
}

static tal_status read_frame(const char *dir, int64_t number, tal_frame *frame, tal_error *err) {
  tal_frame_list list;
  tal_status status = tal_frame_list_read(&list, dir, err);
  const size_t k = number < 0 ? list.count - 1 : (size_t)number;
  if (status == TAL_OK && k >= list.count)
    status = tal_fail(err, TAL_BAD_INPUT, "%s: no field frame %lld; accepted: up to %zu", dir, (long long)number,
                      list.count ? list.count - 1 : 0);
  if (status == TAL_OK)
    status = tal_frame_read(frame, list.entry[k].path, err);
  tal_frame_list_clear(&list);
  return status;
}

// Spins of the frame become mean rates of turning since an earlier one.
static tal_status take_mean_spins(tal_frame *frame, const char *dir, int64_t since, tal_error *err) {
  tal_frame before;
  tal_status status = read_frame(dir, since, &before, err);
  if (status)
    return status;
  const double time = frame->time - before.time;
  if (before.grain_count != frame->grain_count || !(time > 0))
    status =
        tal_fail(err, TAL_BAD_INPUT, "%s: frame %lld is not an earlier one of the same grains", dir, (long long)since);
  for (size_t k = 0; status == TAL_OK && k < frame->grain_count; k++)
    frame->omega[k] = (frame->theta[k] - before.theta[k]) / time;
  tal_frame_clear(&before);
  return status;
}

tal_status tal_rotation_read(tal_rotation *rotation, const char *dir, const tal_rotation_options *options,
                             tal_frame *frame, tal_error *err) {
  tal_frame own = {0};
  tal_run_facts facts;
  *rotation = (tal_rotation){.run = tal_strdup(dir)};
  tal_run_facts_read(&facts, dir);
  rotation->grain = options->grain < 0 ? facts.forced_grain : options->grain;
  rotation->forced = rotation->grain == facts.forced_grain;
  tal_run_facts_clear(&facts);
  tal_status status = TAL_OK;
  if (rotation->grain < 0)
    status = tal_fail(err, TAL_BAD_INPUT, "%s: no grain is forced there; accepted: a run with a spin stage, or --grain",
                      dir);
  if (status == TAL_OK)
    status = read_frame(dir, options->frame, &own, err);
  if (status == TAL_OK && options->since >= 0)
    status = take_mean_spins(&own, dir, options->since, err);
  tal_frame forces_there = {0};
  const bool other = options->network >= 0 && options->network != options->frame;
  if (status == TAL_OK && other)
    status = read_frame(dir, options->network, &forces_there, err);
  if (status == TAL_OK && other && forces_there.grain_count != own.grain_count)
    status = tal_fail(err, TAL_BAD_INPUT, "%s: frames of different grains", dir);
  if (status == TAL_OK)
    status = measure(rotation, &own, other ? &forces_there : &own, options, err);
  tal_frame_clear(&forces_there);
  if (status)
    tal_rotation_clear(rotation);
  if (frame)
    *frame = own;
  else
    tal_frame_clear(&own);
  return status;
}

void tal_rotation_clear(tal_rotation *rotation) {
  free(rotation->run);
  free(rotation->r);
  free(rotation->angle);
  free(rotation->ratio);
  *rotation = (tal_rotation){0};
}

double tal_rotation_shell(const tal_rotation *a, size_t k) {
  double sum = 0;
  size_t count = 0;
  for (size_t p = 0; p < a->points; p++)
    if (a->r[p] >= (double)k && a->r[p] < (double)k + 1) {
      sum += a->ratio[p];
      count++;
    }
  return count ? sum / (double)count : (double)NAN;
}

// ---- all of them ----

static int by_name(const FTSENT **a, const FTSENT **b) {
  return strverscmp((*a)->fts_name, (*b)->fts_name);
}

// What an ensemble began from does not count among its runs.
static bool forced_a_grain(const char *dir) {
  char runs[TAL_PATH_SIZE];
  tal_file_path(runs, dir, "runs");
  if (tal_file_exists(runs))
    return false;
  tal_run_facts facts;
  tal_run_facts_read(&facts, dir);
  const bool forced = facts.done && facts.forced_grain >= 0;
  tal_run_facts_clear(&facts);
  return forced;
}

// DIR of DIR/runs/ID, else the folder itself.
static size_t length_of_sample(const char *run) {
  const char *end = strrchr(run, '/');
  if (end && end - run >= 5 && strncmp(end - 5, "/runs", 5) == 0)
    return (size_t)(end - 5 - run);
  return strlen(run);
}

static bool same_sample(const char *a, const char *b) {
  const size_t length = length_of_sample(a);
  return length == length_of_sample(b) && strncmp(a, b, length) == 0;
}

static tal_status add(tal_rotations *all, const char *dir, const tal_rotation_options *options, tal_error *err) {
  all->item = tal_grow(all->item, all->count, all->count + 1, sizeof *all->item);
  tal_status status = tal_rotation_read(&all->item[all->count], dir, options, NULL, err);
  if (status)
    return status;
  tal_rotation *last = &all->item[all->count];
  last->sample = all->count && same_sample(last->run, last[-1].run) ? last[-1].sample : all->samples++;
  all->count++;
  return TAL_OK;
}

// Folders in the order of their names, those of a sample together.
static tal_status find_all(tal_rotations *all, const char *dir, const tal_rotation_options *options, tal_error *err) {
  char *root = tal_strdup(dir);
  while (strlen(root) > 1 && root[strlen(root) - 1] == '/')
    root[strlen(root) - 1] = '\0';
  FTS *walk = fts_open((char *[]){root, NULL}, FTS_PHYSICAL | FTS_NOCHDIR, by_name);
  tal_status status = walk ? TAL_OK : tal_fail(err, TAL_IO, "%s: cannot be read", dir);
  for (FTSENT *entry; status == TAL_OK && (entry = fts_read(walk));) {
    if (entry->fts_info != FTS_F || strcmp(entry->fts_name, "run.json") != 0)
      continue;
    char *folder = tal_strdup(entry->fts_path);
    *strrchr(folder, '/') = '\0';
    if (forced_a_grain(folder))
      status = add(all, folder, options, err);
    free(folder);
  }
  if (walk)
    fts_close(walk);
  free(root);
  return status;
}

static int ascending(const void *a, const void *b) {
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static double mean_over_sectors(const double value[TAL_SECTORS]) {
  return mean_of(value, TAL_SECTORS);
}

// Means over the forced grains with the intervals of (R12). What is NAN does not count.
static void average(tal_rotations *all) {
  const size_t n = all->count;
  double *value[5];
  size_t *sample = tal_alloc(n, sizeof *sample);
  tal_interval *const into[5] = {&all->share, &all->load, &all->load_others, &all->length, &all->influence};
  for (int k = 0; k < 5; k++)
    value[k] = tal_alloc(n, sizeof(double));
  for (size_t g = 0; g < n; g++) {
    const tal_rotation *a = &all->item[g];
    const bool transmits = tal_rotation_transmits(a);
    const double none = (double)NAN;
    sample[g] = a->sample;
    all->transmitting += transmits;
    value[0][g] = transmits;
    value[1][g] = transmits ? a->load : none;
    value[2][g] = transmits ? none : a->load;
    value[3][g] = transmits ? a->decay.length : none;
    value[4][g] = transmits ? a->influence : none;
  }
  for (int k = 0; k < 5; k++) {
    *into[k] = tal_mean_interval(value[k], sample, n, all->confidence, 1);
    free(value[k]);
  }
  free(sample);
}

static void compare_sectors(tal_rotations *all) {
  tal_sector *sector = tal_alloc(all->count * TAL_SECTORS, sizeof *sector);
  for (size_t g = 0; g < all->count; g++) {
    const tal_rotation *a = &all->item[g];
    for (size_t k = 0; k < TAL_SECTORS; k++)
      sector[g * TAL_SECTORS + k] =
          (tal_sector){a->sample, g, tal_rotation_transmits(a) ? a->transmission[k] : (double)NAN,
                       a->along[k] / mean_over_sectors(a->along), a->across[k] / mean_over_sectors(a->across)};
  }
  tal_sector_statistics_of(sector, all->count * TAL_SECTORS, all->confidence, 1, &all->sectors);
  free(sector);
}

static void sum_up(tal_rotations *all) {
  double *length = tal_alloc(all->count, sizeof *length);
  const double none = (double)NAN;
  size_t fitted = 0;
  average(all);
  compare_sectors(all);
  for (size_t g = 0; g < all->count; g++)
    if (tal_rotation_transmits(&all->item[g]) && all->item[g].decay.points)
      length[fitted++] = all->item[g].decay.length;
  qsort(length, fitted, sizeof *length, ascending);
  all->length_low = fitted ? gsl_stats_quantile_from_sorted_data(length, 1, fitted, 0.05) : none;
  all->length_median = fitted ? gsl_stats_quantile_from_sorted_data(length, 1, fitted, 0.5) : none;
  all->length_high = fitted ? gsl_stats_quantile_from_sorted_data(length, 1, fitted, 0.95) : none;
  free(length);
}

tal_status tal_rotations_read(tal_rotations *all, const char *dir, const tal_rotation_options *options,
                              tal_error *err) {
  *all = (tal_rotations){.confidence = 0.95};
  tal_status status = options->grain >= 0 ? add(all, dir, options, err) : find_all(all, dir, options, err);
  if (status == TAL_OK && !all->count)
    status = tal_fail(err, TAL_BAD_INPUT,
                      "%s: no run of a forced grain there or below; accepted: runs with a spin stage, or --grain", dir);
  if (status)
    tal_rotations_clear(all);
  else
    sum_up(all);
  return status;
}

void tal_rotations_clear(tal_rotations *all) {
  for (size_t k = 0; k < all->count; k++)
    tal_rotation_clear(&all->item[k]);
  free(all->item);
  *all = (tal_rotations){0};
}
