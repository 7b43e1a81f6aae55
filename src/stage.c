#include "stage.h"

#include <string.h>

static const tal_stage *const stages[] = {&tal_stage_free,
                                          &tal_stage_confine,
                                          &tal_stage_compress,
                                          &tal_stage_shear,
                                          &tal_stage_deform,
                                          &tal_stage_spin,
                                          NULL};

const tal_stage *tal_stage_find(const char *name) {
  for (const tal_stage *const *k = stages; *k; k++)
    if (!strcmp((*k)->name, name))
      return *k;
  return NULL;
}

size_t tal_stage_choices(tal_choice *out, size_t capacity) {
  size_t count = 0;
  for (; stages[count] && count < capacity; count++)
    out[count] = (tal_choice){stages[count]->name, stages[count]->help};
  return count;
}
