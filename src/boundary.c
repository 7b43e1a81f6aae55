#include "boundary.h"

#include "kick.h"

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

// What presses acts on the loop's grains alone.
static void mark_pressed(tal_sim *sim) {
  const bool loop_only = sim->boundary && sim->boundary->press;
  memset(sim->pressed, !loop_only, sim->grains.count / TAL_KICK_GRAINS + 1);
  for (size_t k = 0; loop_only && k < sim->graph.loop.count; k++)
    sim->pressed[sim->graph.loop.node[k] / TAL_KICK_GRAINS] = 1;
}

void tal_boundary_let_go(tal_sim *sim) {
  tal_grains *g = &sim->grains;
  if (!sim->boundary_moved)
    return;
  mark_pressed(sim);
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
