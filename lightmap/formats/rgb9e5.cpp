#include "lightmap/formats/rgb9e5.h"

#include <algorithm>
#include <cmath>

namespace lumel {
namespace {

constexpr int kMantissaBits = 9;
constexpr int kBias = 15;

}  // namespace

std::uint32_t rgb9e5FromColor(const Vec3& color) {
  const Vec3 c = glm::clamp(color, Vec3(0.0f), Vec3(kMostRgb9e5));
  const float most = std::max({c.x, c.y, c.z});
  int exponent = 0;
  if (most > 0.0f) {
    std::frexp(most, &exponent);  // most < 2^exponent
    exponent = std::max(exponent, -kBias);
    // A value that rounds up to 2^exponent needs the next exponent.
    if (std::lround(std::ldexp(most, kMantissaBits - exponent)) == 1 << kMantissaBits) ++exponent;
  } else {
    exponent = -kBias;
  }
  const auto mantissa = [exponent](float v) {
    return static_cast<std::uint32_t>(std::lround(std::ldexp(v, kMantissaBits - exponent)));
  };
  return mantissa(c.x) | mantissa(c.y) << 9 | mantissa(c.z) << 18 | static_cast<std::uint32_t>(exponent + kBias) << 27;
}

Vec3 colorFromRgb9e5(std::uint32_t bits) {
  const float unit = std::ldexp(1.0f, static_cast<int>(bits >> 27) - kBias - kMantissaBits);
  return unit * Vec3(static_cast<float>(bits & 511u), static_cast<float>(bits >> 9 & 511u),
                     static_cast<float>(bits >> 18 & 511u));
}

}  // namespace lumel
