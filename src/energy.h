// The energy ledger, eqs (16)-(20): always on, exact for the discrete motion except for what the elastic forces lose to
// the finite step, which is the residual.
#ifndef TAL_ENERGY_H
#define TAL_ENERGY_H

#include "sim.h"

double tal_energy_kinetic(const tal_grains *grains);                               // [J]
double tal_energy_gravity(const tal_grains *grains, const double gravity[2]);      // [J]
double tal_energy_elastic(const tal_sim *sim);                                     // [J] springs included
double tal_energy_springs(const tal_sim *sim);                                     // [J] tangential springs alone
double tal_energy_normal(const tal_sim *sim, const tal_contacts *slots, size_t c); // [J] of one slot's normal force

// Credits the grains' accounts with `weight` [s] times the power of the forces of this (observed) instant. A run
// credits dt per step; the first and last instants of a stage count half.
void tal_energy_credit(tal_sim *sim, double weight);
// Fills the ledger columns of a row from an observed instant.
void tal_energy_row(const tal_sim *sim, tal_row *row);
// What the residual of a row is a share of [J]: everything that changed hands, and what was there to begin with.
double tal_energy_scale(const tal_sim *sim, const tal_row *row);
// What the ledger cannot know of this instant [J], eq (D5): the work of one step, and how far full-step energies swing
// about the conserved one.
double tal_energy_of_a_step(const tal_sim *sim);

#endif
