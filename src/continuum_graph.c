// The Delaunay graph of the assembly, its loop, and the index from an edge to the cells that share it. (30)
// The triangulation and the peeling are geom's; the time of a refresh is the caller's choice.
#include "continuum.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void tal_graph_init(tal_graph *graph) {
  *graph = (tal_graph){.backend = geo_delaunay_backends()[0], .gap_limit = (double)INFINITY};
  geo_mesh_init(&graph->mesh);
  geo_loop_init(&graph->loop);
}

void tal_graph_forget_edges(tal_graph *graph) {
  free(graph->edge_start);
  free(graph->edge_end);
  free(graph->edge_cell);
  graph->edge_start = NULL;
  graph->edge_end = NULL;
  graph->edge_cell = NULL;
}

static void clear_index(tal_graph *graph) {
  tal_graph_forget_edges(graph);
  free(graph->cell);
  free(graph->place);
  graph->cell = NULL;
  graph->place = NULL;
  graph->cell_count = 0;
}

void tal_graph_clear(tal_graph *graph) {
  geo_mesh_clear(&graph->mesh);
  geo_loop_clear(&graph->loop);
  free(graph->inside);
  free(graph->side);
  free(graph->x);
  free(graph->y);
  clear_index(graph);
  *graph = (tal_graph){0};
}

// Numbers the cells in triangle order.
static void number_cells(tal_graph *graph) {
  graph->cell = tal_alloc(graph->mesh.triangle_count, sizeof *graph->cell);
  for (size_t t = 0; t < graph->mesh.triangle_count; t++)
    if (graph->inside[t])
      graph->cell[graph->cell_count++] = (int32_t)t;
}

// Number of the cell of each triangle, -1 outside; owned by the caller.
static int32_t *cell_numbers(const tal_graph *graph) {
  int32_t *number = tal_alloc(graph->mesh.triangle_count, sizeof *number);
  for (size_t t = 0; t < graph->mesh.triangle_count; t++)
    number[t] = -1;
  for (size_t c = 0; c < graph->cell_count; c++)
    number[graph->cell[c]] = (int32_t)c;
  return number;
}

static void place_grains(tal_graph *graph) {
  graph->place = tal_alloc(graph->grain_count, sizeof *graph->place);
  for (size_t c = 0; c < graph->cell_count; c++)
    for (int k = 0; k < 3; k++)
      graph->place[graph->mesh.corner[graph->cell[c]][k]] = TAL_PLACE_INTERIOR;
  for (size_t k = 0; k < graph->loop.count; k++)
    graph->place[graph->loop.node[k]] = TAL_PLACE_BOUNDARY;
}

// Edges of cells, compressed by their smaller grain. geo_mesh_edges gives them ascending in (i, j).
void tal_graph_index_edges(tal_graph *graph) {
  if (graph->edge_start || !graph->cell)
    return;
  int32_t *number = cell_numbers(graph);
  size_t capacity = 3 * graph->mesh.triangle_count, n = graph->grain_count;
  geo_edge *edges = tal_alloc(capacity, sizeof *edges);
  size_t edge_count = geo_mesh_edges(&graph->mesh, edges), kept = 0;
  graph->edge_start = tal_alloc(n + 1, sizeof *graph->edge_start);
  graph->edge_end = tal_alloc(edge_count, sizeof *graph->edge_end);
  graph->edge_cell = tal_alloc(edge_count, sizeof *graph->edge_cell);
  for (size_t e = 0; e < edge_count; e++) {
    int32_t a = number[edges[e].t], b = edges[e].u < 0 ? -1 : number[edges[e].u];
    if (a < 0 && b < 0)
      continue;
    graph->edge_start[edges[e].i + 1]++;
    graph->edge_end[kept] = edges[e].j;
    graph->edge_cell[kept][0] = a < 0 ? b : a;
    graph->edge_cell[kept++][1] = a < 0 ? -1 : b;
  }
  for (size_t i = 0; i < n; i++)
    graph->edge_start[i + 1] += graph->edge_start[i];
  free(edges);
  free(number);
}

static void index_cells(tal_graph *graph) {
  clear_index(graph);
  number_cells(graph);
  place_grains(graph);
  if (!graph->edges_on_demand)
    tal_graph_index_edges(graph);
  graph->indexed = graph->mesh.revision;
}

static void keep_reference(tal_graph *graph, size_t n, const double *x, const double *y) {
  if (graph->grain_count != n || !graph->x) {
    free(graph->x);
    free(graph->y);
    graph->x = tal_alloc(n, sizeof *graph->x);
    graph->y = tal_alloc(n, sizeof *graph->y);
    graph->grain_count = n;
  }
  memcpy(graph->x, x, n * sizeof *x);
  memcpy(graph->y, y, n * sizeof *y);
}

static geo_delaunay_result triangulate(tal_graph *graph, const tal_grains *grains, geo_delaunay_report *report) {
  size_t n = grains->count;
  double *weight = graph->power ? tal_alloc(n, sizeof *weight) : NULL;
  for (size_t i = 0; weight && i < n; i++)
    weight[i] = grains->r[i] * grains->r[i];
  geo_delaunay_result result =
      geo_delaunay_update(graph->backend, grains->x, grains->y, weight, n, &graph->mesh, report);
  free(weight);
  return result;
}

// Peels; *as_before: cells and loop are those that the index belongs to. False when nothing is left.
static bool peel(tal_graph *graph, const tal_grains *g, bool *as_before) {
  size_t count = graph->mesh.triangle_count;
  unsigned char *before = graph->inside;
  graph->inside = tal_alloc(count, sizeof *graph->inside);
  bool left =
      geo_loop_peel(&graph->loop, &graph->mesh, g->x, g->y, g->r, graph->side, graph->gap_limit, graph->inside) == 0;
  *as_before = graph->cell && graph->indexed == graph->mesh.revision && memcmp(before, graph->inside, count) == 0;
  free(before);
  return left;
}

tal_status tal_graph_refresh(tal_graph *graph, const tal_grains *grains, tal_error *err) {
  geo_delaunay_report report = {.first = -1, .second = -1};
  bool as_before;
  graph->valid = false;
  if (triangulate(graph, grains, &report) != GEO_DELAUNAY_OK)
    return tal_fail(err, TAL_INVALID, "no Delaunay graph of the %zu grains: %s", grains->count, report.text);
  if (!peel(graph, grains, &as_before))
    return tal_fail(err, TAL_INVALID,
                    "no assembly is left of the %zu grains: gaps wider than %g m let every cell be peeled off",
                    grains->count, graph->gap_limit);
  keep_reference(graph, grains->count, grains->x, grains->y);
  if (!as_before)
    index_cells(graph);
  graph->valid = true;
  return TAL_OK;
}

typedef struct flagged {
  int32_t corner[3];
  unsigned char inside;
} flagged;

static int compare_flagged(const void *a, const void *b) {
  const int32_t *p = ((const flagged *)a)->corner, *q = ((const flagged *)b)->corner;
  for (int k = 0; k < 3; k++)
    if (p[k] != q[k])
      return p[k] < q[k] ? -1 : 1;
  return 0;
}

// Brings the flags into the order in which geo_mesh_set keeps the triangles: smallest corner first, ascending.
static void restore_inside(tal_graph *graph, const int32_t (*corner)[3], size_t count, const unsigned char *inside) {
  flagged *all = tal_alloc(count, sizeof *all);
  for (size_t t = 0; t < count; t++) {
    const int32_t *c = corner[t];
    int first = c[0] < c[1] && c[0] < c[2] ? 0 : c[1] < c[2] ? 1 : 2;
    for (int k = 0; k < 3; k++)
      all[t].corner[k] = c[(first + k) % 3];
    all[t].inside = inside[t];
  }
  qsort(all, count, sizeof *all, compare_flagged);
  free(graph->inside);
  graph->inside = tal_alloc(count, sizeof *graph->inside);
  for (size_t t = 0; t < count; t++) {
    assert(memcmp(all[t].corner, graph->mesh.corner[t], sizeof all[t].corner) == 0);
    graph->inside[t] = all[t].inside;
  }
  free(all);
}

// As the peeling counts them: points of the mesh that are no corner of a cell.
static size_t points_outside(const tal_graph *graph) {
  unsigned char *counted = tal_alloc(graph->grain_count, sizeof *counted);
  size_t count = 0;
  for (size_t t = 0; t < graph->mesh.triangle_count; t++)
    for (int k = 0; k < 3; k++) {
      int32_t i = graph->mesh.corner[t][k];
      count += graph->place[i] == TAL_PLACE_OUTSIDE && !counted[i];
      counted[i] = 1;
    }
  free(counted);
  return count;
}

void tal_graph_restore(tal_graph *graph, size_t n, const int32_t (*corner)[3], size_t triangle_count,
                       const int32_t *node, size_t node_count, const unsigned char *inside, const double *x,
                       const double *y) {
  geo_mesh_set(&graph->mesh, n, corner, triangle_count);
  geo_loop_set(&graph->loop, node, node_count);
  restore_inside(graph, corner, triangle_count, inside);
  keep_reference(graph, n, x, y);
  index_cells(graph);
  graph->loop.triangle_count = graph->cell_count;
  graph->loop.outside_count = points_outside(graph);
  graph->valid = node_count > 0;
}

size_t tal_graph_edge_cells(const tal_graph *graph, int32_t i, int32_t j, int32_t cell[2]) {
  assert(i < j && (size_t)j < graph->grain_count);
  size_t first = graph->edge_start[i], end = graph->edge_start[i + 1];
  while (end - first > 8) { // a large grain may have thousands of edges
    size_t middle = first + (end - first) / 2;
    if (graph->edge_end[middle] <= j)
      first = middle;
    else
      end = middle;
  }
  while (first < end && graph->edge_end[first] != j)
    first++;
  if (first == end)
    return 0;
  cell[0] = graph->edge_cell[first][0];
  cell[1] = graph->edge_cell[first][1];
  return cell[1] < 0 ? 1 : 2;
}
