// The schema table. A new scene key is a member of a struct of scene.h and one row here. What depends on several keys
// at once is in scene_check.c.
#include "scene_schema.h"

#include "boundary_rows.h"
#include "delaunay.h"

#include <math.h>

#define AT(type, member)               .offset = offsetof(type, member), .size = sizeof(((type *)NULL)->member)
#define COUNTED(type, member, counter) AT(type, member), .count_offset = offsetof(type, counter)
#define KEY(word, kind)                .name = word, .type = TAL_KEY_##kind
#define ANY                            .low = -HUGE_VAL, .high = HUGE_VAL
#define POSITIVE                       .low = 0, .low_open = true, .high = HUGE_VAL
#define NOT_NEGATIVE                   .low = 0, .high = HUGE_VAL
#define FROM(least, most)              .low = least, .high = most
#define INSIDE(least, most)            .low = least, .high = most, .low_open = true, .high_open = true
#define ABOVE_TO(least, most)          .low = least, .high = most, .low_open = true
#define ONLY(key, values)              .selector = key, .only = values
#define CHOOSE(function)               .choices = function

static size_t fill(const tal_choice *list, size_t count, tal_choice *out, size_t capacity) {
  for (size_t i = 0; i < count && i < capacity; i++)
    out[i] = list[i];
  return count < capacity ? count : capacity;
}

#define FIXED_CHOICES(function, ...)                                                                                   \
  static size_t function(tal_choice *out, size_t capacity) {                                                           \
    static const tal_choice list[] = {__VA_ARGS__};                                                                    \
    return fill(list, sizeof list / sizeof *list, out, capacity);                                                      \
  }

FIXED_CHOICES(shape_choices, {"disk", "mass rho pi R^2 h, inertia m R^2/2"},
              {"sphere", "mass 4/3 rho pi R^3, inertia 2/5 m R^2"})
FIXED_CHOICES(radius_choices, {"uniform", "every radius between min and max equally likely"},
              {"lognormal", "ln r normally distributed, cut at min and max"},
              {"sieve", "sizes of a sieve curve, each with the same share of the mass"})
FIXED_CHOICES(lattice_choices, {"triangular", "six neighbours"}, {"square", "four neighbours"})
FIXED_CHOICES(tessellation_choices, {"delaunay", "plain Delaunay triangulation of the centres"},
              {"power", "weighted by radius squared: touching disks always share an edge"})
FIXED_CHOICES(cut_choices, {"circle", "grains whose centre lies inside a circle"},
              {"polygon", "grains whose centre lies inside a polygon"})

static size_t backend_choices(tal_choice *out, size_t capacity) {
  size_t count = 0;
  for (const geo_delaunay_backend *const *b = geo_delaunay_backends(); *b && count < capacity; b++)
    out[count++] = (tal_choice){(*b)->name, (*b)->help};
  return count;
}

static const tal_key radius_keys[] = {
    {KEY("law", CHOICE), .fallback = "uniform", CHOOSE(radius_choices), AT(tal_radius, law), .help = "size law"},
    {KEY("min", REAL), .unit = "m", ONLY("law", "uniform"), .required = true, POSITIVE, AT(tal_radius, min),
     .help = "smallest radius"},
    {KEY("max", REAL), .unit = "m", ONLY("law", "uniform"), .required = true, POSITIVE, AT(tal_radius, max),
     .help = "largest radius"},
    {KEY("median", REAL), .unit = "m", ONLY("law", "lognormal"), .required = true, POSITIVE, AT(tal_radius, median),
     .help = "median radius"},
    {KEY("sigma", REAL), ONLY("law", "lognormal"), .required = true, FROM(0, 3), AT(tal_radius, sigma),
     .help = "standard deviation of ln r"},
    {KEY("min", REAL), .unit = "m", ONLY("law", "lognormal"), .fallback = "0", NOT_NEGATIVE, AT(tal_radius, min),
     .help = "radii below are drawn again"},
    {KEY("max", REAL), .unit = "m", ONLY("law", "lognormal"), .fallback = ".inf", POSITIVE, .infinite = true,
     AT(tal_radius, max), .help = "radii above are drawn again"},
    {KEY("passing", PAIRS), ONLY("law", "sieve"), .required = true, FROM(1, 1000),
     COUNTED(tal_radius, passing, passing_count),
     .help = "points [diameter in m, percent passing by mass] of the sieve curve, both ascending"},
    {KEY("sizes", WHOLE), ONLY("law", "sieve"), .required = true, FROM(1, 1000), AT(tal_radius, sizes),
     .help = "number M of discrete sizes; size k passes 100 (2k-1)/(2M) percent"},
    {.name = NULL}};

static const tal_key listed_keys[] = {
    {KEY("x", REAL), .unit = "m", .required = true, ANY, AT(tal_listed_grain, x), .help = "centre"},
    {KEY("y", REAL), .unit = "m", .required = true, ANY, AT(tal_listed_grain, y), .help = "centre"},
    {KEY("r", REAL), .unit = "m", .required = true, POSITIVE, AT(tal_listed_grain, r), .help = "radius"},
    {KEY("vx", REAL), .unit = "m/s", .fallback = "0", ANY, AT(tal_listed_grain, vx), .help = "velocity"},
    {KEY("vy", REAL), .unit = "m/s", .fallback = "0", ANY, AT(tal_listed_grain, vy), .help = "velocity"},
    {KEY("omega", REAL), .unit = "rad/s", .fallback = "0", ANY, AT(tal_listed_grain, omega),
     .help = "spin, counter-clockwise"},
    {KEY("mass", REAL), .unit = "kg", .note = "from density and shape", POSITIVE, AT(tal_listed_grain, mass),
     .help = "own mass, not multiplied by mass_scaling"},
    {KEY("inertia", REAL), .unit = "kg m^2", .note = "from mass and shape", POSITIVE, AT(tal_listed_grain, inertia),
     .help = "own moment of inertia, not multiplied by mass_scaling"},
    {KEY("fixed", BOOL), .fallback = "false", AT(tal_listed_grain, fixed), .help = "keeps its velocities for ever"},
    {.name = NULL}};

static const tal_key grains_keys[] = {
    {KEY("count", WHOLE), .note = "none: one of count, list, a lattice or a file", FROM(1, 1e8),
     AT(tal_scene_grains, count), .help = "number of grains to pack"},
    {KEY("list", LIST), .note = "none", FROM(1, 1e8), COUNTED(tal_scene_grains, list, list_count),
     .item_size = sizeof(tal_listed_grain), .keys = listed_keys, .help = "grains one by one, ids from 0 in this order"},
    {KEY("radius", GROUP), .optional = true, .note = "required with count or a lattice", AT(tal_scene_grains, radius),
     .keys = radius_keys, .help = "radii; a lattice takes law: uniform with min = max"},
    {KEY("shape", CHOICE), .fallback = "disk", CHOOSE(shape_choices), AT(tal_scene_grains, shape),
     .help = "sets mass and inertia"},
    {KEY("thickness", REAL), .unit = "m", .note = "twice the mean radius", POSITIVE, AT(tal_scene_grains, thickness),
     .help = "h out of the plane: turns forces into stresses"},
    {.name = NULL}};

static const tal_key material_keys[] = {
    {KEY("young", REAL), .unit = "Pa", .note = "required with normal: hertz", POSITIVE, AT(tal_material, young),
     .help = "Young's modulus"},
    {KEY("poisson", REAL), .fallback = "0.3", ABOVE_TO(-1, 0.5), AT(tal_material, poisson), .help = "Poisson's ratio"},
    {KEY("density", REAL), .unit = "kg/m^3", .note = "required unless every listed grain has a mass", POSITIVE,
     AT(tal_material, density), .help = "density before mass scaling"},
    {KEY("friction", REAL), .fallback = "0", NOT_NEGATIVE, AT(tal_material, friction),
     .help = "coefficient of friction between grains"},
    {KEY("damping", REAL), .unit = "s", .fallback = "0", NOT_NEGATIVE, AT(tal_material, damping),
     .help = "T of the viscous part T K d^0.5 d' of normal: hertz; or contact.restitution"},
    {.name = NULL}};

static const tal_key contact_keys[] = {
    {KEY("normal", CHOICE), .fallback = "hertz", CHOOSE(tal_normal_law_choices), AT(tal_scene_contact, normal),
     .help = "normal contact law"},
    {KEY("tangential", CHOICE), .note = "regularised with friction, else none", CHOOSE(tal_tangential_law_choices),
     AT(tal_scene_contact, tangential), .help = "tangential contact law"},
    {KEY("exponent", REAL), ONLY("tangential", "regularised"), .fallback = "20", FROM(1, HUGE_VAL),
     AT(tal_scene_contact, exponent), .help = "c of mu f_n (s/vR)^(1/c)"},
    {KEY("vR", REAL), .unit = "m/s", ONLY("tangential", "regularised"),
     .note = "2 rate Rmean of the first stage with a rate", POSITIVE, AT(tal_scene_contact, vR),
     .help = "reference slip speed; required when no stage has a rate"},
    {KEY("tangential_ratio", REAL), ONLY("tangential", "spring"), .note = "Mindlin's 2(1-nu)/(2-nu)", POSITIVE,
     AT(tal_scene_contact, tangential_ratio), .help = "k_t / k_n of the tangential spring"},
    {KEY("stiffness", REAL), .unit = "N/m", ONLY("normal", "linear"), .required = true, POSITIVE,
     AT(tal_scene_contact, stiffness), .help = "normal stiffness"},
    {KEY("restitution", REAL), .note = "none: undamped", ABOVE_TO(0, 1), AT(tal_scene_contact, restitution),
     .help = "delivered speed ratio of every pair of bodies; in place of damping"},
    {KEY("restitution_speed", REAL), .unit = "m/s", ONLY("normal", "hertz"), .note = "vR", POSITIVE,
     AT(tal_scene_contact, restitution_speed),
     .help = "impact speed at which a pair delivers restitution; required with it when there is no vR"},
    {KEY("damping", REAL), .unit = "N s/m", ONLY("normal", "linear"), .note = "0", NOT_NEGATIVE,
     AT(tal_scene_contact, damping), .help = "normal dashpot; in place of restitution"},
    {.name = NULL}};

static const tal_key wall_keys[] = {
    {KEY("from", VECTOR), .unit = "m", .required = true, ANY, AT(tal_scene_wall, from), .help = "one end"},
    {KEY("to", VECTOR), .unit = "m", .required = true, ANY, AT(tal_scene_wall, to), .help = "other end"},
    {KEY("velocity", VECTOR), .unit = "m/s", .fallback = "[0, 0]", ANY, AT(tal_scene_wall, velocity),
     .help = "of the whole wall"},
    {KEY("young", REAL), .unit = "Pa", .note = "the material's", POSITIVE, .infinite = true, AT(tal_scene_wall, young),
     .help = "Young's modulus; .inf is rigid"},
    {KEY("poisson", REAL), .note = "the material's", ABOVE_TO(-1, 0.5), AT(tal_scene_wall, poisson),
     .help = "Poisson's ratio"},
    {KEY("friction", REAL), .note = "the material's", NOT_NEGATIVE, AT(tal_scene_wall, friction),
     .help = "coefficient of friction of its contacts"},
    {KEY("from_time", REAL), .unit = "s", .fallback = "0", ANY, AT(tal_scene_wall, from_time),
     .help = "there from this time on"},
    {KEY("until_time", REAL), .unit = "s", .fallback = ".inf", ANY, .infinite = true, AT(tal_scene_wall, until_time),
     .help = "gone from this time on (a gate opens)"},
    {.name = NULL}};

static const tal_key cut_keys[] = {{KEY("shape", CHOICE), .fallback = "circle", CHOOSE(cut_choices),
                                    AT(tal_scene_pack, cut_shape), .help = "what is kept"},
                                   {KEY("radius", REAL), .unit = "m", ONLY("shape", "circle"), .required = true,
                                    POSITIVE, AT(tal_scene_pack, cut_radius),
                                    .help = "of the circle about the middle of the packing's box"},
                                   {KEY("points", PAIRS), .unit = "m", ONLY("shape", "polygon"), .required = true,
                                    FROM(3, 1000), COUNTED(tal_scene_pack, cut_points, cut_point_count),
                                    .help = "corners [x, y] in order, from the middle of the packing's box"},
                                   {.name = NULL}};

static const tal_key pack_keys[] = {
    {KEY("method", CHOICE), .note = "drop_and_roll with count, none with list", CHOOSE(tal_packer_choices),
     AT(tal_scene_pack, method), .help = "how the grains are placed"},
    {KEY("width", REAL), .unit = "m", ONLY("method", "drop_and_roll"), .required = true, POSITIVE,
     AT(tal_scene_pack, width), .help = "of the box"},
    {KEY("path", TEXT), ONLY("method", "file"), .required = true, AT(tal_scene_pack, path),
     .help = "CSV with columns x,y,r, relative to the scene file's folder"},
    {KEY("pattern", CHOICE), ONLY("method", "lattice"), .fallback = "triangular", CHOOSE(lattice_choices),
     AT(tal_scene_pack, pattern), .help = "lattice of equal grains"},
    {KEY("columns", WHOLE), ONLY("method", "lattice"), .required = true, FROM(1, 1e8), AT(tal_scene_pack, columns),
     .help = "grains in a row"},
    {KEY("rows", WHOLE), ONLY("method", "lattice"), .required = true, FROM(1, 1e8), AT(tal_scene_pack, rows),
     .help = "number of rows"},
    {KEY("gap", REAL), .unit = "m", ONLY("method", "lattice"), .fallback = "0", ANY, AT(tal_scene_pack, gap),
     .help = "between neighbours; negative: overlap"},
    {KEY("cut", GROUP), .optional = true, .note = "none", .offset = 0, .size = sizeof(tal_scene_pack), .keys = cut_keys,
     .help = "keeps only the grains inside; such a sample is confined without plates"},
    {.name = NULL}};

static const tal_key refresh_keys[] = {
    {KEY("strain", REAL), .note = "one of the two", POSITIVE, AT(tal_scene_continuum, refresh_strain),
     .help = "refresh after this much macroscopic strain"},
    {KEY("displacement", REAL), .unit = "mean diameters", .note = "one of the two", POSITIVE,
     AT(tal_scene_continuum, refresh_displacement), .help = "refresh when a grain has moved this far"},
    {.name = NULL}};

static const tal_key continuum_keys[] = {
    {KEY("backend", CHOICE), .note = "cgal if built in, else qhull", CHOOSE(backend_choices),
     AT(tal_scene_continuum, backend), .help = "triangulation library"},
    {KEY("tessellation", CHOICE), .fallback = "delaunay", CHOOSE(tessellation_choices), AT(tal_scene_continuum, power),
     .help = "kind of triangulation"},
    {KEY("refresh", WHOLE), .unit = "steps", .fallback = "250", FROM(1, 1e12), AT(tal_scene_continuum, refresh_steps),
     .keys = refresh_keys, .help = "steps between triangulations, or one of the two keys below"},
    {KEY("peel", REAL), .unit = "mean diameters", .fallback = "0.5", POSITIVE, AT(tal_scene_continuum, peel),
     .help = "hull edges with a wider gap are peeled off"},
    {.name = NULL}};

static const tal_key neighbours_keys[] = {
    {KEY("skin", REAL), .unit = "mean diameters", .fallback = "0.02", ABOVE_TO(0, 10), AT(tal_scene, skin),
     .help = "reach of the neighbour list beyond contact: cost only (implicit_friction: the order of its sweeps too)"},
    {.name = NULL}};

static const tal_key limits_keys[] = {
    {KEY("overlap", REAL), .unit = "smaller radius", .fallback = "0.5", ABOVE_TO(0, 1), AT(tal_scene, overlap_limit),
     .help = "a deeper contact stops the run as invalid (exit 3), the last good checkpoint is kept"},
    {KEY("outside", REAL), .unit = "grains", .fallback = "0.05", FROM(0, 1), AT(tal_scene, outside_limit),
     .help = "a larger share of the grains outside a minimal boundary's loop stops the run as invalid"},
    {KEY("stride", REAL), .unit = "smallest radius", .fallback = "0.5", POSITIVE, .infinite = true,
     AT(tal_scene, stride_limit), .help = "a grain that moves further in one step stops the run as invalid"},
    {KEY("world", REAL), .unit = "mean diameters", .fallback = "1e7", POSITIVE, .infinite = true,
     AT(tal_scene, world_limit), .help = "a grain further than this from the origin stops the run as invalid"},
    {KEY("residual", REAL), .fallback = "0.1", POSITIVE, .infinite = true, AT(tal_scene, residual_limit),
     .help = "a larger jump of the energy ledger between two rows, as a share of all energy, stops the run as invalid"},
    {.name = NULL}};

static const tal_key integrator_keys[] = {
    {KEY("scheme", CHOICE), .fallback = "verlet", CHOOSE(tal_integrator_choices), AT(tal_scene_integrator, scheme),
     .help = "time integrator"},
    {KEY("dt", REAL), .unit = "s", .required = true, POSITIVE, AT(tal_scene_integrator, dt),
     .help = "time step; the small one of two_timescale"},
    {KEY("m", WHOLE), ONLY("scheme", "two_timescale"), .required = true, FROM(1, 1e6), AT(tal_scene_integrator, m),
     .help = "a cycle is m times (one step of n dt, q steps of dt): m (n + q) small steps"},
    {KEY("n", WHOLE), ONLY("scheme", "two_timescale"), .required = true, FROM(1, 1e6), AT(tal_scene_integrator, n),
     .help = "length of the long step in small steps"},
    {KEY("q", WHOLE), ONLY("scheme", "two_timescale"), .required = true, FROM(0, 1e6), AT(tal_scene_integrator, q),
     .help = "small steps after each long one"},
    {KEY("sweeps", WHOLE), ONLY("scheme", "implicit_friction"), .fallback = "2", FROM(1, 1000),
     AT(tal_scene_integrator, sweeps), .help = "over all contacts in a step: friction is corrected contact by contact"},
    {KEY("tolerance", REAL), ONLY("scheme", "implicit_friction"), .note = "none: sweeps alone", POSITIVE,
     AT(tal_scene_integrator, tolerance),
     .help = "sweeps on (at most 200 more) while a friction force changes by more than this share of mu f_n"},
    {KEY("force", BOOL), .fallback = "false", AT(tal_scene_integrator, force),
     .help = "runs above the critical time step, at the user's risk"},
    {.name = NULL}};

static const tal_key stage_integrator_keys[] = {
    {KEY("scheme", CHOICE), .note = "the scene's", CHOOSE(tal_integrator_choices), AT(tal_scene_integrator, scheme),
     .help = "time integrator of this stage"},
    {KEY("dt", REAL), .unit = "s", .note = "the scene's", POSITIVE, AT(tal_scene_integrator, dt),
     .help = "time step of this stage"},
    {KEY("m", WHOLE), ONLY("scheme", "two_timescale"), .note = "the scene's", FROM(1, 1e6), AT(tal_scene_integrator, m),
     .help = "long steps in a cycle of this stage"},
    {KEY("n", WHOLE), ONLY("scheme", "two_timescale"), .note = "the scene's", FROM(1, 1e6), AT(tal_scene_integrator, n),
     .help = "length of the long step in small steps"},
    {KEY("q", WHOLE), ONLY("scheme", "two_timescale"), .note = "the scene's", FROM(0, 1e6), AT(tal_scene_integrator, q),
     .help = "small steps after each long one"},
    {KEY("sweeps", WHOLE), ONLY("scheme", "implicit_friction"), .note = "the scene's, else 2", FROM(1, 1000),
     AT(tal_scene_integrator, sweeps), .help = "over all contacts in a step of this stage"},
    {KEY("tolerance", REAL), ONLY("scheme", "implicit_friction"), .note = "the scene's", POSITIVE,
     AT(tal_scene_integrator, tolerance), .help = "of the friction forces in this stage"},
    {KEY("force", BOOL), .note = "the scene's", AT(tal_scene_integrator, force),
     .help = "runs above the critical time step, at the user's risk"},
    {.name = NULL}};

static const tal_key membrane_keys[] = {
    {KEY("stiffness", REAL), .unit = "N/m", .fallback = "1e4", POSITIVE, AT(tal_scene_membrane, stiffness),
     .help = "of a link against stretching [P: 10 N/mm]; a link shorter than at rest is slack"},
    {KEY("prestress", REAL), .unit = "N", .fallback = "0", NOT_NEGATIVE, AT(tal_scene_membrane, prestress),
     .help = "tension of a link before the membrane is laid; 0: it just fits the height of the sample"},
    {KEY("radius", REAL), .unit = "m", .note = "1.25 mean radii", POSITIVE, AT(tal_scene_membrane, radius),
     .help = "of a bead: larger than the grains, so that none slips through; links are two radii long"},
    {KEY("mass", REAL), .unit = "kg", .note = "of a grain of that radius, scaled", POSITIVE,
     AT(tal_scene_membrane, mass), .help = "of a bead"},
    {KEY("damping", REAL), .fallback = "0.2", NOT_NEGATIVE, AT(tal_scene_membrane, damping),
     .help = "of a link, as a share of critical"},
    {.name = NULL}};

static const tal_key rate_keys[] = {
    {KEY("xx", REAL), .unit = "1/s", .note = "left to the stress", ANY, AT(tal_scene_rates, xx), .help = "dvx/dx"},
    {KEY("yy", REAL), .unit = "1/s", .note = "left to the stress", ANY, AT(tal_scene_rates, yy), .help = "dvy/dy"},
    {KEY("xy", REAL), .unit = "1/s", .note = "0, unless stresses.xy is given", ANY, AT(tal_scene_rates, xy),
     .help = "dvx/dy"},
    {KEY("yx", REAL), .unit = "1/s", .note = "0, unless stresses.xy is given", ANY, AT(tal_scene_rates, yx),
     .help = "dvy/dx"},
    {.name = NULL}};

static const tal_key stress_keys[] = {
    {KEY("xx", REAL), .unit = "Pa", .note = "the pressure", ANY, AT(tal_scene_stresses, xx), .help = "on the sides"},
    {KEY("yy", REAL), .unit = "Pa", .note = "the pressure", ANY, AT(tal_scene_stresses, yy),
     .help = "on top and bottom"},
    {KEY("xy", REAL), .unit = "Pa", .note = "shear is imposed", ANY, AT(tal_scene_stresses, xy), .help = "shear"},
    {.name = NULL}};

static const tal_key stage_keys[] = {
    {KEY("kind", CHOICE), .required = true, CHOOSE(tal_stage_choices), AT(tal_scene_stage, kind),
     .help = "what the stage does"},
    {KEY("duration", REAL), .unit = "s", ONLY("kind", "free deform"), .required = true, POSITIVE,
     AT(tal_scene_stage, duration), .help = "ends after round(duration/dt) steps"},
    {KEY("pressure", REAL), .unit = "Pa", ONLY("kind", "confine"), .required = true, POSITIVE,
     AT(tal_scene_stage, pressure), .help = "isotropic pressure to reach"},
    {KEY("grain", FORCED), ONLY("kind", "spin"), .fallback = "nearest", AT(tal_scene_stage, grain),
     .help = "that is turned: the one nearest to the middle, an id; many, each in a run of its own: ids, or drawn"},
    {KEY("omega", REAL), .unit = "rad/s", ONLY("kind", "spin"), .required = true, ANY, AT(tal_scene_stage, omega),
     .help = "spin that is imposed on the grain, counter-clockwise"},
    {KEY("ramp", REAL), .unit = "s", ONLY("kind", "spin"), .fallback = "2.5", POSITIVE, AT(tal_scene_stage, ramp),
     .help = "time over which the spin is raised"},
    {KEY("hold", REAL), .unit = "s", ONLY("kind", "spin"), .fallback = "0.5", NOT_NEGATIVE, AT(tal_scene_stage, hold),
     .help = "time for which it is held then"},
    {KEY("ramp", REAL), .unit = "s", ONLY("kind", "confine"), .fallback = "4.0", POSITIVE, AT(tal_scene_stage, ramp),
     .help = "time over which the pressure is raised"},
    {KEY("friction", REAL), ONLY("kind", "confine"), .note = "the material's", NOT_NEGATIVE,
     AT(tal_scene_stage, friction), .help = "between grains in this stage: low gives dense, high loose samples"},
    {KEY("plate_friction", REAL), ONLY("kind", "confine compress"), .note = "that between grains in this stage",
     NOT_NEGATIVE, AT(tal_scene_stage, plate_friction), .help = "between plates and grains"},
    {KEY("tolerance", REAL), ONLY("kind", "confine"), .fallback = "0.01", INSIDE(0, 1), AT(tal_scene_stage, tolerance),
     .help = "ends when both normal stresses are this close to the pressure (relative)"},
    {KEY("unbalanced", REAL), ONLY("kind", "confine"), .fallback = "1e-3", POSITIVE, AT(tal_scene_stage, unbalanced),
     .help = "and mean unbalanced force over mean contact force is below this"},
    {KEY("timeout", REAL), .unit = "s", ONLY("kind", "confine"), .note = "20 ramp + 20 s", POSITIVE,
     AT(tal_scene_stage, timeout), .help = "fails after this long, saying what was reached"},
    {KEY("boundary", CHOICE), ONLY("kind", "compress"), .fallback = "pressure", CHOOSE(tal_boundary_choices),
     AT(tal_scene_stage, boundary), .help = "lateral boundary, or minimal for no plates at all"},
    {KEY("membrane", GROUP), ONLY("kind", "compress"), .optional = true, .note = "with boundary: membrane",
     AT(tal_scene_stage, membrane), .keys = membrane_keys, .help = "the beads of boundary: membrane"},
    {KEY("method", CHOICE), ONLY("kind", "compress shear deform"), .note = "exact with minimal boundaries",
     CHOOSE(tal_method_choices), AT(tal_scene_stage, method), .help = "how minimal boundaries impose the strain rate"},
    {KEY("penalty", REAL), .unit = "N m s", ONLY("kind", "compress shear deform"),
     .note = "half the explicit limit when the stage begins", POSITIVE, AT(tal_scene_stage, penalty),
     .help = "constant K of method: penalty; above the explicit limit the run stops"},
    {KEY("order", WHOLE), ONLY("kind", "compress shear deform"), .note = "0 with minimal boundaries",
     FROM(0, TAL_ORDER_MOST), AT(tal_scene_stage, order),
     .help = "of minimal boundaries, method: exact: 0 uniform traction; higher orders hold the shape"},
    {KEY("pressure", REAL), .unit = "Pa", ONLY("kind", "compress shear deform"),
     .note = "that of the last confine stage before", POSITIVE, AT(tal_scene_stage, pressure),
     .help = "lateral pressure; on all sides with minimal boundaries"},
    {KEY("pressure", REAL), .unit = "Pa", ONLY("kind", "spin"),
     .note = "that of the last confine stage before; none: nothing presses or holds the assembly", POSITIVE,
     AT(tal_scene_stage, pressure), .help = "on all sides"},
    {KEY("rate", REAL), .unit = "1/s", ONLY("kind", "compress"), .required = true, POSITIVE, AT(tal_scene_stage, rate),
     .help = "rate of the engineering axial strain"},
    {KEY("rate", REAL), .unit = "1/s", ONLY("kind", "shear"), .required = true, ANY, AT(tal_scene_stage, rate),
     .help = "L_xy of simple shear; negative: the other way"},
    {KEY("strain", REAL), ONLY("kind", "shear"), .required = true, POSITIVE, AT(tal_scene_stage, strain),
     .help = "amount of shear strain that the stage adds, in the direction of the rate"},
    {KEY("rates", GROUP), ONLY("kind", "deform"), .optional = true, .note = "none", AT(tal_scene_stage, rates),
     .keys = rate_keys, .help = "imposed components of the mean velocity gradient"},
    {KEY("stresses", GROUP), ONLY("kind", "deform"), .optional = true, .note = "the pressure",
     AT(tal_scene_stage, stresses), .keys = stress_keys, .help = "stresses on the loop, compression positive"},
    {KEY("strain", REAL), ONLY("kind", "compress"), .required = true, INSIDE(0, 1), AT(tal_scene_stage, strain),
     .help = "engineering axial strain that the stage adds"},
    {KEY("integrator", GROUP), .optional = true, .note = "the scene's", AT(tal_scene_stage, integrator),
     .keys = stage_integrator_keys, .help = "own settings of this stage"},
    {.name = NULL}};

static const tal_key output_keys[] = {
    {KEY("series_every", REAL), .unit = "s", .fallback = "0.05", NOT_NEGATIVE, .infinite = true,
     AT(tal_scene_output, series_every), .help = "between rows of series.csv; at or below dt: every step"},
    {KEY("fields_every", REAL), .unit = "s", .fallback = ".inf", POSITIVE, .infinite = true,
     AT(tal_scene_output, fields_every), .help = "between field files; .inf: first state and ends of stages only"},
    {KEY("checkpoint_every", REAL), .unit = "s", .fallback = "2.0", POSITIVE, .infinite = true,
     AT(tal_scene_output, checkpoint_every), .help = "between checkpoints, in simulated time"},
    {KEY("tracks", WHOLES), .fallback = "[]", FROM(0, 1e8), COUNTED(tal_scene_output, tracks, track_count),
     .help = "ids of grains followed in tracks.csv"},
    {.name = NULL}};

// A group whose members lie in tal_scene itself.
#define IN_SCENE .offset = 0, .size = sizeof(tal_scene)

static const tal_key scene_keys[] = {
    {KEY("name", TEXT), .fallback = "talus", AT(tal_scene, name), .help = "title of the run"},
    {KEY("seed", WHOLE), .fallback = "1", NOT_NEGATIVE, AT(tal_scene, seed), .help = "of every random choice"},
    {KEY("grains", GROUP), AT(tal_scene, grains), .keys = grains_keys, .help = "the grains"},
    {KEY("material", GROUP), AT(tal_scene, material), .keys = material_keys, .help = "of the grains"},
    {KEY("mass_scaling", REAL), .fallback = "1", POSITIVE, AT(tal_scene, mass_scaling),
     .help = "factor on the masses found from density"},
    {KEY("contact", GROUP), AT(tal_scene, contact), .keys = contact_keys, .help = "contact laws"},
    {KEY("gravity", VECTOR), .unit = "m/s^2", .fallback = "[0, 0]", ANY, AT(tal_scene, gravity),
     .help = "acceleration [x, y]"},
    {KEY("rotation", BOOL), .fallback = "true", AT(tal_scene, rotation), .help = "false holds every grain's spin"},
    {KEY("walls", LIST), .fallback = "[]", FROM(0, 1e6), COUNTED(tal_scene, walls, wall_count),
     .item_size = sizeof(tal_scene_wall), .keys = wall_keys, .help = "straight two-sided walls"},
    {KEY("pack", GROUP), AT(tal_scene, pack), .keys = pack_keys, .help = "where the grains start"},
    {KEY("continuum", GROUP), AT(tal_scene, continuum), .keys = continuum_keys, .help = "the Delaunay continuum"},
    {KEY("neighbours", GROUP), IN_SCENE, .keys = neighbours_keys, .help = "neighbour list"},
    {KEY("limits", GROUP), IN_SCENE, .keys = limits_keys, .help = "when a run is invalid"},
    {KEY("integrator", GROUP), AT(tal_scene, integrator), .keys = integrator_keys, .help = "integration in time"},
    {KEY("stages", LIST), .fallback = "[]", FROM(0, 10000), COUNTED(tal_scene, stages, stage_count),
     .item_size = sizeof(tal_scene_stage), .keys = stage_keys, .help = "what is done, one after the other"},
    {KEY("output", GROUP), AT(tal_scene, output), .keys = output_keys, .help = "what is written, and when"},
    {.name = NULL}};

const tal_key *tal_schema(void) {
  return scene_keys;
}
