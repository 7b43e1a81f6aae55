// What a run leaves on disk: tables, frames, index, report, lock, resume, verify; damage of each kind is found.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "json.h"
#include "output.h"
#include "progress.h"
#include "store.h"
#include "verify.h"
#include <hdf5.h>
#include <math.h>
#include <signal.h>

#include "small_run.h"

static void out_folder(char dir[TAL_PATH_SIZE], const small_run *run) {
  in_folder(dir, run, "deep/out");
}

static void in_out(char path[TAL_PATH_SIZE], const small_run *run, const char *name) {
  char dir[TAL_PATH_SIZE];
  out_folder(dir, run);
  tal_file_path(path, dir, name);
}

static tal_output *create(const small_run *run) {
  char dir[TAL_PATH_SIZE];
  tal_error err;
  tal_output *output;
  out_folder(dir, run);
  if (tal_output_create(&output, dir, &run->scene, &err) != TAL_OK)
    fail_msg("%s", err.text);
  return output;
}

static void write_instant(tal_output *output, tal_sim *sim) {
  tal_error err;
  tal_row row;
  tal_sim_row(sim, &row);
  if (tal_output_row(output, &row, &err) != TAL_OK)
    fail_msg("%s", err.text);
  if (tal_output_fields(output, sim, &err) != TAL_OK)
    fail_msg("%s", err.text);
  tal_sim_observe(sim);
  if (tal_output_tracks(output, sim, &err) != TAL_OK)
    fail_msg("%s", err.text);
}

static void write_checkpoint(tal_output *output, tal_sim *sim) {
  tal_error err;
  if (tal_output_checkpoint(output, sim, &err) != TAL_OK)
    fail_msg("%s", err.text);
}

static void step(tal_sim *sim, int steps) {
  tal_error err;
  for (int k = 0; k < steps; k++) {
    if (tal_sim_step(sim, &err) != TAL_OK)
      fail_msg("%s", err.text);
  }
}

// Rows and frames at steps 0, 5, 10, ..; a checkpoint at every second of them, the last instant without one.
static void write_run(small_run *run) {
  tal_output *output = create(run);
  for (int k = 0; k < 6; k++) {
    if (k > 0)
      step(run->sim, 5);
    write_instant(output, run->sim);
    if (k % 2 == 0)
      write_checkpoint(output, run->sim);
  }
  tal_output_close(output);
}

static tal_status resume(const small_run *run, tal_output **output, tal_sim *sim, tal_error *err) {
  char dir[TAL_PATH_SIZE];
  bool finished = true;
  out_folder(dir, run);
  tal_status status = tal_output_resume(output, dir, sim->scene, sim, &finished, err);
  assert_false(finished);
  return status;
}

static void count_findings(void *context, bool damage, const char *sentence) {
  (void)damage;
  char *all = context;
  strncat(all, sentence, 3000 - strlen(all));
  strncat(all, "\n", 3000 - strlen(all));
}

// Status of verify; findings[3001] gets its sentences.
static tal_status verify(const small_run *run, char *findings) {
  char dir[TAL_PATH_SIZE];
  tal_verify_counts counts;
  out_folder(dir, run);
  findings[0] = '\0';
  return tal_verify(dir, count_findings, findings, &counts, NULL);
}

// EXACT: the columns are the contract's, numbers read back to the same bits, nan is nan, a step is written once.
static void test_series(void **state) {
  (void)state;
  small_run run;
  tal_error err;
  small_run_begin(&run, 7);
  tal_output *output = create(&run);
  tal_row row;
  tal_sim_row(run.sim, &row);
  row.sigma_xx = 1.0 / 3.0;
  row.phi = -(double)NAN;
  row.step = 123456789012.0;
  assert_int_equal(tal_output_row(output, &row, &err), TAL_OK);
  assert_int_equal(tal_output_row(output, &row, &err), TAL_OK);
  tal_output_close(output);
  char path[TAL_PATH_SIZE];
  size_t size;
  in_out(path, &run, "series.csv");
  char *text = (char *)contents(path, &size), *line = strchr(text, '\n') + 1;
  assert_true(strncmp(text, "time[s],step,stage,axial_strain,volumetric_strain,sigma_xx[Pa],", 63) == 0);
  assert_ptr_equal(strchr(line, '\n') + 1, text + size);
  assert_true(holds(line, ",123456789012,") && holds(line, ",nan,") && !holds(line, "-nan"));
#define X(name, unit, meaning)                                                                                         \
  {                                                                                                                    \
    double value = strtod(line, &line);                                                                                \
    assert_true(isnan(row.name) ? isnan(value) : memcmp(&value, &row.name, sizeof value) == 0);                        \
    line++;                                                                                                            \
  }
  TAL_SERIES_FIELDS(X)
#undef X
  assert_ptr_equal(line, text + size);
  free(text);
  small_run_end(&run);
}

// EXACT: one line per tracked grain and time, with the observed resultant.
static void test_tracks(void **state) {
  (void)state;
  small_run run;
  small_run_begin(&run, 0);
  write_run(&run);
  char path[TAL_PATH_SIZE];
  size_t size;
  in_out(path, &run, "tracks.csv");
  char *text = (char *)contents(path, &size), *line = text;
  assert_true(
      strncmp(text, "time[s],id,x[m],y[m],theta[rad],vx[m/s],vy[m/s],omega[rad/s],fx[N],fy[N],torque[N m]\n", 80) == 0);
  for (int k = 0; k < 12; k++)
    line = strchr(line, '\n') + 1;
  const tal_grains *g = &run.sim->grains;
  const double expected[] = {run.sim->run.time, 7,           g->x[7],  g->y[7],  g->theta[7],  g->vx[7],
                             g->vy[7],          g->omega[7], g->rx[7], g->ry[7], g->rtorque[7]};
  for (int k = 0; k < 11; k++) {
    double value = strtod(line, &line);
    assert_memory_equal(&value, &expected[k], sizeof value);
    line++;
  }
  assert_ptr_equal(line, text + size);
  free(text);
  run.scene.output.tracks[1] = 12;
  tal_error err;
  assert_int_equal(tal_output_check_tracks(&run.scene, 13, &err), TAL_OK);
  assert_int_equal(tal_output_check_tracks(&run.scene, 12, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "output.tracks: there is no grain 12, ids go from 0 to 11"));
  small_run_end(&run);
}

// Outside answer: who may write where.
static void test_folder(void **state) {
  (void)state;
  small_run run;
  tal_error err;
  tal_output *first, *second;
  char dir[TAL_PATH_SIZE], below_file[TAL_PATH_SIZE];
  small_run_begin(&run, 0);
  out_folder(dir, &run);
  bool finished;
  assert_int_equal(tal_output_resume(&second, dir, &run.scene, run.sim, &finished, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "holds no run to resume"));
  assert_false(tal_file_exists(dir));
  first = create(&run);
  assert_int_equal(tal_output_create(&second, dir, &run.scene, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "a run is at work in"));
  assert_null(second);
  assert_int_equal(resume(&run, &second, run.sim, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "holds no checkpoint.h5"));
  write_checkpoint(first, run.sim);
  assert_int_equal(resume(&run, &second, run.sim, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "a run is at work in"));
  tal_output_close(first);
  assert_int_equal(tal_output_create(&second, dir, &run.scene, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "already holds a run") && holds(err.text, "--resume"));
  assert_int_equal(resume(&run, &second, run.sim, &err), TAL_OK);
  tal_output_close(second);
  in_folder(below_file, &run, "scene.yaml/out");
  assert_int_equal(tal_output_create(&second, below_file, &run.scene, &err), TAL_IO);
  assert_true(holds(err.text, "scene.yaml/out: cannot make the folder: Not a directory"));
  small_run_end(&run);
}

static void read_doubles(hid_t file, const char *name, double *out, const char *unit) {
  hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
  assert_true(set >= 0);
  assert_true(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, out) >= 0);
  hid_t attribute = H5Aopen(set, "unit", H5P_DEFAULT), type = H5Aget_type(attribute);
  char *value = NULL;
  assert_true(H5Aread(attribute, type, &value) >= 0);
  assert_string_equal(value, unit);
  H5free_memory(value);
  H5Tclose(type);
  H5Aclose(attribute);
  H5Dclose(set);
}

// EXACT: frames as plain HDF5, reached through the links of fields.h5.
static void test_fields(void **state) {
  (void)state;
  small_run run;
  small_run_begin(&run, 0);
  tal_output *output = create(&run);
  write_instant(output, run.sim);
  step(run.sim, 10);
  tal_row row;
  tal_sim_row(run.sim, &row);
  assert_int_equal(tal_output_fields(output, run.sim, NULL), TAL_OK);
  tal_output_close(output);
  char path[TAL_PATH_SIZE];
  double value[64], pressure[64];
  in_out(path, &run, "fields.h5");
  hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  assert_true(file >= 0);
  read_doubles(file, "/frames/000001/grains/y", value, "m");
  assert_memory_equal(value, run.sim->grains.y, 12 * sizeof *value);
  read_doubles(file, "/frames/000001/grains/torque", value, "N m");
  assert_memory_equal(value, run.sim->grains.rtorque, 12 * sizeof *value);
  tal_cells cells;
  tal_cells_init(&cells);
  tal_observed seen = tal_sim_driving(run.sim);
  tal_cells_measure(&seen, &cells);
  assert_true(cells.count > 8 && cells.count < 16);
  read_doubles(file, "/frames/000001/cells/stress", value, "Pa");
  read_doubles(file, "/frames/000001/cells/pressure", pressure, "Pa");
  for (size_t k = 0; k < cells.count; k++) {
    assert_true(value[4 * k + 1] == cells.stress_xy[k] && value[4 * k + 2] == cells.stress_yx[k]);
    assert_true(pressure[k] == cells.pressure[k]);
  }
  read_doubles(file, "/frames/000001/cells/L", value, "1/s");
  for (size_t k = 0; k < cells.count; k++)
    assert_true(value[4 * k + 1] == cells.Lxy[k]);
  tal_cells_clear(&cells);
  hid_t frame = H5Gopen2(file, "/frames/000001", H5P_DEFAULT), time = H5Aopen(frame, "time", H5P_DEFAULT);
  assert_true(H5Aread(time, H5T_NATIVE_DOUBLE, value) >= 0 && fabs(value[0] - 10e-5) < 1e-15);
  H5Aclose(time);
  H5Gclose(frame);
  H5Fclose(file);
  small_run_end(&run);
}

// Touching pairs only, forces balance: the sum over a grain's contacts is its resultant (ROUND, 100 eps of the
// largest).
static void test_contacts_balance(void **state) {
  (void)state;
  small_run run;
  small_run_begin(&run, 0);
  write_run(&run);
  char path[TAL_PATH_SIZE];
  tal_store store;
  in_out(path, &run, "fields/000005.h5");
  assert_int_equal(tal_store_open(&store, path, NULL), TAL_OK);
  double fx[12] = {0}, wanted[12], largest = 0;
  static const char *const groups[] = {"contacts", "wall_contacts"};
  for (int which = 0; which < 2; which++) {
    tal_store_group(&store, groups[which]);
    size_t n = tal_store_rows(&store, "i");
    assert_true(n > 0 && n <= 64);
    int32_t i[64], j[64];
    double fn[64], ft[64], nx[64], ny[64], overlap[64];
    tal_store_get(&store, TAL_ARRAY("i", NULL, &i[0], n));
    tal_store_get(&store, TAL_ARRAY("j", NULL, &j[0], n));
    tal_store_get(&store, TAL_ARRAY("fn", NULL, &fn[0], n));
    tal_store_get(&store, TAL_ARRAY("ft", NULL, &ft[0], n));
    tal_store_get(&store, TAL_ARRAY("nx", NULL, &nx[0], n));
    tal_store_get(&store, TAL_ARRAY("ny", NULL, &ny[0], n));
    tal_store_get(&store, TAL_ARRAY("overlap", NULL, &overlap[0], n));
    for (size_t c = 0; c < n; c++) {
      assert_true(overlap[c] > 0 && fn[c] >= 0);
      double force = fn[c] * nx[c] - ft[c] * ny[c];
      fx[i[c]] += force;
      if (which == 0)
        fx[j[c]] -= force;
      largest = fmax(largest, fabs(force));
    }
  }
  tal_store_group(&store, "grains");
  tal_store_get(&store, TAL_ARRAY("fx", NULL, &wanted[0], 12));
  assert_int_equal(tal_store_status(&store, NULL), TAL_OK);
  tal_store_close(&store);
  for (int k = 0; k < 12; k++)
    assert_true(fabs(fx[k] - wanted[k]) < 100 * 2.3e-16 * largest);
  small_run_end(&run);
}

// Product of the numbers in Dimensions="...".
static long long elements(const char *item) {
  long long product = 1;
  char *at = strstr(item, "Dimensions=\"");
  assert_non_null(at);
  for (at += 12; *at != '"';)
    product *= strtoll(at, &at, 10);
  return product;
}

// Outside answer: the XML is well-formed (where a reader is installed), each reference is there with the size told.
static void test_xdmf(void **state) {
  (void)state;
  small_run run;
  small_run_begin(&run, 0);
  write_run(&run);
  char path[TAL_PATH_SIZE], command[TAL_PATH_SIZE + 100], *at;
  size_t size, references = 0, times = 0;
  in_out(path, &run, "fields.xdmf");
  snprintf(command, sizeof command, "! command -v xmllint >/dev/null || xmllint --noout %s", path);
  assert_int_equal(system(command), 0);
  char *text = (char *)contents(path, &size);
  for (at = text; (at = strstr(at, "<Time Value=")); at++)
    times++;
  assert_int_equal(times, 6);
  for (at = text; (at = strstr(at, "<DataItem")); references++) {
    char file[32], name[64], full[TAL_PATH_SIZE];
    long long expected = elements(at);
    at = strchr(at, '>');
    assert_int_equal(sscanf(at, ">%31[^:<]:%63[^<]", file, name), 2);
    in_out(full, &run, file);
    hid_t frame = H5Fopen(full, H5F_ACC_RDONLY, H5P_DEFAULT), set = H5Dopen2(frame, name, H5P_DEFAULT);
    hid_t space = H5Dget_space(set);
    assert_int_equal(H5Sget_simple_extent_npoints(space), expected);
    H5Sclose(space);
    H5Dclose(set);
    H5Fclose(frame);
  }
  assert_int_equal(references, 6 * 21);
  free(text);
  small_run_end(&run);
}

// EXACT: resumed at step 20 of 25 and gone on, every file is byte for byte that of the run that never stopped.
static void test_resume_equals_unbroken(void **state) {
  (void)state;
  static const char *const names[] = {"series.csv", "tracks.csv",  "fields/000005.h5", "fields/000006.h5",
                                      "fields.h5",  "fields.xdmf", "checkpoint.h5",    "checkpoint.prev.h5"};
  small_run broken, whole;
  tal_error err;
  tal_output *output;
  small_run_begin(&whole, 0);
  small_run_begin(&broken, 0);
  write_run(&broken);
  char path[TAL_PATH_SIZE], later[TAL_PATH_SIZE];
  in_out(path, &broken, "fields/000099.h5.tmp");
  in_out(later, &broken, "fields/000005.h5");
  overwrite(path, "rubbish", 7);
  tal_sim *again = make_sim(&broken.scene, 0);
  if (resume(&broken, &output, again, &err) != TAL_OK)
    fail_msg("%s", err.text);
  assert_int_equal(again->run.step, 20);
  assert_false(tal_file_exists(path));
  assert_false(tal_file_exists(later));
  write_instant(output, again); // of step 20: written already
  for (int k = 5; k < 7; k++) {
    step(again, 5);
    write_instant(output, again);
  }
  write_checkpoint(output, again);
  tal_output_close(output);
  tal_sim_free(again);
  output = create(&whole);
  for (int k = 0; k < 7; k++) {
    if (k > 0)
      step(whole.sim, 5);
    write_instant(output, whole.sim);
    if (k % 2 == 0)
      write_checkpoint(output, whole.sim);
  }
  tal_output_close(output);
  for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
    in_out(path, &broken, names[k]);
    in_out(later, &whole, names[k]);
    assert_same_files(path, later);
  }
  small_run_end(&whole);
  small_run_end(&broken);
}

// Over the contents of all files below the folder of the run, in the order of their names.
static uint64_t folder_hash(const small_run *run) {
  char command[TAL_PATH_SIZE + 100], text[64] = "";
  snprintf(command, sizeof command, "cd %s/deep/out && find . -type f | sort | xargs cat | cksum", run->folder);
  FILE *pipe = popen(command, "r");
  assert_non_null(pipe);
  assert_non_null(fgets(text, sizeof text, pipe));
  pclose(pipe);
  return tal_hash(text, strlen(text));
}

static void assert_refused(const small_run *run, tal_sim *sim, const char *why) {
  tal_error err = {""};
  tal_output *output;
  uint64_t before = folder_hash(run);
  assert_int_equal(resume(run, &output, sim, &err), TAL_BAD_INPUT);
  if (!holds(err.text, why))
    fail_msg("%s", err.text);
  assert_null(output);
  assert_true(folder_hash(run) == before);
}

// Outside answer: what cannot be resumed is refused with the reason, and nothing in the folder changes.
static void test_resume_refuses(void **state) {
  (void)state;
  small_run run;
  small_run_begin(&run, 0);
  write_run(&run);
  tal_sim *again = make_sim(&run.scene, 0);
  char checkpoint[TAL_PATH_SIZE], previous[TAL_PATH_SIZE], path[TAL_PATH_SIZE], aside[TAL_PATH_SIZE];
  in_out(checkpoint, &run, "checkpoint.h5");
  in_out(previous, &run, "checkpoint.prev.h5");
  flip_bit(checkpoint, 5000, 2);
  assert_refused(&run, again, "checkpoint.prev.h5 is intact: move it to checkpoint.h5");
  flip_bit(previous, 5000, 2);
  assert_refused(&run, again, "checkpoint.h5 is damaged");
  assert_refused(&run, again, "there is no intact checkpoint.prev.h5");
  flip_bit(previous, 5000, 2);
  flip_bit(checkpoint, 5000, 2);
  in_out(path, &run, "fields/000003.h5");
  in_folder(aside, &run, "aside");
  assert_int_equal(rename(path, aside), 0);
  assert_refused(&run, again, "fields/000003.h5 is missing");
  assert_int_equal(rename(aside, path), 0);
  in_out(path, &run, "series.csv");
  assert_int_equal(truncate(path, 2500), 0);
  assert_refused(&run, again, "series.csv is damaged: it has 2500 bytes");
  tal_sim_free(again);
  tal_scene other;
  load_scene(&other, run.folder, "0.25");
  again = make_sim(&other, 0);
  assert_refused(&run, again, "belongs to another scene: line");
  assert_refused(&run, again, "friction: 0.5");
  tal_sim_free(again);
  tal_scene_clear(&other);
  small_run_end(&run);
}

// EXACT: killed between the two renames, the one before serves.
static void test_resume_from_previous(void **state) {
  (void)state;
  small_run run;
  tal_error err;
  tal_output *output;
  small_run_begin(&run, 0);
  write_run(&run);
  tal_sim *again = make_sim(&run.scene, 0);
  char path[TAL_PATH_SIZE];
  in_out(path, &run, "checkpoint.h5");
  assert_int_equal(remove(path), 0);
  if (resume(&run, &output, again, &err) != TAL_OK)
    fail_msg("%s", err.text);
  assert_int_equal(again->run.step, 10);
  tal_output_close(output);
  tal_sim_free(again);
  small_run_end(&run);
}

// Outside answer: a run whose stages are all done has nothing to resume, and its folder stays as it is.
static void test_resume_finished(void **state) {
  (void)state;
  small_run run;
  tal_error err;
  tal_output *output;
  bool finished = false;
  char dir[TAL_PATH_SIZE];
  small_run_begin(&run, 0);
  output = create(&run);
  while (!tal_sim_done(run.sim))
    step(run.sim, 1);
  write_instant(output, run.sim);
  write_checkpoint(output, run.sim);
  tal_output_close(output);
  uint64_t before = folder_hash(&run);
  out_folder(dir, &run);
  assert_int_equal(tal_output_resume(&output, dir, &run.scene, run.sim, &finished, &err), TAL_OK);
  assert_true(finished);
  assert_true(folder_hash(&run) == before);
  tal_output_close(output);
  small_run_end(&run);
}

// The report reads back; the scene stands there as JSON and as its text; a strict reader takes it where one is
// installed.
static void test_report(void **state) {
  (void)state;
  small_run run;
  tal_error err;
  small_run_begin(&run, 0);
  tal_output *output = create(&run);
  write_checkpoint(output, run.sim);
  assert_true(tal_output_stages_before(output)[1].wall_time == 0);
  const tal_stage_report stages[2] = {{"free", 1000, 1.5, 1e6, 1.25}, {"free", 17, 0.25, (double)NAN, 0.5}};
  const char *const warnings[] = {"a \"quoted\" \\ line\nand \x01 \xff more"};
  const tal_run_report report = {.status = "interrupted",
                                 .reason = "",
                                 .cores = 2,
                                 .wall_time = 1.75,
                                 .stages = stages,
                                 .stage_count = 2,
                                 .warnings = warnings,
                                 .warning_count = 1,
                                 .energy_residual = (double)NAN};
  assert_int_equal(tal_output_report(output, run.sim, &report, &err), TAL_OK);
  tal_output_close(output);
  if (resume(&run, &output, run.sim, &err) != TAL_OK)
    fail_msg("%s", err.text);
  assert_int_equal(tal_output_stages_before(output)[1].steps, 17);
  assert_true(tal_output_stages_before(output)[0].wall_time == 1.5);
  assert_true(tal_output_stages_before(output)[0].cpu_time == 1.25);
  tal_output_close(output);
  char path[TAL_PATH_SIZE], command[TAL_PATH_SIZE + 200];
  size_t size;
  in_out(path, &run, "run.json");
  char *text = (char *)contents(path, &size);
  assert_true(holds(text, "\"status\": \"interrupted\"") && holds(text, "\"energy_residual\": null"));
  assert_true(holds(text, "\"a \\\"quoted\\\" \\\\ line\\nand \\u0001 \\ufffd more\""));
  assert_true(holds(text, "\"friction\": 0.5") && holds(text, "\"scene_text\": \"name: "));
  snprintf(command, sizeof command, "! command -v python3 >/dev/null || python3 -m json.tool %s >/dev/null", path);
  assert_int_equal(system(command), 0);
  free(text);
  small_run_end(&run);
}

// Outside answer: a full disk at a row gives TAL_IO and no torn line.
static void test_full_disk(void **state) {
  (void)state;
  small_run run;
  small_run_begin(&run, 0);
  char path[TAL_PATH_SIZE];
  in_out(path, &run, "series.csv");
  pid_t child = fork();
  assert_true(child >= 0);
  if (child == 0) {
    tal_error err = {""};
    tal_row row;
    tal_output *output = create(&run);
    tal_sim_row(run.sim, &row);
    limit_files(4000);
    tal_status status = TAL_OK;
    for (int k = 0; k < 100 && status == TAL_OK; k++, row.step++)
      status = tal_output_row(output, &row, &err);
    _exit(status == TAL_IO && holds(err.text, "series.csv: writing failed: File too large") ? 0 : 1);
  }
  assert_int_equal(wait_for(child), 0);
  size_t size;
  char *text = (char *)contents(path, &size);
  assert_true(size > 2000 && size <= 4000 && text[size - 1] == '\n');
  free(text);
  small_run_end(&run);
}

typedef struct damage {
  const char *file;
  int kind; // 'f'lip a bit, 'c'ut half, 'r'emove, 't'ear the last line, 'd'ouble the last line
  const char *finding;
} damage;

static void do_damage(const char *path, int kind) {
  size_t size;
  char *text = (char *)contents(path, &size);
  if (kind == 'f')
    flip_bit(path, size / 2, 3);
  if (kind == 'c')
    overwrite(path, text, size / 2);
  if (kind == 'r')
    assert_int_equal(remove(path), 0);
  if (kind == 't')
    overwrite(path, text, size - 20);
  if (kind == 'd') {
    char *last = text + size - 2;
    while (last[-1] != '\n')
      last--;
    FILE *file = fopen(path, "a");
    fputs(last, file);
    fclose(file);
  }
  free(text);
}

// Outside answer: verify finds each damage, names the file, and finds nothing in the run left alone.
static void test_verify(void **state) {
  (void)state;
  static const damage damages[] = {
      {"checkpoint.h5", 'f', "checkpoint.h5 is damaged"},
      {"checkpoint.prev.h5", 'c', "checkpoint.prev.h5 is damaged"},
      {"fields/000002.h5", 'f', "fields/000002.h5 is damaged"},
      {"fields/000005.h5", 'c', "fields/000005.h5 is damaged"},
      {"fields/000002.h5", 'r', "fields/000002.h5 is missing, 3 later frames"},
      {"fields/000005.h5", 'r', "fields.h5 links to fields/000005.h5, which is missing"},
      {"fields.h5", 'f', "fields.h5 is damaged"},
      {"fields.h5", 'r', "fields.h5 is missing"},
      {"fields.xdmf", 'r', "fields.xdmf is missing"},
      {"series.csv", 't', "series.csv:7: the last line is torn; --resume mends it"},
      {"series.csv", 'd', "series.csv:8: time"},
      {"series.csv", 'c', "checkpoint.h5 was written with"},
      {"series.csv", 'r', "series.csv: cannot be read"},
      {"tracks.csv", 't', "tracks.csv:13: the last line is torn; --resume mends it"},
      {"tracks.csv", 'c', "tracks.csv has"},
  };
  small_run run;
  small_run_begin(&run, 0);
  write_run(&run);
  char findings[3001], path[TAL_PATH_SIZE];
  assert_int_equal(verify(&run, findings), TAL_OK);
  for (size_t k = 0; k < sizeof damages / sizeof *damages; k++) {
    size_t size;
    in_out(path, &run, damages[k].file);
    unsigned char *good = contents(path, &size);
    do_damage(path, damages[k].kind);
    // What a kill leaves behind the checkpoint is none.
    assert_int_equal(verify(&run, findings), holds(damages[k].finding, "resume mends") ? TAL_OK : TAL_IO);
    if (!holds(findings, damages[k].finding))
      fail_msg("%s: %s", damages[k].finding, findings);
    overwrite(path, good, size);
    free(good);
    assert_int_equal(verify(&run, findings), TAL_OK);
  }
  tal_verify_counts counts;
  tal_error err;
  assert_int_equal(tal_verify("/", NULL, NULL, &counts, &err), TAL_BAD_INPUT);
  assert_true(holds(err.text, "holds no run"));
  small_run_end(&run);
}

// Outside answer: half of the second stage is left, 5,000 steps in 5 s make 1,000 steps a second.
static void test_progress(void **state) {
  (void)state;
  small_run run;
  char text[160];
  small_run_begin(&run, 0);
  run.sim->run.time = 5e-3;
  tal_progress_line(run.sim, 5000, 5, text, sizeof text);
  assert_string_equal(text, "[##########..........] 1/2 free  1000 steps/s  0:01 left");
  tal_progress_line(run.sim, 0, 0, text, sizeof text);
  assert_true(holds(text, "0 steps/s  --:-- left"));
  run.scene.stages[0].duration = run.scene.stages[1].duration = (double)NAN;
  run.scene.stages[0].rate = 1;
  run.scene.stages[0].strain = 0.02;
  run.sim->run.axial_strain = 0.005;
  tal_progress_line(run.sim, 1, 2, text, sizeof text);
  assert_true(holds(text, "[#####...............] 1/2 free  strain 0.0050  0 steps/s  >"));
  assert_true(strlen(text) < 80);
  small_run_end(&run);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_series),
      cmocka_unit_test(test_tracks),
      cmocka_unit_test(test_folder),
      cmocka_unit_test(test_fields),
      cmocka_unit_test(test_contacts_balance),
      cmocka_unit_test(test_xdmf),
      cmocka_unit_test(test_resume_equals_unbroken),
      cmocka_unit_test(test_resume_refuses),
      cmocka_unit_test(test_resume_from_previous),
      cmocka_unit_test(test_resume_finished),
      cmocka_unit_test(test_report),
      cmocka_unit_test(test_full_disk),
      cmocka_unit_test(test_verify),
      cmocka_unit_test(test_progress),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
