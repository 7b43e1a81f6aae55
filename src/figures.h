// Figures of a run, drawn by gnuplot from series.csv and the field frames in DIR.
#ifndef TAL_FIGURES_H
#define TAL_FIGURES_H

#include "base.h"

// Draws every figure the data in `dir` allows into dir/figures (PNG). *count: how many. TAL_IO when gnuplot or a
// file fails, TAL_BAD_INPUT when `dir` holds no run.
tal_status tal_figures_draw(const char *dir, int *count, tal_error *err);

// The same, telling each file as it is made. What fails does not keep the other figures from being drawn: the first
// failure is returned at the end. TAL_INTERRUPTED when a signal ended gnuplot.
typedef void tal_figure_made(void *user, const char *path);
tal_status tal_figures_draw_each(const char *dir, tal_figure_made *made, void *user, int *count, tal_error *err);

#endif
