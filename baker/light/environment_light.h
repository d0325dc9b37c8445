// Light from infinity: radiance where a ray leaves the scene, and importance sampling of an environment image.
#pragma once

#include <cstdint>
#include <vector>

#include "baker/light/distribution.h"
#include "baker/light/light_sample.h"
#include "baker/rays/sample_lanes.h"
#include "scene/scene.h"

namespace lumel {

/// The sky is a grid of cells of constant radiance: the means of the image's bilinear interpolant over them, weighed by
/// solid angle, so that no light is gained or lost. They are the image's pixels, where these are neither larger than
/// 360 degrees / kFewestColumns (they are divided then) nor smaller than 360 degrees / kMostColumns (then joined).
///
/// An image is two lights, each sampled on its own: its bright part, where that is small and strong (a sun, windows
/// seen from inside), and the rest. With one table for both, the samples that find the sun hidden would be missing
/// where the sky alone shines, and the other way round.
class EnvironmentLight {
 public:
  EnvironmentLight() = default;
  /// Builds tables for sampling only from an image: a constant sky is met well enough by the directions that a surface
  /// gathers from, and a black one costs nothing. Memory: 18 bytes per cell.
  explicit EnvironmentLight(const Environment& environment);

  /// Returns how many cells stand for an image; one where there is none.
  static std::size_t cellCount(const Image& image);

  /// Tells whether rays that leave the scene bring anything back.
  bool shines() const { return !cells_.empty(); }
  /// Tell whether sampleSun() and sampleSky() are of use.
  bool sunSampled() const { return !sun_.empty(); }
  bool skySampled() const { return !rows_.empty(); }
  /// Tells whether pdf() is positive anywhere.
  bool sampled() const { return sunSampled() || skySampled(); }

  /// Returns the radiance that arrives from a direction. Precondition of this and of arriving(): shines().
  Vec3 radiance(const Vec3& dirWorld) const;
  /// Returns the density per solid angle with which the part that the direction lies in is sampled there.
  float pdf(const Vec3& dirWorld) const;
  /// Returns what rays that were gathered with density `gathered` bring, weighed against the samples below. Lanes whose
  /// result is not used may hold any direction.
  Vec3 arriving(const Vec3& dirWorld, float gathered) const;
  void arriving(const Vec3Lanes& dirWorld, const float* gathered, Vec3Lanes& light) const;

  /// Density: pdf(wi) in either part, in proportion to the luminance of the cells, by solid angle within a cell; each
  /// integrates to one over its part. Precondition: sunSampled(), skySampled().
  void sampleSun(const UnitSquareLanes& u, LightSampleLanes& samples) const;
  void sampleSky(const UnitSquareLanes& u, LightSampleLanes& samples) const;
  /// Names the cells that were chosen, and the places in them.
  struct Places;
  /// sampleSky() in two steps: the first asks memory for the cells.
  Places findSky(const UnitSquareLanes& u) const;
  void sampleSky(const Places& places, LightSampleLanes& samples) const { take(places, samples); }

  /// A cell belongs to the bright part where its luminance is above this many times the image's mean.
  static constexpr float kSunContrast = 8.0f;
  /// The bright part is sampled by itself where it holds this share of the light ...
  static constexpr double kLeastSunShare = 0.1;
  /// ... and no more than this share of the sphere.
  static constexpr double kMostSunSphere = 0.05;
  /// A sun is three cells wide in the finest grid.
  static constexpr std::size_t kFewestColumns = 512;
  static constexpr std::size_t kMostColumns = 2048;

 private:
  struct alignas(16) Cell {
    Vec3 radiance{0};
    float pdf = 0.0f;
  };
  /// Says how cells lie about the sphere.
  struct Grid {
    int rows = 1;
    int columns = 1;
    float cosRotation = 1.0f;
    float sinRotation = 0.0f;
  };
  std::vector<float> addCells(const Environment& environment);
  void splitOffSun(std::vector<float>& luminances);
  void addSky(const std::vector<float>& luminances);
  float solidAngle(std::size_t cell) const;
  static std::int32_t cellAt(const Grid& grid, const Vec3& dirWorld);
  static void findCells(const Grid& grid, const Vec3Lanes& dirWorld, LaneFlags& cells);
  const Cell& cellTowards(const Vec3& dirWorld) const {
    return cells_[cells_.size() > 1 ? static_cast<std::size_t>(cellAt(grid_, dirWorld)) : 0];
  }
  static void aim(const Grid& grid, const float* versines, const Places& places, LightSampleLanes& samples);
  static void weigh(LightSampleLanes& samples);
  static void weighAgainst(const float* pdf, const float* gathered, Vec3Lanes& light);
  void take(const Places& places, LightSampleLanes& samples) const;

  Grid grid_;
  std::vector<Cell> cells_;      // [rows][columns]; one for a constant sky
  std::vector<float> versines_;  // [rows + 1]: 1 - cos of the polar angle (from +y) of the rows' borders
  Distribution rows_;
  DistributionRows columns_;            // per row
  std::vector<std::int32_t> sunCells_;  // ascending
  Distribution sun_;                    // over sunCells_
};

struct EnvironmentLight::Places {
  LaneFlags row;
  LaneFlags column;
  LaneFlags cell;
  alignas(64) float x[kLanes];
  alignas(64) float y[kLanes];
};

inline void EnvironmentLight::sampleSky(const UnitSquareLanes& u, LightSampleLanes& samples) const {
  take(findSky(u), samples);
}

}  // namespace lumel
