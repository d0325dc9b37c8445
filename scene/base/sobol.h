// Owen-scrambled Sobol points by hashing: stateless, so a texel's samples depend on its seed and the sample's index
// alone, never on threads, tiles or order.
// Burley 2020, "Practical Hash-based Owen Scrambling"; the hash is the refinement by Vegdahl of the Laine-Karras
// permutation (Laine and Karras 2011, "Stratified Sampling for Stochastic Transparency").
#pragma once

#include <cstdint>

#include "scene/base/math.h"

namespace lumel {

/// A 32-bit integer hash with full avalanche (bijective).
inline std::uint32_t hashBits(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x21f0aaadu;
  x ^= x >> 15;
  x *= 0xd35a2d97u;
  x ^= x >> 15;
  return x;
}

inline std::uint32_t hashCombine(std::uint32_t seed, std::uint32_t value) {
  return hashBits(seed ^ (value * 0x9e3779b9u + 0x7f4a7c15u + (seed << 6) + (seed >> 2)));
}

inline std::uint32_t reverseBits(std::uint32_t x) {
  // Bytes last, compilers see them being turned round and take an instruction that vectors of 512 bits need not have.
  x = (x >> 16) | (x << 16);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
}

/// The generator matrix of Sobol's second dimension is Pascal's triangle modulo 2. Its row i has a one at column j
/// exactly where the bits of i are a subset of those of j, so the product is a superset sum over the five bits of a
/// bit's position. Returns the coordinate with its bits reversed.
inline std::uint32_t sobolSecondReversed(std::uint32_t index) {
  index ^= (index >> 1) & 0x55555555u;
  index ^= (index >> 2) & 0x33333333u;
  index ^= (index >> 4) & 0x0f0f0f0fu;
  index ^= (index >> 8) & 0x00ff00ffu;
  index ^= (index >> 16) & 0x0000ffffu;
  return index;
}

/// A random permutation in which a bit is only ever changed by the bits below it: on bit-reversed coordinates, a
/// nested uniform (Owen) scramble.
inline std::uint32_t laineKarrasPermutation(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

/// The upper 24 bits as a float in [0, 1): every value is exact, so 1 is never reached by rounding.
inline float unitFloat(std::uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24f; }

/// One Owen-scrambled, index-shuffled (0, 2)-sequence: every aligned block of 2^m indices is a (0, m, 2)-net.
/// Different seeds give independent scrambles, so patterns can be padded to any dimension.
/// `reversedIndex`: reverseBits of the point's index.
inline Vec2 sobol2DOfReversed(std::uint32_t reversedIndex, std::uint32_t seed) {
  const std::uint32_t shuffled = reverseBits(laineKarrasPermutation(reversedIndex, hashBits(seed ^ 0xa511e9b3u)));
  return {unitFloat(reverseBits(laineKarrasPermutation(shuffled, hashBits(seed ^ 0x63d83595u)))),
          unitFloat(reverseBits(laineKarrasPermutation(sobolSecondReversed(shuffled), hashBits(seed ^ 0x1b873593u))))};
}

inline Vec2 sobol2D(std::uint32_t index, std::uint32_t seed) { return sobol2DOfReversed(reverseBits(index), seed); }

/// The same in one dimension: every aligned block of 2^m indices has one point in each interval of length 2^-m.
inline float sobol1D(std::uint32_t index, std::uint32_t seed) {
  const std::uint32_t shuffled = reverseBits(laineKarrasPermutation(reverseBits(index), hashBits(seed ^ 0xa511e9b3u)));
  return unitFloat(reverseBits(laineKarrasPermutation(shuffled, hashBits(seed ^ 0x63d83595u))));
}

/// The sample patterns of one texel: each decision along a path has a pattern of its own.
class TexelSampler {
 public:
  TexelSampler() = default;
  TexelSampler(std::uint64_t seed, std::uint32_t page, std::uint32_t x, std::uint32_t y)
      : seed_(hashCombine(hashCombine(hashCombine(hashCombine(hashBits(static_cast<std::uint32_t>(seed)),
                                                              static_cast<std::uint32_t>(seed >> 32)),
                                                  page),
                                      x),
                          y)) {}

  Vec2 get2D(std::uint32_t sample, std::uint32_t pattern) const { return sobol2D(sample, hashCombine(seed_, pattern)); }
  float get1D(std::uint32_t sample, std::uint32_t pattern) const {
    return sobol1D(sample, hashCombine(seed_, pattern));
  }
  /// Tells texels apart: to seed further samplers.
  std::uint32_t seed() const { return seed_; }
  /// Seed of sobol2D and sobol1D for a pattern.
  std::uint32_t seedOf(std::uint32_t pattern) const { return hashCombine(seed_, pattern); }

 private:
  std::uint32_t seed_ = 0;
};

}  // namespace lumel
