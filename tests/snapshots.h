// Made-up snapshots for the tests of the measurements: grains and contacts by hand, cells from the triangulation.
#ifndef SNAPSHOTS_H
#define SNAPSHOTS_H

#include "measure_snapshot.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static inline tal_snapshot snapshot_of(size_t count, const double (*grain)[3]) {
  tal_snapshot s = {.grain_count = count, .id = tal_alloc(count, sizeof *s.id)};
#define X(name, unit) s.name = tal_alloc(count, sizeof *s.name);
  TAL_SNAPSHOT_GRAINS(X)
#undef X
  for (size_t k = 0; k < count; k++) {
    s.id[k] = (int64_t)k;
    s.x[k] = grain[k][0];
    s.y[k] = grain[k][1];
    s.r[k] = grain[k][2];
  }
  return s;
}

static inline void snapshot_room(tal_snapshot_contacts *c) {
  c->i = tal_grow(c->i, c->count, c->count + 1, sizeof *c->i);
  c->j = tal_grow(c->j, c->count, c->count + 1, sizeof *c->j);
#define X(name, unit) c->name = tal_grow(c->name, c->count, c->count + 1, sizeof *c->name);
  TAL_SNAPSHOT_CONTACTS(X)
#undef X
}

// A contact of i and j with these forces, its normal and overlap from the centres.
static inline void snapshot_join(tal_snapshot *s, int32_t i, int32_t j, double fn, double ft) {
  tal_snapshot_contacts *c = &s->contacts;
  const double dx = s->x[i] - s->x[j], dy = s->y[i] - s->y[j], l = hypot(dx, dy);
  snapshot_room(c);
  c->i[c->count] = i;
  c->j[c->count] = j;
  c->fn[c->count] = fn;
  c->ft[c->count] = ft;
  c->nx[c->count] = dx / l;
  c->ny[c->count] = dy / l;
  c->overlap[c->count++] = s->r[i] + s->r[j] - l;
}

// Every pair closer than touching plus `gap` gets the force fn.
static inline void snapshot_join_all(tal_snapshot *s, double gap, double fn) {
  for (size_t i = 0; i < s->grain_count; i++)
    for (size_t j = i + 1; j < s->grain_count; j++)
      if (hypot(s->x[i] - s->x[j], s->y[i] - s->y[j]) < s->r[i] + s->r[j] + gap)
        snapshot_join(s, (int32_t)i, (int32_t)j, fn, 0);
}

static inline void snapshot_add_cell(tal_snapshot *s, int32_t i, int32_t j, int32_t k) {
  const size_t n = s->cell_count++;
  s->corner = tal_grow(s->corner, n, n + 1, sizeof *s->corner);
  s->cell_area = tal_grow(s->cell_area, n, n + 1, sizeof *s->cell_area);
  memcpy(s->corner[n], (int32_t[3]){i, j, k}, sizeof *s->corner);
  s->cell_area[n] = ((s->x[j] - s->x[i]) * (s->y[k] - s->y[i]) - (s->x[k] - s->x[i]) * (s->y[j] - s->y[i])) / 2;
}

// columns x rows equal grains of radius r, rows shifted by half a diameter when triangular; cells of its rhombi,
// squares.
static inline tal_snapshot snapshot_lattice(int columns, int rows, double r, bool triangular) {
  const size_t n = (size_t)(columns * rows);
  double(*grain)[3] = tal_alloc(n, sizeof *grain);
  for (int k = 0; k < columns * rows; k++) {
    const int row = k / columns, column = k % columns;
    grain[k][0] = 2 * r * column + (triangular ? r * row : 0); // a rhombus: every row further to the right
    grain[k][1] = (triangular ? sqrt(3) : 2) * r * row;
    grain[k][2] = r * (1 + 1e-6); // a slight overlap
  }
  tal_snapshot s = snapshot_of(n, (const double(*)[3])grain);
  free(grain);
  for (int row = 0; row + 1 < rows; row++)
    for (int column = 0; column + 1 < columns; column++) {
      const int32_t a = row * columns + column, b = a + 1, c = a + columns, d = c + 1;
      snapshot_add_cell(&s, a, b, c);
      snapshot_add_cell(&s, b, d, c);
    }
  return s;
}

static inline tal_part snapshot_all(const tal_snapshot *s) {
  tal_part part;
  tal_part_select(&part, s, &(tal_region){0});
  return part;
}

static inline void snapshot_end(tal_snapshot *s, tal_part *part) {
  tal_part_clear(part);
  tal_snapshot_clear(s);
}

#endif
