// See measure_chains.h.
#include "measure_chains.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- sets of grains ----

static int32_t root_of(int32_t *parent, int32_t k) {
  while (parent[k] != k)
    k = parent[k] = parent[parent[k]];
  return k;
}

// False when they were together already. The lower index stays the root.
static bool join(int32_t *parent, int32_t a, int32_t b) {
  a = root_of(parent, a);
  b = root_of(parent, b);
  parent[a > b ? a : b] = a < b ? a : b;
  return a != b;
}

static int32_t *singles(size_t count) {
  int32_t *parent = tal_alloc(count, sizeof *parent);
  for (size_t k = 0; k < count; k++)
    parent[k] = (int32_t)k;
  return parent;
}

// ---- links ----

static bool is_strong(const tal_chains *chains, const tal_part *part, int32_t k) {
  return part->grain[k] && chains->major[k] > chains->mean_major;
}

// A grain whose only contacts are hairs (measure_snapshot.h) has a stress of round-off.
static bool *touching_of(const tal_snapshot *s) {
  bool *touching = tal_alloc(s->grain_count, sizeof *touching);
  for (size_t c = 0; c < s->contacts.count; c++)
    touching[s->contacts.i[c]] = touching[s->contacts.j[c]] = true;
  for (size_t c = 0; c < s->walls.count; c++)
    touching[s->walls.i[c]] = true;
  return touching;
}

// In closed form: it is done for every grain of every frame.
static void measure_grains(tal_chains *chains, const tal_part *part) {
  const tal_snapshot *s = part->of;
  bool *touching = touching_of(s);
  double sum = 0;
  for (size_t k = 0; k < s->grain_count; k++) {
    const double half = (s->stress_xx[k] - s->stress_yy[k]) / 2, shear = (s->stress_xy[k] + s->stress_yx[k]) / 2;
    chains->major[k] = (s->stress_xx[k] + s->stress_yy[k]) / 2 + hypot(half, shear);
    chains->direction[k] = atan2(shear, half) / 2;
    chains->major[k] = touching[k] ? chains->major[k] : 0;
    if (!part->grain[k] || !(chains->major[k] > 0))
      continue;
    chains->bearing++;
    sum += chains->major[k];
  }
  free(touching);
  chains->mean_major = chains->bearing ? sum / (double)chains->bearing : 0;
  for (size_t k = 0; k < s->grain_count; k++)
    chains->strong += is_strong(chains, part, (int32_t)k);
}

typedef struct link {
  double score; // the smaller cosine
  int32_t contact, end[2];
  uint8_t side[2]; // of the grain's principal axis on which the link leaves it
} link;

static int straightest_first(const void *a, const void *b) {
  const link *p = a, *q = b;
  if (p->score != q->score)
    return p->score < q->score ? 1 : -1;
  return p->contact < q->contact ? -1 : 1;
}

static size_t list_links(const tal_chains *chains, const tal_part *part, double least, link *links) {
  const tal_snapshot_contacts *contacts = &part->of->contacts;
  size_t count = 0;
  for (size_t k = 0; k < part->contact_count; k++) {
    const int32_t c = part->contact[k], i = contacts->i[c], j = contacts->j[c];
    if (!is_strong(chains, part, i) || !is_strong(chains, part, j) || !(contacts->fn[c] > 0))
      continue;
    const double nx = contacts->nx[c], ny = contacts->ny[c]; // from j to i
    const double at_i = -(nx * cos(chains->direction[i]) + ny * sin(chains->direction[i]));
    const double at_j = nx * cos(chains->direction[j]) + ny * sin(chains->direction[j]);
    const double score = fmin(fabs(at_i), fabs(at_j));
    if (score >= least)
      links[count++] = (link){score, c, {i, j}, {at_i > 0, at_j > 0}};
  }
  qsort(links, count, sizeof *links, straightest_first);
  return count;
}

// Takes links from the straightest on while both ends are free on that side; none that closes a ring. next[k][side]:
// the neighbour of grain k, and contact[k][side] the link, -1: none.
static void take_links(const link *links, size_t count, size_t grains, int32_t (*next)[2], int32_t (*contact)[2]) {
  int32_t *parent = singles(grains);
  for (size_t k = 0; k < grains; k++)
    next[k][0] = next[k][1] = contact[k][0] = contact[k][1] = -1;
  for (size_t k = 0; k < count; k++) {
    const link *l = &links[k];
    int32_t *from = &next[l->end[0]][l->side[0]], *to = &next[l->end[1]][l->side[1]];
    if (*from >= 0 || *to >= 0 || !join(parent, l->end[0], l->end[1]))
      continue;
    *from = l->end[1];
    *to = l->end[0];
    contact[l->end[0]][l->side[0]] = contact[l->end[1]][l->side[1]] = l->contact;
  }
  free(parent);
}

// ---- chains ----

static void finish_chain(tal_chains *chains, const tal_snapshot *s, tal_chain *chain) {
  const int32_t *grain = chains->grain + chain->first;
  const int32_t a = grain[0], b = grain[chain->count - 1];
  for (size_t k = 0; k < chain->count; k++) {
    chain->stress += chains->major[grain[k]] / (double)chain->count;
    chains->of[grain[k]] = (int32_t)chains->count;
    if (k)
      chain->length += hypot(s->x[grain[k]] - s->x[grain[k - 1]], s->y[grain[k]] - s->y[grain[k - 1]]);
  }
  chain->mean_fn /= (double)(chain->count - 1);
  chain->span = hypot(s->x[b] - s->x[a], s->y[b] - s->y[a]);
  const double angle = atan2(s->y[b] - s->y[a], s->x[b] - s->x[a]);
  chain->angle = angle < 0 ? angle + TAL_PI : angle >= TAL_PI ? 0 : angle;
  chains->chain[chains->count++] = *chain;
}

// Follows the links from an end. Too short a chain leaves no trace.
static void follow(tal_chains *chains, const tal_snapshot *s, int32_t start, const int32_t (*next)[2],
                   const int32_t (*contact)[2]) {
  tal_chain chain = {.first = chains->grain_count};
  const size_t links = chains->link_count;
  int32_t before = -1, at = start;
  while (at >= 0) {
    chains->grain[chain.first + chain.count++] = at;
    // Two grains have one contact, so the side that does not lead back leads on.
    const int side = next[at][0] >= 0 && next[at][0] != before ? 0 : 1;
    const int32_t on = next[at][side] != before ? next[at][side] : -1;
    if (on >= 0) {
      chain.mean_fn += s->contacts.fn[contact[at][side]];
      chains->link[chains->link_count++] = contact[at][side];
    }
    before = at;
    at = on;
  }
  if (chain.count < TAL_CHAIN_LEAST) {
    chains->link_count = links;
    return;
  }
  chains->grain_count += chain.count;
  finish_chain(chains, s, &chain);
}

static void follow_all(tal_chains *chains, const tal_snapshot *s, const int32_t (*next)[2],
                       const int32_t (*contact)[2]) {
  bool *done = tal_alloc(s->grain_count, sizeof *done);
  for (size_t k = 0; k < s->grain_count; k++) {
    const bool end = (next[k][0] >= 0) != (next[k][1] >= 0);
    if (!end || done[k])
      continue;
    const size_t first = chains->grain_count;
    follow(chains, s, (int32_t)k, next, contact);
    for (size_t m = first; m < chains->grain_count; m++)
      done[chains->grain[m]] = true;
  }
  free(done);
}

void tal_chains_find(tal_chains *chains, const tal_part *part, double angle) {
  const size_t n = part->of->grain_count;
  *chains = (tal_chains){.major = tal_alloc(n, sizeof(double)), .direction = tal_alloc(n, sizeof(double))};
  link *links = tal_alloc(part->contact_count, sizeof *links);
  int32_t(*next)[2] = tal_alloc(n, sizeof *next), (*contact)[2] = tal_alloc(n, sizeof *contact);
  measure_grains(chains, part);
  take_links(links, list_links(chains, part, cos(angle), links), n, next, contact);
  chains->grain = tal_alloc(n + TAL_CHAIN_LEAST, sizeof *chains->grain); // a short chain is tried, then dropped
  chains->chain = tal_alloc(n / TAL_CHAIN_LEAST + 1, sizeof *chains->chain);
  chains->link = tal_alloc(n + TAL_CHAIN_LEAST, sizeof *chains->link);
  chains->of = memset(tal_alloc(n, sizeof *chains->of), 0xff, n * sizeof *chains->of);
  follow_all(chains, part->of, (const int32_t(*)[2])next, (const int32_t(*)[2])contact);
  free(links);
  free(next);
  free(contact);
}

void tal_chains_clear(tal_chains *chains) {
  void *const owned[] = {chains->major, chains->direction, chains->chain, chains->grain, chains->of, chains->link};
  for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
    free(owned[k]);
  *chains = (tal_chains){0};
}

// ---- clusters ----

typedef struct extent {
  double x0, x1, y0, y1;
} extent;

static const extent nowhere = {HUGE_VAL, -HUGE_VAL, HUGE_VAL, -HUGE_VAL};

static void widen(extent *e, const tal_snapshot *s, size_t k) {
  e->x0 = fmin(e->x0, s->x[k] - s->r[k]);
  e->x1 = fmax(e->x1, s->x[k] + s->r[k]);
  e->y0 = fmin(e->y0, s->y[k] - s->r[k]);
  e->y1 = fmax(e->y1, s->y[k] + s->r[k]);
}

static int32_t *join_strong(const tal_part *part) {
  const tal_snapshot_contacts *contacts = &part->of->contacts;
  int32_t *parent = singles(part->of->grain_count);
  for (size_t k = 0; k < part->contact_count; k++)
    if (contacts->fn[part->contact[k]] > part->mean_fn)
      join(parent, contacts->i[part->contact[k]], contacts->j[part->contact[k]]);
  return parent;
}

static void judge_clusters(tal_clusters *clusters, const tal_part *part, const int32_t *size, const extent *reach) {
  const tal_snapshot *s = part->of;
  const double d = part->mean_diameter;
  extent all = nowhere;
  size_t members = 0;
  for (size_t k = 0; k < s->grain_count; k++)
    if (part->grain[k])
      widen(&all, s, k);
  for (size_t k = 0; k < s->grain_count; k++) {
    if (size[k] < 2)
      continue;
    const size_t grains = (size_t)size[k];
    clusters->count++;
    members += grains;
    clusters->largest = grains > clusters->largest ? grains : clusters->largest;
    clusters->spans_x |= reach[k].x0 < all.x0 + d && reach[k].x1 > all.x1 - d;
    clusters->spans_y |= reach[k].y0 < all.y0 + d && reach[k].y1 > all.y1 - d;
  }
  clusters->share = members ? (double)clusters->largest / (double)members : 0;
}

tal_clusters tal_clusters_find(const tal_part *part) {
  const size_t n = part->of->grain_count;
  tal_clusters clusters = {0};
  int32_t *parent = join_strong(part), *size = tal_alloc(n, sizeof *size);
  extent *reach = tal_alloc(n, sizeof *reach);
  for (size_t k = 0; k < n; k++)
    reach[k] = nowhere;
  for (size_t k = 0; k < n; k++) {
    const int32_t root = root_of(parent, (int32_t)k);
    size[root]++;
    widen(&reach[root], part->of, k);
  }
  judge_clusters(&clusters, part, size, reach);
  free(parent);
  free(size);
  free(reach);
  return clusters;
}
