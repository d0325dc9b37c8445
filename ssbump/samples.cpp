#include "ssbump/samples.h"

#include <algorithm>
#include <cmath>

namespace lumel::ssbump {
namespace {

// A 64-bit finaliser in the manner of splitmix64 (Steele et al. 2014).
std::uint64_t mix(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15ull;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return z ^ (z >> 31);
}

float unitFloat(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

std::uint32_t reverseBits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0F0F0F0Fu) | ((x & 0x0F0F0F0Fu) << 4);
  return __builtin_bswap32(x);
}

// Owen scrambling of a bit-reversed value: each step lets lower bits flip higher ones' scramble only upwards
// (Laine and Karras 2011, constants of Burley 2020).
std::uint32_t scrambleReversed(std::uint32_t x, std::uint32_t seed) {
  x += seed;
  x ^= x * 0x6C50B47Cu;
  x ^= x * 0xB82F1E52u;
  x ^= x * 0xC7AFE638u;
  x ^= x * 0x8D22F6E6u;
  return x;
}

std::uint32_t owen(std::uint32_t x, std::uint32_t seed) { return reverseBits(scrambleReversed(reverseBits(x), seed)); }

// The second dimension of the Sobol sequence: its generator matrix is Pascal's triangle modulo 2.
std::uint32_t sobolSecond(std::uint32_t index) {
  std::uint32_t result = 0;
  for (std::uint32_t column = 1u << 31; index; index >>= 1, column ^= column >> 1)
    if (index & 1) result ^= column;
  return result;
}

}  // namespace

HemisphereSamples::HemisphereSamples(RaySampling sampling, int count, std::uint32_t seed)
    : sampling_(sampling), count_(count), columns_(1), seed_(seed) {
  // The most nearly square grid that divides the count (300 = 15 x 20); a prime count degrades to one row.
  for (int c = 1; c * c <= count; ++c)
    if (count % c == 0) columns_ = c;
}

Vec3 HemisphereSamples::direction(std::uint64_t texelKey, int index) const {
  float u, v;
  if (sampling_ == RaySampling::Sobol) {
    const std::uint64_t seeds = mix(texelKey * 2 + 1 + (static_cast<std::uint64_t>(seed_) << 40));
    const auto shuffled = owen(static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(mix(seeds)));
    u = unitFloat(owen(reverseBits(shuffled), static_cast<std::uint32_t>(seeds)));
    v = unitFloat(owen(sobolSecond(shuffled), static_cast<std::uint32_t>(seeds >> 32)));
  } else {
    const std::uint64_t bits =
        mix(mix(texelKey + (static_cast<std::uint64_t>(seed_) << 40)) + static_cast<std::uint64_t>(index));
    u = unitFloat(static_cast<std::uint32_t>(bits));
    v = unitFloat(static_cast<std::uint32_t>(bits >> 32));
    if (sampling_ == RaySampling::Stratified) {
      const int rows = count_ / columns_;  // `rows` strata in azimuth, `columns_` in height
      u = (static_cast<float>(index % columns_) + u) / static_cast<float>(columns_);
      v = (static_cast<float>(index / columns_) + v) / static_cast<float>(rows);
    }
  }
  const float sine = std::sqrt(std::max(0.0f, 1 - u * u));
  const float phi = 2 * kPi * v;
  return {sine * std::cos(phi), sine * std::sin(phi), u};
}

}  // namespace lumel::ssbump
