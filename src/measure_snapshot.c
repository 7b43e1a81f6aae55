// See measure_snapshot.h. Formats: docs/formats.md.
#include "measure_snapshot.h"

#include "store.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- reading ----

static void fail(tal_store *store, const char *what) {
  if (store->failed)
    return;
  store->failed = true;
  snprintf(store->what, sizeof store->what, "%s", what);
}

static double *read_reals(tal_store *store, const char *name, size_t count) {
  double *value = tal_alloc(count, sizeof *value);
  tal_store_get(store, &(tal_array){name, NULL, TAL_STORE_DOUBLE, count, 1, value});
  return value;
}

static int32_t *read_indices(tal_store *store, const char *name, size_t count, size_t columns, size_t limit) {
  int32_t *value = tal_alloc(count * columns, sizeof *value);
  tal_store_get(store, &(tal_array){name, NULL, TAL_STORE_INT32, count, columns, value});
  for (size_t k = 0; k < count * columns && !store->failed; k++)
    if (value[k] < 0 || (size_t)value[k] >= limit)
      fail(store, "an index points outside");
  return value;
}

static void read_grains(tal_store *store, tal_snapshot *s) {
  tal_store_group(store, "grains");
  const size_t n = s->grain_count = tal_store_rows(store, "id");
  s->id = tal_alloc(n, sizeof *s->id);
  tal_store_get(store, TAL_ARRAY("id", NULL, s->id, n));
#define X(name, unit) s->name = read_reals(store, #name, n);
  TAL_SNAPSHOT_GRAINS(X)
#undef X
  for (size_t k = 1; k < n && !store->failed; k++)
    if (s->id[k] <= s->id[k - 1])
      fail(store, "the ids of the grains do not ascend");
}

static void drop_hairs(tal_snapshot_contacts *contacts, const double *r, bool walls) {
  size_t kept = 0;
  for (size_t c = 0; c < contacts->count; c++) {
    const int32_t i = contacts->i[c], j = contacts->j[c];
    const double least = walls ? r[i] : fmin(r[i], r[j]);
    if (contacts->overlap[c] < 1e-10 * least)
      continue;
    contacts->i[kept] = i;
    contacts->j[kept] = j;
#define X(name, unit) contacts->name[kept] = contacts->name[c];
    TAL_SNAPSHOT_CONTACTS(X)
#undef X
    kept++;
  }
  contacts->count = kept;
}

static void read_contacts(tal_store *store, tal_snapshot *s, const char *group, bool walls) {
  tal_snapshot_contacts *contacts = walls ? &s->walls : &s->contacts;
  tal_store_group(store, group);
  const size_t n = contacts->count = tal_store_rows(store, "i");
  contacts->i = read_indices(store, "i", n, 1, s->grain_count);
  contacts->j = read_indices(store, "j", n, 1, walls ? SIZE_MAX : s->grain_count);
#define X(name, unit) contacts->name = read_reals(store, #name, n);
  TAL_SNAPSHOT_CONTACTS(X)
#undef X
  if (!store->failed)
    drop_hairs(contacts, s->r, walls);
}

static void read_cells(tal_store *store, tal_snapshot *s) {
  tal_store_group(store, "cells");
  const size_t n = s->cell_count = tal_store_rows(store, "area");
  s->corner = (int32_t(*)[3])read_indices(store, "corner", n, 3, s->grain_count);
  s->cell_area = read_reals(store, "area", n);
}

tal_status tal_snapshot_read(tal_snapshot *snapshot, const char *path, tal_error *err) {
  *snapshot = (tal_snapshot){0};
  tal_store store;
  tal_status status = tal_store_open(&store, path, err);
  if (status)
    return status;
  snapshot->time = tal_store_get_number(&store, "time");
  snapshot->axial_strain = tal_store_get_number(&store, "axial_strain");
  snapshot->step = tal_store_get_integer(&store, "step");
  snapshot->stage = tal_store_get_integer(&store, "stage");
  read_grains(&store, snapshot);
  read_contacts(&store, snapshot, "contacts", false);
  read_contacts(&store, snapshot, "wall_contacts", true);
  read_cells(&store, snapshot);
  status = tal_store_status(&store, err);
  tal_store_close(&store);
  if (status)
    tal_snapshot_clear(snapshot);
  return status;
}

static void clear_contacts(tal_snapshot_contacts *contacts) {
  free(contacts->i);
  free(contacts->j);
#define X(name, unit) free(contacts->name);
  TAL_SNAPSHOT_CONTACTS(X)
#undef X
}

void tal_snapshot_clear(tal_snapshot *s) {
  free(s->id);
#define X(name, unit) free(s->name);
  TAL_SNAPSHOT_GRAINS(X)
#undef X
  clear_contacts(&s->contacts);
  clear_contacts(&s->walls);
  free(s->corner);
  free(s->cell_area);
  *s = (tal_snapshot){0};
}

// ---- regions ----

// A number up to `end`; an empty one is `otherwise`. NULL when it is none.
static const char *take_number(const char *text, char end, double otherwise, double *value) {
  char *stop = (char *)(uintptr_t)text;
  *value = *text == end ? otherwise : strtod(text, &stop);
  if ((stop == text && *text != end) || *stop != end || isnan(*value))
    return NULL;
  return stop + (end != '\0');
}

static bool parse_box(tal_region *region, const char *text) {
  region->kind = TAL_REGION_BOX;
  const char *at = take_number(text, ':', -HUGE_VAL, &region->a);
  at = at ? take_number(at, ',', HUGE_VAL, &region->b) : NULL;
  at = at ? take_number(at, ':', -HUGE_VAL, &region->c) : NULL;
  at = at ? take_number(at, '\0', HUGE_VAL, &region->d) : NULL;
  return at && region->a < region->b && region->c < region->d;
}

static bool parse_disc(tal_region *region, const char *text) {
  const double none = (double)NAN;
  region->kind = TAL_REGION_DISC;
  const char *at = take_number(text, ',', none, &region->a);
  at = at ? take_number(at, ',', none, &region->b) : NULL;
  at = at ? take_number(at, '\0', none, &region->c) : NULL;
  return at && region->c > 0;
}

tal_status tal_region_parse(tal_region *region, const char *text, tal_error *err) {
  *region = (tal_region){0};
  if (strncmp(text, "disc:", 5) == 0 ? parse_disc(region, text + 5) : parse_box(region, text))
    return TAL_OK;
  return tal_fail(err, TAL_BAD_INPUT, "'%.80s' is no region; accepted: X0:X1,Y0:Y1 or disc:X,Y,R in m", text);
}

bool tal_region_has(const tal_region *region, double x, double y) {
  if (region->kind == TAL_REGION_BOX)
    return x >= region->a && x < region->b && y >= region->c && y < region->d;
  if (region->kind == TAL_REGION_DISC)
    return hypot(x - region->a, y - region->b) < region->c;
  return true;
}

// ---- parts ----

static void select_grains(tal_part *part, const tal_region *region) {
  const tal_snapshot *s = part->of;
  double sum = 0;
  part->grain = tal_alloc(s->grain_count, sizeof *part->grain);
  for (size_t k = 0; k < s->grain_count; k++) {
    part->grain[k] = tal_region_has(region, s->x[k], s->y[k]);
    part->grain_count += part->grain[k];
    sum += part->grain[k] ? 2 * s->r[k] : 0;
  }
  part->mean_diameter = part->grain_count ? sum / (double)part->grain_count : 0;
}

static void select_contacts(tal_part *part, const tal_region *region) {
  const tal_snapshot *s = part->of;
  const tal_snapshot_contacts *contacts = &s->contacts;
  double sum = 0;
  part->contact = tal_alloc(contacts->count, sizeof *part->contact);
  for (size_t c = 0; c < contacts->count; c++) {
    const int32_t i = contacts->i[c];
    const double lever = s->r[i] - contacts->overlap[c] / 2; // the contact point, from the centre against n
    if (!tal_region_has(region, s->x[i] - lever * contacts->nx[c], s->y[i] - lever * contacts->ny[c]))
      continue;
    part->contact[part->contact_count++] = (int32_t)c;
    sum += contacts->fn[c];
  }
  part->mean_fn = part->contact_count ? sum / (double)part->contact_count : 0;
}

static void select_cells(tal_part *part, const tal_region *region) {
  const tal_snapshot *s = part->of;
  part->cell = tal_alloc(s->cell_count, sizeof *part->cell);
  for (size_t t = 0; t < s->cell_count; t++) {
    const int32_t *k = s->corner[t];
    if (!tal_region_has(region, (s->x[k[0]] + s->x[k[1]] + s->x[k[2]]) / 3, (s->y[k[0]] + s->y[k[1]] + s->y[k[2]]) / 3))
      continue;
    part->cell[part->cell_count++] = (int32_t)t;
    part->area += s->cell_area[t];
  }
}

void tal_part_select(tal_part *part, const tal_snapshot *snapshot, const tal_region *region) {
  *part = (tal_part){.of = snapshot, .region = *region};
  select_grains(part, region);
  select_contacts(part, region);
  select_cells(part, region);
}

void tal_part_clear(tal_part *part) {
  free(part->grain);
  free(part->contact);
  free(part->cell);
  *part = (tal_part){0};
}
