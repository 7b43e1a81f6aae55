// series.csv and tracks.csv: one header line, then rows of %.17g, each on its way to the disk in one write. A row that
// does not fit is cut off again, so that the file never ends in a torn line.
#include "output_parts.h"

#include "order.h"
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

const char tal_tracks_header[] =
    "time[s],id,x[m],y[m],theta[rad],vx[m/s],vy[m/s],omega[rad/s],fx[N],fy[N],torque[N m]\n";

char *tal_series_header(void) {
  static const char *const names[][2] = {
#define X(name, unit, meaning) {#name, unit},
      TAL_SERIES_FIELDS(X)
#undef X
  };
  char *text = NULL;
  size_t size = 0;
  FILE *stream = tal_text_begin(&text, &size);
  for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
    const char *const format = *names[k][1] ? "%s%s[%s]" : "%s%s";
    fprintf(stream, format, k ? "," : "", names[k][0], names[k][1]);
  }
  fputc('\n', stream);
  tal_text_end(stream);
  return text;
}

// ---- a file of rows ----

static tal_status open_csv(tal_csv *csv, const char *dir, const char *name, int flags, tal_error *err) {
  tal_file_path(csv->path, dir, name);
  csv->fd = open(csv->path, flags | O_WRONLY | O_APPEND | O_CLOEXEC, 0666);
  csv->bytes = 0;
  csv->step = -1;
  if (csv->fd >= 0)
    return TAL_OK;
  return tal_fail(err, TAL_IO, "%s: cannot be opened: %s", csv->path, strerror(errno));
}

static tal_status append(tal_csv *csv, const char *text, size_t size, tal_error *err) {
  tal_status status = tal_file_put(csv->fd, csv->path, text, size, err);
  if (status == TAL_OK) {
    csv->bytes += (int64_t)size;
  } else if (ftruncate(csv->fd, csv->bytes) != 0) {
    return tal_fail(err, TAL_IO, "%s: writing failed and its last line is torn: %s", csv->path, strerror(errno));
  }
  return status;
}

static tal_status create_csv(tal_csv *csv, const char *dir, const char *name, const char *header, tal_error *err) {
  tal_status status = open_csv(csv, dir, name, O_CREAT | O_EXCL, err);
  return status == TAL_OK ? append(csv, header, strlen(header), err) : status;
}

static tal_status resume_csv(tal_csv *csv, const char *dir, const char *name, int64_t bytes, tal_error *err) {
  tal_status status = open_csv(csv, dir, name, 0, err);
  if (status != TAL_OK)
    return status;
  csv->bytes = bytes;
  if (ftruncate(csv->fd, bytes) == 0)
    return TAL_OK;
  return tal_fail(err, TAL_IO, "%s: cannot be cut back to %lld bytes: %s", csv->path, (long long)bytes,
                  strerror(errno));
}

tal_status tal_csv_create_all(tal_output *output, tal_error *err) {
  char *header = tal_series_header();
  tal_status status = create_csv(&output->series, output->dir, "series.csv", header, err);
  free(header);
  if (status != TAL_OK || output->scene->output.track_count == 0)
    return status;
  return create_csv(&output->tracks, output->dir, "tracks.csv", tal_tracks_header, err);
}

tal_status tal_csv_check(const char *dir, const char *name, int64_t bytes, tal_error *err) {
  if (bytes == 0)
    return TAL_OK;
  char path[TAL_PATH_SIZE];
  struct stat info;
  tal_file_path(path, dir, name);
  if (stat(path, &info) != 0)
    return tal_fail(err, TAL_BAD_INPUT, "%s: %s", path, strerror(errno));
  if (info.st_size >= bytes)
    return TAL_OK;
  return tal_fail(err, TAL_BAD_INPUT, "%s is damaged: it has %lld bytes, the checkpoint was written with %lld", path,
                  (long long)info.st_size, (long long)bytes);
}

tal_status tal_csv_resume_all(tal_output *output, const tal_run_files *files, tal_error *err) {
  tal_status status = resume_csv(&output->series, output->dir, "series.csv", files->series_bytes, err);
  output->series.step = files->series_step;
  if (status != TAL_OK || files->tracks_bytes == 0)
    return status;
  status = resume_csv(&output->tracks, output->dir, "tracks.csv", files->tracks_bytes, err);
  output->tracks.step = files->tracks_step;
  return status;
}

tal_status tal_csv_sync(tal_csv *csv, tal_error *err) {
  // EINVAL: a pipe or the like, which has nothing to sync.
  if (csv->fd < 0 || fsync(csv->fd) == 0 || errno == EINVAL)
    return TAL_OK;
  return tal_fail(err, TAL_IO, "%s: syncing failed: %s", csv->path, strerror(errno));
}

void tal_csv_close(tal_csv *csv) {
  if (csv->fd >= 0)
    close(csv->fd);
  csv->fd = -1;
}

// ---- rows ----

// printf's nan may carry a sign.
static void put_number(FILE *stream, char before, double value) {
  if (before)
    fputc(before, stream);
  if (isnan(value)) {
    fputs("nan", stream);
  } else {
    fprintf(stream, "%.17g", value + 0.0); // -0 as 0
  }
}

// Ends the text stream and appends what it holds as the rows of `step`.
static tal_status append_rows(tal_csv *csv, FILE *stream, char **text, size_t *size, int64_t step, tal_error *err) {
  tal_text_end(stream);
  tal_status status = append(csv, *text, *size, err);
  if (status == TAL_OK)
    csv->step = step;
  free(*text);
  return status;
}

tal_status tal_output_row(tal_output *output, const tal_row *row, tal_error *err) {
  if (output->series.step == (int64_t)row->step)
    return TAL_OK;
  char *text = NULL, before = 0;
  size_t size = 0;
  FILE *stream = tal_text_begin(&text, &size);
  // `step` and `stage` come out as whole numbers: %.17g writes them so below 1e17.
#define X(name, unit, meaning)                                                                                         \
  put_number(stream, before, row->name);                                                                               \
  before = ',';
  TAL_SERIES_FIELDS(X)
#undef X
  fputc('\n', stream);
  return append_rows(&output->series, stream, &text, &size, (int64_t)row->step, err);
}

static void put_track(FILE *stream, double time, const tal_grains *g, size_t i) {
  const double values[] = {g->x[i],     g->y[i],  g->theta[i], g->vx[i],     g->vy[i],
                           g->omega[i], g->rx[i], g->ry[i],    g->rtorque[i]};
  put_number(stream, 0, time);
  fprintf(stream, ",%lld", (long long)g->id[i]);
  for (size_t k = 0; k < sizeof values / sizeof *values; k++)
    put_number(stream, ',', values[k]);
  fputc('\n', stream);
}

tal_status tal_output_tracks(tal_output *output, const tal_sim *sim, tal_error *err) {
  const tal_scene_output *wanted = &output->scene->output;
  if (output->tracks.fd < 0 || output->tracks.step == sim->run.step)
    return TAL_OK;
  tal_status status = tal_output_check_tracks(output->scene, sim->grains.count, err);
  if (status != TAL_OK)
    return status;
  char *text = NULL;
  size_t size = 0;
  FILE *stream = tal_text_begin(&text, &size);
  int32_t *index = tal_order_of_ids(&sim->grains);
  for (size_t k = 0; k < wanted->track_count; k++)
    put_track(stream, sim->run.time, &sim->grains, (size_t)index[wanted->tracks[k]]);
  free(index);
  return append_rows(&output->tracks, stream, &text, &size, sim->run.step, err);
}
