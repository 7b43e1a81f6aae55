// Force chains as objects: quasi-linear chains of highly stressed grains, followed from frame to frame, and clusters of
// strong contacts. Rule (M15)-(M19) after J. F. Peters, M. Muthuswamy, J. Wibowo, A. Tordesillas, Phys. Rev. E 72
// (2005) 041307: neighbours in a chain touch, both carry a major principal stress above the mean, and their branch lies
// within an angle of the major principal direction of both. Each grain has at most one link on either side; where
// several offer themselves, the straightest is taken.
#ifndef TAL_MEASURE_CHAINS_H
#define TAL_MEASURE_CHAINS_H

#include "measure_snapshot.h"

#define TAL_CHAIN_ANGLE (TAL_PI / 4)
enum { TAL_CHAIN_LEAST = 3 }; // grains

typedef struct tal_chain {
  size_t first, count; // its grains are grain[first ...] in order
  double length, span; // [m] along the branches, from end to end
  double mean_fn;      // [N] of its links
  double stress;       // [Pa] mean major principal stress of its grains
  double angle;        // [rad] of the line from end to end, in [0, pi)
} tal_chain;

typedef struct tal_chains {
  double *major, *direction; // owned; [grains of the snapshot] major principal stress [Pa], its angle [rad]
  double mean_major;         // [Pa] over the part's grains that carry load: the threshold
  size_t bearing, strong;    // grains of the part that carry load, and more than that
  size_t count;
  tal_chain *chain;   // owned; [count]
  size_t grain_count; // in all chains
  int32_t *grain;     // owned; [grain_count] indices
  int32_t *of;        // owned; [grains of the snapshot] chain, -1: in none
  size_t link_count;  //
  int32_t *link;      // owned; [link_count] contacts of the snapshot that are links of a chain
} tal_chains;

// angle [rad] in (0, pi/2).
void tal_chains_find(tal_chains *chains, const tal_part *part, double angle);
void tal_chains_clear(tal_chains *chains);

// Grains joined by contacts above the part's mean force.
typedef struct tal_clusters {
  size_t count;          // with two grains or more
  size_t largest;        // grains
  double share;          // of the grains that have a strong contact, in the largest
  bool spans_x, spans_y; // one reaches from within a mean diameter of one end to the other
} tal_clusters;
tal_clusters tal_clusters_find(const tal_part *part);

#endif
