// One contact as a scene of the engine, to compare with the reference of physics_ode.h.
#ifndef PHYSICS_CONTACT_H
#define PHYSICS_CONTACT_H

#include "physics.h"
#include "physics_ode.h"

static const double contact_poisson = 0.3;

// Reduced mass [kg] and radius [m] of a contact.
static inline double contact_mass(const ode_contact *k) {
  return k->plane ? k->i.mass : k->i.mass * k->j.mass / (k->i.mass + k->j.mass);
}

static inline double contact_radius(const ode_contact *k) {
  return k->plane ? k->i.r : k->i.r * k->j.r / (k->i.r + k->j.r);
}

// Young's modulus [Pa] that gives the contact its K, from eqs (2) and (3) written the other way round; a plane is
// rigid.
static inline double contact_young(const ode_contact *k) {
  double modulus = 0.75 * k->K / sqrt(contact_radius(k));
  return (k->plane ? 1 : 2) * (1 - contact_poisson * contact_poisson) * modulus;
}

static inline void contact_grain_text(char text[400], const ode_grain *g, double lead) {
  snprintf(text, 400, "{x: %.17g, y: %.17g, r: %.17g, vx: %.17g, vy: %.17g, omega: %.17g, mass: %.17g, inertia: %.17g}",
           g->x - lead * g->vx, g->y - lead * g->vy, g->r, g->vx, g->vy, g->omega, g->mass, g->inertia);
}

// Law and material of the scene.
static inline void contact_law_text(char text[800], const ode_contact *k) {
  char normal[200], tangential[200] = "tangential: none";
  if (k->hertz)
    snprintf(normal, sizeof normal, "normal: hertz");
  else
    snprintf(normal, sizeof normal, "normal: linear, stiffness: %.17g, damping: %.17g", k->K, k->C);
  if (k->kind == ODE_REGULARISED)
    snprintf(tangential, sizeof tangential, "tangential: regularised, exponent: %.17g, vR: %.17g", k->c, k->vR);
  if (k->kind == ODE_SPRING)
    snprintf(tangential, sizeof tangential, "tangential: spring, tangential_ratio: %.17g", k->ratio);
  snprintf(text, 800, "material: {young: %.17g, poisson: %.17g, friction: %.17g, damping: %.17g}\ncontact: {%s, %s}\n",
           contact_young(k), contact_poisson, k->kind == ODE_NONE ? 0 : k->mu, k->hertz ? k->C / k->K : 0, normal,
           tangential);
}

// The scene starts `lead` [s] before the instant that the contact describes.
static inline void contact_open(physics *p, const ode_contact *k, double lead, double dt) {
  char i[400], j[400] = "", law[800];
  contact_grain_text(i, &k->i, lead);
  if (!k->plane)
    contact_grain_text(j, &k->j, lead);
  contact_law_text(law, k);
  physics_open(p,
               "grains: {list: [%s%s%s]}\n%s%s"
               "integrator: {dt: %.17g}\nlimits: {overlap: 1}\nstages: [{kind: free, duration: %.17g}]\n",
               i, k->plane ? "" : ", ", j, law,
               k->plane ? "walls: [{from: [-1e3, 0], to: [1e3, 0], young: .inf}]\n" : "", dt, 2e6 * dt);
}

typedef struct contact_now {
  double overlap, approach; // [m, m/s]
  double load;              // K d + C d': the normal force but for a factor, falls through zero where the contact ends
} contact_now;

// From places and velocities alone.
static inline contact_now contact_state(const physics *p, const ode_contact *k) {
  const tal_grains *g = &p->sim->grains;
  contact_now now = {.overlap = k->i.r - g->y[0], .approach = -g->vy[0]};
  if (!k->plane) {
    double dx = g->x[0] - g->x[1], dy = g->y[0] - g->y[1], distance = hypot(dx, dy);
    now.overlap = k->i.r + k->j.r - distance;
    now.approach = -(dx * (g->vx[0] - g->vx[1]) + dy * (g->vy[0] - g->vy[1])) / distance;
  }
  now.load = k->K * now.overlap + k->C * now.approach;
  return now;
}

static inline void contact_motion(const physics *p, ode_result *result) {
  const tal_grains *g = &p->sim->grains;
  for (size_t b = 0; b < g->count; b++) {
    result->vx[b] = g->vx[b];
    result->vy[b] = g->vy[b];
    result->w[b] = g->omega[b];
  }
}

// Runs until the contact has come and gone. The duration is measured from the instant that the contact describes; its
// end is found by linear interpolation of the load.
static inline ode_result contact_run(const ode_contact *k, double lead, double dt) {
  physics p;
  ode_result result = {0};
  contact_open(&p, k, lead, dt);
  contact_now before, now = contact_state(&p, k);
  do {
    before = now;
    physics_step(&p);
    now = contact_state(&p, k);
    result.overlap = fmax(result.overlap, now.overlap);
    assert_false(tal_sim_done(p.sim));
  } while (now.load > 0 || before.overlap <= 0);
  result.overlap_last = now.overlap;
  result.time = p.sim->run.time - dt - lead + dt * before.load / (before.load - now.load);
  contact_motion(&p, &result);
  physics_close(&p);
  return result;
}

#endif
