// Fabric: contact, branch, normal-force and tangential-force tensors, anisotropies with their directions, and the
// relation of stress to force and fabric. Equations (M1)-(M8). L. Rothenburg and R. J. Bathurst, Geotechnique 39 (1989)
// 601. Contacts between grains only.
#ifndef TAL_MEASURE_TENSORS_H
#define TAL_MEASURE_TENSORS_H

#include "measure_snapshot.h"
#include "vec.h"

typedef enum tal_network { TAL_NETWORK_ALL, TAL_NETWORK_STRONG, TAL_NETWORK_WEAK } tal_network;
// "all", "strong", "weak".
const char *tal_network_name(tal_network network);
// Whether a normal force belongs to it: strong means above the mean of the part.
bool tal_network_has(tal_network network, double fn, double mean);

// 1 + size cos 2(theta - angle), as a vector size (cos 2 angle, sin 2 angle).
typedef struct tal_anisotropy {
  double size;
  double angle; // [rad] in [0, pi), 0 where size is 0
} tal_anisotropy;

// Major and minor eigenvalue of the symmetric part and the angle of the major axis in [0, pi), by GSL.
typedef struct tal_principal {
  double major, minor, angle;
} tal_principal;
tal_principal tal_principal_of(geo_tensor tensor);

// Everything is 0 where there are no contacts.
typedef struct tal_fabric {
  size_t contacts;
  double mean_fn, mean_branch;                     // [N], [m]
  geo_tensor contact, branch, normal, tangential;  // (M1)
  tal_anisotropy a_c, a_l, a_n, a_t;               // (M2)-(M4)
  geo_tensor stress;                               // [Pa] (M5) raw; 0 where the part has no area
  double stress_ratio;                             // (s1 - s2)/(s1 + s2) of it
  double relation_ratio;                           // the same by (M6)
  double relation_full_ratio, relation_full_error; // by (M7); |(M7) - stress| / |stress|, Frobenius
} tal_fabric;

// thickness [m] as in run.json.
tal_fabric tal_fabric_measure(const tal_part *part, tal_network network, double thickness);

#endif
