// One gnuplot run: a script and data files in a temporary folder, no shell, no start-up file, a time limit, a PNG that
// is checked and then moved to its place. Text of the user enters a script through tal_plot_text only.
#ifndef TAL_FIGURES_GNUPLOT_H
#define TAL_FIGURES_GNUPLOT_H

#include "base.h"
#include <stdbool.h>
#include <stdio.h>

typedef struct tal_plot {
  char *folder;      // owned; the temporary folder; gnuplot works there
  FILE *script;      // open from begin to finish
  bool write_failed; // a data file could not be written
  bool empty;        // set by who draws: there is nothing to see, make no file
  double time_limit; // [s] for gnuplot; 120 by default
  size_t drawn;      // elements of the current plot command, see tal_plot_element
} tal_plot;

// Makes the temporary folder inside `folder` and opens the script. TAL_IO.
tal_status tal_plot_begin(tal_plot *plot, const char *folder, tal_error *err);
// Terminal of width x height pixels; `font` in points. Text is enhanced unless an element says `noenhanced`.
void tal_plot_canvas(tal_plot *plot, int width, int height, int font);
// Writes `text` as a single-quoted gnuplot string that shows it literally (say `noenhanced` after it): single quotes
// made typographic, control characters and malformed UTF-8 replaced, more than `limit` characters cut. Nothing in it is
// ever evaluated.
void tal_plot_text(FILE *out, const char *text, size_t limit);
// A data file of this name in the temporary folder, to be given back to tal_plot_data_end. NULL when it cannot be made
// (the failure is reported by finish).
FILE *tal_plot_data(tal_plot *plot, const char *name);
void tal_plot_data_end(tal_plot *plot, FILE *data);
// Starts the next element of a plot command: "plot " the first time since tal_plot_command_end, then a comma.
void tal_plot_element(tal_plot *plot);
void tal_plot_command_end(tal_plot *plot);
// Step of ticks: 1, 2 or 5 times a power of ten, about `parts` of them over `range` > 0.
double tal_plot_tick_step(double range, double parts);
// Runs gnuplot unless plot->empty, moves the picture to `png`, removes the temporary folder. TAL_IO with gnuplot's own
// words when it fails, when it is not installed, or takes too long; TAL_INTERRUPTED when SIGINT or SIGTERM ended it.
tal_status tal_plot_finish(tal_plot *plot, const char *png, tal_error *err);

#endif
