// Packings from a CSV file and from the scene's list: what is read, and every refusal with its file, line and name.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "pack.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// A folder with packing.csv, and a scene in it that names the file.
typedef struct folder {
  char path[200], csv[220], scene_path[220];
  tal_scene scene;
} folder;

static int make_folder(void **state) {
  folder *at = tal_alloc(1, sizeof *at);
  const char *base = getenv("TMPDIR");
  snprintf(at->path, sizeof at->path, "%s/talus-pack-XXXXXX", base ? base : "/tmp");
  assert_non_null(mkdtemp(at->path));
  snprintf(at->csv, sizeof at->csv, "%s/packing.csv", at->path);
  snprintf(at->scene_path, sizeof at->scene_path, "%s/scene.yaml", at->path);
  at->scene = (tal_scene){.path = at->scene_path, .mass_scaling = 1};
  at->scene.pack.method = "file";
  at->scene.pack.path = (char *)(uintptr_t) "packing.csv";
  at->scene.pack.cut_radius = (double)NAN;
  *state = at;
  return 0;
}

static int remove_folder(void **state) {
  folder *at = *state;
  unlink(at->csv);
  assert_int_equal(rmdir(at->path), 0);
  free(at);
  return 0;
}

static void write_csv(const folder *at, const char *text, size_t length) {
  FILE *file = fopen(at->csv, "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(text, 1, length, file), length);
  assert_int_equal(fclose(file), 0);
}

static tal_status pack_text(const folder *at, const char *text, tal_packing *packing, tal_error *err) {
  write_csv(at, text, strlen(text));
  return tal_pack(&at->scene, packing, err);
}

// EXACT: columns in any order, comments, blank lines, CRLF, byte order mark, units, quotes, empty optional fields.
static void reads_everything(void **state) {
  tal_packing p;
  tal_error err = {{0}};
  const char *text = "\xef\xbb\xbf# made by hand\r\n\r\n"
                     "id, r[m] ,\"y\",x,fixed,vx,vy[m/s],omega,mass,inertia[kg m^2]\r\n"
                     "17,1e-3,0.5,-2.5E-1,true,1,0,-3,,\r\n"
                     "  # a comment between\r\n"
                     "18,2e-3, .25 ,\"+1\",0,0,0.125,0,5,\r\n"
                     "19,4e-3,-1,7,false,0,0,0,,1e-9";
  assert_int_equal(pack_text(*state, text, &p, &err), TAL_OK);
  assert_int_equal(p.count, 3);
  assert_true(p.x[0] == -0.25 && p.x[1] == 1 && p.x[2] == 7);
  assert_true(p.y[0] == 0.5 && p.y[1] == 0.25 && p.y[2] == -1);
  assert_true(p.r[0] == 1e-3 && p.r[1] == 2e-3 && p.r[2] == 4e-3);
  assert_true(p.vx[0] == 1 && p.vx[1] == 0 && p.vy[1] == 0.125 && p.omega[0] == -3);
  assert_true(p.fixed[0] == 1 && p.fixed[1] == 0 && p.fixed[2] == 0);
  assert_true(isnan(p.mass[0]) && p.mass[1] == 5 && isnan(p.mass[2]));
  assert_true(isnan(p.inertia[0]) && isnan(p.inertia[1]) && p.inertia[2] == 1e-9);
  assert_true(isnan(p.width));
  tal_packing_clear(&p);
}

// EXACT: what is all zero or absent has no array.
static void absent_stays_absent(void **state) {
  tal_packing p;
  tal_error err = {{0}};
  assert_int_equal(pack_text(*state, "x,y,r,vx,mass,fixed\n0,0,1,0,,0\n3,0,1,0,,0\n", &p, &err), TAL_OK);
  assert_true(!p.vx && !p.vy && !p.omega && !p.mass && !p.inertia && !p.fixed);
  tal_packing_clear(&p);
}

// EXACT: a packing written with 17 digits comes back with the same bits, fixed grains and all.
static void round_trip(void **state) {
  folder *at = *state;
  tal_scene scene = at->scene;
  scene.pack.method = "drop_and_roll";
  scene.pack.width = 30e-3;
  scene.grains.count = 2000;
  scene.grains.radius = (tal_radius){.law = TAL_RADIUS_UNIFORM, .min = 0.5e-3, .max = 1e-3};
  tal_packing p, q;
  tal_error err = {{0}};
  assert_int_equal(tal_pack(&scene, &p, &err), TAL_OK);
  FILE *file = fopen(at->csv, "w");
  assert_non_null(file);
  fprintf(file, "x,y,r\n");
  for (size_t i = 0; i < p.count; i++)
    fprintf(file, "%.17g,%.17g,%.17g\n", p.x[i], p.y[i], p.r[i]);
  assert_int_equal(fclose(file), 0);
  assert_int_equal(tal_pack(&at->scene, &q, &err), TAL_OK);
  assert_int_equal(q.count, p.count);
  assert_memory_equal(p.x, q.x, p.count * sizeof *p.x);
  assert_memory_equal(p.y, q.y, p.count * sizeof *p.y);
  assert_memory_equal(p.r, q.r, p.count * sizeof *p.r);
  assert_true(p.coordination == q.coordination && p.solid_fraction == q.solid_fraction);
  tal_packing_clear(&p);
  tal_packing_clear(&q);
}

// EXACT: each bad file is refused with its own path, the line, the column and the reason.
static void refuses_bad_files(void **state) {
  static const struct {
    const char *text, *where, *says;
  } bad[] = {
      {"", "packing.csv: ", "no header"},
      {"# only a comment\n\n", "packing.csv: ", "no header"},
      {"x,y,r\n", "packing.csv: ", "no grains"},
      {"x,y,r\n# nothing\n\n", "packing.csv: ", "no grains"},
      {"0,0,1\n", "packing.csv:1: 0: ", "unknown column"},
      {"x,y\n0,0\n", "packing.csv:1: r: ", "required"},
      {"# c\nx,y,radius\n0,0,1\n", "packing.csv:2: radius: ", "unknown column"},
      {"x,y,r,\n0,0,1,\n", "packing.csv:1: header: ", "unknown column"},
      {"x,y,r,x\n0,0,1,0\n", "packing.csv:1: x: ", "twice"},
      {"x[mm],y,r\n0,0,1\n", "packing.csv:1: x: ", "SI units"},
      {"x;y;r\n0;0;1\n", "packing.csv:1: x;y;r: ", "unknown column"},
      {"x,y,r\n0,0,1\n1,2\n", "packing.csv:3: ", "2 fields where the header has 3"},
      {"x,y,r\n0,0,1,4\n", "packing.csv:2: ", "more fields"},
      {"x,y,r\n0,0,1,\n", "packing.csv:2: ", "more fields"},
      {"x,y,r\n0,0,-1\n", "packing.csv:2: r: ", "not above 0"},
      {"x,y,r\n\n#\n0,0,0\n", "packing.csv:4: r: ", "not above 0"},
      {"x,y,r\n0,0,\n", "packing.csv:2: r: ", "''"},
      {"x,y,r\r\nnan,0,1\r\n", "packing.csv:2: x: ", "'nan'"},
      {"x,y,r\n0,inf,1\n", "packing.csv:2: y: ", "'inf'"},
      {"x,y,r\n0,1e999,1\n", "packing.csv:2: y: ", "'1e999'"},
      {"x,y,r\n0x10,0,1\n", "packing.csv:2: x: ", "'0x10'"},
      {"x,y,r\n1mm,0,1\n", "packing.csv:2: x: ", "'1mm'"},
      {"x,y,r\n1 2,0,1\n", "packing.csv:2: x: ", "'1 2'"},
      {"x,y,r\n1e,0,1\n", "packing.csv:2: x: ", "'1e'"},
      {"x,y,r\n--1,0,1\n", "packing.csv:2: x: ", "'--1'"},
      {"x,y,r\n\"1,0,1\n", "packing.csv:2: x: ", "'\"1'"},
      {"x,y,r,vx\n0,0,1,\n", "packing.csv:2: vx: ", "''"},
      {"x,y,r,mass\n0,0,1,0\n", "packing.csv:2: mass: ", "not above 0"},
      {"x,y,r,inertia\n0,0,1,-2\n", "packing.csv:2: inertia: ", "not above 0"},
      {"x,y,r,fixed\n0,0,1,yes\n", "packing.csv:2: fixed: ", "'yes'"},
      {"x,y,r\n5,0,1\n1,2,1\n# c\n1,2,3\n", "packing.csv:5: x, y: ", "grains 1 and 2 (lines 3 and 5)"},
      {"x,y,r\n0,0,1\n9,9,1\n-0.0,0,1\n0,0,1\n", "packing.csv:4: ", "grains 0 and 2 (lines 2 and 4)"},
  };
  const folder *at = *state;
  for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
    tal_packing p;
    tal_error err = {{0}};
    assert_int_equal(pack_text(at, bad[k].text, &p, &err), TAL_BAD_INPUT);
    char start[300];
    snprintf(start, sizeof start, "%s/%s", at->path, bad[k].where);
    if (strncmp(err.text, start, strlen(start)) != 0 || !strstr(err.text, bad[k].says))
      fail_msg("case %zu says '%s'", k, err.text);
    assert_true(p.count == 0 && p.x == NULL);
  }
}

// EXACT: zero bytes, no such file, a folder in its place; an absolute path is taken as it is.
static void refuses_what_is_no_file(void **state) {
  folder *at = *state;
  tal_packing p;
  tal_error err = {{0}};
  write_csv(at, "x,y,r\n0,\0,1\n", 12);
  assert_int_equal(tal_pack(&at->scene, &p, &err), TAL_BAD_INPUT);
  assert_non_null(strstr(err.text, "packing.csv:2: not text"));
  tal_scene scene = at->scene;
  const char *paths[] = {"absent.csv", ".", ""}, *says[] = {"No such file", "directory", "missing"};
  for (size_t k = 0; k < 3; k++) {
    scene.pack.path = (char *)(uintptr_t)paths[k];
    assert_int_equal(tal_pack(&scene, &p, &err), TAL_BAD_INPUT);
    assert_non_null(strstr(err.text, says[k]));
  }
  write_csv(at, "x,y,r\n0,0,1\n", 12);
  scene.pack.path = at->csv;
  assert_int_equal(tal_pack(&scene, &p, &err), TAL_OK);
  tal_packing_clear(&p);
}

// EXACT: listed grains come as listed; what is wrong with one names it.
static void listed_grains(void **state) {
  tal_scene scene = ((folder *)*state)->scene;
  scene.path = (char *)(uintptr_t) "scene.yaml";
  scene.pack.method = "none";
  tal_packing p;
  tal_error err = {{0}};
  assert_int_equal(tal_pack(&scene, &p, &err), TAL_BAD_INPUT);
  assert_non_null(strstr(err.text, "scene.yaml: grains.list: no grains"));
  tal_listed_grain good[2] = {{.x = 1, .r = 1, .mass = (double)NAN, .inertia = (double)NAN},
                              {.x = 1, .y = 1, .r = 1, .omega = 2, .mass = 3, .inertia = 4, .fixed = true}};
  scene.grains.list = good;
  scene.grains.list_count = 2;
  assert_int_equal(tal_pack(&scene, &p, &err), TAL_OK);
  assert_true(p.count == 2 && p.y[1] == 1 && p.omega[1] == 2 && p.mass[1] == 3 && p.inertia[1] == 4 && p.fixed[1]);
  assert_true(isnan(p.mass[0]) && !p.vx && p.largest_overlap == 1 && isnan(p.coordination));
  tal_packing_clear(&p);
  for (int k = 0; k < 5; k++) {
    tal_listed_grain list[2] = {good[0], good[1]};
    if (k == 0)
      list[1].y = 0;
    if (k == 1)
      list[1].r = 0;
    if (k == 2)
      list[1].x = (double)NAN;
    if (k == 3)
      list[1].mass = -1;
    if (k == 4)
      list[1].vx = (double)INFINITY;
    scene.grains.list = list;
    assert_int_equal(tal_pack(&scene, &p, &err), TAL_BAD_INPUT);
    assert_non_null(strstr(err.text, k == 0 ? "grains 0 and 1 have the same centre" : "grains.list: grain 1: "));
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test_setup_teardown(reads_everything, make_folder, remove_folder),
      cmocka_unit_test_setup_teardown(absent_stays_absent, make_folder, remove_folder),
      cmocka_unit_test_setup_teardown(round_trip, make_folder, remove_folder),
      cmocka_unit_test_setup_teardown(refuses_bad_files, make_folder, remove_folder),
      cmocka_unit_test_setup_teardown(refuses_what_is_no_file, make_folder, remove_folder),
      cmocka_unit_test_setup_teardown(listed_grains, make_folder, remove_folder),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
