#include "integrate.h"

#include <string.h>

static const tal_integrator *const integrators[] = {&tal_verlet, &tal_implicit_friction, NULL};

const tal_integrator *tal_integrator_find(const char *name) {
  for (const tal_integrator *const *k = integrators; *k; k++)
    if (!strcmp((*k)->name, name))
      return *k;
  return NULL;
}

size_t tal_integrator_choices(tal_choice *out, size_t capacity) {
  size_t count = 0;
  for (; integrators[count] && count < capacity; count++)
    out[count] = (tal_choice){integrators[count]->name, integrators[count]->help};
  return count;
}
