// The parts of a triangle that shine, found from its emission texture.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "baker/light/emission_field.h"

namespace lumel {

/// A triangle within a triangle.
struct ShiningPart {
  std::array<Vec2, 3> corners{Vec2(0, 0), Vec2(1, 0), Vec2(0, 1)};  // weights of the triangle's vertices 1 and 2
  float luminance = 0.0f;                                           // mean over the part
  float contrast = 1.0f;  // root of its mean square over its mean, or somewhat more
};

/// How a triangle lies in the plane of its emission texture.
class TexturedTriangle {
 public:
  /// `texels` are its corners on the plane (EmissionField::pointOf), e1 and e2 its edges from vertex 0 in world space.
  TexturedTriangle(const EmissionField& field, const std::array<Vec2d, 3>& texels, const Vec3& e1, const Vec3& e2);

  /// Tells whether the triangle is a line or a point in the texture. It has no parts then, and no mean by area.
  bool isLine() const { return !(area_ > 0.0); }
  /// Tells whether anything in the texture shines where the triangle lies, or within a thousandth of a texel of it.
  bool shines() const;
  /// Returns the mean luminance over the triangle: exact to rounding, and positive exactly where anything shines.
  /// Precondition: !isLine().
  double mean() const { return field_->integral(polygon_) / area_; }
  /// Returns parts that do not overlap, hold all that shines, and come from at most about `mostBoxes` boxes of the
  /// texture. Their area times luminance adds up to that of the triangle. One part may be the whole triangle.
  /// `mean` is what mean() returns. Precondition: !isLine().
  std::vector<ShiningPart> parts(std::size_t mostBoxes, double mean) const;

 private:
  Vec2 weightsOf(const Vec2d& texel) const;

  const EmissionField* field_;
  TexelPolygon polygon_;
  double area_ = 0.0;                  // 0: a line or a point
  Vec2d perTexel1_{0}, perTexel2_{0};  // how the weights of vertices 1 and 2 grow across the texture
  Vec2d meters_{1};                    // lengths of a texel's sides in the world
};

}  // namespace lumel
