// The complete state of a run in one sealed file (docs/formats.md), generated from the field lists: what is STATE there
// is here. Content depends on the state only, not on host or time of day: two equal states give equal bytes.
#ifndef TAL_CHECKPOINT_H
#define TAL_CHECKPOINT_H

#include "sim.h"

// Bumped when a field list or the layout changes its meaning.
#define TAL_CHECKPOINT_FORMAT 4

// What the files of a run hold at the instant of a checkpoint: X(type, name, unit, meaning).
#define TAL_RUN_FILES_FIELDS(X)                                                                                        \
  X(int64_t, series_bytes, "B", "length of series.csv")                                                                \
  X(int64_t, series_step, "1", "step of its last row, -1: none")                                                       \
  X(int64_t, tracks_bytes, "B", "length of tracks.csv, 0: there is none")                                              \
  X(int64_t, tracks_step, "1", "step of its last rows, -1: none")

// One per frame fields/NNNNNN.h5, in order.
#define TAL_FRAME_MARK_FIELDS(X)                                                                                       \
  X(double, time, "s", "simulated time")                                                                               \
  X(int64_t, step, "1", "small steps since the start")                                                                 \
  X(int64_t, grains, "1", "number of grains")                                                                          \
  X(int64_t, cells, "1", "number of cells")

typedef struct tal_frame_mark {
#define X(type, name, unit, meaning) type name;
  TAL_FRAME_MARK_FIELDS(X)
#undef X
} tal_frame_mark;

typedef struct tal_run_files {
#define X(type, name, unit, meaning) type name;
  TAL_RUN_FILES_FIELDS(X)
#undef X
  size_t frame_count, frame_capacity;
  tal_frame_mark *frame; // owned; [frame_count]
} tal_run_files;

void tal_run_files_clear(tal_run_files *files);
void tal_run_files_add_frame(tal_run_files *files, tal_frame_mark frame);

// Replaces `path`; the one before is kept as `previous`. Brings the slots' histories up to date first. scene_text: the
// scene as resolved. TAL_IO.
tal_status tal_checkpoint_write(const char *path, const char *previous, tal_sim *sim, const char *scene_text,
                                const tal_run_files *files, tal_error *err);

// What a checkpoint says about itself.
typedef struct tal_checkpoint_head {
  tal_run run;
  int64_t grain_count;
  bool complete; // every stage is finished
  tal_run_files files;
} tal_checkpoint_head;

// Checks the seal and the format and reads the head; clear with tal_run_files_clear(&head->files). TAL_IO when it
// cannot be read, TAL_BAD_INPUT when it is damaged or of another format.
tal_status tal_checkpoint_peek(const char *path, tal_checkpoint_head *head, tal_error *err);
// Puts the state back into `sim`, which was created from the scene of scene_text (tal_sim_restored is the caller's).
// TAL_IO when it cannot be read; TAL_BAD_INPUT when it is damaged, of another format, or of another scene (names the
// first line that differs); `sim` is then not to be used.
tal_status tal_checkpoint_read(const char *path, tal_sim *sim, const char *scene_text, tal_run_files *files,
                               tal_error *err);

#endif
