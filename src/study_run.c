// Runs of a study as child processes: fork and exec of the program itself, one thread each, as many at a time as there
// are cores, the longest first so that the last cores do not wait. What a run comes to is read from its folder
// afterwards (study_state.c), so nothing is lost when this process is.
#include "files.h"
#include "progress.h"
#include "study.h"
#include "study_state.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <omp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { BAR = 20 };
static const double patience = 10; // [s] for runs that another process is at work on

static const int stopping[] = {SIGINT, SIGTERM, SIGUSR1, SIGHUP};
enum { STOPPING = sizeof stopping / sizeof *stopping };

static volatile sig_atomic_t asked_to_stop;

static void ask_to_stop(int number) {
  (void)number;
  asked_to_stop = 1;
}

typedef struct worker {
  pid_t child; // 0: free
  size_t run;
} worker;

typedef struct crew {
  const tal_study *study;
  const tal_study_options *options;
  size_t *todo; // owned; [todo_count] indices of runs, the longest first
  size_t todo_count;
  worker *workers; // owned; [cores]
  int cores;
  size_t before, ended, failed; // runs finished before, ended now, of these not done
  double steps_ended, steps_todo;
  double started, shown; // [s]
  bool on_terminal;
  struct sigaction old[STOPPING];
} crew;

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// ---- locks and folders ----

// Locks dir/.lock; -1 when another process holds it (errno EWOULDBLOCK) or it cannot be made.
static int lock_folder(const char *dir) {
  char path[TAL_PATH_SIZE];
  tal_file_path(path, dir, ".lock");
  int fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (fd < 0 || flock(fd, LOCK_EX | LOCK_NB) == 0)
    return fd;
  int why = errno;
  close(fd);
  errno = why;
  return -1;
}

static int remove_entry(const char *path, const struct stat *info, int type, struct FTW *walk) {
  (void)info, (void)type, (void)walk;
  return remove(path);
}

// True when the folder holds a checkpoint to go on from. A run killed before its first one left nothing of use: its
// folder is removed, unless somebody is at work there.
static bool prepare_folder(const char *folder) {
  static const char *const names[] = {"checkpoint.h5", "checkpoint.prev.h5"};
  char path[TAL_PATH_SIZE];
  for (size_t k = 0; k < 2; k++) {
    tal_file_path(path, folder, names[k]);
    if (tal_file_exists(path))
      return true;
  }
  if (!tal_file_exists(folder))
    return false;
  int lock = lock_folder(folder);
  if (lock < 0)
    return false;
  nftw(folder, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
  close(lock);
  return false;
}

// ---- one child ----

// Between fork and exec only what is safe after fork in a process with threads.
static void become(const char *program, char *const *argv, const char *log, pid_t parent) {
  sigset_t none;
  prctl(PR_SET_PDEATHSIG, SIGTERM); // should the study be killed, its runs write a checkpoint and end
  if (getppid() != parent)
    _exit(TAL_INTERRUPTED);
  int out = open(log, O_WRONLY | O_CREAT | O_TRUNC, 0666), in = open("/dev/null", O_RDONLY);
  if (out < 0 || in < 0 || dup2(in, 0) < 0 || dup2(out, 1) < 0 || dup2(out, 2) < 0)
    _exit(TAL_IO);
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, NULL);
  execv(program, argv);
  static const char sorry[] = "the program cannot be started\n";
  const ssize_t written = write(2, sorry, sizeof sorry - 1);
  (void)written; // nobody is left to tell
  _exit(TAL_IO);
}

static tal_status start(crew *this, worker *free_worker, size_t r, tal_error *err) {
  const tal_study_run *run = &this->study->runs[r];
  char folder[TAL_PATH_SIZE], log[TAL_PATH_SIZE + 16];
  tal_study_folder(folder, sizeof folder, this->options->dir, run);
  tal_study_log(log, sizeof log, this->options->dir, run);
  const bool resume = prepare_folder(folder);
  char **words = tal_study_words(this->study, run, this->options->dir);
  size_t count = 0;
  while (words[count])
    count++;
  char **argv = tal_alloc(count + 3, sizeof *argv), name[] = "talus", go_on[] = "--resume";
  argv[0] = name;
  memcpy(argv + 1, words, count * sizeof *argv);
  argv[count + 1] = resume ? go_on : NULL;
  const pid_t parent = getpid();
  free_worker->child = fork();
  if (free_worker->child == 0)
    become(this->options->program, argv, log, parent);
  free_worker->run = r;
  free(argv);
  tal_study_words_free(words);
  if (free_worker->child > 0)
    return TAL_OK;
  free_worker->child = 0;
  return tal_fail(err, TAL_IO, "a run could not be started: %s", strerror(errno));
}

// ---- all of them ----

static void show(crew *this, bool last) {
  const double time = now();
  if (!this->on_terminal || (!last && time - this->shown < 0.25))
    return;
  this->shown = time;
  int at_work = 0;
  for (int k = 0; k < this->cores; k++)
    at_work += this->workers[k].child > 0;
  char rest[24] = "--:--", failed[40] = "";
  if (this->steps_ended > 0)
    tal_progress_put_time(rest, sizeof rest,
                          (time - this->started) * (this->steps_todo - this->steps_ended) / this->steps_ended);
  if (this->failed)
    snprintf(failed, sizeof failed, ", %zu failed", this->failed);
  const size_t done = this->before + this->ended, all = this->study->run_count;
  const int filled = all ? (int)(BAR * done / all) : 0;
  fprintf(stderr, "\r[%.*s%.*s] %zu/%zu runs, %d at work%s  about %s left\033[K", filled, "####################",
          BAR - filled, "....................", done, all, at_work, failed, rest);
  if (last)
    fputs("\r\033[K", stderr);
  fflush(stderr);
}

// Leaves in the log what the run itself could not say.
static void note_signal(const crew *this, size_t r, int number) {
  char log[TAL_PATH_SIZE + 16];
  tal_study_log(log, sizeof log, this->options->dir, &this->study->runs[r]);
  FILE *file = fopen(log, "a");
  if (!file)
    return;
  fprintf(file, "ended by signal %d (%s)\n", number, strsignal(number));
  fclose(file);
}

// Takes up what a child has come to. An interrupted one has not ended.
static void settle(crew *this, worker *one, int result) {
  one->child = 0;
  if (WIFSIGNALED(result))
    note_signal(this, one->run, WTERMSIG(result));
  if (WIFEXITED(result) && WEXITSTATUS(result) == TAL_INTERRUPTED)
    return;
  this->ended++;
  this->steps_ended += this->study->runs[one->run].steps;
  this->failed += !WIFEXITED(result) || WEXITSTATUS(result) != 0;
}

// Is another process at work on the run?
static bool taken(const crew *this, size_t r) {
  char folder[TAL_PATH_SIZE];
  tal_study_folder(folder, sizeof folder, this->options->dir, &this->study->runs[r]);
  if (!tal_file_exists(folder))
    return false;
  const int lock = lock_folder(folder);
  const bool elsewhere = lock < 0 && errno == EWOULDBLOCK;
  if (lock >= 0)
    close(lock);
  return elsewhere;
}

// Takes the next run that nobody is at work on off the list; false when there is none.
static bool pick(crew *this, size_t *r) {
  for (size_t k = 0; k < this->todo_count; k++) {
    if (taken(this, this->todo[k]))
      continue;
    *r = this->todo[k];
    this->todo_count--;
    memmove(this->todo + k, this->todo + k + 1, (this->todo_count - k) * sizeof *this->todo);
    return true;
  }
  return false;
}

// Children that have ended; returns the number still at work.
static int collect(crew *this) {
  int at_work = 0;
  for (int k = 0; k < this->cores; k++) {
    worker *one = &this->workers[k];
    int result;
    if (!one->child)
      continue;
    const pid_t got = waitpid(one->child, &result, WNOHANG);
    if (got == one->child)
      settle(this, one, result);
    else if (got < 0 && errno == ECHILD)
      one->child = 0;
    at_work += one->child > 0;
  }
  return at_work;
}

static void stop_children(const crew *this) {
  for (int k = 0; k < this->cores; k++)
    if (this->workers[k].child)
      kill(this->workers[k].child, SIGTERM);
}

// Gives every idle worker a run; returns the number of runs started.
static int fill_up(crew *this, tal_status *status, tal_error *err) {
  int started = 0;
  for (int k = 0; k < this->cores && *status == TAL_OK; k++) {
    size_t r;
    if (this->workers[k].child)
      continue;
    if (!pick(this, &r))
      break;
    *status = start(this, &this->workers[k], r, err);
    started += *status == TAL_OK;
  }
  return started;
}

static tal_status work(crew *this, tal_error *err) {
  const struct timespec pause = {.tv_nsec = 10000000};
  tal_status status = TAL_OK;
  bool told = false;
  for (double last_at_work = now();; nanosleep(&pause, NULL)) {
    int at_work = collect(this);
    if ((asked_to_stop || status) && !told) {
      stop_children(this);
      told = true;
    }
    if (!told)
      at_work += fill_up(this, &status, err);
    show(this, false);
    if (at_work)
      last_at_work = now();
    else if (told || this->todo_count == 0 || now() - last_at_work > patience)
      break;
  }
  return status ? status : asked_to_stop ? TAL_INTERRUPTED : TAL_OK;
}

// Insertion by nominal length: a study has hundreds of runs, not millions.
static void list_todo(crew *this) {
  const tal_study *study = this->study;
  this->todo = tal_alloc(study->run_count + 1, sizeof *this->todo);
  for (size_t r = 0; r < study->run_count; r++) {
    const tal_study_state state = tal_study_state_read(study, &study->runs[r], this->options->dir);
    if (state.status == TAL_RUN_DONE || (state.status == TAL_RUN_FAILED && state.final)) {
      this->before++;
      this->failed += state.status == TAL_RUN_FAILED;
      continue;
    }
    size_t at = this->todo_count++;
    for (; at > 0 && study->runs[this->todo[at - 1]].steps < study->runs[r].steps; at--)
      this->todo[at] = this->todo[at - 1];
    this->todo[at] = r;
    this->steps_todo += study->runs[r].steps;
  }
}

static void catch_signals(crew *this) {
  struct sigaction action = {.sa_handler = ask_to_stop};
  sigemptyset(&action.sa_mask);
  asked_to_stop = 0;
  for (int k = 0; k < STOPPING; k++) {
    sigaction(stopping[k], &action, &this->old[k]);
    if (stopping[k] == SIGHUP && this->old[k].sa_handler == SIG_IGN) // nohup: it is to go on
      sigaction(SIGHUP, &this->old[k], NULL);
  }
}

static void release_signals(const crew *this) {
  for (int k = 0; k < STOPPING; k++)
    sigaction(stopping[k], &this->old[k], NULL);
}

tal_status tal_study_run_all(const tal_study *study, const tal_study_options *options, tal_error *err) {
  char logs[TAL_PATH_SIZE];
  tal_file_path(logs, options->dir, "logs");
  tal_status status = tal_folder_create(logs, err);
  if (status)
    return status;
  int lock = lock_folder(options->dir);
  if (lock < 0)
    return errno == EWOULDBLOCK ? tal_fail(err, TAL_BAD_INPUT, "a study is at work in %s", options->dir)
                                : tal_fail(err, TAL_IO, "%s/.lock: %s", options->dir, strerror(errno));
  crew this = {.study = study, .options = options, .started = now()};
  this.cores = options->cores > 0 ? options->cores : omp_get_num_procs();
  this.workers = tal_alloc((size_t)this.cores, sizeof *this.workers);
  this.on_terminal = !options->quiet && isatty(STDERR_FILENO);
  list_todo(&this);
  catch_signals(&this);
  status = work(&this, err);
  show(&this, true);
  release_signals(&this);
  close(lock);
  free(this.workers);
  free(this.todo);
  return status;
}
