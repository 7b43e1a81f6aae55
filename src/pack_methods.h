// What the packers share: their descriptors, which pack.c registers, and the pieces each of them needs.
#ifndef TAL_PACK_METHODS_H
#define TAL_PACK_METHODS_H

#include "pack.h"

extern const tal_packer tal_packer_drop_and_roll, tal_packer_lattice, tal_packer_file, tal_packer_list;

// Zeroed centres and radii for `count` grains; the optional arrays stay NULL, numbers not known are NAN.
void tal_packing_init(tal_packing *packing, size_t count);
// What only some packings know of a grain.
typedef struct tal_packed_extras {
  double vx, vy, omega, mass, inertia; // mass, inertia: NAN when not given
  bool fixed;
} tal_packed_extras;
// Stores them for grain i; the optional arrays are made when a value first needs them.
void tal_packing_extras(tal_packing *packing, size_t i, const tal_packed_extras *extras);
// TAL_BAD_INPUT with "FILE:LINE: key: " before the sentence; line 0 is left out.
tal_status tal_pack_fail(const tal_scene *scene, int line, const char *key, tal_error *err, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
// True when two grains have the same centre; the first such pair in id order.
bool tal_packing_coincident(const tal_packing *packing, size_t *first, size_t *second);

// Bounding box of the disks: {x0, x1, y0, y1} [m].
void tal_packing_box(const tal_packing *packing, double box[4]);
// Fills solid_fraction, coordination and largest_overlap.
void tal_packing_report(tal_packing *packing);

#endif
