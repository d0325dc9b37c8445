// A texel may lie in two places: a floor that runs on beneath a wall has texels with a part on either side of it, and
// no light of one side may stand for the other. Here a texel's footprint falls into parts that cannot see each other
// along the surface, and one of them is what the texel's value stands for.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "baker/rays/ray_scene.h"
#include "lightmap/texels/texels.h"

namespace lumel {

/// A point of a surface: its place and unit geometric normal, in world space.
struct SurfaceSpot {
  Vec3 p{0};
  Vec3 ng{0, 0, 1};
};

/// The part of a divided texel that its value stands for, by a few of its points: what sees one of them belongs to it.
struct TexelPart {
  static constexpr std::size_t kMostSpots = 4;
  std::array<SurfaceSpot, kMostSpots> spots;
  std::size_t count = 0;  // of spots, at least 1
  float lift = 0.0f;      // metres above the surface at which its points look at each other
};

/// The points of a divided texel that lie on the part that counts: of the first kDrawn of a sequence over its
/// footprint, TexelFootprint::sample(sobol2D(i, seed)), bit i tells that point i does. They are found once, since each
/// takes rays.
struct PartPoints {
  static constexpr std::uint32_t kDrawn = 64;
  std::uint64_t bits = 0;

  /// Numbers of the points.
  std::vector<std::uint32_t> numbers() const {
    std::vector<std::uint32_t> all;
    for (std::uint32_t i = 0; i < kDrawn; ++i)
      if ((bits >> i & 1u) != 0) all.push_back(i);
    return all;
  }
};

/// Finds the parts of a page's texels. Sight is tested by short rays a twentieth of a texel above the surface: what is
/// lower divides nothing, and neither does what is cut out or see-through (leaves, nets, panes). What lies on the
/// surface so low covers it: covered points belong to no part, unless all are.
class TexelParts {
 public:
  /// Keeps references to its arguments.
  TexelParts(const RayScene& rays, const Materials& materials, const Atlas& atlas, const PageTexels& page)
      : rays_(rays), materials_(materials), atlas_(atlas), page_(page) {}

  /// Bit i: texels[i] may be divided, since from its middle some corner of its footprint is out of sight.
  /// Precondition: at most kLanes texels.
  std::uint32_t suspects(std::span<const std::uint32_t> texels) const;

  /// The part of a texel that counts; nothing where the texel is whole. Of several parts it is the one that sees most
  /// of the neighbouring texels of its chart, and among these the largest; parts inside of solids come last.
  std::optional<TexelPart> find(std::size_t texel) const;

  /// Bit i: spots[i] sees the part. Precondition: at most 64 spots.
  std::uint64_t members(const TexelPart& part, std::span<const SurfaceSpot> spots) const;

  /// The points of a texel that is divided; nothing where it is whole, or where none of them counts.
  std::optional<PartPoints> pointsOf(std::size_t texel, std::uint32_t seed) const;

  /// Tells texels that lie in the open beneath a cover without an underside, whose backs they see, from those inside of
  /// things. Of the texels that are `asked` (one entry for each texel of the page), those become `open` from which a
  /// way leads to one that is `seen` to lie in the open: from neighbour to neighbour of a chart, each in free sight of
  /// the one before it. A texel under something that lies lower than points look at each other is not open.
  void findOpen(std::span<const std::uint8_t> asked, std::span<const std::uint8_t> seen,
                std::span<std::uint8_t> open) const;

 private:
  /// What stands for a texel when neighbours look at each other.
  struct Stand {
    SurfaceSpot spot;
    float lift = 0.0f;
    bool isFree = false;  // nothing lies on the surface there
  };
  Stand standOf(std::uint32_t texel) const;
  std::uint32_t chartOf(std::size_t texel) const;
  std::vector<SurfaceSpot> neighboursOf(std::size_t texel) const;
  std::optional<std::size_t> texelAt(int x, int y) const;
  double openness(const SurfaceSpot& spot, float lift) const;

  const RayScene& rays_;
  const Materials& materials_;
  const Atlas& atlas_;
  const PageTexels& page_;
};

}  // namespace lumel
