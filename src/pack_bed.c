// Bucket grids of the bed. Every length is compared with lengths only, so the answers scale with the unit.
#include "pack_bed.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

// Level l holds radii in (largest / 2^(l+1), largest / 2^l]; the last level holds the rest.
static size_t level_of(const tal_bed *bed, double r) {
  size_t l = 0;
  for (double reach = 0.5 * bed->largest; l + 1 < TAL_BED_LEVELS && r <= reach; reach *= 0.5)
    l++;
  return l;
}

// Buckets no finer than the disks of the level need, nor so fine that most would stay empty (memory O(count)).
static void init_level(tal_bed *bed, size_t l, size_t members, double bed_area) {
  tal_bed_level *level = &bed->level[l];
  level->reach = ldexp(bed->largest, -(int)l);
  if (members == 0)
    return;
  double cell = fmax(2 * level->reach, sqrt(bed_area / (double)members));
  level->cell = fmax(cell, bed->width / (double)members);
  level->columns = (size_t)(bed->width / level->cell) + 1;
}

void tal_bed_init(tal_bed *bed, const double *x, const double *y, const double *r, size_t count, double width) {
  *bed = (tal_bed){.x = x, .y = y, .r = r, .count = count, .width = width};
  bed->next = tal_alloc(count, sizeof *bed->next);
  double area = 0;
  for (size_t i = 0; i < count; i++) {
    area += 4 * r[i] * r[i];
    bed->largest = fmax(bed->largest, r[i]);
  }
  size_t members[TAL_BED_LEVELS] = {0};
  for (size_t i = 0; i < count; i++)
    members[level_of(bed, r[i])]++;
  for (size_t l = 0; l < TAL_BED_LEVELS; l++)
    init_level(bed, l, members[l], area);
}

void tal_bed_clear(tal_bed *bed) {
  for (size_t l = 0; l < TAL_BED_LEVELS; l++)
    free(bed->level[l].first);
  free(bed->next);
  free(bed->near);
  *bed = (tal_bed){0};
}

static void reserve_rows(tal_bed_level *level, size_t rows) {
  if (rows <= level->capacity)
    return;
  size_t old = level->capacity * level->columns, capacity = rows + rows / 2 + 8;
  level->first = tal_grow(level->first, old, capacity * level->columns, sizeof *level->first);
  for (size_t k = old; k < capacity * level->columns; k++)
    level->first[k] = -1;
  level->capacity = capacity;
}

// Bucket number of a coordinate, kept in 0 .. limit - 1.
static size_t bucket(double position, double cell, size_t limit) {
  if (!(position > 0))
    return 0;
  double k = position / cell;
  return k < (double)limit ? (size_t)k : limit - 1;
}

void tal_bed_add(tal_bed *bed, int32_t i) {
  tal_bed_level *level = &bed->level[level_of(bed, bed->r[i])];
  assert(level->columns > 0);
  size_t row = (size_t)(bed->y[i] / level->cell), column = bucket(bed->x[i], level->cell, level->columns);
  reserve_rows(level, row + 1);
  int32_t *first = &level->first[row * level->columns + column];
  bed->next[i] = *first;
  *first = i;
  if (level->rows <= row)
    level->rows = row + 1;
  bed->added++;
}

typedef struct landing {
  double x, r, from, height;
  int32_t grain;
} landing;

static void land_on(const tal_bed *bed, int32_t j, landing *fall) {
  double distance = fall->r + bed->r[j], dx = fabs(fall->x - bed->x[j]);
  if (!(dx < distance) || !(bed->y[j] < fall->from))
    return;
  double height = bed->y[j] + sqrt((distance - dx) * (distance + dx));
  if (height <= fall->height)
    return;
  fall->height = height;
  fall->grain = j;
}

// From the top row down to where no disk can be higher than what was met already.
static void land_on_level(const tal_bed *bed, const tal_bed_level *level, landing *fall) {
  double reach = fall->r + level->reach;
  size_t left = bucket(fall->x - reach, level->cell, level->columns);
  size_t right = bucket(fall->x + reach, level->cell, level->columns);
  for (size_t row = bucket(fall->from, level->cell, level->rows) + 1; row-- > 0;) {
    if ((double)(row + 1) * level->cell + reach <= fall->height)
      return;
    const int32_t *first = &level->first[row * level->columns];
    for (size_t column = left; column <= right; column++)
      for (int32_t j = first[column]; j >= 0; j = bed->next[j])
        land_on(bed, j, fall);
  }
}

int32_t tal_bed_landing(const tal_bed *bed, double x, double r, double from, double *height) {
  landing fall = {.x = x, .r = r, .from = from, .height = r, .grain = -1};
  for (size_t l = TAL_BED_LEVELS; l-- > 0;)
    if (bed->level[l].rows > 0)
      land_on_level(bed, &bed->level[l], &fall);
  *height = fmin(fall.height, from);
  return fall.grain;
}

static size_t gather_bucket(tal_bed *bed, int32_t first, const double box[4], size_t found) {
  for (int32_t j = first; j >= 0; j = bed->next[j]) {
    double x = bed->x[j], y = bed->y[j], r = bed->r[j];
    if (x + r < box[0] || x - r > box[1] || y + r < box[2] || y - r > box[3])
      continue;
    if (found == bed->near_capacity) {
      bed->near_capacity = 2 * found + 64;
      bed->near = tal_grow(bed->near, found, bed->near_capacity, sizeof *bed->near);
    }
    bed->near[found++] = j;
  }
  return found;
}

size_t tal_bed_near(tal_bed *bed, double x0, double x1, double y0, double y1) {
  const double box[4] = {x0, x1, y0, y1};
  size_t found = 0;
  for (size_t l = 0; l < TAL_BED_LEVELS; l++) {
    const tal_bed_level *level = &bed->level[l];
    if (level->rows == 0)
      continue;
    size_t left = bucket(x0 - level->reach, level->cell, level->columns);
    size_t right = bucket(x1 + level->reach, level->cell, level->columns);
    size_t low = bucket(y0 - level->reach, level->cell, level->rows);
    size_t high = bucket(y1 + level->reach, level->cell, level->rows);
    for (size_t row = low; row <= high; row++)
      for (size_t column = left; column <= right; column++)
        found = gather_bucket(bed, level->first[row * level->columns + column], box, found);
  }
  return found;
}
