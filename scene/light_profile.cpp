#include "scene/light_profile.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "scene/base/math.h"

namespace lumel {
namespace {

/// The place of `value` among ascending `knots`: the lower knot, and how far it is to the next.
std::pair<std::size_t, float> placeAmong(const std::vector<float>& knots, float value) {
  const auto next = std::upper_bound(knots.begin() + 1, knots.end() - 1, value);
  const auto lower = static_cast<std::size_t>(next - knots.begin()) - 1;
  return {lower, std::clamp((value - knots[lower]) / (knots[lower + 1] - knots[lower]), 0.0f, 1.0f)};
}

}  // namespace

float LightProfile::share(float right, float up, float forward) const {
  constexpr float kDegrees = 180.0f / kPi;
  const float vertical = std::atan2(std::hypot(right, up), forward) * kDegrees;
  if (vertical < verticals.front() || vertical > verticals.back()) return 0.0f;
  const auto [v, between] = placeAmong(verticals, vertical);
  const auto along = [&, lower = v, part = between](std::size_t horizontal) {
    const float* row = shares.data() + horizontal * verticals.size();
    return row[lower] + (row[lower + 1] - row[lower]) * part;
  };
  if (horizontals.size() == 1) return along(0);
  float horizontal = std::atan2(up, right) * kDegrees;
  if (horizontal < 0.0f) horizontal += 360.0f;
  const auto [h, part] = placeAmong(horizontals, horizontal);
  return along(h) + (along(h + 1) - along(h)) * part;
}

double LightProfile::solidAngle() const {
  constexpr int kRows = 360;
  const int columns = horizontals.size() == 1 ? 1 : 2 * kRows;
  double sum = 0.0;
  for (int i = 0; i < kRows; ++i) {
    const double theta = (i + 0.5) / kRows * std::numbers::pi;
    double row = 0.0;
    for (int j = 0; j < columns; ++j) {
      const double phi = (j + 0.5) / columns * 2.0 * std::numbers::pi;
      row += static_cast<double>(share(static_cast<float>(std::sin(theta) * std::cos(phi)),
                                       static_cast<float>(std::sin(theta) * std::sin(phi)),
                                       static_cast<float>(std::cos(theta))));
    }
    sum += row / columns * std::sin(theta);
  }
  return sum * 2.0 * std::numbers::pi * std::numbers::pi / kRows;
}

}  // namespace lumel
