// JSON Schema (draft 7) from the schema table, for editors that complete and check YAML.
#include "scene_keys.h"
#include "scene_schema.h"
#include "scene_value.h"

#include <math.h>
#include <string.h>

static void put_text(FILE *out, const char *text) {
  fputc('"', out);
  for (; *text; text++) {
    if (*text == '"' || *text == '\\')
      fputc('\\', out);
    fputc(*text, out);
  }
  fputc('"', out);
}

static void put_limits(FILE *out, const tal_key *key) {
  if (!isinf(key->low))
    fprintf(out, ", \"%s\": %.17g", key->low_open ? "exclusiveMinimum" : "minimum", key->low);
  if (!isinf(key->high))
    fprintf(out, ", \"%s\": %.17g", key->high_open ? "exclusiveMaximum" : "maximum", key->high);
}

static void put_default(FILE *out, const tal_key *key) {
  double value;
  if (!key->fallback)
    return;
  bool plain = key->type == TAL_KEY_BOOL || key->type == TAL_KEY_VECTOR || key->type == TAL_KEY_LIST ||
               key->type == TAL_KEY_WHOLES || key->type == TAL_KEY_WHOLE;
  if (key->type == TAL_KEY_REAL && (tal_read_real(key->fallback, &value) != TAL_NUMBER_OK || isinf(value)))
    return;
  fputs(", \"default\": ", out);
  if (plain || key->type == TAL_KEY_REAL)
    fputs(key->fallback, out);
  else
    put_text(out, key->fallback);
}

static void put_description(FILE *out, const tal_key *key) {
  char text[600];
  snprintf(text, sizeof text, "%s%s%s%s%s%s%s%s%s%s", key->help, key->unit ? " [" : "", key->unit ? key->unit : "",
           key->unit ? "]" : "", key->note ? "; default: " : "", key->note ? key->note : "",
           key->selector ? "; only with " : "", key->selector ? key->selector : "", key->selector ? ": " : "",
           key->selector ? key->only : "");
  fputs(", \"description\": ", out);
  put_text(out, text);
}

static void put_group(FILE *out, const tal_key *keys);

static void put_choices(FILE *out, const tal_key *key) {
  tal_choice list[TAL_CHOICES];
  size_t count = key->choices(list, TAL_CHOICES);
  fputs("\"enum\": [", out);
  for (size_t i = 0; i < count; i++) {
    if (i)
      fputs(", ", out);
    put_text(out, list[i].name);
  }
  fputc(']', out);
}

static void put_array(FILE *out, const char *items, size_t least, size_t most) {
  fprintf(out, "\"type\": \"array\", \"items\": %s, \"minItems\": %zu", items, least);
  if (most)
    fprintf(out, ", \"maxItems\": %zu", most);
}

static void put_type(FILE *out, const tal_key *key) {
  const char *number = "{\"type\": \"number\"}";
  const char *pair = "{\"type\": \"array\", \"items\": {\"type\": \"number\"}, \"minItems\": 2, \"maxItems\": 2}";
  switch (key->type) {
  case TAL_KEY_REAL:
    fputs("\"type\": \"number\"", out);
    put_limits(out, key);
    break;
  case TAL_KEY_WHOLE:
    if (key->keys)
      fputs("\"anyOf\": [{", out);
    fputs("\"type\": \"integer\"", out);
    put_limits(out, key);
    if (!key->keys)
      break;
    fputs("}, {", out);
    put_group(out, key->keys);
    fputs("}]", out);
    break;
  case TAL_KEY_BOOL:
    fputs("\"type\": \"boolean\"", out);
    break;
  case TAL_KEY_TEXT:
    fputs("\"type\": [\"string\", \"number\", \"boolean\"]", out);
    break;
  case TAL_KEY_CHOICE:
    put_choices(out, key);
    break;
  case TAL_KEY_VECTOR:
    put_array(out, number, 2, 2);
    break;
  case TAL_KEY_WHOLES:
    put_array(out, "{\"type\": \"integer\", \"minimum\": 0}", 0, 0);
    break;
  case TAL_KEY_PAIRS:
    put_array(out, pair, (size_t)key->low, 0);
    break;
  case TAL_KEY_GROUP:
    put_group(out, key->keys);
    break;
  case TAL_KEY_LIST:
    fprintf(out, "\"type\": \"array\", \"minItems\": %.0f, \"items\": {", key->low);
    put_group(out, key->keys);
    fputc('}', out);
    break;
  case TAL_KEY_FORCED:
    fputs("\"anyOf\": [{\"enum\": [\"nearest\"]}, {\"type\": \"integer\", \"minimum\": 0}, {", out);
    put_array(out, "{\"type\": \"integer\", \"minimum\": 0}", 1, 0);
    fputs("}, {\"type\": \"object\", \"required\": [\"random\"], \"additionalProperties\": false, \"properties\": "
          "{\"random\": {\"type\": \"integer\", \"minimum\": 1}, \"margin\": {\"type\": \"number\", \"minimum\": 0}}}]",
          out);
    break;
  case TAL_KEY_TREE:
    fputs("\"type\": [\"object\", \"array\", \"string\", \"number\", \"boolean\"]", out);
    break;
  }
}

static void put_row(FILE *out, const tal_key *key) {
  fputc('{', out);
  put_type(out, key);
  put_default(out, key);
  put_description(out, key);
  fputc('}', out);
}

static bool required_with(const tal_key *key, const char *value) {
  return key->required && (value ? key->selector && tal_key_exists_with(key, value) : !key->selector);
}

static void put_required(FILE *out, const tal_key *keys, const char *value) {
  bool any = false;
  for (const tal_key *key = keys; key->name; key++) {
    if (!required_with(key, value))
      continue;
    fputs(any ? ", " : ", \"required\": [", out);
    put_text(out, key->name);
    any = true;
  }
  if (any)
    fputc(']', out);
}

// With this value of the selector: which rows hold, which keys may not stand, which must.
static void put_variant(FILE *out, const tal_key *keys, const char *selector, const char *value) {
  fprintf(
      out,
      "{\"if\": {\"properties\": {\"%s\": {\"const\": \"%s\"}}, \"required\": [\"%s\"]}, \"then\": {\"properties\": {",
      selector, value, selector);
  bool any = false;
  for (const tal_key *key = keys; key->name; key++) {
    if (!key->selector || strcmp(key->selector, selector) != 0)
      continue;
    bool here = tal_key_exists_with(key, value);
    const tal_key *row = tal_schema_row(keys, key->name, value);
    if (!here && tal_key_exists_with(row, value))
      continue; // another row of that name holds
    if (!here && tal_schema_row(keys, key->name, NULL) != key)
      continue;
    fprintf(out, "%s\"%s\": ", any ? ", " : "", key->name);
    if (here)
      put_row(out, key);
    else
      fputs("false", out);
    any = true;
  }
  fputc('}', out);
  put_required(out, keys, value);
  fputs("}}", out);
}

static void put_variants(FILE *out, const tal_key *keys) {
  bool any = false;
  for (const tal_key *selector = keys; selector->name; selector++) {
    bool used = false;
    for (const tal_key *key = keys; key->name; key++)
      used = used || (key->selector && strcmp(key->selector, selector->name) == 0);
    tal_choice list[TAL_CHOICES];
    size_t count = used ? selector->choices(list, TAL_CHOICES) : 0;
    for (size_t i = 0; i < count; i++) {
      fputs(any ? ", " : ", \"allOf\": [", out);
      put_variant(out, keys, selector->name, list[i].name);
      any = true;
    }
  }
  if (any)
    fputc(']', out);
}

static void put_group(FILE *out, const tal_key *keys) {
  fputs("\"type\": \"object\", \"additionalProperties\": false, \"properties\": {", out);
  for (const tal_key *key = keys; key->name; key++) {
    bool several = false;
    if (tal_schema_row(keys, key->name, NULL) != key)
      continue;
    for (const tal_key *other = key + 1; other->name; other++)
      several = several || strcmp(other->name, key->name) == 0;
    fprintf(out, "%s\"%s\": ", key == keys ? "" : ", ", key->name);
    if (several)
      fputs("{}", out); // said by the variants below
    else
      put_row(out, key);
  }
  fputc('}', out);
  put_required(out, keys, NULL);
  put_variants(out, keys);
}

void tal_keys_json(FILE *out) {
  fputs("{\"$schema\": \"http://json-schema.org/draft-07/schema#\", \"title\": \"Talus scene\", ", out);
  put_group(out, tal_schema());
  fputs(", \"required\": [\"integrator\"]}\n", out);
}
