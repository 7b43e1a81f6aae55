// Macroscopic measures of one observed instant: loop (32), assembly stress from inside and from outside (36)-(40),
// powers (42)-(44), fabric, coordination, solid fraction, slip, unbalanced force (45)-(49). The two sides of each
// identity come from different numbers: the contact slots on one, the grains' resultants, walls and boundary forces on
// the other. Nothing here is integrated in time.
#include "continuum.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

static const double nothing = (double)NAN; // of what has no meaning

static bool touching(const tal_contacts *slots, size_t c) {
  return slots->overlap[c] > 0;
}

static geo_vec centre(const tal_grains *grains, int32_t i) {
  return (geo_vec){grains->x[i], grains->y[i]};
}

static geo_vec velocity(const tal_grains *grains, int32_t i) {
  return (geo_vec){grains->vx[i], grains->vy[i]};
}

static geo_tensor divided(geo_tensor sum, double volume) {
  return volume == 0 ? (geo_tensor){nothing, nothing, nothing, nothing} : geo_tensor_scale(1 / volume, sum);
}

// ---- The loop

// (47) for a node of the loop: the angle from the edge ahead round to the edge behind, on the left of a walk round it.
static double interior_angle(const tal_observed *seen, size_t k) {
  const geo_loop *loop = &seen->graph->loop;
  geo_vec here = centre(seen->grains, loop->node[k]);
  geo_vec ahead = geo_sub(centre(seen->grains, loop->node[(k + 1) % loop->count]), here);
  geo_vec behind = geo_sub(centre(seen->grains, loop->node[(k + loop->count - 1) % loop->count]), here);
  double angle = atan2(geo_cross(ahead, behind), geo_dot(ahead, behind));
  return angle < 0 ? angle + 2 * TAL_PI : angle;
}

static double solid_area(const tal_observed *seen) {
  const double *r = seen->grains->r;
  double sum = 0;
  for (size_t i = 0; i < seen->grains->count; i++)
    if (seen->graph->place[i] == TAL_PLACE_INTERIOR)
      sum += TAL_PI * r[i] * r[i];
  for (size_t k = 0; k < seen->graph->loop.count; k++) {
    double radius = r[seen->graph->loop.node[k]];
    sum += interior_angle(seen, k) / 2 * radius * radius;
  }
  return sum;
}

static void measure_extent(const tal_observed *seen, tal_macro *macro) {
  const geo_loop *loop = &seen->graph->loop;
  geo_vec low = centre(seen->grains, loop->node[0]), high = low;
  for (size_t k = 1; k < loop->count; k++) {
    geo_vec p = centre(seen->grains, loop->node[k]);
    low = (geo_vec){fmin(low.x, p.x), fmin(low.y, p.y)};
    high = (geo_vec){fmax(high.x, p.x), fmax(high.y, p.y)};
  }
  macro->width = high.x - low.x;
  macro->height = high.y - low.y;
}

static void measure_loop(const tal_observed *seen, tal_macro *macro) {
  const tal_grains *grains = seen->grains;
  const geo_loop *loop = &seen->graph->loop;
  macro->area = geo_loop_area(loop, grains->x, grains->y);
  macro->solid_fraction = macro->area == 0 ? nothing : solid_area(seen) / macro->area;
  macro->velocity_gradient = geo_loop_velocity_gradient(loop, grains->x, grains->y, grains->vx, grains->vy);
  measure_extent(seen, macro);
}

static void without_loop(tal_macro *macro) {
  geo_tensor none = {nothing, nothing, nothing, nothing};
  macro->area = macro->width = macro->height = macro->solid_fraction = nothing;
  macro->velocity_gradient = macro->stress = macro->stress_boundary = macro->stress_inertia = none;
  macro->power_contacts = macro->power_boundary = nothing;
}

// Centroid of the loop's area and mean velocity of its nodes: the frame in which the sums over grains round least.
static void frame_of_loop(const tal_observed *seen, geo_vec *origin, geo_vec *drift) {
  const geo_loop *loop = &seen->graph->loop;
  geo_vec first = centre(seen->grains, loop->node[0]), sum = {0, 0}, speed = {0, 0};
  double twice = 0;
  for (size_t k = 0; k < loop->count; k++) {
    geo_vec a = geo_sub(centre(seen->grains, loop->node[k]), first);
    geo_vec b = geo_sub(centre(seen->grains, loop->node[(k + 1) % loop->count]), first);
    double cross = geo_cross(a, b);
    twice += cross;
    sum = geo_add(sum, geo_scale(cross / 3, geo_add(a, b)));
    speed = geo_add(speed, velocity(seen->grains, loop->node[k]));
  }
  *origin = twice == 0 ? first : geo_add(first, geo_scale(1 / twice, sum));
  *drift = geo_scale(1 / (double)loop->count, speed);
}

// ---- The contacts

static void measure_contacts(const tal_observed *seen, double *mean_force_size, tal_macro *macro) {
  const tal_contacts *pairs = seen->pairs;
  geo_tensor moment = {0}, fabric = {0};
  double normal = 0, size = 0, slip = 0;
  for (size_t c = 0; c < pairs->count; c++) {
    if (!touching(pairs, c))
      continue;
    geo_vec force = tal_contact_force(pairs, c), n = {pairs->nx[c], pairs->ny[c]};
    geo_vec branch = geo_sub(centre(seen->grains, pairs->i[c]), centre(seen->grains, pairs->j[c]));
    moment = geo_tensor_add(moment, geo_outer(force, branch));
    fabric = geo_tensor_add(fabric, geo_outer(n, n));
    normal += pairs->fe[c] + pairs->fd[c];
    size += geo_norm(force);
    slip += fabs(pairs->slip[c]);
    macro->contacts++;
  }
  double count = macro->contacts ? (double)macro->contacts : nothing;
  macro->stress = divided(moment, macro->area * seen->thickness);
  macro->fabric = divided(fabric, count);
  macro->mean_force = normal / count;
  macro->mean_slip = seen->vR > 0 ? slip / count / seen->vR : nothing;
  macro->coordination = seen->grains->count ? 2 * (double)macro->contacts / (double)seen->grains->count : nothing;
  *mean_force_size = size / count;
}

// Contacts of each grain. A grain about to be removed has at most one partner left, so the exclusive or of its
// partners' indices is enough to find it: no adjacency list.
typedef struct bearing {
  int32_t walls, pairs, partners;
} bearing;

static void count_bearing(const tal_observed *seen, bearing *of) {
  for (size_t c = 0; c < seen->walls->count; c++)
    if (touching(seen->walls, c))
      of[seen->walls->i[c]].walls++;
  for (size_t c = 0; c < seen->pairs->count; c++) {
    if (!touching(seen->pairs, c))
      continue;
    int32_t i = seen->pairs->i[c], j = seen->pairs->j[c];
    of[i].pairs++;
    of[j].pairs++;
    of[i].partners ^= j;
    of[j].partners ^= i;
  }
}

// (46) Follows each chain of rattlers to its end; a removed grain is marked by walls = -1.
static double bearing_coordination(const tal_observed *seen, size_t contacts) {
  size_t n = seen->grains->count, bearers = n;
  bearing *of = tal_alloc(n, sizeof *of);
  count_bearing(seen, of);
  for (size_t start = 0; start < n; start++) {
    size_t i = start;
    while (of[i].walls >= 0 && of[i].walls + of[i].pairs < 2) {
      size_t partner = (size_t)of[i].partners;
      bool had_partner = of[i].pairs == 1;
      of[i] = (bearing){.walls = -1};
      bearers--;
      if (!had_partner)
        break;
      contacts--;
      of[partner].pairs--;
      of[partner].partners ^= (int32_t)i;
      i = partner;
    }
  }
  free(of);
  return bearers ? 2 * (double)contacts / (double)bearers : nothing;
}

// ---- The grains, seen from outside

typedef struct grain_forces {
  geo_vec external; // boundary force, gravity, reaction of what holds it; wall contacts come with the walls
  geo_vec inertia;  // m a
} grain_forces;

static grain_forces forces_on(const tal_observed *seen, size_t i) {
  const tal_grains *grains = seen->grains;
  geo_vec boundary = {grains->bx[i], grains->by[i]}, resultant = {grains->rx[i], grains->ry[i]};
  // Weight and the reaction -(resultant + weight) leave -resultant, whatever the mass.
  if (grains->inverse_mass[i] == 0)
    return (grain_forces){geo_sub(boundary, resultant), {0, 0}};
  geo_vec weight = {grains->mass[i] * seen->gravity[0], grains->mass[i] * seen->gravity[1]};
  return (grain_forces){geo_add(boundary, weight), geo_add(resultant, weight)};
}

// (38), (39), and the part of (43) that comes from outside the contacts between grains.
static void measure_outside(const tal_observed *seen, tal_macro *macro) {
  const tal_grains *grains = seen->grains;
  const tal_contacts *walls = seen->walls;
  geo_tensor external = {0}, inertia = {0};
  geo_vec origin, drift;
  double power = 0, volume = macro->area * seen->thickness;
  frame_of_loop(seen, &origin, &drift);
  for (size_t i = 0; i < grains->count; i++) {
    grain_forces forces = forces_on(seen, i);
    geo_vec x = geo_sub(centre(grains, (int32_t)i), origin), v = geo_sub(velocity(grains, (int32_t)i), drift);
    external = geo_tensor_add(external, geo_outer(forces.external, x));
    inertia = geo_tensor_add(inertia, geo_outer(forces.inertia, x));
    power += geo_dot(geo_sub(forces.external, forces.inertia), v);
  }
  for (size_t c = 0; c < walls->count; c++) {
    if (!touching(walls, c))
      continue;
    geo_vec force = tal_contact_force(walls, c);
    external = geo_tensor_add(external, geo_outer(force, geo_sub(centre(grains, walls->i[c]), origin)));
    power += geo_dot(force, geo_sub(velocity(grains, walls->i[c]), drift));
  }
  macro->stress_boundary = divided(external, -volume);
  macro->stress_inertia = divided(inertia, volume);
  macro->power_boundary = power;
}

// (43): contacts that no cell knows are external to the cells; each works on its two grains.
static double off_graph_power(const tal_observed *seen) {
  const tal_contacts *pairs = seen->pairs;
  double power = 0;
  for (size_t c = 0; c < pairs->count; c++) {
    int32_t cell[2];
    if (!touching(pairs, c) || tal_graph_edge_cells(seen->graph, pairs->i[c], pairs->j[c], cell))
      continue;
    geo_vec force = tal_contact_force(pairs, c);
    power += geo_dot(force, velocity(seen->grains, pairs->i[c]));
    power -= geo_dot(force, velocity(seen->grains, pairs->j[c]));
  }
  return power;
}

// (42) cell by cell. Writes the number of contacts that belong to no cell.
static double cells_power(const tal_observed *seen, size_t *contacts_off_graph) {
  const tal_graph *graph = seen->graph;
  geo_tensor *moment = tal_alloc(graph->cell_count, sizeof *moment);
  *contacts_off_graph = tal_cells_moments(seen, moment);
  double power = 0, area;
  for (size_t c = 0; c < graph->cell_count; c++) {
    const int32_t *corner = graph->mesh.corner[graph->cell[c]];
    geo_vec p[3], v[3];
    for (int k = 0; k < 3; k++) {
      p[k] = centre(seen->grains, corner[k]);
      v[k] = velocity(seen->grains, corner[k]);
    }
    power -= geo_contract(moment[c], tal_cell_gradient(p, v, &area));
  }
  free(moment);
  return power;
}

// Kinetic energy, and (49) once the mean force is known.
static void measure_motion(const tal_observed *seen, double mean_force_size, tal_macro *macro) {
  const tal_grains *grains = seen->grains;
  double unbalanced = 0, kinetic = 0;
  size_t free_count = 0;
  for (size_t i = 0; i < grains->count; i++) {
    geo_vec v = velocity(grains, (int32_t)i);
    kinetic += (grains->mass[i] * geo_dot(v, v) + grains->inertia[i] * grains->omega[i] * grains->omega[i]) / 2;
    if (grains->inverse_mass[i] == 0)
      continue;
    free_count++;
    unbalanced += geo_norm(forces_on(seen, i).inertia);
  }
  macro->kinetic = kinetic;
  macro->unbalanced = free_count && mean_force_size > 0 ? unbalanced / (double)free_count / mean_force_size : nothing;
}

void tal_macro_measure(const tal_observed *seen, tal_macro *macro) {
  double mean_force_size;
  *macro = (tal_macro){0};
  if (seen->graph->valid)
    measure_loop(seen, macro);
  else
    without_loop(macro);
  measure_contacts(seen, &mean_force_size, macro);
  measure_motion(seen, mean_force_size, macro);
  macro->coordination_bearing = bearing_coordination(seen, macro->contacts);
  macro->contacts_off_graph = macro->contacts;
  if (!seen->graph->valid)
    return;
  assert(seen->graph->grain_count == seen->grains->count);
  measure_outside(seen, macro);
  macro->power_contacts = cells_power(seen, &macro->contacts_off_graph);
  if (macro->contacts_off_graph)
    macro->power_boundary += off_graph_power(seen);
}
