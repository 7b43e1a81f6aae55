// Loads a scene: file to tree, --set on the tree, tree to struct, rules that join keys. The steps are in scene_*.c.
#include "scene.h"

#include "radius.h"
#include "scene_check.h"
#include "scene_read.h"
#include "scene_set.h"
#include "scene_yaml.h"

#include <errno.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

// Whole file in memory (owned by the caller); NULL with *problem saying why not.
static char *read_file(const char *path, size_t *size, const char **problem) {
  FILE *file = fopen(path, "rb");
  struct stat info;
  *problem = strerror(errno);
  if (!file)
    return NULL;
  char *bytes = NULL;
  size_t capacity = (size_t)1 << 16, used = 0;
  if (fstat(fileno(file), &info) == 0 && S_ISDIR(info.st_mode)) {
    *problem = "it is a folder";
  } else {
    bytes = tal_alloc(capacity, 1);
    while (used <= TAL_YAML_BYTES && !feof(file) && !ferror(file)) {
      if (used == capacity) {
        bytes = tal_grow(bytes, used, 2 * capacity, 1);
        capacity *= 2;
      }
      used += fread(bytes + used, 1, capacity - used, file);
    }
    *problem = used > TAL_YAML_BYTES ? "it is longer than 64 MiB" : ferror(file) ? "reading failed" : NULL;
  }
  fclose(file);
  *size = used;
  if (!*problem)
    return bytes;
  free(bytes);
  return NULL;
}

static bool build_tree(tal_tree *tree, const char *path, tal_report *report) {
  const char *problem;
  size_t size = 0;
  char *bytes = read_file(path, &size, &problem);
  if (!bytes) {
    char text[160];
    snprintf(text, sizeof text, "cannot be read: %s; accepted: a scene file in YAML", problem);
    tal_report_text(report, 0, NULL, "", text);
    return false;
  }
  tal_yaml_error error;
  tree->root = tal_yaml_parse(tree, bytes, size, NULL, &error);
  free(bytes);
  if (!tree->root)
    tal_report_text(report, error.line, NULL, "", error.text);
  else if (tree->root->kind != TAL_NODE_MAP)
    tal_report_text(report, tree->root->line, NULL, "",
                    "the scene is not a mapping; accepted: key: value (see `talus keys`)");
  return report->errors->count == 0;
}

static int line_of(tal_node *root, const char *path) {
  const tal_node *node = tal_node_find(root, path);
  return node && !node->override ? node->line : 0;
}

static void fill_scene(tal_scene *scene, tal_tree *tree, tal_report *report) {
  tal_scene_read(scene, tree->root, report);
  tal_scene_resolve(scene, tree->root, report);
  tal_scene_read_variants(scene, tree->root, report);
  tal_scene_check(scene, tree->root, report);
  scene->line_dt = line_of(tree->root, "integrator.dt");
  scene->line_width = line_of(tree->root, "pack.width");
}

tal_status tal_scene_load(tal_scene *scene, const char *path, const char *const *overrides, size_t override_count,
                          tal_scene_errors *errors) {
  tal_report report = {.file = path, .errors = errors};
  tal_tree tree = {0};
  errors->count = 0;
  *scene = (tal_scene){.path = tal_strdup(path)};
  locale_t plain = newlocale(LC_NUMERIC_MASK, "C", (locale_t)0), before = uselocale(plain);
  if (build_tree(&tree, path, &report)) {
    for (size_t i = 0; i < override_count; i++)
      tal_scene_set(&tree, overrides[i], &report);
    fill_scene(scene, &tree, &report);
  }
  uselocale(before);
  freelocale(plain);
  tal_tree_clear(&tree);
  if (!errors->count)
    return TAL_OK;
  tal_scene_clear(scene);
  return TAL_BAD_INPUT;
}

void tal_scene_clear(tal_scene *scene) {
  for (size_t s = 0; s < scene->stage_count; s++)
    free(scene->stages[s].grain.ids);
  tal_schema_release(tal_schema(), scene);
  free(scene->path);
  *scene = (tal_scene){0};
}

char *tal_scene_relative(const tal_scene *scene, const char *path) {
  const char *slash = scene->path ? strrchr(scene->path, '/') : NULL;
  size_t folder = slash && *path != '/' ? (size_t)(slash - scene->path) + 1 : 0;
  size_t size = folder + strlen(path) + 1;
  char *joined = tal_alloc(size, 1);
  snprintf(joined, size, "%.*s%s", (int)folder, folder ? scene->path : "", path);
  return joined;
}

static double mean_of_list(const tal_scene_grains *grains) {
  double sum = 0;
  for (size_t i = 0; i < grains->list_count; i++)
    sum += grains->list[i].r;
  return sum / (double)grains->list_count;
}

double tal_scene_mean_radius(const tal_scene *scene) {
  if (scene->grains.list_count)
    return mean_of_list(&scene->grains);
  if (scene->pack.method && strcmp(scene->pack.method, "file") == 0)
    return nan("");
  return tal_radius_mean(&scene->grains.radius, scene->grains.shape);
}
