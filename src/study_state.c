// See study_state.h. run.json is read with the scene's YAML reader: JSON is a part of YAML.
#include "study_state.h"

#include "files.h"
#include "scene_value.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *tal_study_status_name(tal_study_status status) {
  static const char *const names[] = {"missing", "unfinished", "done", "failed"};
  return names[status];
}

void tal_study_log(char *path, size_t size, const char *dir, const tal_study_run *run) {
  snprintf(path, size, "%s/logs/%s.log", dir, run->id);
}

static double number(const tal_node *node) {
  double value;
  return node && node->kind == TAL_NODE_SCALAR && tal_read_real(node->text, &value) == TAL_NUMBER_OK ? value
                                                                                                     : (double)NAN;
}

static const char *text_of(const tal_node *map, const char *key) {
  const tal_node *node = tal_node_get(map, key);
  return node && node->kind == TAL_NODE_SCALAR ? node->text : "";
}

// The last line of the log that holds something; "" when there is none.
static void last_line(char *out, size_t size, const char *path) {
  unsigned char *bytes;
  size_t length;
  *out = '\0';
  if (tal_file_read(path, &bytes, &length, NULL) != TAL_OK)
    return;
  while (length && strchr("\r\n ", bytes[length - 1]))
    length--;
  size_t begin = length;
  while (begin && bytes[begin - 1] != '\n')
    begin--;
  snprintf(out, size, "%.*s", (int)(length - begin), (const char *)bytes + begin);
  free(bytes);
}

static bool counts(const tal_study *study, size_t stage) {
  for (size_t k = 0; k < study->cost_stage_count; k++)
    if ((size_t)study->cost_stages[k] == stage)
      return true;
  return study->cost_stage_count == 0;
}

static void read_cost(tal_study_state *state, const tal_study *study, const tal_node *root) {
  const tal_node *stages = tal_node_get(root, "stages");
  double steps = 0, cpu = 0;
  size_t k = 0;
  for (const tal_node *stage = stages ? stages->child : NULL; stage; stage = stage->next, k++) {
    if (!counts(study, k))
      continue;
    steps += number(tal_node_get(stage, "steps"));
    cpu += number(tal_node_get(stage, "cpu_time"));
  }
  state->cpu_time = cpu;
  state->grain_steps = steps * number(tal_node_get(root, "grains"));
}

static bool same_scene(const tal_node *root, uint64_t hash) {
  const char *text = text_of(root, "scene_text");
  return tal_hash(text, strlen(text)) == hash;
}

static void judge(tal_study_state *state, const tal_study *study, const tal_study_run *run, const tal_node *root,
                  const char *log) {
  const char *status = text_of(root, "status");
  if (!same_scene(root, run->scene)) {
    *state = (tal_study_state){.status = TAL_RUN_FAILED, .final = true};
    snprintf(state->reason, sizeof state->reason, "the folder holds a run of another scene");
  } else if (strcmp(status, "done") == 0) {
    state->status = TAL_RUN_DONE;
    *state->reason = '\0';
    read_cost(state, study, root);
  } else if (strcmp(status, "invalid") == 0) {
    state->status = TAL_RUN_FAILED;
    state->final = true;
    snprintf(state->reason, sizeof state->reason, "%.390s", text_of(root, "reason"));
  } else if (strcmp(status, "interrupted") == 0 || !*log) {
    state->status = TAL_RUN_UNFINISHED;
    snprintf(state->reason, sizeof state->reason, "unfinished at t = %.6g s", number(tal_node_get(root, "time")));
  }
}

tal_study_state tal_study_state_read(const tal_study *study, const tal_study_run *run, const char *dir) {
  tal_study_state state = {.status = TAL_RUN_MISSING, .cpu_time = (double)NAN, .grain_steps = (double)NAN};
  char folder[TAL_PATH_SIZE], path[TAL_PATH_SIZE + 16];
  tal_study_log(path, sizeof path, dir, run);
  last_line(state.reason, sizeof state.reason, path);
  char log[sizeof state.reason];
  memcpy(log, state.reason, sizeof log);
  if (*log)
    state.status = TAL_RUN_FAILED;
  else
    snprintf(state.reason, sizeof state.reason, "not begun");
  tal_study_folder(folder, sizeof folder, dir, run);
  snprintf(path, sizeof path, "%s/run.json", folder);
  unsigned char *bytes;
  size_t size;
  if (tal_file_read(path, &bytes, &size, NULL) != TAL_OK)
    return state;
  tal_tree tree = {0};
  tal_yaml_error error;
  tree.root = tal_yaml_parse(&tree, (const char *)bytes, size, NULL, &error);
  free(bytes);
  if (tree.root)
    judge(&state, study, run, tree.root, log);
  tal_tree_clear(&tree);
  return state;
}
