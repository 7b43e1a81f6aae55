// The forced grain of a spin stage [P 4.2]: which one it is, and how it is turned.
#ifndef TAL_FORCED_H
#define TAL_FORCED_H

#include "sim.h"

// Contacts of each grain that carry force, into count[grains]; walls count.
void tal_forced_contacts(const tal_sim *sim, int *count);
// Index of the grain that the stage forces: the one listed, or the one that bears (two contacts) nearest to the mean of
// all centres. TAL_INVALID where no grain can be turned.
tal_status tal_forced_choose(const tal_sim *sim, const tal_scene_stage *plan, size_t *index, tal_error *err);
// Grains of an ensemble, ascending, in new memory owned by the caller: those listed, or `random` of them drawn without
// return from the scene's seed among grains that bear and lie at least `margin` mean diameters within the loop (of an
// assembly with a graph). TAL_BAD_INPUT "FILE:LINE: key: ..." where there are fewer.
tal_status tal_forced_draw(tal_sim *sim, const tal_scene_stage *plan, int64_t **ids, size_t *count, tal_error *err);
// Are the listed grains of every spin stage there and not fixed? TAL_BAD_INPUT "FILE:LINE: key: ...".
tal_status tal_forced_check(const tal_sim *sim, tal_error *err);

// From now on the grain turns as tal_forced_turn says. It comes to rest; what that takes is booked as work of the hold.
void tal_forced_take(tal_sim *sim, size_t index);
// Gives the grain of the stage before back to its torque; nothing where there is none.
void tal_forced_release(tal_sim *sim);
// Sets the spin [rad/s] at the end of the step that is about to be taken; the angle follows by the trapezoidal rule.
void tal_forced_turn(tal_sim *sim, double omega);
// What is to be known of the grain now (a rattler, on the rim), one sentence into text, "" for nothing.
void tal_forced_warning(const tal_sim *sim, char *text, size_t size);

#endif
