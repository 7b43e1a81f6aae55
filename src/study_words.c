#include "study_words.h"

#include "scene_value.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define LETTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
#define DIGITS  "0123456789"

// A scalar keeps its meaning bare when no character of it can mean anything else inside [] or {}.
static void put_scalar(FILE *out, const tal_node *node) {
  const bool bare = !node->quoted && *node->text && !node->text[strspn(node->text, LETTERS DIGITS "._+-/~%")];
  if (bare) {
    fputs(node->text, out);
    return;
  }
  fputc('"', out);
  for (const char *c = node->text; *c; c++) {
    if (*c == '"' || *c == '\\')
      fprintf(out, "\\%c", *c);
    else if ((unsigned char)*c < ' ')
      fprintf(out, "\\x%02x", (unsigned)*c);
    else
      fputc(*c, out);
  }
  fputc('"', out);
}

// As deep as the YAML reader allows.
static void put_node(FILE *out, const tal_node *node) {
  if (node->kind == TAL_NODE_SCALAR) {
    put_scalar(out, node);
    return;
  }
  const bool map = node->kind == TAL_NODE_MAP;
  fputc(map ? '{' : '[', out);
  for (const tal_node *child = node->child; child; child = child->next) {
    if (map)
      fprintf(out, "%s: ", child->key);
    put_node(out, child);
    if (child->next)
      fputs(", ", out);
  }
  fputc(map ? '}' : ']', out);
}

const char *tal_words_of_node(tal_tree *tree, const tal_node *node) {
  char *text = NULL;
  size_t size = 0;
  FILE *out = tal_text_begin(&text, &size);
  put_node(out, node);
  tal_text_end(out);
  const char *copy = tal_tree_copy(tree, text, size);
  free(text);
  return copy;
}

const char *tal_words_format(tal_tree *tree, const char *format, ...) {
  char *text;
  size_t size;
  FILE *out = tal_text_begin(&text, &size);
  va_list args;
  va_start(args, format);
  vfprintf(out, format, args);
  va_end(args);
  tal_text_end(out);
  const char *copy = tal_tree_copy(tree, text, size);
  free(text);
  return copy;
}

const char *tal_words_slug(tal_tree *tree, const char *text) {
  char *slug = tal_tree_copy(tree, text, strlen(text)), *to = slug;
  for (const char *from = text; *from; from++) {
    if (strchr(LETTERS DIGITS ".+_-", *from))
      *to++ = *from;
    else if (to > slug && to[-1] != '-')
      *to++ = '-';
  }
  while (to > slug && to[-1] == '-')
    to--;
  *to = '\0';
  if (slug[strspn(slug, ".")] == '\0')
    return "value";
  return slug;
}

void tal_words_shell(FILE *out, const char *word) {
  if (*word && !word[strspn(word, LETTERS DIGITS "._+-/=:,@%")]) {
    fputs(word, out);
    return;
  }
  fputc('\'', out);
  for (; *word; word++)
    fputs(*word == '\'' ? "'\\''" : (char[]){*word, '\0'}, out);
  fputc('\'', out);
}

void tal_words_csv(FILE *out, const char *field) {
  if (!field[strcspn(field, ",\"\r\n")]) {
    fputs(field, out);
    return;
  }
  fputc('"', out);
  for (; *field; field++)
    fputs(*field == '"' ? "\"\"" : (char[]){*field, '\0'}, out);
  fputc('"', out);
}

void tal_words_number(FILE *out, double value) {
  char text[40];
  tal_print_real(value, text, sizeof text);
  fputs(isnan(value) ? "nan" : isinf(value) ? (value > 0 ? "inf" : "-inf") : text, out);
}
