// Allocation of the grains from their field list.
#include "grains.h"

#include <stdlib.h>

void tal_grains_init(tal_grains *grains, size_t count) {
  grains->count = count;
#define X(type, name, unit, kept, meaning) grains->name = tal_alloc(count, sizeof(type));
  TAL_GRAIN_FIELDS(X)
#undef X
  for (size_t i = 0; i < count; i++)
    grains->id[i] = (int64_t)i;
}

#define IF_STATE(...)
#define IF_WORK(...)
#define IF_SEEN(...) __VA_ARGS__

void tal_grains_show(tal_grains *grains) {
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept(if (!grains->name) grains->name = tal_alloc(grains->count, sizeof(type));)
  TAL_GRAIN_FIELDS(X)
#undef X
}

void tal_grains_hide(tal_grains *grains) {
#define X(type, name, unit, kept, meaning) IF_##kept(free(grains->name); grains->name = NULL;)
  TAL_GRAIN_FIELDS(X)
#undef X
}

void tal_grains_clear(tal_grains *grains) {
#define X(type, name, unit, kept, meaning) free(grains->name);
  TAL_GRAIN_FIELDS(X)
#undef X
  *grains = (tal_grains){0};
}
