#include "baker/gather/waves/wave_points.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "baker/rays/ray_start.h"
#include "lightmap/texels/vertex_normal.h"
#include "scene/base/check.h"

namespace lumel {

WavePoints::WavePoints(const RayScene& rays, const Atlas& atlas, const PageTexels& page, std::size_t first,
                       std::size_t count) {
  TexelFootprint footprint;
  sources_.reserve(64);
  pieces_.reserve(128);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (lane < count) {
      areas_[lane] = footprint.clip(atlas, page, first + lane);
      if (areas_[lane] > 0) addTexel(rays, atlas, footprint, lane);
    }
    active_[lane] = areas_[lane] > 0;
    firstSource_[lane + 1] = static_cast<std::uint32_t>(sources_.size());
    firstPiece_[lane + 1] = static_cast<std::uint32_t>(pieces_.size());
    turns_[lane] = turns(lane);
    turning_ = turning_ || turns_[lane];
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    if (!active_[lane]) {
      drawn_[lane] = {};
      leaveOut(lane);
    } else if (!turns_[lane]) {
      setFrame(lane, sources_[firstSource_[lane]].frame, sources_[firstSource_[lane]].ng);
    }
}

/// Of all points of a texel.
void WavePoints::setFrame(std::size_t lane, const Frame& frame, const Vec3& ng) {
  if (!turning_) {
    surfaces_[0].frame.set(lane, frame);
    surfaces_[0].ng.set(lane, ng);
    return;
  }
  const auto fill = [](float(&rows)[3][kMost], const Vec3& v) {
    for (int k = 0; k < 3; ++k) std::fill(std::begin(rows[k]), std::end(rows[k]), v[k]);
  };
  fill(drawn_[lane].t, frame.t);
  fill(drawn_[lane].b, frame.b);
  fill(drawn_[lane].n, frame.n);
  fill(drawn_[lane].ng, ng);
  fill(drawn_[lane].lift, Vec3(0.0f));
}

WavePoints::Source WavePoints::sourceOf(const RayScene& rays, const Surface& surface,
                                        const TexelFootprint::Source& from) {
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
  source.rounded = roundedShare(source.ng, source.e1, source.e2, source.normals);
  if (source.flat) source.frame = frameFromTangent(unitNormalOr(source.normals[0], source.ng), source.tangents[0]);
  return source;
}

void WavePoints::addTexel(const RayScene& rays, const Atlas& atlas, const TexelFootprint& footprint, std::size_t lane) {
  const auto firstSource = static_cast<std::uint32_t>(sources_.size());
  const std::uint32_t firstBefore = lane > 0 ? firstSource_[lane - 1] : 0;
  std::uint32_t known = firstBefore;
  for (const TexelFootprint::Source& from : footprint.sources()) {
    // Neighbours share triangles; those of both are in order.
    while (known < firstSource && sources_[known].triangle < from.triangle) ++known;
    sources_.push_back(known < firstSource && sources_[known].triangle == from.triangle
                           ? Source(sources_[known])
                           : sourceOf(rays, atlas.surfaces[from.triangle.surface], from));
  }
  for (const TexelFootprint::Piece& from : footprint.pieces()) {
    const std::array<Vec2, 3>& c = from.barycentric;
    pieces_.push_back({firstSource + from.source, static_cast<float>(from.areaBefore), static_cast<float>(from.area),
                       c[0], c[1] - c[0], c[2] - c[0], from.isSquare});
  }
  LUMEL_CHECK(pieces_.size() > firstPiece_[lane]);
}

void WavePoints::boundsOf(std::size_t lane, Vec3& least, Vec3& most) const {
  least = Vec3(std::numeric_limits<float>::max());
  most = Vec3(std::numeric_limits<float>::lowest());
  for (std::uint32_t i = firstPiece_[lane]; i < firstPiece_[lane + 1]; ++i) {
    const Piece& piece = pieces_[i];
    const Source& source = sources_[piece.source];
    for (const Vec2& w : {piece.start, piece.start + piece.toSecond, piece.start + piece.toThird,
                          piece.start + (piece.isSquare ? piece.toSecond + piece.toThird : piece.toSecond)}) {
      const Vec3 p = source.p0 + w.x * source.e1 + w.y * source.e2;
      least = glm::min(least, p);
      most = glm::max(most, p);
    }
  }
}

void WavePoints::leaveOut(std::size_t lane) {
  active_[lane] = 0;
  setFrame(lane, {Vec3(0.0f), Vec3(0.0f), Vec3(0.0f)}, Vec3(0.0f));
}

bool WavePoints::turns(std::size_t lane) const {
  const auto same = [](const Frame& a, const Frame& b) { return a.t == b.t && a.b == b.b && a.n == b.n; };
  for (std::uint32_t i = firstSource_[lane]; i < firstSource_[lane + 1]; ++i) {
    const Source& first = sources_[firstSource_[lane]];
    if (!sources_[i].flat || !same(sources_[i].frame, first.frame) || sources_[i].ng != first.ng) return true;
  }
  return false;
}

/// Points of a texel that is all square: as TexelFootprint::sample.
LUMEL_FOR_EACH_CPU void WavePoints::chooseInSquare(const Piece& square, std::uint32_t seed,
                                                   const std::uint32_t* reversedIndices, Places& places) {
  const Vec2 start = square.start, toSecond = square.toSecond, toThird = square.toThird;
  const std::uint32_t source = square.source;
  for (std::uint32_t i = 0; i < kMost; ++i) {
    const Vec2 u = sobol2DOfReversed(reversedIndices[i], seed);
    places.source[i] = source;
    places.x[i] = within(start.x + u.x * toSecond.x + u.y * toThird.x, 0.0f, 1.0f);
    places.y[i] = within(start.y + u.x * toSecond.y + u.y * toThird.y, 0.0f, 1.0f - places.x[i]);
  }
}

/// Of any texel: u.x chooses the piece, and what is left of it the place within.
LUMEL_FOR_EACH_CPU void WavePoints::choose(std::span<const Piece> pieces, float area, std::uint32_t seed,
                                           const std::uint32_t* reversedIndices, Places& places) {
  alignas(64) float target[kMost];
  alignas(64) float y[kMost];
  for (std::uint32_t i = 0; i < kMost; ++i) {
    const Vec2 u = sobol2DOfReversed(reversedIndices[i], seed);
    target[i] = u.x * area;
    y[i] = u.y;
  }
  alignas(64) std::uint32_t source[kMost];
  alignas(64) float before[kMost], size[kMost], startX[kMost], startY[kMost];
  alignas(64) float secondX[kMost], secondY[kMost], thirdX[kMost], thirdY[kMost];
  alignas(64) std::uint32_t square[kMost];
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const Piece piece = pieces[k];
    // Pieces before the first one with points need no test.
    const float from = k == 0 ? -1.0f : piece.areaBefore;
    const std::uint32_t isSquare = piece.isSquare ? 1 : 0;
    for (std::uint32_t i = 0; i < kMost; ++i) {
      const bool reached = target[i] >= from;
      source[i] = reached ? piece.source : source[i];
      before[i] = pick(reached, piece.areaBefore, before[i]);
      size[i] = pick(reached, piece.area, size[i]);
      startX[i] = pick(reached, piece.start.x, startX[i]);
      startY[i] = pick(reached, piece.start.y, startY[i]);
      secondX[i] = pick(reached, piece.toSecond.x, secondX[i]);
      secondY[i] = pick(reached, piece.toSecond.y, secondY[i]);
      thirdX[i] = pick(reached, piece.toThird.x, thirdX[i]);
      thirdY[i] = pick(reached, piece.toThird.y, thirdY[i]);
      square[i] = reached ? isSquare : square[i];
    }
  }
  for (std::uint32_t i = 0; i < kMost; ++i) {
    const float share = within((target[i] - before[i]) / size[i], 0.0f, 1.0f);
    const float reach = std::sqrt(share);
    const float alongSecond = pick(square[i] != 0, share, reach * (1.0f - y[i]));
    const float alongThird = pick(square[i] != 0, y[i], reach * y[i]);
    const float x = startX[i] + alongSecond * secondX[i] + alongThird * thirdX[i];
    const float z = startY[i] + alongSecond * secondY[i] + alongThird * thirdY[i];
    places.source[i] = source[i];
    places.x[i] = within(x, 0.0f, 1.0f);
    places.y[i] = within(z, 0.0f, 1.0f - places.x[i]);
  }
}

void WavePoints::keepTo(std::size_t lane, const PartPoints& points, std::uint32_t seed) {
  kept_[lane] = {points.numbers(), seed};
  for (std::uint32_t& index : kept_[lane].reversedIndices) index = reverseBits(index);
}

/// The points that lie on one source; whether there are any.
LUMEL_FOR_EACH_CPU bool WavePoints::locate(const Source& from, std::uint32_t number, const Places& places,
                                           Drawn& drawn) {
  std::uint32_t any = 0;
  for (std::uint32_t i = 0; i < kMost; ++i) any |= places.source[i] == number ? 1u : 0u;
  if (any == 0) return false;
  const Vec3 p0 = from.p0, e1 = from.e1, e2 = from.e2, ng = from.ng;
  const float distance = from.offsetMeters;
  for (std::uint32_t i = 0; i < kMost; ++i) {
    const bool here = places.source[i] == number;
    const Vec3 fromFirst = places.x[i] * e1 + places.y[i] * e2;
    const Vec3 p = p0 + fromFirst;
    const Vec3 start = p + rayOffset(ng, e1 + e2 - 3.0f * fromFirst, distance);
    for (int k = 0; k < 3; ++k) {
      drawn.p[k][i] = pick(here, p[k], drawn.p[k][i]);
      drawn.rayStart[k][i] = pick(here, start[k], drawn.rayStart[k][i]);
    }
  }
  return true;
}

/// As frameFromTangent of the interpolated normal and tangent, without branches.
LUMEL_FOR_EACH_CPU void WavePoints::locateFrames(const Source& from, std::uint32_t number, const Places& places,
                                                 Drawn& drawn) {
  const std::array<Vec3, 3> normals = from.normals;
  const std::array<Vec4, 3> tangents = from.tangents;
  const Vec3 ng = from.ng;
  // A chart never mixes handedness, so neither does a triangle.
  const float hand = tangents[0].w < 0.0f ? -1.0f : 1.0f;
  constexpr float kMostFinite = std::numeric_limits<float>::max();
  for (std::uint32_t i = 0; i < kMost; ++i) {
    const bool here = places.source[i] == number;
    const float w1 = places.x[i], w2 = places.y[i];
    const float w0 = 1.0f - w1 - w2;
    const Vec3 normal = w0 * normals[0] + w1 * normals[1] + w2 * normals[2];
    const float length = directedLength(normal);
    const bool isDirected = length > 0.0f;
    const Vec3 n = pick(isDirected, normal * (1.0f / pick(isDirected, length, 1.0f)), ng);
    const Vec3 raw = w0 * Vec3(tangents[0]) + w1 * Vec3(tangents[1]) + w2 * Vec3(tangents[2]);
    const Vec3 side = raw - n * glm::dot(n, raw);
    const float side2 = glm::dot(side, side);
    const bool isFrame = (side2 > 1e-12f * glm::dot(raw, raw)) & (side2 <= kMostFinite);
    const float unit = 1.0f / std::sqrt(pick(isFrame, side2, 1.0f));
    const Frame any = frameAround(n);
    const Vec3 t = pick(isFrame, side * unit, any.t);
    const float turn = pick(isFrame, hand, 1.0f);
    const Vec3 b = turn * glm::cross(n, t);
    for (int k = 0; k < 3; ++k) {
      drawn.t[k][i] = pick(here, t[k], drawn.t[k][i]);
      drawn.b[k][i] = pick(here, b[k], drawn.b[k][i]);
      drawn.n[k][i] = pick(here, n[k], drawn.n[k][i]);
      drawn.ng[k][i] = pick(here, ng[k], drawn.ng[k][i]);
      drawn.lift[k][i] = pick(here, 0.0f, drawn.lift[k][i]);
    }
  }
}

/// Rays from a rounded source that go below its facet start over it (liftToRound).
LUMEL_FOR_EACH_CPU void WavePoints::lift(const Source& from, std::uint32_t number, const Places& places, Drawn& drawn) {
  const std::array<Vec3, 3> normals = from.normals;
  const Vec3 ng = from.ng, e1 = from.e1, e2 = from.e2;
  const float distance = from.offsetMeters, rounded = from.rounded;
  for (std::uint32_t i = 0; i < kMost; ++i) {
    const float w1 = places.x[i], w2 = places.y[i];
    const Vec3 move = rounded * liftToRound(w1 * e1 + w2 * e2, e1, e2, {w1, w2}, normals);
    const bool lifted = (places.source[i] == number) & isLifted(move, ng, distance);
    for (int k = 0; k < 3; ++k) {
      drawn.lift[k][i] = pick(lifted, move[k], drawn.lift[k][i]);
    }
  }
}

void WavePoints::draw(const std::array<TexelSampler, kLanes>& samplers, std::uint32_t pattern, std::uint32_t first,
                      std::uint32_t count) {
  LUMEL_CHECK(count >= 1 && count <= kMost && (count & (count - 1)) == 0);
  mask_ = count - 1;
  alignas(64) std::uint32_t reversedIndices[kMost];
  for (std::uint32_t i = 0; i < kMost; ++i) reversedIndices[i] = reverseBits(first + i);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (!active_[lane]) continue;
    Places& places = places_[lane];
    const std::span pieces = std::span(pieces_).subspan(firstPiece_[lane], firstPiece_[lane + 1] - firstPiece_[lane]);
    const std::uint32_t seed = samplers[lane].seedOf(pattern);
    if (const std::vector<std::uint32_t>& own = kept_[lane].reversedIndices; !own.empty()) {
      alignas(64) std::uint32_t chosen[kMost];
      for (std::uint32_t i = 0; i < kMost; ++i) chosen[i] = own[(seed + first + i) % own.size()];
      choose(pieces, static_cast<float>(areas_[lane]), kept_[lane].seed, chosen, places);
    } else if (pieces.size() == 1 && pieces[0].isSquare) {
      chooseInSquare(pieces[0], seed, reversedIndices, places);
    } else {
      choose(pieces, static_cast<float>(areas_[lane]), seed, reversedIndices, places);
    }
    for (std::uint32_t s = firstSource_[lane]; s < firstSource_[lane + 1]; ++s) {
      const Source& source = sources_[s];
      if (!locate(source, s, places, drawn_[lane]) || !turns_[lane]) continue;
      locateFrames(source, s, places, drawn_[lane]);
      if (source.rounded > 0.0f) lift(source, s, places, drawn_[lane]);
    }
  }
  turnToLanes(drawn_.data(), turning_, p_.data(), rayStarts_.data(), surfaces_.data());
}

/// From points by texel to texels by point.
LUMEL_FOR_EACH_CPU void WavePoints::turnToLanes(const Drawn* drawn, bool turning, Vec3Lanes* p, Vec3Lanes* rayStarts,
                                                SurfaceLanes* surfaces) {
  const auto turn = [&](float(Drawn::*member)[3][kMost], auto lanesOf) {
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t first = 0; first < kMost; first += 8) {
        std::array<LaneWords, 8> columns;
        turnRows<8>([&](std::size_t lane) { return &(drawn[lane].*member)[k][first]; }, columns);
        for (std::size_t i = 0; i < 8; ++i) {
          Vec3Lanes& to = lanesOf(first + i);
          std::memcpy(k == 0 ? to.x : k == 1 ? to.y : to.z, &columns[i], sizeof to.x);
        }
      }
  };
  turn(&Drawn::p, [&](std::size_t i) -> Vec3Lanes& { return p[i]; });
  turn(&Drawn::rayStart, [&](std::size_t i) -> Vec3Lanes& { return rayStarts[i]; });
  if (!turning) return;
  turn(&Drawn::t, [&](std::size_t i) -> Vec3Lanes& { return surfaces[i].frame.t; });
  turn(&Drawn::b, [&](std::size_t i) -> Vec3Lanes& { return surfaces[i].frame.b; });
  turn(&Drawn::n, [&](std::size_t i) -> Vec3Lanes& { return surfaces[i].frame.n; });
  turn(&Drawn::ng, [&](std::size_t i) -> Vec3Lanes& { return surfaces[i].ng; });
  turn(&Drawn::lift, [&](std::size_t i) -> Vec3Lanes& { return surfaces[i].lift; });
}

PlaceOnTriangle WavePoints::place(std::size_t lane, std::uint32_t i) const {
  const Places& places = places_[lane];
  const std::uint32_t at = i & mask_;
  return {sources_[places.source[at]].triangle, {places.x[at], places.y[at]}};
}

}  // namespace lumel
