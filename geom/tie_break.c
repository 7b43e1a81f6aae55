// Joins triangles across edges whose conflict predicate is exactly zero and lays a fan over each face.
#include "tie_break.h"

#include <stdbool.h>
#include <string.h>

#include "memory.h"

typedef struct face_walk {
  const geo_site *site;
  const geo_mesh *mesh;
  unsigned char *tie;   // [T] bit k: the edge opposite corner k lies inside a face
  unsigned char *taken; // [T] triangle belongs to a face already written
  int32_t *stack;       // [T] triangles of the present face
  int32_t *after;       // [points] next point along the face's border
  int32_t *border;      // [points] its corners in order
  int32_t (*out)[3];    // [T] triangles written
  size_t out_count;
} face_walk;

static bool mark_ties(face_walk *w) {
  const geo_mesh *mesh = w->mesh;
  bool any = false;
  for (int32_t t = 0; t < (int32_t)mesh->triangle_count; t++)
    for (int k = 0; k < 3; k++) {
      int32_t u = mesh->neighbour[t][k];
      if (u < t)
        continue;
      int m = mesh->neighbour[u][0] == t ? 0 : mesh->neighbour[u][1] == t ? 1 : 2;
      const int32_t *c = mesh->corner[t];
      if (geo_conflict(w->site[c[0]], w->site[c[1]], w->site[c[2]], w->site[mesh->corner[u][m]]) != 0)
        continue;
      w->tie[t] |= (unsigned char)(1 << k);
      w->tie[u] |= (unsigned char)(1 << m);
      any = true;
    }
  return any;
}

// Gathers the face around triangle t, links its border in `after`, returns the number of triangles; *start is the
// smallest point on the border.
static size_t collect_face(face_walk *w, int32_t t, int32_t *start) {
  size_t count = 0;
  *start = INT32_MAX;
  w->stack[count++] = t;
  w->taken[t] = 1;
  for (size_t s = 0; s < count; s++) {
    const int32_t *corner = w->mesh->corner[w->stack[s]], *neighbour = w->mesh->neighbour[w->stack[s]];
    for (int k = 0; k < 3; k++) {
      if (w->tie[w->stack[s]] >> k & 1) {
        if (!w->taken[neighbour[k]])
          w->stack[count++] = neighbour[k];
        w->taken[neighbour[k]] = 1;
        continue;
      }
      int32_t a = corner[(k + 1) % 3];
      w->after[a] = corner[(k + 2) % 3];
      if (a < *start)
        *start = a;
    }
  }
  return count;
}

// Corners of the face's border, counter-clockwise from the smallest; points on a straight side are left out.
static size_t face_corners(face_walk *w, int32_t start) {
  size_t count = 0, least = 0;
  int32_t before = start, here = w->after[start];
  do {
    int32_t next = w->after[here];
    if (geo_orient(w->site[before], w->site[here], w->site[next]) > 0) {
      if (count == 0 || here < w->border[least])
        least = count;
      w->border[count++] = here;
    }
    before = here;
    here = next;
  } while (before != start);
  for (size_t k = 0; k < count; k++)
    w->after[w->border[k]] = w->border[(k + 1) % count];
  for (size_t k = 0, p = (size_t)w->border[least]; k < count; k++, p = (size_t)w->after[p])
    w->border[k] = (int32_t)p;
  return count;
}

static void write_face(face_walk *w, int32_t t) {
  int32_t start;
  if (collect_face(w, t, &start) == 1) {
    memcpy(w->out[w->out_count++], w->mesh->corner[t], sizeof *w->out);
    return;
  }
  size_t corners = face_corners(w, start);
  for (size_t k = 1; k + 1 < corners; k++) {
    int32_t fan[3] = {w->border[0], w->border[k], w->border[k + 1]};
    memcpy(w->out[w->out_count++], fan, sizeof fan);
  }
}

void geo_tie_break(const geo_site *site, geo_mesh *mesh) {
  size_t triangles = mesh->triangle_count, points = mesh->point_count;
  face_walk w = {.site = site, .mesh = mesh, .tie = geo_zeroed(triangles, 1)};
  if (mark_ties(&w)) {
    w.taken = geo_zeroed(triangles, 1);
    w.stack = geo_resize(NULL, triangles, sizeof *w.stack);
    w.after = geo_resize(NULL, points, sizeof *w.after);
    w.border = geo_resize(NULL, points, sizeof *w.border);
    w.out = geo_resize(NULL, triangles, sizeof *w.out);
    for (size_t t = 0; t < triangles; t++)
      if (!w.taken[t])
        write_face(&w, (int32_t)t);
    geo_mesh_set(mesh, points, (const int32_t(*)[3])w.out, w.out_count);
  }
  free(w.tie);
  free(w.taken);
  free(w.stack);
  free(w.after);
  free(w.border);
  free(w.out);
}
