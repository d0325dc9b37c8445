#include "lightmap/seams/seams.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "lightmap/seams/border_edges.h"

namespace lumel {
namespace {

/// Edges coincide within this share of a texel of the coarser side.
constexpr double kTolerance = 0.05;
/// Cosine of 3 degrees: under a light at 45 degrees, flat facets that bend by more differ by more than 5%.
constexpr float kLeastShadingCosine = 0.9986f;
/// Smoothly shaded facets bend by up to 60 degrees (a hexagon).
constexpr double kLeastFacetCosine = 0.49;
/// Common parts shorter than this share of a texel, and of the shorter edge, are touching corners.
constexpr double kLeastOverlap = 0.1;
constexpr double kPointsPerTexel = 2.0;
/// Crossings begin and end so many texels from the edge, over the surface by a tenth of that.
constexpr double kReach = 0.5;
constexpr double kLift = 0.1;

/// The common part of two edges.
struct Meeting {
  double from = 0.0;  // metres from the first edge's start
  double to = 0.0;
};

/// The common part of two edges, if they run along each other within `tolerance`.
std::optional<Meeting> meetingOf(const BorderEdge& a, const BorderEdge& b, double tolerance) {
  const Vec3d fromA = b.start - a.start, toA = b.end - a.start;
  double s0 = glm::dot(fromA, a.direction), s1 = glm::dot(toA, a.direction);
  const bool reversed = s0 > s1;
  const double low = std::max(std::min(s0, s1), 0.0), high = std::min(std::max(s0, s1), a.length);
  const double shorter = std::min(a.length, b.length);
  if (!(high - low > std::max(kLeastOverlap * shorter, std::min(2.0 * tolerance, 0.5 * shorter)))) return std::nullopt;
  for (const double s : {low, high}) {
    const Vec3d onA = a.start + s * a.direction;
    const double t = (reversed ? s0 - s : s - s0) * b.length / std::abs(s1 - s0);
    const Vec3d apart = b.start + t * b.direction - onA;
    if (!(glm::dot(apart, apart) <= tolerance * tolerance)) return std::nullopt;
  }
  return Meeting{low, high};
}

/// Texels per metre along a direction in the triangle's plane.
Vec2d texelsAlong(const BorderEdge& edge, const Vec3d& direction) {
  return edge.perMetre[0] * glm::dot(direction, edge.direction) + edge.perMetre[1] * glm::dot(direction, edge.outwards);
}

SeamSide sideOf(const Atlas& atlas, const BorderEdge& edge, const Vec3d& start, const Vec3d& direction, double middle) {
  const double offset = glm::dot(start - edge.start, edge.direction);
  const Vec3d along = glm::dot(direction, edge.direction) < 0 ? -edge.direction : edge.direction;
  SeamSide side;
  side.page = static_cast<std::uint32_t>(atlas.surfaces[edge.surface].page);
  side.chart = edge.chart;
  side.start = edge.startTexel + edge.perMetre[0] * offset;
  side.along = texelsAlong(edge, along);
  side.out = edge.perMetre[1];
  const double t = offset + middle * glm::dot(along, edge.direction);
  side.frame = frameOn(atlas, edge, std::clamp(t / edge.length, 0.0, 1.0));
  return side;
}

/// Whether the two are one edge of one chart: both sides have the same place on the page, and are continued there.
bool isSamePlace(const SeamPair& pair) {
  const SeamSide& a = pair.sides[0];
  const SeamSide& b = pair.sides[1];
  constexpr double kSame = 1e-2;  // texels; UVs are floats
  const auto near = [](const Vec2d& p, const Vec2d& q) { return glm::dot(p - q, p - q) < kSame * kSame; };
  return a.page == b.page && near(a.start, b.start) && near(a.at({pair.length, 0}), b.at({pair.length, 0})) &&
         glm::dot(a.out, b.out) < 0;
}

std::optional<SeamPair> pairOf(const Atlas& atlas, const BorderEdge& a, const BorderEdge& b) {
  if (!(glm::dot(a.normal, b.normal) > kLeastFacetCosine)) return std::nullopt;
  if (!(glm::dot(a.outwards, b.outwards) < -kLeastFacetCosine)) return std::nullopt;
  const double coarser = std::max(a.metresPerTexel, b.metresPerTexel);
  const double tolerance = std::min(kTolerance * coarser, 0.25 * std::min(a.length, b.length));
  const auto meeting = meetingOf(a, b, tolerance);
  if (!meeting) return std::nullopt;
  SeamPair pair;
  pair.length = meeting->to - meeting->from;
  const Vec3d start = a.start + meeting->from * a.direction;
  pair.sides = {sideOf(atlas, a, start, a.direction, 0.5 * pair.length),
                sideOf(atlas, b, start, a.direction, 0.5 * pair.length)};
  if (!(glm::dot(pair.sides[0].frame.n, pair.sides[1].frame.n) >= kLeastShadingCosine)) return std::nullopt;
  if (isSamePlace(pair)) return std::nullopt;
  return pair;
}

/// Adds the points of a pair and, for each, the way from side to side.
void addPoints(const BorderEdge& a, const BorderEdge& b, const SeamPair& pair, std::uint32_t index,
               std::vector<SeamPoint>& points, std::vector<SeamCrossing>& crossings) {
  const double texels = pair.length * std::max(glm::length(pair.sides[0].along), glm::length(pair.sides[1].along));
  const auto count = static_cast<std::size_t>(std::clamp(std::ceil(kPointsPerTexel * texels), 1.0, 1e6));
  const Vec3d up = glm::normalize(a.normal + b.normal);
  const double halfCosine = std::max(0.5, glm::dot(up, a.normal));
  const double tangent = std::sqrt(std::max(0.0, 1.0 - halfCosine * halfCosine)) / halfCosine;
  const double reach = kReach * std::max(1.0 / glm::length(pair.sides[0].out), 1.0 / glm::length(pair.sides[1].out));
  const Vec3d lift = reach * (kLift + tangent) * up;
  const Vec3d start = a.start + a.direction * glm::dot(a.direction, a.pointAt(pair.sides[0].start) - a.start);
  for (std::size_t k = 0; k < count; ++k) {
    const double metres = pair.length * (static_cast<double>(k) + 0.5) / static_cast<double>(count);
    points.push_back({index, static_cast<float>(metres), static_cast<float>(texels / static_cast<double>(count))});
    const Vec3d p = start + metres * a.direction + lift;
    crossings.push_back({Vec3(p - reach * a.outwards), Vec3(p - reach * b.outwards)});
  }
}

}  // namespace

Vec2d SeamSide::inMetres(const Vec2d& texel) const {
  const Vec2d d = texel - start;
  const double determinant = along.x * out.y - along.y * out.x;
  return Vec2d(d.x * out.y - d.y * out.x, along.x * d.y - along.y * d.x) / determinant;
}

Seams findSeams(const Atlas& atlas, const BlockedCrossings& blocked) {
  const std::vector<BorderEdge> edges = borderEdges(atlas);
  Seams seams;
  std::vector<SeamPoint> points;
  std::vector<SeamCrossing> crossings;
  for (const auto& [first, second] : neighboursOf(edges)) {
    const auto pair = pairOf(atlas, edges[first], edges[second]);
    if (!pair) continue;
    addPoints(edges[first], edges[second], *pair, static_cast<std::uint32_t>(seams.pairs.size()), points, crossings);
    seams.pairs.push_back(*pair);
  }
  std::vector<std::uint8_t> isBlocked(points.size(), 0);
  blocked(crossings, isBlocked);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (isBlocked[i] == 0) seams.points.push_back(points[i]);
  return seams;
}

}  // namespace lumel
