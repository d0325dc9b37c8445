// The light that texels send back, for rays that end on them: where in the atlas a hit lies, and what the texel there
// reflects.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "baker/rays/ray_scene.h"
#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"

namespace lumel {

inline constexpr std::uint32_t kNoTexel = 0xffffffffu;

/// Covered texels of all pages are numbered through: page by page, in the order of PageTexels.
class TexelMap {
 public:
  /// Keeps references to its arguments. Memory: half a byte per pixel of every page (as if all were as wide as the
  /// widest), 32 per triangle of a part that has a lightmap.
  TexelMap(const RayScene& rays, const Atlas& atlas, const std::vector<PageTexels>& texels);

  std::size_t size() const { return firstOfPage_.back(); }
  std::uint32_t firstOfPage(std::size_t page) const { return firstOfPage_[page]; }
  std::size_t pageOf(std::uint32_t texel) const;

  /// The texels that the rays of a packet end on, in three steps: each asks memory for what the next one reads, so that
  /// a caller can do other work in between.
  struct Lookup;
  void findTriangles(const RayPacket& packet, Lookup& lookup) const;
  void findPixels(const RayPacket& packet, Lookup& lookup) const;
  void findTexels(Lookup& lookup) const;
  /// All three, where there is no other work: the lanes at least wait for memory together.
  void findAll(const RayPacket& packet, Lookup& lookup) const {
    findTriangles(packet, lookup);
    findPixels(packet, lookup);
    findTexels(lookup);
  }

  /// Hits that are nearer than so many of their texels: one value for a whole texel is too coarse for them.
  static constexpr float kNearTexels = 0.5f;
  /// `uneven`: one for each texel; from now on hits on those that are not 0 are too coarse from afar, too.
  void setUneven(std::span<const std::uint8_t> uneven);

  /// For each texel that is `wanting` and not `valid`: the nearest valid one of the same chart, within kReach texels;
  /// pairs of (texel, source) in the order of texels. Texels without such a neighbour are left out.
  struct Substitute {
    std::uint32_t texel = 0;
    std::uint32_t source = 0;
  };
  std::vector<Substitute> substitutes(std::span<const std::uint8_t> wanting, std::span<const std::uint8_t> valid) const;
  static constexpr int kReach = 16;

  /// Of the texels that are `hidden` for certain, those whose chart has one that is `valid`.
  std::vector<std::uint8_t> buried(std::span<const std::uint8_t> hidden, std::span<const std::uint8_t> valid) const;

 private:
  struct alignas(32) Triangle {
    Vec2 pixel{0}, perU{0}, perV{0};     // on the page: of the first corner, and how it moves with the barycentrics
    std::uint32_t firstTile = kNowhere;  // of the page
    float texelMeters = 0.0f;            // width of a texel on the surface; kShines: hits bring emission
  };
  struct PartMap {
    std::uint32_t firstTriangle = kNowhere;  // into triangles_; kNowhere: no lightmap
    float frontSign = 0.0f;                  // ScenePart::frontSign
  };
  struct PageMap {
    int width = 0;
    int height = 0;
    std::uint32_t firstTile = 0;  // rows of tilesAcross_, with one more row and column than the page has
  };
  /// 4 x 4 pixels. Texels are numbered tile by tile (PageTexels::coords), so a texel is the first of its tile and as
  /// many more as are covered before it: the map of a page fits into a processor's cache.
  struct Tile {
    std::uint32_t first = 0;
    std::uint32_t bits = 0;  // bit 4 * (y % 4) + x % 4: the pixel is covered; 16 higher: its texel is uneven
  };
  /// Triangle, page and tile that stand for having none: lookups need no branches.
  static constexpr std::uint32_t kNowhere = 0;
  static constexpr float kShines = std::numeric_limits<float>::infinity();

  void addSurface(std::uint32_t part, const Surface& surface);
  static void chooseTriangles(const RayPacket& packet, const PartMap* parts, Lookup& lookup);
  static void placePixels(const RayPacket& packet, const Triangle* triangles, std::uint32_t tilesAcross,
                          Lookup& lookup);
  static bool countTexels(const Tile* tiles, Lookup& lookup);
  const PageMap& pageOf(const Triangle& triangle) const;
  bool fromBehind(std::uint32_t part, const RayPacket& packet, int lane) const;
  std::uint32_t texelBeside(const PageMap& page, const Vec2& pixel) const;
  std::size_t tileOf(const PageMap& page, std::uint32_t x, std::uint32_t y) const {
    return page.firstTile + std::size_t{y / 4} * tilesAcross_ + x / 4;
  }
  std::uint32_t at(const PageMap& page, int x, int y) const;
  std::uint32_t chartOf(const PageTexels& page, std::size_t texel) const;
  std::vector<std::uint8_t> chartsWith(std::span<const std::uint8_t> valid) const;
  std::vector<std::uint8_t> tilesWith(std::span<const std::uint8_t> valid) const;
  bool anyInReach(const PageMap& page, const TexelCoord& at, std::span<const std::uint8_t> tileIsValid) const;
  std::uint32_t nearestValid(std::size_t page, std::size_t texel, std::span<const std::uint8_t> valid) const;

  const RayScene& rays_;
  const Atlas& atlas_;
  const std::vector<PageTexels>& texels_;
  const bool placesInstances_;
  std::vector<std::uint32_t> firstOfPage_;  // [pages + 1]
  std::vector<PageMap> pages_;              // from 1 on
  std::uint32_t tilesAcross_ = 0;           // of all pages, so that lookups need not know which
  std::vector<Tile> tiles_;
  std::vector<PartMap> parts_;  // of RayScene::parts; the last one is for rays that hit nothing
  std::vector<Triangle> triangles_;
};

struct TexelMap::Lookup {
  /// The texel at the hit, from either side; kNoTexel: nothing was hit, the part has no lightmap, or the point lies (by
  /// rounding) beside all texels of the page.
  alignas(64) std::array<std::uint32_t, kLanes> texels;
  alignas(64) std::array<std::uint32_t, kLanes> parts;  // of RayScene::parts, where there is a hit
  // Bits of lanes:
  std::uint32_t behind;  // the hit is on the back
  std::uint32_t others;  // the texel does not tell all: a back, something that shines by itself, or no texel at all
  // One value for a texel is too coarse, and the hit does not shine:
  std::uint32_t near;    // the ray is shorter than kNearTexels
  std::uint32_t uneven;  // as setUneven said

 private:
  friend TexelMap;
  alignas(64) std::array<std::uint32_t, kLanes> triangles;
  alignas(64) std::array<std::uint32_t, kLanes> tiles;
  alignas(64) std::array<std::uint32_t, kLanes> bits;  // of the pixel in its tile
  alignas(64) std::array<float, kLanes> x;
  alignas(64) std::array<float, kLanes> y;
};

}  // namespace lumel
