#include "ssbump/occlusion/samples.h"

#include <algorithm>
#include <cmath>

#include "scene/base/sobol.h"

namespace lumel::ssbump {
namespace {

// A 64-bit finaliser in the manner of splitmix64 (Steele et al. 2014).
std::uint64_t mix(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15ull;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return z ^ (z >> 31);
}

}  // namespace

HemisphereSamples::HemisphereSamples(RaySampling sampling, int count, std::uint32_t seed)
    : sampling_(sampling), count_(count), columns_(1), seed_(seed) {
  // The most nearly square grid that divides the count (300 = 15 x 20); a prime count degrades to one row.
  for (int c = 1; c * c <= count; ++c)
    if (count % c == 0) columns_ = c;
}

Vec3 HemisphereSamples::direction(std::uint64_t texelKey, int index) const {
  const std::uint64_t key = mix(texelKey + (static_cast<std::uint64_t>(seed_) << 40));
  float u, v;
  if (sampling_ == RaySampling::Sobol) {
    const Vec2 point = sobol2D(static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(key));
    u = point.x;
    v = point.y;
  } else {
    const std::uint64_t bits = mix(key + static_cast<std::uint64_t>(index));
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
