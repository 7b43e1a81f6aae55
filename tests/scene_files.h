// Scene texts for the tests of the loader: a temporary folder, a file in it, loading and throwing away.
#ifndef TAL_SCENE_FILES_H
#define TAL_SCENE_FILES_H

#include "scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct scene_folder {
  char path[400];
  char file[420]; // the scene file in it
} scene_folder;

static inline scene_folder scene_folder_create(void) {
  scene_folder folder;
  const char *base = getenv("TMPDIR");
  snprintf(folder.path, sizeof folder.path, "%.300s/talus-scene-XXXXXX", base && *base ? base : "/tmp");
  assert_non_null(mkdtemp(folder.path));
  snprintf(folder.file, sizeof folder.file, "%s/s.yaml", folder.path);
  return folder;
}

static inline void scene_folder_remove(scene_folder *folder) {
  unlink(folder->file);
  assert_int_equal(rmdir(folder->path), 0);
}

static inline void scene_folder_write(const scene_folder *folder, const char *text, size_t size) {
  unlink(folder->file); // a new file: some file systems flush to disk on rewriting an old one
  FILE *file = fopen(folder->file, "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(text, 1, size, file), size);
  assert_int_equal(fclose(file), 0);
}

static inline tal_status load_text(const scene_folder *folder, const char *text, tal_scene *scene,
                                   tal_scene_errors *errors) {
  scene_folder_write(folder, text, strlen(text));
  return tal_scene_load(scene, folder->file, NULL, 0, errors);
}

#endif
