// Two time scales [P 2.4, 2.20]: cycles of N_S = m (n + q) small steps, m times one step of n dt followed by q steps of
// dt, each a step of velocity Verlet, eqs (12)-(17). The long steps carry the slow motion, the short ones let friction
// settle: m (1 + q) evaluations of the forces in the time of N_S small steps. dt is the small step; time and steps are
// counted in small steps. Where a cycle stands follows from the steps taken in the stage, so a run resumes anywhere.
#include "integrate.h"

static int64_t cycle(const tal_scene_integrator *plan) {
  return plan->m * (plan->n + plan->q);
}

static int64_t length(const tal_scene_integrator *plan, int64_t done) {
  return done % (plan->n + plan->q) == 0 ? plan->n : 1;
}

const tal_integrator tal_two_timescale = {.name = "two_timescale",
                                          .help = "cycles of m times one step of n dt and q steps of dt",
                                          .cycle = cycle,
                                          .length = length,
                                          .advance = tal_integrate_verlet_step};
