// What the files output*.c share. Private to them.
#ifndef TAL_OUTPUT_PARTS_H
#define TAL_OUTPUT_PARTS_H

#include "checkpoint.h"
#include "files.h"
#include "output.h"

// A CSV that grows by whole rows.
typedef struct tal_csv {
  int fd;        // -1: not open
  int64_t bytes; // its length
  int64_t step;  // step of the last rows, -1: none
  char path[TAL_PATH_SIZE];
} tal_csv;

struct tal_output {
  char *dir;              // owned
  const tal_scene *scene; // borrowed
  char *scene_text;       // owned; the scene as resolved
  int lock;               // file descriptor of DIR/.lock
  tal_csv series, tracks;
  tal_run_files files;      // frames; the CSV part is filled in at a checkpoint
  size_t listed_frames;     // frames in fields.xdmf
  tal_stage_report *before; // owned; [scene->stage_count]
};

// output_series.c: opens both CSV for a new run (headers) or cuts them back to what `files` says. tal_csv_check tells
// beforehand, changing nothing, whether the file is long enough (TAL_BAD_INPUT).
tal_status tal_csv_create_all(tal_output *output, tal_error *err);
tal_status tal_csv_check(const char *dir, const char *name, int64_t bytes, tal_error *err);
tal_status tal_csv_resume_all(tal_output *output, const tal_run_files *files, tal_error *err);
tal_status tal_csv_sync(tal_csv *csv, tal_error *err);
void tal_csv_close(tal_csv *csv);
// The header line of series.csv with its line end; owned by the caller.
char *tal_series_header(void);
extern const char tal_tracks_header[];

// output_fields.c: the path of frame k ("fields/000012.h5"), the index fields.h5, what is there beyond the checkpoint.
#define TAL_FRAME_NAME "fields/%06zu.h5"
tal_status tal_fields_check(const char *dir, const tal_run_files *files, tal_error *err);
tal_status tal_fields_drop_later(const tal_output *output, tal_error *err);
tal_status tal_fields_index(tal_output *output, tal_error *err);
// output_xdmf.c: fields.xdmf for all frames.
tal_status tal_xdmf_write(tal_output *output, tal_error *err);

// output_report.c: stages of DIR/run.json into before[stage_count]; what is not there stays.
void tal_report_read(const char *dir, tal_stage_report *before, size_t stage_count);

#endif
