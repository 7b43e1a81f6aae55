// Force chains in time: which chain goes on as which, how long each lives, and where they buckle (M20)-(M22).
// Buckling after A. Tordesillas, Phil. Mag. 87 (2007) 4987: three neighbours of a chain of the frame before whose angle
// has closed by more than 2 x 1 degree while the load of the middle grain fell.
#ifndef TAL_MEASURE_CHAIN_LIVES_H
#define TAL_MEASURE_CHAIN_LIVES_H

#include "measure_chains.h"

#define TAL_BUCKLING_ANGLE (TAL_PI / 180)

typedef struct tal_chain_life {
  size_t born, last;               // numbers of the frames
  double born_time, last_time;     // [s]
  double born_strain, last_strain; //
  size_t frames, longest;          // seen in; grains
  size_t buckled;                  // buckling events
  bool from_start, to_end;         // there in the first or in the last frame: its life is cut off
} tal_chain_life;

typedef struct tal_buckling {
  size_t life;          // of the chain
  int32_t grain[3];     // indices, the middle one is [1]
  double before, after; // [rad] the angle at the middle grain
  double lost;          // share of its major principal stress that it lost
} tal_buckling;

typedef struct tal_chain_tracker {
  size_t life_count;
  tal_chain_life *life; // owned; [life_count] the life's number is its chain's id
  size_t *id;           // owned; [chains of the last frame] life of each
  // What is kept of the last frame.
  size_t frame, frames_seen;
  tal_chains before; // owned
  size_t grain_count;
  int64_t *grain_id; // owned
  double *x, *y;     // owned
  // What the last update found.
  size_t born, gone_on, ended, segments;
  size_t event_count;
  tal_buckling *event; // owned; [event_count]
} tal_chain_tracker;

// Takes the chains of frame number `frame` (they move into the tracker). Frames of other grains start afresh.
void tal_chain_tracker_add(tal_chain_tracker *tracker, tal_chains *chains, const tal_snapshot *snapshot, size_t frame);
// Marks those alive as cut off.
void tal_chain_tracker_end(tal_chain_tracker *tracker);
void tal_chain_tracker_clear(tal_chain_tracker *tracker);

#endif
