// The order of grains in memory. Neighbours in space shall be neighbours in memory: the hot loop holds the grains
// between the two ends of a contact in the cache, and threads take ranges of grains (forces_range.c). Large samples are
// laid in layers across their shorter side, once, when they are made. Who writes for users gives grains in the order of
// their ids.
#ifndef TAL_ORDER_H
#define TAL_ORDER_H

#include "continuum.h"

// Fewer grains than this stay in the order of the packing: they fit into the cache in any order.
enum { TAL_ORDER_FROM = 2000 };

// Puts the grains, ids and all, into layers one mean diameter thick, each along its length. Before anything refers to
// a grain by its index. The order follows from centres and radii alone.
void tal_order_grains(tal_grains *grains);

// An observed instant in the order of ids.
typedef struct tal_by_id {
  tal_observed seen; // what to look at: the original where it is in order, else the copies below
  tal_grains grains; // owned, as all that follows
  tal_contacts pairs, walls;
  tal_graph graph;
} tal_by_id;

void tal_by_id_init(tal_by_id *copy, const tal_observed *seen);
void tal_by_id_clear(tal_by_id *copy);
// Index of each id; owned by the caller. [count]
int32_t *tal_order_of_ids(const tal_grains *grains);

#endif
