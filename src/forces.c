// A step's sweep over the contacts, shared out among threads.
#include "forces.h"

#include "hot.h"
#include "kick.h"

#include <omp.h>
#include <stdlib.h>

static void reserve_sums(tal_sim *sim, int threads) {
  size_t needed = sim->neighbours.ring * (size_t)threads;
  if (needed <= sim->sums_capacity)
    return;
  free(sim->sums);
  sim->sums = tal_alloc(needed, sizeof *sim->sums);
  sim->sums_capacity = needed;
}

// Ranges are longer than what is worked out twice for them.
static int useful_threads(const tal_sim *sim) {
  size_t ranges = sim->grains.count / (4 * TAL_KICK_GRAINS + 2 * sim->neighbours.span);
  size_t threads = (size_t)omp_get_max_threads();
  return (int)(ranges < 1 ? 1 : ranges < threads ? ranges : threads);
}

void tal_forces_step(tal_sim *sim, double dt, double credit) {
  const int threads = useful_threads(sim);
  const tal_sweep sweep = tal_sweep_of(sim, dt);
  reserve_sums(sim, threads);
  tal_forces_sweep_walls(sim, dt);
  tal_forces_forget(sim);
#pragma omp parallel num_threads(threads) if (threads > 1)
  sim->hot->forces_range(sim, &sweep, omp_get_thread_num(), omp_get_num_threads());
  tal_kick_book(sim, credit);
}
