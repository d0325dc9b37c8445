#include "baker/light/shining_parts.h"

#include <algorithm>
#include <cmath>

namespace lumel {
namespace {

/// A triangle is a line in the texture where its area is below this share of its longest side squared: texture
/// coordinates are floats.
constexpr double kThinnest = 1e-6;
/// A polygon with this share of the triangle's area is the triangle.
constexpr double kWhole = 1.0 - 1e-9;

}  // namespace

TexturedTriangle::TexturedTriangle(const EmissionField& field, const std::array<Vec2d, 3>& texels, const Vec3& e1,
                                   const Vec3& e2)
    : field_(&field) {
  for (const Vec2d& p : texels) polygon_.add(p);
  const Vec2d d1 = texels[1] - texels[0], d2 = texels[2] - texels[0], d3 = texels[2] - texels[1];
  const double twice = d1.x * d2.y - d1.y * d2.x;
  const double longest = std::max({glm::dot(d1, d1), glm::dot(d2, d2), glm::dot(d3, d3)});
  if (!(std::abs(twice) > kThinnest * longest)) return;
  area_ = 0.5 * std::abs(twice);
  perTexel1_ = Vec2d(d2.y, -d2.x) / twice;
  perTexel2_ = Vec2d(-d1.y, d1.x) / twice;
  const auto lengthAlong = [&](int axis) {
    return glm::length(perTexel1_[axis] * Vec3d(e1) + perTexel2_[axis] * Vec3d(e2));
  };
  meters_ = {lengthAlong(0), lengthAlong(1)};
}

bool TexturedTriangle::shines() const {
  if (!isLine()) return field_->integral(polygon_) > 0.0;
  TexelBox box{polygon_.corners[0], polygon_.corners[0]};
  for (const Vec2d& p : {polygon_.corners[1], polygon_.corners[2]}) {
    box.min = glm::min(box.min, p);
    box.max = glm::max(box.max, p);
  }
  return field_->shinesIn(box);
}

/// Returns the weights of vertices 1 and 2 at a point, kept inside the triangle against rounding.
Vec2 TexturedTriangle::weightsOf(const Vec2d& texel) const {
  const Vec2d fromFirst = texel - polygon_.corners[0];
  const double w1 = std::clamp(glm::dot(fromFirst, perTexel1_), 0.0, 1.0);
  const double w2 = std::clamp(glm::dot(fromFirst, perTexel2_), 0.0, 1.0 - w1);
  return {static_cast<float>(w1), static_cast<float>(w2)};
}

std::vector<ShiningPart> TexturedTriangle::parts(std::size_t mostBoxes, double mean) const {
  std::vector<ShiningPart> parts;
  for (const TexelBox& box : field_->divide(polygon_, meters_, mostBoxes)) {
    const TexelPolygon polygon = clipped(polygon_, box);
    const double area = polygon.area();
    if (!(area > 0.0)) continue;
    const bool isWhole = area >= kWhole * area_;
    const double light = isWhole ? mean * area_ : field_->integral(polygon);
    if (!(light > 0.0)) continue;
    // What of the box lies beside the polygon counts, too: a bound is good enough.
    const auto contrast = static_cast<float>(std::sqrt(field_->squareIn(box) * area) / light);
    if (isWhole) return {{.luminance = static_cast<float>(mean), .contrast = contrast}};
    for (std::size_t i = 2; i < polygon.count; ++i) {
      const std::array<Vec2, 3> corners = {weightsOf(polygon.corners[0]), weightsOf(polygon.corners[i - 1]),
                                           weightsOf(polygon.corners[i])};
      const Vec2 d1 = corners[1] - corners[0], d2 = corners[2] - corners[0];
      if (d1.x * d2.y != d1.y * d2.x) parts.push_back({corners, static_cast<float>(light / area), contrast});
    }
  }
  return parts;
}

}  // namespace lumel
