// Light volumes: what arrives at the points of a grid in space from all sides, so that what moves, and has no lightmap,
// stands in the same light as the level.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "scene/base/math.h"

namespace lumel {

inline constexpr std::size_t kHarmonics = 9;
inline constexpr std::size_t kCubeFaces = 6;

/// The real spherical harmonics of a unit direction up to band 2, in the order Y00, Y1-1 (y), Y10 (z), Y11 (x),
/// Y2-2 (xy), Y2-1 (yz), Y20 (3z^2 - 1), Y21 (xz), Y22 (x^2 - y^2) (Ramamoorthi and Hanrahan 2001).
std::array<float, kHarmonics> harmonics(const Vec3& direction);

/// max(0, direction.axis) / pi for the axes +x, -x, +y, -y, +z, -z: the faces of an ambient cube.
std::array<float, kCubeFaces> cubeKernels(const Vec3& direction);

/// How far one sees from a point: 8 x 8 directions, by the octahedral map (Cigolle et al. 2014).
inline constexpr int kSightSide = 8;
inline constexpr std::size_t kSights = kSightSide * kSightSide;
/// The unit direction through the middle of sight number `i`, rows of kSightSide.
Vec3 sightDirection(std::size_t i);

/// What is known at a point of the grid. Light is linear Rec. 709.
struct VolumePoint {
  Vec3 offset{0};        // metres from the point of the grid to where light was gathered
  bool isValid = false;  // false: inside of something; its light is that of the valid points around it
  std::array<Vec3, kHarmonics> harmonics{};  // integral over the sphere of radiance times Y_i
  std::array<Vec3, kCubeFaces> cube{};       // irradiance / pi on the six faces
  std::array<float, kSights> nearness{};     // 1 / distance to what is seen in each direction; 0: nothing
};

/// How a lookup turns a point's light into that on a normal.
enum class VolumeBasis {
  Cube,  // six faces, weighed by the normal's squared coordinates (McTaggart 2004)
  Sh1,   // two bands, clamped to zero
  Sh2,   // three
};

/// Which of the eight points around a place a lookup believes.
enum class VolumeMask {
  None,   // all of them, by distance
  Sight,  // valid ones that see the place, and more those that lie above its surface
};

struct LightVolume {
  std::string name;  // of the node that asked for it; empty: the command line
  Vec3 origin{0};    // world space, metres: the first point
  Vec3 cell{1};      // from point to point
  std::array<int, 3> counts{};
  std::vector<VolumePoint> points;  // x fastest, then y

  std::size_t indexOf(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(counts[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(counts[0]) +
           static_cast<std::size_t>(x);
  }
  Vec3 gridPoint(std::size_t index) const;
  /// Whether a place in the world lies in the box of the points.
  bool contains(const Vec3& p) const;
};

/// Grid of points that fills a box with cells of at most `cell` metres; a flat box has one layer. Without light.
LightVolume volumeOf(const Vec3& least, const Vec3& most, float cell);
/// Points that volumeOf would make.
double pointCount(const Vec3& least, const Vec3& most, float cell);

/// Gives invalid points the mean light of the nearest valid ones, ring by ring; black where there is none at all.
void fillInvalid(LightVolume& volume);

/// The points around a place and how much each counts; weights add up to 1.
struct VolumeLookup {
  std::array<std::size_t, 8> points{};
  std::array<float, 8> weights{};
};
/// `p`: world space; places outside are looked up at the volume's rim. `normal`: of the surface there, or 0 for what
/// has none. Where no point is believed all are.
VolumeLookup lookUp(const LightVolume& volume, const Vec3& p, const Vec3& normal, VolumeMask mask);

/// Irradiance / pi on a unit normal; with a normal of 0 the mean radiance from all sides.
Vec3 lightOn(const LightVolume& volume, const VolumeLookup& lookup, const Vec3& normal, VolumeBasis basis);

const char* nameOf(VolumeBasis basis);  // "cube", "sh1", "sh2"

}  // namespace lumel
