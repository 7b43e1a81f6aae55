// Bad scenes: the line, the key and the words of each message. One table of small changes to a good scene, one of
// --set, one of whole files.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "scene_files.h"

#include <time.h>

static const char *const good[] = {
    /* 1 */ "name: base",
    /* 2 */ "grains: {count: 100, radius: {law: uniform, min: 0.5e-3, max: 1.0e-3}}",
    /* 3 */ "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}",
    /* 4 */ "contact: {normal: hertz, tangential: regularised, exponent: 20}",
    /* 5 */ "pack: {method: drop_and_roll, width: 60e-3}",
    /* 6 */ "integrator: {scheme: verlet, dt: 1e-5}",
    /* 7 */ "stages:",
    /* 8 */ "  - {kind: confine, pressure: 100e3}",
    /* 9 */ "  - {kind: compress, rate: 5e-3, strain: 0.20}",
    /* 10 */ "output: {tracks: []}"};

enum { LINES = sizeof good / sizeof *good };

typedef struct bad_line {
  int replaced; // line of the good scene put aside for `text`
  const char *text;
  int line; // expected in the message
  const char *key;
  const char *words; // expected somewhere behind the key
} bad_line;

#define LISTED  "{list: [{x: 0, y: 0, r: 1e-3}, {x: 3e-3, y: 0, r: 1e-3}]}"
#define WALL    "walls: [{from: [0, 0], to: [1, 0]"
#define EQUAL   "grains: {radius: {law: uniform, min: 1e-3, max: 1e-3}}"
#define LATTICE EQUAL "\npack: {method: lattice, columns: 4"

static const bad_line bad_lines[] = {
    // unknown keys
    {1, "nmae: base", 1, "nmae", "did you mean 'name'? accepted: name, seed, grains"},
    {1, "colour: red", 1, "colour", "unknown key; accepted: name, seed"},
    {3, "material: {young: 30e9, density: 2675, frction: 0.45}", 3, "material.frction", "did you mean 'friction'?"},
    {9, "  - {kind: compress, rate: 5e-3, strain: 0.2, speed: 1}", 9, "stages[1].speed", "unknown key"},
    {6, "integrator: {dt: 1e-5, sweeps: 3}", 6, "integrator.sweeps",
     "no effect with scheme: verlet; accepted: only with scheme: implicit_friction"},
    {6, "integrator: {dt: 1e-5, m: 3}", 6, "integrator.m",
     "no effect with scheme: verlet; accepted: only with scheme: two_timescale"},
    {6, "integrator: {scheme: two_timescale, dt: 1e-5, n: 5, q: 5}", 6, "integrator.m",
     "is missing; accepted: a whole"},
    {6, "integrator: {scheme: two_timescale, dt: 1e-5, m: 5, n: 0, q: 5}", 6, "integrator.n", "accepted: a whole"},
    {6, "integrator: {scheme: two_timescale, dt: 1e-5, m: 1, n: 10, q: 0}", 6, "integrator.n",
     "10 small steps are the whole cycle of m (n + q) = 10; accepted: n below m (n + q), so q or m larger"},
    {9, "  - {kind: compress, rate: 5e-3, strain: 0.2, integrator: {scheme: two_timescale}}", 9,
     "stages[1].integrator.n", "is missing (scheme: two_timescale); accepted: a whole number"},
    {6, "integrator: {scheme: implicit_friction, dt: 1e-5, sweeps: 0}", 6, "integrator.sweeps", "accepted: a whole"},
    {6, "integrator: {scheme: implicit_friction, dt: 1e-5, tolerance: 0}", 6, "integrator.tolerance", "> 0"},
    // boundaries
    {9, "  - {kind: compress, rate: 5e-3, strain: 0.2, penalty: 2}", 9, "stages[1].penalty",
     "has no effect with boundary: pressure; accepted: only with boundary: minimal"},
    {9, "  - {kind: compress, rate: 5e-3, strain: 0.2, order: 2}", 9, "stages[1].order", "no effect with boundary"},
    {9, "  - {kind: compress, boundary: minimal, rate: 5e-3, strain: 0.2, penalty: 2}", 9, "stages[1].penalty",
     "no effect with method: exact; accepted: only with method: penalty"},
    {9, "  - {kind: compress, rate: 5e-3, strain: 0.2, membrane: {radius: 1e-3}}", 9, "stages[1].membrane",
     "has no effect with boundary: pressure; accepted: only with boundary: membrane"},
    {9, "  - {kind: compress, boundary: membrane, rate: 5e-3, strain: 0.2, membrane: {stiffness: 0}}", 9,
     "stages[1].membrane.stiffness", "> 0"},
    {9, "  - {kind: compress, boundary: minimal, plate_friction: 0, rate: 5e-3, strain: 0.2}", 9,
     "stages[1].plate_friction", "has no effect with boundary: minimal; accepted: only with plates"},
    {9, "  - {kind: shear, rate: 5e-3, strain: 0.2, method: penalty, order: 1}", 9, "stages[1].order",
     "no effect with method: penalty; accepted: only with method: exact"},
    {9, "  - {kind: shear, rate: 5e-3, strain: 0.2, order: 9}", 9, "stages[1].order", "in [0, 8]"},
    {9, "  - {kind: shear, rate: 0, strain: 0.2}", 9, "stages[1].rate", "is zero; accepted: a number in 1/s"},
    {9, "  - {kind: shear, strain: 0.2}", 9, "stages[1].rate", "is missing"},
    {9, "  - {kind: shear, boundary: pressure, rate: 5e-3, strain: 0.2}", 9, "stages[1].boundary", "kind: compress"},
    {9, "  - {kind: deform, duration: 1, rates: {xx: 1}, stresses: {xx: 1e5}}", 9, "stages[1].stresses.xx",
     "stands beside rates.xx; accepted: one of the two"},
    {9, "  - {kind: deform, duration: 1, rates: {yx: 1}, stresses: {xy: 1e3}}", 9, "stages[1].stresses.xy",
     "stands beside rates.yx; accepted: one of the two"},
    {9, "  - {kind: deform, duration: 1, rates: {yy: 1, zz: 1}}", 9, "stages[1].rates.zz", "accepted: xx, yy, xy, yx"},
    {9, "  - {kind: deform, rates: {xx: 1}}", 9, "stages[1].duration", "is missing"},
    {8, "  - {kind: deform, duration: 1, pressure: 1, rates: {xx: 1}}", 9, "stages[1].pressure",
     "no confine stage comes before"},
    {5, "pack: {width: 60e-3, cut: {shape: polygon}}", 5, "pack.cut.points", "is missing; accepted: a list of"},
    {5, "pack: {width: 60e-3, cut: {shape: polygon, radius: 1, points: [[0, 0], [1, 0], [0, 1]]}}", 5,
     "pack.cut.radius", "has no effect with shape: polygon"},
    {5, "pack: {width: 60e-3, cut: {shape: polygon, points: [[0, 0], [1, 0]]}}", 5, "pack.cut.points", "has 2 items"},
    {5, "pack: {width: 60e-3, cut: {shape: polygon, points: [[0, 0], [1, 1], [2, 2]]}}", 5, "pack.cut.points",
     "enclose no area; accepted: corners of a polygon in order"},
    // choices
    {4, "contact: {normal: hysteretic}", 4, "contact.normal", "'hysteretic' is not known; accepted: hertz, linear"},
    {6, "integrator: {scheme: leapfrog, dt: 1e-5}", 6, "integrator.scheme", "accepted: verlet, two_timescale"},
    {9, "  - {kind: twist, rate: 5e-3, strain: 0.2}", 9, "stages[1].kind", "accepted: free, confine, compress"},
    {9, "  - {kind: compress, boundary: bag, rate: 5e-3, strain: 0.2}", 9, "stages[1].boundary", "pressure"},
    {5, "pack: {method: rain, width: 60e-3}", 5, "pack.method", "'rain' is not known; accepted: "},
    {1, "continuum: {backend: voronoi}", 1, "continuum.backend", "'voronoi' is not known; accepted: "},
    {1, "continuum: {tessellation: voronoi}", 1, "continuum.tessellation", "accepted: delaunay, power"},
    // numbers
    {3, "material: {young: 100kPa, density: 2675}", 3, "material.young",
     "'100kPa' is not a number; accepted: a number in Pa > 0 (write 100e3)"},
    {3, "material: {young: 30 GPa, density: 2675}", 3, "material.young", "(write 30e9)"},
    {5, "pack: {width: 60mm}", 5, "pack.width", "accepted: a number in m > 0 (write 60e-3)"},
    {5, "pack: {width: 60 m}", 5, "pack.width", "(write 60)"},
    {3, "material: {young: 30e9, density: 2675, friction: 45%}", 3, "material.friction", "(write 45e-2)"},
    {3, "material:\n  young: 30e9\n  density: 2675\n  friction: 0,45", 6, "material.friction", "(write 0.45)"},
    {3, "material: {young: 0x10, density: 2675}", 3, "material.young", "'0x10' is not a number"},
    {3, "material: {young: inf, density: 2675}", 3, "material.young", "'inf' is not a number"},
    {3, "material: {young: .inf, density: 2675}", 3, "material.young", "'.inf' is not a finite number"},
    {3, "material: {young: .nan, density: 2675}", 3, "material.young", "'.nan' is not a finite number"},
    {3, "material: {young: 1e999, density: 2675}", 3, "material.young", "'1e999' is too large"},
    {6, "integrator: {dt: 1e-999}", 6, "integrator.dt", "'1e-999' is too small"},
    {3, "material: {young: \"30e9\", density: 2675}", 3, "material.young", "'30e9' is quoted"},
    {3, "material: {young: [30e9], density: 2675}", 3, "material.young", "is a list; accepted: a number in Pa > 0"},
    {3, "material: {young: {E: 1}, density: 2675}", 3, "material.young", "is a mapping"},
    {3, "material: {young: , density: 2675}", 3, "material.young", "has no value"},
    {3, "material: {young: ~, density: 2675}", 3, "material.young", "has no value"},
    {3, "material:\n  density: 2675\n  young:\n    soft", 5, "material.young", "'soft' is not a number"},
    {1, "gravity: [0, -9.81, 0]", 1, "gravity", "accepted: two numbers in m/s^2: [x, y]"},
    {1, "gravity: [0, down]", 1, "gravity[1]", "'down' is not a number"},
    {1, "gravity: 9.81", 1, "gravity", "is not a list of two numbers"},
    // whole numbers, booleans, text
    {2, "grains: {count: 1e4, radius: {min: 5e-4, max: 1e-3}}", 2, "grains.count",
     "'1e4' is not a whole number in digits; accepted: a whole number in [1, 100000000] (write 10000)"},
    {2, "grains: {count: 10.0, radius: {min: 5e-4, max: 1e-3}}", 2, "grains.count", "(write 10)"},
    {2, "grains: {count: many, radius: {min: 5e-4, max: 1e-3}}", 2, "grains.count", "such as 10000"},
    {2, "grains: {count: \"10\", radius: {min: 5e-4, max: 1e-3}}", 2, "grains.count", "'10' is quoted"},
    {2, "grains: {count: 0, radius: {min: 5e-4, max: 1e-3}}", 2, "grains.count", "'0' is out of range"},
    {2, "grains: {count: 200000000, radius: {min: 5e-4, max: 1e-3}}", 2, "grains.count", "out of range"},
    {2, "grains: {count: 99999999999999999999, radius: {min: 5e-4, max: 1e-3}}", 2, "grains.count", "is too large"},
    {1, "seed: -1", 1, "seed", "'-1' is out of range; accepted: a whole number >= 0"},
    {1, "rotation: maybe", 1, "rotation", "'maybe' is not true or false; accepted: true or false"},
    {1, "rotation: yes", 1, "rotation", "'yes' is not true or false"},
    {1, "rotation: 'true'", 1, "rotation", "is quoted"},
    {1, "name: ''", 1, "name", "accepted: a line of text"},
    {1, "name: \"two\\nlines\"", 1, "name", "more than one line"},
    {10, "output: {tracks: [0, 1.5]}", 10, "output.tracks[1]", "'1.5' is not a whole number"},
    {10, "output: {tracks: 3}", 10, "output.tracks", "is not a list"},
    {10, "output: {tracks: [100]}", 10, "output.tracks", "100 is no grain; accepted: ids from 0 to 99"},
    {10, "output: {tracks: [7, 3, 7]}", 10, "output.tracks", "7 is listed twice"},
    // ranges
    {3, "material: {young: 30e9, density: 2675, friction: -0.1}", 3, "material.friction", "accepted: a number >= 0"},
    {3, "material: {young: 30e9, density: 2675, poisson: 0.6}", 3, "material.poisson", "in (-1, 0.5]"},
    {3, "material: {young: 30e9, density: 2675, poisson: -1}", 3, "material.poisson", "in (-1, 0.5]"},
    {3, "material: {young: 0, density: 2675}", 3, "material.young", "'0' is out of range"},
    {6, "integrator: {dt: 0}", 6, "integrator.dt", "accepted: a number in s > 0"},
    {6, "integrator: {dt: -1e-5}", 6, "integrator.dt", "out of range"},
    {9, "  - {kind: compress, rate: 5e-3, strain: 1}", 9, "stages[1].strain", "accepted: a number in (0, 1)"},
    {9, "  - {kind: compress, rate: 0, strain: 0.2}", 9, "stages[1].rate", "accepted: a number in 1/s > 0"},
    {8, "  - {kind: confine, pressure: 0}", 8, "stages[0].pressure", "accepted: a number in Pa > 0"},
    {4, "contact: {exponent: 0.5}", 4, "contact.exponent", "accepted: a number >= 1"},
    {1, "continuum: {peel: 0}", 1, "continuum.peel", "accepted: a number in mean diameters > 0"},
    {1, "continuum: {refresh: 0}", 1, "continuum.refresh", "or a mapping with strain or displacement"},
    {1, "limits: {overlap: 2}", 1, "limits.overlap", "in (0, 1]"},
    {2, "grains: {count: 9, thickness: 0, radius: {min: 5e-4, max: 1e-3}}", 2, "grains.thickness", "> 0"},
    {2, "grains: {count: 9, radius: {min: -5e-4, max: 1e-3}}", 2, "grains.radius.min", "'-5e-4' is out of range"},
    {2, "grains: {count: 9, radius: {min: 2e-3, max: 1e-3}}", 2, "grains.radius.min", "accepted: min <= max"},
    {2, "grains: {count: 9, radius: {law: lognormal, median: 1e-3, sigma: -1}}", 2, "grains.radius.sigma", "[0, 3]"},
    {2, "grains: {count: 9, radius: {law: sieve, sizes: 3, passing: [[2e-3, 50], [1e-3, 90]]}}", 2,
     "grains.radius.passing", "ascend"},
    {2, "grains: {count: 9, radius: {law: sieve, sizes: 3, passing: [[2e-3]]}}", 2, "grains.radius.passing[0]",
     "not a list of two numbers"},
    // missing: the parent's line
    {6, "integrator: {scheme: verlet}", 6, "integrator.dt", "is missing; accepted: a number in s > 0"},
    {6, "seed: 3", 1, "integrator.dt", "is missing"},
    {3, "material: {density: 2675}", 3, "material.young", "is missing (normal: hertz)"},
    {3, "material:\n  young: 30e9", 3, "material.density", "is missing"},
    {2, "grains: {shape: disk}", 2, "grains.count", "is missing; accepted: grains.count, grains.list"},
    {2, "grains: {count: 9}", 2, "grains.radius", "is missing"},
    {2, "grains:\n  count: 9\n  radius: {law: uniform, min: 1e-3}", 4, "grains.radius.max", "is missing"},
    {2, "grains: {count: 9, radius: {law: lognormal, median: 1e-3}}", 2, "grains.radius.sigma", "is missing"},
    {2, "grains: {list: [{x: 0, y: 0}]}\npack: {}", 2, "grains.list[0].r", "is missing"},
    {4, "contact: {normal: linear}\nmaterial: {density: 1}", 4, "contact.stiffness", "accepted: a number in N/m > 0"},
    {5, "pack: {method: drop_and_roll}", 5, "pack.width", "is missing"},
    {5, LATTICE "}", 6, "pack.rows", "is missing"},
    {9, "  - {kind: compress, strain: 0.2}", 9, "stages[1].rate", "is missing"},
    {9, "  - {rate: 5e-3, strain: 0.2}", 9, "stages[1].kind", "is missing; accepted: free, confine, compress"},
    {8, "  - {kind: free, duration: 1}", 9, "stages[1].pressure", "no confine stage comes before"},
    {8, "  - kind: confine\n    ramp: 1", 8, "stages[0].pressure", "is missing"},
    {9, "  - {kind: free}\ncontact: {vR: 1}", 9, "stages[1].duration", "is missing"},
    {1, "walls: [{from: [0, 0]}]", 1, "walls[0].to", "is missing"},
    // impossible combinations
    {4, "contact: {normal: hertz, stiffness: 1e5}", 4, "contact.stiffness",
     "has no effect with normal: hertz; accepted: only with normal: linear"},
    {4, "contact: {normal: hertz, restitution: 0.5}", 3, "material.damping",
     "stands beside contact.restitution; accepted: one of the two (material.damping: 0 counts as none)"},
    {4, "contact: {restitution: 0}\nmaterial: {young: 1e9, density: 1}", 4, "contact.restitution",
     "'0' is out of range; accepted: a number in (0, 1]"},
    {4, "contact: {restitution: 1.01}\nmaterial: {young: 1e9, density: 1}", 4, "contact.restitution",
     "'1.01' is out of range; accepted: a number in (0, 1]"},
    {4, "contact: {restitution: 0.5, restitution_speed: 0}\nmaterial: {young: 1e9, density: 1}", 4,
     "contact.restitution_speed", "'0' is out of range; accepted: a number in m/s > 0"},
    {4, "contact: {restitution: .nan}\nmaterial: {young: 1e9, density: 1}", 4, "contact.restitution",
     "accepted: a number"},
    {4, "contact: {restitution_speed: 1}", 4, "contact.restitution_speed",
     "has no effect without contact.restitution; accepted: both or none"},
    {4, "contact: {normal: linear, stiffness: 1, restitution: 0.5, restitution_speed: 1}\nmaterial: {density: 1}", 4,
     "contact.restitution_speed", "has no effect with normal: linear; accepted: only with normal: hertz"},
    {4, "contact: {tangential: none, exponent: 20}", 4, "contact.exponent", "only with tangential: regularised"},
    {4, "contact: {tangential: none, tangential_ratio: 1}", 4, "contact.tangential_ratio",
     "only with tangential: spring"},
    {4, "contact: {normal: linear, stiffness: 1e5, damping: 1, restitution: 1}\nmaterial: {density: 1}", 4,
     "contact.damping", "stands beside contact.restitution"},
    {4, "contact: {normal: linear, stiffness: 1e5}", 3, "material.damping", "accepted: contact.damping"},
    {9, "  - {kind: free, duration: 1, rate: 5e-3}\ncontact: {vR: 1}", 9, "stages[1].rate", "only with kind: compress"},
    {9, "  - {kind: free, duration: 1, pressure: 1}\ncontact: {vR: 1}", 9, "stages[1].pressure",
     "only with kind: confine or compress"},
    {5, "pack: {width: 60e-3, columns: 3}", 5, "pack.columns", "only with method: lattice"},
    {5, "pack: {method: none}", 5, "pack.method", "without places"},
    {2, "grains: {count: 9, radius: {law: uniform, min: 1e-3, max: 1e-3, median: 1}}", 2, "grains.radius.median",
     "only with law: lognormal"},
    {2, "grains: " LISTED, 5, "pack.method", "accepted: none with grains.list"},
    {5, LATTICE ", rows: 3, gap: -2e-3}", 6, "pack.gap", "accepted: a gap > -2 radius"},
    {5, "pack: {width: 1.5e-3}", 5, "pack.width", "0.0015 m is too narrow for grains of radius 0.001 m"},
    {1, "continuum: {refresh: {strain: 1, displacement: 1}}", 1, "continuum.refresh", "needs one criterion"},
    {1, "continuum: {refresh: {}}", 1, "continuum.refresh", "needs one criterion"},
    {1, WALL "}, {from: [1, 1], to: [1, 1]}]", 1, "walls[1].to", "is where the wall starts"},
    {1, WALL ", until_time: -1}]", 1, "walls[0].until_time", "is not after from_time"},
    {1, WALL ", velocity: [.inf, 0]}]", 1, "walls[0].velocity[0]", "not a finite number"},
    // wrong shapes
    {3, "material: steel", 3, "material", "is not a mapping; accepted: a mapping with young, poisson"},
    {10, "output:", 10, "output", "has no value"},
    {1, "walls: {from: [0, 0]}", 1, "walls", "is a mapping; accepted: a list of mappings"},
    {9, "  - compress", 9, "stages[1]", "is not a mapping"},
    {1, "walls: none", 1, "walls", "is not a list"}};

// The good scene with one line put aside; lines of the good scene whose key the new text brings along go too.
static void compose(const bad_line *bad, char *out, size_t size) {
  *out = '\0';
  for (int line = 1; line <= LINES; line++) {
    size_t used = strlen(out);
    size_t word = strcspn(good[line - 1], ":") + 1;
    char again[40];
    snprintf(again, sizeof again, "\n%.*s", (int)word, good[line - 1]);
    bool replaced = line == bad->replaced, top = good[line - 1][0] != ' ';
    bool brought = top && (strstr(bad->text, again) || strncmp(bad->text, again + 1, word) == 0);
    snprintf(out + used, size - used, "%s\n", replaced ? bad->text : brought ? "" : good[line - 1]);
  }
}

static void expect_message(const tal_scene_errors *errors, const char *place, const char *key, const char *words) {
  char start[600];
  snprintf(start, sizeof start, "%s: %s%s", place, key, *key ? ": " : "");
  for (size_t i = 0; i < errors->count; i++) {
    const char *text = errors->item[i].text;
    if (strncmp(text, start, strlen(start)) == 0 && strstr(text + strlen(start), words))
      return;
  }
  for (size_t i = 0; i < errors->count; i++)
    print_error("  got: %s\n", errors->item[i].text);
  fail_msg("expected '%s ... %s'", start, words);
}

// EXACT: each bad line gives one message with its line and key; nothing is left in the scene.
static void test_bad_lines(void **state) {
  (void)state;
  scene_folder folder = scene_folder_create();
  for (size_t i = 0; i < sizeof bad_lines / sizeof *bad_lines; i++) {
    const bad_line *bad = &bad_lines[i];
    char text[2000], place[460];
    tal_scene scene;
    tal_scene_errors errors;
    compose(bad, text, sizeof text);
    tal_status status = load_text(&folder, text, &scene, &errors);
    snprintf(place, sizeof place, "%s:%d", folder.file, bad->line);
    if (status != TAL_BAD_INPUT)
      print_error("accepted: %s\n", bad->text);
    assert_int_equal(status, TAL_BAD_INPUT);
    expect_message(&errors, place, bad->key, bad->words);
    if (errors.count != 1)
      for (size_t e = 0; e < errors.count; e++)
        print_error("  several: %s\n", errors.item[e].text);
    assert_int_equal(errors.count, 1);
    assert_null(scene.name);
  }
  scene_folder_remove(&folder);
}

typedef struct bad_file {
  const char *text;
  size_t size;
  const char *place; // behind the file name
  const char *words;
} bad_file;

#define FILE_OF(text) text, sizeof(text) - 1

// EXACT: files that are no scene at all, with the line where reading stopped.
static void test_bad_files(void **state) {
  (void)state;
  static const bad_file files[] = {
      {FILE_OF(""), ":1", "empty"},
      {FILE_OF("\n\n# only a comment\n"), ":1", "empty"},
      {FILE_OF("---\n"), ":2", "not a mapping"},
      {FILE_OF("[1, 2]\n"), ":1", "not a mapping"},
      {FILE_OF("just words\n"), ":1", "not a mapping"},
      {FILE_OF("name: a\ngrains: {count: 3\nseed: 1\n"), ":3", "not YAML"},
      {FILE_OF("grains:\n\tcount: 3\n"), ":2", "not tabs"},
      {FILE_OF("name: a\nseed: 1\nname: b\n"), ":3", "'name' is given twice (first in line 1)"},
      {FILE_OF("name: a\nmaterial: &m {young: 1}\n"), ":2", "anchors, aliases and tags"},
      {FILE_OF("name: a\nseed: *s\n"), ":2", "anchors, aliases and tags"},
      {FILE_OF("seed: !!int 3\n"), ":1", "anchors, aliases and tags"},
      {FILE_OF("<<: *base\n"), ":1", "anchors, aliases and tags"},
      {FILE_OF("name: a\n---\nname: b\n"), ":2", "a second document"},
      {FILE_OF("%YAML 1.1\n---\nname: a\n"), ":1", "directives"},
      {FILE_OF("name: a\nseed: \0\n"), ":2", "not plain text"},
      {FILE_OF("name: \"a\\0b\"\n"), ":1", "NUL character"},
      {FILE_OF("name: a\nseed: \xff\xfe\n"), ":2", "not plain text"},
      {FILE_OF("? [a, b]\n: 3\n"), ":1", "a key that is a list"}};
  scene_folder folder = scene_folder_create();
  for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
    char place[460];
    tal_scene scene;
    tal_scene_errors errors;
    scene_folder_write(&folder, files[i].text, files[i].size);
    assert_int_equal(tal_scene_load(&scene, folder.file, NULL, 0, &errors), TAL_BAD_INPUT);
    snprintf(place, sizeof place, "%s%s", folder.file, files[i].place);
    assert_int_equal(errors.count, 1);
    expect_message(&errors, place, "", files[i].words);
  }
  scene_folder_remove(&folder);
}

// EXACT: a file that is not there, a folder.
static void test_unreadable(void **state) {
  (void)state;
  scene_folder folder = scene_folder_create();
  tal_scene scene;
  tal_scene_errors errors;
  assert_int_equal(tal_scene_load(&scene, folder.file, NULL, 0, &errors), TAL_BAD_INPUT);
  expect_message(&errors, folder.file, "", "cannot be read: No such file");
  assert_int_equal(tal_scene_load(&scene, folder.path, NULL, 0, &errors), TAL_BAD_INPUT);
  expect_message(&errors, folder.path, "", "cannot be read: it is a folder");
  scene_folder_remove(&folder);
}

// EXACT: a packing file that is missing is named by its key, relative to the scene's folder; one that is there is
// found.
static void test_packing_file(void **state) {
  (void)state;
  scene_folder folder = scene_folder_create();
  const char *text =
      "material: {young: 1e9, density: 1}\npack: {method: file, path: grains.csv}\nintegrator: {dt: 1e-6}\n";
  char csv[460], place[460];
  tal_scene scene;
  tal_scene_errors errors;
  assert_int_equal(load_text(&folder, text, &scene, &errors), TAL_BAD_INPUT);
  snprintf(place, sizeof place, "%s:2", folder.file);
  expect_message(&errors, place, "pack.path", "'grains.csv' does not exist");
  snprintf(csv, sizeof csv, "%s/grains.csv", folder.path);
  FILE *file = fopen(csv, "w");
  assert_non_null(file);
  fclose(file);
  assert_int_equal(load_text(&folder, text, &scene, &errors), TAL_OK);
  char *found = tal_scene_relative(&scene, scene.pack.path);
  assert_string_equal(found, csv);
  free(found);
  tal_scene_clear(&scene);
  unlink(csv);
  scene_folder_remove(&folder);
}

// EXACT: many errors come in the order of the file, the first ten of them; --set comes last.
static void test_order(void **state) {
  (void)state;
  scene_folder folder = scene_folder_create();
  tal_scene scene;
  tal_scene_errors errors;
  char text[2000] = "stages:\n";
  for (int i = 0; i < 12; i++)
    strcat(text, "  - {kind: free, duration: -1}\n");
  strcat(text, "seed: x\n");
  const char *set = "gravity=down";
  scene_folder_write(&folder, text, strlen(text));
  assert_int_equal(tal_scene_load(&scene, folder.file, &set, 1, &errors), TAL_BAD_INPUT);
  assert_int_equal(errors.count, 10);
  int last = 0;
  for (size_t i = 0; i < errors.count; i++) {
    int line = atoi(errors.item[i].text + strlen(folder.file) + 1);
    assert_true(line >= last && line <= 11);
    last = line;
  }
  strcpy(text, "seed: x\nrotation: no\nintegrator: {dt: 1}\n");
  assert_int_equal(load_text(&folder, text, &scene, &errors), TAL_BAD_INPUT);
  assert_non_null(strstr(errors.item[errors.count - 1].text, ":2: rotation: "));
  assert_int_equal(tal_scene_load(&scene, folder.file, &set, 1, &errors), TAL_BAD_INPUT);
  assert_int_equal(strncmp(errors.item[errors.count - 1].text, "--set gravity=down: gravity: ", 29), 0);
  scene_folder_remove(&folder);
}

// EXACT: --set names itself and the key.
static void test_bad_overrides(void **state) {
  (void)state;
  static const struct {
    const char *set, *key, *words;
  } rows[] = {{"material.young=100kPa", "material.young", "(write 100e3)"},
              {"material.yuong=1", "material.yuong", "did you mean 'young'?"},
              {"foo.bar.baz=1", "foo", "unknown key"},
              {"stages.2.strain=0.1", "stages", "has 2 items; accepted: an index from 0 to 1"},
              {"stages.strain=0.1", "stages", "is a list; accepted: an index, such as stages.0.strain"},
              {"walls.0.friction=0", "walls", "accepted: the whole list, walls=[...]"},
              {"stages.1.strain=2", "stages[1].strain", "accepted: a number in (0, 1)"},
              {"stages[1].strain=2", "stages[1].strain", "accepted: a number in (0, 1)"},
              {"stages=", "stages", "has no value"},
              {"stages", "", "names no key; accepted: KEY=VALUE"},
              {"=3", "", "names no key"},
              {"a..b=3", "", "is not a key"},
              {"seed.=3", "", "is not a key"},
              {"seed=[1", "seed", "not YAML"},
              {"seed=*a", "seed", "anchors"},
              {"seed=1\n---\n2", "seed", "a second document"},
              {"material.young.x=1", "material.young", "is a mapping; accepted: a number"},
              {"contact.normal=linear", "", ""},
              {"contact.restitution=0.5", "contact.restitution",
               "stands beside material.damping; accepted: one of the two (material.damping: 0 counts as none)"},
              {"pack.width=0.5e-3", "pack.width", "too narrow"}};
  scene_folder folder = scene_folder_create();
  char text[2000];
  compose(&(bad_line){.replaced = 0, .text = ""}, text, sizeof text);
  scene_folder_write(&folder, text, strlen(text));
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    tal_scene scene;
    tal_scene_errors errors;
    char place[200], *newline;
    assert_int_equal(tal_scene_load(&scene, folder.file, &rows[i].set, 1, &errors), TAL_BAD_INPUT);
    snprintf(place, sizeof place, "--set %s", rows[i].set);
    while ((newline = strchr(place, '\n')))
      *newline = '?';
    if (*rows[i].words)
      expect_message(&errors, place, rows[i].key, rows[i].words);
    for (size_t e = 0; e < errors.count; e++)
      assert_null(strchr(errors.item[e].text, '\n'));
  }
  scene_folder_remove(&folder);
}

static double seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// EXACT: hostile files are refused within a second each: 100 kB of '[' and of "- ", a scalar of 4 MB, a mapping of
// 100,000 keys.
static void test_bombs(void **state) {
  (void)state;
  scene_folder folder = scene_folder_create();
  size_t size = 4 << 20;
  char *text = tal_alloc(size + 1, 1);
  static const char *const units[] = {"[", "- ", "{a: ", "? ", "x", "a%05d: 1\n"};
  for (size_t u = 0; u < sizeof units / sizeof *units; u++) {
    size_t most = u == 4 ? size : 100000, used = 0;
    for (int i = 0; used + 10 < most; i++) {
      char unit[16];
      snprintf(unit, sizeof unit, units[u], i);
      memcpy(text + used, unit, strlen(unit));
      used += strlen(unit);
    }
    scene_folder_write(&folder, text, used);
    tal_scene scene;
    tal_scene_errors errors;
    double start = seconds();
    assert_int_equal(tal_scene_load(&scene, folder.file, NULL, 0, &errors), TAL_BAD_INPUT);
    assert_true(seconds() - start < 1);
    for (size_t e = 0; e < errors.count; e++)
      assert_true(strlen(errors.item[e].text) < sizeof errors.item[e].text - 1);
  }
  free(text);
  scene_folder_remove(&folder);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_bad_lines),  cmocka_unit_test(test_bad_files),
                                     cmocka_unit_test(test_unreadable), cmocka_unit_test(test_packing_file),
                                     cmocka_unit_test(test_order),      cmocka_unit_test(test_bad_overrides),
                                     cmocka_unit_test(test_bombs)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
