// `talus measure` from outside: what it writes for a small run, for grains without contacts and for one grain; what it
// refuses.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "program.h"
#include <dirent.h>

static const char lattice[] = "name: lattice\n"
                              "grains: {radius: {law: uniform, min: 1e-3, max: 1e-3}, thickness: 2e-3}\n"
                              "material: {young: 1e7, poisson: 0.3, density: 2000, friction: 0.5, damping: 1e-4}\n"
                              "pack: {method: lattice, pattern: %s, columns: %d, rows: %d, gap: %s}\n"
                              "integrator: {scheme: verlet, dt: 1e-6}\n"
                              "contact: {vR: 1e-5}\nstages: []\n";

static void run_lattice(program *p, const char *out, const char *pattern, int columns, int rows, const char *gap) {
  char text[1000];
  outcome got;
  snprintf(text, sizeof text, lattice, pattern, columns, rows, gap);
  program_write(p, "s.yaml", text);
  program_run(p, WORDS("run", "s.yaml", "-o", out, "-q", "--no-figures"), &got);
  if (got.code)
    fail_msg("%s", got.err);
}

// Compressed fast, a small sample with everything in it: frames of stage 1 at several strains.
static void run_biaxial(program *p) {
  outcome got;
  program_write(p, "s.yaml",
                "name: small\n"
                "seed: 3\n"
                "grains: {count: 120, radius: {law: uniform, min: 0.5e-3, max: 1e-3}}\n"
                "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\n"
                "mass_scaling: 1e5\n"
                "pack: {method: drop_and_roll, width: 12e-3}\n"
                "continuum: {refresh: {strain: 1e-4}}\n"
                "integrator: {scheme: implicit_friction, dt: 2e-4, sweeps: 1}\n"
                "stages:\n"
                "  - {kind: confine, pressure: 100e3, ramp: 0.5, friction: 0.1, tolerance: 0.2, unbalanced: 0.05}\n"
                "  - {kind: compress, boundary: pressure, rate: 0.05, strain: 0.05}\n"
                "output: {series_every: 0.02, fields_every: 0.2}\n");
  program_run(p, WORDS("run", "s.yaml", "-o", "out", "-q", "--no-figures"), &got);
  if (got.code)
    fail_msg("%s", got.err);
}

// Number in column `name` of row `row` (from 0) of a table, counting rows whose line contains `with`.
static double cell_of(program *p, const char *file, const char *name, size_t row, const char *with) {
  size_t size = 0;
  char *text = program_read(p, file, &size);
  assert_non_null(text);
  char *rest = text, *header = strsep(&rest, "\n"), *line;
  size_t column = 0;
  for (char *title; (title = strsep(&header, ",")) && strcmp(title, name) != 0;)
    column++;
  while ((line = strsep(&rest, "\n")) && (!strstr(line, with) || row-- > 0))
    ;
  if (!line || !*line)
    fail_msg("%s: no row with '%s'", file, with);
  for (size_t k = 0; k < column; k++)
    strsep(&line, ",");
  assert_non_null(line);
  const double value = strtod(line, NULL);
  free(text);
  return value;
}

// Every table of the folder: rows as long as the header, nothing that is no number.
static void assert_sound_tables(program *p, const char *folder) {
  FTS *walk = walk_begin(program_path(p, folder));
  size_t tables = 0;
  for (FTSENT *entry; (entry = fts_read(walk));) {
    char name[200];
    size_t size, columns = 1;
    if (entry->fts_info != FTS_F || !strstr(entry->fts_name, ".csv"))
      continue;
    snprintf(name, sizeof name, "%.60s/%.100s", folder, entry->fts_name);
    char *text = program_read(p, name, &size), *rest = text, *line = strsep(&rest, "\n");
    tables++;
    for (const char *c = line; *c; c++)
      columns += *c == ',';
    while ((line = strsep(&rest, "\n")) && *line) {
      size_t found = 1;
      for (const char *c = line; *c; c++)
        found += *c == ',';
      if (found != columns || strstr(line, "nan") || strstr(line, "inf"))
        fail_msg("%s: %s", name, line);
    }
    free(text);
  }
  fts_close(walk);
  assert_true(tables >= 3);
}

static void measure(program *p, const char *const *words) {
  outcome got;
  program_run(p, words, &got);
  if (got.code)
    fail_msg("exit %d: %s", got.code, got.err);
}

static void assert_near(double value, double wanted, double tolerance) {
  if (!(value >= wanted - tolerance && value <= wanted + tolerance))
    fail_msg("%.17g is not %.17g within %g", value, wanted, tolerance);
}

// ROUND: stress, coordination and solid fraction of the last frame are those of series.csv, to the digits of the table.
static void test_agrees_with_the_series(void **state) {
  program *p = *state;
  run_biaxial(p);
  measure(p, WORDS("measure", "out", "--no-figures", "--over", "0.01"));
  assert_sound_tables(p, "out/measure");
  size_t size, rows = 0;
  char *text = program_read(p, "out/series.csv", &size);
  for (size_t k = 0; k < size; k++)
    rows += text[k] == '\n';
  free(text);
  const char *const same[][2] = {{"stress_xx[Pa]", "sigma_xx[Pa]"},
                                 {"stress_xy[Pa]", "sigma_xy[Pa]"},
                                 {"stress_yy[Pa]", "sigma_yy[Pa]"},
                                 {"contact_xx", "fabric_xx"},
                                 {"contact_xy", "fabric_xy"}},
                    *const counted[] = {"coordination", "coordination_bearing", "solid_fraction"};
  size_t frames = 0;
  text = program_read(p, "out/measure/tensors.csv", &size);
  for (const char *at = text; (at = strstr(at, ",all,")); at++)
    frames++;
  free(text);
  const double scale = cell_of(p, "out/series.csv", "sigma_yy[Pa]", rows - 2, "");
  for (size_t k = 0; k < sizeof same / sizeof *same; k++) {
    const double mine = cell_of(p, "out/measure/tensors.csv", same[k][0], frames - 1, ",all,"),
                 series = cell_of(p, "out/series.csv", same[k][1], rows - 2, "");
    assert_near(mine, series, 1e-10 * (k < 3 ? scale : 1));
  }
  for (size_t k = 0; k < sizeof counted / sizeof *counted; k++)
    assert_near(cell_of(p, "out/measure/voids.csv", counted[k], frames - 1, ""),
                cell_of(p, "out/series.csv", counted[k], rows - 2, ""), 1e-11);
}

// EXACT: tables are the same to the byte with one thread and with two, and whichever frames get lists.
static void test_threads(void **state) {
  program *p = *state;
  run_biaxial(p);
  setenv("OMP_NUM_THREADS", "1", 1);
  measure(p, WORDS("measure", "out", "--no-figures", "--over", "0.01", "-o", "one"));
  setenv("OMP_NUM_THREADS", "2", 1);
  measure(p, WORDS("measure", "out", "--no-figures", "--over", "0.01", "-o", "two"));
  measure(p, WORDS("measure", "out", "--no-figures", "--over", "0.01", "--at", "all", "-o", "lists"));
  unsetenv("OMP_NUM_THREADS");
  static const char *const tables[] = {"bands.csv",  "buckling.csv",    "chain_lives.csv", "chains.csv",
                                       "forces.csv", "persistence.csv", "tensors.csv",     "voids.csv"};
  for (size_t k = 0; k < sizeof tables / sizeof *tables; k++) {
    uint64_t hash[3];
    const char *const folders[3] = {"one", "two", "lists"};
    for (int f = 0; f < 3; f++) {
      char name[80];
      snprintf(name, sizeof name, "%s/%s", folders[f], tables[k]);
      hash[f] = content_hash(program_path(p, name));
    }
    assert_true(hash[0] != 0 && hash[0] == hash[1]);
    if (k > 0) // bands.csv has a row per frame of --at
      assert_true(hash[0] == hash[2]);
  }
}

// Whether a name in the folder contains `text`.
static bool folder_has(program *p, const char *folder, const char *text) {
  DIR *list = opendir(program_path(p, folder));
  bool found = false;
  for (struct dirent *entry; list && (entry = readdir(list));)
    found |= strstr(entry->d_name, text) != NULL;
  if (list)
    closedir(list);
  return found;
}

// EXACT: Ctrl-C while a figure is drawn ends with 75 and leaves nothing half done; a frame that is damaged further on
// leaves no tables.
static void test_leaves_nothing(void **state) {
  program *p = *state;
  outcome got;
  run_biaxial(p);
  process child = program_start(p, WORDS("measure", "out", "--at", "all", "-o", "stopped"), NULL);
  while (!folder_has(p, "stopped", ".plot-") && kill(child.id, 0) == 0)
    usleep(1000);
  kill(child.id, SIGINT);
  process_wait(&child, &got);
  assert_int_equal(got.code, 75);
  assert_non_null(strstr(got.err, "stopped after "));
  assert_false(folder_has(p, "stopped", ".plot-") || folder_has(p, "stopped", ".tmp") ||
               folder_has(p, "stopped", ".csv"));
  FILE *file = fopen(program_path(p, "out/fields/000002.h5"), "r+");
  assert_non_null(file);
  fseek(file, 5000, SEEK_SET);
  const int byte = getc(file);
  fseek(file, 5000, SEEK_SET);
  putc(byte ^ 1, file);
  fclose(file);
  program_run(p, WORDS("measure", "out", "--no-figures", "-o", "damaged"), &got);
  assert_int_equal(got.code, 2);
  assert_non_null(strstr(got.err, "000002.h5"));
  assert_false(folder_has(p, "damaged", ".csv"));
}

// EXACT: a lattice that does not touch, and one grain: all tables are there, nothing in them is no number.
static void test_no_contacts(void **state) {
  program *p = *state;
  outcome got;
  run_lattice(p, "out", "square", 4, 3, "1e-4");
  program_run(p, WORDS("measure", "out"), &got);
  assert_int_equal(got.code, 0);
  assert_non_null(strstr(got.err, "0 contacts"));
  assert_sound_tables(p, "out/measure");
  assert_near(cell_of(p, "out/measure/tensors.csv", "contacts", 0, ",all,"), 0, 0);
  run_lattice(p, "single", "square", 1, 1, "0");
  measure(p, WORDS("measure", "single", "-o", "one"));
  assert_sound_tables(p, "one");
}

// EXACT: a region without a grain, and one around a single grain.
static void test_empty_regions(void **state) {
  program *p = *state;
  outcome got;
  run_lattice(p, "out", "triangular", 6, 6, "-1e-6");
  program_run(p, WORDS("measure", "out", "--region", "disc:5,5,1e-3", "-o", "far"), &got);
  assert_int_equal(got.code, 0);
  assert_non_null(strstr(got.err, "0 grains"));
  assert_sound_tables(p, "far");
  measure(p, WORDS("measure", "out", "--region", "disc:1e-3,1e-3,1e-4", "-o", "near"));
  assert_sound_tables(p, "near");
}

// EXACT: each bad input is exit 2 and one line; nothing is written.
static void test_refusals(void **state) {
  program *p = *state;
  run_lattice(p, "out", "square", 3, 3, "-1e-6");
  const struct {
    const char *words[6], *message;
  } bad[] = {
      {{"measure", "nowhere"}, "nowhere holds no field frames"},
      {{"measure", "out", "--at", "0.5"}, "--at: there is no frame near 0.5"},
      {{"measure", "out", "--at", "often"}, "--at: 'often' is no instant"},
      {{"measure", "out", "--at", "frame=7"}, "--at: there is no frame '7'"},
      {{"measure", "out", "--at", "peak"}, "has no compression yet"},
      {{"measure", "out", "--window", "0.1"}, "--window: '0.1' is no range"},
      {{"measure", "out", "--window", "0.1:0.2"}, "--window: no frame lies in 0.1:0.2"},
      {{"measure", "out", "--region", "1:2"}, "--region: '1:2' is no region"},
      {{"measure", "out", "--angle", "95"}, "--angle: '95' is out of range"},
      {{"measure", "out", "--over", "-1"}, "--over: '-1' is out of range"},
      {{"measure", "out", "--export", "contact"}, "accepted: cells, contacts, grains, loop"},
      {{"measure", "out", "--export", "grains/z"}, "--export: there is no field 'grains/z'; accepted: fx, fy, id,"},
      {{"measure", "out", "--threads", "2"}, "--threads: is not an option here"},
  };
  for (size_t k = 0; k < sizeof bad / sizeof *bad; k++)
    assert_refused(p, bad[k].words[3] ? bad[k].words[3] : "", bad[k].words, 2, bad[k].message);
}

// EXACT: exported numbers read back to the bits of the lattice; a group is one row per member, tables column by column.
static void test_export(void **state) {
  program *p = *state;
  run_lattice(p, "out", "square", 3, 3, "-1e-6");
  measure(p, WORDS("measure", "out", "--export", "grains/x", "--export", "cells", "--at", "all", "--no-figures"));
  size_t size;
  char *text = program_read(p, "out/measure/grains-x-000000.csv", &size);
  assert_non_null(text);
  assert_int_equal(strncmp(text, "x[m]\n", 5), 0);
  assert_int_equal(count_lines(text), 10);
  free(text);
  text = program_read(p, "out/measure/cells-000000.csv", &size);
  assert_int_equal(count_lines(text), 1 + 8);
  assert_non_null(strstr(text, "L_xx[1/s],L_xy[1/s],L_yx[1/s],L_yy[1/s]"));
  assert_non_null(strstr(text, "strain_xx,strain_xy,strain_yy"));
  assert_non_null(strstr(text, "corner_0,corner_1,corner_2"));
  free(text);
  assert_near(cell_of(p, "out/measure/cells-000000.csv", "area[m^2]", 0, ","), 0.5 * 1.999e-3 * 1.999e-3, 1e-15);
}

// EXACT: a flipped byte in a frame is found before anything is written.
static void test_damaged_frame(void **state) {
  program *p = *state;
  outcome got;
  run_lattice(p, "out", "square", 3, 3, "-1e-6");
  FILE *file = fopen(program_path(p, "out/fields/000000.h5"), "r+");
  assert_non_null(file);
  fseek(file, 5000, SEEK_SET);
  const int byte = getc(file);
  fseek(file, 5000, SEEK_SET);
  putc(byte ^ 1, file);
  fclose(file);
  program_run(p, WORDS("measure", "out"), &got);
  assert_int_equal(got.code, 2);
  assert_non_null(strstr(got.err, "000000.h5"));
  assert_int_equal(access(program_path(p, "out/measure/tensors.csv"), F_OK), -1);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      program_test(test_agrees_with_the_series),
      program_test(test_threads),
      program_test(test_leaves_nothing),
      program_test(test_no_contacts),
      program_test(test_empty_regions),
      program_test(test_refusals),
      program_test(test_export),
      program_test(test_damaged_frame),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
