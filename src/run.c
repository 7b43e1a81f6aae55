#include "run.h"

#include "checkpoint.h"
#include "critical.h"
#include "effects.h"
#include "files.h"
#include "forced.h"
#include "forces.h"
#include "inspect.h"
#include "integrate.h"
#include "output.h"
#include "progress.h"
#include "step.h"

#include <math.h>
#include <omp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

// Set by the handler of SIGINT, SIGTERM, SIGUSR1 and SIGHUP; a signal has no other way to reach a loop.
static volatile sig_atomic_t asked_to_stop;

static void ask_to_stop(int number) {
  (void)number;
  asked_to_stop = 1;
}

static void catch_signals(void) {
  struct sigaction action = {.sa_handler = ask_to_stop};
  sigemptyset(&action.sa_mask);
  asked_to_stop = 0;
  sigaction(SIGINT, &action, NULL);
  sigaction(SIGTERM, &action, NULL);
  sigaction(SIGUSR1, &action, NULL);
  struct sigaction before;
  if (sigaction(SIGHUP, NULL, &before) == 0 && before.sa_handler != SIG_IGN) // else nohup: it is to go on
    sigaction(SIGHUP, &action, NULL);
  signal(SIGXFSZ, SIG_IGN); // a file beyond the limit is a write that fails and says so
}

static double clock_read(clockid_t clock) {
  struct timespec now;
  clock_gettime(clock, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static double clock_now(void) {
  return clock_read(CLOCK_MONOTONIC);
}

static double cpu_now(void) {
  return clock_read(CLOCK_PROCESS_CPUTIME_ID);
}

// A run under way: what the observers share.
typedef struct job {
  const tal_scene *scene;
  tal_sim *sim;
  tal_output *output;
  tal_progress progress;
  tal_row row;                 // of the last look at the ledger
  int64_t looked;              // step of that look, -1: none yet
  tal_stage_report *stages;    // owned; [stage_count]
  double started, cpu_started; // [s] clocks when this part of the run began
  double stage_started, stage_cpu_started;
  int64_t first_step;
  double wall_before, cpu_before; // [s] of the parts of the run before this one
  double phi;                     // largest of the rows of stages with a rate
  int cores;
  bool checkpoint; // one has been written, or the run was resumed from one
} job;

enum { WARNINGS = 4, WARNING_SIZE = 200 };

// What the user should know about the accuracy of this run; count of sentences in `text`.
static size_t warnings(const job *this, char text[WARNINGS][WARNING_SIZE]) {
  double friction = tal_friction_step(this->sim, this->sim->run.pressure);
  double dt = tal_step_longest(this->sim);
  size_t count = 0;
  if (dt > friction && !(this->sim->effects & TAL_EFFECT_IMPLICIT))
    snprintf(text[count++], WARNING_SIZE,
             "dt = %g s: explicit regularised friction chatters above %.3g s, which softens the response and adds slip",
             dt, friction);
  if (this->phi > TAL_QUASISTATIC_LIMIT)
    snprintf(text[count++], WARNING_SIZE,
             "phi reached %.3g: above %g the deformation is not quasi-static; lower mass_scaling or rate", this->phi,
             TAL_QUASISTATIC_LIMIT);
  if (this->sim->run.outside_most > 0)
    snprintf(
        text[count++], WARNING_SIZE,
        "up to %lld grains at a time lay outside the boundary: nothing pressed on them until it reached them again",
        (long long)this->sim->run.outside_most);
  tal_forced_warning(this->sim, text[count], WARNING_SIZE);
  return count + (*text[count] != '\0');
}

static tal_status report_run(job *this, const char *name, const char *reason, tal_error *err) {
  double took = clock_now() - this->started;
  int64_t steps = this->sim->run.step - this->first_step;
  char text[WARNINGS][WARNING_SIZE];
  const char *const sentences[WARNINGS] = {text[0], text[1], text[2], text[3]};
  tal_run_report report = {.status = name,
                           .reason = reason,
                           .cores = this->cores,
                           .wall_time = this->wall_before + took,
                           .cpu_time = this->cpu_before + cpu_now() - this->cpu_started,
                           .grain_steps_per_second =
                               took > 0 ? (double)steps * (double)this->sim->grains.count / took : 0,
                           .energy_residual = this->row.energy_residual,
                           .stages = this->stages,
                           .stage_count = this->scene->stage_count,
                           .warnings = sentences,
                           .warning_count = warnings(this, text)};
  return tal_output_report(this->output, this->sim, &report, err);
}

// Nothing that has gone bad is written. Leaves the row of this instant.
static tal_status inspect(job *this, tal_error *err) {
  tal_status status = tal_inspect(this->sim, err);
  if (status || this->looked == this->sim->run.step)
    return status;
  const tal_row before = this->row;
  tal_sim_row(this->sim, &this->row);
  if (this->looked >= 0)
    status = tal_inspect_energy(this->sim, &before, &this->row, err);
  this->looked = this->sim->run.step;
  return status;
}

// Books the time since the last call on the stage.
static void account_stage(job *this, int64_t stage) {
  if (!this->scene->stage_count)
    return;
  tal_stage_report *report = &this->stages[stage];
  const double now = clock_now(), cpu = cpu_now();
  report->steps = this->sim->run.stage_step;
  report->wall_time += now - this->stage_started;
  report->cpu_time += cpu - this->stage_cpu_started;
  report->grain_steps_per_second =
      report->wall_time > 0 ? (double)report->steps * (double)this->sim->grains.count / report->wall_time : 0;
  this->stage_started = now;
  this->stage_cpu_started = cpu;
}

// Times are booked with every checkpoint: what a killed run has cost up to there is not lost.
static tal_status write_checkpoint(job *this, tal_error *err) {
  tal_status status = inspect(this, err);
  if (status == TAL_OK)
    status = tal_output_checkpoint(this->output, this->sim, err);
  if (status)
    return status;
  this->checkpoint = true;
  account_stage(this, this->sim->run.stage);
  return report_run(this, "running", "", err);
}

// Small steps in the whole number of cycles of the integrator nearest to `every`, at least one; 0 for never.
static int64_t cadence(double every, const tal_sim *sim) {
  if (!isfinite(every))
    return 0;
  const tal_scene_integrator *plan = &tal_sim_stage(sim)->integrator;
  const int64_t cycle = tal_integrate_cycle(plan);
  double cycles = round(every / (plan->dt * (double)cycle));
  return cycles < 1 ? cycle : (int64_t)cycles * cycle;
}

static bool falls_due(const tal_sim *sim, double every, int64_t stage_step) {
  const int64_t steps = cadence(every, sim);
  return steps > 0 && stage_step % steps == 0;
}

// What is written after a step.
typedef struct looks {
  bool row, fields, checkpoint;
} looks;

// After that step of the stage, should the stage not end there.
static looks looks_after(const job *this, int64_t stage_step) {
  const tal_scene_output *plan = &this->scene->output;
  return (looks){.row = falls_due(this->sim, plan->series_every, stage_step),
                 .fields = falls_due(this->sim, plan->fields_every, stage_step),
                 .checkpoint = falls_due(this->sim, plan->checkpoint_every, stage_step)};
}

// phi of the row just taken where the stage has a rate, else 0. Not below the stage's pressure: a packing that is
// compressed as it was made bears no stress at first.
static double phi_now(const job *this) {
  const tal_scene_stage *plan = tal_sim_stage(this->sim);
  if (!plan || !(fabs(plan->rate) > 0))
    return 0;
  double height = 2 * this->sim->constants.mean_radius / this->row.psi;
  double pressure = fmax(0.5 * (this->row.sigma_xx + this->row.sigma_yy), plan->pressure);
  return tal_quasistatic_coefficient(this->sim, fabs(plan->rate), pressure, height);
}

static tal_status write_row(job *this, bool fields, tal_error *err) {
  tal_status status = inspect(this, err);
  if (status)
    return status;
  this->phi = fmax(this->phi, phi_now(this));
  if ((status = tal_output_row(this->output, &this->row, err)))
    return status;
  if (fields && (status = tal_output_fields(this->output, this->sim, err)))
    return status;
  if (!this->scene->output.track_count)
    return TAL_OK;
  tal_sim_observe(this->sim); // last: it overwrites the driving forces in the slots
  return tal_output_tracks(this->output, this->sim, err);
}

// Everything that looks at the run between two steps.
static tal_status observe(job *this, looks due, tal_error *err) {
  const bool ends = this->sim->run.stage_done, fields = ends || due.fields;
  tal_status status = fields || due.row ? write_row(this, fields, err) : TAL_OK;
  if (status == TAL_OK && (tal_sim_done(this->sim) || due.checkpoint))
    status = write_checkpoint(this, err);
  return status;
}

// One step, watched where its forces are written; a run that is asked to stop makes one that can be.
static tal_status step(job *this, tal_error *err) {
  tal_sim *sim = this->sim;
  const int64_t stage = sim->run.stage;
  const bool enters = !sim->run.stage_begun || sim->run.stage_done; // which stage the step belongs to is seen later
  looks due = {true, true, true};
  if (!enters)
    due = looks_after(this, sim->run.stage_step + tal_step_small_steps(sim, sim->run.stage_step));
  tal_sim_watch(sim, due.row || due.fields || due.checkpoint || asked_to_stop);
  tal_status status = tal_sim_step(sim, err);
  if (sim->run.stage != stage) { // the step belongs to the next stage
    this->stage_started = clock_now();
    this->stage_cpu_started = cpu_now();
  }
  if (status)
    return status;
  return observe(this, enters ? looks_after(this, sim->run.stage_step) : due, err);
}

static tal_status advance(job *this, tal_error *err) {
  while (!tal_sim_done(this->sim)) {
    if (asked_to_stop && this->sim->remembers)
      return TAL_INTERRUPTED;
    tal_status status = step(this, err);
    if (status)
      return status;
    if (this->sim->run.stage_done)
      account_stage(this, this->sim->run.stage);
    tal_progress_show(&this->progress, this->sim);
  }
  return TAL_OK;
}

// Steps until done, then says in run.json how it ended.
static tal_status run_job(job *this, tal_error *err) {
  tal_status status = advance(this, err), reported;
  if (status != TAL_OK)
    account_stage(this, this->sim->run.stage);
  switch (status) {
  case TAL_OK:
    return report_run(this, "done", "", err);
  case TAL_INTERRUPTED:
    if ((reported = write_checkpoint(this, err)))
      return reported;
    if ((reported = report_run(this, "interrupted", "", err)))
      return reported;
    return status;
  case TAL_INVALID:
    report_run(this, "invalid", err ? err->text : "", NULL);
    return status;
  default:
    return status;
  }
}

static tal_status open_output(job *this, const tal_run_options *options, bool *finished, tal_error *err) {
  *finished = false;
  if (options->resume)
    return tal_output_resume(&this->output, options->dir, this->scene, this->sim, finished, err);
  return tal_output_create(&this->output, options->dir, this->scene, err);
}

// Clocks and stage reports, continued where an earlier part of the run left them.
static void begin_accounts(job *this) {
  const tal_stage_report *before = tal_output_stages_before(this->output);
  this->stages = tal_alloc(this->scene->stage_count + 1, sizeof *this->stages);
  for (size_t s = 0; s < this->scene->stage_count; s++) {
    this->stages[s] = before[s];
    this->stages[s].kind = this->scene->stages[s].kind;
    this->wall_before += before[s].wall_time;
    this->cpu_before += before[s].cpu_time;
  }
  this->started = this->stage_started = clock_now();
  this->cpu_started = this->stage_cpu_started = cpu_now();
  this->first_step = this->sim->run.step;
}

static void fill_result(const job *this, tal_run_result *result) {
  int64_t steps = this->sim->run.step - this->first_step;
  result->row = this->row;
  result->wall_time = clock_now() - this->started;
  result->grain_steps_per_second = (double)steps * (double)this->sim->grains.count / result->wall_time;
  result->checkpoint = this->checkpoint;
}

static tal_status run_opened(job *this, const tal_run_options *options, tal_run_result *result, tal_error *err) {
  tal_status status = TAL_OK;
  begin_accounts(this);
  if (options->resume)
    status = inspect(this, err);
  else if ((status = write_row(this, true, err)) == TAL_OK)
    status = write_checkpoint(this, err);
  tal_progress_begin(&this->progress, this->sim, options->quiet);
  if (status == TAL_OK)
    status = run_job(this, err);
  tal_progress_end(&this->progress);
  fill_result(this, result);
  free(this->stages);
  return status;
}

// The run was killed between its last checkpoint and its last report.
static tal_status report_late(job *this, tal_error *err) {
  begin_accounts(this);
  tal_sim_row(this->sim, &this->row);
  tal_status status = report_run(this, "done", "", err);
  free(this->stages);
  return status;
}

// A thousand grains wait longer for a second thread than it saves. OMP_NUM_THREADS is the limit where it is set.
int tal_run_threads(size_t grains, int asked) {
  int useful = 1 + (int)(grains / 2000), there = omp_get_max_threads();
  int threads = asked > 0 ? asked : useful < there ? useful : there;
  omp_set_num_threads(threads);
  return threads;
}

tal_status tal_run_from(tal_sim *sim, const char *path, tal_error *err) {
  char inside[TAL_PATH_SIZE];
  tal_checkpoint_head head;
  tal_run_files files;
  tal_file_path(inside, path, "checkpoint.h5");
  const char *file = tal_file_exists(inside) ? inside : path;
  tal_status status = tal_checkpoint_peek(file, &head, err);
  if (status)
    return status;
  tal_run_files_clear(&head.files);
  tal_scene before = *sim->scene;
  before.stage_count = head.run.stage_begun ? (size_t)head.run.stage + 1 : 0;
  if (!head.complete)
    return tal_fail(err, TAL_BAD_INPUT, "%s: that run is not finished; accepted: a finished run", file);
  if (before.stage_count >= sim->scene->stage_count)
    return tal_fail(err, TAL_BAD_INPUT,
                    "%s: the scene has no stage beyond the %zu of that run; accepted: a further stage", file,
                    before.stage_count);
  char *text = tal_scene_text(&before);
  status = tal_checkpoint_read(file, sim, text, &files, err);
  free(text);
  if (status)
    return status;
  tal_run_files_clear(&files);
  tal_sim_restored(sim);
  return TAL_OK;
}

tal_status tal_run_scene(const tal_scene *scene, const tal_run_options *options, tal_run_result *result,
                         tal_error *err) {
  *result = (tal_run_result){0};
  job run = {.scene = scene, .checkpoint = options->resume, .looked = -1};
  tal_status status = tal_sim_create(&run.sim, scene, err);
  if (status == TAL_OK)
    status = tal_output_check_tracks(scene, run.sim->grains.count, err);
  if (status == TAL_OK && options->from && !options->resume)
    status = tal_run_from(run.sim, options->from, err);
  if (status == TAL_OK)
    run.cores = tal_run_threads(run.sim->grains.count, options->threads);
  if (status == TAL_OK) {
    catch_signals();
    status = open_output(&run, options, &result->already_done, err);
  }
  if (status == TAL_OK && !result->already_done)
    status = run_opened(&run, options, result, err);
  else if (status == TAL_OK && !tal_output_reported_done(run.output))
    status = report_late(&run, err);
  if (run.output)
    tal_output_close(run.output);
  tal_sim_free(run.sim);
  return status;
}
