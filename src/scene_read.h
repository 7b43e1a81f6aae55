// Tree to struct through the schema table, in two passes. Private to scene*.c and study*.c.
#ifndef TAL_SCENE_READ_H
#define TAL_SCENE_READ_H

#include "scene_report.h"
#include "scene_schema.h"

// Pass 1: every default, then every value of the file, into *scene (zeroed by the caller). Reports unknown keys, wrong
// types and values out of range; defaults without a constant are left NAN, 0 or NULL.
void tal_scene_read(tal_scene *scene, const tal_node *root, tal_report *report);
// Pass 2, once all choices are resolved: keys that do not exist with the choices made, and required keys that are
// missing.
void tal_scene_read_variants(const tal_scene *scene, const tal_node *root, tal_report *report);
// Both passes for any table of keys and its struct (zeroed by the caller).
void tal_schema_read(const tal_key *keys, void *base, const tal_node *root, tal_report *report);
void tal_schema_read_variants(const tal_key *keys, const void *base, const tal_node *root, tal_report *report);
// Frees what the keys own inside one struct.
void tal_schema_release(const tal_key *keys, void *base);

#endif
