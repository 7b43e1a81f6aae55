// A step's sweep over the contacts, shared out among threads.
#include "forces.h"

#include "drift.h"
#include "hot.h"
#include "kick.h"

#include <omp.h>
#include <stdlib.h>

static void reserve_rings(tal_sim *sim, size_t threads) {
  const size_t ring = sim->neighbours.ring;
  if (sim->ring_capacity >= ring * threads)
    return;
  free(sim->sums);
  free(sim->rings);
  sim->ring_capacity = ring * threads;
  sim->sums = tal_alloc(sim->ring_capacity, sizeof *sim->sums);
  sim->rings = tal_alloc(2 * sim->ring_capacity, sizeof *sim->rings);
}

// Ranges are longer than what is worked out twice for them.
static int useful_threads(const tal_sim *sim) {
  size_t ranges = sim->grains.count / (4 * TAL_KICK_GRAINS + 2 * sim->neighbours.span);
  size_t threads = (size_t)omp_get_max_threads();
  return (int)(ranges < 1 ? 1 : ranges < threads ? ranges : threads);
}

void tal_forces_step(tal_sim *sim, double dt, double credit, bool drifts) {
  const int threads = useful_threads(sim);
  tal_sweep sweep = tal_sweep_of(sim, dt);
  sweep.drifts = drifts;
  reserve_rings(sim, (size_t)threads);
  tal_forces_forget(sim);
  int64_t fastest = 0;
#pragma omp parallel num_threads(threads) if (threads > 1) reduction(max : fastest)
  fastest = sim->hot->forces_range(sim, &sweep, omp_get_thread_num(), omp_get_num_threads());
  sim->next_stride = tal_drift_stride(sim->dt_next, fastest);
  tal_kick_book(sim, credit);
}
