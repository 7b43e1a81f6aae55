// Is a run's folder whole? Looks at every file; changes nothing.
#ifndef TAL_VERIFY_H
#define TAL_VERIFY_H

#include "base.h"
#include <stdbool.h>

// One finding: a sentence naming the file, and whether it means damage (else: worth knowing).
typedef void tal_finding(void *context, bool damage, const char *sentence);

typedef struct tal_verify_counts {
  size_t rows, frames, checkpoints; // sound ones
  size_t damages, notes;
} tal_verify_counts;

// Checks: seals of frames, fields.h5 and checkpoints; series.csv and tracks.csv (columns, whole lines, times and steps
// that grow); frames against fields.h5; checkpoints against the CSV and the frames. TAL_OK, TAL_IO when something is
// damaged, TAL_BAD_INPUT with `err` when `dir` holds no run.
tal_status tal_verify(const char *dir, tal_finding *finding, void *context, tal_verify_counts *counts, tal_error *err);

#endif
