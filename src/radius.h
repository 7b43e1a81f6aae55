// Radius laws: the sizes of the grains a packer makes.
//   uniform    r uniform in [min, max].
//   lognormal  ln(r / median) normal with standard deviation sigma, cut off (not clamped) to [min, max].
//   sieve      a grading curve, percent of the MASS passing each sieve diameter [H 4.1]. The curve is read straight
//              between sieves in percent against ln(diameter); mass below the first sieve given takes its diameter,
//              mass above the last takes that one's. The mass is cut in M equal parts; part k = 1..M is made of equal
//              grains of the diameter D_k at percentile 100 (2k - 1)/(2M). Equal masses turn into NUMBERS of grains by
//              the mass of one grain: the probability of D_k is D_k^-p / sum D_l^-p, p = 3 for spheres (H's equation)
//              and p = 2 for disks, whose mass goes with the area.
// Same law, same stream: same bits, except that exp, ln and the normal quantile (lognormal, sieve) are those of libm
// and GSL. Lengths scaled by a power of two give radii scaled by it, bit for bit.
#ifndef TAL_RADIUS_H
#define TAL_RADIUS_H

#include "scene.h"
#include <gsl/gsl_rng.h>

// TAL_BAD_INPUT with a sentence (without file and key) when the law cannot be drawn from.
tal_status tal_radius_check(const tal_radius *law, tal_error *err);
// Draws r[n] [m], one number of the stream each (two at most for sieve). The law must pass tal_radius_check.
void tal_radius_draw(const tal_radius *law, tal_shape shape, gsl_rng *rng, double *r, size_t n);
// Mean radius [m] of the law, by number.
double tal_radius_mean(const tal_radius *law, tal_shape shape);
// The one radius [m] of a law that has only one, else NAN.
double tal_radius_single(const tal_radius *law);
// Sieve: the M diameters [m], ascending, and the probability by number of each; both [law->sizes].
void tal_radius_sieve_sizes(const tal_radius *law, tal_shape shape, double *diameter, double *probability);

#endif
