// x^(1/c) for the regularised friction law, without branches, so that it vectorises with the loop around it and gives
// the same bits whatever the vector width. Logarithm: argument reduced to [sqrt(1/2), sqrt(2)) and the series of
// 2 atanh((m - 1)/(m + 1)); exponential: 2^n times the series of e^r, |r| <= ln(2)/2. Relative error below
// (4 + 1.7 |ln x|/c) eps (tests/test_root.c): half an eps each from exponent times ln 2, from adding ln m and from the
// product with 1/c, 0.15 eps from ln 2 itself; 4 eps from the series. 0 for x below 1e-300.
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

// ln x of a normal x > 0.
TAL_KERNEL double tal_log(double x) {
  const uint64_t sqrt_half = 0x3fe6a09e667f3bcdULL; // bits of sqrt(1/2)
  const uint64_t magic = 0x4330000000000000ULL;     // bits of 2^52: integers below 2^52 become doubles by an OR
  // exponent + 1024, kept positive so that a logical shift does
  uint64_t u = tal_bits(x);
  uint64_t shifted = (u - sqrt_half + (1024ULL << 52)) >> 52;
  double exponent = tal_double(shifted | magic) - (4503599627370496.0 + 1024.0);
  double m = tal_double(u - ((shifted - 1024ULL) << 52));
  double s = (m - 1) / (m + 1), z = s * s;
  // atanh series to z^9/19: the next term is below 1e-17 of the first at z = 0.0295. Both series by Estrin's scheme:
  // Horner's chain of dependent operations took twice the time.
  double z2 = z * z, z4 = z2 * z2;
  double p = (1.0 / 3 + z * (1.0 / 5)) + z2 * (1.0 / 7 + z * (1.0 / 9));
  p = p + z4 * ((1.0 / 11 + z * (1.0 / 13)) + z2 * (1.0 / 15 + z * (1.0 / 17)) + z4 * (1.0 / 19));
  const double ln2 = 0.693147180559945309417;
  return exponent * ln2 + (2 * s + 2 * s * z * p);
}

// e^y, |y| < 708.
TAL_KERNEL double tal_exp(double y) {
  const double round = 6755399441055744.0; // 1.5 2^52
  double n = (y * 1.44269504088896340736 + round) - round;
  const double ln2_high = 0.693147180369123816490, ln2_low = 1.90821492927058770002e-10; // high part: 21 trailing zeros
  double r = (y - n * ln2_high) - n * ln2_low;
  // e^r = 1 + (r + r^2 (1/2! + r/3! + ... + r^11/13!))
  double r2 = r * r, r4 = r2 * r2, r8 = r4 * r4;
  double low = (0.5 + r * (1.0 / 6)) + r2 * (1.0 / 24 + r * (1.0 / 120));
  double middle = (1.0 / 720 + r * (1.0 / 5040)) + r2 * (1.0 / 40320 + r * (1.0 / 362880));
  double high = (1.0 / 3628800 + r * (1.0 / 39916800)) + r2 * (1.0 / 479001600 + r * (1.0 / 6227020800));
  double q = 1 + (r + r2 * (low + r4 * middle + r8 * high));
  double power = tal_double(((tal_bits(n + 4503599627370496.0 + 1023.0) & 0x7ffULL)) << 52); // 2^n
  return q * power;
}

// x >= 0, finite; inverse_exponent = 1/c in (0, 1].
TAL_KERNEL double tal_root(double x, double inverse_exponent) {
  double root = tal_exp(tal_log(x) * inverse_exponent);
  return x < 1e-300 ? 0.0 : root;
}

// x^e of a normal x > 0 and any e, held between e^-700 and e^700.
TAL_KERNEL double tal_power(double x, double e) {
  double y = tal_log(x) * e;
  y = y > 700 ? 700 : y;
  return tal_exp(y < -700 ? -700 : y);
}

#endif
