// See checkpoint.h. Groups: /run and /files (attributes), /frames, /grains, /contacts, /wall_contacts, /walls, /graph,
// /minimal; the scene is the text /scene. Slots are kept where history hangs on them (a spring); the others follow from
// the centres.
#include "checkpoint.h"

#include "files.h"
#include "forces.h"
#include "store.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// A field list's `kept` chooses between these.
#define IF_STATE(...) __VA_ARGS__
#define IF_WORK(...)
#define IF_PAST(...)   __VA_ARGS__
#define IF_SOLVED(...) __VA_ARGS__
#define IF_DAMPED(...)
#define IF_SEEN(...)
#define IF_WALL(...)
#define PUT_int64_t tal_store_put_integer
#define PUT_double  tal_store_put_number
#define GET_int64_t tal_store_get_integer
#define GET_double  tal_store_get_number

void tal_run_files_clear(tal_run_files *files) {
  free(files->frame);
  *files = (tal_run_files){.series_step = -1, .tracks_step = -1};
}

void tal_run_files_add_frame(tal_run_files *files, tal_frame_mark frame) {
  if (files->frame_count == files->frame_capacity) {
    files->frame_capacity = files->frame_capacity ? 2 * files->frame_capacity : 64;
    files->frame = tal_grow(files->frame, files->frame_count, files->frame_capacity, sizeof *files->frame);
  }
  files->frame[files->frame_count++] = frame;
}

// ---- writing ----

static void put_head(tal_store *store, const tal_sim *sim, const char *scene_text, const tal_run_files *files) {
  tal_store_put_integer(store, "format", TAL_CHECKPOINT_FORMAT);
  tal_store_put_integer(store, "scene_hash", (int64_t)tal_hash(scene_text, strlen(scene_text)));
  tal_store_put_text(store, "version", TAL_VERSION);
  tal_store_put_text(store, "scene", scene_text);
  tal_store_group(store, "run");
#define X(type, name, unit, meaning) PUT_##type(store, #name, sim->run.name);
  TAL_RUN_FIELDS(X)
#undef X
  tal_store_put_integer(store, "grain_count", (int64_t)sim->grains.count);
  tal_store_put_integer(store, "complete", tal_sim_done(sim));
  tal_store_group(store, "files");
#define X(type, name, unit, meaning) PUT_##type(store, #name, files->name);
  TAL_RUN_FILES_FIELDS(X)
#undef X
}

static void put_frames(tal_store *store, const tal_run_files *files) {
  tal_store_group(store, "frames");
#define X(type, name, unit, meaning)                                                                                   \
  {                                                                                                                    \
    type *column = tal_alloc(files->frame_count, sizeof *column);                                                      \
    for (size_t k = 0; k < files->frame_count; k++)                                                                    \
      column[k] = files->frame[k].name;                                                                                \
    tal_store_put(store, TAL_ARRAY(#name, unit, column, files->frame_count));                                          \
    free(column);                                                                                                      \
  }
  TAL_FRAME_MARK_FIELDS(X)
#undef X
}

static void put_grains(tal_store *store, const tal_grains *grains) {
  tal_store_group(store, "grains");
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept(tal_store_put(store, TAL_ARRAY(#name, unit, grains->name, grains->count));)
  TAL_GRAIN_FIELDS(X)
#undef X
}

static size_t *kept_slots(const tal_contacts *contacts, size_t *count) {
  size_t *kept = tal_alloc(contacts->count, sizeof *kept);
  *count = 0;
  for (size_t c = 0; c < contacts->count; c++) {
    if (contacts->overlap[c] > 0 || (contacts->spring && contacts->spring[c] != 0))
      kept[(*count)++] = c;
  }
  return kept;
}

static void put_contacts(tal_store *store, const char *group, const tal_contacts *contacts) {
  size_t count;
  size_t *kept_slot = kept_slots(contacts, &count);
  tal_store_group(store, group);
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept({                                                                                                          \
    type *column = tal_alloc(count, sizeof *column);                                                                   \
    for (size_t k = 0; k < count; k++)                                                                                 \
      column[k] = contacts->name ? contacts->name[kept_slot[k]] : 0;                                                   \
    tal_store_put(store, TAL_ARRAY(#name, unit, column, count));                                                       \
    free(column);                                                                                                      \
  })
  TAL_CONTACT_FIELDS(X)
#undef X
  free(kept_slot);
}

static void put_walls(tal_store *store, const tal_walls *walls) {
  tal_store_group(store, "walls");
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept({                                                                                                          \
    type *column = tal_alloc(walls->count, sizeof *column);                                                            \
    for (size_t w = 0; w < walls->count; w++)                                                                          \
      column[w] = walls->wall[w].name;                                                                                 \
    tal_store_put(store, TAL_ARRAY(#name, unit, column, walls->count));                                                \
    free(column);                                                                                                      \
  })
  TAL_WALL_FIELDS(X)
#undef X
}

static void put_graph(tal_store *store, const tal_graph *graph) {
  if (!graph->valid)
    return;
  tal_store_group(store, "graph");
  const size_t triangles = graph->mesh.triangle_count;
  int32_t *corner = triangles ? graph->mesh.corner[0] : NULL;
  tal_store_put(store, &(tal_array){"corner", "1", TAL_STORE_INT32, triangles, 3, corner});
  tal_store_put(store, TAL_ARRAY("inside", "1", graph->inside, triangles));
  tal_store_put(store, TAL_ARRAY("node", "1", graph->loop.node, graph->loop.count));
  tal_store_put(store, TAL_ARRAY("x", "m", graph->x, graph->grain_count));
  tal_store_put(store, TAL_ARRAY("y", "m", graph->y, graph->grain_count));
}

static void put_membrane(tal_store *store, const tal_membrane *membrane) {
  tal_store_group(store, "membrane");
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept(tal_store_put(store, TAL_ARRAY(#name, unit, membrane->name, membrane->count));)
  TAL_BEAD_FIELDS(X)
#undef X
}

// Forces by which a minimal boundary held its rows at the last step.
static void put_multipliers(tal_store *store, const tal_rows *rows) {
  tal_store_group(store, "minimal");
  tal_store_put(store, TAL_ARRAY("multiplier", "Pa", (double *)rows->multiplier, TAL_ROWS_MOST));
}

tal_status tal_checkpoint_write(const char *path, const char *previous, tal_sim *sim, const char *scene_text,
                                const tal_run_files *files, tal_error *err) {
  tal_store store;
  tal_implicit_save(sim);
  tal_forces_expand(sim);
  tal_store_begin(&store);
  put_head(&store, sim, scene_text, files);
  put_frames(&store, files);
  put_grains(&store, &sim->grains);
  put_contacts(&store, "contacts", &sim->pairs);
  put_contacts(&store, "wall_contacts", &sim->wall_contacts);
  put_walls(&store, &sim->walls);
  put_graph(&store, &sim->graph);
  put_multipliers(&store, &sim->rows);
  put_membrane(&store, &sim->membrane);
  return tal_store_save(&store, path, previous, err);
}

// ---- reading ----

static tal_status open_checked(tal_store *store, const char *path, tal_error *err) {
  tal_status status = tal_store_open(store, path, err);
  if (status != TAL_OK)
    return status;
  int64_t format = tal_store_get_integer(store, "format");
  if (format != TAL_CHECKPOINT_FORMAT && !store->failed) {
    char *version = tal_store_get_text(store, "version");
    status = tal_fail(err, TAL_BAD_INPUT, "%s was written by talus %s (format %lld); talus %s reads format %d", path,
                      version, (long long)format, TAL_VERSION, TAL_CHECKPOINT_FORMAT);
    free(version);
  } else {
    status = tal_store_status(store, err);
  }
  if (status != TAL_OK)
    tal_store_close(store);
  return status;
}

static void get_frames(tal_store *store, tal_run_files *files) {
  tal_store_group(store, "frames");
  files->frame_count = files->frame_capacity = tal_store_rows(store, "time");
  files->frame = tal_alloc(files->frame_count, sizeof *files->frame);
#define X(type, name, unit, meaning)                                                                                   \
  {                                                                                                                    \
    type *column = tal_alloc(files->frame_count, sizeof *column);                                                      \
    tal_store_get(store, TAL_ARRAY(#name, unit, column, files->frame_count));                                          \
    for (size_t k = 0; k < files->frame_count; k++)                                                                    \
      files->frame[k].name = column[k];                                                                                \
    free(column);                                                                                                      \
  }
  TAL_FRAME_MARK_FIELDS(X)
#undef X
}

static void get_head(tal_store *store, tal_checkpoint_head *head) {
  *head = (tal_checkpoint_head){0};
  tal_store_group(store, "run");
#define X(type, name, unit, meaning) head->run.name = GET_##type(store, #name);
  TAL_RUN_FIELDS(X)
#undef X
  head->grain_count = tal_store_get_integer(store, "grain_count");
  head->complete = tal_store_get_integer(store, "complete") != 0;
  tal_store_group(store, "files");
#define X(type, name, unit, meaning) head->files.name = GET_##type(store, #name);
  TAL_RUN_FILES_FIELDS(X)
#undef X
  get_frames(store, &head->files);
}

tal_status tal_checkpoint_peek(const char *path, tal_checkpoint_head *head, tal_error *err) {
  tal_store store;
  *head = (tal_checkpoint_head){0};
  tal_status status = open_checked(&store, path, err);
  if (status != TAL_OK)
    return status;
  get_head(&store, head);
  status = tal_store_status(&store, err);
  tal_store_close(&store);
  if (status != TAL_OK)
    tal_run_files_clear(&head->files);
  return status;
}

static int length_of_line(const char *line) {
  size_t length = strcspn(line, "\n");
  return length < 100 ? (int)length : 100;
}

// Names the first line in which two scenes differ.
static tal_status foreign_scene(const char *path, const char *theirs, const char *ours, tal_error *err) {
  size_t line = 1, start = 0;
  for (size_t k = 0; theirs[k] && theirs[k] == ours[k]; k++) {
    if (theirs[k] != '\n')
      continue;
    line++;
    start = k + 1;
  }
  const char *a = theirs + start, *b = ours + start;
  return tal_fail(err, TAL_BAD_INPUT,
                  "%s belongs to another scene: line %zu of the resolved scene is \"%.*s\" there and \"%.*s\" here",
                  path, line, length_of_line(a), a, length_of_line(b), b);
}

static tal_status check_scene(tal_store *store, const tal_sim *sim, const char *ours, tal_error *err) {
  tal_store_group(store, "/");
  int64_t hash = tal_store_get_integer(store, "scene_hash");
  char *theirs = tal_store_get_text(store, "scene");
  tal_status status = tal_store_status(store, err);
  if (status == TAL_OK && (hash != (int64_t)tal_hash(ours, strlen(ours)) || strcmp(theirs, ours) != 0)) {
    status = foreign_scene(store->path, theirs, ours, err);
  }
  free(theirs);
  tal_store_group(store, "run");
  int64_t grains = tal_store_get_integer(store, "grain_count");
  if (status == TAL_OK && grains != (int64_t)sim->grains.count) {
    status = tal_fail(err, TAL_BAD_INPUT, "%s holds %lld grains, the scene makes %zu", store->path, (long long)grains,
                      sim->grains.count);
  }
  return status;
}

static void get_grains(tal_store *store, tal_grains *grains) {
  tal_store_group(store, "grains");
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept(tal_store_get(store, TAL_ARRAY(#name, unit, grains->name, grains->count));)
  TAL_GRAIN_FIELDS(X)
#undef X
}

static void get_contacts(tal_store *store, const char *group, tal_contacts *contacts) {
  tal_store_group(store, group);
  const size_t count = tal_store_rows(store, "i");
  tal_contacts_clear(contacts);
  tal_contacts_reserve(contacts, count);
  contacts->count = count;
#define X(type, name, unit, kept, meaning)                                                                             \
  if (count)                                                                                                           \
    memset(contacts->name, 0, count * sizeof *contacts->name);                                                         \
  IF_##kept(tal_store_get(store, TAL_ARRAY(#name, unit, contacts->name, count));)
  TAL_CONTACT_FIELDS(X)
#undef X
}

static void get_walls(tal_store *store, tal_walls *walls) {
  tal_store_group(store, "walls");
  const size_t count = tal_store_rows(store, "x0");
  tal_walls_clear(walls);
  for (size_t w = 0; w < count; w++)
    tal_walls_add(walls);
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept({                                                                                                          \
    type *column = tal_alloc(count, sizeof *column);                                                                   \
    tal_store_get(store, TAL_ARRAY(#name, unit, column, count));                                                       \
    for (size_t w = 0; w < count; w++)                                                                                 \
      walls->wall[w].name = column[w];                                                                                 \
    free(column);                                                                                                      \
  })
  TAL_WALL_FIELDS(X)
#undef X
}

static void get_membrane(tal_store *store, tal_membrane *membrane) {
  tal_store_group(store, "membrane");
  tal_membrane_init(membrane, tal_store_rows(store, "x"));
#define X(type, name, unit, kept, meaning)                                                                             \
  IF_##kept(tal_store_get(store, TAL_ARRAY(#name, unit, membrane->name, membrane->count));)
  TAL_BEAD_FIELDS(X)
#undef X
}

static bool below(const int32_t *index, size_t count, size_t limit) {
  for (size_t k = 0; k < count; k++) {
    if (index[k] < 0 || (size_t)index[k] >= limit)
      return false;
  }
  return true;
}

static void get_graph(tal_store *store, tal_graph *graph, size_t grains) {
  tal_store_group(store, "/");
  if (!tal_store_has(store, "graph")) {
    graph->valid = false;
    return;
  }
  tal_store_group(store, "graph");
  const size_t triangles = tal_store_rows(store, "corner"), nodes = tal_store_rows(store, "node");
  int32_t(*corner)[3] = tal_alloc(triangles, sizeof *corner), *node = tal_alloc(nodes, sizeof *node);
  unsigned char *inside = tal_alloc(triangles, 1);
  double *x = tal_alloc(grains, sizeof *x), *y = tal_alloc(grains, sizeof *y);
  tal_store_get(store, &(tal_array){"corner", NULL, TAL_STORE_INT32, triangles, 3, corner});
  tal_store_get(store, TAL_ARRAY("inside", NULL, inside, triangles));
  tal_store_get(store, TAL_ARRAY("node", NULL, node, nodes));
  tal_store_get(store, TAL_ARRAY("x", NULL, x, grains));
  tal_store_get(store, TAL_ARRAY("y", NULL, y, grains));
  if (!store->failed && (!below(corner[0], 3 * triangles, grains) || !below(node, nodes, grains))) {
    store->failed = true;
    snprintf(store->what, sizeof store->what, "the graph names grains that are not there");
  }
  if (!store->failed)
    tal_graph_restore(graph, grains, (const int32_t(*)[3])corner, triangles, node, nodes, inside, x, y);
  free(corner);
  free(node);
  free(inside);
  free(x);
  free(y);
}

static void check_slots(tal_store *store, const tal_sim *sim) {
  const tal_contacts *pairs = &sim->pairs, *walls = &sim->wall_contacts;
  const size_t grains = sim->grains.count;
  if (store->failed || (below(pairs->i, pairs->count, grains) && below(pairs->j, pairs->count, grains) &&
                        below(walls->i, walls->count, grains) && below(walls->j, walls->count, sim->walls.count))) {
    return;
  }
  store->failed = true;
  snprintf(store->what, sizeof store->what, "contacts name grains or walls that are not there");
}

tal_status tal_checkpoint_read(const char *path, tal_sim *sim, const char *scene_text, tal_run_files *files,
                               tal_error *err) {
  *files = (tal_run_files){.series_step = -1, .tracks_step = -1};
  tal_store store;
  tal_status status = open_checked(&store, path, err);
  if (status != TAL_OK)
    return status;
  status = check_scene(&store, sim, scene_text, err);
  if (status == TAL_OK) {
    tal_checkpoint_head head;
    get_head(&store, &head);
    get_grains(&store, &sim->grains);
    get_contacts(&store, "contacts", &sim->pairs);
    get_contacts(&store, "wall_contacts", &sim->wall_contacts);
    get_walls(&store, &sim->walls);
    get_graph(&store, &sim->graph, sim->grains.count);
    tal_store_group(&store, "minimal");
    tal_store_get(&store, TAL_ARRAY("multiplier", NULL, sim->rows.multiplier, TAL_ROWS_MOST));
    get_membrane(&store, &sim->membrane);
    check_slots(&store, sim);
    sim->run = head.run;
    *files = head.files;
    status = tal_store_status(&store, err);
  }
  tal_store_close(&store);
  if (status != TAL_OK)
    tal_run_files_clear(files);
  return status;
}
