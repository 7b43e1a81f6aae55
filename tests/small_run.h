// A small simulation in a temporary folder, for the tests of what a run leaves on disk.
#ifndef SMALL_RUN_H
#define SMALL_RUN_H

#include "files.h"
#include "sim.h"
#include <fcntl.h>
#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

typedef struct small_run {
  char folder[TAL_PATH_SIZE]; // removed at the end
  tal_scene scene;
  tal_sim *sim;
} small_run;

// Grains sliding down on an inclined floor: touching pairs, springs, a wall, a graph, tracks. %s: friction.
static const char small_scene[] =
    "name: small\n"
    "seed: 3\n"
    "grains: {radius: {law: uniform, min: 1e-3, max: 1e-3}, thickness: 2e-3}\n"
    "material: {young: 1e7, poisson: 0.3, density: 2000, friction: %s, damping: 1e-4}\n"
    "contact: {normal: hertz, tangential: spring}\n"
    "gravity: [1, -9]\n"
    "pack: {method: lattice, pattern: triangular, columns: 4, rows: 3, gap: -1e-6}\n"
    "walls: [{from: [-1, 5e-7], to: [1, 5e-7], young: .inf}]\n"
    "integrator: {scheme: verlet, dt: 1e-5}\n"
    "stages: [{kind: free, duration: 1e-2}, {kind: free, duration: 1e-2}]\n"
    "output: {series_every: 1e-4, fields_every: 1e-3, checkpoint_every: 1e-3, tracks: [2, 7]}\n";

static inline void in_folder(char path[TAL_PATH_SIZE], const small_run *run, const char *name) {
  tal_file_path(path, run->folder, name);
}

static inline void load_scene(tal_scene *scene, const char *folder, const char *friction) {
  char path[TAL_PATH_SIZE];
  tal_file_path(path, folder, "scene.yaml");
  FILE *file = fopen(path, "w");
  assert_non_null(file);
  fprintf(file, small_scene, friction);
  assert_int_equal(fclose(file), 0);
  tal_scene_errors errors = {0};
  if (tal_scene_load(scene, path, NULL, 0, &errors) != TAL_OK)
    fail_msg("%s", errors.item[0].text);
}

static inline tal_sim *make_sim(const tal_scene *scene, int steps) {
  tal_error err;
  tal_sim *sim;
  if (tal_sim_create(&sim, scene, &err) != TAL_OK)
    fail_msg("%s", err.text);
  for (int k = 0; k < steps; k++) {
    if (tal_sim_step(sim, &err) != TAL_OK)
      fail_msg("%s", err.text);
  }
  return sim;
}

static inline void small_run_begin(small_run *run, int steps) {
  const char *base = getenv("TMPDIR");
  snprintf(run->folder, sizeof run->folder, "%s/talus-test-XXXXXX", base ? base : "/tmp");
  assert_non_null(mkdtemp(run->folder));
  load_scene(&run->scene, run->folder, "0.5");
  run->sim = make_sim(&run->scene, steps);
}

static inline int remove_entry(const char *path, const struct stat *info, int type, struct FTW *walk) {
  (void)info, (void)type, (void)walk;
  return remove(path);
}

static inline void small_run_end(small_run *run) {
  tal_sim_free(run->sim);
  tal_scene_clear(&run->scene);
  nftw(run->folder, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
}

// Not inline: gcc 12 then takes the local's address for the returned pointer and warns.
__attribute__((noinline, unused)) static unsigned char *contents(const char *path, size_t *size) {
  unsigned char *data;
  tal_error err;
  if (tal_file_read(path, &data, size, &err) != TAL_OK)
    fail_msg("%s", err.text);
  return data;
}

static inline void overwrite(const char *path, const void *data, size_t size) {
  FILE *file = fopen(path, "w");
  assert_non_null(file);
  assert_int_equal(fwrite(data, 1, size, file), size);
  assert_int_equal(fclose(file), 0);
}

static inline void flip_bit(const char *path, size_t at, int bit) {
  size_t size;
  unsigned char *data = contents(path, &size);
  data[at % size] ^= (unsigned char)(1 << bit);
  overwrite(path, data, size);
  free(data);
}

static inline void assert_same_files(const char *a, const char *b) {
  size_t a_size, b_size;
  unsigned char *a_data = contents(a, &a_size), *b_data = contents(b, &b_size);
  assert_int_equal(a_size, b_size);
  assert_memory_equal(a_data, b_data, a_size);
  free(a_data);
  free(b_data);
}

static inline bool holds(const char *text, const char *part) {
  return strstr(text, part) != NULL;
}

// From here on in this process no file grows beyond `bytes`: a disk that is full.
static inline void limit_files(rlim_t bytes) {
  signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &(struct rlimit){bytes, bytes});
}

// Exit code of the child, -1 when it was killed.
static inline int wait_for(pid_t child) {
  int status;
  assert_int_equal(waitpid(child, &status, 0), child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

#endif
