// Drop-and-roll packing under gravity [P 2.5, 3.3; Jodrey & Tory, Simulation 32 (1979) 1-12], in two dimensions. Disks
// are dropped one by one from above at a random place between the side walls x = 0 and x = width. Each falls straight
// down, rolls without slip or bounce over the disks it meets, falls again where its support ends, and rests on two
// supports with its centre between them (two disks, or a disk and a side wall) or on the floor y = 0. The disks that
// reach the floor are the random bed. There is no dynamics: a disk never moves again once it rests.
//
// Everything a rolling disk can meet is closed-form. Its centre moves on the circle of radius D_i = r + r_i about its
// support i, towards the side it landed on, down to the height of c_i. Disk j stops it where the distance to c_j
// first is D_j: on the circle that is the direction i -> j turned back by the angle alpha,
// cos(alpha) = (d^2 + D_i^2 - D_j^2)/(2 d D_i), d = |c_j - c_i|. The earliest meeting wins. It is a rest when the
// disk's centre lies between both supports; else the disk goes on rolling, about j.
//
// Round-off: no tolerance anywhere. Whether j is met at all is decided by the side of the line i -> j the disk is on
// (approaching or leaving), never by a small distance, and each new position is computed from the two supports
// directly, so errors do not add up along the path.
#include "pack_bed.h"
#include "pack_methods.h"
#include "radius.h"
#include "random.h"

#include <math.h>

// The disk on its way.
typedef struct drop {
  double x, y, r;  // [m]
  int32_t support; // the grain it rolls about, -1 none
  double side;     // +1 rolls towards larger x, -1 towards smaller
} drop;

typedef enum meeting { MEETS_NOTHING, MEETS_LEVEL, MEETS_GRAIN, MEETS_WALL, MEETS_FLOOR } meeting;

// Where a roll ends. (u, v): centre relative to the support, u towards the rolling side; the roll is clockwise.
typedef struct event {
  double u, v; // [m]
  meeting kind;
  int32_t grain;
} event;

static void consider(event *best, event candidate) {
  if (best->u * candidate.v - best->v * candidate.u > 0)
    *best = candidate;
}

// The roll of one disk about its support, as consider_* see it.
typedef struct roll {
  double x, y;     // [m] centre of the support
  double distance; // [m] D_i
  double u, v;     // [m] where the disk is now, relative to the support
  double r;        // [m] of the disk
  double side;
} roll;

static void consider_grain(event *best, const roll *path, const tal_bed *bed, int32_t j) {
  double du = path->side * (bed->x[j] - path->x), dv = bed->y[j] - path->y;
  double reach = path->r + bed->r[j], d2 = du * du + dv * dv, d = sqrt(d2);
  if (d >= path->distance + reach)
    return;
  if (du * path->v - dv * path->u < 0)
    return; // leaving j
  double along = (d2 + (path->distance - reach) * (path->distance + reach)) / (2 * d);
  double h2 = (path->distance - along) * (path->distance + along);
  if (!(h2 > 0))
    return; // grazes it
  double h = sqrt(h2), eu = du / d, ev = dv / d;
  consider(best, (event){along * eu - h * ev, along * ev + h * eu, MEETS_GRAIN, j});
}

static void consider_box(event *best, const roll *path, double width) {
  double wall = (path->side > 0 ? width - path->x : path->x) - path->r, rise = path->r - path->y;
  double D = path->distance;
  if (wall < D) {
    double u = fmax(wall, 0);
    consider(best, (event){u, sqrt((D - u) * (D + u)), MEETS_WALL, -1});
  }
  if (rise > 0)
    consider(best, (event){sqrt((D - rise) * (D + rise)), rise, MEETS_FLOOR, -1});
}

// A roll over a far larger disk is cut in pieces of about eight radii, so that the search stays local, yet in no more
// than some fifty pieces. The turn has tan(angle / 2) = t, which needs no trigonometric function.
static event longest_roll(const roll *path) {
  event end = {path->distance, 0, MEETS_LEVEL, -1};
  double t = fmax(4 * path->r / path->distance, 1.0 / 64);
  if (t >= 1)
    return end;
  double c = (1 - t) * (1 + t) / (1 + t * t), s = 2 * t / (1 + t * t);
  event piece = {c * path->u + s * path->v, c * path->v - s * path->u, MEETS_NOTHING, -1};
  if (piece.v > 0)
    consider(&end, piece);
  return end;
}

static event roll_end(tal_bed *bed, const roll *path, int32_t support) {
  event end = longest_roll(path);
  double r = path->r, ahead = path->x + path->side * end.u, behind = path->x + path->side * path->u;
  size_t near =
      tal_bed_near(bed, fmin(ahead, behind) - r, fmax(ahead, behind) + r, path->y + end.v - r, path->y + path->v + r);
  for (size_t k = 0; k < near; k++)
    if (bed->near[k] != support)
      consider_grain(&end, path, bed, bed->near[k]);
  consider_box(&end, path, bed->width);
  return end;
}

// Falls straight down; true when it lies on the floor.
static bool fall(const tal_bed *bed, drop *disk) {
  disk->support = tal_bed_landing(bed, disk->x, disk->r, disk->y, &disk->y);
  if (disk->support < 0)
    return true;
  disk->side = disk->x >= bed->x[disk->support] ? 1 : -1;
  return false;
}

typedef enum outcome { RESTS, ROLLS, FALLS } outcome;

static outcome take_roll(tal_bed *bed, drop *disk) {
  double sx = bed->x[disk->support], sy = bed->y[disk->support];
  roll path = {.x = sx, .y = sy, .r = disk->r, .side = disk->side};
  path.distance = disk->r + bed->r[disk->support];
  path.u = disk->side * (disk->x - sx);
  path.v = disk->y - sy;
  event end = roll_end(bed, &path, disk->support);
  disk->x = end.kind == MEETS_WALL ? (disk->side > 0 ? bed->width - disk->r : disk->r) : sx + disk->side * end.u;
  disk->y = end.kind == MEETS_FLOOR ? disk->r : sy + end.v;
  switch (end.kind) {
  case MEETS_NOTHING:
    return ROLLS;
  case MEETS_LEVEL:
    return FALLS;
  case MEETS_WALL:
  case MEETS_FLOOR:
    return RESTS;
  case MEETS_GRAIN:
    break;
  }
  if (disk->side * (bed->x[end.grain] - disk->x) > 0)
    return RESTS;
  disk->support = end.grain;
  return ROLLS;
}

// Follows one disk to its rest. False when the path does not end (each roll leads down, so that is our bug).
static bool settle(tal_bed *bed, drop *disk) {
  outcome next = FALLS;
  for (size_t turns = 0; turns < 1000 + 100 * bed->count; turns++) {
    if (next == FALLS && fall(bed, disk))
      return true;
    next = take_roll(bed, disk);
    if (next == RESTS)
      return true;
  }
  return false;
}

static tal_status drop_all(const tal_scene *scene, tal_packing *packing, tal_error *err) {
  tal_bed bed;
  tal_bed_init(&bed, packing->x, packing->y, packing->r, packing->count, packing->width);
  gsl_rng *rng = tal_random_stream(scene->seed, TAL_STREAM_DROP);
  bool settled = true;
  for (size_t i = 0; i < packing->count && settled; i++) {
    double r = packing->r[i], x = r + gsl_rng_uniform(rng) * (packing->width - 2 * r);
    drop disk = {.x = x, .y = (double)INFINITY, .r = r, .support = -1};
    settled = settle(&bed, &disk);
    packing->x[i] = disk.x;
    packing->y[i] = disk.y;
    if (settled)
      tal_bed_add(&bed, (int32_t)i);
  }
  gsl_rng_free(rng);
  tal_bed_clear(&bed);
  return settled ? TAL_OK : tal_fail(err, TAL_INVALID, "drop_and_roll: a grain found no rest; please report the scene");
}

static tal_status check_sizes(const tal_scene *scene, const tal_packing *packing, tal_error *err) {
  double largest = 0, smallest = (double)INFINITY;
  for (size_t i = 0; i < packing->count; i++) {
    largest = fmax(largest, 2 * packing->r[i]);
    smallest = fmin(smallest, 2 * packing->r[i]);
  }
  if (!(smallest > 0 && isfinite(largest)))
    return tal_pack_fail(scene, 0, "grains.radius", err,
                         "the law gives diameters from %g to %g m; set min above 0 and a finite max", smallest,
                         largest);
  if (packing->width >= 2 * largest && isfinite(packing->width))
    return TAL_OK;
  return tal_pack_fail(scene, scene->line_width, "pack.width", err,
                       "%g m is too narrow a box, it must hold two of the largest grains side by side: at least %g m",
                       packing->width, 2 * largest);
}

static tal_status drop_and_roll(const tal_scene *scene, tal_packing *packing, tal_error *err) {
  tal_error law;
  if (scene->grains.count < 1 || scene->grains.count > INT32_MAX)
    return tal_pack_fail(scene, 0, "grains.count", err, "%lld grains; 1 to %d are accepted",
                         (long long)scene->grains.count, INT32_MAX);
  if (tal_radius_check(&scene->grains.radius, &law))
    return tal_pack_fail(scene, 0, "grains.radius", err, "%s", law.text);
  tal_packing_init(packing, (size_t)scene->grains.count);
  packing->width = scene->pack.width;
  gsl_rng *rng = tal_random_stream(scene->seed, TAL_STREAM_RADIUS);
  tal_radius_draw(&scene->grains.radius, scene->grains.shape, rng, packing->r, packing->count);
  gsl_rng_free(rng);
  tal_status status = check_sizes(scene, packing, err);
  return status ? status : drop_all(scene, packing, err);
}

const tal_packer tal_packer_drop_and_roll = {
    "drop_and_roll", "grains dropped one by one into a box roll to a stable rest (width)", drop_and_roll};
