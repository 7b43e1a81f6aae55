#include "boundary.h"

#include <stdlib.h>
#include <string.h>

static const tal_boundary *const boundaries[] = {&tal_boundary_pressure, &tal_boundary_membrane, &tal_boundary_minimal,
                                                 NULL};

const tal_boundary *tal_boundary_find(const char *name) {
  for (const tal_boundary *const *k = boundaries; *k; k++)
    if (!strcmp((*k)->name, name))
      return *k;
  return NULL;
}

void tal_boundary_let_go(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  if (!sim->boundary_moved)
    return;
  memset(g->bx, 0, g->count * sizeof *g->bx);
  memset(g->by, 0, g->count * sizeof *g->by);
  sim->boundary_moved = false;
}

void tal_boundary_prepare(tal_sim *sim) {
  const size_t count = sim->graph.loop.count;
  tal_boundary_let_go(sim);
  if (sim->loop_capacity >= count)
    return;
  free(sim->loop_centre);
  sim->loop_capacity = count + count / 8;
  sim->loop_centre = tal_alloc(sim->loop_capacity, sizeof *sim->loop_centre);
}

size_t tal_boundary_choices(tal_choice *out, size_t capacity) {
  size_t count = 0;
  for (; boundaries[count] && count < capacity; count++)
    out[count] = (tal_choice){boundaries[count]->name, boundaries[count]->help};
  return count;
}

size_t tal_method_choices(tal_choice *out, size_t capacity) {
  static const tal_choice methods[] = {{"exact", "the multiplier is solved for in every step: no error, no constant"},
                                       {"penalty", "a force in proportion to the error of the strain rate [P 3.4]"}};
  size_t count = sizeof methods / sizeof *methods;
  for (size_t k = 0; k < count && k < capacity; k++)
    out[k] = methods[k];
  return count < capacity ? count : capacity;
}
