#include "baker/rays/texel_parts.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <unordered_map>

#include "baker/rays/sampling.h"
#include "scene/base/sobol.h"

namespace lumel {
namespace {

/// Points look at each other from so many texel widths above the surface.
constexpr float kLiftTexels = 0.05f;
/// Points whose normals differ by more than 45 degrees do not see each other because the surface bends away between
/// them: they are not asked, and count as one place. (Small things have texels that cover several of their sides.)
constexpr float kSamePlace = 0.7f;
/// Corners are drawn in by this share of their way to the middle, so that what stands exactly along a texel's border
/// does not divide it. What is left out is half a per cent of the texel.
constexpr float kDrawnIn = 1.0f / 256.0f;
/// Points that are drawn of a texel that may be divided, beside its corners.
constexpr std::uint32_t kDrawn = 16;
constexpr std::size_t kMostCorners = 8;
/// And so far from the corners, since in sharp creases the way up from a corner leads into the other side.
constexpr float kFromCorner = 1.0f / 16.0f;
/// What lies on a surface is looked for from this share of the lift upwards, which rounding does not reach (liftOf).
constexpr float kRising = 1.0f / 64.0f;
/// Rays that tell how far a part lies inside of something.
constexpr int kOpennessRays = kLanes;

/// Collects up to 64 questions of who sees whom and traces them sixteen at a time. A question is answered with no as
/// soon as one of its rays is blocked.
class SightTest {
 public:
  SightTest(const RayScene& rays, const Materials& materials) : rays_(rays), materials_(materials) {}

  /// Over a bend that points outwards the way leads by a point above it.
  void ask(std::size_t question, const SurfaceSpot& a, const SurfaceSpot& b, float lift) {
    const Vec3 from = a.p + lift * a.ng, to = b.p + lift * b.ng;
    const float cosine = glm::dot(a.ng, b.ng);
    if (cosine < kSamePlace) return;
    if (cosine > 0.9999f) return trace(question, from, to);
    const Vec3 sum = a.ng + b.ng;
    const float length = glm::length(sum);
    const float rise = 0.5f * glm::length(b.p - a.p) * std::sqrt(std::max(0.0f, 1.0f - cosine) / (1.0f + cosine));
    const Vec3 over = 0.5f * (a.p + b.p) + sum * ((lift + rise) / length);
    trace(question, from, over);
    trace(question, over, to);
  }

  /// Asks whether nothing lies on the surface at a point, lower than `lift`.
  void askUpwards(std::size_t question, const SurfaceSpot& spot, float lift) {
    trace(question, spot.p + kRising * lift * spot.ng, spot.p + lift * spot.ng);
  }

  /// Bits of the questions whose two do not see each other.
  std::uint64_t blocked() {
    flush();
    return blocked_;
  }

 private:
  void trace(std::size_t question, const Vec3& from, const Vec3& to) {
    const Vec3 way = to - from;
    if (!(glm::dot(way, way) > 0.0f) || (blocked_ >> question & 1u) != 0) return;
    from_[lanes_] = from;
    way_[lanes_] = way;
    questions_[lanes_] = question;
    if (++lanes_ == kLanes) flush();
  }

  void flush() {
    if (lanes_ == 0) return;
    const std::uint32_t met = rays_.alphaTestedParts() > 0 ? metOpaque() : metAny();
    forEachLane(met, [&](std::size_t lane) { blocked_ |= std::uint64_t{1} << questions_[lane]; });
    lanes_ = 0;
  }

  std::uint32_t metAny() const {
    ShadowPacket packet;
    for (int lane = 0; lane < static_cast<int>(lanes_); ++lane) packet.set(lane, from_[lane], way_[lane], 1.0f);
    rays_.occluded(packet, TraceMode::Packet);
    std::uint32_t met = 0;
    for (int lane = 0; lane < static_cast<int>(lanes_); ++lane) met |= packet.visible(lane) ? 0u : 1u << lane;
    return met;
  }

  /// Lanes that meet what is neither cut out nor see-through.
  std::uint32_t metOpaque() const {
    RayPacket packet;
    for (int lane = 0; lane < static_cast<int>(lanes_); ++lane) {
      packet.set(lane, from_[lane], way_[lane]);
      packet.rayhit.ray.tfar[lane] = 1.0f;
    }
    rays_.intersect(packet, TraceMode::Packet);
    std::uint32_t met = 0;
    for (int lane = 0; lane < static_cast<int>(lanes_); ++lane) {
      if (!packet.hit(lane)) continue;
      const ScenePart& part = rays_.parts()[rays_.partOf(packet, lane)];
      if (materials_.material(part.primitive->material).alphaMode == AlphaMode::Opaque) met |= 1u << lane;
    }
    return met;
  }

  const RayScene& rays_;
  const Materials& materials_;
  std::size_t lanes_ = 0;
  std::array<Vec3, kLanes> from_;
  std::array<Vec3, kLanes> way_;
  std::array<std::size_t, kLanes> questions_{};
  std::uint64_t blocked_ = 0;
};

/// Calls body(i) for the bits that are set, from the lowest.
template <class Body>
void forEachBit(std::uint64_t bits, Body body) {
  for (; bits != 0; bits &= bits - 1) body(static_cast<std::size_t>(std::countr_zero(bits)));
}

/// Bits 0 to count - 1. Precondition: at most 64.
std::uint64_t firstBits(std::size_t count) { return count == 0 ? 0 : ~std::uint64_t{0} >> (64 - count); }

SurfaceSpot spotOf(const SurfacePoint& point) { return {point.position, point.geometricNormal}; }

/// Height above the surface at which a texel's points look at each other, in metres: by the width of the texel on its
/// first triangle, and more than rounding.
float liftOf(const TexelFootprint& footprint, const Atlas& atlas, const RayScene& rays) {
  const TexelFootprint::Source& source = footprint.sources().front();
  const Surface& surface = atlas.surfaces[source.triangle.surface];
  std::array<Vec3, 3> corners;
  for (std::size_t i = 0; i < 3; ++i) corners[i] = surface.positions[source.vertices[i]];
  const Vec2d a = source.texels[1] - source.texels[0], b = source.texels[2] - source.texels[0];
  const double texels = std::abs(a.x * b.y - a.y * b.x);
  const double meters2 =
      glm::length(glm::cross(Vec3d(corners[1]) - Vec3d(corners[0]), Vec3d(corners[2]) - Vec3d(corners[0])));
  const float width = texels > 0.0 ? static_cast<float>(std::sqrt(meters2 / texels)) : 0.0f;
  return std::max(kLiftTexels * width, 16.0f * offsetDistance(corners, rays.translationOf(surface.instance)));
}

/// The corners of a footprint's pieces that reach farthest in eight directions of the page, drawn in towards its
/// middle.
std::vector<SurfaceSpot> cornersOf(const TexelFootprint& footprint, const SurfaceSpot& middle) {
  const auto onPage = [&](const TexelFootprint::Piece& piece, const Vec2d& w) {
    const std::array<Vec2d, 3>& t = footprint.sources()[piece.source].texels;
    return t[0] + w.x * (t[1] - t[0]) + w.y * (t[2] - t[0]);
  };
  Vec2d mean(0);
  for (const TexelFootprint::Piece& piece : footprint.pieces())
    mean += piece.area / footprint.area() * onPage(piece, piece.middle());
  struct Corner {
    const TexelFootprint::Piece* piece = nullptr;
    Vec2 barycentric{0};
    double distance2 = 0.0;
  };
  std::array<Corner, kMostCorners> farthest;
  const auto enter = [&](const TexelFootprint::Piece& piece, const Vec2& barycentric) {
    const Vec2d way = onPage(piece, Vec2d(barycentric)) - mean;
    // The corners of a whole square lie on diagonals, which rounding must not divide.
    const bool isSteep = std::abs(way.y) > 1.001 * std::abs(way.x);
    Corner& corner = farthest[(way.x < 0.0 ? 1u : 0u) + (way.y < 0.0 ? 2u : 0u) + (isSteep ? 4u : 0u)];
    if (const double distance2 = glm::dot(way, way); distance2 > corner.distance2)
      corner = {&piece, barycentric, distance2};
  };
  for (const TexelFootprint::Piece& piece : footprint.pieces()) {
    const std::array<Vec2, 3>& c = piece.barycentric;
    for (const Vec2& barycentric : c) enter(piece, barycentric);
    if (piece.isSquare) enter(piece, c[1] + c[2] - c[0]);  // the fourth corner lies opposite of the first
  }
  std::vector<SurfaceSpot> corners;
  for (const Corner& corner : farthest) {
    if (corner.piece == nullptr) continue;
    corners.push_back(spotOf(footprint.pointOn(*corner.piece, corner.barycentric)));
    corners.back().p += kDrawnIn * (middle.p - corners.back().p);
  }
  return corners;
}

/// Points spread evenly over the footprint (the additive recurrence of the plastic number, Roberts 2018).
void addDrawn(const TexelFootprint& footprint, std::vector<SurfaceSpot>& spots) {
  for (std::uint32_t i = 0; i < kDrawn; ++i) {
    const Vec2d u = Vec2d(0.5) + static_cast<double>(i) * Vec2d(0.7548776662466927, 0.5698402909980532);
    spots.push_back(spotOf(footprint.sample(Vec2(u - glm::floor(u)))));
  }
}

/// Steps to the texels beside one.
constexpr std::array<std::array<int, 2>, 4> kBeside = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
constexpr std::uint32_t kNoPart = 0xffffffffu;

/// Points that see each other, by way of others too, are one part: for each the number of its part's first point. From
/// each point that was reached those are asked that were not yet, so that a whole texel takes one round.
/// Those that something lies on are no part of anything: kNoPart. Precondition: at most 64 spots.
std::vector<std::uint32_t> partsOf(std::span<const SurfaceSpot> spots, std::uint64_t covered, float lift,
                                   const RayScene& rays, const Materials& materials) {
  std::vector<std::uint32_t> part(spots.size(), kNoPart);
  std::uint64_t unknown = firstBits(spots.size()) & ~covered;
  while (unknown != 0) {
    const auto first = static_cast<std::uint32_t>(std::countr_zero(unknown));
    std::uint64_t waiting = std::uint64_t{1} << first;
    unknown &= ~waiting;
    while (waiting != 0) {
      const auto from = static_cast<std::size_t>(std::countr_zero(waiting));
      waiting &= waiting - 1u;
      part[from] = first;
      if (unknown == 0) continue;
      SightTest sight(rays, materials);
      forEachBit(unknown, [&](std::size_t i) { sight.ask(i, spots[from], spots[i], lift); });
      const std::uint64_t reached = unknown & ~sight.blocked();
      waiting |= reached;
      unknown &= ~reached;
    }
  }
  return part;
}

}  // namespace

std::uint32_t TexelParts::suspects(std::span<const std::uint32_t> texels) const {
  SightTest sight(rays_, materials_);
  TexelFootprint footprint;
  for (std::uint32_t i = 0; i < texels.size(); ++i) {
    if (!(footprint.clip(atlas_, page_, texels[i]) > 0.0)) continue;
    const SurfaceSpot middle = spotOf(footprint.centroid());
    const float lift = liftOf(footprint, atlas_, rays_);
    for (const SurfaceSpot& corner : cornersOf(footprint, middle)) {
      sight.ask(i, middle, corner, lift);
      sight.askUpwards(i, {corner.p + kFromCorner * (middle.p - corner.p), corner.ng}, lift);
    }
  }
  return static_cast<std::uint32_t>(sight.blocked());
}

std::optional<TexelPart> TexelParts::find(std::size_t texel) const {
  TexelFootprint footprint;
  if (!(footprint.clip(atlas_, page_, texel) > 0.0)) return std::nullopt;
  const SurfaceSpot middle = spotOf(footprint.centroid());
  const float lift = liftOf(footprint, atlas_, rays_);
  std::vector<SurfaceSpot> spots = cornersOf(footprint, middle);
  const std::size_t corners = spots.size();
  addDrawn(footprint, spots);

  const std::size_t count = spots.size();
  SightTest upwards(rays_, materials_);
  for (std::size_t i = corners; i < count; ++i) upwards.askUpwards(i, spots[i], lift);
  const std::vector<std::uint32_t> parent = partsOf(spots, upwards.blocked(), lift, rays_, materials_);
  if (std::ranges::count(parent, 0u) == static_cast<std::ptrdiff_t>(count)) return std::nullopt;

  struct Candidate {
    TexelPart part;
    double score = 0.0;
  };
  std::vector<Candidate> candidates;
  for (std::size_t root = 0; root < count; ++root) {
    if (parent[root] != root) continue;
    Candidate& candidate = candidates.emplace_back();
    candidate.part.lift = lift;
    // Drawn points first: they lie amid their part, corners at its rim.
    for (std::size_t i = count; i-- > 0;) {
      if (parent[i] != root) continue;
      if (candidate.part.count < TexelPart::kMostSpots) candidate.part.spots[candidate.part.count++] = spots[i];
      candidate.score += i >= corners ? 1.0 / kDrawn : 0.0;
    }
  }
  if (candidates.empty()) return std::nullopt;
  if (candidates.size() == 1) return candidates[0].part;
  const std::vector<SurfaceSpot> neighbours = neighboursOf(texel);
  for (Candidate& candidate : candidates) candidate.score += std::popcount(members(candidate.part, neighbours));
  std::ranges::stable_sort(candidates, std::ranges::greater(), &Candidate::score);
  const Candidate* best = nullptr;
  double bestScore = 0.0;
  for (const Candidate& candidate : candidates) {
    if (best != nullptr && candidate.score <= bestScore) break;
    const double score = candidate.score * openness(candidate.part.spots[0], lift);
    if (best != nullptr && score <= bestScore) continue;
    best = &candidate;
    bestScore = score;
  }
  return best->part;
}

std::uint64_t TexelParts::members(const TexelPart& part, std::span<const SurfaceSpot> spots) const {
  SightTest upwards(rays_, materials_);
  for (std::size_t i = 0; i < spots.size(); ++i) upwards.askUpwards(i, spots[i], part.lift);
  const std::uint64_t free = firstBits(spots.size()) & ~upwards.blocked();
  std::uint64_t others = free;
  for (std::size_t k = 0; k < part.count && others != 0; ++k) {
    SightTest sight(rays_, materials_);
    forEachBit(others, [&](std::size_t i) { sight.ask(i, part.spots[k], spots[i], part.lift); });
    others &= sight.blocked();
  }
  return free & ~others;
}

std::optional<PartPoints> TexelParts::pointsOf(std::size_t texel, std::uint32_t seed) const {
  const std::optional<TexelPart> part = find(texel);
  if (!part) return std::nullopt;
  TexelFootprint footprint;
  footprint.clip(atlas_, page_, texel);
  std::array<SurfaceSpot, PartPoints::kDrawn> spots;
  for (std::uint32_t i = 0; i < PartPoints::kDrawn; ++i) spots[i] = spotOf(footprint.sample(sobol2D(i, seed)));
  const PartPoints points{members(*part, spots)};
  if (points.bits == 0) return std::nullopt;
  return points;
}

std::uint32_t TexelParts::chartOf(std::size_t texel) const {
  const TriangleRef& ref = page_.trianglesOf(texel).front();
  return atlas_.surfaces[ref.surface].charts[ref.triangle];
}

TexelParts::Stand TexelParts::standOf(std::uint32_t texel) const {
  Stand stand;
  TexelFootprint footprint;
  if (!(footprint.clip(atlas_, page_, texel) > 0.0)) return stand;
  stand.spot = spotOf(footprint.centroid());
  stand.lift = liftOf(footprint, atlas_, rays_);
  if (suspects({&texel, 1}) != 0)
    if (const std::optional<TexelPart> part = find(texel)) stand.spot = part->spots[0];
  SightTest sight(rays_, materials_);
  sight.askUpwards(0, stand.spot, stand.lift);
  stand.isFree = sight.blocked() == 0;
  return stand;
}

void TexelParts::findOpen(std::span<const std::uint8_t> asked, std::span<const std::uint8_t> seen,
                          std::span<std::uint8_t> open) const {
  std::unordered_map<std::uint32_t, Stand> stands;
  const auto standAt = [&](std::uint32_t texel) -> const Stand& {
    const auto [at, isNew] = stands.try_emplace(texel);
    if (isNew) at->second = standOf(texel);
    return at->second;
  };
  std::vector<std::uint8_t> reached(page_.size(), 0);
  for (std::uint32_t start = 0; start < page_.size(); ++start) {
    if (asked[start] == 0 || reached[start] != 0) continue;
    std::vector<std::uint32_t> way = {start};
    reached[start] = 1;
    bool isOpen = false;
    for (std::size_t next = 0; next < way.size() && !isOpen; ++next) {
      const Stand from = standAt(way[next]);
      if (!from.isFree) continue;
      const TexelCoord at = page_.coords[way[next]];
      SightTest sight(rays_, materials_);
      std::array<std::optional<std::size_t>, kBeside.size()> beside;
      for (std::uint32_t k = 0; k < kBeside.size(); ++k) {
        beside[k] = texelAt(at.x + kBeside[k][0], at.y + kBeside[k][1]);
        if (!beside[k] || chartOf(*beside[k]) != chartOf(way[next])) beside[k].reset();
        // Who was reached before and is not open cannot be seen from here, or this texel would have been reached then.
        if (!beside[k] || (reached[*beside[k]] != 0 && open[*beside[k]] == 0)) continue;
        sight.ask(k, from.spot, standAt(static_cast<std::uint32_t>(*beside[k])).spot, from.lift);
      }
      const std::uint64_t blocked = sight.blocked();
      for (std::uint32_t k = 0; k < kBeside.size(); ++k) {
        if (!beside[k] || (blocked >> k & 1u) != 0) continue;
        const auto texel = static_cast<std::uint32_t>(*beside[k]);
        if (!standAt(texel).isFree) continue;
        isOpen = isOpen || seen[texel] != 0 || open[texel] != 0;
        if (reached[texel] == 0) way.push_back(texel);
        reached[texel] = 1;
      }
    }
    if (isOpen)
      for (const std::uint32_t texel : way) open[texel] = 1;
  }
}

/// The middles of the up to four texels beside one that belong to the same chart.
std::vector<SurfaceSpot> TexelParts::neighboursOf(std::size_t texel) const {
  std::vector<SurfaceSpot> spots;
  TexelFootprint footprint;
  const TexelCoord at = page_.coords[texel];
  for (const auto& [dx, dy] : kBeside) {
    const auto near = texelAt(at.x + dx, at.y + dy);
    if (near && chartOf(*near) == chartOf(texel) && footprint.clip(atlas_, page_, *near) > 0.0)
      spots.push_back(spotOf(footprint.centroid()));
  }
  return spots;
}

/// PageTexels::coords are in order of tiles, then of rows.
std::optional<std::size_t> TexelParts::texelAt(int x, int y) const {
  if (x < 0 || y < 0 || x >= page_.width || y >= page_.height) return std::nullopt;
  const auto key = [](const TexelCoord& at) { return std::array<int, 4>{at.y / 4, at.x / 4, at.y % 4, at.x % 4}; };
  const TexelCoord wanted{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)};
  const auto found = std::ranges::lower_bound(page_.coords, key(wanted), {}, key);
  if (found == page_.coords.end() || found->x != wanted.x || found->y != wanted.y) return std::nullopt;
  return static_cast<std::size_t>(found - page_.coords.begin());
}

/// Share of the rays from a point that do not meet the back of a single-sided surface first.
double TexelParts::openness(const SurfaceSpot& spot, float lift) const {
  RayPacket packet;
  const Frame frame = frameAround(spot.ng);
  for (int i = 0; i < kOpennessRays; ++i) {
    const Vec2 u((static_cast<float>(i % 4) + 0.5f) / 4.0f, (static_cast<float>(i) + 0.5f) / kOpennessRays);
    packet.set(i, spot.p + lift * spot.ng, frame.fromLocal(sampleCosineHemisphere(u)));
  }
  rays_.intersect(packet, TraceMode::Packet);
  int backs = 0;
  for (int i = 0; i < kOpennessRays; ++i)
    if (packet.hit(i)) {
      const HitSurface hit = rays_.surfaceAt(packet, i);
      backs += hit.backFace && !materials_.material(hit.material).doubleSided ? 1 : 0;
    }
  return 1.0 - static_cast<double>(backs) / kOpennessRays;
}

}  // namespace lumel
