// Greedy colouring of the contacts by (i, j): each takes the first of 64 colours that neither of its grains has; what
// finds none (a grain with very many contacts) goes into a last one that is swept in order. Walls hold no colours: no
// contact changes their velocity.
#include "friction.h"

#include <stdlib.h>
#include <string.h>

enum { COLOURS = 64 };

// False when the contacts are those that were coloured last.
static bool renew_keys(tal_friction_system *system) {
  bool same = system->coloured == system->count;
  for (size_t k = 0; k < system->count; k++) {
    int64_t key = (int64_t)system->contact[k].i << 32 | system->contact[k].j;
    same = same && system->key[k] == key;
    system->key[k] = key;
  }
  system->coloured = system->count;
  return !same;
}

static int first_free(uint64_t taken) {
  return taken == UINT64_MAX ? COLOURS : __builtin_ctzll(~taken);
}

// Colour of every contact, and how many have each.
static void deal_colours(const tal_friction_system *system, size_t grains, uint8_t *colour, int32_t *size) {
  uint64_t *taken = tal_alloc(grains, sizeof *taken);
  for (size_t k = 0; k < system->count; k++) {
    const tal_friction_contact *c = &system->contact[k];
    bool two = (size_t)c->j < grains;
    int own = first_free(taken[c->i] | (two ? taken[c->j] : 0));
    colour[k] = (uint8_t)own;
    size[own]++;
    if (own == COLOURS)
      continue;
    taken[c->i] |= 1ULL << own;
    if (two)
      taken[c->j] |= 1ULL << own;
  }
  free(taken);
}

void tal_friction_colour(tal_friction_system *system, size_t grains) {
  if (!renew_keys(system))
    return;
  uint8_t *colour = tal_alloc(system->count, sizeof *colour);
  int32_t size[COLOURS + 1] = {0}, next[COLOURS + 1];
  deal_colours(system, grains, colour, size);
  system->serial_last = size[COLOURS] > 0;
  system->colour_count = 0;
  system->first[0] = 0;
  for (int k = 0; k <= COLOURS; k++) {
    if (size[k] == 0)
      continue;
    next[k] = system->first[system->colour_count];
    system->first[system->colour_count + 1] = next[k] + size[k];
    system->colour_count++;
  }
  for (size_t k = 0; k < system->count; k++)
    system->order[next[colour[k]]++] = (int32_t)k;
  free(colour);
}
