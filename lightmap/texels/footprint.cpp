// TexelFootprint of texels.h: a texel's square clipped by its triangles, and points on what is left.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "lightmap/raster.h"
#include "lightmap/texels/texels.h"
#include "lightmap/texels/vertex_normal.h"
#include "scene/base/check.h"

namespace lumel {
namespace {

/// A convex polygon of at most 7 corners: a triangle cut by a square.
struct Polygon {
  std::array<Vec2d, 8> corners;
  std::size_t count = 0;
  void add(const Vec2d& p) { corners[count++] = p; }
};

double cross(const Vec2d& a, const Vec2d& b) { return a.x * b.y - a.y * b.x; }

/// Sutherland and Hodgman 1974, for one side of the square: keeps what has sign * (coordinate - limit) >= 0. The new
/// corner lies on the side exactly.
Polygon clipSide(const Polygon& in, int axis, double limit, double sign) {
  Polygon out;
  for (std::size_t i = 0; i < in.count; ++i) {
    const Vec2d& a = in.corners[i];
    const Vec2d& b = in.corners[i + 1 < in.count ? i + 1 : 0];
    const double da = sign * (a[axis] - limit);
    const double db = sign * (b[axis] - limit);
    if (da >= 0) out.add(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
      Vec2d corner = a + (b - a) * (da / (da - db));
      corner[axis] = limit;
      out.add(corner);
    }
  }
  return out;
}

/// Whether the texel lies inside of the triangle as a whole: its centre on the inner side of each edge, by half of the
/// square's extent across it.
bool covers(const std::array<Vec2d, 3>& t, const Vec2d& centre) {
  const double sign = cross(t[1] - t[0], t[2] - t[0]) < 0 ? -1 : 1;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec2d edge = t[i < 2 ? i + 1 : 0] - t[i];
    if (!(sign * cross(edge, centre - t[i]) >= 0.5 * (std::abs(edge.x) + std::abs(edge.y)))) return false;
  }
  return true;
}

Polygon clipToTexel(const std::array<Vec2d, 3>& triangle, TexelCoord texel) {
  Polygon polygon;
  for (const Vec2d& p : triangle) polygon.add(p);
  const Vec2d least = glm::min(glm::min(triangle[0], triangle[1]), triangle[2]);
  const Vec2d most = glm::max(glm::max(triangle[0], triangle[1]), triangle[2]);
  for (int axis = 0; axis < 2; ++axis) {
    const double from = axis == 0 ? texel.x : texel.y;
    if (least[axis] < from) polygon = clipSide(polygon, axis, from, 1);
    if (most[axis] > from + 1) polygon = clipSide(polygon, axis, from + 1, -1);
  }
  return polygon;
}

/// Weights of vertices 1 and 2 for p, kept inside the triangle against rounding.
Vec2 barycentricOf(const TexelFootprint::Source& source, const Vec2d& p) {
  const Vec2d fromFirst = p - source.texels[0];
  const double w1 = std::clamp(glm::dot(fromFirst, source.perTexel1), 0.0, 1.0);
  const double w2 = std::clamp(glm::dot(fromFirst, source.perTexel2), 0.0, 1.0 - w1);
  return {static_cast<float>(w1), static_cast<float>(w2)};
}

Vec2d closestOnSegment(const Vec2d& a, const Vec2d& b, const Vec2d& p) {
  const Vec2d ab = b - a;
  const double length2 = glm::dot(ab, ab);
  return length2 > 0 ? a + ab * std::clamp(glm::dot(p - a, ab) / length2, 0.0, 1.0) : a;
}

Vec2d closestInTriangle(const std::array<Vec2d, 3>& t, const Vec2d& p) {
  const double sign = cross(t[1] - t[0], t[2] - t[0]) < 0 ? -1 : 1;
  bool inside = true;
  Vec2d best = t[0];
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec2d& a = t[i];
    const Vec2d& b = t[(i + 1) % 3];
    inside = inside && sign * cross(b - a, p - a) >= 0;
    const Vec2d q = closestOnSegment(a, b, p);
    if (glm::dot(q - p, q - p) < glm::dot(best - p, best - p)) best = q;
  }
  return inside ? p : best;
}

/// Unit vector, or `fallback` where v has no direction.
Vec3 unitOr(const Vec3d& v, const Vec3& fallback) {
  const double length = std::sqrt(glm::dot(v, v));
  return length > 1e-150 && std::isfinite(length) ? Vec3(v / length) : fallback;
}

/// Follows the winding in space; a triangle without area there takes its first vertex normal.
Vec3 geometricNormalOf(const Surface& surface, const std::array<std::uint32_t, 3>& v) {
  const Vec3d p0(surface.positions[v[0]]);
  const Vec3d normal = glm::cross(Vec3d(surface.positions[v[1]]) - p0, Vec3d(surface.positions[v[2]]) - p0);
  return unitOr(normal, unitOr(Vec3d(surface.normals[v[0]]), Vec3(0, 0, 1)));
}

}  // namespace

TexelFootprint::Source TexelFootprint::sourceOf(const TriangleRef& ref) const {
  const Surface& surface = atlas_->surfaces[ref.surface];
  Source source;
  source.triangle = ref;
  for (std::size_t i = 0; i < 3; ++i) {
    source.vertices[i] = surface.indices[std::size_t{3} * ref.triangle + i];
    source.texels[i] = snapToTexelBorder(Vec2d(surface.lightmapUvs[source.vertices[i]]) * Vec2d(width_, height_));
  }
  const Vec2d e1 = source.texels[1] - source.texels[0], e2 = source.texels[2] - source.texels[0];
  const double perTwiceArea = 1.0 / cross(e1, e2);
  source.perTexel1 = perTwiceArea * Vec2d(e2.y, -e2.x);
  source.perTexel2 = perTwiceArea * Vec2d(-e1.y, e1.x);
  source.geometricNormal = geometricNormalOf(surface, source.vertices);
  return source;
}

double TexelFootprint::clip(const Atlas& atlas, const PageTexels& page, std::size_t texel) {
  // Neighbours share triangles.
  std::swap(sources_, before_);
  if (atlas_ != &atlas || width_ != page.width || height_ != page.height) before_.clear();
  atlas_ = &atlas;
  width_ = page.width;
  height_ = page.height;
  sources_.clear();
  pieces_.clear();
  area_ = 0.0;
  auto known = before_.begin();
  for (const TriangleRef& ref : page.trianglesOf(texel)) {
    // Both are in order.
    while (known != before_.end() && known->triangle < ref) ++known;
    const auto source = static_cast<std::uint32_t>(sources_.size());
    sources_.push_back(known != before_.end() && known->triangle == ref ? *known : sourceOf(ref));
    const Vec2d corner(page.coords[texel].x, page.coords[texel].y);
    if (covers(sources_.back().texels, corner + 0.5)) {
      const std::array<Vec2, 3> barycentrics = {barycentricOf(sources_.back(), corner),
                                                barycentricOf(sources_.back(), corner + Vec2d(1, 0)),
                                                barycentricOf(sources_.back(), corner + Vec2d(0, 1))};
      pieces_.push_back({source, barycentrics, area_, 1.0, true});
      area_ += 1.0;
      continue;
    }
    const Polygon polygon = clipToTexel(sources_.back().texels, page.coords[texel]);
    if (polygon.count < 3) {
      sources_.pop_back();
      continue;
    }
    std::array<Vec2, 8> barycentrics;
    for (std::size_t i = 0; i < polygon.count; ++i)
      barycentrics[i] = barycentricOf(sources_.back(), polygon.corners[i]);
    for (std::size_t i = 2; i < polygon.count; ++i) {
      const Vec2d& first = polygon.corners[0];
      const double area = 0.5 * std::abs(cross(polygon.corners[i - 1] - first, polygon.corners[i] - first));
      if (!(area > 0)) continue;
      pieces_.push_back({source, {barycentrics[0], barycentrics[i - 1], barycentrics[i]}, area_, area, false});
      area_ += area;
    }
  }
  return area_;
}

SurfacePoint TexelFootprint::sample(Vec2 u) const {
  LUMEL_CHECK(!pieces_.empty());
  const double target = static_cast<double>(u.x) * area_;
  const auto next = std::upper_bound(pieces_.begin() + 1, pieces_.end(), target,
                                     [](double value, const Piece& piece) { return value < piece.areaBefore; });
  const Piece& piece = *(next - 1);
  // What is left of u.x within the piece is uniform again.
  const double r = std::clamp((target - piece.areaBefore) / piece.area, 0.0, 1.0);
  const std::array<Vec2, 3>& c = piece.barycentric;
  if (piece.isSquare) return pointOn(piece, c[0] + static_cast<float>(r) * (c[1] - c[0]) + u.y * (c[2] - c[0]));
  // (r, u.y) -> triangle preserves area: lines of constant r are parallel to the side opposite to corner 0, and the
  // triangle that they cut off at it has the share r.
  const auto reach = static_cast<float>(std::sqrt(r));
  return pointOn(piece, c[0] + reach * ((1.0f - u.y) * (c[1] - c[0]) + u.y * (c[2] - c[0])));
}

SurfacePoint TexelFootprint::centroid() const {
  LUMEL_CHECK(!pieces_.empty());
  const auto onPage = [&](const Piece& piece, const Vec2d& w) {
    const std::array<Vec2d, 3>& t = sources_[piece.source].texels;
    return t[0] + w.x * (t[1] - t[0]) + w.y * (t[2] - t[0]);
  };
  Vec2d mean(0);
  for (const Piece& piece : pieces_) mean += piece.area / area_ * onPage(piece, piece.middle());
  const Piece* nearest = nullptr;
  Vec2d nearestPoint(0);
  double leastDistance2 = std::numeric_limits<double>::infinity();
  for (const Piece& piece : pieces_) {
    const auto corner = [&](std::size_t i) { return onPage(piece, Vec2d(piece.barycentric[i])); };
    const Vec2d point = piece.isSquare ? mean : closestInTriangle({corner(0), corner(1), corner(2)}, mean);
    const double distance2 = glm::dot(point - mean, point - mean);
    if (distance2 >= leastDistance2) continue;
    leastDistance2 = distance2;
    nearest = &piece;
    nearestPoint = point;
  }
  return pointOn(*nearest, barycentricOf(sources_[nearest->source], nearestPoint));
}

SurfacePoint TexelFootprint::pointOn(const Piece& piece, Vec2 barycentric) const {
  const Source& source = sources_[piece.source];
  const Surface& surface = atlas_->surfaces[source.triangle.surface];
  const std::array<std::uint32_t, 3>& v = source.vertices;
  const float w1 = std::clamp(barycentric.x, 0.0f, 1.0f);
  const float w2 = std::clamp(barycentric.y, 0.0f, 1.0f - w1);
  const float w0 = 1.0f - w1 - w2;

  SurfacePoint point;
  point.triangle = source.triangle;
  point.barycentric = Vec3(w0, w1, w2);
  point.geometricNormal = source.geometricNormal;
  // Relative to one vertex and in double: far from the origin floats would cancel.
  const Vec3d p0(surface.positions[v[0]]);
  const Vec3d edge1 = Vec3d(surface.positions[v[1]]) - p0;
  const Vec3d edge2 = Vec3d(surface.positions[v[2]]) - p0;
  point.position = Vec3(p0 + static_cast<double>(w1) * edge1 + static_cast<double>(w2) * edge2);

  const Vec3 normal = w0 * surface.normals[v[0]] + w1 * surface.normals[v[1]] + w2 * surface.normals[v[2]];
  // A chart never mixes handedness, so neither does a triangle: the interpolated w keeps its sign.
  const Vec4 tangent = w0 * surface.tangents[v[0]] + w1 * surface.tangents[v[1]] + w2 * surface.tangents[v[2]];
  point.frame = frameFromTangent(unitNormalOr(normal, source.geometricNormal), tangent);
  return point;
}

}  // namespace lumel
