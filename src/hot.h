// The hot loops for the processor at hand. Their files (HOT in the Makefile) are compiled for several widths of vectors
// from one source, renamed by width.h; a run takes the widest that the processor has. Same bits with all.
#ifndef TAL_HOT_H
#define TAL_HOT_H

#include "drift.h"
#include "forces_range.h"
#include "implicit_parts.h"

// X(result, name, arguments): tal_<name> of the headers above.
#define TAL_HOT_FUNCTIONS(X)                                                                                           \
  X(int64_t, forces_range, (tal_sim * sim, const tal_sweep *sweep, int part, int parts))                               \
  X(int64_t, drift_group, (tal_sim * sim, size_t start, int count, double dt, tal_grain_record *record))               \
  X(double, implicit_take,                                                                                             \
    (const tal_implicit_solve *s, tal_implicit_pass pass, size_t start, int count, double factor))                     \
  X(tal_implicit_works, implicit_work, (const tal_implicit_solve *s, size_t start, int count))

struct tal_hot {
  const char *name; // "v4": AVX-512, "v3": AVX2, "base": what the rest of the program was compiled for
#define X(result, name, arguments) result(*name) arguments;
  TAL_HOT_FUNCTIONS(X)
#undef X
};

// The widest loops that this processor runs.
const tal_hot *tal_hot_best(void);
// By name; NULL when the program has none such or the processor cannot run them.
const tal_hot *tal_hot_find(const char *name);

#endif
