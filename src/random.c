// Seeding of the random number streams. mt19937 takes 32 bits, so seed and stream are mixed by one round of
// SplitMix64 (Steele, Lea & Flood, OOPSLA 2014) and the upper half is used.
#include "random.h"

gsl_rng *tal_random_stream(uint64_t seed, tal_stream stream) {
  uint64_t z = seed + 0x9e3779b97f4a7c15u * (uint64_t)stream;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  z ^= z >> 31;
  gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
  gsl_rng_set(rng, (unsigned long)(z >> 32));
  return rng;
}
