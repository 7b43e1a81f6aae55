// Hard cases: one row of a table each. A case asserts what must hold and then says in a row what it measured, where the
// limit lies and what happens beyond it. `make test` runs the short form and sees only whether it holds; `make hard`
// sets HARD=plain and LONG=1 sets HARD=long: larger sizes, and the rows are printed (tests/hard.sh puts them together).
#ifndef TAL_TEST_HARD_H
#define TAL_TEST_HARD_H

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct hard_row {
  const char *name;     // of the case
  const char *dial;     // what was varied, and how far
  const char *holds;    // what must hold, and where the right answer comes from
  const char *measured; // what was found
  const char *limit;    // where it ends
  const char *beyond;   // what happens there
} hard_row;

static inline int hard_form(void) {
  const char *form = getenv("HARD");
  return !form ? 0 : strcmp(form, "long") == 0 ? 2 : 1;
}

// A size or a number of steps by form.
static inline int64_t hard_size(int64_t in_test, int64_t plain, int64_t longest) {
  const int64_t sizes[] = {in_test, plain, longest};
  return sizes[hard_form()];
}

// A text for a row, valid until sixteen more have been made.
__attribute__((format(printf, 1, 2))) static inline const char *hard_text(const char *format, ...) {
  static char text[16][400];
  static int next;
  char *here = text[next++ % 16];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(here, sizeof text[0], format, arguments);
  va_end(arguments);
  return here;
}

static inline void hard_report(const hard_row *row) {
  if (hard_form() == 0)
    return;
  printf("| %s | %s | %s | %s | %s | %s |\n", row->name, row->dial, row->holds, row->measured, row->limit, row->beyond);
  fflush(stdout);
}

#endif
