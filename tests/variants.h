// A small scene for everything that a scene can choose by name: enumerated from the schema, whose choices come from the
// registries (src/registry.h). A new variant is here by itself where its name in place of the scene's is enough; else
// it needs a line of `needs`, and the test fails that asks for its scene until there is one.
#ifndef TAL_TEST_VARIANTS_H
#define TAL_TEST_VARIANTS_H

#include "scene_walk.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

// Sixteen grains between plates: confined, then compressed; every kind of output.
static const char variants_scene[] =
    "name: tiny\n"
    "grains: {count: 16, radius: {law: uniform, min: 0.5e-3, max: 1.0e-3}, thickness: 1.5e-3}\n"
    "material: {young: 30e9, poisson: 0.3, density: 2675, friction: 0.45, damping: 0.002}\n"
    "mass_scaling: 1e5\n"
    "contact: {normal: hertz, tangential: regularised}\n"
    "pack: {method: drop_and_roll, width: 6e-3}\n"
    "continuum: {refresh: 70}\n"
    "integrator: {dt: 1e-5}\n"
    "stages:\n"
    "  - {kind: confine, pressure: 100e3, ramp: 1e-3, friction: 0.1, tolerance: 0.9, unbalanced: 100}\n"
    "  - {kind: compress, rate: 0.1, strain: 0.0001}\n"
    "output: {series_every: 2e-4, fields_every: 7e-4, checkpoint_every: 5e-4, tracks: [1, 2]}\n";

// For pack.method: file.
static const char variants_grains[] = "x,y,r\n0,1e-3,1e-3\n1.9999e-3,1e-3,1e-3\n3.9998e-3,1e-3,1e-3\n"
                                      "1e-3,2.732e-3,1e-3\n3e-3,2.732e-3,1e-3\n2e-3,4.464e-3,1e-3\n";

enum { VARIANT_SETS = 8, VARIANTS_MOST = 100 };

typedef struct variant {
  char path[84]; // of the key, without indices: "stages.boundary"
  const char *choice;
  char set[120];                   // the choice itself as --set=..., unless `needs` has a line
  const char *sets[VARIANT_SETS];  // ended by NULL
  const char *large[VARIANT_SETS]; // what more makes so many grains that threads share the loops
} variant;

#define FREE                                                                                                           \
  "--set=stages=[{kind: free, duration: 1e-3}, {kind: free, duration: 1e-3}]", "--set=contact={tangential: spring}",   \
      "--set=gravity=[1, -9]", "--set=walls=[{from: [-1, 0], to: [1, 0]}]"
#define EQUAL   "--set=grains={radius: {law: uniform, min: 1e-3, max: 1e-3}, thickness: 1.5e-3}"
#define MORE    "--set=grains.count=30", "--set=pack.width=9e-3"
#define LATTICE "--set=pack.columns=28", "--set=pack.rows=26"
#define SCHEME  "{scheme: two_timescale, dt: 1e-5, m: 1, n: 4, q: 3}"
#define SQUARE  "[[-4e-3, -4e-3], [4e-3, -4e-3], [4e-3, 4e-3], [-4e-3, 4e-3]]"
#define LARGE   "--set=grains.count=720", "--set=pack.width=38e-3"

static const struct {
  const char *path, *choice, *sets[VARIANT_SETS], *large[VARIANT_SETS];
} needs[] = {
    {"grains.radius.law", "lognormal", {"--set=grains.radius={law: lognormal, median: 0.7e-3, sigma: 0.2}"}, {LARGE}},
    {"grains.radius.law",
     "sieve",
     {"--set=grains.radius={law: sieve, passing: [[1e-3, 0], [2e-3, 100]], sizes: 4}"},
     {LARGE}},
    {"contact.normal",
     "linear",
     {"--set=contact={normal: linear, stiffness: 1e7, restitution: 0.3}",
      "--set=material={density: 2675, friction: 0.45}"},
     {LARGE}},
    {"pack.method", "lattice", {EQUAL, "--set=pack={method: lattice, columns: 4, rows: 4}"}, {LATTICE}},
    {"pack.method",
     "file",
     {"--set=grains={thickness: 1.5e-3}", "--set=pack={method: file, path: grains.csv}"},
     {NULL}},
    {"pack.method",
     "none",
     {FREE,
      "--set=grains={list: [{x: 0, y: 0.999e-3, r: 1e-3}, {x: 1.999e-3, y: 0.999e-3, r: 1e-3, omega: 9}, "
      "{x: 1e-3, y: 2.73e-3, r: 1e-3, vx: 0.1}]}",
      "--set=pack={method: none}"},
     {NULL}},
    {"pack.pattern", "triangular", {EQUAL, "--set=pack={method: lattice, columns: 4, rows: 4}"}, {LATTICE}},
    {"pack.pattern",
     "square",
     {EQUAL, "--set=pack={method: lattice, pattern: square, columns: 4, rows: 4}"},
     {LATTICE}},
    {"pack.cut.shape", "circle", {MORE, "--set=pack.cut={shape: circle, radius: 4e-3}"}, {NULL}},
    {"pack.cut.shape", "polygon", {MORE, "--set=pack.cut={shape: polygon, points: " SQUARE "}"}, {NULL}},
    {"integrator.scheme", "two_timescale", {"--set=integrator=" SCHEME}, {LARGE}},
    {"stages.integrator.scheme", "two_timescale", {"--set=stages.1.integrator=" SCHEME}, {LARGE}},
    {"stages.kind", "free", {FREE}, {LARGE}},
    {"stages.kind", "confine", {NULL}, {LARGE}},
    {"stages.kind", "compress", {NULL}, {LARGE}},
    {"stages.kind", "shear", {"--set=stages.1={kind: shear, rate: 0.1, strain: 1e-4}"}, {LARGE}},
    {"stages.kind", "deform", {"--set=stages.1={kind: deform, rates: {yy: -0.1}, duration: 1e-3}"}, {LARGE}},
    {"stages.kind",
     "spin",
     {"--set=stages.1={kind: spin, omega: 1, ramp: 5e-4, hold: 5e-4}", "--set=contact.vR=1e-4"},
     {LARGE}},
    // a bed that is hardly confined has a slope under the plate, along which a membrane slips in for ever
    {"stages.boundary",
     "membrane",
     {"--set=stages.1.boundary=membrane", EQUAL, "--set=pack={method: lattice, columns: 4, rows: 4}"},
     {LATTICE}},
    {"stages.method", "penalty", {"--set=stages.1.boundary=minimal", "--set=stages.1.method=penalty"}, {LARGE}},
    {"stages.method", "exact", {"--set=stages.1.boundary=minimal", "--set=stages.1.order=1"}, {LARGE}},
};

static inline void variants_fill(variant *v) {
  static const char *const large[VARIANT_SETS] = {LARGE};
  const bool in_stage = strncmp(v->path, "stages.", 7) == 0;
  snprintf(v->set, sizeof v->set, "--set=%s%.60s=%.40s", in_stage ? "stages.1." : "", in_stage ? v->path + 7 : v->path,
           v->choice);
  memcpy(v->large, large, sizeof large);
  v->sets[0] = v->set;
  for (size_t k = 0; k < sizeof needs / sizeof *needs; k++) {
    if (strcmp(needs[k].path, v->path) != 0 || strcmp(needs[k].choice, v->choice) != 0)
      continue;
    memcpy(v->sets, needs[k].sets, sizeof v->sets);
    memcpy(v->large, needs[k].large, sizeof v->large);
  }
}

static inline size_t variants_add(variant *list, size_t count, const tal_key *keys, const char *prefix) {
  for (const tal_key *key = keys; key->name; key++) {
    char path[84], inside[88];
    snprintf(path, sizeof path, "%.50s%.30s", prefix, key->name);
    snprintf(inside, sizeof inside, "%s.", path);
    tal_choice choices[TAL_CHOICES];
    const size_t found = key->type == TAL_KEY_CHOICE ? key->choices(choices, TAL_CHOICES) : 0;
    for (size_t c = 0; c < found && count < VARIANTS_MOST; c++, count++) {
      list[count] = (variant){.choice = choices[c].name};
      snprintf(list[count].path, sizeof list[count].path, "%s", path);
    }
    if (key->type == TAL_KEY_GROUP || key->type == TAL_KEY_LIST)
      count = variants_add(list, count, key->keys, inside);
  }
  return count;
}

// Every variant there is; returns their number.
static inline size_t variants_list(variant list[VARIANTS_MOST]) {
  const size_t count = variants_add(list, 0, tal_schema(), "");
  for (size_t k = 0; k < count; k++)
    variants_fill(&list[k]);
  return count;
}

// Has the scene (or a list's item in it) the choice at `path`?
static inline bool variant_held(const tal_key *keys, const char *base, const char *path, const char *choice) {
  for (const tal_key *key = keys; key->name; key++) {
    const size_t length = strlen(key->name);
    if (strncmp(path, key->name, length) != 0 || (path[length] && path[length] != '.') ||
        !tal_walk_exists(key, keys, NULL, base))
      continue;
    const char *rest = path + length + (path[length] == '.');
    if (key->type == TAL_KEY_CHOICE && !*rest) {
      const char *name = tal_walk_chosen(key, base + key->offset);
      return name && strcmp(name, choice) == 0;
    }
    if (key->type == TAL_KEY_GROUP)
      return variant_held(key->keys, base + key->offset, rest, choice);
    if (key->type != TAL_KEY_LIST)
      continue;
    const char *items;
    size_t count;
    bool held = false;
    memcpy(&items, base + key->offset, sizeof items);
    memcpy(&count, base + key->count_offset, sizeof count);
    for (size_t k = 0; k < count; k++)
      held |= variant_held(key->keys, items + k * key->item_size, rest, choice);
    return held;
  }
  return false;
}

#endif
