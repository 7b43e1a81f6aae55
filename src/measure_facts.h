// What the measurements need of run.json: the thickness and the friction of each stage.
#ifndef TAL_MEASURE_FACTS_H
#define TAL_MEASURE_FACTS_H

#include "base.h"

typedef struct tal_measure_facts {
  double thickness; // [m] 1 when it is not known: stresses then count per metre of thickness
  double friction;  // of the material, 0 when it is not known
  size_t stage_count;
  double *stage_friction; // owned; [stage_count]
} tal_measure_facts;

// Never fails: what is not there stays at the values above.
void tal_measure_facts_read(tal_measure_facts *facts, const char *dir);
void tal_measure_facts_clear(tal_measure_facts *facts);
// Friction between grains in that stage.
double tal_measure_facts_friction(const tal_measure_facts *facts, int64_t stage);

#endif
