// Friction and normal damping of one contact solved at the velocity they leave behind, eqs (50)-(53) of docs/method.md:
// the force of a step is the law's force at the speed that this very force brings about. All laws are monotone, so
// there is one root.
#ifndef TAL_LAW_IMPLICIT_H
#define TAL_LAW_IMPLICIT_H

#include "lanes.h"
#include "root.h"
#include <math.h>
#include <string.h>

// Normal force [N] of a contact with elastic force fe and viscosity c [N s/m] whose mean speed of approach over the
// kick would be `free` without it; yield [m/(s N)]: what a unit of normal force takes off that mean.
TAL_KERNEL double tal_implicit_normal(double elastic, double viscosity, double free, double yield) {
  double fn = (elastic + viscosity * free) / (1 + viscosity * yield);
  return fn > 0 ? fn : 0;
}

// 2^x to 1e-3, |x| < 1000.
TAL_KERNEL double tal_rough_exp2(double x) {
  const double round = 6755399441055744.0; // 1.5 2^52
  double n = (x + round) - round, r = x - n;
  return tal_double(((tal_bits(n + 4503599627370496.0 + 1023.0) & 0x7ffULL)) << 52) *
         (1 + r * (0.6931 + r * (0.2402 + r * 0.0555)));
}

// log2 x to 0.05, x normal and positive.
TAL_KERNEL double tal_rough_log2(double x) {
  uint64_t u = tal_bits(x);
  double exponent = tal_double((u >> 52) | 0x4330000000000000ULL) - (4503599627370496.0 + 1023.0);
  return exponent + tal_double((u & 0xfffffffffffffULL) | 0x3ff0000000000000ULL) - 0.957;
}

// Regularised law: the root u of u^c + b u = a; u is |ft| / (mu fn), a >= 0 the slip over vR that friction has to
// brake, b >= 0 the slip over vR that mu fn takes away in the kick, c >= 1. The left side is convex and grows, and the
// smaller of a/b (it sticks: friction takes all) and a^(1/c) (it slides: friction takes next to nothing) is near it:
// above by some 1/c where the two are alike.
TAL_KERNEL double tal_implicit_guess(double a, double b, double c, double inverse_c) {
  double stuck = a / (b > 1e-280 ? b : 1e-280), slides = tal_rough_exp2(tal_rough_log2(a) * inverse_c);
  double least = stuck < slides ? stuck : slides, alike = least / (stuck < slides ? slides : stuck);
  return least * (1 - (c >= 2 ? 1.2 * inverse_c : 0) * alike * alike);
}

// Contacts whose root is sought together: so many vectors that one operation does not wait for the one before, of the
// width that the processor has, for wider ones go through memory.
#ifdef __AVX512F__
enum { TAL_WIDTH_OF_ROOTS = 8 };
#else
enum { TAL_WIDTH_OF_ROOTS = 4 };
#endif
enum { TAL_ROOT_VECTORS = 4, TAL_ROOT_LANES = TAL_WIDTH_OF_ROOTS * TAL_ROOT_VECTORS };
typedef double tal_wide __attribute__((vector_size(8 * TAL_WIDTH_OF_ROOTS), aligned(8), may_alias));
typedef struct tal_roots {
  tal_wide v[TAL_ROOT_VECTORS];
} tal_roots;

// u^e for a whole e >= 0, by squaring.
TAL_KERNEL void tal_whole_powers(const tal_roots *u, tal_roots *out, int e) {
  tal_roots square = *u;
  *out = *u;
  for (int m = 0; m < TAL_ROOT_VECTORS && !(e & 1); m++)
    out->v[m] = (tal_wide){0} + 1;
  for (int left = e >> 1; left; left >>= 1) {
    for (int m = 0; m < TAL_ROOT_VECTORS; m++)
      square.v[m] *= square.v[m];
    for (int m = 0; m < TAL_ROOT_VECTORS && left & 1; m++)
      out->v[m] *= square.v[m];
  }
}

TAL_KERNEL void tal_any_powers(const tal_roots *u, tal_roots *out, double e) {
  const double *from = (const double *)u->v;
  double *to = (double *)out->v;
#pragma omp simd
  for (int k = 0; k < TAL_ROOT_LANES; k++)
    to[k] = tal_power(from[k], e);
}

// One round of Halley's iteration with power = u^(c-2).
TAL_KERNEL void tal_implicit_round(tal_roots *u, const tal_roots *power, const tal_roots *a, const tal_roots *b,
                                   double c) {
  for (int m = 0; m < TAL_ROOT_VECTORS; m++) {
    const tal_wide first = power->v[m] * u->v[m], excess = u->v[m] * (first + b->v[m]) - a->v[m];
    const tal_wide slope = c * first + b->v[m], bend = c * (c - 1) * power->v[m];
    u->v[m] -= 2 * excess * slope / (2 * slope * slope - excess * bend);
  }
}

// Roots of `count` contacts, at most a block, in arrays that hold whole sets of TAL_ROOT_LANES; a and b as above. A
// whole c takes products where another takes a logarithm and an exponential. To round-off for c up to 200
// (tests/test_implicit_friction.c).
TAL_KERNEL void tal_implicit_shares(const double *restrict a, const double *restrict b, double *restrict u, int count,
                                    double c) {
  const double inverse_c = 1 / c;
  const int whole = c >= 2 && c == floor(c) && c < 1000 ? (int)c - 2 : -1, rounds = c <= 50 ? 3 : 4;
#pragma omp simd
  for (int k = 0; k < count; k++)
    u[k] = tal_implicit_guess(a[k] > 1e-280 ? a[k] : 1e-280, b[k], c, inverse_c);
  for (int k = 0; k < count; k += TAL_ROOT_LANES) {
    tal_roots x, power;
    memcpy(&x, u + k, sizeof x);
    for (int round = 0; round < rounds; round++) {
      if (whole >= 0)
        tal_whole_powers(&x, &power, whole);
      else
        tal_any_powers(&x, &power, c - 2);
      tal_implicit_round(&x, &power, (const tal_roots *)(a + k), (const tal_roots *)(b + k), c);
    }
    memcpy(u + k, &x, sizeof x);
  }
#pragma omp simd
  for (int k = 0; k < count; k++)
    u[k] = a[k] > 1e-280 ? u[k] : 0;
}

// Spring law: the force at this instant is the mean (1, 2, 1)/4 of the spring's at the last, this and the next instant,
// the last of which depends on the force: q - k dt (s - before)/4 with s = free + compliance dt ft, cut at the cap.
// q: spring force at this instant [N]; k_dt = kt dt [N s/m]; compliance_dt [m/(s N)] slip per force.
TAL_KERNEL double tal_implicit_spring(double q, double k_dt, double free, double before, double compliance_dt,
                                      double cap) {
  double trial = (q - 0.25 * k_dt * (free - before)) / (1 + 0.25 * k_dt * compliance_dt);
  double above = trial > cap ? cap : trial;
  return above < -cap ? -cap : above;
}

#endif
