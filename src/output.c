// The folder of a run: who may write there, what a new run and a resumed one find. See output.h.
#include "output_parts.h"

#include "store.h"
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

static const char checkpoint_name[] = "checkpoint.h5", previous_name[] = "checkpoint.prev.h5";

static bool holds_run(const char *dir) {
  static const char *const names[] = {"series.csv", checkpoint_name, previous_name, "run.json", "fields.h5", "fields"};
  for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
    char path[TAL_PATH_SIZE];
    tal_file_path(path, dir, names[k]);
    if (tal_file_exists(path))
      return true;
  }
  return false;
}

// The lock goes with the process, however it ends; the empty file stays.
static tal_status lock_folder(const char *dir, int *lock, tal_error *err) {
  char path[TAL_PATH_SIZE];
  tal_file_path(path, dir, ".lock");
  *lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (*lock < 0)
    return tal_fail(err, TAL_IO, "%s: cannot be made: %s", path, strerror(errno));
  if (flock(*lock, LOCK_EX | LOCK_NB) == 0)
    return TAL_OK;
  int why = errno;
  close(*lock);
  *lock = -1;
  if (why == EWOULDBLOCK)
    return tal_fail(err, TAL_BAD_INPUT, "a run is at work in %s", dir);
  return tal_fail(err, TAL_IO, "%s: cannot be locked: %s", path, strerror(why));
}

static tal_output *output_new(const char *dir, const tal_scene *scene) {
  tal_output *output = tal_alloc(1, sizeof *output);
  output->dir = tal_strdup(dir);
  output->scene = scene;
  output->scene_text = tal_scene_text(scene);
  output->lock = output->series.fd = output->tracks.fd = -1;
  output->files = (tal_run_files){.series_step = -1, .tracks_step = -1};
  output->before = tal_alloc(scene->stage_count, sizeof *output->before);
  for (size_t k = 0; k < scene->stage_count; k++)
    output->before[k].kind = scene->stages[k].kind;
  return output;
}

void tal_output_close(tal_output *output) {
  if (!output)
    return;
  if (output->listed_frames < output->files.frame_count)
    tal_xdmf_write(output, NULL);
  tal_csv_close(&output->series);
  tal_csv_close(&output->tracks);
  if (output->lock >= 0)
    close(output->lock);
  tal_run_files_clear(&output->files);
  free(output->before);
  free(output->scene_text);
  free(output->dir);
  free(output);
}

// A failure on the way in: let go without touching any file.
static tal_status settle(tal_output **output, tal_status status) {
  if (status == TAL_OK)
    return status;
  tal_run_files_clear(&(*output)->files);
  tal_output_close(*output);
  *output = NULL;
  return status;
}

tal_status tal_output_check_tracks(const tal_scene *scene, size_t grain_count, tal_error *err) {
  for (size_t k = 0; k < scene->output.track_count; k++) {
    long long id = scene->output.tracks[k];
    if (id >= 0 && (size_t)id < grain_count)
      continue;
    return tal_fail(err, TAL_BAD_INPUT, "%s: output.tracks: there is no grain %lld, ids go from 0 to %lld", scene->path,
                    id, (long long)grain_count - 1);
  }
  return TAL_OK;
}

static tal_status create_files(tal_output *output, tal_error *err) {
  if (holds_run(output->dir)) {
    return tal_fail(err, TAL_BAD_INPUT, "%s already holds a run: go on with --resume, or choose another folder with -o",
                    output->dir);
  }
  char path[TAL_PATH_SIZE];
  tal_file_path(path, output->dir, "fields");
  tal_status status = tal_folder_create(path, err);
  return status == TAL_OK ? tal_csv_create_all(output, err) : status;
}

tal_status tal_output_create(tal_output **output, const char *dir, const tal_scene *scene, tal_error *err) {
  *output = NULL;
  tal_status status = tal_folder_create(dir, err);
  if (status != TAL_OK)
    return status;
  *output = output_new(dir, scene);
  // The lock first: "a run is at work" says more than "holds a run".
  status = lock_folder(dir, &(*output)->lock, err);
  if (status == TAL_OK)
    status = create_files(*output, err);
  return settle(output, status);
}

// Which checkpoint to go on from: path is set to it.
static tal_status find_checkpoint(const char *dir, char path[TAL_PATH_SIZE], tal_error *err) {
  if (!tal_file_exists(dir) || !holds_run(dir)) {
    return tal_fail(err, TAL_BAD_INPUT, "%s holds no run to resume", dir);
  }
  tal_file_path(path, dir, checkpoint_name);
  if (tal_file_exists(path))
    return TAL_OK;
  tal_file_path(path, dir, previous_name);
  if (tal_file_exists(path))
    return TAL_OK;
  return tal_fail(err, TAL_BAD_INPUT,
                  "%s holds no checkpoint.h5: the run ended before its first one; remove the folder "
                  "and start again",
                  dir);
}

static bool is_intact(const char *checkpoint) {
  tal_checkpoint_head head;
  bool intact = tal_checkpoint_peek(checkpoint, &head, NULL) == TAL_OK;
  if (intact)
    tal_run_files_clear(&head.files);
  return intact;
}

static bool is_sealed(const char *checkpoint) {
  tal_store store;
  const bool sealed = tal_store_open(&store, checkpoint, NULL) == TAL_OK;
  if (sealed)
    tal_store_close(&store);
  return sealed;
}

// Adds to the sentence on a bad checkpoint whether the one before could serve; where it is another version's, so is the
// one before.
static tal_status offer_previous(const char *dir, const char *bad, tal_status status, const tal_error *why,
                                 tal_error *err) {
  char previous[TAL_PATH_SIZE];
  tal_file_path(previous, dir, previous_name);
  if (strcmp(bad, previous) != 0 && is_intact(previous)) {
    return tal_fail(err, status, "%.800s; %s is intact: move it to %s to go on from there", why->text, previous_name,
                    checkpoint_name);
  }
  if (is_sealed(bad))
    return tal_fail(err, status, "%s", why->text);
  return tal_fail(err, status, "%.800s; there is no intact %s", why->text, previous_name);
}

static tal_status check_files(const tal_output *output, tal_error *err) {
  const tal_run_files *files = &output->files;
  tal_status status = tal_csv_check(output->dir, "series.csv", files->series_bytes, err);
  if (status == TAL_OK)
    status = tal_csv_check(output->dir, "tracks.csv", files->tracks_bytes, err);
  return status == TAL_OK ? tal_fields_check(output->dir, files, err) : status;
}

// From here on the folder changes: everything later than the checkpoint goes.
static tal_status cut_back(tal_output *output, tal_error *err) {
  tal_status status = tal_csv_resume_all(output, &output->files, err);
  if (status != TAL_OK)
    return status;
  if (output->files.frame_count > 0) { // the lists first: killed here, none names a frame that is gone
    status = tal_fields_index(output, err);
    if (status == TAL_OK)
      status = tal_xdmf_write(output, err);
  }
  return status == TAL_OK ? tal_fields_drop_later(output, err) : status;
}

static tal_status resume_files(tal_output *output, const char *checkpoint, tal_sim *sim, tal_error *err) {
  tal_error why = {""};
  tal_status status = tal_checkpoint_read(checkpoint, sim, output->scene_text, &output->files, &why);
  if (status != TAL_OK && !is_intact(checkpoint))
    return offer_previous(output->dir, checkpoint, status, &why, err);
  if (status != TAL_OK)
    return tal_fail(err, status, "%s", why.text);
  status = check_files(output, err);
  if (status != TAL_OK)
    return status;
  tal_report_read(output->dir, output->before, output->scene->stage_count);
  return cut_back(output, err);
}

tal_status tal_output_resume(tal_output **output, const char *dir, const tal_scene *scene, tal_sim *sim, bool *finished,
                             tal_error *err) {
  *output = NULL;
  *finished = false;
  char checkpoint[TAL_PATH_SIZE];
  tal_status status = find_checkpoint(dir, checkpoint, err);
  if (status != TAL_OK)
    return status;
  *output = output_new(dir, scene);
  status = lock_folder(dir, &(*output)->lock, err);
  // Looked for again under the lock: a run that was at work may have renamed it meanwhile.
  if (status == TAL_OK)
    status = find_checkpoint(dir, checkpoint, err);
  if (status == TAL_OK)
    status = resume_files(*output, checkpoint, sim, err);
  if (status != TAL_OK)
    return settle(output, status);
  tal_sim_restored(sim);
  *finished = tal_sim_done(sim);
  return TAL_OK;
}

const tal_stage_report *tal_output_stages_before(const tal_output *output) {
  return output->before;
}

tal_status tal_output_checkpoint(tal_output *output, tal_sim *sim, tal_error *err) {
  // What the checkpoint says of the CSV must be on disk before it is.
  tal_status status = tal_csv_sync(&output->series, err);
  if (status == TAL_OK)
    status = tal_csv_sync(&output->tracks, err);
  if (status != TAL_OK)
    return status;
  tal_run_files *files = &output->files;
  files->series_bytes = output->series.bytes;
  files->series_step = output->series.step;
  files->tracks_bytes = output->tracks.bytes;
  files->tracks_step = output->tracks.step;
  if (output->listed_frames < files->frame_count)
    status = tal_xdmf_write(output, err);
  if (status != TAL_OK)
    return status;
  char path[TAL_PATH_SIZE], previous[TAL_PATH_SIZE];
  tal_file_path(path, output->dir, checkpoint_name);
  tal_file_path(previous, output->dir, previous_name);
  return tal_checkpoint_write(path, previous, sim, output->scene_text, files, err);
}
