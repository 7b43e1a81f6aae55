// Defaults that depend on other keys. What stays NAN here is found by the engine: thickness, vR, the tangential ratio,
// the material's values on walls.
#include "delaunay.h"
#include "registry.h"
#include "scene_check.h"
#include "scene_schema.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *named(const char *name, size_t (*choices)(tal_choice *out, size_t capacity)) {
  const tal_key key = {.choices = choices};
  const char *found = NULL;
  tal_key_choice(&key, name, &found);
  return found;
}

bool tal_scene_any_friction(const tal_scene *scene) {
  bool any = scene->material.friction > 0;
  for (size_t w = 0; w < scene->wall_count; w++)
    any = any || scene->walls[w].friction > 0;
  for (size_t s = 0; s < scene->stage_count; s++)
    any = any || scene->stages[s].friction > 0 || scene->stages[s].plate_friction > 0;
  return any;
}

// A key of the regularised law or of the spring asks for that law.
static void resolve_tangential(tal_scene *scene, tal_node *root) {
  bool regularised =
      tal_scene_any_friction(scene) || tal_node_find(root, "contact.exponent") || tal_node_find(root, "contact.vR");
  const char *name = regularised ? "regularised" : "none";
  if (tal_node_find(root, "contact.tangential_ratio"))
    name = "spring";
  if (!tal_node_find(root, "contact.tangential"))
    scene->contact.tangential = named(name, tal_tangential_law_choices);
}

static void resolve_pack_method(tal_scene *scene, tal_node *root) {
  bool list = tal_node_find(root, "grains.list"), count = tal_node_find(root, "grains.count");
  if (tal_node_find(root, "pack.method") || (!list && !count))
    return;
  scene->pack.method = named(list ? "none" : "drop_and_roll", tal_packer_choices);
}

static void resolve_continuum(tal_scene *scene, tal_node *root) {
  const geo_delaunay_backend *best = geo_delaunay_backend_find("cgal");
  if (!best)
    best = geo_delaunay_backend_find("qhull");
  if (!tal_node_find(root, "continuum.backend") && best)
    scene->continuum.backend = best->name;
}

static void resolve_stage_integrator(const tal_scene *scene, tal_scene_stage *stage, tal_node *node) {
  tal_scene_integrator own = stage->integrator;
  stage->integrator = scene->integrator;
  if (own.scheme)
    stage->integrator.scheme = own.scheme;
  if (!isnan(own.dt))
    stage->integrator.dt = own.dt;
  if (tal_node_find(node, "integrator.force"))
    stage->integrator.force = own.force;
  if (own.m > 0)
    stage->integrator.m = own.m;
  if (own.n > 0)
    stage->integrator.n = own.n;
  if (tal_node_find(node, "integrator.q"))
    stage->integrator.q = own.q;
  if (own.sweeps > 0)
    stage->integrator.sweeps = own.sweeps;
  if (stage->integrator.sweeps < 1)
    stage->integrator.sweeps = 2;
  if (!isnan(own.tolerance))
    stage->integrator.tolerance = own.tolerance;
}

// A polygon reaches as far as its furthest corner.
static void resolve_cut(tal_scene *scene) {
  tal_scene_pack *pack = &scene->pack;
  for (size_t k = 0; pack->cut_shape == TAL_CUT_POLYGON && k < pack->cut_point_count; k++)
    pack->cut_radius = fmax(pack->cut_radius, hypot(pack->cut_points[k][0], pack->cut_points[k][1]));
}

// Shear and deform know no boundary but the minimal one; method and order belong to it.
static void resolve_boundary(tal_scene_stage *stage, const tal_node *node) {
  const char *kind = stage->kind ? stage->kind : "";
  bool deforms = tal_word_among(kind, "shear deform spin");
  if (deforms)
    stage->boundary = named("minimal", tal_boundary_choices);
  const double none = nan("");
  if (!stage->boundary || strcmp(stage->boundary, "membrane") != 0)
    stage->membrane = (tal_scene_membrane){none, none, none, none, none};
  bool minimal = stage->boundary && strcmp(stage->boundary, "minimal") == 0;
  if (!minimal) {
    stage->method = NULL;
    stage->order = -1;
    return;
  }
  if (!tal_node_get(node, "method"))
    stage->method = named("exact", tal_method_choices);
  if (!tal_node_get(node, "order"))
    stage->order = strcmp(stage->method ? stage->method : "exact", "exact") == 0 ? 0 : -1;
  const tal_scene_rates *rates = &stage->rates;
  if (strcmp(kind, "deform") == 0)
    stage->rate = fmax(fmax(fabs(rates->xx), fabs(rates->yy)), fmax(fabs(rates->xy), fabs(rates->yx)));
}

static void resolve_stages(tal_scene *scene, tal_node *root, tal_report *report) {
  const tal_node *list = tal_node_get(root, "stages");
  tal_node *node = list ? list->child : NULL;
  double pressure = nan("");
  bool confined = false;
  for (size_t s = 0; s < scene->stage_count; s++, node = node->next) {
    tal_scene_stage *stage = &scene->stages[s];
    const char *kind = stage->kind ? stage->kind : "";
    stage->line = node->override ? 0 : node->line;
    resolve_stage_integrator(scene, stage, node);
    if (strcmp(kind, "confine") == 0) {
      pressure = stage->pressure;
      confined = true;
      if (!tal_node_get(node, "timeout"))
        stage->timeout = 20 * stage->ramp + 20;
    }
    resolve_boundary(stage, node);
    if (!tal_word_among(kind, "compress shear deform spin") || tal_node_get(node, "pressure"))
      continue;
    stage->pressure = pressure;
    char key[64];
    snprintf(key, sizeof key, "stages[%zu].pressure", s);
    if (!confined && strcmp(kind, "spin") == 0)
      stage->boundary = stage->method = NULL; // nothing presses
    else if (!confined)
      tal_report_add(report, node, key,
                     "is missing and no confine stage comes before; accepted: a number in Pa > 0, or a confine stage");
  }
}

void tal_scene_resolve(tal_scene *scene, tal_node *root, tal_report *report) {
  resolve_tangential(scene, root);
  resolve_pack_method(scene, root);
  resolve_continuum(scene, root);
  resolve_cut(scene);
  resolve_stages(scene, root, report);
  if (isnan(scene->contact.restitution))
    scene->contact.damping = isnan(scene->contact.damping) ? 0 : scene->contact.damping;
  else if (scene->contact.normal && !strcmp(scene->contact.normal, "hertz") && scene->material.damping == 0)
    scene->material.damping = nan(""); // else the check complains
}
