// A membrane on either side between plates [P 3.2]: bead chains (membrane.h) that carry the pressure to the grains. The
// beads move by the same scheme as the grains, (12)-(15); their ends go up and down with the plates.
#include "boundary.h"

#include "membrane.h"
#include "walls.h"

#include <string.h>

static void refreshed(tal_sim *sim) {
  sim->boundary_moved = true; // what an earlier boundary pressed with
}

static void apply(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  const tal_membrane *m = &sim->membrane;
  tal_boundary_let_go(sim);
  for (size_t c = 0; c < m->contact_count; c++)
    g->bx[m->contact[c].grain] = g->by[m->contact[c].grain] = 0;
  tal_membrane_forces(sim);
}

static double plate_speed(const tal_sim *sim, double side) {
  return tal_walls_plate(&sim->walls, side > 0 ? +1 : -1)->vy;
}

// (12)-(14): half kick, drift, the velocity that the laws see.
static void drift(tal_sim *sim, double dt) {
  tal_membrane *m = &sim->membrane;
  for (size_t b = 0; b < m->count; b++) {
    const bool end = m->plate[b] != 0;
    double kick_x = 0.5 * dt * (m->fx[b] / m->mass[b]), kick_y = 0.5 * dt * (m->fy[b] / m->mass[b]);
    m->vx[b] += kick_x;
    m->vy[b] = end ? plate_speed(sim, m->plate[b]) : m->vy[b] + kick_y;
    m->x[b] += dt * m->vx[b];
    m->y[b] += dt * m->vy[b];
    m->ux[b] = m->vx[b] + kick_x;
    m->uy[b] = end ? m->vy[b] : m->vy[b] + kick_y;
  }
}

static void take_forces(tal_membrane *m) {
  memcpy(m->fx, m->rx, m->count * sizeof *m->fx);
  memcpy(m->fy, m->ry, m->count * sizeof *m->fy);
}

static void note_powers(tal_sim *sim) {
  tal_membrane_power p = tal_membrane_powers(sim);
  sim->run.membrane_pressure_power = p.pressure;
  sim->run.membrane_ends_power = p.ends;
  sim->run.membrane_grains_power = p.grains;
  sim->run.membrane_lost_power = p.lost;
}

// (15), and the powers of the instant.
static void finish(tal_sim *sim, double dt, double credit) {
  tal_membrane *m = &sim->membrane;
  take_forces(m);
  for (size_t b = 0; b < m->count; b++) {
    m->vx[b] += 0.5 * dt * (m->fx[b] / m->mass[b]);
    m->vy[b] += m->plate[b] != 0 ? 0 : 0.5 * dt * (m->fy[b] / m->mass[b]);
    m->ux[b] = m->vx[b];
    m->uy[b] = m->vy[b];
  }
  note_powers(sim);
  tal_membrane_credit(sim, credit);
}

static tal_status begin(tal_sim *sim, const tal_scene_stage *plan, tal_error *err) {
  if (sim->membrane.count || tal_membrane_lay(sim, &plan->membrane))
    return TAL_OK;
  return tal_fail(err, TAL_INVALID,
                  "stages[%d]: the membrane does not come to rest on the sample under %g Pa; a stiffer membrane "
                  "(membrane.stiffness) or less pressure",
                  (int)sim->run.stage, plan->pressure);
}

static void start(tal_sim *sim) {
  tal_membrane *m = &sim->membrane;
  for (size_t b = 0; b < m->count; b++)
    if (m->plate[b] != 0)
      m->vy[b] = m->uy[b] = plate_speed(sim, m->plate[b]);
  apply(sim);
  take_forces(m);
  note_powers(sim);
}

static void restored(tal_sim *sim) {
  tal_membrane *m = &sim->membrane;
  memcpy(m->ux, m->vx, m->count * sizeof *m->ux);
  memcpy(m->uy, m->vy, m->count * sizeof *m->uy);
  m->listed = 0;
}

const tal_boundary tal_boundary_membrane = {.name = "membrane",
                                            .help = "chains of beads on both sides, pressed from outside",
                                            .plates = true,
                                            .begin = begin,
                                            .refreshed = refreshed,
                                            .apply = apply,
                                            .start = start,
                                            .drift = drift,
                                            .finish = finish,
                                            .restored = restored,
                                            .critical = tal_membrane_critical,
                                            .check = tal_membrane_check};
