// Friction and normal damping solved at velocity level: the law's root, creep at rest, conservation, work, order of
// convergence, colours, the same bits for any number of threads and after a stop.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "checkpoint.h"
#include "energy.h"
#include "engine.h"
#include "implicit.h"
#include "law_implicit.h"
#include "physics_contact.h"
#include <float.h>
#include <gsl/gsl_rng.h>

// ---- the root -------------------------------------------------------------------------------------------------------

// Root of u^c + b u = a by halving an interval, in extended precision.
static double share_by_halving(double a_given, double b_given, double c_given) {
  const long double a = (long double)a_given, b = (long double)b_given, c = (long double)c_given;
  long double low = 0, high = fminl(a / b, powl(a, 1 / c)) * 1.01L;
  for (int k = 0; k < 200; k++) {
    long double middle = (low + high) / 2;
    if (powl(middle, c) + b * middle > a)
      high = middle;
    else
      low = middle;
  }
  return (double)low;
}

static double share(double a, double b, double c) {
  double as[TAL_ROOT_LANES] = {a}, bs[TAL_ROOT_LANES] = {b}, u[TAL_ROOT_LANES] = {0};
  tal_implicit_shares(as, bs, u, TAL_IMPLICIT_VECTOR, c);
  return u[0];
}

// ROUND (100 eps) against halving: from deep sticking to fast slip, and where both terms
// are equal, the hardest place.
static void test_root(void **state) {
  (void)state;
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  static const double exponents[] = {1, 1.5, 2, 5, 19.5, 20, 50, 200};
  for (size_t e = 0; e < sizeof exponents / sizeof *exponents; e++) {
    double c = exponents[e];
    for (int k = 0; k < 4000; k++) {
      double b = pow(10, uniform(random, -6, 6)), u = pow(10, uniform(random, -4, 5 / (c + 5)));
      double a = k % 2 || c == 1 ? pow(u, c) + b * u : pow(b, c / (c - 1)) * pow(10, uniform(random, -0.3, 0.6));
      if (!(a > 1e-250 && a < 1e250))
        continue;
      double root = share(a, b, c);
      assert_relative(root, share_by_halving(a, b, c), 100 * DBL_EPSILON);
    }
    assert_true(share(0, 1, c) == 0);
    assert_relative(share(3, 0, c), pow(3, 1 / c), 100 * DBL_EPSILON); // nothing gives way
  }
  gsl_rng_free(random);
}

// ---- one grain on a floor -------------------------------------------------------------------------------------------

// A block (its spin held) at rest on a floor that carries it, pushed sideways by gravity: the share of mu fn is `load`.
static void open_block(physics *p, double load, double mu, double c, double dt, double duration) {
  physics_open(p,
               "grains: {list: [{x: 0, y: 0.75, r: 1, mass: 2, inertia: 1}]}\nrotation: false\n"
               "material: {friction: %.17g, density: 1}\ngravity: [%.17g, -8]\n"
               "contact: {normal: linear, stiffness: 64, tangential: regularised, exponent: %.17g, vR: 0.01}\n"
               "walls: [{from: [-1e4, 0], to: [1e4, 0], young: .inf}]\n"
               "integrator: {scheme: implicit_friction, dt: %.17g}\nstages: [{kind: free, duration: %.17g}]\n",
               mu, load * mu * 8, c, dt, duration);
}

// ROUND (a few c eps): at rest under load a contact creeps at the law's own s = vR (f / (mu fn))^c, for any step, load,
// friction from 0.01 to 2 and exponent from 5 to 200; explicit steps of this size would overshoot by up to 1e3 vR.
static void test_creep(void **state) {
  (void)state;
  static const double exponents[] = {5, 20, 200}, frictions[] = {0.01, 0.45, 2}, loads[] = {0.5, 0.9, 0.99};
  for (int e = 0; e < 3; e++)
    for (int f = 0; f < 3; f++)
      for (int l = 0; l < 3; l++)
        for (double dt = 1e-3; dt < 0.3; dt *= 10) {
          physics p;
          double creep = 0.01 * pow(loads[l], exponents[e]);
          double relaxation = exponents[e] * creep / (loads[l] * frictions[f] * 8); // of the slip about the creep
          open_block(&p, loads[l], frictions[f], exponents[e], dt, 1e9);
          for (int s = 0; s < 50 + 30 * relaxation / dt; s++)
            physics_step(&p);
          assert_near(p.sim->grains.vx[0], creep, 1e-8, creep + 1e-6 * dt);
          physics_close(&p);
        }
}

// ROUND: a million steps of sticking: the path is the creep's, the kinetic energy stays the creep's, friction takes the
// work of the load.
static void test_long_rest(void **state) {
  (void)state;
  physics p;
  const double load = 0.75, creep = 0.01 * pow(load, 20), force = load * 0.45 * 16;
  open_block(&p, load, 0.45, 20, 0.01, 1e4);
  physics_to_end(&p);
  tal_row row;
  tal_sim_row(p.sim, &row);
  assert_int_equal(p.sim->run.step, 1000000);
  assert_relative(p.sim->grains.x[0], 1e4 * creep, 1e-4); // the start takes a step or two
  assert_relative(p.sim->grains.vx[0], creep, 1e-7);
  assert_near(p.sim->grains.vy[0], 0, 1e-12, 1);
  assert_relative(row.dissipated_friction, force * p.sim->grains.x[0], 1e-4);
  physics_close(&p);
}

// Closed form: without a load, Coulomb friction (c = 200 comes within half a percent) stops a slider after v/(mu g), on
// the spot: one step later it is at rest, and stays.
static void test_stops(void **state) {
  (void)state;
  physics p;
  open_block(&p, 0, 0.5, 200, 1e-3, 1);
  p.sim->grains.vx[0] = 1;
  physics_to_end(&p); // stops at 1 / (0.5 * 8) = 0.25 s, after 1/(2 mu g) = 0.125 m
  assert_relative(p.sim->grains.x[0], 0.125, 0.03);
  assert_near(p.sim->grains.vx[0], 0, 1e-12, 1);
  physics_close(&p);
}

// ---- impacts --------------------------------------------------------------------------------------------------------

static ode_contact oblique(ode_friction kind, bool plane) {
  ode_contact k = {.hertz = true, .plane = plane, .K = 1e7, .C = 20, .kind = kind, .mu = 0.3};
  k.i = (ode_grain){.x = -1e-3, .r = 1e-3, .vx = 0.8, .vy = 0.9, .omega = -50, .mass = 1e-5, .inertia = 5e-12};
  k.j = (ode_grain){.x = 1.5e-3, .r = 1.5e-3, .vx = -0.2, .vy = -0.4, .mass = 3e-5, .inertia = 3e-11};
  if (plane)
    k.i = (ode_grain){.y = 1e-3, .r = 1e-3, .vx = 2, .vy = -1, .omega = 50, .mass = 1e-5, .inertia = 5e-12};
  k.vR = 1;
  k.c = 3;
  k.ratio = 0.8;
  k.length = pow(1.25 * contact_mass(&k) / k.K, 0.4);
  if (kind == ODE_SPRING) { // its stiffness is that of the end of a step: constant here
    k.hertz = false;
    k.K = 1e5;
    k.C = 0.1;
    k.length = sqrt(contact_mass(&k) / k.K);
  }
  k.overlap = 0.3 * k.length; // starting at the square-root onset of damping would cost half an order
  k.i.y -= plane ? k.overlap : 0;
  k.j.x -= plane ? 0 : k.overlap;
  return k;
}

// Order over five refinements of the velocities and spins after part of the contact.
static double impact_order(const ode_contact *k, int first) {
  const double until = 0.3 * 2.9433 * k->length;
  ode_result exact = ode_solve(k, until, until);
  double dt[5], error[5];
  for (int r = 0; r < 5; r++) {
    physics p;
    char i[400], j[400] = "", law[800];
    dt[r] = until / (first << r);
    contact_grain_text(i, &k->i, 0);
    if (!k->plane)
      contact_grain_text(j, &k->j, 0);
    contact_law_text(law, k);
    physics_open(&p,
                 "grains: {list: [%s%s%s]}\n%s%s"
                 "integrator: {scheme: implicit_friction, dt: %.17g, tolerance: 1e-12}\n"
                 "limits: {overlap: 1}\nstages: [{kind: free, duration: %.17g}]\n",
                 i, k->plane ? "" : ", ", j, law, k->plane ? "walls: [{from: [-9, 0], to: [9, 0], young: .inf}]\n" : "",
                 dt[r], until);
    physics_to_end(&p);
    const tal_grains *g = &p.sim->grains;
    error[r] = hypot(hypot(g->vx[0] - exact.vx[0], g->vy[0] - exact.vy[0]), k->i.r * (g->omega[0] - exact.w[0]));
    physics_close(&p);
  }
  return fitted_order(dt, error, 5);
}

// ORDER: sliding friction, regularised law, against the high-order reference: first order, as stated.
static void test_order_regularised(void **state) {
  (void)state;
  for (int plane = 0; plane < 2; plane++) {
    ode_contact k = oblique(ODE_REGULARISED, plane);
    double order = impact_order(&k, 40);
    if (!(order > 0.9 && order < 1.3))
      fail_msg("order %.3f", order);
  }
}

// ORDER: the spring law below its cap, constant stiffness: second order, down to where the slip, read with the geometry
// of the end of a step as in the explicit scheme, leaves 1e-6.
static void test_order_spring(void **state) {
  (void)state;
  for (int plane = 0; plane < 2; plane++) {
    ode_contact k = oblique(ODE_SPRING, plane);
    k.mu = 20;
    double order = impact_order(&k, 5);
    if (!(order > 1.8 && order < 2.4))
      fail_msg("order %.3f", order);
  }
}

// ORDER: normal damping, both laws, no friction: second order.
static void test_order_damping(void **state) {
  (void)state;
  for (int plane = 0; plane < 2; plane++)
    for (int hertz = 0; hertz < 2; hertz++) {
      ode_contact k = oblique(hertz ? ODE_NONE : ODE_SPRING, plane);
      k.kind = ODE_NONE;
      k.C = hertz ? 200 : 1; // of the order of critical
      double order = impact_order(&k, 5);
      if (!(order > 1.8 && order < 2.4))
        fail_msg("order %.3f (plane %d, hertz %d)", order, plane, hertz);
    }
}

// Closed form: a load that sinks onto a spring through a damper so stiff that explicit steps of this size diverge
// (dt c/m = 20). It starts at the speed of the slow decay; that is all there is to see.
static void test_stiff_damper(void **state) {
  (void)state;
  physics p;
  const double k = 64, c = 400, m = 2, weight = 16, dt = 0.1, slow = (c - sqrt(c * c - 4 * k * m)) / (2 * m);
  physics_open(&p,
               "grains: {list: [{x: 0, y: 0.999999999, r: 1, vy: %.17g, mass: %g, inertia: 1}]}\n"
               "material: {friction: 0, density: 1}\n"
               "gravity: [0, %g]\ncontact: {normal: linear, stiffness: %g, damping: %g, vR: 1}\n"
               "walls: [{from: [-9, 0], to: [9, 0], young: .inf}]\n"
               "integrator: {scheme: implicit_friction, dt: %g}\nstages: [{kind: free, duration: 60}]\n",
               -slow * weight / k, m, -weight / m, k, c, dt);
  for (int s = 1; s <= 600; s++) {
    physics_step(&p);
    assert_near(1 - p.sim->grains.y[0], weight / k * (1 - exp(-slow * s * dt)), 1e-3, weight / k);
  }
  assert_near(p.sim->grains.vy[0], 0, 1e-3, weight / k * slow);
  physics_close(&p);
}

// ---- many grains ----------------------------------------------------------------------------------------------------

// A lattice of overlapping grains thrown about, spinning; `more` stands in for further scene lines.
static engine *start_cloud(int columns, int rows, const char *tangential, const char *more, double dt) {
  draft *d = draft_begin();
  fprintf(d->to,
          "grains: {radius: {law: uniform, min: 1, max: 1}, thickness: 1}\n"
          "material: {young: 1e4, poisson: 0.3, density: 1, friction: 0.6, damping: 1e-3}\n"
          "contact: {normal: hertz, %s}\n"
          "pack: {method: lattice, pattern: triangular, columns: %d, rows: %d, gap: -0.02}\n%s"
          "integrator: {scheme: implicit_friction, dt: %.17g}\nstages: [{kind: free, duration: 1e9}]\n",
          tangential, columns, rows, more, dt);
  engine *e = engine_start(d);
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  tal_grains *g = &e->sim->grains;
  for (size_t i = 0; i < g->count; i++) {
    g->vx[i] = uniform(random, -1, 1);
    g->vy[i] = uniform(random, -1, 1);
    g->omega[i] = uniform(random, -3, 3);
  }
  e->sim->run.kinetic0 = tal_energy_kinetic(g);
  gsl_rng_free(random);
  return e;
}

static const char regularised[] = "tangential: regularised, exponent: 20, vR: 0.01";
static const char spring[] = "tangential: spring";

typedef struct momenta {
  double x, y, angular, scale;
} momenta;

static momenta total(const tal_grains *g) {
  momenta m = {0};
  for (size_t i = 0; i < g->count; i++) {
    m.x += g->mass[i] * g->vx[i];
    m.y += g->mass[i] * g->vy[i];
    m.angular += g->mass[i] * (g->x[i] * g->vy[i] - g->y[i] * g->vx[i]) + g->inertia[i] * g->omega[i];
    m.scale += g->mass[i] * (1 + hypot(g->x[i], g->y[i])) * (hypot(g->vx[i], g->vy[i]) + fabs(g->omega[i]));
  }
  return m;
}

// ROUND: momentum and angular momentum of a free cloud stay, however incomplete the sweeps, for both laws. Velocities
// at an instant hold half a kick of a torque-free set of forces about the centres of that instant: no error of the
// step.
static void test_momenta(void **state) {
  (void)state;
  for (int law = 0; law < 2; law++) {
    engine *e = start_cloud(8, 8, law ? spring : regularised, "", 1e-3);
    momenta before = total(&e->sim->grains);
    for (int s = 0; s < 500; s++) {
      engine_step(e);
      momenta now = total(&e->sim->grains);
      assert_near(now.x, before.x, 1e-13, before.scale);
      assert_near(now.y, before.y, 1e-13, before.scale);
      assert_near(now.angular, before.angular, 1e-12, before.scale);
    }
    engine_end(e);
  }
}

// ROUND: the same about one grain with more contacts than there are colours: those that find none are swept in order.
static void test_hub(void **state) {
  (void)state;
  enum { RIM = 1000 };
  draft *d = draft_begin();
  const double r = 1, ring = r / sin(3.14159265358979 / RIM) * 0.9995, hub = ring - 0.9995 * r;
  fprintf(d->to, "grains: {list: [{x: 0, y: 0, r: %.17g, omega: 0.2}", hub);
  for (int k = 0; k < RIM; k++)
    fprintf(d->to, ", {x: %.17g, y: %.17g, r: %.17g}", ring * cos(6.283185307179586 * k / RIM),
            ring * sin(6.283185307179586 * k / RIM), r);
  fprintf(d->to,
          "], thickness: 1}\nmaterial: {young: 1e4, density: 1, friction: 0.6, damping: 1e-3}\n"
          "contact: {%s}\nintegrator: {scheme: implicit_friction, dt: 1e-3}\n"
          "stages: [{kind: free, duration: 1e9}]\n",
          "tangential: regularised, exponent: 20, vR: 0.01");
  engine *e = engine_start(d);
  momenta before = total(&e->sim->grains);
  engine_steps(e, 100);
  assert_true(e->sim->implicit.serial_last);
  momenta now = total(&e->sim->grains);
  assert_near(now.x, before.x, 1e-13, before.scale);
  assert_near(now.y, before.y, 1e-13, before.scale);
  assert_near(now.angular, before.angular, 1e-12, before.angular); // the hub has nearly all of it
  assert_true(e->sim->grains.omega[0] < 0.2 - 1e-9);               // the rim takes some of it
  engine_end(e);
}

static double friction_work(const tal_sim *sim) {
  return sim->run.friction_work;
}

// Closed form of the second law: the work of regularised friction in a step is never positive (walls at rest), with one
// sweep, also where the step is far above the friction's explicit limit; and some of it is done. Friction 0.1 to 2.
static void test_work(void **state) {
  (void)state;
  for (double mu = 0.1; mu < 3; mu *= 4.4) {
    engine *e = start_cloud(
        9, 7, regularised, "limits: {overlap: 1}\ngravity: [0, -20]\nwalls: [{from: [-90, -1], to: [90, -1]}]\n", 1e-3);
    e->sim->friction = mu;
    tal_neighbours_rebuild(e->sim);
    for (int s = 0; s < 3000; s++) {
      double before = friction_work(e->sim);
      engine_step(e);
      double after = friction_work(e->sim);
      assert_true(after <= before + 1e-12 * fabs(before));
    }
    assert_true(friction_work(e->sim) < -1);
    tal_row row = engine_row(e);
    assert_true(fabs(row.energy_residual) < 1e-3);
    engine_end(e);
  }
}

// A grain that fell between two fixed ones and is pressed on them askew; mean slip over vR.
static double restlessness(const char *scheme, double dt) {
  draft *d = draft_begin();
  fprintf(
      d->to,
      "grains: {list: [{x: -1.2, y: 0, r: 1, fixed: true}, {x: 1.2, y: 0, r: 1, fixed: true}, {x: 0, y: 1.7, r: 1}]}\n"
      "material: {young: 1e6, density: 1, friction: 0.6, damping: 1e-3}\ngravity: [3, -20]\n"
      "contact: {vR: 1e-6}\nintegrator: {scheme: %s, dt: %.17g}\nstages: [{kind: free, duration: 1e9}]\n",
      scheme, dt);
  engine *e = engine_start(d);
  engine_steps(e, 20000);
  double slip = engine_row(e).mean_slip;
  engine_end(e);
  return slip;
}

// Closed form: below the cap the law lets a contact slip by less than vR. A grain at rest on two others does, at a step
// at which explicit friction keeps it jumping.
static void test_no_chatter(void **state) {
  (void)state;
  assert_true(restlessness("implicit_friction", 5e-4) < 1);
  assert_true(restlessness("verlet", 5e-4) > 100);
}

// ---- colours, threads, stops ----------------------------------------------------------------------------------------

// EXACT: no two contacts of a colour share a grain (walls do not count), but for the last colour of a grain with more
// than 64 contacts, which is marked.
static void test_colours(void **state) {
  (void)state;
  enum { GRAINS = 200, WALLS = 2, MOST = 1200 };
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  for (int hub = 0; hub < 2; hub++) {
    int32_t i[MOST], j[MOST];
    uint8_t colour[MOST];
    size_t count = 0;
    for (int32_t a = 0; a < GRAINS; a++)
      for (int32_t b = a + 1; b < GRAINS + WALLS; b++)
        if ((hub && a == 0) || uniform(random, 0, 1) < 0.02) {
          assert_true(count < MOST);
          i[count] = a;
          j[count++] = b;
        }
    bool serial_last;
    size_t colours = tal_implicit_colours(i, j, count, GRAINS, colour, &serial_last);
    assert_int_equal(serial_last, hub);
    assert_true(hub ? colours == 65 : colours < 15);
    for (size_t own = 0; own < colours; own++) {
      bool taken[GRAINS] = {false}, last = own == 64;
      size_t size = 0;
      for (size_t k = 0; k < count; k++) {
        if (colour[k] != own)
          continue;
        size++;
        assert_true(last || !taken[i[k]]);
        taken[i[k]] = true;
        if (j[k] >= GRAINS)
          continue;
        assert_true(last || !taken[j[k]]);
        taken[j[k]] = true;
      }
      assert_true(size > 0);
    }
  }
  gsl_rng_free(random);
}

// EXACT: the same bits with one thread, two and three; tiles enough for all to have their share.
static void test_threads(void **state) {
  (void)state;
  engine *run[3];
  for (int t = 0; t < 3; t++) {
    omp_set_num_threads(t + 1);
    run[t] = start_cloud(140, 120, regularised, "walls: [{from: [-900, -1], to: [900, -1]}]\n", 1e-3);
    engine_steps(run[t], 12);
    assert_true(run[t]->sim->implicit.tiles > 30);
  }
  omp_set_num_threads(1);
  assert_same_motion(run[0], run[1]);
  assert_same_motion(run[0], run[2]);
  for (int t = 0; t < 3; t++)
    engine_end(run[t]);
}

// EXACT: put back from a checkpoint with a fresh neighbour list, the run goes on to the same bits, for both laws.
static void test_goes_on(void **state) {
  (void)state;
  for (int law = 0; law < 2; law++) {
    const char *floor = "gravity: [1, -20]\nwalls: [{from: [-900, -1], to: [900, -1]}]\n";
    engine *a = start_cloud(7, 6, law ? spring : regularised, floor, 1e-3);
    engine *b = start_cloud(7, 6, law ? spring : regularised, floor, 1e-3);
    char path[] = "/tmp/talus-implicit-XXXXXX";
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    engine_steps(a, 237);
    tal_error err = {""};
    tal_run_files files = {.series_step = -1, .tracks_step = -1};
    char *text = tal_scene_text(&a->scene);
    free(a->scene.path);
    a->scene.path = tal_strdup(b->scene.path);
    assert_int_equal(tal_checkpoint_write(path, NULL, a->sim, text, &files, &err), TAL_OK);
    if (tal_checkpoint_read(path, b->sim, text, &files, &err) != TAL_OK)
      fail_msg("%s", err.text);
    tal_run_files_clear(&files);
    free(text);
    unlink(path);
    tal_sim_restored(b->sim);
    engine_steps(a, 400);
    engine_steps(b, 400);
    assert_same_motion(a, b);
    engine_end(a);
    engine_end(b);
  }
}

int main(void) {
  omp_set_num_threads(1);
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_root),
                                     cmocka_unit_test(test_creep),
                                     cmocka_unit_test(test_long_rest),
                                     cmocka_unit_test(test_stops),
                                     cmocka_unit_test(test_order_regularised),
                                     cmocka_unit_test(test_order_spring),
                                     cmocka_unit_test(test_order_damping),
                                     cmocka_unit_test(test_stiff_damper),
                                     cmocka_unit_test(test_momenta),
                                     cmocka_unit_test(test_hub),
                                     cmocka_unit_test(test_work),
                                     cmocka_unit_test(test_no_chatter),
                                     cmocka_unit_test(test_colours),
                                     cmocka_unit_test(test_threads),
                                     cmocka_unit_test(test_goes_on)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
