// Good scenes: the numbers they load to, defaults, overrides, the canonical text, and damaged texts that must not harm.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "scene_files.h"
#include "scene_keys.h"
#include "scene_value.h"
#include "scene_yaml.h"

#include <locale.h>
#include <math.h>

static const char design[] =
    "name: biaxial-pressure\n"
    "seed: 1\n"
    "grains:   {count: 3279, radius: {law: uniform, min: 0.5e-3, max: 1.0e-3}, shape: disk, thickness: 1.5e-3}\n"
    "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\n"
    "mass_scaling: 1e5\n"
    "contact:  {normal: hertz, tangential: regularised, exponent: 20}\n"
    "pack:     {method: drop_and_roll, width: 60e-3}\n"
    "continuum: {backend: qhull, tessellation: delaunay, refresh: 250, peel: 0.5}\n"
    "integrator: {scheme: verlet, dt: 1e-5}\n"
    "stages:\n"
    "  - {kind: confine,  pressure: 100e3, ramp: 4.0}\n"
    "  - {kind: compress, boundary: pressure, rate: 5e-3, strain: 0.20}\n"
    "output:   {series_every: 0.05, fields_every: 1.0, checkpoint_every: 2.0, tracks: []}\n";

static void load_good(const scene_folder *folder, const char *text, const char *const *sets, size_t set_count,
                      tal_scene *scene) {
  tal_scene_errors errors;
  scene_folder_write(folder, text, strlen(text));
  tal_status status = tal_scene_load(scene, folder->file, sets, set_count, &errors);
  for (size_t i = 0; i < errors.count; i++)
    print_error("%s\n", errors.item[i].text);
  assert_int_equal(status, TAL_OK);
  assert_int_equal(errors.count, 0);
}

#define same(a, b) assert_true((a) == (b))

// EXACT: the design's example, every number of it.
static void test_design(void **state) {
  (void)state;
  scene_folder folder = scene_folder_create();
  tal_scene s;
  load_good(&folder, design, NULL, 0, &s);
  assert_string_equal(s.name, "biaxial-pressure");
  assert_string_equal(s.path, folder.file);
  same(s.seed, 1);
  same(s.grains.count, 3279);
  same(s.grains.radius.law, TAL_RADIUS_UNIFORM);
  same(s.grains.radius.min, 0.5e-3);
  same(s.grains.radius.max, 1.0e-3);
  same(s.grains.shape, TAL_DISK);
  same(s.grains.thickness, 1.5e-3);
  same(s.grains.list_count, 0);
  same(s.material.young, 30e9);
  same(s.material.poisson, 0.3);
  same(s.material.density, 2675);
  same(s.material.friction, 0.45);
  same(s.material.damping, 0.002);
  same(s.mass_scaling, 1e5);
  assert_string_equal(s.contact.normal, "hertz");
  assert_string_equal(s.contact.tangential, "regularised");
  same(s.contact.exponent, 20);
  assert_string_equal(s.pack.method, "drop_and_roll");
  same(s.pack.width, 60e-3);
  assert_string_equal(s.continuum.backend, "qhull");
  assert_false(s.continuum.power);
  same(s.continuum.refresh_steps, 250);
  same(s.continuum.peel, 0.5);
  assert_string_equal(s.integrator.scheme, "verlet");
  same(s.integrator.dt, 1e-5);
  same(s.stage_count, 2);
  assert_string_equal(s.stages[0].kind, "confine");
  same(s.stages[0].pressure, 100e3);
  same(s.stages[0].ramp, 4);
  assert_string_equal(s.stages[1].kind, "compress");
  assert_string_equal(s.stages[1].boundary, "pressure");
  same(s.stages[1].rate, 5e-3);
  same(s.stages[1].strain, 0.2);
  same(s.stages[1].pressure, 100e3);
  same(s.stages[1].line, 12);
  same(s.line_dt, 9);
  same(s.line_width, 7);
  same(s.output.series_every, 0.05);
  same(s.output.fields_every, 1);
  same(s.output.checkpoint_every, 2);
  same(s.output.track_count, 0);
  same(tal_scene_mean_radius(&s), 0.75e-3);
  tal_scene_clear(&s);
  scene_folder_remove(&folder);
}

// EXACT: the defaults of a scene that says as little as it may.
static void test_defaults(void **state) {
  (void)state;
  scene_folder folder = scene_folder_create();
  tal_scene s;
  load_good(
      &folder,
      "grains: {count: 10, radius: {min: 1e-3, max: 2e-3}}\nmaterial: {young: 1e9, density: 1000}\n"
      "pack: {width: 0.1}\nintegrator: {dt: 1e-6}\nstages: [{kind: confine, pressure: 2}, {kind: free, duration: 1}]",
      NULL, 0, &s);
  assert_string_equal(s.name, "talus");
  same(s.seed, 1);
  same(s.mass_scaling, 1);
  same(s.gravity[0], 0);
  same(s.gravity[1], 0);
  assert_true(s.rotation);
  same(s.material.poisson, 0.3);
  same(s.material.friction, 0);
  same(s.material.damping, 0);
  assert_string_equal(s.contact.normal, "hertz");
  assert_string_equal(s.contact.tangential, "none");
  assert_string_equal(s.pack.method, "drop_and_roll");
  assert_true(isnan(s.pack.cut_radius));
  assert_true(isnan(s.grains.thickness));
  same(s.continuum.refresh_steps, 250);
  assert_true(isnan(s.continuum.refresh_strain));
  same(s.continuum.peel, 0.5);
  same(s.skin, 0.02);
  same(s.overlap_limit, 0.5);
  assert_false(s.integrator.force);
  same(s.stages[0].ramp, 4);
  same(s.stages[0].tolerance, 0.01);
  same(s.stages[0].unbalanced, 1e-3);
  same(s.stages[0].timeout, 100);
  assert_true(isnan(s.stages[0].friction));
  same(s.stages[0].integrator.dt, 1e-6);
  assert_true(isnan(s.stages[1].pressure));
  same(s.output.series_every, 0.05);
  assert_true(isinf(s.output.fields_every));
  same(s.output.checkpoint_every, 2);
  tal_scene_clear(&s);
  scene_folder_remove(&folder);
}

static const char listed[] =
    "grains:\n"
    "  list:\n"
    "  - {x: 0, y: 0, r: 1e-3, fixed: true, mass: 1e-3}\n"
    "  - {x: 3e-3, y: 0.5, r: 2e-3, vx: -1, vy: .5, omega: +2E1, mass: 1e-3, inertia: 1e-9}\n"
    "  shape: sphere\n"
    "material: {young: 1e9, friction: 0.3}\n"
    "rotation: false\n"
    "contact: {vR: 1e-3, tangential: regularised}\n"
    "gravity: [0, -9.81]\n"
    "walls:\n"
    "- {from: [0, 0], to: [1, 0], young: .inf, friction: 0, velocity: [0, 1e-3], from_time: 1, until_time: 2}\n"
    "- from: [0, 0]\n"
    "  to: [0, 1]\n"
    "continuum: {tessellation: power, refresh: {strain: 1e-3}}\n"
    "integrator: {dt: 1e-6, force: true}\n"
    "stages:\n"
    "- {kind: free, duration: 0.5, integrator: {dt: 1e-7, force: false}}\n"
    "- {kind: free, duration: 0.5}\n"
    "output: {tracks: [1, 0], series_every: 0, fields_every: .inf}\n";

// EXACT: listed grains, walls, a stage's own integrator, the refresh mapping.
static void test_listed(void **state) {
  (void)state;
  scene_folder folder = scene_folder_create();
  tal_scene s;
  load_good(&folder, listed, NULL, 0, &s);
  same(s.grains.count, 0);
  same(s.grains.list_count, 2);
  assert_string_equal(s.pack.method, "none");
  assert_true(s.grains.list[0].fixed);
  assert_true(isnan(s.grains.list[0].inertia));
  same(s.grains.list[1].y, 0.5);
  same(s.grains.list[1].vx, -1);
  same(s.grains.list[1].vy, 0.5);
  same(s.grains.list[1].omega, 20);
  same(s.grains.list[1].inertia, 1e-9);
  same(s.grains.shape, TAL_SPHERE);
  assert_false(s.rotation);
  same(s.gravity[1], -9.81);
  same(s.wall_count, 2);
  assert_true(isinf(s.walls[0].young));
  same(s.walls[0].friction, 0);
  same(s.walls[0].velocity[1], 1e-3);
  same(s.walls[0].from_time, 1);
  same(s.walls[0].until_time, 2);
  same(s.walls[1].to[1], 1);
  assert_true(isnan(s.walls[1].young) && isnan(s.walls[1].friction) && isinf(s.walls[1].until_time));
  assert_true(s.continuum.power);
  same(s.continuum.refresh_steps, 0);
  same(s.continuum.refresh_strain, 1e-3);
  same(s.stages[0].integrator.dt, 1e-7);
  assert_false(s.stages[0].integrator.force);
  same(s.stages[1].integrator.dt, 1e-6);
  assert_true(s.stages[1].integrator.force);
  same(s.output.track_count, 2);
  same(s.output.tracks[0], 1);
  same(tal_scene_mean_radius(&s), 1.5e-3);
  tal_scene_clear(&s);
  scene_folder_remove(&folder);
}

// EXACT: which laws come with which keys, and what damping means beside restitution.
static void test_contact_choices(void **state) {
  (void)state;
  static const struct {
    const char *sets[3];
    const char *normal, *tangential;
  } rows[] = {
      {{"material.friction=0"}, "hertz", "none"},
      {{"material.friction=0.2"}, "hertz", "regularised"},
      {{"material.friction=0", "stages.0.friction=0.1"}, "hertz", "regularised"},
      {{"material.friction=0", "contact.vR=1"}, "hertz", "regularised"},
      {{"material.friction=0.2", "contact.tangential_ratio=0.8"}, "hertz", "spring"},
      {{"contact={normal: linear, stiffness: 1e5, restitution: 0.5}", "material.damping=0"}, "linear", "regularised"},
      {{"contact={normal: linear, stiffness: 1e5}", "material.damping=0"}, "linear", "regularised"},
      {{"contact.restitution=0.5", "material.damping=0"}, "hertz", "regularised"},
      {{"contact={restitution: 0.5, restitution_speed: 2}", "material.damping=0"}, "hertz", "regularised"}};
  scene_folder folder = scene_folder_create();
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    tal_scene s;
    const char *sets[4] = {"contact={}"};
    size_t count = 1;
    for (const char *const *set = rows[i].sets; count < 4 && set < rows[i].sets + 3 && *set; set++)
      sets[count++] = *set;
    load_good(&folder, design, sets, count, &s);
    assert_string_equal(s.contact.normal, rows[i].normal);
    assert_string_equal(s.contact.tangential, rows[i].tangential);
    if (i == 5) {
      same(s.contact.restitution, 0.5);
      assert_true(isnan(s.contact.damping));
    }
    if (i == 6) {
      assert_true(isnan(s.contact.restitution));
      same(s.contact.damping, 0);
    }
    if (i >= 7) {
      same(s.contact.restitution, 0.5);
      assert_true(isnan(s.material.damping));
      assert_true(i == 7 ? isnan(s.contact.restitution_speed) : s.contact.restitution_speed == 2);
    }
    tal_scene_clear(&s);
  }
  scene_folder_remove(&folder);
}

// EXACT: --set changes values, items, whole lists and mappings, makes what is missing; a repaired value is no error.
static void test_overrides(void **state) {
  (void)state;
  const char *sets[] = {"stages.1.strain=0.1",
                        "stages[0].friction=0",
                        "contact.vR=1e-3",
                        "grains.radius.min=0.6e-3",
                        "walls=[{from: [0, 0], to: [1, 0]}]",
                        "walls.0.to.1=2",
                        "continuum.refresh.displacement=0.1",
                        "output.tracks=[3, 4]",
                        "neighbours.skin=0.1",
                        "name=a = b",
                        "seed=1",
                        "seed=2"};
  scene_folder folder = scene_folder_create();
  tal_scene s;
  load_good(&folder, design, sets, sizeof sets / sizeof *sets, &s);
  same(s.stages[1].strain, 0.1);
  same(s.stages[0].friction, 0);
  same(s.contact.vR, 1e-3);
  same(s.grains.radius.min, 0.6e-3);
  same(s.walls[0].to[0], 1);
  same(s.walls[0].to[1], 2);
  same(s.continuum.refresh_steps, 0);
  same(s.continuum.refresh_displacement, 0.1);
  same(s.output.track_count, 2);
  same(s.skin, 0.1);
  assert_string_equal(s.name, "a = b");
  same(s.seed, 2);
  tal_scene_clear(&s);
  const char *repaired = "material.young=30e9";
  const char *broken = "grains: {count: 9, radius: {min: 1e-3, max: 1e-3}}\nmaterial: {young: 30GPa, density: 1}\n"
                       "pack: {width: 1}\nintegrator: {dt: 1}\n";
  load_good(&folder, broken, &repaired, 1, &s);
  same(s.material.young, 30e9);
  tal_scene_clear(&s);
  scene_folder_remove(&folder);
}

static void expect_round_trip(const scene_folder *folder, tal_scene *scene) {
  tal_scene again;
  char *text = tal_scene_text(scene);
  load_good(folder, text, NULL, 0, &again);
  char *second = tal_scene_text(&again);
  assert_string_equal(text, second);
  free(second);
  free(text);
  tal_scene_clear(&again);
}

// EXACT: the canonical text loads to the same text, whatever law, packing or quoting the scene uses.
static void test_round_trip(void **state) {
  (void)state;
  const char *head = "material: {young: 1e9, density: 2650.123456789}\nintegrator: {dt: 1e-6}\n";
  static const char *const tails[] = {
      "grains: {count: 9, radius: {law: lognormal, median: 1e-3, sigma: 0.3}}\npack: {width: 1}\n",
      "grains: {count: 9, radius: {law: lognormal, median: 1e-3, sigma: 0.3, min: 5e-4, max: 2e-3}}\npack: {width: "
      "1}\n",
      "grains: {count: 9, radius: {law: sieve, sizes: 4, passing: [[1e-3, 0], [2e-3, 100]]}}\npack: {width: 1}\n",
      "grains: {radius: {min: 1e-3, max: 1e-3}}\npack: {method: lattice, pattern: square, columns: 3, rows: 4, gap: "
      "-1e-5, "
      "cut: {radius: 1}}\n",
      "name: it's \"quoted\" # not this\ngrains: {list: [{x: 0.1, y: 1e-300, r: 0.3333333333333333}]}\n",
      "name: 'true'\ngrains: {list: [{x: 0, y: 0, r: 1}]}\nseed: 9223372036854775807\n",
      "grains: {list: [{x: 0, y: 0, r: 1}]}\ncontact: {normal: linear, stiffness: 1e5, restitution: 0.9}\n",
      "grains: {list: [{x: 0, y: 0, r: 1}]}\ncontact: {restitution: 0.3, restitution_speed: 0.1}\n",
      "grains: {list: [{x: 0, y: 0, r: 1}]}\ncontact: {normal: linear, stiffness: 1e5, damping: 3, tangential: "
      "spring}\n"};
  scene_folder folder = scene_folder_create();
  tal_scene s;
  for (size_t i = 0; i < sizeof tails / sizeof *tails; i++) {
    char text[800];
    snprintf(text, sizeof text, "%s%s", head, tails[i]);
    load_good(&folder, text, NULL, 0, &s);
    expect_round_trip(&folder, &s);
    tal_scene_clear(&s);
  }
  const char *both[] = {design, listed};
  for (size_t i = 0; i < 2; i++) {
    load_good(&folder, both[i], NULL, 0, &s);
    expect_round_trip(&folder, &s);
    tal_scene_clear(&s);
  }
  scene_folder_remove(&folder);
}

// EXACT: layout does not matter: CRLF, no final newline, a byte-order mark, block against flow style give the same
// text.
static void test_layout(void **state) {
  (void)state;
  scene_folder folder = scene_folder_create();
  tal_scene s;
  load_good(&folder, design, NULL, 0, &s);
  char *plain = tal_scene_text(&s);
  tal_scene_clear(&s);
  char variants[3][2 * sizeof design];
  size_t used = 0;
  for (const char *c = design; *c; c++) {
    if (*c == '\n')
      variants[0][used++] = '\r';
    variants[0][used++] = *c;
  }
  variants[0][used] = '\0';
  snprintf(variants[1], sizeof variants[1], "%.*s", (int)sizeof design - 2, design);
  snprintf(variants[2], sizeof variants[2], "\xef\xbb\xbf%s", design);
  for (size_t i = 0; i < 3; i++) {
    load_good(&folder, variants[i], NULL, 0, &s);
    char *text = tal_scene_text(&s);
    assert_string_equal(text, plain);
    free(text);
    tal_scene_clear(&s);
  }
  free(plain);
  scene_folder_remove(&folder);
}

static bool survives(const scene_folder *folder, const char *text, size_t size) {
  tal_scene s;
  tal_scene_errors errors;
  scene_folder_write(folder, text, size);
  tal_status status = tal_scene_load(&s, folder->file, NULL, 0, &errors);
  if (status == TAL_OK) {
    expect_round_trip(folder, &s);
    tal_scene_clear(&s);
    return true;
  }
  assert_int_equal(status, TAL_BAD_INPUT);
  assert_in_range(errors.count, 1, 10);
  for (size_t i = 0; i < errors.count; i++) {
    assert_int_equal(strncmp(errors.item[i].text, folder->file, strlen(folder->file)), 0);
    for (const char *c = errors.item[i].text; *c; c++)
      assert_true((unsigned char)*c >= ' ');
  }
  return false;
}

// EXACT: every truncation, and every byte replaced by each of a set of troublemakers, loads (and then round-trips) or
// is refused in one-line messages.
static void test_damaged(void **state) {
  (void)state;
  static const char bytes[] = "{}[],:-#&*!|>'\"%@ \t\n\r\0\x01\x80\xff"
                              "0e.a";
  scene_folder folder = scene_folder_create();
  char text[sizeof design > sizeof listed ? sizeof design : sizeof listed];
  size_t good = 0, bad = 0;
  const char *sources[] = {design, listed};
  for (size_t n = 0; n < 2; n++) {
    size_t size = strlen(sources[n]);
    for (size_t i = 0; i < size; i++)
      *(survives(&folder, sources[n], i) ? &good : &bad) += 1;
    for (size_t i = 0; i < size; i++) {
      memcpy(text, sources[n], size);
      for (size_t b = n + i % 3; b < sizeof bytes - 1; b += 3) {
        text[i] = bytes[b];
        *(survives(&folder, text, size) ? &good : &bad) += 1;
      }
    }
  }
  assert_true(good > 100 && bad > 1000);
  scene_folder_remove(&folder);
}

// EXACT: numbers are read with a point whatever the program's locale says.
static void test_locale(void **state) {
  (void)state;
  if (!setlocale(LC_NUMERIC, "de_DE.UTF-8"))
    skip();
  scene_folder folder = scene_folder_create();
  tal_scene s;
  load_good(&folder, design, NULL, 0, &s);
  same(s.material.friction, 0.45);
  expect_round_trip(&folder, &s);
  tal_scene_clear(&s);
  setlocale(LC_NUMERIC, "C");
  scene_folder_remove(&folder);
}

// EXACT: strict scalars against a list of what they take and refuse.
static void test_scalars(void **state) {
  (void)state;
  static const char *const reals[] = {"1", "-1", "+1", "1.", ".5", "1e5", "1E-5", "1.5e+10", "007", ".inf"};
  static const char *const not_reals[] = {"",   "e5",  ".",     "1e",  "1e+",   "0x1", "inf",      "nan", "1 ",
                                          " 1", "1,5", "1_000", "--1", "1.5.2", "1f",  "infinity", "1d5", "½"};
  double value;
  int64_t whole;
  for (size_t i = 0; i < sizeof reals / sizeof *reals; i++)
    assert_int_equal(tal_read_real(reals[i], &value), TAL_NUMBER_OK);
  for (size_t i = 0; i < sizeof not_reals / sizeof *not_reals; i++)
    assert_int_equal(tal_read_real(not_reals[i], &value), TAL_NUMBER_NOT);
  assert_int_equal(tal_read_whole("-9223372036854775808", &whole), TAL_NUMBER_OK);
  assert_true(whole == INT64_MIN);
  assert_int_equal(tal_read_whole("9223372036854775808", &whole), TAL_NUMBER_TOO_LARGE);
  assert_int_equal(tal_read_whole("1e4", &whole), TAL_NUMBER_NOT);
  assert_int_equal(tal_read_whole("", &whole), TAL_NUMBER_NOT);
  assert_int_equal(tal_edit_distance("friction", "frction"), 1);
  assert_int_equal(tal_edit_distance("name", "nmae"), 1);
  assert_int_equal(tal_edit_distance("", "abc"), 3);
}

// EXACT: printed numbers are the shortest of 15 to 17 digits that read back to the same bits.
static void test_printed(void **state) {
  (void)state;
  char text[40];
  double value = 1, back;
  for (int i = 0; i < 2000; i++) {
    value *= -1.0737;
    tal_print_real(value, text, sizeof text);
    assert_int_equal(tal_read_real(text, &back), TAL_NUMBER_OK);
    same(back, value);
  }
  tal_print_real(0.1, text, sizeof text);
  assert_string_equal(text, "0.1");
  tal_print_real(-HUGE_VAL, text, sizeof text);
  assert_string_equal(text, "-.inf");
}

static char *printed_keys(const char *what, bool *found) {
  char *text = NULL;
  size_t size;
  FILE *out = open_memstream(&text, &size);
  *found = tal_keys_print(out, what);
  fclose(out);
  return text;
}

// EXACT: `talus keys` finds keys, groups and kinds, with and without list indices, and nothing else.
static void test_keys(void **state) {
  (void)state;
  static const struct {
    const char *what, *has, *has_not;
  } rows[] = {{"", "material.young", "viscosity"},
              {"stages.compress", "stages.rate", "stages.duration"},
              {"stages.free", "stages.duration", "stages.rate"},
              {"stages[1].rate", "only with kind: compress", "stages.strain"},
              {"stages.1.rate", "1/s", "stages.strain"},
              {"contact", "contact.vR", "material"},
              {"grains.radius.sieve", "grains.radius.passing", "grains.radius.median"},
              {"contact.tangential", "regularised with friction, else none", "exponent"}};
  static const char *const unknown[] = {"foo", "stages.twist", "material.youn", "contact.hurtz", ".", "stages."};
  bool found;
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    char *text = printed_keys(rows[i].what, &found);
    assert_true(found);
    assert_non_null(strstr(text, rows[i].has));
    assert_null(strstr(text, rows[i].has_not));
    free(text);
  }
  for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++) {
    free(printed_keys(unknown[i], &found));
    assert_false(found);
  }
}

// EXACT: the JSON Schema is well formed, without a key twice, and says what the table says.
static void test_json_schema(void **state) {
  (void)state;
  char *text = NULL;
  size_t size;
  FILE *out = open_memstream(&text, &size);
  tal_keys_json(out);
  fclose(out);
  tal_tree tree = {0};
  tal_yaml_error error;
  tal_node *root = tal_yaml_parse(&tree, text, size, NULL, &error);
  if (!root)
    print_error("line %d: %s\n", error.line, error.text);
  assert_non_null(root);
  tal_node *young = tal_node_find(root, "properties.material.properties.young");
  assert_string_equal(tal_node_find(young, "exclusiveMinimum")->text, "0");
  assert_string_equal(tal_node_find(root, "properties.seed.default")->text, "1");
  assert_int_equal(tal_node_find(root, "properties.stages.items.allOf")->count, 6);
  assert_int_equal(tal_node_find(root, "properties.walls.items.required")->count, 2);
  tal_tree_clear(&tree);
  free(text);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_design),          cmocka_unit_test(test_defaults),  cmocka_unit_test(test_listed),
      cmocka_unit_test(test_contact_choices), cmocka_unit_test(test_overrides), cmocka_unit_test(test_round_trip),
      cmocka_unit_test(test_layout),          cmocka_unit_test(test_damaged),   cmocka_unit_test(test_locale),
      cmocka_unit_test(test_scalars),         cmocka_unit_test(test_printed),   cmocka_unit_test(test_keys),
      cmocka_unit_test(test_json_schema)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
