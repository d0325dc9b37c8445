// Points on the covered parts of a wave's texels, drawn many at a time and laid out by lane.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "baker/direct_light.h"
#include "baker/lanes.h"
#include "baker/sobol.h"
#include "lightmap/texels.h"

namespace lumel {

/// One point of every texel of a wave. Lanes without a texel, or whose texel has no area, hold zeros.
struct PointLanes {
  Vec3Lanes rayStart;
  FrameLanes frame;
  Vec3Lanes ng;      // geometric normal
  LightLanes light;  // the same points as receivers of sampled light
};

/// Where on its triangle a point lies.
struct PlaceOnTriangle {
  TriangleRef triangle;
  Vec2 weights{0};  // of vertices 1 and 2
};

class WavePoints {
 public:
  static constexpr std::uint32_t kMost = 16;

  /// Texels [first, first + count) of a page, count <= kLanes.
  WavePoints(const RayScene& rays, const Atlas& atlas, const PageTexels& page, std::size_t first, std::size_t count);

  /// Covered area in texels; 0: nothing to sample.
  double area(std::size_t lane) const { return areas_[lane]; }
  bool covered(std::size_t lane) const { return areas_[lane] > 0 && !leftOut_[lane]; }
  /// From now on the lane is without a texel. Precondition: nothing was drawn.
  void leaveOut(std::size_t lane);

  /// Draws samples [first, first + count) of a pattern, count <= kMost a power of two: point i of every texel is its
  /// sample first + i, uniform over the texel's covered area.
  void draw(const std::array<TexelSampler, kLanes>& samplers, std::uint32_t pattern, std::uint32_t first,
            std::uint32_t count);
  /// Points are used over and over: i counts modulo the number drawn.
  const PointLanes& operator[](std::uint32_t i) const { return points_[i & mask_]; }
  PlaceOnTriangle place(std::size_t lane, std::uint32_t i) const;

 private:
  /// A triangle of a texel, with what its points need of the surface.
  struct Source {
    TriangleRef triangle;
    Vec3 p0{0}, e1{0}, e2{0};  // first corner and the edges from it, world
    Vec3 ng{0, 0, 1};
    float offsetMeters = 0.0f;  // of ray starts
    bool flat = false;          // one frame throughout
    Frame frame{};              // where flat
    std::array<Vec3, 3> normals{};
    std::array<Vec4, 3> tangents{};
  };
  /// A part of such a triangle: place = start + reach * (toSecond + uy * (toThird - toSecond)).
  struct Piece {
    std::uint32_t source = 0;
    float areaBefore = 0.0f;
    float area = 0.0f;
    Vec2 start{0}, toSecond{0}, toThird{0};
  };
  struct Place {
    std::uint32_t source = 0;
    Vec2 weights{0};
  };
  void addTexel(const RayScene& rays, const Atlas& atlas, const TexelFootprint& footprint, std::size_t lane);
  Place choose(std::size_t lane, Vec2 u) const;
  void store(std::size_t lane, std::uint32_t i, const Place& place);

  std::array<double, kLanes> areas_{};
  std::array<bool, kLanes> leftOut_{};
  std::vector<Source> sources_;
  std::vector<Piece> pieces_;                            // lane by lane
  std::array<std::uint32_t, kLanes + 1> firstPiece_{};  // of each lane
  std::uint32_t mask_ = 0;
  std::array<PointLanes, kMost> points_;
  std::array<std::array<Place, kLanes>, kMost> places_;
};

}  // namespace lumel
