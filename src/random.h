// Random number streams, one per use, so that drawing more of one thing never changes another.
// Generator: GSL's mt19937. Its integers and the uniform numbers made from them are the same bits on every machine.
#ifndef TAL_RANDOM_H
#define TAL_RANDOM_H

#include <gsl/gsl_rng.h>
#include <stdint.h>

typedef enum tal_stream {
  TAL_STREAM_RADIUS = 1,
  TAL_STREAM_DROP = 2,
  TAL_STREAM_FORCED = 3,
  TAL_STREAM_BOOTSTRAP = 4
} tal_stream;

// The stream of a scene's seed: all 64 bits of the seed count. Free with gsl_rng_free().
gsl_rng *tal_random_stream(uint64_t seed, tal_stream stream);

#endif
