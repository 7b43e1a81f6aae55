// The scene: everything a user asks for, resolved to SI numbers. Filled from YAML by scene.c through one schema table.
// Plain data; a scene never changes once a run has started.
#ifndef TAL_SCENE_H
#define TAL_SCENE_H

#include "base.h"
#include <stdbool.h>

typedef enum tal_shape { TAL_DISK, TAL_SPHERE } tal_shape;
typedef enum tal_radius_law { TAL_RADIUS_UNIFORM, TAL_RADIUS_LOGNORMAL, TAL_RADIUS_SIEVE } tal_radius_law;

// NAN in an optional number means "not given" throughout.
typedef struct tal_radius {
  tal_radius_law law;
  double min, max;      // [m] uniform; lognormal: cut-offs, 0 and INFINITY when not given
  double median, sigma; // lognormal: median [m], standard deviation of ln r [-]
  double (*passing)[2]; // sieve: owned; [passing_count][2] diameter [m], percent passing, both ascending
  size_t passing_count;
  int64_t sizes; // sieve: number of discrete sizes M
} tal_radius;

typedef struct tal_listed_grain {
  double x, y, r;       // [m]
  double vx, vy, omega; // [m/s, m/s, rad/s], omega counter-clockwise
  double mass, inertia; // [kg, kg m^2], NAN: from the material
  bool fixed;           // keeps its velocities for ever
} tal_listed_grain;

typedef struct tal_scene_grains {
  int64_t count; // 0 when listed, from a file or on a lattice
  tal_radius radius;
  tal_listed_grain *list; // owned
  size_t list_count;
  tal_shape shape;
  double thickness; // [m] NAN: twice the mean radius
} tal_scene_grains;

typedef struct tal_material {
  double young;    // [Pa]
  double poisson;  // [-]
  double density;  // [kg/m^3] before mass scaling
  double friction; // [-]
  double damping;  // [s] T of the Hertz law [P 2.16], NAN when contact.restitution is given
} tal_material;

typedef struct tal_scene_contact {
  const char *normal;       // name of a registered normal law
  const char *tangential;   // name of a registered tangential law
  double exponent;          // c of the regularised law [P 2.18]
  double vR;                // [m/s] NAN: 2 rate Rmean of the first stage with a rate
  double stiffness;         // [N/m] linear
  double restitution;       // delivered speed ratio, NAN when damping is given
  double restitution_speed; // [m/s] hertz: where it is delivered, NAN: vR
  double damping;           // [N s/m] linear, NAN when restitution is given
  double tangential_ratio;  // spring: k_t / k_n, NAN: Mindlin's 2(1-nu)/(2-nu)
} tal_scene_contact;

typedef struct tal_scene_wall {
  double from[2], to[2];           // [m]
  double velocity[2];              // [m/s]
  double young, poisson, friction; // NAN: the material's; young may be INFINITY
  double from_time, until_time;    // [s] active in from_time <= t < until_time; 0 and INFINITY by default
} tal_scene_wall;

typedef enum tal_lattice { TAL_LATTICE_TRIANGULAR, TAL_LATTICE_SQUARE } tal_lattice;

typedef enum tal_cut { TAL_CUT_CIRCLE, TAL_CUT_POLYGON } tal_cut;

typedef struct tal_scene_pack {
  const char *method;      // name of a registered packer: drop_and_roll, lattice, file, none
  double width;            // [m] drop_and_roll
  char *path;              // file: owned, as given (relative to the scene file's folder)
  tal_lattice pattern;     // lattice
  int64_t columns, rows;   // lattice
  double gap;              // [m] lattice: between neighbours, negative = overlap
  tal_cut cut_shape;       // cut
  double cut_radius;       // [m] circle: radius; polygon: of its furthest corner (by the loader); NAN: no cut
  double (*cut_points)[2]; // polygon: owned; [cut_point_count][2] corners from the middle of the packing's box [m]
  size_t cut_point_count;
} tal_scene_pack;

typedef struct tal_scene_continuum {
  const char *backend;         // "cgal" | "qhull"
  bool power;                  // tessellation: power
  int64_t refresh_steps;       // 0 when another criterion is given
  double refresh_strain;       // [-] NAN when not given
  double refresh_displacement; // [mean diameters] NAN when not given
  double peel;                 // [mean diameters]
} tal_scene_continuum;

typedef struct tal_scene_integrator {
  const char *scheme; // name of a registered integrator
  double dt;          // [s]
  bool force;         // run above dt_crit
  int64_t m, n, q;    // two_timescale: m times (a step of n dt, q steps of dt)
  int64_t sweeps;     // implicit_friction: over the contacts, per step
  double tolerance;   // implicit_friction: sweeps again while a force changes by more than this share of mu fn
} tal_scene_integrator;

// Components of the velocity gradient dv_a/dx_b [1/s]; NAN: not imposed.
typedef struct tal_scene_rates {
  double xx, yy, xy, yx;
} tal_scene_rates;

// Stresses [Pa], compression positive; NAN: not given.
typedef struct tal_scene_stresses {
  double xx, yy, xy;
} tal_scene_stresses;

// Bead chains of boundary: membrane.
typedef struct tal_scene_membrane {
  double stiffness; // [N/m] of a link
  double prestress; // [N] tension of the links while they are a straight line
  double radius;    // [m] of a bead, NAN: 1.25 mean radii
  double mass;      // [kg] of a bead, NAN: that of a grain of its radius
  double damping;   // [-] of a link, share of critical
} tal_scene_membrane;

// Grains whose spin a stage imposes. None listed and random 0: the one nearest to the middle.
typedef struct tal_scene_forced {
  int64_t *ids; // owned; [count]
  size_t count;
  int64_t random; // grains drawn for an ensemble
  double margin;  // [mean diameters] between them and the loop
  bool many;      // a list was given
} tal_scene_forced;

typedef struct tal_scene_stage {
  const char *kind;                // name of a registered stage: free, confine, compress, shear, deform
  const char *boundary;            // name of a registered boundary (shear, deform: minimal; resolved by the loader)
  const char *method;              // minimal: exact | penalty; else NULL
  double penalty;                  // [N m s] minimal, penalty: K, NAN: from the explicit limit
  int64_t order;                   // minimal, exact: p; else -1
  double duration;                 // [s] free, deform
  double pressure;                 // [Pa] all but free (NAN: inherited from confine; resolved by the loader)
  double ramp;                     // [s] confine, spin
  double friction;                 // [-] confine; NAN: the material's
  double plate_friction;           // [-] confine, compress: of the plates; NAN: that of the grains in this stage
  double tolerance;                // [-] confine: on the stresses, default 0.01
  double unbalanced;               // [-] confine: mean unbalanced over mean contact force, default 1e-3
  double timeout;                  // [s] confine: fails after this long, default 20 ramp + 20 s
  double rate;                     // [1/s] compress, shear (may be negative); deform: largest of rates, by the loader
  double strain;                   // [-] compress, shear
  tal_scene_membrane membrane;     // compress with boundary: membrane
  tal_scene_rates rates;           // deform
  tal_scene_stresses stresses;     // deform
  tal_scene_forced grain;          // spin
  double omega;                    // [rad/s] spin
  double hold;                     // [s] spin: after the ramp
  tal_scene_integrator integrator; // the stage's own, else a copy of the scene's
  int line;                        // of the stage in the file, for messages
} tal_scene_stage;

typedef struct tal_scene_output {
  double series_every;     // [s]
  double fields_every;     // [s] INFINITY: first and last state only
  double checkpoint_every; // [s]
  int64_t *tracks;         // owned; grain ids
  size_t track_count;
} tal_scene_output;

typedef struct tal_scene {
  char *name; // owned
  char *path; // owned; the scene file as given, for messages and relative paths
  uint64_t seed;
  tal_scene_grains grains;
  tal_material material;
  double mass_scaling;
  tal_scene_contact contact;
  double gravity[2]; // [m/s^2]
  bool rotation;
  tal_scene_wall *walls; // owned
  size_t wall_count;
  tal_scene_pack pack;
  tal_scene_continuum continuum;
  double skin;           // neighbours.skin [mean diameters]
  double overlap_limit;  // limits.overlap [smaller radius]: beyond it the run stops
  double stride_limit;   // limits.stride [smallest radius]: a grain that moves further in one step stops the run
  double world_limit;    // limits.world [mean diameters from the origin]: a grain beyond stops the run
  double residual_limit; // limits.residual: a jump of the ledger by a larger share stops the run
  double outside_limit;  // limits.outside [grains]: with more of them outside a minimal boundary the run stops
  tal_scene_integrator integrator;
  tal_scene_stage *stages; // owned
  size_t stage_count;
  tal_scene_output output;
  int line_dt, line_width; // lines of integrator.dt and pack.width in the file (0 when absent), for later messages
} tal_scene;

// Up to ten messages, each "FILE:LINE: key: what is wrong, what is accepted", in file order.
typedef struct tal_scene_errors {
  size_t count;
  tal_error item[10];
} tal_scene_errors;

// Reads and validates `path` with the overrides "key.sub=value" of --set applied on top. Returns TAL_OK with *scene
// filled (free with tal_scene_clear), TAL_BAD_INPUT or TAL_IO with the messages in `errors` and *scene empty.
tal_status tal_scene_load(tal_scene *scene, const char *path, const char *const *overrides, size_t override_count,
                          tal_scene_errors *errors);
void tal_scene_clear(tal_scene *scene);
// The scene as resolved (every key with its value, defaults included) as YAML that loads to the same scene; owned by
// the caller. Canonical: equal scenes give equal text (its hash identifies a checkpoint's scene).
char *tal_scene_text(const tal_scene *scene);
// `path` as it stands in the scene, relative to the scene file's folder; owned by the caller.
char *tal_scene_relative(const tal_scene *scene, const char *path);
// Mean radius [m] by the radius law or the list; NAN when only the packing file knows it.
double tal_scene_mean_radius(const tal_scene *scene);

#endif
