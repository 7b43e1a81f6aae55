// Checkpoints: round trip, equal bytes for equal states, damage of every kind refused, kills and full disks survived.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "checkpoint.h"
#include "store.h"
#include <malloc.h>
#include <math.h>
#include <signal.h>
#include <time.h>

#include "small_run.h"

static const char other_text[] = "name: other\nseed: 3\n";

static void write_here(const small_run *run, const char *name, tal_sim *sim) {
  char path[TAL_PATH_SIZE];
  tal_error err;
  tal_run_files files = {.series_bytes = 1234, .series_step = 40, .tracks_step = -1};
  for (int k = 0; k < 3; k++)
    tal_run_files_add_frame(&files, (tal_frame_mark){0.1 * k, 10 * k, 12, 9 + k});
  char *text = tal_scene_text(sim->scene);
  in_folder(path, run, name);
  if (tal_checkpoint_write(path, NULL, sim, text, &files, &err) != TAL_OK)
    fail_msg("%s", err.text);
  free(text);
  tal_run_files_clear(&files);
}

static tal_status read_here(const small_run *run, const char *name, tal_sim *sim, const char *text, tal_error *err) {
  char path[TAL_PATH_SIZE];
  tal_run_files files;
  in_folder(path, run, name);
  tal_status status = tal_checkpoint_read(path, sim, text, &files, err);
  tal_run_files_clear(&files);
  return status;
}

static void assert_same_bits(const void *a, const void *b, size_t size) {
  if (size)
    assert_memory_equal(a, b, size);
}

#define IF_STATE(...) __VA_ARGS__
#define IF_WORK(...)
#define IF_SEEN(...)

static void assert_same_state(const tal_sim *a, const tal_sim *b) {
  assert_int_equal(a->grains.count, b->grains.count);
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept(assert_same_bits(a->grains.name, b->grains.name, a->grains.count * sizeof(type));)
  TAL_GRAIN_FIELDS(X)
#undef X
#define X(type, name, unit, meaning) assert_same_bits(&a->run.name, &b->run.name, sizeof(type));
  TAL_RUN_FIELDS(X)
#undef X
  assert_int_equal(a->walls.count, b->walls.count);
  for (size_t w = 0; w < a->walls.count; w++) {
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept(assert_same_bits(&a->walls.wall[w].name, &b->walls.wall[w].name, sizeof(type));)
    TAL_WALL_FIELDS(X)
#undef X
  }
  assert_int_equal(a->graph.valid, b->graph.valid);
  if (!a->graph.valid)
    return;
  assert_int_equal(a->graph.mesh.triangle_count, b->graph.mesh.triangle_count);
  assert_same_bits(a->graph.mesh.corner, b->graph.mesh.corner, a->graph.mesh.triangle_count * sizeof(int32_t[3]));
  assert_int_equal(a->graph.loop.count, b->graph.loop.count);
  assert_same_bits(a->graph.loop.node, b->graph.loop.node, a->graph.loop.count * sizeof(int32_t));
  assert_same_bits(a->graph.inside, b->graph.inside, a->graph.mesh.triangle_count);
  assert_same_bits(a->graph.x, b->graph.x, a->graph.grain_count * sizeof(double));
  assert_same_bits(a->graph.y, b->graph.y, a->graph.grain_count * sizeof(double));
}

// Springs of touching pairs, found by (i, j) whatever the candidate lists hold besides.
static size_t assert_same_springs(const tal_contacts *a, const tal_contacts *b) {
  size_t found = 0;
  for (size_t c = 0; c < a->count; c++) {
    if (a->spring[c] == 0 && a->spring_stiffness[c] == 0)
      continue;
    size_t d = 0;
    while (d < b->count && (b->i[d] != a->i[c] || b->j[d] != a->j[c]))
      d++;
    assert_true(d < b->count);
    assert_same_bits(&a->spring[c], &b->spring[d], sizeof(double));
    assert_same_bits(&a->spring_stiffness[c], &b->spring_stiffness[d], sizeof(double));
    found++;
  }
  return found;
}

// EXACT: what is read is what was written, for odd values too, and the next checkpoint has the same bytes.
static void test_round_trip(void **state) {
  (void)state;
  small_run run;
  tal_error err = {""};
  small_run_begin(&run, 20);
  tal_sim *again = make_sim(&run.scene, 0);
  run.sim->grains.torque[1] = -0.0;
  run.sim->grains.omega[2] = 0x1p-1074;
  run.sim->run.held_work = (double)NAN;
  run.sim->run.height0 = (double)INFINITY;
  char *text = tal_scene_text(&run.scene), a[TAL_PATH_SIZE], b[TAL_PATH_SIZE];
  write_here(&run, "a.h5", run.sim);
  assert_int_equal(read_here(&run, "a.h5", again, text, &err), TAL_OK);
  assert_same_state(run.sim, again);
  assert_true(assert_same_springs(&run.sim->pairs, &again->pairs) > 5);
  assert_true(assert_same_springs(&run.sim->wall_contacts, &again->wall_contacts) > 2);
  tal_sim_restored(again);
  assert_same_state(run.sim, again);
  write_here(&run, "b.h5", again);
  in_folder(a, &run, "a.h5");
  in_folder(b, &run, "b.h5");
  assert_same_files(a, b);
  tal_sim_free(again);
  free(text);
  small_run_end(&run);
}

// EXACT: a state read back goes on to the same bits as the one that never stopped.
static void test_goes_on(void **state) {
  (void)state;
  small_run run;
  tal_error err = {""};
  small_run_begin(&run, 15);
  tal_sim *again = make_sim(&run.scene, 0);
  char *text = tal_scene_text(&run.scene);
  write_here(&run, "a.h5", run.sim);
  assert_int_equal(read_here(&run, "a.h5", again, text, &err), TAL_OK);
  tal_sim_restored(again);
  for (int k = 0; k < 300; k++) {
    assert_int_equal(tal_sim_step(run.sim, &err), TAL_OK);
    assert_int_equal(tal_sim_step(again, &err), TAL_OK);
  }
  assert_same_state(run.sim, again);
  tal_sim_free(again);
  free(text);
  small_run_end(&run);
}

// EXACT: two simulations that came to the same state on their own, with other rubbish in fresh memory.
static void test_equal_states_equal_bytes(void **state) {
  (void)state;
  small_run run;
  small_run_begin(&run, 100);
  char a[TAL_PATH_SIZE], b[TAL_PATH_SIZE];
  write_here(&run, "a.h5", run.sim);
  nanosleep(&(struct timespec){1, 100000000}, NULL); // another second, should a time of day get in
  mallopt(M_PERTURB, 0x5a);
  tal_sim *other = make_sim(&run.scene, 100);
  write_here(&run, "b.h5", other);
  mallopt(M_PERTURB, 0);
  in_folder(a, &run, "a.h5");
  in_folder(b, &run, "b.h5");
  assert_same_files(a, b);
  tal_sim_free(other);
  small_run_end(&run);
}

// Outside answer: every single flipped bit, checked by the seal; a sample of them through the whole reader.
static void test_flips_are_refused(void **state) {
  (void)state;
  small_run run;
  tal_error err = {""};
  small_run_begin(&run, 50);
  char path[TAL_PATH_SIZE], *text = tal_scene_text(&run.scene);
  size_t size;
  write_here(&run, "a.h5", run.sim);
  in_folder(path, &run, "a.h5");
  unsigned char *data = contents(path, &size);
  assert_true(tal_seal_check(data, size));
  for (size_t k = 0; k < size; k++) {
    data[k] ^= (unsigned char)(1 << k % 8);
    assert_false(tal_seal_check(data, size));
    data[k] ^= (unsigned char)(1 << k % 8);
  }
  for (size_t k = 0; k < size; k += size / 150) {
    flip_bit(path, k, (int)(k % 8));
    assert_int_equal(read_here(&run, "a.h5", run.sim, text, &err), TAL_BAD_INPUT);
    assert_true(holds(err.text, "a.h5 is damaged"));
    flip_bit(path, k, (int)(k % 8));
  }
  assert_int_equal(read_here(&run, "a.h5", run.sim, text, &err), TAL_OK);
  free(data);
  free(text);
  small_run_end(&run);
}

// Outside answer: cut anywhere or grown, it is refused; a missing one is a matter of files.
static void test_cuts_are_refused(void **state) {
  (void)state;
  small_run run;
  tal_error err = {""};
  small_run_begin(&run, 20);
  char path[TAL_PATH_SIZE], *text = tal_scene_text(&run.scene);
  size_t size;
  write_here(&run, "a.h5", run.sim);
  in_folder(path, &run, "a.h5");
  unsigned char *data = contents(path, &size);
  for (size_t length = 0; length < size; length += 1 + size / 60) {
    overwrite(path, data, length);
    assert_int_equal(read_here(&run, "a.h5", run.sim, text, &err), TAL_BAD_INPUT);
  }
  overwrite(path, data, size - 1);
  assert_int_equal(read_here(&run, "a.h5", run.sim, text, &err), TAL_BAD_INPUT);
  overwrite(path, data, size + 1); // contents() leaves one zero behind
  assert_int_equal(read_here(&run, "a.h5", run.sim, text, &err), TAL_BAD_INPUT);
  assert_int_equal(remove(path), 0);
  assert_int_equal(read_here(&run, "a.h5", run.sim, text, &err), TAL_IO);
  free(data);
  free(text);
  small_run_end(&run);
}

// Sealed, but not ours: another scene (the line is named), another number of grains, another format, no checkpoint at
// all.
static void test_foreign_is_refused(void **state) {
  (void)state;
  small_run run;
  tal_error err = {""};
  small_run_begin(&run, 20);
  char path[TAL_PATH_SIZE], *text = tal_scene_text(&run.scene);
  write_here(&run, "a.h5", run.sim);
  assert_int_equal(read_here(&run, "a.h5", run.sim, other_text, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "another scene: line 1") && holds(err.text, "name: other"));
  run.sim->grains.count--;
  assert_int_equal(read_here(&run, "a.h5", run.sim, text, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "holds 12 grains, the scene makes 11"));
  run.sim->grains.count++;
  tal_store store;
  in_folder(path, &run, "b.h5");
  tal_store_begin(&store);
  tal_store_put_integer(&store, "format", 99);
  tal_store_put_text(&store, "version", "7.5");
  assert_int_equal(tal_store_save(&store, path, NULL, &err), TAL_OK);
  assert_int_equal(read_here(&run, "b.h5", run.sim, text, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "written by talus 7.5 (format 99)"));
  tal_store_begin(&store);
  tal_store_put_integer(&store, "format", TAL_CHECKPOINT_FORMAT);
  assert_int_equal(tal_store_save(&store, path, NULL, &err), TAL_OK);
  assert_int_equal(read_here(&run, "b.h5", run.sim, text, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "not as expected"));
  free(text);
  small_run_end(&run);
}

// EXACT: the one before is kept under its name, and the head says what was put in.
static void test_previous_is_kept(void **state) {
  (void)state;
  small_run run;
  tal_error err = {""};
  small_run_begin(&run, 10);
  char path[TAL_PATH_SIZE], previous[TAL_PATH_SIZE], *text = tal_scene_text(&run.scene);
  tal_run_files files = {.series_bytes = 77, .series_step = 10, .tracks_bytes = 8, .tracks_step = 9};
  in_folder(path, &run, "checkpoint.h5");
  in_folder(previous, &run, "checkpoint.prev.h5");
  for (int k = 0; k < 3; k++) {
    assert_int_equal(tal_checkpoint_write(path, previous, run.sim, text, &files, &err), TAL_OK);
    assert_int_equal(tal_file_exists(previous), k > 0);
    tal_checkpoint_head head;
    assert_int_equal(tal_checkpoint_peek(path, &head, &err), TAL_OK);
    assert_int_equal(head.run.step, 10 + k);
    assert_int_equal(head.grain_count, 12);
    assert_false(head.complete);
    assert_int_equal(head.files.series_bytes, 77);
    assert_int_equal(head.files.tracks_step, 9);
    tal_run_files_clear(&head.files);
    if (k > 0) {
      assert_int_equal(tal_checkpoint_peek(previous, &head, &err), TAL_OK);
      assert_int_equal(head.run.step, 9 + k);
      tal_run_files_clear(&head.files);
    }
    assert_int_equal(tal_sim_step(run.sim, &err), TAL_OK);
  }
  free(text);
  small_run_end(&run);
}

static void write_for_ever(const small_run *run, const char *path, const char *previous, const char *text) {
  tal_run_files files = {.series_step = -1, .tracks_step = -1};
  for (;;) {
    run->sim->run.step++;
    if (tal_checkpoint_write(path, previous, run->sim, text, &files, NULL) != TAL_OK)
      _exit(1);
  }
}

// Outside answer: killed at 100 random moments in the middle of writing, one of the two names is always good, and it
// never goes back by more than the checkpoint before.
static void test_kills_leave_a_good_one(void **state) {
  (void)state;
  small_run run;
  tal_error err = {""};
  small_run_begin(&run, 10);
  char path[TAL_PATH_SIZE], previous[TAL_PATH_SIZE], *text = tal_scene_text(&run.scene);
  in_folder(path, &run, "checkpoint.h5");
  in_folder(previous, &run, "checkpoint.prev.h5");
  tal_run_files none = {.series_step = -1};
  assert_int_equal(tal_checkpoint_write(path, previous, run.sim, text, &none, &err), TAL_OK);
  int64_t last = run.sim->run.step;
  srand(1);
  for (int k = 0; k < 100; k++) {
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0)
      write_for_ever(&run, path, previous, text);
    nanosleep(&(struct timespec){0, 1000 * (rand() % 8000)}, NULL);
    kill(child, SIGKILL);
    assert_int_equal(wait_for(child), -1);
    tal_checkpoint_head head;
    const char *good = tal_file_exists(path) ? path : previous;
    if (tal_checkpoint_peek(good, &head, &err) != TAL_OK)
      fail_msg("%s", err.text);
    assert_true(head.run.step + 1 >= last);
    last = run.sim->run.step = head.run.step;
    tal_run_files_clear(&head.files);
  }
  free(text);
  small_run_end(&run);
}

// Outside answer: a disk that fills up at any point of the file gives TAL_IO and leaves the old checkpoint as it was.
static void test_full_disk(void **state) {
  (void)state;
  small_run run;
  small_run_begin(&run, 10);
  char path[TAL_PATH_SIZE], previous[TAL_PATH_SIZE], temporary[TAL_PATH_SIZE], *text = tal_scene_text(&run.scene);
  size_t size;
  write_here(&run, "checkpoint.h5", run.sim);
  in_folder(path, &run, "checkpoint.h5");
  in_folder(previous, &run, "checkpoint.prev.h5");
  in_folder(temporary, &run, "checkpoint.h5.tmp");
  unsigned char *before = contents(path, &size);
  for (size_t limit = 0; limit < size - 1000; limit += size / 7) {
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
      tal_error err = {""};
      tal_run_files none = {.series_step = -1};
      limit_files(limit);
      tal_status status = tal_checkpoint_write(path, previous, run.sim, text, &none, &err);
      _exit(status == TAL_IO && holds(err.text, "checkpoint.h5") && holds(err.text, "File too large") ? 0 : 1);
    }
    assert_int_equal(wait_for(child), 0);
    size_t now;
    unsigned char *after = contents(path, &now);
    assert_int_equal(now, size);
    assert_memory_equal(after, before, size);
    assert_false(tal_file_exists(previous));
    assert_false(tal_file_exists(temporary));
    free(after);
  }
  free(before);
  free(text);
  small_run_end(&run);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_round_trip),
      cmocka_unit_test(test_goes_on),
      cmocka_unit_test(test_equal_states_equal_bytes),
      cmocka_unit_test(test_flips_are_refused),
      cmocka_unit_test(test_cuts_are_refused),
      cmocka_unit_test(test_foreign_is_refused),
      cmocka_unit_test(test_previous_is_kept),
      cmocka_unit_test(test_kills_leave_a_good_one),
      cmocka_unit_test(test_full_disk),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
