// See measure_voids.h.
#include "measure_voids.h"

#include "measure_tensors.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- coordination ----

// Contacts of each grain, walls included, and who they are with: wall contacts have no partner.
typedef struct partners {
  size_t *first; // [grains + 1]
  int32_t *with; // [first[grains]]
  int32_t *left; // [grains] contacts left, walls included
} partners;

static partners partners_of(const tal_snapshot *s) {
  const tal_snapshot_contacts *contacts = &s->contacts;
  const size_t n = s->grain_count;
  partners p = {tal_alloc(n + 2, sizeof(size_t)), tal_alloc(2 * contacts->count, sizeof(int32_t)),
                tal_alloc(n, sizeof(int32_t))};
  for (size_t c = 0; c < contacts->count; c++) {
    p.left[contacts->i[c]]++;
    p.left[contacts->j[c]]++;
  }
  for (size_t k = 0; k < n; k++)
    p.first[k + 2] = p.first[k + 1] + (size_t)p.left[k];
  for (size_t c = 0; c < contacts->count; c++) {
    const int32_t i = contacts->i[c], j = contacts->j[c];
    p.with[p.first[i + 1]++] = j;
    p.with[p.first[j + 1]++] = i;
  }
  for (size_t c = 0; c < s->walls.count; c++)
    p.left[s->walls.i[c]]++;
  return p;
}

static void partners_clear(partners *p) {
  free(p->first);
  free(p->with);
  free(p->left);
}

bool *tal_rattlers_find(const tal_snapshot *s) {
  partners p = partners_of(s);
  bool *rattler = tal_alloc(s->grain_count, sizeof *rattler);
  int32_t *stack = tal_alloc(s->grain_count, sizeof *stack);
  size_t waiting = 0;
  for (size_t k = 0; k < s->grain_count; k++)
    if (p.left[k] < 2) {
      rattler[k] = true;
      stack[waiting++] = (int32_t)k;
    }
  while (waiting) {
    const int32_t k = stack[--waiting];
    for (size_t m = p.first[k]; m < p.first[k + 1]; m++) {
      const int32_t other = p.with[m];
      if (rattler[other] || --p.left[other] >= 2)
        continue;
      rattler[other] = true;
      stack[waiting++] = other;
    }
  }
  free(stack);
  partners_clear(&p);
  return rattler;
}

tal_coordination tal_coordination_measure(const tal_part *part) {
  const tal_snapshot *s = part->of;
  tal_coordination z = {.grains = part->grain_count};
  bool *rattler = tal_rattlers_find(s);
  size_t *all = tal_alloc(s->grain_count, sizeof *all), ends = 0, bearing = 0;
  for (size_t c = 0; c < s->contacts.count; c++) {
    const int32_t i = s->contacts.i[c], j = s->contacts.j[c];
    all[i]++;
    all[j]++;
    bearing += rattler[i] || rattler[j] ? 0 : (size_t)part->grain[i] + part->grain[j];
  }
  for (size_t k = 0; k < s->grain_count; k++) {
    if (!part->grain[k])
      continue;
    ends += all[k];
    z.rattlers += rattler[k];
    z.with[all[k] < TAL_COORDINATION_BINS ? all[k] : TAL_COORDINATION_BINS - 1]++;
  }
  z.mean = z.grains ? (double)ends / (double)z.grains : 0;
  z.bearing = z.grains > z.rattlers ? (double)bearing / (double)(z.grains - z.rattlers) : 0;
  free(rattler);
  free(all);
  return z;
}

// ---- cells ----

double tal_cell_solid(const tal_snapshot *s, size_t t) {
  double solid = 0;
  for (int k = 0; k < 3; k++) {
    const int32_t a = s->corner[t][k], b = s->corner[t][(k + 1) % 3], c = s->corner[t][(k + 2) % 3];
    const double bx = s->x[b] - s->x[a], by = s->y[b] - s->y[a], cx = s->x[c] - s->x[a], cy = s->y[c] - s->y[a];
    solid += fabs(atan2(bx * cy - by * cx, bx * cx + by * cy)) * s->r[a] * s->r[a] / 2;
  }
  return solid;
}

// ---- edges ----

// Edges filed under their lower grain: of cells (owner: the cell) or of contacts.
typedef struct edge {
  int32_t other, owner;
} edge;
typedef struct edges {
  size_t *first; // [grains + 1]
  edge *item;    // by `other` within a grain
} edges;

static int by_other(const void *a, const void *b) {
  const edge *p = a, *q = b;
  return p->other != q->other ? (p->other > q->other) - (p->other < q->other)
                              : (p->owner > q->owner) - (p->owner < q->owner);
}

static void file_edge(edges *e, int32_t a, int32_t b, int32_t owner, bool counting) {
  const int32_t low = a < b ? a : b, high = a < b ? b : a;
  if (counting)
    e->first[low + 2]++;
  else
    e->item[e->first[low + 1]++] = (edge){high, owner};
}

static void file_cells(edges *e, const tal_snapshot *s, bool counting) {
  for (size_t t = 0; t < s->cell_count; t++)
    for (int k = 0; k < 3; k++)
      file_edge(e, s->corner[t][k], s->corner[t][(k + 1) % 3], (int32_t)t, counting);
}

static void file_contacts(edges *e, const tal_snapshot *s, const bool *rattler, bool counting) {
  for (size_t c = 0; c < s->contacts.count; c++)
    if (!rattler[s->contacts.i[c]] && !rattler[s->contacts.j[c]])
      file_edge(e, s->contacts.i[c], s->contacts.j[c], (int32_t)c, counting);
}

// rattler NULL: the edges of the cells.
static edges edges_of(const tal_snapshot *s, const bool *rattler) {
  edges e = {tal_alloc(s->grain_count + 2, sizeof(size_t)), NULL};
  rattler ? file_contacts(&e, s, rattler, true) : file_cells(&e, s, true);
  for (size_t k = 2; k < s->grain_count + 2; k++)
    e.first[k] += e.first[k - 1];
  e.item = tal_alloc(e.first[s->grain_count + 1], sizeof *e.item);
  rattler ? file_contacts(&e, s, rattler, false) : file_cells(&e, s, false);
  for (size_t k = 0; k < s->grain_count; k++)
    qsort(e.item + e.first[k], e.first[k + 1] - e.first[k], sizeof *e.item, by_other);
  return e;
}

static void edges_clear(edges *e) {
  free(e->first);
  free(e->item);
}

static bool edges_have(const edges *e, size_t low, int32_t high) {
  for (size_t k = e->first[low]; k < e->first[low + 1]; k++)
    if (e->item[k].other == high)
      return true;
  return false;
}

// ---- voids ----

static int32_t root_of(int32_t *parent, int32_t k) {
  while (parent[k] != k)
    k = parent[k] = parent[parent[k]];
  return k;
}

// Goes over every edge of the graph, of one cell (u = -1) or two, telling whether a contact closes it.
typedef void visit(void *context, int32_t t, int32_t u, bool closed);
static void visit_edges(const tal_snapshot *s, const edges *cells, const edges *contacts, visit *each, void *context) {
  for (size_t low = 0; low < s->grain_count; low++)
    for (size_t k = cells->first[low]; k < cells->first[low + 1]; k++) {
      const edge *e = &cells->item[k];
      const bool pair = k + 1 < cells->first[low + 1] && e[1].other == e->other;
      each(context, e->owner, pair ? e[1].owner : -1, edges_have(contacts, low, e->other));
      k += pair;
    }
}

static void open_edge(void *context, int32_t t, int32_t u, bool closed) {
  int32_t *parent = context;
  if (closed || u < 0)
    return;
  const int32_t a = root_of(parent, t), b = root_of(parent, u);
  parent[a > b ? a : b] = a < b ? a : b;
}

typedef struct counting {
  int32_t *parent;
  size_t *sides; // of the root's void
  bool *open;
} counting;

// A contact with the same void on both sides hangs into it and is no side.
static void count_edge(void *context, int32_t t, int32_t u, bool closed) {
  counting *c = context;
  const int32_t a = root_of(c->parent, t), b = u < 0 ? -1 : root_of(c->parent, u);
  if (!closed && u < 0)
    c->open[a] = true;
  if (!closed || a == b)
    return;
  c->sides[a]++;
  if (b >= 0)
    c->sides[b]++;
}

// Sums over the cells of a void: area, first and second moments about the origin `ox, oy`.
typedef struct moments {
  size_t cells;
  double area, solid, x, y, xx, xy, yy;
} moments;

static void add_cell(moments *m, const tal_snapshot *s, size_t t, double ox, double oy) {
  const double area = s->cell_area[t];
  double sx = 0, sy = 0, xx = 0, xy = 0, yy = 0;
  for (int k = 0; k < 3; k++) {
    const double x = s->x[s->corner[t][k]] - ox, y = s->y[s->corner[t][k]] - oy;
    sx += x, sy += y;
    xx += x * x, xy += x * y, yy += y * y;
  }
  m->cells++;
  m->area += area;
  m->solid += tal_cell_solid(s, t);
  m->x += area * sx / 3;
  m->y += area * sy / 3;
  m->xx += area * (xx + sx * sx) / 12;
  m->xy += area * (xy + sx * sy) / 12;
  m->yy += area * (yy + sy * sy) / 12;
}

static tal_void void_of(const moments *m, size_t sides, bool open, double ox, double oy) {
  tal_void v = {.cells = m->cells, .sides = sides, .open = open, .area = m->area, .solid = m->solid};
  const double x = m->area > 0 ? m->x / m->area : 0, y = m->area > 0 ? m->y / m->area : 0;
  const double xy = m->xy - m->area * x * y;
  const tal_principal p = tal_principal_of((geo_tensor){m->xx - m->area * x * x, xy, xy, m->yy - m->area * y * y});
  v.x = ox + x;
  v.y = oy + y;
  v.aspect = p.major > 0 ? sqrt(fmax(0, p.minor) / p.major) : 1;
  v.angle = p.angle;
  return v;
}

static void keep_voids(tal_voids *voids, const tal_part *part, const counting *c) {
  const tal_snapshot *s = part->of;
  moments *sum = tal_alloc(s->cell_count, sizeof *sum);
  int32_t *number = tal_alloc(s->cell_count, sizeof *number);
  for (size_t t = 0; t < s->cell_count; t++) {
    const size_t root = (size_t)root_of(c->parent, (int32_t)t), at = (size_t)s->corner[root][0];
    add_cell(&sum[root], s, t, s->x[at], s->y[at]); // moments about a corner of its own lose no digits
  }
  for (size_t t = 0; t < s->cell_count; t++) {
    if (!sum[t].cells)
      continue;
    const size_t at = (size_t)s->corner[t][0];
    const tal_void v = void_of(&sum[t], c->sides[t], c->open[t], s->x[at], s->y[at]);
    const bool in = tal_region_has(&part->region, v.x, v.y);
    number[t] = in ? (int32_t)voids->count : -1;
    if (in)
      voids->item[voids->count++] = v;
  }
  for (size_t t = 0; t < s->cell_count; t++)
    voids->of[t] = number[root_of(c->parent, (int32_t)t)];
  free(sum);
  free(number);
}

static void summarise(tal_voids *voids) {
  for (size_t k = 0; k < voids->count; k++) {
    const tal_void *v = &voids->item[k];
    if (v->open)
      continue;
    voids->closed++;
    voids->with[v->sides < TAL_VOID_BINS ? v->sides : TAL_VOID_BINS - 1]++;
    voids->mean_sides += (double)v->sides;
    voids->mean_area += v->area;
    voids->mean_aspect += v->aspect;
    voids->largest_area = fmax(voids->largest_area, v->area);
  }
  const double n = voids->closed ? (double)voids->closed : 1;
  voids->mean_sides /= n;
  voids->mean_area /= n;
  voids->mean_aspect /= n;
}

void tal_voids_find(tal_voids *voids, const tal_part *part) {
  const tal_snapshot *s = part->of;
  const size_t n = s->cell_count;
  *voids = (tal_voids){.item = tal_alloc(n, sizeof(tal_void)), .of = tal_alloc(n, sizeof(int32_t))};
  bool *rattler = tal_rattlers_find(s);
  edges cells = edges_of(s, NULL), contacts = edges_of(s, rattler);
  counting c = {tal_alloc(n, sizeof(int32_t)), tal_alloc(n, sizeof(size_t)), tal_alloc(n, sizeof(bool))};
  for (size_t t = 0; t < n; t++)
    c.parent[t] = (int32_t)t;
  visit_edges(s, &cells, &contacts, open_edge, c.parent);
  visit_edges(s, &cells, &contacts, count_edge, &c);
  keep_voids(voids, part, &c);
  summarise(voids);
  edges_clear(&cells);
  edges_clear(&contacts);
  free(rattler);
  free(c.parent);
  free(c.sides);
  free(c.open);
}

void tal_voids_clear(tal_voids *voids) {
  free(voids->item);
  free(voids->of);
  *voids = (tal_voids){0};
}
