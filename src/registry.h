// Names of everything a scene can choose by name. Each kind of variant keeps a NULL-terminated list of constant
// descriptors whose first two members are `name` and `help`; the scene loader and `talus keys` read only those.
#ifndef TAL_REGISTRY_H
#define TAL_REGISTRY_H

#include <stddef.h>

typedef struct tal_choice {
  const char *name;
  const char *help;
} tal_choice;

// Each writes the choices in registry order into out[capacity] and returns their number.
size_t tal_normal_law_choices(tal_choice *out, size_t capacity);     // law.c
size_t tal_tangential_law_choices(tal_choice *out, size_t capacity); // law.c
size_t tal_integrator_choices(tal_choice *out, size_t capacity);     // integrate.c
size_t tal_boundary_choices(tal_choice *out, size_t capacity);       // boundary.c
size_t tal_method_choices(tal_choice *out, size_t capacity);         // boundary.c
size_t tal_stage_choices(tal_choice *out, size_t capacity);          // stage.c
size_t tal_packer_choices(tal_choice *out, size_t capacity);         // pack.c

#endif
