#include "integrate.h"

#include <string.h>

static const tal_integrator *const integrators[] = {&tal_verlet, &tal_two_timescale, &tal_implicit_friction, NULL};

const tal_integrator *tal_integrator_find(const char *name) {
  for (const tal_integrator *const *k = integrators; *k; k++)
    if (!strcmp((*k)->name, name))
      return *k;
  return NULL;
}

int64_t tal_integrate_cycle(const tal_scene_integrator *plan) {
  const tal_integrator *scheme = tal_integrator_find(plan->scheme);
  return scheme->cycle ? scheme->cycle(plan) : 1;
}

int64_t tal_integrate_longest(const tal_scene_integrator *plan) {
  const tal_integrator *scheme = tal_integrator_find(plan->scheme);
  return scheme->length ? scheme->length(plan, 0) : 1;
}

size_t tal_integrator_choices(tal_choice *out, size_t capacity) {
  size_t count = 0;
  for (; integrators[count] && count < capacity; count++)
    out[count] = (tal_choice){integrators[count]->name, integrators[count]->help};
  return count;
}
