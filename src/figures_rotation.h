// Figures of `talus rotation` [P figs 4.4, 4.5], into DIR/rotation.
#ifndef TAL_FIGURES_ROTATION_H
#define TAL_FIGURES_ROTATION_H

#include "rotation.h"

// One grain: map.png (its surroundings, spins and forces), rose.png (W and the axes of Sym(T)), transmission.png.
// Several: transmission.png (each and their mean), lengths.png (distributions), sectors.png (transmission over what the
// chains do). TAL_IO.
tal_status tal_rotation_figures(const tal_rotations *all, const char *dir, const tal_rotation_options *options,
                                tal_error *err);

#endif
