// Pressure on the Delaunay boundary, eq (22) [P 2.5, 3.2]: each edge of the loop carries p h times its length along the
// inward normal, half to each end. On a closed loop that is a force and moment free system of uniform stress p.
// With plates only the two arcs between the outermost grains at the plates are pressed; the plates load the rest. The
// arcs' ends need not be of one height: the horizontal part of the pressure on the chord between the two ends at a
// plate makes up for that, so that the pressure pushes nothing sideways and bears no shear. While the plates bed a
// packing's uneven ends few grains touch: the arcs then end at the corners of the sample.
#include "boundary.h"

// Loop places of the leftmost and rightmost grain at the plate; the grain nearest the plate when there is none.
static void plate_ends(const tal_sim *sim, int plate, int64_t *left, int64_t *right) {
  const geo_loop *loop = &sim->graph.loop;
  const tal_grains *g = &sim->grains;
  int64_t nearest = 0;
  *left = *right = -1;
  for (int64_t k = 0; k < (int64_t)loop->count; k++) {
    int32_t i = loop->node[k], n = loop->node[nearest];
    if (plate * g->y[i] - g->r[i] < plate * g->y[n] - g->r[n])
      nearest = k;
    if (sim->graph.side[i] != (plate > 0 ? 1 : 2))
      continue;
    if (*left < 0 || g->x[i] < g->x[loop->node[*left]])
      *left = k;
    if (*right < 0 || g->x[i] > g->x[loop->node[*right]])
      *right = k;
  }
  if (*left < 0)
    *left = *right = nearest;
}

// Loop places furthest out along the diagonals on the plate's side.
static void corners(const tal_sim *sim, int side, int64_t *left, int64_t *right) {
  const geo_loop *loop = &sim->graph.loop;
  const tal_grains *g = &sim->grains;
  *left = *right = 0;
  for (int64_t k = 0; k < (int64_t)loop->count; k++) {
    int32_t i = loop->node[k], l = loop->node[*left], r = loop->node[*right];
    if (-g->x[i] - side * g->y[i] > -g->x[l] - side * g->y[l])
      *left = k;
    if (g->x[i] - side * g->y[i] > g->x[r] - side * g->y[r])
      *right = k;
  }
}

static void refreshed(tal_sim *sim) {
  sim->boundary_moved = true;
  if (!tal_walls_plate(&sim->walls, +1) || !tal_walls_plate(&sim->walls, -1)) {
    sim->run.arc_bottom_left = sim->run.arc_bottom_right = sim->run.arc_top_right = sim->run.arc_top_left = 0;
    return;
  }
  if (sim->run.bedding) {
    corners(sim, +1, &sim->run.arc_bottom_left, &sim->run.arc_bottom_right);
    corners(sim, -1, &sim->run.arc_top_left, &sim->run.arc_top_right);
    return;
  }
  plate_ends(sim, +1, &sim->run.arc_bottom_left, &sim->run.arc_bottom_right);
  plate_ends(sim, -1, &sim->run.arc_top_left, &sim->run.arc_top_right);
}

// The grains [from, to) whose forces are wanted.
typedef struct own {
  size_t from, to;
} own;

static void push(tal_sim *sim, own o, int32_t grain, double fx, double fy) {
  if ((size_t)grain < o.from || (size_t)grain >= o.to)
    return;
  sim->grains.bx[grain] += fx;
  sim->grains.by[grain] += fy;
}

// The given number of edges counter-clockwise from place `from`.
static void press_arc(tal_sim *sim, own o, int64_t from, size_t edges) {
  const geo_loop *loop = &sim->graph.loop;
  const double(*at)[2] = (const double(*)[2])sim->loop_centre;
  const double half = 0.5 * sim->run.pressure * sim->constants.thickness;
  size_t k = (size_t)from;
  for (size_t e = 0; e < edges; e++) {
    size_t next = k + 1 == loop->count ? 0 : k + 1;
    // inward normal times length of a counter-clockwise edge
    double fx = -half * (at[next][1] - at[k][1]), fy = half * (at[next][0] - at[k][0]);
    push(sim, o, loop->node[k], fx, fy);
    push(sim, o, loop->node[next], fx, fy);
    k = next;
  }
}

static size_t edges_between(const geo_loop *loop, int64_t from, int64_t to) {
  return (size_t)(to >= from ? to - from : to + (int64_t)loop->count - from);
}

// The horizontal part of the pressure on the straight line between two places, shared by the grains of the loop from
// the one to the other.
static void press_chord(tal_sim *sim, own o, int64_t from, int64_t to) {
  const geo_loop *loop = &sim->graph.loop;
  const size_t grains = edges_between(loop, from, to) + 1;
  const double rise = sim->loop_centre[to][1] - sim->loop_centre[from][1];
  const double fx = -sim->run.pressure * sim->constants.thickness * rise / (double)grains;
  for (size_t k = 0; k < grains; k++)
    push(sim, o, loop->node[((size_t)from + k) % loop->count], fx, 0);
}

static void press(tal_sim *sim, size_t from, size_t to) {
  const geo_loop *loop = &sim->graph.loop;
  const tal_run *run = &sim->run;
  const own o = {from, to};
  for (size_t k = 0; k < loop->count; k++)
    if ((size_t)loop->node[k] >= from && (size_t)loop->node[k] < to)
      sim->grains.bx[loop->node[k]] = sim->grains.by[loop->node[k]] = 0;
  if (!tal_walls_plate(&sim->walls, +1)) {
    press_arc(sim, o, 0, loop->count);
    return;
  }
  press_arc(sim, o, run->arc_bottom_right, edges_between(loop, run->arc_bottom_right, run->arc_top_right));
  press_arc(sim, o, run->arc_top_left, edges_between(loop, run->arc_top_left, run->arc_bottom_left));
  press_chord(sim, o, run->arc_bottom_left, run->arc_bottom_right);
  press_chord(sim, o, run->arc_top_right, run->arc_top_left);
}

static void apply(tal_sim *sim) {
  const geo_loop *loop = &sim->graph.loop;
  tal_boundary_prepare(sim);
  for (size_t k = 0; k < loop->count; k++) {
    sim->loop_centre[k][0] = sim->grains.x[loop->node[k]];
    sim->loop_centre[k][1] = sim->grains.y[loop->node[k]];
  }
  press(sim, 0, sim->grains.count);
}

const tal_boundary tal_boundary_pressure = {.name = "pressure",
                                            .help = "pressure on the grains of the Delaunay boundary",
                                            .plates = true,
                                            .refreshed = refreshed,
                                            .apply = apply,
                                            .press = press};
