// Into the working form and out of it again.
// A set of counter-clockwise triangles whose unmatched edges form one convex cycle that winds once covers every place
// inside the cycle exactly once (the covering number is the winding number), so it tiles the hull of its points. That
// is what geo_working_load checks, with exact predicates.
#include "working.h"

#include <assert.h>
#include <string.h>

#include "memory.h"

// Lexicographic order in (x, y).
static bool left_of(geo_site a, geo_site b) {
  return a.x != b.x ? a.x < b.x : a.y < b.y;
}

static bool all_counter_clockwise(const geo_site *site, const geo_mesh *mesh) {
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const int32_t *c = mesh->corner[t];
    if (geo_orient(site[c[0]], site[c[1]], site[c[2]]) <= 0)
      return false;
  }
  return mesh->triangle_count > 0;
}

// Links the rim: next[a] = b for rim edge a -> b. Returns the number of edges and some point of the rim in *start; 0 if
// a point has two rim edges leaving it.
static size_t link_rim(const geo_mesh *mesh, int32_t *next, int32_t *start) {
  size_t count = 0;
  memset(next, -1, mesh->point_count * sizeof *next);
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int k = 0; k < 3; k++) {
      if (mesh->neighbour[t][k] >= 0)
        continue;
      int32_t a = mesh->corner[t][(k + 1) % 3];
      if (next[a] >= 0)
        return 0;
      next[a] = mesh->corner[t][(k + 2) % 3];
      *start = a;
      count++;
    }
  return count;
}

// One cycle, no right turns, one leftmost point (so it winds once and never doubles back).
static bool rim_is_convex(const geo_site *site, const int32_t *next, int32_t start, size_t count) {
  int32_t a = start, b = next[start];
  size_t steps = 0, leftmost = 0;
  do {
    int32_t c = b >= 0 ? next[b] : -1;
    if (c < 0 || steps++ > count || geo_orient(site[a], site[b], site[c]) < 0)
      return false;
    leftmost += left_of(site[b], site[a]) && left_of(site[b], site[c]);
    a = b;
    b = c;
  } while (a != start);
  return steps == count && leftmost == 1;
}

static bool tiles_its_hull(const geo_site *site, const geo_mesh *mesh) {
  if (!all_counter_clockwise(site, mesh))
    return false;
  int32_t *next = geo_resize(NULL, mesh->point_count, sizeof *next), start = -1;
  size_t count = link_rim(mesh, next, &start);
  bool good = count >= 3 && rim_is_convex(site, next, start, count);
  free(next);
  return good;
}

static void prepare(geo_working *w, const geo_site *site, size_t n, size_t capacity) {
  assert(n < INT32_MAX);
  *w = (geo_working){.site = site, .ghost = (int32_t)n};
  w->link = geo_resize(NULL, n + 1, sizeof *w->link);
  geo_working_reserve(w, capacity);
}

void geo_working_reserve(geo_working *w, size_t count) {
  if (count <= w->capacity)
    return;
  size_t old = w->capacity;
  w->capacity = geo_capacity(old, count);
  w->corner = geo_resize(w->corner, w->capacity, sizeof *w->corner);
  w->neighbour = geo_resize(w->neighbour, w->capacity, sizeof *w->neighbour);
  w->stamp = geo_resize(w->stamp, w->capacity, sizeof *w->stamp);
  memset(w->stamp + old, -1, (w->capacity - old) * sizeof *w->stamp);
}

void geo_working_clear(geo_working *w) {
  free(w->corner);
  free(w->neighbour);
  free(w->stamp);
  free(w->link);
  *w = (geo_working){0};
}

// Rim edge a -> b gets the ghost (b, a, ghost); ghosts meet along their edges to the point at infinity.
static void add_ghosts(geo_working *w) {
  size_t finite = w->count;
  for (size_t t = 0; t < finite; t++)
    for (int k = 0; k < 3; k++) {
      if (w->neighbour[t][k] >= 0)
        continue;
      geo_working_reserve(w, w->count + 1);
      int32_t g = (int32_t)w->count++, a = w->corner[t][(k + 1) % 3], b = w->corner[t][(k + 2) % 3];
      memcpy(w->corner[g], (int32_t[3]){b, a, w->ghost}, sizeof *w->corner);
      geo_working_join(w, g, 2, (int32_t)t, k);
      w->link[b] = g;
    }
  for (size_t g = finite; g < w->count; g++)
    geo_working_join(w, (int32_t)g, 0, w->link[w->corner[g][1]], 1);
}

bool geo_working_load(geo_working *w, const geo_site *site, size_t n, const geo_mesh *mesh) {
  if (!tiles_its_hull(site, mesh))
    return false;
  size_t finite = mesh->triangle_count;
  prepare(w, site, n, finite + 64);
  memcpy(w->corner, mesh->corner, finite * sizeof *w->corner);
  memcpy(w->neighbour, mesh->neighbour, finite * sizeof *w->neighbour);
  w->count = finite;
  add_ghosts(w);
  return true;
}

void geo_working_start(geo_working *w, const geo_site *site, size_t n) {
  prepare(w, site, n, 2 * n + 16);
  int32_t c = 2;
  while (c + 1 < (int32_t)n && geo_orient(site[0], site[1], site[c]) == 0)
    c++;
  int turn = geo_orient(site[0], site[1], site[c]);
  assert(turn != 0);
  memcpy(w->corner[0], (int32_t[3]){0, turn > 0 ? 1 : c, turn > 0 ? c : 1}, sizeof *w->corner);
  memset(w->neighbour[0], -1, sizeof *w->neighbour);
  w->count = 1;
  add_ghosts(w);
}

void geo_working_store(const geo_working *w, geo_mesh *mesh) {
  int32_t(*corner)[3] = geo_resize(NULL, w->count, sizeof *corner);
  int32_t(*neighbour)[3] = geo_resize(NULL, w->count, sizeof *neighbour);
  int32_t *number = geo_resize(NULL, w->count, sizeof *number), count = 0;
  for (size_t t = 0; t < w->count; t++)
    number[t] = w->corner[t][0] >= 0 && geo_working_ghost(w, (int32_t)t) < 0 ? count++ : -1;
  for (size_t t = 0; t < w->count; t++) {
    if (number[t] < 0)
      continue;
    memcpy(corner[number[t]], w->corner[t], sizeof *corner);
    for (int k = 0; k < 3; k++)
      neighbour[number[t]][k] = number[w->neighbour[t][k]];
  }
  geo_mesh_set_joined(mesh, (size_t)w->ghost, (const int32_t(*)[3])corner, (const int32_t(*)[3])neighbour,
                      (size_t)count);
  free(number);
  free(neighbour);
  free(corner);
}
