// x^(1/c) for the regularised friction law, without branches, so that it vectorises with the loop around it and gives
// the same bits whatever the vector width. It is 2^(log2(x)/c). Logarithm: argument reduced to [sqrt(1/2), sqrt(2)) and
// a polynomial for log2(m) = 2/ln 2 atanh(s), s = (m - 1)/(m + 1); power: 2^n times a polynomial for 2^f, |f| <= 1/2.
// Both polynomials interpolate at Chebyshev's nodes, absolute error 2.5e-18 and 2.1e-17. Relative error of x^(1/c)
// below (4 + 1.7 |ln x|/c) eps (tests/test_root.c): half an eps each from adding log2 m to the exponent and from the
// product with 1/c, 4 eps from the polynomials' own rounding. 0 for x below 1e-300.
#ifndef TAL_ROOT_H
#define TAL_ROOT_H

#include "effects.h"
#include <stdint.h>
#include <string.h>

TAL_KERNEL uint64_t tal_bits(double x) {
  uint64_t u;
  memcpy(&u, &x, sizeof u);
  return u;
}

TAL_KERNEL double tal_double(uint64_t u) {
  double x;
  memcpy(&x, &u, sizeof x);
  return x;
}

// a b + c, rounded once wherever it runs: an instruction from AVX2 on, exact in the library elsewhere.
TAL_KERNEL double tal_fma(double a, double b, double c) {
  return __builtin_fma(a, b, c);
}

// log2 x of a normal x > 0.
TAL_KERNEL double tal_log2(double x) {
  const uint64_t sqrt_half = 0x3fe6a09e667f3bcdULL; // bits of sqrt(1/2)
  const uint64_t magic = 0x4330000000000000ULL;     // bits of 2^52: integers below 2^52 become doubles by an OR
  // exponent + 1024, kept positive so that a logical shift does
  uint64_t u = tal_bits(x) - sqrt_half + (1024ULL << 52);
  double exponent = tal_double(u >> 52 | magic) - (4503599627370496.0 + 1024.0);
  double m = tal_double((u & 0x000fffffffffffffULL) + sqrt_half);
  double s = (m - 1) / (m + 1), z = s * s, z2 = z * z, z4 = z2 * z2;
  // both polynomials by Estrin's scheme: Horner's chain of dependent operations took twice the time
  double p = tal_fma(z2, tal_fma(z, 0x1.484b091a92bb1p-2, 0x1.a61762b534b6ep-2),
                     tal_fma(z, 0x1.2776c50ef68f3p-1, 0x1.ec709dc3a0401p-1));
  double q = tal_fma(z2, 0x1.afde0dd07fe15p-3, tal_fma(z, 0x1.c4ff2c46480e7p-3, 0x1.0c9e91c7d1b10p-2));
  return exponent + tal_fma(s, 0x1.71547652b82fep+1, s * z * tal_fma(z4, q, p));
}

// 2^y, |y| < 1020.
TAL_KERNEL double tal_exp2(double y) {
  const double round = 6755399441055744.0; // 1.5 2^52: the nearest integer n ends up in the low bits
  double shifted = y + round;
  double f = y - (shifted - round), f2 = f * f, f4 = f2 * f2;
  double low = tal_fma(f2, tal_fma(f, 0x1.5d87fe78a5dc1p-10, 0x1.3b2ab6fba3856p-7),
                       tal_fma(f, 0x1.c6b08d704a0c0p-5, 0x1.ebfbdff82c590p-3));
  double middle = tal_fma(f2, tal_fma(f, 0x1.b525086dac128p-24, 0x1.62bfe45469585p-20),
                          tal_fma(f, 0x1.ffcbfc61f9da2p-17, 0x1.430913037bab9p-13));
  double high = tal_fma(f, 0x1.e9bbf63fc2d10p-32, 0x1.e5ea1242d6602p-28);
  double p = tal_fma(f4, tal_fma(f4, high, middle), low);
  double q = 1 + tal_fma(f2, p, f * 0.693147180559945309417);
  return tal_double(tal_bits(q) + (tal_bits(shifted) << 52)); // q 2^n
}

// x^(1/c) for x >= 0, finite, in two halves; inverse_exponent = 1/c in (0, 1]. Loops over many x do better with one
// loop for each half: the two together are a longer chain of dependent operations than a processor looks ahead.
TAL_KERNEL double tal_root_begin(double x, double inverse_exponent) {
  return tal_log2(x) * inverse_exponent;
}

TAL_KERNEL double tal_root_end(double x, double begun) {
  double root = tal_exp2(begun);
  return x < 1e-300 ? 0.0 : root;
}

TAL_KERNEL double tal_root(double x, double inverse_exponent) {
  return tal_root_end(x, tal_root_begin(x, inverse_exponent));
}

// x^e of a normal x > 0 and any e, held between 2^-1010 and 2^1010.
TAL_KERNEL double tal_power(double x, double e) {
  double y = tal_log2(x) * e;
  y = y > 1010 ? 1010 : y;
  return tal_exp2(y < -1010 ? -1010 : y);
}

#endif
