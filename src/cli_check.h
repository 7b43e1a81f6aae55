// Parts of `talus check`.
#ifndef TAL_CLI_CHECK_H
#define TAL_CLI_CHECK_H

#include "sim.h"

// The names of the effects in a mask (effects.h), separated by commas.
void tal_check_effect_names(unsigned effects, char *to, size_t size);
// One line: what each effect of the first stage costs [ns per grain and step], found by short trials; nothing when one
// of them goes bad. Shortens the steps of `scene`; `step_seconds`: about what a step takes.
void tal_check_print_costs(tal_scene *scene, double step_seconds);

#endif
