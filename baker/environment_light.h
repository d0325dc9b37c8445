// Light from infinity: radiance where a ray leaves the scene, and importance sampling of an environment image.
#pragma once

#include <vector>

#include "baker/distribution.h"
#include "baker/lights.h"
#include "scene/scene.h"

namespace lumel {

/// An image is two lights, each sampled on its own: its bright part, where that is small and strong (a sun, windows
/// seen from inside), and the rest. With one table for both, the samples that find the sun hidden would be missing
/// where the sky alone shines, and the other way round.
class EnvironmentLight {
 public:
  EnvironmentLight() = default;
  /// Builds tables only for an image: a constant sky is met well enough by the directions that a surface gathers
  /// from, and a black one costs nothing. Keeps a reference to `environment`.
  explicit EnvironmentLight(const Environment& environment);

  /// Whether rays that leave the scene bring anything back.
  bool shines() const { return environment_ != nullptr; }
  /// Whether sampleSun() and sampleSky() are of use.
  bool sunSampled() const { return !sun_.empty(); }
  bool skySampled() const { return !rows_.empty(); }
  /// Whether pdf() is not zero everywhere.
  bool sampled() const { return sunSampled() || skySampled(); }

  Vec3 radiance(const Vec3& dirWorld) const;

  /// Density: pdf(wi) in either part, in proportion to the mean luminance of the image's cells, by solid angle within
  /// a cell of constant elevation step; each integrates to one over its part. Precondition: sunSampled(),
  /// skySampled().
  LightSample sampleSun(Vec2 u) const;
  LightSample sampleSky(Vec2 u) const;
  /// Of the part that the direction lies in.
  float pdf(const Vec3& dirWorld) const;

  /// A cell belongs to the bright part where its luminance is above this many times the image's mean.
  static constexpr float kSunContrast = 8.0f;
  /// The bright part is sampled by itself where it holds this share of the light ...
  static constexpr double kLeastSunShare = 0.1;
  /// ... and no more than this share of the sphere.
  static constexpr double kMostSunSphere = 0.05;

 private:
  struct Cell {
    std::size_t row = 0;
    std::size_t column = 0;
  };
  void splitOffSun(std::vector<float>& luminances);
  Cell cellAt(const Vec3& dirWorld) const;
  LightSample sampleCell(const Cell& cell, Vec2 within, float probability) const;
  std::size_t numberOf(const Cell& cell) const { return cell.row * width_ + cell.column; }

  const Environment* environment_ = nullptr;
  std::size_t width_ = 0;
  std::size_t height_ = 0;
  Distribution rows_;
  std::vector<Distribution> columns_;  // per row
  std::vector<std::size_t> sunCells_;  // ascending, by numberOf
  Distribution sun_;                   // over sunCells_
  float cosRotation_ = 1.0f;
  float sinRotation_ = 0.0f;
};

}  // namespace lumel
