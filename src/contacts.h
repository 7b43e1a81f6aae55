// Contact slots: one per candidate pair (grain-grain) or per candidate grain-wall meeting. A slot touches when overlap
// > 0. Force on grain i: (fe + fd) n + ft t with n = (nx, ny) the unit normal INTO i (from j, or from the wall) and t =
// (-ny, nx). Grain j gets the opposite. The contact point lies at x_i - (r_i - overlap/2) n (wall: r_i - overlap).
#ifndef TAL_CONTACTS_H
#define TAL_CONTACTS_H

#include "base.h"
#include <stdbool.h>

// X(type, name, unit, kept, meaning), as in grains.h. More kinds, without memory where nobody needs them.
// PAST: state of laws with a history. SOLVED: state of implicit friction. DAMPED: where the law's damping is not one
// time for all contacts. SEEN: where someone looks at contacts between steps. WALL: of wall contacts.
#define TAL_CONTACT_FIELDS(X)                                                                                          \
  X(int32_t, i, "1", STATE, "grain, i < j")                                                                            \
  X(int32_t, j, "1", STATE, "grain, or index of the wall in a list of wall contacts")                                  \
  X(double, reach, "m", WORK, "sum of the radii; wall: the radius")                                                    \
  X(double, stiffness, "N/m^1.5 | N/m", WORK, "K of the normal law")                                                   \
  X(double, damping, "N s/m^1.5 | N s/m", DAMPED, "coefficient of the viscous part of the normal law")                 \
  X(double, friction, "1", WALL, "coefficient of friction")                                                            \
  X(double, spring, "N", PAST, "spring law: tangential spring force after the last step; implicit friction: ft")       \
  X(double, viscous, "N", SOLVED, "implicit friction: viscous part of the normal force after the last step")           \
  X(double, spring_stiffness, "N/m", PAST, "tangential stiffness after the last step (spring law only)")               \
  X(double, nx, "1", SEEN, "unit normal into i")                                                                       \
  X(double, ny, "1", SEEN, "unit normal into i")                                                                       \
  X(double, overlap, "m", SEEN, "positive in contact, negative: the gap")                                              \
  X(double, fe, "N", SEEN, "elastic part of the normal force, >= 0")                                                   \
  X(double, fd, "N", SEEN, "the rest of the normal force: viscous part after clipping, fe + fd >= 0")                  \
  X(double, ft, "N", SEEN, "tangential force on i along t")                                                            \
  X(double, slip, "m/s", SEEN, "slip speed of i against j along t, with its sign (observed states only)")

typedef struct tal_contacts {
  size_t count, capacity;
#define X(type, name, unit, kept, meaning) type *name; // owned; [capacity]; those of kinds with conditions may be NULL
  TAL_CONTACT_FIELDS(X)
#undef X
} tal_contacts;

void tal_contacts_init(tal_contacts *contacts);
void tal_contacts_clear(tal_contacts *contacts);
// Room for `capacity` slots (never shrinks); contents are kept.
void tal_contacts_reserve(tal_contacts *contacts, size_t capacity);
// What slots of a list need memory for.
typedef struct tal_contact_needs {
  bool past, solved, damped;
} tal_contact_needs;

// The same for an empty list of grain-grain slots: without SEEN and WALL, of the others what is needed.
void tal_contacts_reserve_pairs(tal_contacts *contacts, size_t capacity, tal_contact_needs needs);
// Gives the SEEN fields memory where they have none, and takes it away.
void tal_contacts_show(tal_contacts *contacts);
void tal_contacts_hide(tal_contacts *contacts);
// Exchanges the contents of two lists.
void tal_contacts_swap(tal_contacts *a, tal_contacts *b);

#endif
