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
               "integrator: {dt: %.17g}\nlimits: {overlap: 1}\nstages: [{kind: free, duration: 1e9}]\n",
               i, k->plane ? "" : ", ", j, law,
               k->plane ? "walls: [{from: [-1e3, 0], to: [1e3, 0], young: .inf}]\n" : "", dt);
}

// Normal force [N] on the first grain and overlap [m], both from the grains' own places and forces.
static inline void contact_normal(const physics *p, const ode_contact *k, double *fn, double *overlap) {
  const tal_grains *g = &p->sim->grains;
  double nx = 0, ny = 1, distance = g->y[0];
  if (!k->plane) {
    distance = hypot(g->x[0] - g->x[1], g->y[0] - g->y[1]);
    nx = (g->x[0] - g->x[1]) / distance;
    ny = (g->y[0] - g->y[1]) / distance;
  }
  *fn = g->fx[0] * nx + g->fy[0] * ny;
  *overlap = k->i.r + (k->plane ? 0 : k->j.r) - distance;
}

// Runs until the normal force has come and gone. The duration is measured from the instant that the contact describes;
// its end is found by linear interpolation of the overlap, or extrapolation of the force where it ends clipped.
static inline ode_result contact_run(const ode_contact *k, double lead, double dt) {
  physics p;
  ode_result result = {0};
  double fn = 0, overlap, before, deep = 0;
  contact_open(&p, k, lead, dt);
  contact_normal(&p, k, &fn, &overlap);
  for (int64_t steps = 0;; steps++) {
    before = fn;
    deep = overlap;
    physics_step(&p);
    contact_normal(&p, k, &fn, &overlap);
    result.overlap = fmax(result.overlap, overlap);
    if (fn <= 0 && before > 0)
      break;
    result.stuck_share = before - fn; // last change of the force, for the extrapolation
    assert_true(steps < 10000000);
  }
  double last = p.sim->run.time - dt;
  result.time = last - lead + dt * (overlap < 0 ? deep / (deep - overlap) : before / result.stuck_share);
  result.stuck_share = 0;
  const tal_grains *g = &p.sim->grains;
  for (size_t b = 0; b < g->count; b++) {
    result.vx[b] = g->vx[b];
    result.vy[b] = g->vy[b];
    result.w[b] = g->omega[b];
  }
  physics_close(&p);
  return result;
}

#endif
