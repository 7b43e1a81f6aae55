// Packings: where the grains start. A packer is a constant descriptor and one registry line in pack.c.
#ifndef TAL_PACK_H
#define TAL_PACK_H

#include "grains.h"
#include "scene.h"

typedef struct tal_packing {
  size_t count;
  double *x, *y, *r;       // owned; [count] [m]
  double *vx, *vy, *omega; // owned; [count] or NULL when all zero
  double *mass, *inertia;  // owned; [count] or NULL; NAN: from the material
  unsigned char *fixed;    // owned; [count] or NULL
  double width;            // [m] of the box, NAN without one (and after a cut)
  // The bulk is the middle half of the bounding box in width and in height; NAN with fewer than 20 grains in it.
  double solid_fraction;  // grain area in the bulk / its area
  double coordination;    // touching neighbours of a bulk grain (gap below 1e-9 mean diameters)
  double largest_overlap; // [m] over all pairs, 0 when none overlap
} tal_packing;

typedef struct tal_packer {
  const char *name;
  const char *help;
  tal_status (*pack)(const tal_scene *scene, tal_packing *packing, tal_error *err);
} tal_packer;

const tal_packer *tal_packer_find(const char *name);

// Runs the scene's packer, applies the cut, fills the report. Errors: TAL_BAD_INPUT with one sentence starting
// "FILE:LINE: key: " (line 0 is left out); what is wrong in a CSV file starts with that file's path and line.
// Ids are in packing order: order of the drops, of the list or file, lattice row by row from the bottom.
// A cut keeps the grains whose centre lies in a circle or a polygon about the middle of the bounding box of all discs,
// and renumbers them in order. Random radii and drop places come from two streams of the scene's seed (random.h).
// Lengths scaled by a power of four give the same bits scaled.
tal_status tal_pack(const tal_scene *scene, tal_packing *packing, tal_error *err);
void tal_packing_clear(tal_packing *packing);
// Grains with mass, inertia (scaling included), ids in packing order. h is the thickness [m].
void tal_packing_grains(const tal_packing *packing, const tal_scene *scene, double thickness, tal_grains *grains);

#endif
