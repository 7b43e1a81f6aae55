// The granular assembly as a continuum: cells, loop, strain [Bagi, Satake], stress [Christoffersen], fabric;
// docs/method.md (30)-(49).
// Signs: stress and pressure positive in compression; velocity gradients keep the mathematical sign.
// Index order: L_ab = dv_a/dx_b, so stress_ab = (1/Ah) sum f_a (x_i - x_j)_b (force first, branch second), raw. In this
// order the contacts absorb the power -A h stress_ab L_ab with no symmetrisation.
#ifndef TAL_CONTINUUM_H
#define TAL_CONTINUUM_H

#include "boundary_loop.h"
#include "contacts.h"
#include "delaunay.h"
#include "grains.h"
#include "mesh.h"
#include <stdbool.h>

// The graph and what is integrated over it. Reference positions are those of the last refresh. "Cell" is a triangle
// inside the loop; cells are numbered in the order of the mesh's triangles.
typedef struct tal_graph {
  const geo_delaunay_backend *backend;
  bool power;            // power instead of plain Delaunay
  double gap_limit;      // [m] peel times the mean diameter; infinite (no peeling) after init
  geo_mesh mesh;         // T triangles of grain indices
  geo_loop loop;         // counter-clockwise boundary grains
  unsigned char *inside; // owned; [T] 1 for cells inside the loop
  unsigned char *side; // owned; [n] the rigid side a grain rests on (1, 2, ...) or 0, for the next refresh; may be NULL
  double *x, *y;       // owned; [n] centres at the last refresh [m]
  size_t grain_count;  // n
  bool valid;          // false before the first refresh and after a failed one
  // Derived from mesh, loop and inside by refresh and restore.
  uint64_t indexed;        // revision of the mesh that the index belongs to
  bool edges_on_demand;    // the three arrays of edges are made by tal_graph_index_edges alone, else by each refresh
  size_t cell_count;       // C
  int32_t *cell;           // owned; [C] triangle of each cell
  unsigned char *place;    // owned; [n] a tal_place
  size_t *edge_start;      // owned; [n+1] edges (i, .) are edge_start[i] ... edge_start[i+1]-1
  int32_t *edge_end;       // owned; [E] larger grain of each edge of a cell, ascending for each i
  int32_t (*edge_cell)[2]; // owned; [E][2] the cells on the edge, the second -1 at the rim
} tal_graph;

// Where a grain lies: no corner of a cell, corner of cells only inside, or node of the loop.
enum tal_place { TAL_PLACE_OUTSIDE = 0, TAL_PLACE_INTERIOR = 1, TAL_PLACE_BOUNDARY = 2 };

// The first backend, plain Delaunay, no peeling, not valid.
void tal_graph_init(tal_graph *graph);
void tal_graph_clear(tal_graph *graph);
// Triangulates, peels, stores the reference positions. TAL_INVALID with the reason when no assembly is left (fewer than
// three grains, all on one line, two at one place, a centre that is no number, everything peeled); then valid is false.
tal_status tal_graph_refresh(tal_graph *graph, const tal_grains *grains, tal_error *err);
// Puts back a stored graph: triangles [T][3] counter-clockwise in any order, loop nodes [B], inside [T] in the order of
// the triangles given, reference positions [n]. valid is false when there are no loop nodes.
void tal_graph_restore(tal_graph *graph, size_t n, const int32_t (*corner)[3], size_t triangle_count,
                       const int32_t *node, size_t node_count, const unsigned char *inside, const double *x,
                       const double *y);
// Makes the index of edges where there is none, and throws it away.
void tal_graph_index_edges(tal_graph *graph);
void tal_graph_forget_edges(tal_graph *graph);
// The cells that share the edge (i, j), i < j: returns how many (0, 1 or 2) and fills as many of `cell`.
// O(log edges of i).
size_t tal_graph_edge_cells(const tal_graph *graph, int32_t i, int32_t j, int32_t cell[2]);

// What the measures below look at: one observed instant (slots and rx, ry hold forces with that instant's velocities).
typedef struct tal_observed {
  const tal_grains *grains;
  const tal_contacts *pairs; // grain-grain slots
  const tal_contacts *walls; // grain-wall slots (j = wall)
  const tal_graph *graph;    // may be invalid (graph->valid false): loop-based measures are then NAN
  double gravity[2];         // [m/s^2]
  double thickness;          // h [m]
  double vR;                 // [m/s] reference slip speed, NAN: mean_slip is NAN
} tal_observed;

typedef struct tal_macro {
  double area;                  // [m^2] inside the loop
  double width, height;         // [m] extent of the loop's centres
  geo_tensor stress;            // [Pa] (1/Ah) sum over touching grain-grain pairs of force (x) branch, raw (36)
  geo_tensor stress_boundary;   // [Pa] the same from pressure, walls, gravity, holds of fixed grains, at centres (38)
  geo_tensor stress_inertia;    // [Pa] inertia part: stress = stress_boundary + stress_inertia to round-off (39)
  geo_tensor velocity_gradient; // [1/s] of the loop (32)
  geo_tensor fabric;            // sum of n (x) n over touching pairs / number of touching pairs (45)
  double coordination;          // 2 contacts / grains, walls not counted
  double coordination_bearing;  // the same without rattlers; walls help to bear but are not counted (46)
  double solid_fraction;        // disc area inside the loop / loop area, boundary grains by their angle (47)
  double mean_slip;             // mean |slip| of touching pairs over vR (48)
  double unbalanced;            // mean |resultant incl. gravity| of free grains / mean |force| of pairs (49)
  double mean_force;            // [N] mean normal force of touching pairs
  double kinetic;               // [J] translation + rotation
  double power_contacts;        // [W] that contacts absorb in the cells: -sum of A h stress : L (42)
  double power_boundary;        // [W] the same from external forces, off-graph contacts and inertia (43)
  size_t contacts;              // touching pairs
  size_t contacts_off_graph;    // touching pairs that are no edge of a cell
} tal_macro;

// All of tal_macro in O(n). What has no meaning (no loop, no contact, no grain) is NAN; counts are then 0. Needs the
// grains the graph was made of (same count). Summed in index order: the same bits for any number of threads.
void tal_macro_measure(const tal_observed *seen, tal_macro *macro);

// X(name, unit, meaning) of the per-cell doubles.
#define TAL_CELL_FIELDS(X)                                                                                             \
  X(area, "m^2", "area")                                                                                               \
  X(Lxx, "1/s", "velocity gradient dvx/dx")                                                                            \
  X(Lxy, "1/s", "velocity gradient dvx/dy")                                                                            \
  X(Lyx, "1/s", "velocity gradient dvy/dx")                                                                            \
  X(Lyy, "1/s", "velocity gradient dvy/dy")                                                                            \
  X(strain_xx, "1", "symmetric displacement gradient since the last refresh")                                          \
  X(strain_xy, "1", "symmetric displacement gradient since the last refresh")                                          \
  X(strain_yy, "1", "symmetric displacement gradient since the last refresh")                                          \
  X(stress_xx, "Pa", "stress, compression positive, raw, first index: force")                                          \
  X(stress_xy, "Pa", "stress, compression positive, raw, first index: force")                                          \
  X(stress_yx, "Pa", "stress, compression positive, raw, first index: force")                                          \
  X(stress_yy, "Pa", "stress, compression positive, raw, first index: force")                                          \
  X(L_II, "1/s", "second invariant of the deviator of D = sym L: sqrt(D':D'/2)")                                       \
  X(pressure, "Pa", "(stress_xx + stress_yy)/2")

// The cells inside the loop. A cell that has no area has NAN for whatever is divided by it; one that has turned over
// since the last refresh keeps its negative area, so that sums over cells stay exact.
typedef struct tal_cells {
  size_t count;                              // 0 without a valid graph
  int32_t (*corner)[3];                      // owned; [count][3] grain indices
#define X(name, unit, meaning) double *name; // owned; [count]
  TAL_CELL_FIELDS(X)
#undef X
} tal_cells;

void tal_cells_init(tal_cells *cells);
void tal_cells_clear(tal_cells *cells);
// Sizes the arrays and fills every field, (31), (34), (35), (37).
void tal_cells_measure(const tal_observed *seen, tal_cells *cells);
// A h stress of each cell [N m], (37): half of each contact on its edges, all of it where the edge is at the rim.
// Adds to moment[cell_count], zero before; returns the number of touching pairs that belong to no cell.
size_t tal_cells_moments(const tal_observed *seen, geo_tensor *moment);
// Stress of each grain [Pa], (41): (1/(pi r^2 h)) sum over its contacts (walls too) of force (x) (centre - contact
// point); compression positive, raw; writes stress[n].
void tal_grain_stress(const tal_observed *seen, geo_tensor *stress);

// Gradient [1/m times the unit of u] of the field that is linear on the triangle p [m] with the values u at its
// corners: (31) for the two edges from corner 0, by Cramer's rule. area [m^2], signed; NAN where it is 0.
static inline geo_tensor tal_cell_gradient(const geo_vec p[3], const geo_vec u[3], double *area) {
  geo_vec e1 = geo_sub(p[1], p[0]), e2 = geo_sub(p[2], p[0]);
  geo_vec d1 = geo_sub(u[1], u[0]), d2 = geo_sub(u[2], u[0]);
  double twice = geo_cross(e1, e2), scale = twice == 0 ? (double)NAN : 1 / twice;
  *area = twice / 2;
  return geo_tensor_scale(scale, (geo_tensor){d1.x * e2.y - d2.x * e1.y, d2.x * e1.x - d1.x * e2.x,
                                              d1.y * e2.y - d2.y * e1.y, d2.y * e1.x - d1.y * e2.x});
}

// Force on grain i of slot c [N].
static inline geo_vec tal_contact_force(const tal_contacts *slots, size_t c) {
  double fn = slots->fe[c] + slots->fd[c], ft = slots->ft[c];
  return (geo_vec){fn * slots->nx[c] - ft * slots->ny[c], fn * slots->ny[c] + ft * slots->nx[c]};
}

#endif
