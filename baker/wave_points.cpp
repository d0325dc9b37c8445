#include "baker/wave_points.h"

#include <algorithm>
#include <cmath>

#include "scene/check.h"

namespace lumel {
namespace {

LUMEL_FOR_EACH_CPU void drawSquare(std::uint32_t seed, std::uint32_t first, float* x, float* y) {
  for (std::uint32_t i = 0; i < WavePoints::kMost; ++i) {
    const Vec2 u = sobol2D(first + i, seed);
    x[i] = u.x;
    y[i] = u.y;
  }
}

Frame frameAt(const std::array<Vec3, 3>& normals, const std::array<Vec4, 3>& tangents, const Vec3& ng, Vec2 w) {
  const float w0 = 1.0f - w.x - w.y;
  const Vec3 normal = w0 * normals[0] + w.x * normals[1] + w.y * normals[2];
  const float length2 = glm::dot(normal, normal);
  const bool isSmooth = length2 > 1e-12f && std::isfinite(length2);
  // A chart never mixes handedness, so neither does a triangle: the interpolated w keeps its sign.
  const Vec4 tangent = w0 * tangents[0] + w.x * tangents[1] + w.y * tangents[2];
  return frameFromTangent(isSmooth ? normal / std::sqrt(length2) : ng, tangent);
}

}  // namespace

WavePoints::WavePoints(const RayScene& rays, const Atlas& atlas, const PageTexels& page, std::size_t first,
                       std::size_t count) {
  TexelFootprint footprint;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (lane < count) {
      areas_[lane] = footprint.clip(atlas, page, first + lane);
      if (areas_[lane] > 0) addTexel(rays, atlas, footprint, lane);
    }
    firstPiece_[lane + 1] = static_cast<std::uint32_t>(pieces_.size());
    for (PointLanes& point : points_) point.light.active[lane] = areas_[lane] > 0;
  }
}

void WavePoints::leaveOut(std::size_t lane) {
  leftOut_[lane] = true;
  for (PointLanes& point : points_) point.light.active[lane] = false;
}

void WavePoints::addTexel(const RayScene& rays, const Atlas& atlas, const TexelFootprint& footprint,
                          std::size_t lane) {
  const auto firstSource = static_cast<std::uint32_t>(sources_.size());
  for (const TexelFootprint::Source& from : footprint.sources()) {
    const Surface& surface = atlas.surfaces[from.triangle.surface];
    Source source{.triangle = from.triangle, .ng = from.geometricNormal};
    std::array<Vec3, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i] = surface.positions[from.vertices[i]];
      source.normals[i] = surface.normals[from.vertices[i]];
      source.tangents[i] = surface.tangents[from.vertices[i]];
    }
    source.p0 = corners[0];
    source.e1 = corners[1] - corners[0];
    source.e2 = corners[2] - corners[0];
    source.offsetMeters = offsetDistance(corners, rays.translationOf(surface.instance));
    source.flat = source.normals[0] == source.normals[1] && source.normals[0] == source.normals[2] &&
                  source.tangents[0] == source.tangents[1] && source.tangents[0] == source.tangents[2];
    if (source.flat) source.frame = frameAt(source.normals, source.tangents, source.ng, Vec2(0.0f));
    sources_.push_back(source);
  }
  for (const TexelFootprint::Piece& from : footprint.pieces()) {
    const std::array<Vec2, 3>& c = from.barycentric;
    pieces_.push_back({firstSource + from.source, static_cast<float>(from.areaBefore), static_cast<float>(from.area),
                       c[0], c[1] - c[0], c[2] - c[0]});
  }
  LUMEL_CHECK(pieces_.size() > firstPiece_[lane]);
}

void WavePoints::draw(const std::array<TexelSampler, kLanes>& samplers, std::uint32_t pattern, std::uint32_t first,
                      std::uint32_t count) {
  LUMEL_CHECK(count >= 1 && count <= kMost && (count & (count - 1)) == 0);
  mask_ = count - 1;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (!covered(lane)) continue;
    alignas(64) float x[kMost];
    alignas(64) float y[kMost];
    drawSquare(samplers[lane].seedOf(pattern), first, x, y);
    for (std::uint32_t i = 0; i < count; ++i) store(lane, i, choose(lane, {x[i], y[i]}));
  }
}

/// As TexelFootprint::sample: u.x chooses the piece, and what is left of it the reach within.
WavePoints::Place WavePoints::choose(std::size_t lane, Vec2 u) const {
  const Piece* piece = pieces_.data() + firstPiece_[lane];
  const Piece* const last = pieces_.data() + firstPiece_[lane + 1] - 1;
  const float target = u.x * static_cast<float>(areas_[lane]);
  while (piece != last && target >= piece[1].areaBefore) ++piece;
  const float share = std::clamp((target - piece->areaBefore) / piece->area, 0.0f, 1.0f);
  const Vec2 w = piece->start + std::sqrt(share) * ((1.0f - u.y) * piece->toSecond + u.y * piece->toThird);
  const float w1 = std::clamp(w.x, 0.0f, 1.0f);
  return {piece->source, {w1, std::clamp(w.y, 0.0f, 1.0f - w1)}};
}

void WavePoints::store(std::size_t lane, std::uint32_t i, const Place& place) {
  const Source& source = sources_[place.source];
  const Vec2 w = place.weights;
  const Vec3 fromFirst = w.x * source.e1 + w.y * source.e2;
  const Vec3 p = source.p0 + fromFirst;
  const Vec3 start = p + rayOffset(source.ng, source.e1 + source.e2 - 3.0f * fromFirst, source.offsetMeters);
  const Frame frame = source.flat ? source.frame : frameAt(source.normals, source.tangents, source.ng, w);
  places_[i][lane] = place;
  PointLanes& point = points_[i];
  point.rayStart.set(lane, start);
  point.frame.set(lane, frame);
  point.ng.set(lane, source.ng);
  point.light.receivers[lane] = {p, source.ng, frame.n, start};
}

PlaceOnTriangle WavePoints::place(std::size_t lane, std::uint32_t i) const {
  const Place& place = places_[i & mask_][lane];
  return {sources_[place.source].triangle, place.weights};
}

}  // namespace lumel
