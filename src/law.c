#include "law.h"

#include <string.h>

static const struct tal_law hertz = {"hertz", "Hertz contact, force K d^1.5, viscosity T K d^0.5 d'", TAL_EFFECT_HERTZ};
static const struct tal_law linear = {"linear", "linear spring and dashpot, force k d + c d'", 0};
static const struct tal_law *const normal_laws[] = {&hertz, &linear, NULL};

static const struct tal_law none = {"none", "no friction", 0};
static const struct tal_law regularised = {"regularised", "friction mu fn (s/vR)^(1/c), viscous near rest",
                                           TAL_EFFECT_REGULARISED};
static const struct tal_law spring = {"spring", "incremental tangential spring with Coulomb cap", TAL_EFFECT_SPRING};
static const struct tal_law *const tangential_laws[] = {&none, &regularised, &spring, NULL};

static const struct tal_law *find(const struct tal_law *const *laws, const char *name) {
  for (; *laws; laws++)
    if (!strcmp((*laws)->name, name))
      return *laws;
  return NULL;
}

static size_t choices(const struct tal_law *const *laws, tal_choice *out, size_t capacity) {
  size_t count = 0;
  for (; laws[count] && count < capacity; count++)
    out[count] = (tal_choice){laws[count]->name, laws[count]->help};
  return count;
}

const struct tal_law *tal_normal_law_find(const char *name) {
  return find(normal_laws, name);
}
const struct tal_law *tal_tangential_law_find(const char *name) {
  return find(tangential_laws, name);
}
size_t tal_normal_law_choices(tal_choice *out, size_t capacity) {
  return choices(normal_laws, out, capacity);
}
size_t tal_tangential_law_choices(tal_choice *out, size_t capacity) {
  return choices(tangential_laws, out, capacity);
}
