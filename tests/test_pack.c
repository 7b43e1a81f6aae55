// Packings: drop-and-roll against brute force, force balance and a small-step reference; lattices; the cut; the grains.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "pack.h"
#include "radius.h"
#include "random.h"
#include "registry.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static tal_scene box_scene(int64_t count, double width, uint64_t seed) {
  tal_scene scene = {.path = (char *)(uintptr_t) "scene.yaml", .seed = seed, .mass_scaling = 1, .rotation = true};
  scene.grains.count = count;
  scene.grains.radius = (tal_radius){.law = TAL_RADIUS_UNIFORM, .min = 0.5e-3, .max = 1e-3};
  scene.material.density = 2675;
  scene.pack.method = "drop_and_roll";
  scene.pack.width = width;
  scene.pack.cut_radius = (double)NAN;
  scene.line_width = 9;
  return scene;
}

static tal_packing packed(const tal_scene *scene) {
  tal_packing packing;
  tal_error err = {{0}};
  assert_int_equal(tal_pack(scene, &packing, &err), TAL_OK);
  return packing;
}

static double gap(const tal_packing *p, size_t i, size_t j) {
  double dx = p->x[i] - p->x[j], dy = p->y[i] - p->y[j];
  return sqrt(dx * dx + dy * dy) - p->r[i] - p->r[j];
}

static double top(const tal_packing *p) {
  double height = 0;
  for (size_t i = 0; i < p->count; i++)
    height = fmax(height, p->y[i] + p->r[i]);
  return height;
}

// The scenes that drop-and-roll is checked on: the standard one, equal grains (where ties are common), the narrowest
// box, and sizes over a factor of several hundred.
enum { CASES = 5 };
static tal_scene drop_case(int which) {
  tal_scene scene = box_scene(1500, 40e-3, 11);
  if (which == 1)
    scene.grains.radius.min = scene.grains.radius.max;
  if (which == 2)
    scene.pack.width = 4e-3;
  if (which == 3)
    scene.grains.radius =
        (tal_radius){.law = TAL_RADIUS_LOGNORMAL, .median = 0.2e-3, .sigma = 1.2, .min = 1e-5, .max = 8e-3};
  if (which == 4) {
    scene.grains.radius.min = scene.grains.radius.max;
    scene.pack.width = 4e-3;
  }
  return scene;
}

// ROUND: no overlap of two grains, floor or wall beyond a few eps of the packing's extent.
static void no_overlap(void **state) {
  (void)state;
  for (int which = 0; which < CASES; which++) {
    tal_scene scene = drop_case(which);
    tal_packing p = packed(&scene);
    double eps = 8 * DBL_EPSILON * (top(&p) + p.width), deepest = 0;
    for (size_t i = 0; i < p.count; i++) {
      for (size_t j = 0; j < i; j++)
        deepest = fmax(deepest, -gap(&p, i, j));
      assert_true(p.y[i] >= p.r[i] && p.x[i] >= p.r[i] - eps && p.x[i] <= p.width - p.r[i] + eps);
    }
    assert_true(deepest < eps);
    assert_true(p.largest_overlap == deepest);
    tal_packing_clear(&p);
  }
}

// Area [m^2] of the grains inside the box, from their chords on closely spaced horizontal lines.
static double area_by_chords(const tal_packing *p, double x0, double x1, double y0, double y1) {
  const int lines = 20000;
  double area = 0;
  for (int k = 0; k < lines; k++) {
    double y = y0 + (y1 - y0) * (k + 0.5) / lines;
    for (size_t i = 0; i < p->count; i++) {
      double dy = y - p->y[i];
      if (fabs(dy) >= p->r[i])
        continue;
      double half = sqrt(p->r[i] * p->r[i] - dy * dy);
      double chord = fmin(p->x[i] + half, x1) - fmax(p->x[i] - half, x0);
      area += fmax(chord, 0) * (y1 - y0) / lines;
    }
  }
  return area;
}

// EXACT: the bulk coordination is the count of touching neighbours of the grains in the middle half. ROUND: the solid
// fraction is that of chords drawn through the same box (their midpoint rule is good to 1e-6).
static void report_by_brute_force(void **state) {
  (void)state;
  tal_scene scene = box_scene(600, 20e-3, 4);
  tal_packing p = packed(&scene);
  double left = 1, bottom = 1, right = 0, mean = 0;
  for (size_t i = 0; i < p.count; i++) {
    left = fmin(left, p.x[i] - p.r[i]);
    right = fmax(right, p.x[i] + p.r[i]);
    bottom = fmin(bottom, p.y[i] - p.r[i]);
    mean += 2 * p.r[i] / (double)p.count;
  }
  double width = right - left, height = top(&p) - bottom, neighbours = 0, grains = 0;
  double x0 = left + width / 4, x1 = right - width / 4, y0 = bottom + height / 4, y1 = bottom + height * 3 / 4;
  for (size_t i = 0; i < p.count; i++) {
    if (p.x[i] < x0 || p.x[i] >= x1 || p.y[i] < y0 || p.y[i] >= y1)
      continue;
    grains++;
    for (size_t j = 0; j < p.count; j++)
      neighbours += j != i && gap(&p, i, j) < 1e-9 * mean;
  }
  assert_true(p.coordination == neighbours / grains);
  double solid = area_by_chords(&p, x0, x1, y0, y1) / ((x1 - x0) * (y1 - y0));
  assert_true(fabs(p.solid_fraction - solid) < 1e-6);
  tal_packing_clear(&p);
}

// What holds a grain: directions (nx, ny) from the supports into it.
typedef struct supports {
  int count;
  double nx[8], ny[8];
} supports;

static void support(supports *held, double nx, double ny) {
  if (held->count < 8) {
    held->nx[held->count] = nx;
    held->ny[held->count] = ny;
  }
  held->count++;
}

// Earlier grains, walls and floor that touch grain i within 1e-12 of the smaller radius (plus eps of the extent).
static supports supports_of(const tal_packing *p, size_t i, double eps) {
  supports held = {0};
  double near = 1e-12 * p->r[i] + eps;
  for (size_t j = 0; j < i; j++) {
    if (gap(p, i, j) > near)
      continue;
    double reach = p->r[i] + p->r[j];
    support(&held, (p->x[i] - p->x[j]) / reach, (p->y[i] - p->y[j]) / reach);
  }
  if (p->x[i] - p->r[i] <= near)
    support(&held, 1, 0);
  if (p->x[i] + p->r[i] >= p->width - near)
    support(&held, -1, 0);
  return held;
}

// Some pair of supports carries the weight by pushing only: a n1 + b n2 = (0, 1), so a = -n2x / det, b = n1x / det.
static bool carries(const supports *held) {
  for (int a = 0; a < held->count; a++)
    for (int b = 0; b < held->count; b++) {
      double det = held->nx[a] * held->ny[b] - held->nx[b] * held->ny[a];
      if (det > 0 && held->nx[a] > 0 && held->nx[b] < 0)
        return true;
    }
  return false;
}

// ROUND: every grain lies on the floor or is carried by supports on both sides of its centre. Sizes without ties have
// exactly two supports, none more, none fewer.
static void every_grain_is_stable(void **state) {
  (void)state;
  for (int which = 0; which < CASES; which++) {
    tal_scene scene = drop_case(which);
    tal_packing p = packed(&scene);
    double eps = 8 * DBL_EPSILON * (top(&p) + p.width);
    size_t floor = 0;
    for (size_t i = 0; i < p.count; i++) {
      supports held = supports_of(&p, i, eps);
      bool on_floor = p.y[i] == p.r[i];
      floor += on_floor;
      assert_true(on_floor || carries(&held));
      if (which != 1 && which != 4 && !on_floor)
        assert_int_equal(held.count, 2);
    }
    assert_true(floor >= 1);
    tal_packing_clear(&p);
  }
}

// The reference: the same fall and roll in small steps of angle, every earlier grain looked at in every step.
typedef struct walker {
  double x, y, r;
} walker;

static double walker_gap(const tal_packing *p, const walker *w, size_t j) {
  return sqrt((w->x - p->x[j]) * (w->x - p->x[j]) + (w->y - p->y[j]) * (w->y - p->y[j])) - w->r - p->r[j];
}

static long reference_fall(const tal_packing *p, size_t count, walker *w, long skip) {
  double best = w->r;
  long on = -1;
  for (size_t j = 0; j < count; j++) {
    double reach = w->r + p->r[j], dx = w->x - p->x[j];
    if ((long)j == skip || fabs(dx) >= reach || p->y[j] >= w->y)
      continue;
    double height = p->y[j] + sqrt(reach * reach - dx * dx);
    if (height <= best)
      continue;
    best = height;
    on = (long)j;
  }
  w->y = best;
  return on;
}

// First grain other than `on` that the walker is inside of by more than `depth`; -1 none, -2 wall, -3 floor.
static long inside_of(const tal_packing *p, size_t count, const walker *w, long on, double depth) {
  if (w->x < w->r - depth || w->x > p->width - w->r + depth)
    return -2;
  if (w->y < w->r - depth)
    return -3;
  for (size_t j = 0; j < count; j++)
    if ((long)j != on && walker_gap(p, w, j) < -depth)
      return (long)j;
  return -1;
}

static walker at_angle(const tal_packing *p, long on, double r, double side, double angle) {
  double reach = r + p->r[on];
  return (walker){p->x[on] + side * reach * sin(angle), p->y[on] + reach * cos(angle), r};
}

// Rolls about `on` (angle from the vertical grows); returns what stopped it, -1 when it came level with its support.
static long reference_roll(const tal_packing *p, size_t count, walker *w, long on, double side) {
  const double step = 2e-3, depth = 1e-9 * w->r;
  double angle = atan2(side * (w->x - p->x[on]), w->y - p->y[on]);
  for (; angle < TAL_PI / 2; angle += step) {
    walker next = at_angle(p, on, w->r, side, angle + step);
    if (inside_of(p, count, &next, on, depth) == -1)
      continue;
    double low = angle, high = angle + step;
    for (int k = 0; k < 60; k++) {
      double middle = 0.5 * (low + high);
      next = at_angle(p, on, w->r, side, middle);
      *(inside_of(p, count, &next, on, depth) == -1 ? &low : &high) = middle;
    }
    if (high > TAL_PI / 2)
      break;
    *w = at_angle(p, on, w->r, side, high);
    return inside_of(p, count, w, on, depth);
  }
  *w = at_angle(p, on, w->r, side, TAL_PI / 2);
  return -1;
}

static void reference_drop(const tal_packing *p, size_t count, walker *w) {
  long on = -1;
  for (;;) {
    on = reference_fall(p, count, w, on);
    if (on < 0)
      return;
    double side = w->x >= p->x[on] ? 1 : -1;
    for (;;) {
      long met = reference_roll(p, count, w, on, side);
      if (met == -1)
        break;
      if (met < -1 || side * (p->x[met] - w->x) > 0)
        return;
      on = met;
    }
  }
}

// Each grain ends where a small-step reference ends (to 1e-6 radii), given the bed of the grains before it.
static void agrees_with_small_steps(void **state) {
  (void)state;
  for (uint64_t seed = 1; seed <= 4; seed++) {
    tal_scene scene = box_scene(160, 14e-3, seed);
    if (seed > 2)
      scene.grains.radius =
          (tal_radius){.law = TAL_RADIUS_LOGNORMAL, .median = 0.5e-3, .sigma = 0.8, .min = 0.1e-3, .max = 3e-3};
    tal_packing p = packed(&scene);
    gsl_rng *rng = tal_random_stream(seed, TAL_STREAM_DROP);
    for (size_t i = 0; i < p.count; i++) {
      walker w = {p.r[i] + gsl_rng_uniform(rng) * (p.width - 2 * p.r[i]), 1.0, p.r[i]};
      reference_drop(&p, i, &w);
      assert_true(hypot(w.x - p.x[i], w.y - p.y[i]) < 1e-6 * p.r[i]);
    }
    gsl_rng_free(rng);
    tal_packing_clear(&p);
  }
}

typedef struct sample {
  double mean, error; // mean and its standard error
} sample;

static sample sample_of(const double *value, size_t n) {
  sample s = {0, 0};
  for (size_t k = 0; k < n; k++)
    s.mean += value[k] / (double)n;
  for (size_t k = 0; k < n; k++)
    s.error += (value[k] - s.mean) * (value[k] - s.mean);
  s.error = sqrt(s.error / (double)(n * (n - 1)));
  return s;
}

// Mean height of the surface: of the highest point of any grain above equally spaced places.
static double surface_height(const tal_packing *p) {
  const int places = 64;
  double sum = 0;
  for (int k = 0; k < places; k++) {
    double x = p->width * (k + 0.5) / places, height = 0;
    for (size_t i = 0; i < p->count; i++) {
      double dx = x - p->x[i];
      if (fabs(dx) < p->r[i])
        height = fmax(height, p->y[i] + sqrt(p->r[i] * p->r[i] - dx * dx));
    }
    sum += height / places;
  }
  return sum;
}

// MODEL: bulk solid fraction 0.81 and coordination 4 (two supports per grain) for radii 0.5 to 1 mm, over 12 seeds,
// within 3 s.e.; the s.e. themselves are below 0.0006 and 0.002, so the band is narrow.
static void bulk_of_standard_packing(void **state) {
  (void)state;
  double solid[12], coordination[12];
  for (uint64_t k = 0; k < 12; k++) {
    tal_scene scene = box_scene(20000, 150e-3, 100 + k);
    tal_packing p = packed(&scene);
    solid[k] = p.solid_fraction;
    coordination[k] = p.coordination;
    tal_packing_clear(&p);
  }
  sample phi = sample_of(solid, 12), z = sample_of(coordination, 12);
  assert_true(phi.error < 6e-4 && fabs(phi.mean - 0.81) < 3 * phi.error);
  assert_true(z.error < 2e-3 && fabs(z.mean - 4) < 3 * z.error);
}

// MODEL: 983 grains in 32 mm fill about 72 mm [P 3.3]: between the mean surface and the highest grain. No side is
// preferred: the centre of the grains' area is in the middle within 3 s.e.
static void height_of_small_packing(void **state) {
  (void)state;
  double surface[12], highest[12], lean[12];
  for (uint64_t k = 0; k < 12; k++) {
    tal_scene scene = box_scene(983, 32e-3, 1 + k);
    tal_packing p = packed(&scene);
    surface[k] = surface_height(&p);
    highest[k] = top(&p);
    double area = 0, moment = 0;
    for (size_t i = 0; i < p.count; i++) {
      area += p.r[i] * p.r[i];
      moment += p.r[i] * p.r[i] * (p.x[i] - 0.5 * p.width);
    }
    lean[k] = moment / area;
    tal_packing_clear(&p);
  }
  sample low = sample_of(surface, 12), high = sample_of(highest, 12), middle = sample_of(lean, 12);
  assert_true(low.mean < 72e-3 + 3 * low.error && high.mean > 72e-3 - 3 * high.error);
  assert_true(low.mean > 68e-3 && high.mean < 77e-3);
  assert_true(fabs(middle.mean) < 3 * middle.error);
}

static void assert_scaled(const tal_packing *a, const tal_packing *b, double scale) {
  assert_int_equal(a->count, b->count);
  for (size_t i = 0; i < a->count; i++)
    assert_true(b->x[i] == scale * a->x[i] && b->y[i] == scale * a->y[i] && b->r[i] == scale * a->r[i]);
  assert_true(a->solid_fraction == b->solid_fraction && a->coordination == b->coordination);
  assert_true(b->largest_overlap == scale * a->largest_overlap);
}

// EXACT: the same scene gives the same bits; lengths times a power of four give the same bits times it; another seed
// gives another packing. Radii come from their own stream.
static void same_bits(void **state) {
  (void)state;
  for (int which = 0; which < CASES; which++) {
    tal_scene scene = drop_case(which);
    tal_packing p = packed(&scene);
    const double scales[] = {1, 4, 65536, 1.0 / 1024};
    for (size_t k = 0; k < 4; k++) {
      tal_scene other = scene;
      other.pack.width *= scales[k];
      other.grains.radius.min *= scales[k];
      other.grains.radius.max *= scales[k];
      other.grains.radius.median *= scales[k];
      tal_packing q = packed(&other);
      assert_scaled(&p, &q, scales[k]);
      tal_packing_clear(&q);
    }
    double *r = tal_alloc(p.count, sizeof *r);
    gsl_rng *rng = tal_random_stream(scene.seed, TAL_STREAM_RADIUS);
    tal_radius_draw(&scene.grains.radius, TAL_DISK, rng, r, p.count);
    assert_memory_equal(r, p.r, p.count * sizeof *r);
    scene.seed++;
    tal_packing q = packed(&scene);
    assert_memory_not_equal(q.x, p.x, p.count * sizeof *p.x);
    gsl_rng_free(rng);
    free(r);
    tal_packing_clear(&p);
    tal_packing_clear(&q);
  }
}

static double pitch(const tal_packing *p, size_t i, size_t j) {
  return gap(p, i, j) + p->r[i] + p->r[j];
}

// ROUND: lattices in closed form: places, overlap, coordination, and solid fraction (a large lattice: the middle half
// cuts cells at its rim, so to one row in the number of rows).
static void lattices_closed_form(void **state) {
  (void)state;
  const double gaps[] = {0, -2e-5, 1e-4};
  for (int k = 0; k < 6; k++) {
    bool triangular = k < 3;
    double r = 1e-3, space = gaps[k % 3], a = 2 * r + space;
    tal_scene scene = box_scene(0, (double)NAN, 1);
    scene.grains.radius.min = scene.grains.radius.max = r;
    scene.pack.method = "lattice";
    scene.pack.pattern = triangular ? TAL_LATTICE_TRIANGULAR : TAL_LATTICE_SQUARE;
    scene.pack.columns = 120;
    scene.pack.rows = 101;
    scene.pack.gap = space;
    tal_packing p = packed(&scene);
    assert_int_equal(p.count, 120 * 101);
    assert_true(p.x[0] == r && p.y[0] == r && isnan(p.width));
    assert_true(fabs(p.x[119] - (r + 119 * a)) < 1e-15 && p.y[119] == r);
    assert_true(fabs(p.x[120] - (triangular ? r + a / 2 : r)) < 1e-17);
    assert_true(fabs(p.y[120] - (r + (triangular ? a * sqrt(3.0) / 2 : a))) < 1e-17);
    assert_true(p.x[240] == p.x[0]);
    assert_true(fabs(pitch(&p, 0, 120) - a) < 1e-17 && fabs(pitch(&p, 0, 1) - a) < 1e-17);
    assert_true(fabs(p.largest_overlap - fmax(-space, 0)) < 1e-15);
    assert_true(p.coordination == (space > 0 ? 0 : triangular ? 6 : 4));
    double cell = a * a * (triangular ? sqrt(3.0) / 2 : 1);
    assert_true(fabs(p.solid_fraction - TAL_PI * r * r / cell) < 0.02);
    tal_packing_clear(&p);
  }
}

// EXACT: the cut keeps the grains whose centre is within the radius of the middle of the bounding box, in order.
static void cut_keeps_circle(void **state) {
  (void)state;
  tal_scene scene = box_scene(3000, 50e-3, 2);
  tal_packing whole = packed(&scene);
  double x0 = 1, x1 = 0, y0 = 1, y1 = 0, radius = 15e-3;
  for (size_t i = 0; i < whole.count; i++) {
    x0 = fmin(x0, whole.x[i] - whole.r[i]);
    x1 = fmax(x1, whole.x[i] + whole.r[i]);
    y0 = fmin(y0, whole.y[i] - whole.r[i]);
    y1 = fmax(y1, whole.y[i] + whole.r[i]);
  }
  scene.pack.cut_radius = radius;
  tal_packing cut = packed(&scene);
  size_t kept = 0;
  for (size_t i = 0; i < whole.count; i++) {
    if (hypot(whole.x[i] - (x0 + x1) / 2, whole.y[i] - (y0 + y1) / 2) > radius)
      continue;
    assert_true(kept < cut.count && cut.x[kept] == whole.x[i] && cut.y[kept] == whole.y[i] &&
                cut.r[kept] == whole.r[i]);
    kept++;
  }
  assert_int_equal(kept, cut.count);
  assert_true(isnan(cut.width) && fabs(cut.solid_fraction - 0.81) < 0.02 && fabs(cut.coordination - 4) < 0.1);
  tal_packing_clear(&whole);
  tal_packing_clear(&cut);
}

// EXACT: a polygon, corners from the middle of the box, given either way round: a triangle against its three half
// planes and a notch, which is no half plane.
static void cut_keeps_polygon(void **state) {
  (void)state;
  tal_scene scene = box_scene(2000, 40e-3, 2);
  tal_packing whole = packed(&scene);
  double x0 = 1, x1 = 0, y0 = 1, y1 = 0;
  for (size_t i = 0; i < whole.count; i++) {
    x0 = fmin(x0, whole.x[i] - whole.r[i]);
    x1 = fmax(x1, whole.x[i] + whole.r[i]);
    y0 = fmin(y0, whole.y[i] - whole.r[i]);
    y1 = fmax(y1, whole.y[i] + whole.r[i]);
  }
  double triangle[3][2] = {{-10e-3, -8e-3}, {12e-3, -6e-3}, {1e-3, 14e-3}}, back[3][2];
  double notched[5][2] = {{-9e-3, -9e-3}, {9e-3, -9e-3}, {9e-3, 9e-3}, {0, 0}, {-9e-3, 9e-3}};
  for (int k = 0; k < 3; k++)
    memcpy(back[k], triangle[2 - k], sizeof back[k]);
  for (int shape = 0; shape < 3; shape++) {
    scene.pack.cut_shape = TAL_CUT_POLYGON;
    scene.pack.cut_points = shape == 0 ? triangle : shape == 1 ? back : notched;
    scene.pack.cut_point_count = shape < 2 ? 3 : 5;
    scene.pack.cut_radius = 1; // given
    tal_packing cut = packed(&scene);
    size_t kept = 0;
    for (size_t i = 0; i < whole.count; i++) {
      double x = whole.x[i] - (x0 + x1) / 2, y = whole.y[i] - (y0 + y1) / 2;
      bool inside = fabs(x) < 9e-3 && y > -9e-3 && y < fabs(x);
      for (int k = 0; shape < 2 && k < 3; k++) {
        const double *a = triangle[k], *b = triangle[(k + 1) % 3];
        inside = (k == 0 || inside) && (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) > 0;
      }
      if (!inside)
        continue;
      assert_true(kept < cut.count && cut.x[kept] == whole.x[i] && cut.y[kept] == whole.y[i]);
      kept++;
    }
    assert_true(kept > 50);
    assert_int_equal(kept, cut.count);
    tal_packing_clear(&cut);
  }
  tal_packing_clear(&whole);
}

// ROUND: closed forms of mass and inertia for both shapes, scaling; overrides as given; fixed grains and held spins.
static void grains_from_packing(void **state) {
  (void)state;
  tal_listed_grain list[] = {
      {.x = 0, .y = 0, .r = 1e-3, .vx = 1, .vy = 2, .omega = 3, .mass = (double)NAN, .inertia = (double)NAN},
      {.x = 1, .y = 0, .r = 2e-3, .mass = 5, .inertia = (double)NAN},
      {.x = 2, .y = 0, .r = 1e-3, .mass = (double)NAN, .inertia = 7},
      {.x = 3, .y = 0, .r = 1e-3, .mass = (double)NAN, .inertia = (double)NAN, .fixed = true}};
  for (int k = 0; k < 4; k++) {
    bool sphere = k % 2, rotation = k < 2;
    tal_scene scene = box_scene(0, (double)NAN, 1);
    scene.grains.list = list;
    scene.grains.list_count = 4;
    scene.grains.shape = sphere ? TAL_SPHERE : TAL_DISK;
    scene.pack.method = "none";
    scene.mass_scaling = 100;
    scene.rotation = rotation;
    tal_packing p = packed(&scene);
    tal_grains grains;
    tal_packing_grains(&p, &scene, 1.5e-3, &grains);
    double factor = sphere ? 0.4 : 0.5, volume = sphere ? 4.0 / 3.0 * TAL_PI * 1e-9 : TAL_PI * 1e-6 * 1.5e-3;
    double mass = 267500 * volume;
    assert_true(fabs(grains.mass[0] - mass) < 1e-15 * mass);
    assert_true(fabs(grains.inertia[0] - factor * mass * 1e-6) < 1e-15 * mass * 1e-6);
    assert_true(grains.mass[1] == 5 && fabs(grains.inertia[1] - factor * 5 * 4e-6) < 1e-20);
    assert_true(grains.mass[2] == grains.mass[0] && grains.inertia[2] == 7);
    assert_true(grains.vx[0] == 1 && grains.vy[0] == 2 && grains.omega[0] == 3 && grains.vx[1] == 0);
    assert_true(grains.inverse_mass[0] == 1 / grains.mass[0] && grains.inverse_mass[3] == 0);
    assert_true(grains.inverse_inertia[0] == (rotation ? 1 / grains.inertia[0] : 0) && grains.inverse_inertia[3] == 0);
    for (size_t i = 0; i < 4; i++)
      assert_true(grains.id[i] == (int64_t)i && grains.x[i] == list[i].x);
    tal_grains_clear(&grains);
    tal_packing_clear(&p);
  }
}

static void assert_refused(const tal_scene *scene, const char *starts, const char *says) {
  tal_packing packing;
  tal_error err = {{0}};
  assert_int_equal(tal_pack(scene, &packing, &err), TAL_BAD_INPUT);
  assert_true(strncmp(err.text, starts, strlen(starts)) == 0);
  assert_non_null(strstr(err.text, says));
  assert_true(packing.count == 0 && packing.x == NULL);
}

// EXACT: what cannot be packed is refused with file, line where known, key and the accepted range.
static void refuses(void **state) {
  (void)state;
  tal_scene scene = box_scene(2000, 3.8e-3, 1);
  assert_refused(&scene, "scene.yaml:9: pack.width: ", "too narrow");
  scene.pack.width = (double)NAN;
  assert_refused(&scene, "scene.yaml:9: pack.width: ", "at least");
  scene = box_scene(0, 1, 1);
  assert_refused(&scene, "scene.yaml: grains.count: ", "0 grains");
  scene = box_scene(10, 1, 1);
  scene.grains.radius.min = -1e-3;
  assert_refused(&scene, "scene.yaml: grains.radius: ", "above 0");
  scene = box_scene(1000, 1, 1);
  scene.grains.radius =
      (tal_radius){.law = TAL_RADIUS_LOGNORMAL, .median = 1e-3, .sigma = 500, .max = (double)INFINITY};
  assert_refused(&scene, "scene.yaml: grains.radius: ", "set min");
  scene = box_scene(100, 20e-3, 1);
  scene.pack.cut_radius = 1e-6;
  assert_refused(&scene, "scene.yaml: pack.cut.radius: ", "no grain");
  scene = box_scene(0, (double)NAN, 1);
  scene.pack.method = "lattice";
  scene.pack.columns = scene.pack.rows = 3;
  assert_refused(&scene, "scene.yaml: grains.radius: ", "equal grains");
  scene.grains.radius.min = 1e-3;
  scene.pack.gap = -2e-3;
  assert_refused(&scene, "scene.yaml: pack.gap: ", "-0.002");
  scene.pack.gap = 0;
  scene.grains.count = 10;
  assert_refused(&scene, "scene.yaml: grains.count: ", "9");
  scene.grains.count = 0;
  scene.pack.rows = 0;
  assert_refused(&scene, "scene.yaml: pack.rows: ", "1 or more");
  scene.pack.method = "magic";
  assert_refused(&scene, "scene.yaml: pack.method: ", "magic");
}

// EXACT: the registry answers by name, in order, and never past the room given.
static void registry(void **state) {
  (void)state;
  tal_choice choice[8];
  assert_int_equal(tal_packer_choices(choice, 8), 4);
  assert_int_equal(tal_packer_choices(choice, 2), 2);
  assert_string_equal(choice[0].name, "drop_and_roll");
  const char *names[] = {"drop_and_roll", "lattice", "file", "none"};
  for (size_t k = 0; k < 4; k++)
    assert_string_equal(tal_packer_find(names[k])->name, names[k]);
  assert_null(tal_packer_find("drop"));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(no_overlap),
      cmocka_unit_test(report_by_brute_force),
      cmocka_unit_test(every_grain_is_stable),
      cmocka_unit_test(agrees_with_small_steps),
      cmocka_unit_test(bulk_of_standard_packing),
      cmocka_unit_test(height_of_small_packing),
      cmocka_unit_test(same_bits),
      cmocka_unit_test(lattices_closed_form),
      cmocka_unit_test(cut_keeps_circle),
      cmocka_unit_test(cut_keeps_polygon),
      cmocka_unit_test(grains_from_packing),
      cmocka_unit_test(refuses),
      cmocka_unit_test(registry),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
