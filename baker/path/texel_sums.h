// What a bake keeps per texel while it samples: sums in double, and how the mean went on its way.
#pragma once

#include <array>
#include <cstdint>

#include "lightmap/maps/encoding.h"
#include "scene/base/math.h"

namespace lumel {

/// Texels of less validity are hidden: inside of things, beneath floors. They take the light of texels around them.
constexpr float kLeastValidity = 0.5f;

/// Holds the light of one sample, spread over the flat map and those of an encoding: estimates of irradiance / pi.
struct SampleValue {
  Vec3 flat{0};
  std::array<Vec3, kMostMaps> maps{};
};

/// Adds up the samples of one texel.
class TexelSums {
 public:
  static constexpr int kBatches = 16;

  /// `maps` says how many there are, `batch` in [0, kBatches) which stretch of the sample sequence the sample belongs
  /// to.
  void add(const SampleValue& value, std::size_t maps, int batch) {
    flat_ += value.flat;
    for (std::size_t i = 0; i < maps; ++i) maps_[i] += value.maps[i];
    const auto b = static_cast<std::size_t>(batch);
    batchSum_[b][0] += static_cast<double>(luminance(value.flat));
    for (std::size_t i = 0; i < maps; ++i) batchSum_[b][i + 1] += static_cast<double>(luminance(value.maps[i]));
    ++batchCount_[b];
    ++count_;
  }
  void countGatherRay(bool metBackFace) {
    ++gatherRays_;
    if (metBackFace) ++backFaces_;
  }

  std::uint32_t count() const { return count_; }
  /// Returns the means over the samples that were added; zero where there are none.
  SampleValue mean() const;
  /// Returns the share of gather rays that met no back face of a single-sided surface; 1 where none was traced.
  float validity() const;
  /// Returns the luminances of the means over the batches before `batch`, the flat map's first; 0 where they have no
  /// samples.
  std::array<float, 1 + kMostMaps> luminancesBefore(int batch) const;

 private:
  Vec3d flat_{0};
  std::array<Vec3d, kMostMaps> maps_{};
  std::array<std::array<double, 1 + kMostMaps>, kBatches> batchSum_{};
  std::array<std::uint32_t, kBatches> batchCount_{};
  std::uint32_t count_ = 0;
  std::uint32_t gatherRays_ = 0;
  std::uint32_t backFaces_ = 0;
};

}  // namespace lumel
