// The neighbour list: candidate slots within a skin, and for each grain its slots in the order of its partners.
#ifndef TAL_NEIGHBOURS_H
#define TAL_NEIGHBOURS_H

#include "cells.h"
#include "records.h"
#include <stdbool.h>

struct tal_sim;

typedef struct tal_neighbours {
  geo_pairs far;       // owned; pairs of grains closer than contact plus `reach` when the bucket grid was searched
  double reach;        // [m]
  double far_moved;    // [m] no grain has moved further since then; NAN: they do not count
  double far_radii;    // [m] sum of the radii then
  int32_t *first;      // owned; [n + 1] start of each grain's incidences; NULL where nobody looked
  int32_t *slot;       // owned; [2 pairs] slot index c; where the grain is the slot's j: ~c
  int32_t *wall_first; // owned; [n + 1] the same for wall contacts; only meaningful when there are any
  size_t grain_capacity;
  size_t span;    // largest j - i of the slots
  size_t ring;    // grains that the hot loop must hold at a time, a power of two
  tal_seat *seat; // owned; [slots + 3] of each slot's grains in such a ring; zeros behind: they are read in fours
  double moved;   // [m] no grain has moved further than this since the list was built
  double stride;  // [m] no grain moved further than this in the last step
  int unseen;     // steps since the displacements were looked at
  uint64_t rebuilds;
} tal_neighbours;

void tal_neighbours_init(tal_neighbours *neighbours);
void tal_neighbours_clear(tal_neighbours *neighbours);
// Rebuilds the list of `sim` from the present centres; spring histories are carried over by (i, j).
void tal_neighbours_rebuild(struct tal_sim *sim);
// Each grain's incidences: made where this list has none yet, and thrown away.
void tal_neighbours_deal(struct tal_sim *sim);
void tal_neighbours_forget(tal_neighbours *neighbours);
// Makes the list of a restored run again: that of the centres it was last built from, so that the order of the contacts
// and the moment of the next rebuild are those of the unbroken run.
void tal_neighbours_restore(struct tal_sim *sim);
// Before or after a drift in which no grain moves by more than `step` [m] and after that of the walls: true, and the
// step is taken into account, when that much is enough to know that no two bodies off the list meet.
bool tal_neighbours_hold(struct tal_sim *sim, double step);
// After a step in which no grain has moved by more than `step` [m]: true when two bodies not on the list may have met
// since it was built, a wall has come or gone, or a coordinate is no number.
bool tal_neighbours_stale(struct tal_sim *sim, double step);

#endif
