// Combinations of keys. Each check looks at what the user wrote (the tree) and at the values read; a value that was
// wrong in itself is NAN, 0 or NULL here and is not complained about twice.
#include "scene_check.h"

#include "radius.h"
#include "scene_value.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct checker {
  const tal_scene *scene;
  tal_node *root;
  tal_report *report;
} checker;

static bool given(const checker *c, const char *path) {
  return tal_node_find(c->root, path) != NULL;
}

static bool named(const char *choice, const char *name) {
  return choice && strcmp(choice, name) == 0;
}

// Reports at the key, or where its nearest parent stands.
static void wrong(const checker *c, const char *path, const char *what) {
  tal_report_add(c->report, tal_node_nearest(c->root, path), path, "%s", what);
}

// Same for a key that is not there; a parent that is no mapping has been complained about.
static void missing(const checker *c, const char *path, const char *what) {
  const tal_node *near = tal_node_nearest(c->root, path);
  if (near->kind == TAL_NODE_MAP)
    tal_report_add(c->report, near, path, "%s", what);
}

// ---- grains and packing ----

static void check_source(const checker *c) {
  const char *method = c->scene->pack.method;
  bool count = given(c, "grains.count"), list = given(c, "grains.list");
  bool file = named(method, "file"), lattice = named(method, "lattice");
  bool unknown = !method && given(c, "pack.method");
  if (count && list)
    wrong(c, "grains.list", "stands beside grains.count; accepted: one of the two");
  else if (file && count)
    wrong(c, "grains.count", "the file says how many grains there are; accepted: no count with pack.method: file");
  else if (lattice && count)
    wrong(c, "grains.count", "columns and rows say how many; accepted: no count with pack.method: lattice");
  else if (count && named(method, "none"))
    wrong(c, "pack.method",
          "'none' leaves grains.count grains without places; accepted: drop_and_roll, or grains.list");
  else if (list && method && !named(method, "none"))
    wrong(c, "pack.method", "listed grains have their places; accepted: none with grains.list");
  else if (!count && !list && !file && !lattice && !unknown)
    missing(c, "grains.count", "is missing; accepted: grains.count, grains.list, or pack.method: lattice or file");
}

static void check_radius_law(const checker *c) {
  const tal_radius *radius = &c->scene->grains.radius;
  tal_error err;
  bool window = radius->law != TAL_RADIUS_SIEVE;
  bool complete = window ? !isnan(radius->min) && !isnan(radius->max) : radius->passing_count && radius->sizes;
  if (radius->law == TAL_RADIUS_LOGNORMAL)
    complete = complete && !isnan(radius->median) && !isnan(radius->sigma);
  if (!complete)
    return;
  char text[200];
  if (window && radius->min > radius->max) {
    snprintf(text, sizeof text, "min %g is larger than max %g; accepted: min <= max", radius->min, radius->max);
    wrong(c, given(c, "grains.radius.min") ? "grains.radius.min" : "grains.radius.max", text);
  } else if (tal_radius_check(radius, &err) != TAL_OK) {
    wrong(c, window ? "grains.radius" : "grains.radius.passing", err.text);
  } else if (named(c->scene->pack.method, "lattice") && isnan(tal_radius_single(radius))) {
    wrong(c, "grains.radius", "a lattice needs equal grains; accepted: {law: uniform, min: R, max: R}");
  }
}

static void check_radius(const checker *c) {
  bool list = given(c, "grains.list"), file = named(c->scene->pack.method, "file");
  bool wanted = given(c, "grains.count") || named(c->scene->pack.method, "lattice");
  if (given(c, "grains.radius")) {
    if (list)
      wrong(c, "grains.radius", "has no effect with grains.list; accepted: r of each grain");
    else if (file)
      wrong(c, "grains.radius", "has no effect with pack.method: file; accepted: the file's column r");
    else
      check_radius_law(c);
  } else if (wanted) {
    missing(c, "grains.radius",
            "is missing; accepted: {law: uniform, min: 0.5e-3, max: 1e-3}, or law: lognormal, sieve");
  }
}

static double largest_radius(const tal_radius *radius) {
  if (radius->law == TAL_RADIUS_SIEVE)
    return radius->passing_count ? radius->passing[radius->passing_count - 1][0] / 2 : nan("");
  return isinf(radius->max) ? radius->median : radius->max;
}

static void check_box(const checker *c) {
  const tal_scene *scene = c->scene;
  double largest = largest_radius(&scene->grains.radius);
  if (!named(scene->pack.method, "drop_and_roll") || !(scene->pack.width < 2 * largest))
    return;
  char text[200];
  snprintf(text, sizeof text, "%g m is too narrow for grains of radius %g m; accepted: at least two radii, better 20",
           scene->pack.width, largest);
  wrong(c, "pack.width", text);
}

static void check_lattice(const checker *c) {
  const tal_scene_pack *pack = &c->scene->pack;
  if (!named(pack->method, "lattice"))
    return;
  if ((double)pack->columns * (double)pack->rows > 1e8)
    wrong(c, "pack.rows", "columns times rows is too large; accepted: at most 100000000 grains");
  double radius = tal_radius_single(&c->scene->grains.radius);
  if (pack->gap <= -2 * radius)
    wrong(c, "pack.gap", "puts grains on top of each other; accepted: a gap > -2 radius");
}

static void check_file(const checker *c) {
  if (!named(c->scene->pack.method, "file") || !c->scene->pack.path)
    return;
  char *path = tal_scene_relative(c->scene, c->scene->pack.path);
  char quoted[128], text[300];
  struct stat info;
  tal_quote(c->scene->pack.path, 120, quoted, sizeof quoted);
  bool there = stat(path, &info) == 0, readable = there && !S_ISDIR(info.st_mode) && access(path, R_OK) == 0;
  snprintf(text, sizeof text, "'%s' %s; accepted: a CSV file with columns x,y,r, relative to the scene file's folder",
           quoted, there ? "cannot be read" : "does not exist");
  if (!readable)
    wrong(c, "pack.path", text);
  free(path);
}

static void check_density(const checker *c) {
  const tal_scene_grains *grains = &c->scene->grains;
  size_t with_mass = 0;
  const tal_node *list = tal_node_find(c->root, "grains.list");
  for (const tal_node *item = list ? list->child : NULL; item; item = item->next)
    with_mass += tal_node_get(item, "mass") != NULL;
  bool needed = !list || with_mass < grains->list_count;
  if (needed && !given(c, "material.density"))
    missing(c, "material.density",
            list ? "is missing, and not every listed grain has a mass; accepted: a number in kg/m^3 > 0"
                 : "is missing; accepted: a number in kg/m^3 > 0");
}

static int64_t grain_total(const tal_scene *scene) {
  if (scene->grains.list_count)
    return (int64_t)scene->grains.list_count;
  if (named(scene->pack.method, "lattice"))
    return scene->pack.columns * scene->pack.rows;
  return scene->grains.count;
}

static int ascending(const void *a, const void *b) {
  int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
  return (x > y) - (x < y);
}

static void check_tracks(const checker *c) {
  const tal_scene_output *output = &c->scene->output;
  int64_t total = grain_total(c->scene);
  char text[160];
  if (!output->track_count)
    return;
  int64_t *sorted = tal_grow(NULL, 0, output->track_count, sizeof *sorted);
  memcpy(sorted, output->tracks, output->track_count * sizeof *sorted);
  qsort(sorted, output->track_count, sizeof *sorted, ascending);
  int64_t last = sorted[output->track_count - 1];
  snprintf(text, sizeof text, "%lld is no grain; accepted: ids from 0 to %lld", (long long)last, (long long)total - 1);
  if (total && last >= total)
    wrong(c, "output.tracks", text);
  for (size_t i = 1; i < output->track_count; i++) {
    if (sorted[i] != sorted[i - 1])
      continue;
    snprintf(text, sizeof text, "%lld is listed twice; accepted: each id once", (long long)sorted[i]);
    wrong(c, "output.tracks", text);
    break;
  }
  free(sorted);
}

// ---- contacts ----

// A stage of unknown kind may have one.
static bool has_rate(const tal_scene *scene) {
  for (size_t s = 0; s < scene->stage_count; s++) {
    const tal_scene_stage *stage = &scene->stages[s];
    if (!stage->kind || named(stage->kind, "compress") || named(stage->kind, "shear") || stage->rate > 0)
      return true;
  }
  return false;
}

// With normal: hertz. A damping of 0 beside it is as good as none, so that --set can change from one to the other.
static void check_restitution(const checker *c) {
  const tal_node *own = tal_node_find(c->root, "contact.restitution");
  if (!own) {
    if (given(c, "contact.restitution_speed"))
      wrong(c, "contact.restitution_speed", "has no effect without contact.restitution; accepted: both or none");
    return;
  }
  if (c->scene->material.damping > 0) {
    const char *remedy = "accepted: one of the two (material.damping: 0 counts as none)";
    const char *path = own->override ? "contact.restitution" : "material.damping";
    const char *other = own->override ? "material.damping" : "contact.restitution";
    tal_report_add(c->report, tal_node_find(c->root, path), path, "stands beside %s; %s", other, remedy);
  }
  if (c->scene->contact.restitution < 1 && !given(c, "contact.restitution_speed") && !given(c, "contact.vR") &&
      !has_rate(c->scene))
    missing(c, "contact.restitution_speed",
            "is missing, and neither contact.vR nor a stage with a rate gives one; accepted: a number in m/s > 0");
}

static void check_normal(const checker *c) {
  const tal_scene *scene = c->scene;
  bool hertz = named(scene->contact.normal, "hertz"), linear = named(scene->contact.normal, "linear");
  if (hertz && !given(c, "material.young"))
    missing(c, "material.young", "is missing (normal: hertz); accepted: a number in Pa > 0");
  if (linear && given(c, "contact.restitution") && given(c, "contact.damping"))
    wrong(c, "contact.damping", "stands beside contact.restitution; accepted: one of the two");
  if (hertz)
    check_restitution(c);
  if (linear && given(c, "material.damping") && scene->material.damping != 0)
    wrong(c, "material.damping", "has no effect with normal: linear; accepted: contact.damping or contact.restitution");
}

static void check_slip_speed(const checker *c) {
  bool regularised = named(c->scene->contact.tangential, "regularised") && tal_scene_any_friction(c->scene);
  if (regularised && !given(c, "contact.vR") && !has_rate(c->scene))
    missing(c, "contact.vR", "is missing, and no stage has a rate to find it from; accepted: a number in m/s > 0");
}

// ---- walls, continuum ----

static void check_wall(const checker *c, const tal_node *node, size_t w) {
  const tal_scene_wall *wall = &c->scene->walls[w];
  char key[64];
  if (wall->from[0] == wall->to[0] && wall->from[1] == wall->to[1]) {
    snprintf(key, sizeof key, "walls[%zu].to", w);
    tal_report_add(c->report, node, key, "is where the wall starts; accepted: a second point");
  }
  if (wall->until_time <= wall->from_time) {
    snprintf(key, sizeof key, "walls[%zu].until_time", w);
    tal_report_add(c->report, node, key, "%g s is not after from_time %g s; accepted: a later time", wall->until_time,
                   wall->from_time);
  }
}

static void check_walls(const checker *c) {
  const tal_node *list = tal_node_get(c->root, "walls");
  const tal_node *node = list ? list->child : NULL;
  for (size_t w = 0; w < c->scene->wall_count; w++, node = node->next)
    check_wall(c, node, w);
}

// ---- integrators ----

// A cycle of two time scales at `key`: P's long step is shorter than the cycle.
static void check_cycle(const checker *c, const tal_node *node, const char *base, const tal_scene_integrator *plan) {
  char key[80], text[200];
  if (!named(plan->scheme, "two_timescale"))
    return;
  if (plan->m < 1 || plan->n < 1) {
    snprintf(key, sizeof key, "%s.%s", base, plan->n < 1 ? "n" : "m");
    tal_report_add(c->report, node, key, "is missing (scheme: two_timescale); accepted: a whole number in [1, 1e+06]");
    return;
  }
  snprintf(key, sizeof key, "%s.n", base);
  snprintf(text, sizeof text,
           "%lld small steps are the whole cycle of m (n + q) = %lld; accepted: n below m (n + q), so q or m larger",
           (long long)plan->n, (long long)(plan->m * (plan->n + plan->q)));
  if (plan->n >= plan->m * (plan->n + plan->q))
    tal_report_add(c->report, node, key, "%s", text);
}

static void check_cycles(const checker *c) {
  const tal_scene_integrator *whole = &c->scene->integrator;
  if (given(c, "integrator.m") && given(c, "integrator.n") && whole->m > 0 && whole->n > 0)
    check_cycle(c, tal_node_nearest(c->root, "integrator.n"), "integrator", whole);
  const tal_node *list = tal_node_get(c->root, "stages");
  const tal_node *node = list ? list->child : NULL;
  for (size_t s = 0; s < c->scene->stage_count; s++, node = node->next) {
    const tal_node *own = tal_node_get(node, "integrator");
    char base[64];
    snprintf(base, sizeof base, "stages[%zu].integrator", s);
    if (own)
      check_cycle(c, own, base, &c->scene->stages[s].integrator);
  }
}

// ---- boundaries ----

typedef struct stage_place {
  const checker *c;
  const tal_node *node;
  size_t index;
} stage_place;

__attribute__((format(printf, 3, 4))) static void wrong_stage(const stage_place *at, const char *key,
                                                              const char *format, ...) {
  char path[80], text[300];
  const tal_node *node = tal_node_find((tal_node *)at->node, key);
  snprintf(path, sizeof path, "stages[%zu].%s", at->index, key);
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  tal_report_add(at->c->report, node ? node : at->node, path, "%s", text);
}

// Keys of minimal boundaries beside another one; keys of one method beside the other.
static void check_method(const stage_place *at, const tal_scene_stage *stage) {
  static const char *const keys[] = {"method", "penalty", "order"};
  bool minimal = named(stage->boundary, "minimal"), exact = named(stage->method, "exact");
  for (int k = 0; k < 3 && stage->boundary && !minimal; k++)
    if (tal_node_get(at->node, keys[k]))
      wrong_stage(at, keys[k], "has no effect with boundary: %s; accepted: only with boundary: minimal",
                  stage->boundary);
  if (stage->boundary && !named(stage->boundary, "membrane") && tal_node_get(at->node, "membrane"))
    wrong_stage(at, "membrane", "has no effect with boundary: %s; accepted: only with boundary: membrane",
                stage->boundary);
  if (minimal && tal_node_get(at->node, "plate_friction"))
    wrong_stage(at, "plate_friction", "has no effect with boundary: minimal; accepted: only with plates");
  if (!minimal || !stage->method)
    return;
  if (exact && tal_node_get(at->node, "penalty"))
    wrong_stage(at, "penalty", "has no effect with method: exact; accepted: only with method: penalty");
  if (!exact && tal_node_get(at->node, "order"))
    wrong_stage(at, "order", "has no effect with method: penalty; accepted: only with method: exact");
}

// A component is imposed or left to a stress, not both.
static void check_components(const stage_place *at) {
  static const char *const pairs[][2] = {{"rates.xx", "stresses.xx"},
                                         {"rates.yy", "stresses.yy"},
                                         {"rates.xy", "stresses.xy"},
                                         {"rates.yx", "stresses.xy"}};
  for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++)
    if (tal_node_find((tal_node *)at->node, pairs[k][0]) && tal_node_find((tal_node *)at->node, pairs[k][1]))
      wrong_stage(at, pairs[k][1], "stands beside %s; accepted: one of the two", pairs[k][0]);
}

// Grains that are there and free to turn; a plan of many is the last stage.
static void check_spin(const stage_place *at, const tal_scene_stage *stage) {
  const tal_scene *scene = at->c->scene;
  const int64_t total = isnan(scene->pack.cut_radius) ? grain_total(scene) : 0;
  if (!scene->rotation)
    wrong_stage(at, "kind", "spin has no effect with rotation: false; accepted: rotation: true");
  if (stage->omega == 0)
    wrong_stage(at, "omega", "is zero; accepted: a number in rad/s that is not 0");
  for (size_t k = 0; k < stage->grain.count; k++) {
    const int64_t id = stage->grain.ids[k];
    if (total && id >= total)
      wrong_stage(at, "grain", "%lld is no grain; accepted: ids from 0 to %lld", (long long)id, (long long)total - 1);
    else if (total && scene->grains.list_count && scene->grains.list[id].fixed)
      wrong_stage(at, "grain", "%lld is a fixed grain: it keeps its spin; accepted: grains that are free",
                  (long long)id);
  }
  if ((stage->grain.many || stage->grain.random) && at->index + 1 < scene->stage_count)
    wrong_stage(at, "grain", "forces many grains, each in a run of its own; accepted: in the last stage only");
}

static void check_boundaries(const checker *c) {
  const tal_node *list = tal_node_get(c->root, "stages");
  const tal_node *node = list ? list->child : NULL;
  for (size_t s = 0; s < c->scene->stage_count; s++, node = node->next) {
    const tal_scene_stage *stage = &c->scene->stages[s];
    const stage_place at = {c, node, s};
    if (node->kind != TAL_NODE_MAP)
      continue;
    check_method(&at, stage);
    if (named(stage->kind, "deform"))
      check_components(&at);
    if (named(stage->kind, "spin"))
      check_spin(&at, stage);
    if (named(stage->kind, "shear") && stage->rate == 0)
      wrong_stage(&at, "rate", "is zero; accepted: a number in 1/s that is not 0");
  }
}

static void check_cut(const checker *c) {
  const tal_scene_pack *pack = &c->scene->pack;
  if (pack->cut_shape != TAL_CUT_POLYGON || pack->cut_point_count < 3)
    return;
  double twice = 0;
  for (size_t k = 0; k < pack->cut_point_count; k++) {
    const double *a = pack->cut_points[k], *b = pack->cut_points[(k + 1) % pack->cut_point_count];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  if (twice == 0)
    wrong(c, "pack.cut.points", "enclose no area; accepted: corners of a polygon in order");
}

static void check_refresh(const checker *c) {
  const tal_node *refresh = tal_node_find(c->root, "continuum.refresh");
  if (refresh && refresh->kind == TAL_NODE_MAP && refresh->count != 1)
    wrong(c, "continuum.refresh", "needs one criterion; accepted: strain or displacement, or a whole number of steps");
}

void tal_scene_check(const tal_scene *scene, tal_node *root, tal_report *report) {
  checker c = {scene, root, report};
  check_source(&c);
  check_radius(&c);
  check_box(&c);
  check_lattice(&c);
  check_file(&c);
  check_density(&c);
  check_tracks(&c);
  check_normal(&c);
  check_slip_speed(&c);
  check_walls(&c);
  check_refresh(&c);
  check_cycles(&c);
  check_cut(&c);
  check_boundaries(&c);
}
