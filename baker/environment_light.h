// Light from infinity: radiance where a ray leaves the scene, and importance sampling of an environment image.
#pragma once

#include <vector>

#include "baker/distribution.h"
#include "baker/lights.h"
#include "scene/scene.h"

namespace lumel {

class EnvironmentLight {
 public:
  EnvironmentLight() = default;
  /// Builds tables only for an image: a constant sky is met well enough by the directions that a surface gathers
  /// from, and a black one costs nothing. Keeps a reference to `environment`.
  explicit EnvironmentLight(const Environment& environment);

  /// Whether rays that leave the scene bring anything back.
  bool shines() const { return environment_ != nullptr; }
  /// Whether sample() is of use, and pdf() not zero everywhere.
  bool sampled() const { return !rows_.empty(); }

  Vec3 radiance(const Vec3& dirWorld) const;

  /// Density: pdf(wi), in proportion to the mean luminance of the image's cells, by solid angle within a cell of
  /// constant elevation step. Precondition: sampled().
  LightSample sample(Vec2 u) const;
  float pdf(const Vec3& dirWorld) const;

 private:
  const Environment* environment_ = nullptr;
  Distribution rows_;
  std::vector<Distribution> columns_;  // per row
  float cosRotation_ = 1.0f;
  float sinRotation_ = 0.0f;
};

}  // namespace lumel
