// The hot loops compiled for several widths of vectors give the same bits.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "engine.h"

#include "hot.h"

#include <omp.h>
#include <string.h>

enum { COLUMNS = 19, GRAINS = COLUMNS * 23, STEPS = 300 };

static engine *crowd(const char *rest) {
  draft *d = draft_begin();
  fputs("grains:\n  thickness: 1\n  list:\n", d->to);
  for (int k = 0; k < GRAINS; k++)
    fprintf(d->to, "  - {x: %.17g, y: %.17g, r: %.17g, vx: %.17g, vy: %.17g, fixed: %s}\n", 1.7 * (k % COLUMNS + 0.5),
            1.7 * (k / COLUMNS + 0.5) + 0.05 * (k % 5), 0.85 + 0.1 * sin(k), 2 * sin(2 * k), 2 * cos(3 * k),
            k % 97 == 5 ? "true" : "false");
  fprintf(d->to,
          "material: {young: 1e6, density: 1, friction: 0.5}\ngravity: [-2, -9]\nlimits: {overlap: 1}\n"
          "walls: [{from: [-1, -0.5], to: [40, -0.5]}, {from: [-0.5, 0], to: [-0.5, 50]}]\n"
          "stages: [{kind: free, duration: 10}]\n%s",
          rest);
  return engine_start(d);
}

static void assert_same_state(const tal_sim *a, const tal_sim *b, const char *width, const char *scene) {
#define X(type, member, unit, kept, meaning)                                                                           \
  if (a->grains.member && b->grains.member &&                                                                          \
      memcmp(a->grains.member, b->grains.member, a->grains.count * sizeof(type)) != 0)                                 \
    fail_msg("%s, %s: %s differs", width, scene, #member);
  TAL_GRAIN_FIELDS(X)
#undef X
  if (memcmp(&a->run, &b->run, sizeof a->run) != 0)
    fail_msg("%s, %s: the run differs", width, scene);
}

// EXACT: every width that this processor has against what the rest of the program was compiled for.
static void test_widths(void **state) {
  (void)state;
  static const char *const widths[] = {"v3", "v4"};
  static const char *const scenes[] = {
      "contact: {normal: hertz, tangential: regularised, exponent: 20, vR: 0.01}\nintegrator: {dt: 4e-4, force: "
      "true}\n",
      "contact: {normal: hertz, tangential: spring}\nintegrator: {dt: 4e-4, force: true}\n",
      "contact: {normal: linear, tangential: none, stiffness: 1e5}\nintegrator: {dt: 4e-4, force: true}\n",
      "contact: {normal: hertz, tangential: regularised, exponent: 20, vR: 0.01}\n"
      "integrator: {scheme: implicit_friction, dt: 4e-4, force: true}\n"};
  for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++)
    for (size_t w = 0; w < sizeof widths / sizeof *widths; w++) {
      engine *base = crowd(scenes[s]), *wide = crowd(scenes[s]);
      base->sim->hot = tal_hot_find("base");
      wide->sim->hot = tal_hot_find(widths[w]);
      for (int k = 0; wide->sim->hot && k < STEPS; k++) {
        engine_step(base);
        engine_step(wide);
      }
      if (wide->sim->hot)
        assert_same_state(base->sim, wide->sim, widths[w], scenes[s]);
      else
        print_message("this processor or program has no %s\n", widths[w]);
      engine_end(base);
      engine_end(wide);
    }
}

// EXACT: what a run takes can run, and is the widest there is.
static void test_choice(void **state) {
  (void)state;
  assert_ptr_equal(tal_hot_find(tal_hot_best()->name), tal_hot_best());
  assert_non_null(tal_hot_find("base"));
  assert_null(tal_hot_find("v5"));
  if (tal_hot_find("v4"))
    assert_string_equal(tal_hot_best()->name, "v4");
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_widths), cmocka_unit_test(test_choice)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
