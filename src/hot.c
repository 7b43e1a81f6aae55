#include "hot.h"

#include <string.h>

#define TABLE(text, width)                                                                                             \
  { text, tal_forces_range##width, tal_drift_group##width, tal_implicit_take##width, tal_implicit_work##width }

#ifdef TAL_HAVE_WIDTHS
#define X(result, name, arguments)                                                                                     \
  result tal_##name##_v3 arguments;                                                                                    \
  result tal_##name##_v4 arguments;
TAL_HOT_FUNCTIONS(X)
#undef X
static const tal_hot v3 = TABLE("v3", _v3), v4 = TABLE("v4", _v4);
#endif
static const tal_hot base = TABLE("base", );

// The widest first.
static const tal_hot *runnable(size_t k) {
#ifdef TAL_HAVE_WIDTHS
  const bool has_v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool has_v4 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                      __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512vl");
  if (has_v3 && has_v4 && k-- == 0)
    return &v4;
  if (has_v3 && k-- == 0)
    return &v3;
#endif
  return k == 0 ? &base : NULL;
}

const tal_hot *tal_hot_best(void) {
  return runnable(0);
}

const tal_hot *tal_hot_find(const char *name) {
  for (size_t k = 0; runnable(k); k++)
    if (strcmp(runnable(k)->name, name) == 0)
      return runnable(k);
  return NULL;
}
