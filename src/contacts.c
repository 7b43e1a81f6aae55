#include "contacts.h"

#include <stdlib.h>

void tal_contacts_init(tal_contacts *contacts) {
  *contacts = (tal_contacts){0};
}

void tal_contacts_clear(tal_contacts *contacts) {
#define X(type, name, unit, kept, meaning) free(contacts->name);
  TAL_CONTACT_FIELDS(X)
#undef X
  *contacts = (tal_contacts){0};
}

void tal_contacts_reserve(tal_contacts *contacts, size_t capacity) {
  if (capacity <= contacts->capacity)
    return;
#define X(type, name, unit, kept, meaning)                                                                             \
  contacts->name = tal_grow(contacts->name, contacts->capacity, capacity, sizeof(type));
  TAL_CONTACT_FIELDS(X)
#undef X
  contacts->capacity = capacity;
}

void tal_contacts_swap(tal_contacts *a, tal_contacts *b) {
  tal_contacts held = *a;
  *a = *b;
  *b = held;
}

#define IF_STATE(...) __VA_ARGS__
#define IF_WORK(...)  __VA_ARGS__
#define IF_PAST(...)                                                                                                   \
  if (needs.past)                                                                                                      \
  __VA_ARGS__
#define IF_SOLVED(...)                                                                                                 \
  if (needs.solved)                                                                                                    \
  __VA_ARGS__
#define IF_DAMPED(...)                                                                                                 \
  if (needs.damped)                                                                                                    \
  __VA_ARGS__
#define IF_SEEN(...)
#define IF_WALL(...)

void tal_contacts_reserve_pairs(tal_contacts *contacts, size_t capacity, tal_contact_needs needs) {
#define X(type, name, unit, kept, meaning) IF_##kept(contacts->name = tal_alloc(capacity, sizeof(type));)
  TAL_CONTACT_FIELDS(X)
#undef X
  contacts->capacity = capacity;
}

#undef IF_STATE
#undef IF_WORK
#undef IF_PAST
#undef IF_SOLVED
#undef IF_DAMPED
#undef IF_SEEN
#define IF_STATE(...)
#define IF_WORK(...)
#define IF_PAST(...)
#define IF_SOLVED(...)
#define IF_DAMPED(...)
#define IF_SEEN(...) __VA_ARGS__

void tal_contacts_show(tal_contacts *contacts) {
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept(if (!contacts->name) contacts->name = tal_alloc(contacts->capacity, sizeof(type));)
  TAL_CONTACT_FIELDS(X)
#undef X
}

void tal_contacts_hide(tal_contacts *contacts) {
#define X(type, name, unit, kept, meaning) IF_##kept(free(contacts->name); contacts->name = NULL;)
  TAL_CONTACT_FIELDS(X)
#undef X
}
