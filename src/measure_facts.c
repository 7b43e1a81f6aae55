// See measure_facts.h. JSON is a part of YAML, so the scene's parser reads it.
#include "measure_facts.h"

#include "files.h"
#include "scene_value.h"
#include "scene_yaml.h"
#include <stdlib.h>

static double number_of(const tal_node *node, double otherwise) {
  double value;
  if (!node || node->kind != TAL_NODE_SCALAR || node->quoted || tal_read_real(node->text, &value) != TAL_NUMBER_OK)
    return otherwise;
  return value;
}

static void read_stages(tal_measure_facts *facts, const tal_node *stages) {
  if (!stages || stages->kind != TAL_NODE_LIST)
    return;
  facts->stage_friction = tal_alloc(stages->count, sizeof *facts->stage_friction);
  for (const tal_node *stage = stages->child; stage; stage = stage->next)
    facts->stage_friction[facts->stage_count++] = number_of(tal_node_get(stage, "friction"), facts->friction);
}

void tal_measure_facts_read(tal_measure_facts *facts, const char *dir) {
  *facts = (tal_measure_facts){.thickness = 1};
  char path[TAL_PATH_SIZE];
  unsigned char *text;
  size_t size;
  tal_file_path(path, dir, "run.json");
  if (tal_file_read(path, &text, &size, NULL))
    return;
  tal_tree tree = {0};
  tal_yaml_error error;
  tal_node *root = tal_yaml_parse(&tree, (const char *)text, size, NULL, &error);
  if (root) {
    facts->thickness = number_of(tal_node_find(root, "thickness"), 1);
    facts->friction = number_of(tal_node_find(root, "scene.material.friction"), 0);
    read_stages(facts, tal_node_find(root, "scene.stages"));
  }
  tal_tree_clear(&tree);
  free(text);
}

void tal_measure_facts_clear(tal_measure_facts *facts) {
  free(facts->stage_friction);
  *facts = (tal_measure_facts){0};
}

double tal_measure_facts_friction(const tal_measure_facts *facts, int64_t stage) {
  return stage >= 0 && (size_t)stage < facts->stage_count ? facts->stage_friction[stage] : facts->friction;
}
