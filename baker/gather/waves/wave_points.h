// Points on the covered parts of a wave's texels, drawn many at a time and laid out by lane.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "baker/light/direct_light.h"
#include "baker/rays/lanes.h"
#include "baker/rays/texel_parts.h"
#include "lightmap/texels/texels.h"
#include "scene/base/sobol.h"

namespace lumel {

/// One point of every texel of a wave: a view into WavePoints, until it draws again. Lanes that are not active, without
/// a texel or whose texel has no area, hold frames and normals of zeros.
struct PointLanes {
  const LaneFlags& active;
  const Vec3Lanes& p;
  const Vec3Lanes& rayStart;
  const FrameLanes& frame;
  const Vec3Lanes& ng;    // geometric normal
  const Vec3Lanes& lift;  // as of Receiver

  /// The same points as receivers of sampled light.
  ReceiverLanes receivers() const { return {active, p, ng, frame.n, rayStart, false, nullptr, &lift}; }
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
  bool covered(std::size_t lane) const { return active_[lane] != 0; }
  /// Finds the corners of a box in the world about the covered part of a texel.
  void boundsOf(std::size_t lane, Vec3& least, Vec3& most) const;
  /// From the next draw on the lane is without a texel.
  void leaveOut(std::size_t lane);

  /// From the next draw on the lane's points are these of its texel, over and over.
  void keepTo(std::size_t lane, const PartPoints& points, std::uint32_t seed);

  /// Draws samples [first, first + count) of a pattern, count <= kMost a power of two: point i of every texel is its
  /// sample first + i, uniform over the texel's covered area.
  void draw(const std::array<TexelSampler, kLanes>& samplers, std::uint32_t pattern, std::uint32_t first,
            std::uint32_t count);
  /// Points are used over and over: i counts modulo the number drawn.
  PointLanes operator[](std::uint32_t i) const {
    const std::uint32_t at = i & mask_;
    const SurfaceLanes& surface = surfaces_[turning_ ? at : 0];
    return {active_, p_[at], rayStarts_[at], surface.frame, surface.ng, surface.lift};
  }
  PlaceOnTriangle place(std::size_t lane, std::uint32_t i) const;

 private:
  /// A triangle of a texel, with what its points need of the surface.
  struct Source {
    TriangleRef triangle;
    Vec3 p0{0}, e1{0}, e2{0};  // first corner and the edges from it, world
    Vec3 ng{0, 0, 1};
    float offsetMeters = 0.0f;  // of ray starts
    bool flat = false;          // one frame throughout
    float rounded = 0.0f;       // roundedShare
    Frame frame{};              // where flat
    std::array<Vec3, 3> normals{};
    std::array<Vec4, 3> tangents{};
  };
  /// A part of such a triangle (TexelFootprint::Piece): its first corner, and the ways to the others.
  struct Piece {
    std::uint32_t source = 0;
    float areaBefore = 0.0f;
    float area = 0.0f;
    Vec2 start{0}, toSecond{0}, toThird{0};
    bool isSquare = false;
  };
  /// The points of one texel: source, and the weights of its vertices 1 and 2.
  struct alignas(64) Places {
    std::uint32_t source[kMost];
    float x[kMost];
    float y[kMost];
  };
  /// The same points in space; of texels that do not turn, frame and ng are set once.
  struct alignas(64) Drawn {
    float p[3][kMost];
    float rayStart[3][kMost];
    float t[3][kMost];
    float b[3][kMost];
    float n[3][kMost];
    float ng[3][kMost];
    float lift[3][kMost];
  };
  /// The points of a divided texel.
  struct KeptPoints {
    std::vector<std::uint32_t> reversedIndices;  // empty: the texel is whole
    std::uint32_t seed = 0;
  };
  struct SurfaceLanes {
    FrameLanes frame;
    Vec3Lanes ng;
    Vec3Lanes lift;
  };
  static Source sourceOf(const RayScene& rays, const Surface& surface, const TexelFootprint::Source& from);
  void addTexel(const RayScene& rays, const Atlas& atlas, const TexelFootprint& footprint, std::size_t lane);
  bool turns(std::size_t lane) const;
  void setFrame(std::size_t lane, const Frame& frame, const Vec3& ng);
  static void chooseInSquare(const Piece& square, std::uint32_t seed, const std::uint32_t* reversedIndices,
                             Places& places);
  static void choose(std::span<const Piece> pieces, float area, std::uint32_t seed,
                     const std::uint32_t* reversedIndices, Places& places);
  static bool locate(const Source& source, std::uint32_t number, const Places& places, Drawn& drawn);
  static void turnToLanes(const Drawn* drawn, bool turning, Vec3Lanes* p, Vec3Lanes* rayStarts, SurfaceLanes* surfaces);
  static void locateFrames(const Source& source, std::uint32_t number, const Places& places, Drawn& drawn);
  static void lift(const Source& source, std::uint32_t number, const Places& places, Drawn& drawn);

  std::array<double, kLanes> areas_{};
  LaneFlags active_{};
  std::vector<Source> sources_;                          // lane by lane
  std::vector<Piece> pieces_;                            // lane by lane
  std::array<std::uint32_t, kLanes + 1> firstSource_{};  // of each lane
  std::array<std::uint32_t, kLanes + 1> firstPiece_{};
  std::array<KeptPoints, kLanes> kept_;
  std::array<bool, kLanes> turns_{};  // the frame is not the same all over the texel
  bool turning_ = false;              // any does
  std::uint32_t mask_ = 0;
  std::array<Vec3Lanes, kMost> p_;
  std::array<Vec3Lanes, kMost> rayStarts_;
  std::array<SurfaceLanes, kMost> surfaces_;  // the first alone where no texel turns
  std::array<Places, kLanes> places_;
  std::array<Drawn, kLanes> drawn_;
};

}  // namespace lumel
