// Packers by name, the cut, and the grains made from a packing.
#include "pack_methods.h"
#include "registry.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const tal_packer *const packers[] = {&tal_packer_drop_and_roll, &tal_packer_lattice, &tal_packer_file,
                                            &tal_packer_list};
enum { PACKERS = sizeof packers / sizeof *packers };

const tal_packer *tal_packer_find(const char *name) {
  for (size_t k = 0; k < PACKERS; k++)
    if (strcmp(packers[k]->name, name) == 0)
      return packers[k];
  return NULL;
}

size_t tal_packer_choices(tal_choice *out, size_t capacity) {
  size_t count = 0;
  for (; count < PACKERS && count < capacity; count++)
    out[count] = (tal_choice){packers[count]->name, packers[count]->help};
  return count;
}

tal_status tal_pack_fail(const tal_scene *scene, int line, const char *key, tal_error *err, const char *format, ...) {
  tal_error said;
  va_list args;
  va_start(args, format);
  vsnprintf(said.text, sizeof said.text, format, args);
  va_end(args);
  const char *path = scene->path ? scene->path : "scene";
  if (line > 0)
    return tal_fail(err, TAL_BAD_INPUT, "%s:%d: %s: %s", path, line, key, said.text);
  return tal_fail(err, TAL_BAD_INPUT, "%s: %s: %s", path, key, said.text);
}

void tal_packing_init(tal_packing *packing, size_t count) {
  *packing = (tal_packing){.count = count, .width = (double)NAN};
  packing->x = tal_alloc(count, sizeof *packing->x);
  packing->y = tal_alloc(count, sizeof *packing->y);
  packing->r = tal_alloc(count, sizeof *packing->r);
  packing->solid_fraction = packing->coordination = (double)NAN;
}

void tal_packing_clear(tal_packing *packing) {
  free(packing->x);
  free(packing->y);
  free(packing->r);
  free(packing->vx);
  free(packing->vy);
  free(packing->omega);
  free(packing->mass);
  free(packing->inertia);
  free(packing->fixed);
  *packing = (tal_packing){0};
}

// Array of `count` values `absent` when there is none yet.
static double *optional(double *array, size_t count, double absent) {
  if (array)
    return array;
  array = tal_alloc(count, sizeof *array);
  for (size_t i = 0; i < count; i++)
    array[i] = absent;
  return array;
}

void tal_packing_extras(tal_packing *packing, size_t i, const tal_packed_extras *extras) {
  size_t n = packing->count;
  if (extras->vx != 0)
    (packing->vx = optional(packing->vx, n, 0))[i] = extras->vx;
  if (extras->vy != 0)
    (packing->vy = optional(packing->vy, n, 0))[i] = extras->vy;
  if (extras->omega != 0)
    (packing->omega = optional(packing->omega, n, 0))[i] = extras->omega;
  if (!isnan(extras->mass))
    (packing->mass = optional(packing->mass, n, (double)NAN))[i] = extras->mass;
  if (!isnan(extras->inertia))
    (packing->inertia = optional(packing->inertia, n, (double)NAN))[i] = extras->inertia;
  if (extras->fixed && !packing->fixed)
    packing->fixed = tal_alloc(n, 1);
  if (extras->fixed)
    packing->fixed[i] = 1;
}

typedef struct centre {
  double x, y;
  size_t i;
} centre;

static int compare_centres(const void *left, const void *right) {
  const centre *a = left, *b = right;
  if (a->x != b->x)
    return a->x < b->x ? -1 : 1;
  if (a->y != b->y)
    return a->y < b->y ? -1 : 1;
  return a->i < b->i ? -1 : a->i > b->i;
}

bool tal_packing_coincident(const tal_packing *packing, size_t *first, size_t *second) {
  size_t n = packing->count;
  centre *sorted = tal_alloc(n, sizeof *sorted);
  for (size_t i = 0; i < n; i++)
    sorted[i] = (centre){packing->x[i], packing->y[i], i};
  qsort(sorted, n, sizeof *sorted, compare_centres);
  bool found = false;
  for (size_t k = 1; k < n; k++) {
    const centre *a = &sorted[k - 1], *b = &sorted[k];
    if (a->x != b->x || a->y != b->y || (found && a->i > *first))
      continue;
    if (found && a->i == *first && b->i > *second)
      continue;
    *first = a->i;
    *second = b->i;
    found = true;
  }
  free(sorted);
  return found;
}

static void keep_grain(tal_packing *packing, size_t to, size_t from) {
  double *arrays[] = {packing->x,  packing->y,     packing->r,    packing->vx,
                      packing->vy, packing->omega, packing->mass, packing->inertia};
  for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
    if (arrays[k])
      arrays[k][to] = arrays[k][from];
  if (packing->fixed)
    packing->fixed[to] = packing->fixed[from];
}

// Is (x, y) inside the polygon: an odd number of its edges crosses the ray to the right.
static bool in_polygon(const double (*corner)[2], size_t count, double x, double y) {
  bool inside = false;
  for (size_t k = 0; k < count; k++) {
    const double *a = corner[k], *b = corner[(k + 1) % count];
    if ((a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) * (b[0] - a[0]) / (b[1] - a[1]))
      inside = !inside;
  }
  return inside;
}

static bool in_cut(const tal_scene_pack *pack, double dx, double dy) {
  if (pack->cut_shape == TAL_CUT_POLYGON)
    return in_polygon((const double(*)[2])pack->cut_points, pack->cut_point_count, dx, dy);
  return sqrt(dx * dx + dy * dy) <= pack->cut_radius;
}

static tal_status cut(const tal_scene *scene, tal_packing *packing, tal_error *err) {
  const tal_scene_pack *pack = &scene->pack;
  double box[4];
  if (isnan(pack->cut_radius))
    return TAL_OK;
  tal_packing_box(packing, box);
  double x = 0.5 * (box[0] + box[1]), y = 0.5 * (box[2] + box[3]);
  size_t kept = 0;
  for (size_t i = 0; i < packing->count; i++)
    if (in_cut(pack, packing->x[i] - x, packing->y[i] - y))
      keep_grain(packing, kept++, i);
  packing->count = kept;
  packing->width = (double)NAN;
  if (kept > 0)
    return TAL_OK;
  if (pack->cut_shape == TAL_CUT_POLYGON)
    return tal_pack_fail(scene, 0, "pack.cut.points", err,
                         "no grain has its centre inside the polygon about (%g, %g) m", x, y);
  return tal_pack_fail(scene, 0, "pack.cut.radius", err, "no grain has its centre within %g m of (%g, %g) m",
                       pack->cut_radius, x, y);
}

tal_status tal_pack(const tal_scene *scene, tal_packing *packing, tal_error *err) {
  *packing = (tal_packing){0};
  const tal_packer *packer = tal_packer_find(scene->pack.method);
  if (!packer)
    return tal_pack_fail(scene, 0, "pack.method", err, "unknown method '%s'", scene->pack.method);
  tal_status status = packer->pack(scene, packing, err);
  if (!status)
    status = cut(scene, packing, err);
  if (status) {
    tal_packing_clear(packing);
    return status;
  }
  tal_packing_report(packing);
  return TAL_OK;
}

// Mass [kg] of a grain of radius r [m], before scaling.
static double material_mass(const tal_scene *scene, double r, double thickness) {
  double density = scene->material.density;
  if (scene->grains.shape == TAL_SPHERE)
    return density * (4.0 / 3.0) * TAL_PI * r * r * r;
  return density * TAL_PI * r * r * thickness;
}

static void set_masses(tal_grains *grains, const tal_packing *packing, const tal_scene *scene, double thickness) {
  double inertia_factor = scene->grains.shape == TAL_SPHERE ? 0.4 : 0.5;
  for (size_t i = 0; i < packing->count; i++) {
    double r = packing->r[i];
    bool fixed = packing->fixed && packing->fixed[i];
    grains->mass[i] = packing->mass && !isnan(packing->mass[i])
                          ? packing->mass[i]
                          : scene->mass_scaling * material_mass(scene, r, thickness);
    grains->inertia[i] = packing->inertia && !isnan(packing->inertia[i]) ? packing->inertia[i]
                                                                         : inertia_factor * grains->mass[i] * r * r;
    grains->inverse_mass[i] = fixed ? 0 : 1 / grains->mass[i];
    grains->inverse_inertia[i] = fixed || !scene->rotation ? 0 : 1 / grains->inertia[i];
  }
}

void tal_packing_grains(const tal_packing *packing, const tal_scene *scene, double thickness, tal_grains *grains) {
  size_t bytes = packing->count * sizeof(double);
  tal_grains_init(grains, packing->count);
  memcpy(grains->x, packing->x, bytes);
  memcpy(grains->y, packing->y, bytes);
  memcpy(grains->r, packing->r, bytes);
  if (packing->vx)
    memcpy(grains->vx, packing->vx, bytes);
  if (packing->vy)
    memcpy(grains->vy, packing->vy, bytes);
  if (packing->omega)
    memcpy(grains->omega, packing->omega, bytes);
  set_masses(grains, packing, scene, thickness);
}
