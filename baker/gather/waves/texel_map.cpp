#include "baker/gather/waves/texel_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <map>
#include <utility>

#include "scene/base/check.h"
#include "scene/base/parallel.h"

namespace lumel {

namespace {

/// Of a surface's triangle whose corners lie at `pixels` of its page: metres, 0 where it has no area there.
float texelWidth(const Surface& surface, std::size_t triangle, const std::array<Vec2, 3>& pixels) {
  const auto corner = [&](std::size_t i) { return surface.positions[surface.indices[3 * triangle + i]]; };
  const float meters2 = glm::length(glm::cross(corner(1) - corner(0), corner(2) - corner(0)));
  const Vec2 u = pixels[1] - pixels[0], v = pixels[2] - pixels[0];
  const float texels = std::abs(u.x * v.y - u.y * v.x);
  return texels > 0.0f ? std::sqrt(meters2 / texels) : 0.0f;
}

constexpr std::uint32_t kTileTexels = 16;
constexpr std::uint32_t kCovered = (1u << kTileTexels) - 1u;  // of Tile::bits
std::uint32_t tileBit(std::uint32_t x, std::uint32_t y) { return 4 * (y & 3u) + (x & 3u); }

/// How many of the lowest 16 bits are set.
[[gnu::always_inline]] inline std::uint32_t countBits(std::uint32_t bits) {
  bits -= (bits >> 1) & 0x5555u;
  bits = (bits & 0x3333u) + ((bits >> 2) & 0x3333u);
  bits = (bits + (bits >> 4)) & 0x0f0fu;
  return (bits + (bits >> 8)) & 0x1fu;
}

/// Where Embree places no instances its geometries are the parts, in the same order.
LUMEL_FOR_EACH_CPU void geometriesOf(const RayPacket& packet, std::uint32_t none,
                                     std::array<std::uint32_t, kLanes>& parts) {
#pragma GCC ivdep
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t geometry = packet.rayhit.hit.geomID[lane];
    parts[lane] = (packet.valid[lane] != 0) & (geometry != RTC_INVALID_GEOMETRY_ID) ? geometry : none;
  }
}

}  // namespace

TexelMap::TexelMap(const RayScene& rays, const Atlas& atlas, const std::vector<PageTexels>& texels)
    : rays_(rays), atlas_(atlas), texels_(texels), placesInstances_(rays.placesInstances()) {
  firstOfPage_.push_back(0);
  pages_.push_back({.width = 1, .height = 1, .firstTile = 0});
  for (const PageTexels& page : texels)
    tilesAcross_ = std::max(tilesAcross_, static_cast<std::uint32_t>(page.width / 4 + 1));
  std::size_t count = 0;
  std::size_t tiles = 1;
  for (const PageTexels& page : texels) {
    count += page.size();
    LUMEL_CHECK(count < kNoTexel);
    firstOfPage_.push_back(static_cast<std::uint32_t>(count));
    pages_.push_back({page.width, page.height, static_cast<std::uint32_t>(tiles)});
    tiles += std::size_t{tilesAcross_} * static_cast<std::size_t>(page.height / 4 + 1);
    LUMEL_CHECK(tiles < kNoTexel);
  }
  tiles_.resize(tiles);
  for (std::size_t p = 0; p < texels.size(); ++p) {
    const PageMap& page = pages_[p + 1];
    for (std::size_t i = 0; i < texels[p].size(); ++i) {
      const TexelCoord c = texels[p].coords[i];
      const std::uint32_t texel = firstOfPage_[p] + static_cast<std::uint32_t>(i);
      Tile& tile = tiles_[tileOf(page, c.x, c.y)];
      if (tile.bits == 0) tile.first = texel;
      tile.bits |= 1u << tileBit(c.x, c.y);
      // The order of PageTexels: what comes later lies behind it in its tile.
      LUMEL_CHECK(at(page, c.x, c.y) == texel);
    }
  }

  for (const ScenePart& part : rays.parts()) parts_.push_back({.frontSign = part.frontSign});
  parts_.emplace_back();
  triangles_.emplace_back();
  // Instances and primitives number surfaces; parts leave out what rays cannot hit.
  std::map<std::pair<int, const Primitive*>, std::uint32_t> partOf;
  for (std::uint32_t p = 0; p < rays.parts().size(); ++p)
    partOf.emplace(std::pair(rays.parts()[p].instance, rays.parts()[p].primitive), p);
  for (const Surface& surface : atlas.surfaces)
    if (const auto found = partOf.find({surface.instance, rays.primitiveOf(surface.instance, surface.primitive)});
        found != partOf.end())
      addSurface(found->second, surface);
}

void TexelMap::addSurface(std::uint32_t part, const Surface& surface) {
  const ScenePart& source = rays_.parts()[part];
  std::uint32_t& first = parts_[part].firstTriangle;
  if (first == kNowhere) {
    LUMEL_CHECK(triangles_.size() + source.primitive->triangleCount() < kNoTexel);
    first = static_cast<std::uint32_t>(triangles_.size());
    triangles_.resize(triangles_.size() + source.primitive->triangleCount());
  }
  const PageMap& page = pages_[static_cast<std::size_t>(surface.page) + 1];
  for (std::size_t t = 0; t < surface.triangleCount(); ++t) {
    const std::uint32_t sourceTriangle = surface.sourceTriangle[t];
    const std::uint32_t* sourceCorner = source.primitive->indices.data() + std::size_t{3} * sourceTriangle;
    std::array<Vec2, 3> pixels{};  // of the source triangle's corners, which may be wound the other way round
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t vertex = surface.indices[3 * t + k];
        if (surface.sourceVertex[vertex] == sourceCorner[i])
          pixels[i] = surface.lightmapUvs[vertex] * Vec2(page.width, page.height);
      }
    triangles_[std::size_t{first} + sourceTriangle] = {
        pixels[0], pixels[1] - pixels[0], pixels[2] - pixels[0], page.firstTile,
        source.firstEmitter < 0 ? texelWidth(surface, t, pixels) : kShines};
  }
}

void TexelMap::setUneven(std::span<const std::uint8_t> uneven) {
  for (std::size_t p = 0; p < texels_.size(); ++p)
    for (std::size_t i = 0; i < texels_[p].size(); ++i) {
      const TexelCoord c = texels_[p].coords[i];
      if (uneven[firstOfPage_[p] + i])
        tiles_[tileOf(pages_[p + 1], c.x, c.y)].bits |= 1u << (kTileTexels + tileBit(c.x, c.y));
    }
}

std::size_t TexelMap::pageOf(std::uint32_t texel) const {
  return static_cast<std::size_t>(std::upper_bound(firstOfPage_.begin(), firstOfPage_.end(), texel) -
                                  firstOfPage_.begin()) -
         1;
}

const TexelMap::PageMap& TexelMap::pageOf(const Triangle& triangle) const {
  const auto next = std::upper_bound(pages_.begin(), pages_.end(), triangle.firstTile,
                                     [](std::uint32_t tile, const PageMap& page) { return tile < page.firstTile; });
  return *(next - 1);
}

std::uint32_t TexelMap::at(const PageMap& page, int x, int y) const {
  if (x < 0 || y < 0 || x >= page.width || y >= page.height) return kNoTexel;
  const auto column = static_cast<std::uint32_t>(x);
  const auto row = static_cast<std::uint32_t>(y);
  const Tile& tile = tiles_[tileOf(page, column, row)];
  const std::uint32_t bit = 1u << tileBit(column, row);
  return (tile.bits & bit) != 0 ? tile.first + countBits(tile.bits & (bit - 1u)) : kNoTexel;
}

/// Of a hit on an instance, whose normal Embree gives in the space that its triangles are in.
bool TexelMap::fromBehind(std::uint32_t part, const RayPacket& packet, int lane) const {
  const RTCHit16& hit = packet.rayhit.hit;
  const ScenePart& source = rays_.parts()[part];
  const Vec3 ng(hit.Ng_x[lane], hit.Ng_y[lane], hit.Ng_z[lane]);
  return glm::dot(packet.direction(lane), source.worldFromNormal * ng) > 0.0f;
}

/// A point on a chart's border may round to the texel beside it.
std::uint32_t TexelMap::texelBeside(const PageMap& page, const Vec2& pixel) const {
  const int x = static_cast<int>(std::floor(pixel.x));
  const int y = static_cast<int>(std::floor(pixel.y));
  const int sideX = pixel.x - static_cast<float>(x) < 0.5f ? -1 : 1;
  const int sideY = pixel.y - static_cast<float>(y) < 0.5f ? -1 : 1;
  for (const auto& [dx, dy] : {std::pair(sideX, 0), std::pair(0, sideY), std::pair(sideX, sideY)})
    if (const std::uint32_t texel = at(page, x + dx, y + dy); texel != kNoTexel) return texel;
  return kNoTexel;
}

LUMEL_FOR_EACH_CPU void TexelMap::chooseTriangles(const RayPacket& packet, const PartMap* parts, Lookup& lookup) {
  const RTCRay16& ray = packet.rayhit.ray;
  const RTCHit16& hit = packet.rayhit.hit;
  std::array<LaneWords, 2> columns;
  turnRows<2>([&](std::size_t lane) { return parts + lookup.parts[lane]; }, columns);
  alignas(64) std::uint32_t firsts[kLanes];
  alignas(64) float signs[kLanes];
  std::memcpy(firsts, &columns[0], sizeof firsts);
  std::memcpy(signs, &columns[1], sizeof signs);
  std::uint32_t behind = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const float along = glm::dot(Vec3(ray.dir_x[lane], ray.dir_y[lane], ray.dir_z[lane]),
                                 Vec3(hit.Ng_x[lane], hit.Ng_y[lane], hit.Ng_z[lane]));
    behind |= along * signs[lane] > 0.0f ? 1u << lane : 0u;
    lookup.triangles[lane] = firsts[lane] != kNowhere ? firsts[lane] + hit.primID[lane] : kNowhere;
  }
  lookup.behind = behind;
}

void TexelMap::findTriangles(const RayPacket& packet, Lookup& lookup) const {
  const auto none = static_cast<std::uint32_t>(parts_.size() - 1);
  if (!placesInstances_)
    geometriesOf(packet, none, lookup.parts);
  else
    for (int lane = 0; lane < kLanes; ++lane)
      lookup.parts[static_cast<std::size_t>(lane)] = packet.hit(lane) ? rays_.partOf(packet, lane) : none;
  chooseTriangles(packet, parts_.data(), lookup);
  if (placesInstances_)
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::uint32_t part = lookup.parts[static_cast<std::size_t>(lane)];
      if (part == none || rays_.parts()[part].isWorld) continue;
      const std::uint32_t bit = 1u << lane;
      lookup.behind = fromBehind(part, packet, lane) ? lookup.behind | bit : lookup.behind & ~bit;
    }
  for (const std::uint32_t triangle : lookup.triangles) __builtin_prefetch(triangles_.data() + triangle);
}

LUMEL_FOR_EACH_CPU void TexelMap::placePixels(const RayPacket& packet, const Triangle* triangles,
                                              std::uint32_t tilesAcross, Lookup& lookup) {
  std::array<LaneWords, 8> columns;
  turnRows<8>([&](std::size_t lane) { return triangles + lookup.triangles[lane]; }, columns);
  alignas(64) float of[8][kLanes];  // Triangle's members in order
  alignas(64) std::uint32_t firstTile[kLanes];
  std::memcpy(of, &columns, sizeof of);
  std::memcpy(firstTile, &columns[6], sizeof firstTile);
  std::uint32_t hits = 0, others = 0, near = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const bool isFound = lookup.triangles[lane] != kNowhere;
    const float u = pick(isFound, packet.rayhit.hit.u[lane], 0.0f), v = pick(isFound, packet.rayhit.hit.v[lane], 0.0f);
    const float x = of[0][lane] + u * of[2][lane] + v * of[4][lane];
    const float y = of[1][lane] + u * of[3][lane] + v * of[5][lane];
    // Rounding may lead over the page's border, below zero or into the row and column that pages have beyond it.
    const auto column = static_cast<std::uint32_t>(std::max(static_cast<int>(x), 0));
    const auto row = static_cast<std::uint32_t>(std::max(static_cast<int>(y), 0));
    lookup.x[lane] = x;
    lookup.y[lane] = y;
    const bool isHit = (packet.valid[lane] != 0) & (packet.rayhit.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID);
    const bool shines = of[7][lane] == kShines;
    const bool isNear = !shines & (packet.rayhit.ray.tfar[lane] < kNearTexels * of[7][lane]);
    const std::uint32_t bit = 1u << lane;
    hits |= isHit ? bit : 0u;
    others |= !isFound | shines ? bit : 0u;
    near |= isNear ? bit : 0u;
    lookup.bits[lane] = tileBit(column, row);
    lookup.tiles[lane] = firstTile[lane] + row / 4 * tilesAcross + column / 4;
  }
  lookup.behind &= hits;
  lookup.others = (others & hits) | lookup.behind;
  lookup.near = near & hits;
}

void TexelMap::findPixels(const RayPacket& packet, Lookup& lookup) const {
  static_assert(sizeof(Triangle) == 32 && offsetof(Triangle, firstTile) == 24 && offsetof(Triangle, texelMeters) == 28);
  placePixels(packet, triangles_.data(), tilesAcross_, lookup);
  for (const std::uint32_t tile : lookup.tiles) __builtin_prefetch(tiles_.data() + tile);
}

/// Returns whether a pixel is not covered.
LUMEL_FOR_EACH_CPU bool TexelMap::countTexels(const Tile* tiles, Lookup& lookup) {
  static_assert(sizeof(Tile) == 8);
  std::array<LaneWords, 2> columns;
  turnRows<2>([&](std::size_t lane) { return tiles + lookup.tiles[lane]; }, columns);
  alignas(64) std::uint32_t of[2][kLanes];
  std::memcpy(of, &columns, sizeof of);
  int beside = 0;
  std::uint32_t uneven = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t bits = of[1][lane];
    const std::uint32_t bit = 1u << lookup.bits[lane];
    const std::uint32_t texel = of[0][lane] + countBits(bits & (bit - 1u));
    const bool isCovered = (bits & bit) != 0;
    const bool isUneven = (bits >> kTileTexels & bit) != 0;
    lookup.texels[lane] = isCovered ? texel : kNoTexel;
    beside |= !isCovered & (lookup.triangles[lane] != kNowhere) ? 1 : 0;
    uneven |= isUneven ? 1u << lane : 0u;
  }
  lookup.uneven = uneven & ~lookup.others;
  return beside != 0;
}

void TexelMap::findTexels(Lookup& lookup) const {
  if (!countTexels(tiles_.data(), lookup)) return;
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    if (lookup.texels[lane] == kNoTexel && lookup.triangles[lane] != kNowhere)
      lookup.texels[lane] = texelBeside(pageOf(triangles_[lookup.triangles[lane]]), {lookup.x[lane], lookup.y[lane]});
}

std::uint32_t TexelMap::chartOf(const PageTexels& page, std::size_t texel) const {
  const TriangleRef& ref = page.triangles[page.firstTriangle[texel]];
  return atlas_.surfaces[ref.surface].charts[ref.triangle];
}

std::uint32_t TexelMap::nearestValid(std::size_t pageIndex, std::size_t texel,
                                     std::span<const std::uint8_t> valid) const {
  const PageTexels& page = texels_[pageIndex];
  const TexelCoord at = page.coords[texel];
  const std::uint32_t chart = chartOf(page, texel);
  std::uint32_t best = kNoTexel;
  int leastDistance2 = std::numeric_limits<int>::max();
  // Nothing on a later ring is nearer than what was found within its radius.
  for (int ring = 1; ring <= kReach && ring * ring < leastDistance2; ++ring)
    for (int dy = -ring; dy <= ring; ++dy) {
      const int step = std::abs(dy) == ring ? 1 : 2 * ring;
      for (int dx = -ring; dx <= ring; dx += step) {
        const int distance2 = dx * dx + dy * dy;
        if (distance2 >= leastDistance2) continue;
        const std::uint32_t found = this->at(pages_[pageIndex + 1], at.x + dx, at.y + dy);
        if (found == kNoTexel || !valid[found] || chartOf(page, found - firstOfPage_[pageIndex]) != chart) continue;
        best = found;
        leastDistance2 = distance2;
      }
    }
  return best;
}

/// Per tile: whether one of its texels is `valid`.
std::vector<std::uint8_t> TexelMap::tilesWith(std::span<const std::uint8_t> valid) const {
  std::vector<std::uint8_t> tiles(tiles_.size(), 0);
  for (std::size_t i = 0; i < tiles_.size(); ++i)
    for (std::uint32_t t = tiles_[i].first; t < tiles_[i].first + countBits(tiles_[i].bits & kCovered); ++t)
      tiles[i] |= valid[t];
  return tiles;
}

/// Whether a tile within kReach of a texel, or little more, is valid.
bool TexelMap::anyInReach(const PageMap& page, const TexelCoord& at, std::span<const std::uint8_t> tileIsValid) const {
  const int x0 = std::max(0, at.x - kReach) / 4, x1 = std::min(page.width - 1, at.x + kReach) / 4;
  const int y0 = std::max(0, at.y - kReach) / 4, y1 = std::min(page.height - 1, at.y + kReach) / 4;
  for (int y = y0; y <= y1; ++y) {
    const std::uint8_t* row = tileIsValid.data() + page.firstTile + static_cast<std::size_t>(y) * tilesAcross_;
    if (std::any_of(row + x0, row + x1 + 1, [](std::uint8_t v) { return v != 0; })) return true;
  }
  return false;
}

/// Per chart: whether one of its texels is `valid`.
std::vector<std::uint8_t> TexelMap::chartsWith(std::span<const std::uint8_t> valid) const {
  std::vector<std::uint8_t> charts(atlas_.charts.size(), 0);
  for (std::size_t p = 0; p < texels_.size(); ++p)
    for (std::size_t i = 0; i < texels_[p].size(); ++i)
      if (valid[firstOfPage_[p] + i]) charts[chartOf(texels_[p], i)] = 1;
  return charts;
}

std::vector<std::uint8_t> TexelMap::buried(std::span<const std::uint8_t> hidden,
                                           std::span<const std::uint8_t> valid) const {
  const std::vector<std::uint8_t> chartIsSeen = chartsWith(valid);
  std::vector<std::uint8_t> found(size(), 0);
  for (std::size_t p = 0; p < texels_.size(); ++p)
    for (std::size_t i = 0; i < texels_[p].size(); ++i)
      if (hidden[firstOfPage_[p] + i]) found[firstOfPage_[p] + i] = chartIsSeen[chartOf(texels_[p], i)];
  return found;
}

std::vector<TexelMap::Substitute> TexelMap::substitutes(std::span<const std::uint8_t> wanting,
                                                        std::span<const std::uint8_t> valid) const {
  const std::vector<std::uint8_t> charts = chartsWith(valid);
  const std::vector<std::uint8_t> tileIsValid = tilesWith(valid);
  std::vector<Substitute> all;
  for (std::size_t p = 0; p < texels_.size(); ++p)
    for (std::uint32_t t = firstOfPage_[p]; t < firstOfPage_[p + 1]; ++t)
      if (wanting[t] && !valid[t] && charts[chartOf(texels_[p], t - firstOfPage_[p])]) all.push_back({t, kNoTexel});
  parallelFor(all.size(), 64, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const std::size_t page = pageOf(all[i].texel);
      const std::size_t texel = all[i].texel - firstOfPage_[page];
      if (anyInReach(pages_[page + 1], texels_[page].coords[texel], tileIsValid))
        all[i].source = nearestValid(page, texel, valid);
    }
  });
  std::erase_if(all, [](const Substitute& s) { return s.source == kNoTexel; });
  return all;
}

}  // namespace lumel
