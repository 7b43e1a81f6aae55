// The report on a packing: solid fraction and coordination of its bulk, largest overlap. The bulk is the middle half of
// the bounding box in width and in height. Walls do not reach into it, so every support there is a grain.
#include "cells.h"
#include "pack_methods.h"

#include <assert.h>
#include <math.h>

void tal_packing_box(const tal_packing *packing, double box[4]) {
  box[0] = box[2] = (double)INFINITY;
  box[1] = box[3] = (double)-INFINITY;
  for (size_t i = 0; i < packing->count; i++) {
    double x = packing->x[i], y = packing->y[i], r = packing->r[i];
    box[0] = fmin(box[0], x - r);
    box[1] = fmax(box[1], x + r);
    box[2] = fmin(box[2], y - r);
    box[3] = fmax(box[3], y + r);
  }
}

// Area of the part of the unit disk left of a and below b.
static double unit_corner(double a, double b) {
  a = fmin(fmax(a, -1), 1);
  b = fmin(fmax(b, -1), 1);
  double left = 0.5 * TAL_PI + a * sqrt(1 - a * a) + asin(a), below = 0.5 * TAL_PI + b * sqrt(1 - b * b) + asin(b);
  if (a * a + b * b < 1)
    return 0.5 * (left + below) - 0.25 * TAL_PI + a * b;
  if (a >= 0 && b >= 0)
    return left + below - TAL_PI;
  if (a < 0 && b < 0)
    return 0;
  return a < 0 ? left : below;
}

// Area [m^2] that disk i has in the box.
static double area_inside(const tal_packing *packing, size_t i, const double box[4]) {
  double r = packing->r[i], west = (box[0] - packing->x[i]) / r, east = (box[1] - packing->x[i]) / r;
  double south = (box[2] - packing->y[i]) / r, north = (box[3] - packing->y[i]) / r;
  if (west >= 1 || east <= -1 || south >= 1 || north <= -1)
    return 0;
  if (west <= -1 && east >= 1 && south <= -1 && north >= 1)
    return TAL_PI * r * r;
  return r * r *
         (unit_corner(east, north) - unit_corner(west, north) - unit_corner(east, south) + unit_corner(west, south));
}

// Touching counts what lies nearer than this times the mean diameter: far above round-off, far below chance.
static const double touching_gap = 1e-9;

typedef struct bulk {
  double box[4]; // [m] the middle half of the packing's bounding box in width and in height
  double mean_diameter;
} bulk;

static bool in_bulk(const tal_packing *packing, size_t i, const bulk *middle) {
  return packing->x[i] >= middle->box[0] && packing->x[i] < middle->box[1] && packing->y[i] >= middle->box[2] &&
         packing->y[i] < middle->box[3];
}

// Overlap and coordination from the pairs that touch.
static void report_pairs(tal_packing *packing, const bulk *middle, size_t bulk_grains) {
  geo_pairs pairs;
  geo_pairs_init(&pairs);
  double margin = touching_gap * middle->mean_diameter;
  int finite = geo_cells_pairs(packing->x, packing->y, packing->r, packing->count, margin, &pairs);
  assert(finite == 0);
  (void)finite;
  size_t ends = 0;
  for (size_t c = 0; c < pairs.count; c++) {
    size_t i = (size_t)pairs.pair[c][0], j = (size_t)pairs.pair[c][1];
    double dx = packing->x[i] - packing->x[j], dy = packing->y[i] - packing->y[j], distance = sqrt(dx * dx + dy * dy);
    packing->largest_overlap = fmax(packing->largest_overlap, packing->r[i] + packing->r[j] - distance);
    ends += (size_t)in_bulk(packing, i, middle) + (size_t)in_bulk(packing, j, middle);
  }
  if (bulk_grains > 0)
    packing->coordination = (double)ends / (double)bulk_grains;
  geo_pairs_clear(&pairs);
}

// Fewer grains than this in the middle are no bulk.
static const size_t fewest_bulk_grains = 20;

void tal_packing_report(tal_packing *packing) {
  bulk middle = {.mean_diameter = 0};
  double box[4], area = 0;
  tal_packing_box(packing, box);
  for (size_t k = 0; k < 4; k += 2) {
    middle.box[k] = box[k] + 0.25 * (box[k + 1] - box[k]);
    middle.box[k + 1] = box[k] + 0.75 * (box[k + 1] - box[k]);
  }
  size_t bulk_grains = 0;
  for (size_t i = 0; i < packing->count; i++) {
    area += area_inside(packing, i, middle.box);
    bulk_grains += in_bulk(packing, i, &middle);
    middle.mean_diameter += 2 * packing->r[i] / (double)packing->count;
  }
  if (bulk_grains < fewest_bulk_grains)
    bulk_grains = 0;
  double bulk_area = (middle.box[1] - middle.box[0]) * (middle.box[3] - middle.box[2]);
  if (bulk_grains > 0)
    packing->solid_fraction = area / bulk_area;
  report_pairs(packing, &middle, bulk_grains);
}
