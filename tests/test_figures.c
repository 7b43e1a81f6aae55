// Figures: reading a run's files, text that enters gnuplot, the affine part of displacements, and whole drawings of
// small made-up runs. What a picture looks like is judged by eye; here its size, its name and its being whole count.
#include <stdarg.h>
#include <stddef.h>

#include <setjmp.h>

#include <stdint.h>

#include <cmocka.h>

#include "figures.h"
#include "figures_canvas.h"
#include <dirent.h>
#include <hdf5.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

// ---- a folder per test ----

static void remove_tree(const char *path) {
  DIR *list = opendir(path);
  for (struct dirent *entry; list && (entry = readdir(list));) {
    if (!strcmp(entry->d_name, ".") || !strcmp(entry->d_name, ".."))
      continue;
    char *inner = tal_path_join(path, entry->d_name);
    if (unlink(inner))
      remove_tree(inner);
    free(inner);
  }
  if (list)
    closedir(list);
  rmdir(path);
}

static int make_folder(void **state) {
  const char *base = getenv("TMPDIR");
  char *path = tal_path_join(base ? base : "/tmp", "talus-figures-XXXXXX");
  *state = mkdtemp(path);
  return *state ? 0 : -1;
}

static int drop_folder(void **state) {
  remove_tree(*state);
  free(*state);
  return 0;
}

static void write_text(const char *dir, const char *name, const char *text) {
  char *path = tal_path_join(dir, name);
  FILE *file = fopen(path, "w");
  assert_non_null(file);
  fputs(text, file);
  assert_int_equal(fclose(file), 0);
  free(path);
}

static size_t count_entries(const char *dir, const char *name) {
  char *path = tal_path_join(dir, name);
  DIR *list = opendir(path);
  size_t count = 0;
  for (struct dirent *entry; list && (entry = readdir(list));)
    count += strcmp(entry->d_name, ".") && strcmp(entry->d_name, "..");
  if (list)
    closedir(list);
  free(path);
  return count;
}

// ---- made-up runs ----

// Confined until t = 1 s, then compressed; every column that the curves use.
static void write_series(const char *dir, int rows) {
  char *path = tal_path_join(dir, "series.csv");
  FILE *file = fopen(path, "w");
  assert_non_null(file);
  fputs("time[s],step,stage,axial_strain,volumetric_strain,sigma_xx[Pa],sigma_yy[Pa],stress_ratio,coordination,"
        "coordination_bearing,solid_fraction,mean_slip,kinetic[J],elastic[J],work_walls[J],dissipated_friction[J],"
        "energy_residual\n",
        file);
  for (int k = 0; k < rows; k++) {
    double t = 0.1 * k, strain = t < 1 ? 0 : 0.01 * (t - 1);
    fprintf(file, "%.17g,%d,%d,%.17g,%.17g,%g,%g,%g,3.5,3.8,0.82,%s,1e-6,1e-4,%g,%g,%g\n", t, 10 * k, t > 1, strain,
            0.3 * strain, 1e5 * fmin(t, 1), 1e5 * fmin(t, 1) * (1 + strain), 1 + strain, strain > 0 ? "1.5" : "nan",
            strain, 0.9 * strain, 1e-8 * k);
  }
  assert_int_equal(fclose(file), 0);
  free(path);
}

static void put_attribute(hid_t file, const char *name, double value) {
  hid_t space = H5Screate(H5S_SCALAR), attribute = H5Acreate2(file, name, H5T_NATIVE_DOUBLE, space, 0, 0);
  H5Awrite(attribute, H5T_NATIVE_DOUBLE, &value);
  H5Aclose(attribute);
  H5Sclose(space);
}

static void put_column(hid_t file, const char *path, hid_t type, hsize_t count, const void *value) {
  hid_t links = H5Pcreate(H5P_LINK_CREATE), space = H5Screate_simple(1, &count, NULL);
  H5Pset_create_intermediate_group(links, 1);
  hid_t set = H5Dcreate2(file, path, type, space, links, 0, 0);
  assert_true(set >= 0);
  H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, value);
  H5Dclose(set);
  H5Sclose(space);
  H5Pclose(links);
}

// Four grains of a square, compressed by `strain`; contact c joins grain c and `partner[c]`.
static void write_frame(const char *dir, int number, double strain, const int32_t partner[3]) {
  char *folder = tal_path_join(dir, "fields"), name[32];
  mkdir(folder, 0777);
  snprintf(name, sizeof name, "%06d.h5", number);
  char *path = tal_path_join(folder, name);
  hid_t file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  assert_true(file >= 0);
  put_attribute(file, "time", number);
  put_attribute(file, "axial_strain", strain);
  const int64_t id[4] = {0, 1, 2, 3};
  const double x[4] = {0, 1e-3, 1e-3, 0}, y[4] = {0, 0, 1e-3 * (1 - strain), 1.01e-3 * (1 - strain)};
  const double r[4] = {5e-4, 5e-4, 5e-4, 5e-4}, theta[4] = {0, strain, -strain, 2 * strain};
  const char *const grain[] = {"/grains/x", "/grains/y", "/grains/r", "/grains/theta"};
  const double *const column[] = {x, y, r, theta};
  put_column(file, "/grains/id", H5T_NATIVE_INT64, 4, id);
  for (int k = 0; k < 4; k++)
    put_column(file, grain[k], H5T_NATIVE_DOUBLE, 4, column[k]);
  const int32_t i[3] = {0, 1, 2}, a[2] = {0, 0}, b[2] = {1, 2}, c[2] = {2, 3}, loop[4] = {0, 1, 2, 3};
  put_column(file, "/contacts/i", H5T_NATIVE_INT32, 3, i);
  put_column(file, "/contacts/j", H5T_NATIVE_INT32, 3, partner);
  put_column(file, "/contacts/fn", H5T_NATIVE_DOUBLE, 3, (double[]){1, 2, 30});
  put_column(file, "/contacts/overlap", H5T_NATIVE_DOUBLE, 3, (double[]){1e-7, 1e-7, 1e-15});
  put_column(file, "/cells/i", H5T_NATIVE_INT32, 2, a);
  put_column(file, "/cells/j", H5T_NATIVE_INT32, 2, b);
  put_column(file, "/cells/k", H5T_NATIVE_INT32, 2, c);
  put_column(file, "/cells/L_II", H5T_NATIVE_DOUBLE, 2, (double[]){0.1, 0.3});
  put_column(file, "/cells/pressure", H5T_NATIVE_DOUBLE, 2, (double[]){1e5, (double)NAN});
  put_column(file, "/cells/area", H5T_NATIVE_DOUBLE, 2, (double[]){5e-7, 5e-7});
  put_column(file, "/loop/node", H5T_NATIVE_INT32, 4, loop);
  // A plate, a wall that stays, a wall that went away at t = 0.
  const char *const wall[] = {"/walls/x0",    "/walls/y0",        "/walls/x1",        "/walls/y1",
                              "/walls/plate", "/walls/from_time", "/walls/until_time"};
  const double walls[7][3] = {{0, 1, 2}, {-5e-4, 1, 2}, {0, 3, 4}, {-5e-4, 3, 4}, {1, 0, 0}, {-1, -1, -1}, {99, 99, 0}};
  for (int k = 0; k < 7; k++)
    put_column(file, wall[k], H5T_NATIVE_DOUBLE, 3, walls[k]);
  assert_true(H5Fclose(file) >= 0);
  free(path);
  free(folder);
}

static const int32_t sound[3] = {1, 2, 3};

// ---- what a PNG says of itself ----

typedef struct png {
  unsigned width, height;
} png;

static png read_png(const char *dir, const char *name) {
  unsigned char head[24];
  char *path = tal_path_join(dir, name);
  FILE *file = fopen(path, "rb");
  if (!file)
    fail_msg("%s was not made", name);
  assert_int_equal(fread(head, 1, sizeof head, file), sizeof head);
  fclose(file);
  free(path);
  assert_memory_equal(head, "\x89PNG\r\n\x1a\n", 8);
  assert_memory_equal(head + 12, "IHDR", 4);
  return (png){(unsigned)head[18] << 8 | head[19], (unsigned)head[22] << 8 | head[23]};
}

// ---- tables ----

// EXACT: columns come by name without their unit, nan is NAN, a row still being written is left out.
static void table_columns_by_name(void **state) {
  write_text(*state, "t.csv", "time[s],step,sigma_xx[Pa]\n0,0,nan\n0.1,10,-1.5e5\n0.30000000000000004,20,7\n0.4,3");
  char *path = tal_path_join(*state, "t.csv");
  tal_table table;
  tal_error err;
  assert_int_equal(tal_table_read(&table, path, &err), TAL_OK);
  assert_int_equal(table.rows, 3);
  assert_int_equal(table.columns, 3);
  const double *stress = tal_table_column(&table, "sigma_xx"), *time = tal_table_column(&table, "time");
  assert_true(isnan(stress[0]) && stress[1] == -1.5e5 && stress[2] == 7);
  assert_true(time[2] == 0.1 + 0.2);
  assert_null(tal_table_column(&table, "sigma_xx[Pa]"));
  assert_null(tal_table_column(&table, "sigma_yy"));
  tal_table_clear(&table);
  free(path);
}

// EXACT: lines ended by CR LF read the same.
static void table_with_cr(void **state) {
  write_text(*state, "t.csv", "a,b\r\n1,2\r\n3,4\r\n");
  char *path = tal_path_join(*state, "t.csv");
  tal_table table;
  assert_int_equal(tal_table_read(&table, path, NULL), TAL_OK);
  assert_int_equal(table.rows, 2);
  assert_true(tal_table_column(&table, "b")[1] == 4);
  tal_table_clear(&table);
  free(path);
}

// EXACT: what is no table is refused with file and line, and leaves nothing behind.
static void table_refuses(void **state) {
  static const struct {
    const char *text, *line;
  } cases[] = {{"", ":1:"},           {"a,b\n1,2\n3\n", ":3:"},  {"a,b\n1,2,3\n", ":2:"},
               {"a,b\n1,x\n", ":2:"}, {"a,b\n1,\n2,3\n", ":2:"}, {"a,b\n\n", ":2:"},
               {"a,b\n1,2 \n", ":2:"}};
  char *path = tal_path_join(*state, "t.csv");
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
    tal_table table;
    tal_error err;
    write_text(*state, "t.csv", cases[k].text);
    assert_int_equal(tal_table_read(&table, path, &err), TAL_BAD_INPUT);
    assert_non_null(strstr(err.text, cases[k].line));
    assert_true(table.rows == 0 && table.columns == 0);
  }
  unlink(path);
  tal_table table;
  assert_int_equal(tal_table_read(&table, path, NULL), TAL_IO);
  free(path);
}

// EXACT: name and confining pressure from a scene given as an object and as text; without run.json the folder's name.
static void facts_of_a_run(void **state) {
  static const char *const json[] = {
      "{\"stages\": [1], \"scene\": {\"name\": \"a 'b'\", \"stages\": [{\"kind\": \"free\"}, {\"kind\": \"confine\", "
      "\"pressure\": 1e5}]}}",
      "{\"scene\": \"name: \\\"a 'b'\\\"\\nstages:\\n- {kind: free}\\n- {kind: confine, pressure: 1e5}\\n\"}"};
  tal_run_facts facts;
  for (int k = 0; k < 2; k++) {
    write_text(*state, "run.json", json[k]);
    tal_run_facts_read(&facts, *state);
    assert_string_equal(facts.name, "a 'b'");
    assert_int_equal(facts.confine_stage, 1);
    assert_true(facts.pressure == 1e5);
    tal_run_facts_clear(&facts);
  }
  write_text(*state, "run.json", "{ not json");
  char *slashed = tal_path_join(*state, "/");
  tal_run_facts_read(&facts, slashed);
  assert_string_equal(facts.name, strrchr(*state, '/') + 1);
  assert_true(facts.confine_stage == -1 && isnan(facts.pressure));
  tal_run_facts_clear(&facts);
  free(slashed);
}

// ---- text for gnuplot ----

// EXACT: single quotes become typographic, control characters and malformed UTF-8 replaced, long text cut; the rest is
// untouched.
static void text_is_quoted(void **state) {
  (void)state;
  static const struct {
    const char *text, *quoted;
  } cases[] = {{"plain", "'plain'"},
               {"it's", "'it’s'"},
               {"'\nsystem 'x", "'’ system ’x'"},
               {"`touch /tmp/x` @a _^{} %s \\ \"", "'`touch /tmp/x` @a _^{} %s \\ \"'"},
               {"\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80", "'\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80'"},
               {"\xff\xc3(\xed\xa0\x80\xc0\xaf\xf5", "'\?\?(\?\?\?\?\?\?'"},
               {"\xc2\x85\x7f\t", "'   '"},
               {"0123456789abcdefghijX", "'0123456789abcdefghij…'"}};
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
    char *got = NULL;
    size_t size;
    FILE *out = open_memstream(&got, &size);
    tal_plot_text(out, cases[k].text, 20 + 20 * (k != 7));
    fclose(out);
    assert_string_equal(got, cases[k].quoted);
    free(got);
  }
}

// EXACT: a hostile scene name runs nothing and breaks nothing: the figure is made, the trap files are not.
static void hostile_names(void **state) {
  static const char *const names[] = {
      "`touch trap`",
      "' ; system('touch trap') #",
      "\n!touch trap\n",
      "$(touch trap)",
      "\"`touch trap`\"",
      "\\\n'\nshell\n",
      "@trap %s %d {/Symbol a} _^",
      "\\",
      "'",
      "''",
      "{{{}_{^{@~&{\xff}}",
      "\x01\x02\xc3",
  };
  char *trap = tal_path_join(*state, "trap");
  for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
    tal_plot plot;
    tal_error err = {""};
    tal_figure_data data = {.facts.name = (char *)names[k]};
    tal_frame frame = {.grain_count = 1, .x = (double[]){0}, .y = (double[]){0}, .r = (double[]){1e-3}};
    tal_map map = tal_map_of_frame(&frame);
    assert_int_equal(tal_plot_begin(&plot, *state, &err), TAL_OK);
    tal_map_fit(&map, 1, false);
    tal_map_open(&map, &data, &plot);
    // gnuplot works in the temporary folder: there a sprung trap would lie.
    fprintf(plot.script, "plot 0\nif (system('ls trap 2>/dev/null') ne '') { exit status 7 }\n");
    char *picture = tal_path_join(*state, "p.png");
    tal_status status = tal_plot_finish(&plot, picture, &err);
    if (status)
      fail_msg("name %zu: %s", k, err.text);
    assert_int_equal(read_png(*state, "p.png").width, map.width);
    assert_int_equal(access(trap, F_OK), -1);
    unlink(picture);
    free(picture);
  }
  assert_int_equal(access("trap", F_OK), -1);
  free(trap);
}

// ---- gnuplot as a child ----

static tal_status run_script(const char *dir, const char *text, double limit, tal_error *err) {
  tal_plot plot;
  assert_int_equal(tal_plot_begin(&plot, dir, err), TAL_OK);
  plot.time_limit = limit;
  fputs(text, plot.script);
  char *picture = tal_path_join(dir, "p.png");
  tal_status status = tal_plot_finish(&plot, picture, err);
  free(picture);
  return status;
}

// EXACT: gnuplot's own words reach the message; nothing is left in the folder.
static void gnuplot_complains(void **state) {
  tal_error err;
  assert_int_equal(run_script(*state, "plot 1\nnonsense 3\n", 60, &err), TAL_IO);
  assert_non_null(strstr(err.text, "line 2"));
  assert_int_equal(run_script(*state, "x = 1\n", 60, &err), TAL_IO);
  assert_non_null(strstr(err.text, "no picture"));
  assert_int_equal(count_entries(*state, "."), 0);
}

// EXACT: a gnuplot that hangs is ended.
static void gnuplot_hangs(void **state) {
  tal_error err;
  struct timespec begin, end;
  clock_gettime(CLOCK_MONOTONIC, &begin);
  assert_int_equal(run_script(*state, "pause 30\n", 0.2, &err), TAL_IO);
  clock_gettime(CLOCK_MONOTONIC, &end);
  assert_true(end.tv_sec - begin.tv_sec < 10);
  assert_non_null(strstr(err.text, "longer than 0.2 s"));
  assert_int_equal(count_entries(*state, "."), 0);
}

// EXACT: a signal that reaches gnuplot (Ctrl-C does) counts as the user's wish, and nothing is left in the folder.
static void gnuplot_is_interrupted(void **state) {
  static const char *const signals[] = {"INT", "TERM"};
  for (int k = 0; k < 2; k++) {
    char script[120];
    tal_error err;
    snprintf(script, sizeof script, "system '(sleep 0.2; kill -%s $PPID) >/dev/null 2>&1 &'\npause 20\n", signals[k]);
    assert_int_equal(run_script(*state, script, 60, &err), TAL_INTERRUPTED);
    assert_non_null(strstr(err.text, "p.png"));
    assert_int_equal(count_entries(*state, "."), 0);
  }
}

// EXACT: without gnuplot one sentence names the package; the run is untouched and no temporary file stays.
static void gnuplot_is_missing(void **state) {
  write_series(*state, 30);
  char *path = tal_strdup(getenv("PATH"));
  tal_error err;
  int count = -1;
  setenv("PATH", *state, 1);
  tal_status status = tal_figures_draw(*state, &count, &err);
  setenv("PATH", path, 1);
  free(path);
  assert_int_equal(status, TAL_IO);
  assert_int_equal(count, 0);
  assert_non_null(strstr(err.text, "gnuplot-nox"));
  assert_null(strchr(err.text, '\n'));
  assert_int_equal(count_entries(*state, "figures"), 0);
  assert_int_equal(count_entries(*state, "."), 2);
}

// ---- affine displacements ----

// ROUND: an exactly affine displacement leaves nothing, at any strain, offset and shape of the cloud.
static void affine_leaves_nothing(void **state) {
  (void)state;
  enum { N = 50 };
  for (int trial = 0; trial < 20; trial++) {
    double x[N], y[N], dx[N], dy[N], exx = 0.01 * trial, eyy = -0.02 * trial, largest = 0;
    for (int k = 0; k < N; k++) {
      x[k] = 3.0 + sin(1.7 * k + trial);
      y[k] = -2.0 + 4 * cos(2.3 * k * (trial + 1));
      dx[k] = 0.4 + exx * x[k];
      dy[k] = -0.1 + eyy * y[k];
    }
    tal_affine affine = tal_affine_fit(N, x, y, dx, dy, eyy);
    assert_true(fabs(affine.exx - exx) < 1e-13);
    assert_true(fabs(affine.ax - 0.4) < 1e-12 && fabs(affine.ay + 0.1) < 1e-12);
    tal_affine_subtract(affine, N, x, y, dx, dy);
    for (int k = 0; k < N; k++)
      largest = fmax(largest, hypot(dx[k], dy[k]));
    assert_true(largest < 64 * 2.3e-16 * 4);
  }
}

// ROUND: what is not affine stays: two halves sliding by +-s keep their jump, less the part a stretch can take; for
// points at x = +-1 with u_x = s y-sign and as many of each, the fit is zero and the vectors are +-s exactly.
static void affine_keeps_slip(void **state) {
  (void)state;
  const double x[4] = {-1, 1, -1, 1}, y[4] = {-1, -1, 1, 1};
  double dx[4] = {-0.5, -0.5, 0.5, 0.5}, dy[4] = {0.2, 0.2, -0.2, -0.2};
  tal_affine affine = tal_affine_fit(4, x, y, dx, dy, -0.1);
  assert_true(affine.exx == 0 && affine.ax == 0 && affine.ay == 0 && affine.eyy == -0.1);
  tal_affine_subtract(affine, 4, x, y, dx, dy);
  for (int k = 0; k < 4; k++) {
    assert_true(dx[k] == (y[k] < 0 ? -0.5 : 0.5));
    assert_true(fabs(dy[k] + 0.1 * y[k]) < 1e-15);
  }
  affine = tal_affine_fit(0, x, y, dx, dy, 0);
  assert_true(affine.exx == 0 && affine.ax == 0);
}

// ---- whole runs ----

// EXACT: a folder that holds no run, or does not exist, is bad input and stays as it was.
static void empty_folder(void **state) {
  tal_error err;
  int count = -1;
  assert_int_equal(tal_figures_draw(*state, &count, &err), TAL_BAD_INPUT);
  assert_int_equal(count, 0);
  assert_int_equal(count_entries(*state, "."), 0);
  assert_int_equal(tal_figures_draw("/nonexistent/run", &count, &err), TAL_BAD_INPUT);
}

static void collect(void *user, const char *path) {
  char *names = user;
  strcat(strcat(names, strrchr(path, '/') + 1), " ");
}

// EXACT: series alone gives the curves, each a whole PNG of the stated size, and no temporary file stays.
static void series_only(void **state) {
  write_series(*state, 40);
  tal_error err;
  char names[400] = "";
  int count;
  assert_int_equal(tal_figures_draw_each(*state, collect, names, &count, &err), TAL_OK);
  assert_string_equal(names, "confinement.png stress_ratio.png volumetric_strain.png mean_slip.png energy.png "
                             "coordination.png ");
  assert_int_equal(count, 6);
  assert_int_equal(count_entries(*state, "figures"), 6);
  png size = read_png(*state, "figures/stress_ratio.png");
  assert_true(size.width == 1300 && size.height == 950);
}

// EXACT: rows before any compression give energies and coordination against time, no curve against strain; one row or
// none gives no figure, and that is no error.
static void runs_without_strain(void **state) {
  static const int rows[] = {9, 1, 0}, figures[] = {2, 0, 0};
  for (int k = 0; k < 3; k++) {
    int count;
    write_series(*state, rows[k]);
    assert_int_equal(tal_figures_draw(*state, &count, NULL), TAL_OK);
    assert_int_equal(count, figures[k]);
  }
  assert_int_equal(count_entries(*state, "figures"), 2);
}

// EXACT: frames give all maps; the box of a map is as wide as high for a square of grains, so axes are equal.
static void frames_give_maps(void **state) {
  for (int k = 0; k < 5; k++)
    write_frame(*state, k, 0.01 * k, sound);
  char names[400] = "";
  int count;
  tal_error err;
  tal_status status = tal_figures_draw_each(*state, collect, names, &count, &err);
  if (status)
    fail_msg("%s", err.text);
  assert_string_equal(names, "grains_first.png grains.png displacement.png rotation.png cells_L_II.png "
                             "cells_pressure.png ");
  tal_frame square = {.grain_count = 2, .x = (double[]){0, 5}, .y = (double[]){7, 12}, .r = (double[]){1, 1}};
  tal_map map = tal_map_of_frame(&square);
  assert_true(map.x0 == -1 && map.x1 == 6 && map.y0 == 6 && map.y1 == 13);
  tal_map_fit(&map, 2, true);
  assert_int_equal(map.box_width, map.box_height);
  assert_true(map.x1 - map.x0 >= 7 && map.left + map.box_width < map.width && map.top + map.box_height < map.height);
}

// EXACT: the window ends with the last frame and begins with the latest at least 2 % before it; a shorter test takes
// the last unstrained frame. Walls gone by then are left out, plates are as wide as the grains.
static void window_of_frames(void **state) {
  static const double strain[] = {0, 0, 0.01, 0.02, 0.03, 0.045};
  for (int k = 0; k < 6; k++)
    write_frame(*state, k, strain[k], sound);
  tal_figure_data data;
  assert_int_equal(tal_figure_data_read(&data, *state, NULL), TAL_OK);
  assert_true(data.last.axial_strain == 0.045 && data.earlier.axial_strain == 0.02);
  assert_int_equal(data.window.count, 4);
  assert_true(data.window.dtheta[3] == 2 * 0.045 - 2 * 0.02);
  assert_true(data.window.dy[0] == 0 && data.window.dx[2] == 0);
  assert_true(data.confined.time == 1 && data.first.time == 0);
  assert_int_equal(data.last.contact_count, 2); // the third overlaps by less than round-off
  assert_int_equal(data.last.wall_count, 2);
  assert_true(data.last.wall[0][0] == -5e-4 && data.last.wall[0][2] == 1e-3 + 5e-4 && data.last.wall[1][0] == 1);
  tal_figure_data_clear(&data);
  for (int k = 3; k < 6; k++)
    write_frame(*state, k, 0.012, sound);
  assert_int_equal(tal_figure_data_read(&data, *state, NULL), TAL_OK);
  assert_true(data.earlier.axial_strain == 0 && data.earlier.time == 1);
  tal_figure_data_clear(&data);
}

// EXACT: a frame that is cut short is named and the others are drawn; one whose indices lead outside is refused.
static void damaged_frames(void **state) {
  int count;
  tal_error err;
  write_frame(*state, 0, 0, sound);
  write_frame(*state, 1, 0.03, sound);
  write_frame(*state, 2, 0.06, sound);
  char *cut = tal_path_join(*state, "fields/000001.h5");
  assert_int_equal(truncate(cut, 700), 0);
  assert_int_equal(tal_figures_draw(*state, &count, &err), TAL_IO);
  assert_non_null(strstr(err.text, "000001.h5"));
  assert_int_equal(count, 6);
  unlink(cut);
  free(cut);
  write_frame(*state, 2, 0.06, (int32_t[]){1, 4, 0});
  char *last = tal_path_join(*state, "fields/000002.h5");
  tal_frame frame;
  assert_int_equal(tal_frame_read(&frame, last, &err), TAL_IO);
  assert_non_null(strstr(err.text, "/contacts/j"));
  assert_int_equal(frame.grain_count, 0);
  free(last);
}

int main(void) {
#define TEST(name) cmocka_unit_test_setup_teardown(name, make_folder, drop_folder)
  const struct CMUnitTest tests[] = {
      TEST(table_columns_by_name),  TEST(table_with_cr),      TEST(table_refuses),         TEST(facts_of_a_run),
      TEST(text_is_quoted),         TEST(hostile_names),      TEST(gnuplot_complains),     TEST(gnuplot_hangs),
      TEST(gnuplot_is_interrupted), TEST(gnuplot_is_missing), TEST(affine_leaves_nothing), TEST(affine_keeps_slip),
      TEST(empty_folder),           TEST(series_only),        TEST(runs_without_strain),   TEST(frames_give_maps),
      TEST(window_of_frames),       TEST(damaged_frames),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
