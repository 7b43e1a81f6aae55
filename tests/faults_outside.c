// What others do to a run: signals at any moment, readers of its files while it writes them, two runs begun at once in
// one folder, a disk that is really full or read-only (a small file system of our own, where we may mount one), a limit
// on the size of files.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "faults.h"
#include "variants.h"
#include <hdf5.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>

static const char *const sets[] = {
    "--set=output={series_every: 2e-4, fields_every: 3e-4, checkpoint_every: 4e-4, tracks: [1]}", NULL};

static char *whole(program *p, const char *const *with) {
  program_write(p, "s.yaml", variants_scene);
  faults_done(p, &(faults_run){"whole", "1", with, false});
  return faults_print(p, "whole");
}

// EXACT: each of the four signals, at any write: exit 75, one line that says how to go on, the same bits; a hang-up
// that nohup has told us to ignore changes nothing.
static void signals(void **state) {
  static const int numbers[] = {SIGINT, SIGTERM, SIGHUP, SIGUSR1};
  program *p = *state;
  char *print = whole(p, sets);
  long trials = 0;
  for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++) {
    for (long n = faults_long() ? 1 : 3 + 9 * (long)k;; n += faults_long() ? 1 : 60) {
      char how[8], what[60];
      outcome got;
      snprintf(how, sizeof how, "s%d", numbers[k]);
      snprintf(what, sizeof what, "signal %d at write %ld", numbers[k], n);
      faults_remove(p, "parts");
      faults_plan(p, "write", n, how);
      faults_do(p, &(faults_run){"parts", "1", sets, false}, &got);
      if (!faults_struck(p))
        break;
      const bool stopped =
          got.code == 75 && count_lines(got.err) == 1 && strstr(got.err, "talus run s.yaml -o parts --resume");
      if (!stopped && !(got.code == 0 && !*got.err)) // the last of the writes come after the last step
        fail_msg("%s: exit %d\n%s", what, got.code, got.err);
      if (stopped)
        assert_sound(p, "parts", what);
      faults_recover(p, &(faults_run){"parts", "1", sets, false}, print, what);
      trials++;
    }
  }
  signal(SIGHUP, SIG_IGN);
  faults_remove(p, "parts");
  faults_plan(p, "write", 9, "s1");
  faults_done(p, &(faults_run){"parts", "1", sets, false});
  signal(SIGHUP, SIG_DFL);
  assert_printed(p, "parts", print, "nohup");
  free(print);
  faults_held("SIGINT, SIGTERM, SIGHUP, SIGUSR1", trials, "one line, exit 75; resumed to the same bits");
}

// ---- readers ----

// The last frame of fields.h5 through its link: its number of grains; 0 when there is no file yet, -1 when it is bad.
static long read_last_frame(const char *path) {
  if (access(path, R_OK) != 0)
    return 0;
  long grains = -1;
  H5G_info_t info;
  char name[40];
  hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT), frames = -1, set = -1;
  if (file >= 0)
    frames = H5Gopen2(file, "frames", H5P_DEFAULT);
  if (frames >= 0 && H5Gget_info(frames, &info) >= 0 && info.nlinks > 0) {
    snprintf(name, sizeof name, "%06llu/grains/x", (unsigned long long)info.nlinks - 1);
    set = H5Dopen2(frames, name, H5P_DEFAULT);
  }
  double x[64];
  if (set >= 0 && H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, x) >= 0)
    grains = 16;
  if (set >= 0)
    H5Dclose(set);
  if (frames >= 0)
    H5Gclose(frames);
  if (file >= 0)
    H5Fclose(file);
  return grains;
}

// EXACT: fields.h5 opened over and over while the run writes it: each time a whole frame, and the run has its bits.
static void read_while_running(void **state) {
  static const char *const often[] = {
      "--set=output={series_every: 2e-4, fields_every: 3e-5, checkpoint_every: 1e-4, tracks: [1]}", NULL};
  program *p = *state;
  char *print = whole(p, often), path[4400];
  snprintf(path, sizeof path, "%s", program_path(p, "parts/fields.h5"));
  long reads = 0;
  for (int rounds = 0; rounds < (faults_long() ? 20 : 1); rounds++) {
    outcome got;
    faults_remove(p, "parts");
    process child = faults_start(p, &(faults_run){"parts", "1", often, false});
    for (siginfo_t ended = {0}; !ended.si_pid; waitid(P_PID, (id_t)child.id, &ended, WEXITED | WNOHANG | WNOWAIT)) {
      const long grains = read_last_frame(path);
      if (grains < 0)
        fail_msg("fields.h5 could not be read after %ld reads", reads);
      reads += grains > 0;
      faults_sleep(1e-4);
    }
    process_wait(&child, &got);
    assert_outcome("read while running", &got, 0, "");
    assert_printed(p, "parts", print, "read while running");
  }
  assert_true(reads > 3);
  free(print);
  faults_held("fields.h5 read while it is written", reads, "each a whole frame; the run has its bits");
}

// EXACT: of two runs begun at the same time in one folder one is refused, whichever; the other has its bits.
static void two_at_once(void **state) {
  program *p = *state;
  char *print = whole(p, sets);
  const int trials = faults_long() ? 100 : 3;
  for (int k = 0; k < trials; k++) {
    outcome a, b;
    faults_remove(p, "parts");
    process first = faults_start(p, &(faults_run){"parts", "1", sets, false});
    process second = faults_start(p, &(faults_run){"parts", "1", sets, false});
    process_wait(&first, &a);
    process_wait(&second, &b);
    const outcome *refused = a.code ? &a : &b, *done = a.code ? &b : &a;
    if (done->code != 0 || refused->code != 2 || count_lines(refused->err) != 1 ||
        !(strstr(refused->err, "a run is at work in parts") || strstr(refused->err, "parts already holds a run")))
      fail_msg("exits %d and %d\n%s%s", a.code, b.code, a.err, b.err);
    assert_printed(p, "parts", print, "two at once");
  }
  free(print);
  faults_held("two runs begun at once in one folder", trials, "one refused, the other has its bits");
}

// EXACT: files that may not grow beyond a limit: exit 4, one line; without it the same bits.
static void file_limit(void **state) {
  static const rlim_t limits[] = {100, 4000, 12000, 30000};
  program *p = *state;
  char *print = whole(p, sets);
  for (size_t k = 0; k < sizeof limits / sizeof *limits; k++) {
    const faults_run run = {"parts", "1", sets, false};
    struct rlimit before;
    outcome got;
    faults_remove(p, "parts");
    getrlimit(RLIMIT_FSIZE, &before);
    process child = {0};
    setrlimit(RLIMIT_FSIZE, &(struct rlimit){limits[k], before.rlim_max});
    child = faults_start(p, &run);
    process_wait(&child, &got);
    setrlimit(RLIMIT_FSIZE, &before);
    if (got.code != 4 || count_lines(got.err) != 1 || !strstr(got.err, "File too large"))
      fail_msg("limit %ld: exit %d\n%s", (long)limits[k], got.code, got.err);
    faults_recover(p, &run, print, "beyond a limit");
  }
  free(print);
  faults_held("a limit on the size of files", sizeof limits / sizeof *limits,
              "one line, exit 4; resumed to the same bits");
}

// ---- a disk of our own ----

// Mounts in a name space of our own, which ends with this process. False where that is not allowed.
static bool own_mounts(void) {
  const uid_t user = getuid();
  if (unshare(CLONE_NEWNS | (user ? CLONE_NEWUSER : 0)) != 0)
    return false;
  FILE *map = user ? fopen("/proc/self/uid_map", "w") : NULL;
  if (map) {
    fprintf(map, "0 %u 1\n", (unsigned)user);
    fclose(map);
  }
  return mount("none", "/", NULL, MS_REC | MS_PRIVATE, NULL) == 0;
}

static void remount(program *p, unsigned long flags, const char *options) {
  if (mount("none", program_path(p, "disk"), NULL, MS_REMOUNT | flags, options) != 0)
    fail_msg("remounting: %s", strerror(errno));
}

static void assert_no_disk(program *p, const faults_run *run, const char *reason) {
  outcome got;
  faults_do(p, run, &got);
  if (got.code != 4 || count_lines(got.err) != 1 || !strstr(got.err, reason) || *got.out)
    fail_msg("exit %d, expected 4 and one line with '%s'\n%s%s", got.code, reason, got.out, got.err);
}

static void fill_disk(program *p, const char *print, int kilobytes) {
  const faults_run run = {"disk/out", "1", sets, false};
  char size[40];
  snprintf(size, sizeof size, "size=%dk", kilobytes);
  faults_remove(p, "disk/out");
  remount(p, 0, size);
  assert_no_disk(p, &run, "No space left on device");
  remount(p, 0, "size=16m");
  faults_recover(p, &run, print, size);
}

static void lock_disk(program *p, const char *print) {
  const faults_run run = {"disk/out", "1", sets, false}, again = {"disk/out", "1", sets, true},
                   fresh = {"disk/new", "1", sets, false};
  outcome got;
  faults_remove(p, "disk/out");
  faults_plan(p, "write", 30, "s15");
  faults_do(p, &run, &got);
  assert_int_equal(got.code, 75);
  faults_plan(p, NULL, 0, NULL);
  remount(p, MS_RDONLY, NULL);
  assert_no_disk(p, &fresh, "Read-only file system");
  assert_no_disk(p, &again, "Read-only file system");
  remount(p, 0, "size=16m");
  faults_recover(p, &run, print, "read-only");
}

// EXACT: full at every size there is, and read-only.
static void full_and_read_only(void **state) {
  program *p = *state;
  char *print = whole(p, sets);
  assert_int_equal(mkdir(program_path(p, "disk"), 0777), 0);
  if (!own_mounts() || mount("none", program_path(p, "disk"), "tmpfs", 0, "size=16m") != 0) {
    faults_held("a full and a read-only disk", 0, "not tried: no file system may be mounted here");
    free(print);
    return;
  }
  faults_done(p, &(faults_run){"disk/out", "1", sets, false});
  int trials = 0, most = 0;
  FTS *walk = walk_begin(program_path(p, "disk/out"));
  for (FTSENT *entry; (entry = fts_read(walk));)
    most += entry->fts_info == FTS_F ? (int)((entry->fts_statp->st_size + 4095) / 4096 * 4) : 0;
  fts_close(walk);
  for (int size = 4; size < most - 8; size += faults_long() ? 8 : most / 3, trials++)
    fill_disk(p, print, size);
  lock_disk(p, print);
  umount(program_path(p, "disk"));
  free(print);
  assert_true(trials > 2);
  faults_held("a full disk", trials, "one line, exit 4; with room resumed to the same bits");
  faults_held("a read-only disk", 2, "one line, exit 4; resumed to the same bits");
}

int main(int argc, char **argv) {
  if (argc > 1)
    cmocka_set_test_filter(argv[1]);
  const struct CMUnitTest tests[] = {
      faults_test(signals),
      faults_test(read_while_running),
      faults_test(two_at_once),
      faults_test(file_limit),
      faults_test(full_and_read_only), // last: this process then has mounts of its own
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
