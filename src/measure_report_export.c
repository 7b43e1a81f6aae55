// FIELD-NNNNNN.csv for the fields of --export in the frames of --at.
#include "files.h"
#include "measure_map.h"

static void frame(void *state, tal_measuring *run, const tal_part *part) {
  (void)state;
  (void)part;
  for (size_t k = 0; run->detail && k < run->options->export_count; k++) {
    const char *field = run->options->exports[k];
    char name[128], path[TAL_PATH_SIZE];
    tal_error err;
    snprintf(name, sizeof name, "%.100s-%06zu.csv", field, run->frame);
    for (char *c = name; *c; c++)
      *c = *c == '/' ? '-' : *c;
    tal_file_path(path, run->out, name);
    const tal_status status = tal_frame_export(run->choice.frames.entry[run->frame].path, field, path, &err);
    if (status)
      tal_measure_failed(run, status, &err);
    else if (run->options->made)
      run->options->made(run->options->user, path);
  }
}

const tal_measurement tal_measurement_export = {NULL, frame, NULL};
