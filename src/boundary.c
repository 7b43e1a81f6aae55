#include "boundary.h"

#include <string.h>

static const tal_boundary *const boundaries[] = {&tal_boundary_pressure, NULL};

const tal_boundary *tal_boundary_find(const char *name) {
  for (const tal_boundary *const *k = boundaries; *k; k++)
    if (!strcmp((*k)->name, name))
      return *k;
  return NULL;
}

size_t tal_boundary_choices(tal_choice *out, size_t capacity) {
  size_t count = 0;
  for (; boundaries[count] && count < capacity; count++)
    out[count] = (tal_choice){boundaries[count]->name, boundaries[count]->help};
  return count;
}
