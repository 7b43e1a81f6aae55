// See measure_select.h.
#include "measure_select.h"

#include "figures_data.h"
#include "files.h"
#include "scene_value.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Strains of frames are multiples of a step, up to round-off.
static const double hair = 1e-9;

static void span(const tal_frame_choice *choice, bool inside, bool times, double range[2]) {
  range[0] = HUGE_VAL;
  range[1] = -HUGE_VAL;
  for (size_t k = 0; k < choice->frames.count; k++) {
    const tal_frame_entry *entry = &choice->frames.entry[k];
    const double value = times ? entry->time : entry->axial_strain;
    if (inside && !choice->in[k])
      continue;
    range[0] = fmin(range[0], value);
    range[1] = fmax(range[1], value);
  }
}

static bool take_end(const char *text, size_t length, double otherwise, double *value) {
  char word[64];
  *value = otherwise;
  if (length == 0)
    return true;
  snprintf(word, sizeof word, "%.*s", (int)length, text);
  return length < sizeof word && tal_read_real(word, value) == TAL_NUMBER_OK;
}

static tal_status take_window(tal_frame_choice *choice, const char *window, tal_error *err) {
  const char *colon = window ? strchr(window, ':') : NULL;
  double from = -HUGE_VAL, to = HUGE_VAL, range[2];
  if (window && (!colon || !take_end(window, (size_t)(colon - window), -HUGE_VAL, &from) ||
                 !take_end(colon + 1, strlen(colon + 1), HUGE_VAL, &to) || !(from <= to)))
    return tal_fail(err, TAL_BAD_INPUT, "--window: '%.80s' is no range; accepted: A:B, axial strains, A <= B", window);
  for (size_t k = 0; k < choice->frames.count; k++) {
    const double strain = choice->frames.entry[k].axial_strain;
    choice->in[k] = !window || (strain >= from - hair && strain <= to + hair);
    choice->in_count += choice->in[k];
  }
  span(choice, false, false, range);
  if (choice->in_count)
    return TAL_OK;
  return tal_fail(err, TAL_BAD_INPUT, "--window: no frame lies in %.80s; frames reach from %.6g to %.6g", window,
                  range[0], range[1]);
}

static size_t nearest(const tal_frame_choice *choice, double wanted, bool times) {
  size_t best = 0;
  double least = HUGE_VAL;
  for (size_t k = 0; k < choice->frames.count; k++) {
    const tal_frame_entry *entry = &choice->frames.entry[k];
    const double distance = fabs((times ? entry->time : entry->axial_strain) - wanted);
    if (!choice->in[k] || !(distance < least))
      continue;
    best = k;
    least = distance;
  }
  return best;
}

size_t tal_frame_nearest(const tal_frame_choice *choice, double strain) {
  return nearest(choice, strain, false);
}

static tal_status take_peak(tal_frame_choice *choice, const char *dir, tal_error *err) {
  char path[TAL_PATH_SIZE];
  tal_table series;
  tal_file_path(path, dir, "series.csv");
  tal_status status = tal_table_read(&series, path, err);
  if (status)
    return status;
  const double *strain = tal_table_column(&series, "axial_strain"), *ratio = tal_table_column(&series, "stress_ratio");
  double most = -HUGE_VAL, at = 0;
  for (size_t k = 0; strain && ratio && k < series.rows; k++)
    if (strain[k] > 0 && ratio[k] > most)
      most = ratio[k], at = strain[k];
  tal_table_clear(&series);
  if (!(most > -HUGE_VAL))
    return tal_fail(err, TAL_BAD_INPUT, "--at: peak: %s has no compression yet", path);
  choice->detail[nearest(choice, at, false)] = true;
  return TAL_OK;
}

// A number, which must lie where the frames are: the nearest one is meant, not the last one before nothing.
static tal_status take_value(tal_frame_choice *choice, const char *word, bool times, tal_error *err) {
  double value, range[2];
  if (tal_read_real(word, &value) != TAL_NUMBER_OK)
    return tal_fail(
        err, TAL_BAD_INPUT,
        "--at: '%.80s' is no instant; accepted: an axial strain, t=TIME, frame=NUMBER, first, last, peak, all", word);
  span(choice, true, times, range);
  const double slack = hair + 1e-3 * (range[1] - range[0]);
  if (value < range[0] - slack || value > range[1] + slack)
    return tal_fail(err, TAL_BAD_INPUT, "--at: there is no frame near %.80s; frames reach from %.6g to %.6g", word,
                    range[0], range[1]);
  choice->detail[nearest(choice, value, times)] = true;
  return TAL_OK;
}

static tal_status take_number(tal_frame_choice *choice, const char *word, tal_error *err) {
  int64_t number;
  if (tal_read_whole(word, &number) != TAL_NUMBER_OK || number < 0 || (size_t)number >= choice->frames.count ||
      !choice->in[number])
    return tal_fail(err, TAL_BAD_INPUT, "--at: there is no frame '%.80s'; accepted: a number from 0 to %zu", word,
                    choice->frames.count - 1);
  choice->detail[number] = true;
  return TAL_OK;
}

static tal_status take_word(tal_frame_choice *choice, const char *dir, const char *word, tal_error *err) {
  size_t first = choice->frames.count, last = 0;
  for (size_t k = choice->frames.count; k-- > 0;)
    first = choice->in[k] ? k : first;
  for (size_t k = 0; k < choice->frames.count; k++)
    last = choice->in[k] ? k : last;
  if (strcmp(word, "peak") == 0)
    return take_peak(choice, dir, err);
  if (strncmp(word, "frame=", 6) == 0)
    return take_number(choice, word + 6, err);
  if (strncmp(word, "t=", 2) == 0)
    return take_value(choice, word + 2, true, err);
  if (strcmp(word, "first") == 0)
    choice->detail[first] = true;
  else if (strcmp(word, "last") == 0)
    choice->detail[last] = true;
  else if (strcmp(word, "all") == 0)
    memcpy(choice->detail, choice->in, choice->frames.count * sizeof *choice->in);
  else
    return take_value(choice, word, false, err);
  return TAL_OK;
}

static tal_status take_at(tal_frame_choice *choice, const char *dir, const char *at, tal_error *err) {
  char *words = tal_strdup(at ? at : "last"), *rest = words;
  tal_status status = TAL_OK;
  for (char *word; !status && (word = strsep(&rest, ","));)
    status = take_word(choice, dir, word, err);
  free(words);
  return status;
}

tal_status tal_frame_choose(tal_frame_choice *choice, const char *dir, const char *window, const char *at,
                            tal_error *err) {
  *choice = (tal_frame_choice){0};
  tal_status status = tal_frame_list_read(&choice->frames, dir, err);
  if (!status && choice->frames.count == 0)
    status = tal_fail(err, TAL_BAD_INPUT, "%s holds no field frames (fields/NNNNNN.h5)", dir);
  choice->in = tal_alloc(choice->frames.count, sizeof *choice->in);
  choice->detail = tal_alloc(choice->frames.count, sizeof *choice->detail);
  if (!status)
    status = take_window(choice, window, err);
  if (!status)
    status = take_at(choice, dir, at, err);
  if (status)
    tal_frame_choice_clear(choice);
  return status;
}

void tal_frame_choice_clear(tal_frame_choice *choice) {
  tal_frame_list_clear(&choice->frames);
  free(choice->in);
  free(choice->detail);
  *choice = (tal_frame_choice){0};
}
