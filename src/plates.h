// The two plates of a biaxial test: horizontal walls without ends, one sided.
#ifndef TAL_PLATES_H
#define TAL_PLATES_H

#include "sim.h"

// Puts the plates against the outermost grains unless they are there. Same material as the grains.
void tal_plates_ensure(tal_sim *sim);
// Marks in sim->graph.side the grains at the bottom (1) and the top plate (2): those within a hundredth of a mean
// diameter of touching it and another grain. One that left the assembly along a plate is none.
void tal_plates_mark(tal_sim *sim);
double tal_plates_distance(const tal_sim *sim); // [m]
// Both plates approach each other at `speed` [m/s] in all, half each.
void tal_plates_drive(tal_sim *sim, double speed);
// Force servo, eq (23): each plate moves so that its load tends to `pressure` h times the width of the loop between the
// ends of the arcs at that plate. speed_limit [m/s].
void tal_plates_servo(tal_sim *sim, double pressure, double speed_limit);
// Sets the friction between plates and grains, in the contacts that are listed too.
void tal_plates_rub(tal_sim *sim, double friction);
// The plates slide sideways, against each other: each is as heavy as a row of grains, their friction drives them. What
// pushes both the same way holds. speed_limit [m/s].
void tal_plates_slide(tal_sim *sim, double speed_limit);
// Takes the plates away; they take the elastic energy of their contacts with them. What they did stays in the ledger as
// the work of walls that are never there again.
void tal_plates_remove(tal_sim *sim);

#endif
