#include "ensemble.h"

#include "checkpoint.h"
#include "files.h"
#include "forced.h"
#include "study.h"
#include "study_read.h"
#include "study_state.h"
#include "study_words.h"

#include <stdlib.h>
#include <string.h>

bool tal_ensemble_asked(const tal_scene *scene) {
  if (!scene->stage_count)
    return false;
  const tal_scene_stage *last = &scene->stages[scene->stage_count - 1];
  return last->grain.many || last->grain.random > 0;
}

tal_scene tal_ensemble_confined(const tal_scene *scene) {
  tal_scene confined = *scene;
  confined.stage_count--;
  return confined;
}

tal_status tal_ensemble_check(const tal_scene *scene, tal_error *err) {
  tal_scene still = *scene; // not a stage of it is begun
  tal_sim *sim;
  still.stage_count = 0;
  tal_status status = tal_sim_create(&sim, &still, err);
  if (status)
    return status;
  sim->scene = scene;
  status = tal_forced_check(sim, err);
  tal_sim_free(sim);
  return status;
}

// The grains, drawn in the confined state.
static tal_status draw(const tal_scene *scene, const char *checkpoint, int64_t **ids, size_t *count, tal_error *err) {
  tal_scene confined = tal_ensemble_confined(scene);
  tal_sim *sim;
  tal_run_files files;
  tal_status status = tal_sim_create(&sim, &confined, err);
  if (status)
    return status;
  char *text = tal_scene_text(&confined);
  status = tal_checkpoint_read(checkpoint, sim, text, &files, err);
  free(text);
  if (status == TAL_OK) {
    tal_run_files_clear(&files);
    tal_sim_restored(sim);
    if (!sim->graph.valid)
      tal_graph_refresh(&sim->graph, &sim->grains, NULL);
    sim->scene = scene;
    status = tal_forced_draw(sim, &scene->stages[scene->stage_count - 1], ids, count, err);
  }
  tal_sim_free(sim);
  return status;
}

// One run of the plan; its scene as the child will read it.
static tal_status add_run(tal_study *study, const tal_scene *scene, int64_t id, tal_error *err) {
  tal_tree *tree = &study->tree;
  tal_study_setting *setting = &study->settings[study->setting_count++];
  const char *key = tal_words_format(tree, "stages.%zu.grain=%lld", scene->stage_count - 1, (long long)id);
  *setting = (tal_study_setting){.id = tal_words_format(tree, "grain-%lld", (long long)id),
                                 .label = tal_words_format(tree, "grain %lld", (long long)id),
                                 .value = {TAL_STUDY_OWN, TAL_STUDY_OWN},
                                 .seeds = &study->seeds};
  tal_study_sets_add(&setting->sets, (tal_study_set){key, 0, true});
  const size_t common = study->common.count;
  const char **texts = tal_alloc(common + 2, sizeof *texts);
  for (size_t k = 0; k < common; k++)
    texts[k] = study->common.item[k].text;
  texts[common] = key;
  texts[common + 1] = tal_words_format(tree, "seed=%lld", (long long)scene->seed);
  tal_scene one;
  tal_scene_errors errors;
  tal_status status = tal_scene_load(&one, scene->path, texts, common + 2, &errors);
  free(texts);
  if (status)
    return tal_fail(err, status, "%s", errors.item[0].text);
  char *text = tal_scene_text(&one);
  study->runs[study->run_count++] =
      (tal_study_run){setting->id, study->setting_count - 1, (int64_t)scene->seed, tal_hash(text, strlen(text)), 1};
  free(text);
  tal_scene_clear(&one);
  return TAL_OK;
}

static tal_status plan(tal_study *study, const tal_scene *scene, const tal_ensemble_options *options,
                       const char *checkpoint, tal_error *err) {
  int64_t *ids = NULL;
  size_t count = 0;
  tal_status status = draw(scene, checkpoint, &ids, &count, err);
  study->path = tal_strdup(scene->path);
  study->name = tal_strdup(scene->name);
  study->scene = tal_strdup(scene->path);
  study->scene_path = tal_strdup(scene->path);
  study->from = tal_words_format(&study->tree, "%s", checkpoint);
  for (size_t k = 0; k < options->set_count; k++)
    tal_study_sets_add(&study->common,
                       (tal_study_set){tal_words_format(&study->tree, "%s", options->sets[k]), 0, true});
  study->settings = tal_alloc(count, sizeof *study->settings);
  study->runs = tal_alloc(count, sizeof *study->runs);
  for (size_t k = 0; k < count && status == TAL_OK; k++)
    status = add_run(study, scene, ids[k], err);
  free(ids);
  return status;
}

static void sum_up(const tal_study *study, const char *dir, tal_ensemble_result *result) {
  result->grains = study->run_count;
  for (size_t r = 0; r < study->run_count; r++) {
    const tal_study_state state = tal_study_state_read(study, &study->runs[r], dir);
    if (state.status == TAL_RUN_FAILED && !result->failed++)
      snprintf(result->reason, sizeof result->reason, "%.100s: %.280s", study->runs[r].id, state.reason);
    result->unfinished += state.status == TAL_RUN_MISSING || state.status == TAL_RUN_UNFINISHED;
  }
}

tal_status tal_ensemble_run(const tal_scene *scene, const tal_ensemble_options *options, tal_ensemble_result *result,
                            tal_error *err) {
  char checkpoint[TAL_PATH_SIZE];
  tal_study study = {0};
  *result = (tal_ensemble_result){0};
  tal_file_path(checkpoint, options->dir, "checkpoint.h5");
  tal_status status = plan(&study, scene, options, checkpoint, err);
  if (status == TAL_OK)
    status = tal_study_plan_write(&study, options->dir, err);
  const tal_study_options how = {options->dir, options->program, options->cores, options->quiet};
  if (status == TAL_OK)
    status = tal_study_run_all(&study, &how, err);
  if (status == TAL_OK)
    sum_up(&study, options->dir, result);
  tal_study_clear(&study);
  return status;
}
