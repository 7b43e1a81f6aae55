// Triangles inside out are left out; then one round along the rim from its leftmost point fills every right turn
// (Graham's scan). Whether that gave a tiling is for geo_working_load to prove.
#include "rim.h"

#include <string.h>

#include "memory.h"

typedef struct mender {
  const geo_site *site;
  size_t count;         // triangles kept and added
  int32_t (*corner)[3]; // [T + n]
  int32_t *next;        // [n] next point along the rim, -1 off the rim
  int32_t *stack;       // [n + 1] points of the rim so far that turn left
} mender;

static bool left_of(geo_site a, geo_site b) {
  return a.x != b.x ? a.x < b.x : a.y < b.y;
}

static void keep_upright(mender *m, const geo_mesh *mesh, unsigned char *kept) {
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const int32_t *c = mesh->corner[t];
    kept[t] = geo_orient(m->site[c[0]], m->site[c[1]], m->site[c[2]]) > 0;
    if (kept[t])
      memcpy(m->corner[m->count++], c, sizeof *m->corner);
  }
}

// Links the sides that have no kept triangle beyond. Returns the leftmost point of the rim, -1 where a point has two
// rim sides leaving it.
static int32_t link_rim(mender *m, const geo_mesh *mesh, const unsigned char *kept) {
  int32_t leftmost = -1;
  memset(m->next, -1, mesh->point_count * sizeof *m->next);
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int k = 0; k < 3 && kept[t]; k++) {
      int32_t u = mesh->neighbour[t][k], a = mesh->corner[t][(k + 1) % 3];
      if (u >= 0 && kept[u])
        continue;
      if (m->next[a] >= 0)
        return -1;
      m->next[a] = mesh->corner[t][(k + 2) % 3];
      if (leftmost < 0 || left_of(m->site[a], m->site[leftmost]))
        leftmost = a;
    }
  return leftmost;
}

// False when the rim does not come back to its start.
static bool fill_notches(mender *m, int32_t start, size_t points) {
  size_t depth = 0, steps = 0;
  int32_t p = start;
  m->stack[depth++] = start;
  do {
    p = m->next[p];
    if (p < 0 || steps++ > points)
      return false;
    for (; depth > 1; depth--) {
      int32_t a = m->stack[depth - 2], b = m->stack[depth - 1];
      if (geo_orient(m->site[a], m->site[b], m->site[p]) >= 0)
        break;
      memcpy(m->corner[m->count++], (int32_t[3]){a, p, b}, sizeof *m->corner);
    }
    m->stack[depth++] = p;
  } while (p != start);
  return true;
}

bool geo_rim_mend(const geo_site *site, size_t n, const geo_mesh *mesh, geo_mesh *mended) {
  if (mesh->point_count != n || mesh->triangle_count == 0)
    return false;
  mender m = {.site = site};
  m.corner = geo_resize(NULL, mesh->triangle_count + n, sizeof *m.corner);
  m.next = geo_resize(NULL, n, sizeof *m.next);
  m.stack = geo_resize(NULL, n + 2, sizeof *m.stack);
  unsigned char *kept = geo_zeroed(mesh->triangle_count, 1);
  keep_upright(&m, mesh, kept);
  int32_t start = link_rim(&m, mesh, kept);
  bool good = start >= 0 && fill_notches(&m, start, n);
  if (good)
    geo_mesh_set(mended, n, (const int32_t(*)[3])m.corner, m.count);
  free(kept);
  free(m.stack);
  free(m.next);
  free(m.corner);
  return good;
}
