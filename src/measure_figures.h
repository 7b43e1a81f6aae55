// Curves drawn from the finished tables of `talus measure`.
#ifndef TAL_MEASURE_FIGURES_H
#define TAL_MEASURE_FIGURES_H

#include "measure_list.h"

// Every curve the tables in run->out allow. A failure is kept in run; the rest is drawn.
void tal_measure_curves_draw(tal_measuring *run);

#endif
