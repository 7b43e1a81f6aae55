// A checkpoint that is damaged or foreign: cut at any length, any bit flipped, written by another version. All are
// refused with one clear line, the one before is offered, and from there the run comes to the same bits. Short: a
// sample of bits and lengths, every bit of HDF5's header and of the seal among them; long: every one.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "checkpoint.h"
#include "faults.h"
#include "files.h"
#include "output.h"
#include "store.h"
#include "variants.h"
#include <omp.h>

// Twenty grains, springs, plates: each part of a checkpoint holds something.
static const char *const sets[] = {
    "--set=grains.count=20", "--set=contact.tangential=spring",
    "--set=output={series_every: 3e-4, fields_every: 8e-4, checkpoint_every: 3e-4, tracks: [1]}", NULL};
static const char offered[] = "checkpoint.prev.h5 is intact: move it to checkpoint.h5 to go on from there";

typedef struct half {
  program *p;
  tal_scene scene;
  tal_sim *sim; // never touched: what is refused is refused before
  char dir[4400], checkpoint[4500];
  off_t size;
} half;

// A run stopped half way, in p's folder/half; the unbroken one in whole.
static void half_begin(half *h, program *p) {
  outcome got;
  tal_scene_errors errors;
  tal_error err;
  const char *words[4];
  for (int k = 0; k < 3; k++)
    words[k] = sets[k] + strlen("--set=");
  h->p = p;
  program_write(p, "s.yaml", variants_scene);
  faults_done(p, &(faults_run){"whole", "1", sets, false});
  faults_plan(p, "write", 30, "s15");
  faults_do(p, &(faults_run){"half", "1", sets, false}, &got);
  assert_int_equal(got.code, 75);
  assert_true(faults_struck(p));
  faults_plan(p, NULL, 0, NULL);
  assert_int_equal(tal_scene_load(&h->scene, program_path(p, "s.yaml"), words, 3, &errors), TAL_OK);
  assert_int_equal(tal_sim_create(&h->sim, &h->scene, &err), TAL_OK);
  snprintf(h->dir, sizeof h->dir, "%s", program_path(p, "half"));
  snprintf(h->checkpoint, sizeof h->checkpoint, "%s/checkpoint.h5", h->dir);
  struct stat info;
  assert_int_equal(stat(h->checkpoint, &info), 0);
  h->size = info.st_size;
}

static void half_end(half *h) {
  tal_sim_free(h->sim);
  tal_scene_clear(&h->scene);
}

static void assert_offered(half *h, const char *what, long at) {
  tal_output *output;
  tal_error err = {""};
  bool finished;
  const tal_status status = tal_output_resume(&output, h->dir, &h->scene, h->sim, &finished, &err);
  if (status != TAL_BAD_INPUT || output || !strstr(err.text, "checkpoint.h5 is damaged") || !strstr(err.text, offered))
    fail_msg("%s %ld: status %d: %s", what, at, (int)status, err.text);
}

static void flip(int fd, off_t at, int bit) {
  unsigned char byte;
  assert_int_equal(pread(fd, &byte, 1, at), 1);
  byte ^= (unsigned char)(1 << bit);
  assert_int_equal(pwrite(fd, &byte, 1, at), 1);
}

// Bits tried in the short form: every one of the first 96 bytes and of the seal, and each 1009th.
static bool bit_tried(const half *h, off_t bit) {
  const off_t byte = bit / 8;
  return faults_long() || byte < 96 || byte >= h->size - TAL_SEAL_SIZE || bit % 1009 == 0;
}

// Outside answer: every flipped bit shows.
static void flipped_bits(void **state) {
  half h;
  long trials = 0;
  half_begin(&h, *state);
  const int fd = open(h.checkpoint, O_RDWR | O_CLOEXEC);
  for (off_t bit = 0; bit < 8 * h.size; bit++) {
    if (!bit_tried(&h, bit))
      continue;
    flip(fd, bit / 8, (int)(bit % 8));
    assert_offered(&h, "bit", (long)bit);
    flip(fd, bit / 8, (int)(bit % 8));
    trials++;
  }
  close(fd);
  faults_done(h.p, &(faults_run){"half", "1", sets, true}); // nothing was changed by it
  char *print = faults_print(h.p, "whole");
  assert_printed(h.p, "half", print, "after all flips");
  free(print);
  half_end(&h);
  faults_held("a bit of a checkpoint flipped", trials, "refused, the one before offered");
}

// Outside answer: cut to any length it is refused; EXACT: the one that is offered leads to the same bits.
static void cut_lengths(void **state) {
  half h;
  long trials = 0;
  half_begin(&h, *state);
  const off_t stride = faults_long() ? 1 : 211;
  for (off_t length = h.size - 1; length >= 0; length = length == 0 ? -1 : length > stride ? length - stride : 0) {
    assert_int_equal(truncate(h.checkpoint, length), 0);
    assert_offered(&h, "length", (long)length);
    trials++;
  }
  assert_refused(h.p, "cut", WORDS("run", "s.yaml", "-o", "half", "--resume", sets[0], sets[1], sets[2]), 2, offered);
  char previous[4500];
  snprintf(previous, sizeof previous, "%s/checkpoint.prev.h5", h.dir);
  assert_int_equal(rename(previous, h.checkpoint), 0);
  char *print = faults_print(h.p, "whole");
  faults_recover(h.p, &(faults_run){"half", "2", sets, false}, print, "from the one before");
  free(print);
  half_end(&h);
  faults_held("a checkpoint cut to a length", trials, "refused, the one before offered and good");
}

// Outside answer: sealed, but of another version: it says which, and offers nothing that is no better.
static void other_version(void **state) {
  static const char *const names[] = {"checkpoint.h5", "checkpoint.prev.h5"};
  half h;
  half_begin(&h, *state);
  for (int k = 0; k < 2; k++) {
    char path[4500];
    tal_store store;
    snprintf(path, sizeof path, "%s/%s", h.dir, names[k]);
    tal_store_begin(&store);
    tal_store_put_integer(&store, "format", TAL_CHECKPOINT_FORMAT + 1);
    tal_store_put_text(&store, "version", "9.8.7");
    assert_int_equal(tal_store_save(&store, path, NULL, NULL), TAL_OK);
  }
  char expected[200];
  snprintf(expected, sizeof expected,
           "half/checkpoint.h5 was written by talus 9.8.7 (format %d); talus %s reads format %d\n",
           TAL_CHECKPOINT_FORMAT + 1, TAL_VERSION, TAL_CHECKPOINT_FORMAT);
  assert_refused(h.p, "other version", WORDS("run", "s.yaml", "-o", "half", "--resume", sets[0], sets[1], sets[2]), 2,
                 expected);
  half_end(&h);
  faults_held("another version's checkpoint", 1, "refused, both versions named");
}

int main(int argc, char **argv) {
  if (argc > 1)
    cmocka_set_test_filter(argv[1]);
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {
      faults_test(flipped_bits),
      faults_test(cut_lengths),
      faults_test(other_version),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
