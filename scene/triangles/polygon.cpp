#include "scene/triangles/polygon.h"

#include <algorithm>
#include <numeric>

namespace lumel {
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

bool contains(const Vec2d& a, const Vec2d& b, const Vec2d& c, const Vec2d& p) {
  return signedArea(a, b, p) >= 0 && signedArea(b, c, p) >= 0 && signedArea(c, a, p) >= 0;
}

Triangles cutQuad(const std::vector<Vec2d>& p, std::span<const Vec3> corners) {
  const double smaller02 = std::min(signedArea(p[0], p[1], p[2]), signedArea(p[0], p[2], p[3]));
  const double smaller13 = std::min(signedArea(p[0], p[1], p[3]), signedArea(p[1], p[2], p[3]));
  const bool shorter02 =
      glm::distance(Vec3d(corners[0]), Vec3d(corners[2])) <= glm::distance(Vec3d(corners[1]), Vec3d(corners[3]));
  const bool use02 = smaller02 > 0 && smaller13 > 0 ? shorter02 : smaller02 >= smaller13;
  if (use02) return {{0, 1, 2}, {0, 2, 3}};
  return {{0, 1, 3}, {1, 2, 3}};
}

bool isEar(const std::vector<Vec2d>& p, const std::vector<std::uint32_t>& left, std::size_t i) {
  const std::size_t n = left.size();
  const std::uint32_t a = left[(i + n - 1) % n], b = left[i], c = left[(i + 1) % n];
  if (!(signedArea(p[a], p[b], p[c]) > 0)) return false;
  return std::none_of(left.begin(), left.end(), [&](std::uint32_t q) {
    return p[q] != p[a] && p[q] != p[b] && p[q] != p[c] && contains(p[a], p[b], p[c], p[q]);
  });
}

}  // namespace

Vec3d newellNormal(std::span<const Vec3> corners) {
  Vec3d normal(0);
  const Vec3d origin(corners[0]);
  for (std::size_t i = 0; i < corners.size(); ++i)
    normal += glm::cross(Vec3d(corners[i]) - origin, Vec3d(corners[(i + 1) % corners.size()]) - origin);
  return normal;
}

Triangles triangulatePolygon(std::span<const Vec3> corners) {
  if (corners.size() < 3) return {};
  if (corners.size() == 3) return {{0, 1, 2}};
  std::vector<std::uint32_t> left(corners.size());
  std::iota(left.begin(), left.end(), 0u);
  const Vec3d normal = newellNormal(corners);
  std::vector<Vec2d> flat(corners.size(), Vec2d(0));
  if (glm::length(normal) > 0) {
    const Frame frame = frameAround(Vec3(glm::normalize(normal)));
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec3d d = Vec3d(corners[i]) - Vec3d(corners[0]);
      flat[i] = {glm::dot(d, Vec3d(frame.t)), glm::dot(d, Vec3d(frame.b))};
    }
    if (corners.size() == 4) return cutQuad(flat, corners);
  }
  Triangles triangles;
  while (left.size() > 3) {
    std::size_t ear = 0;
    while (ear < left.size() && !isEar(flat, left, ear)) ++ear;
    if (ear == left.size()) break;
    const std::size_t n = left.size();
    triangles.push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  // One triangle, or what crosses itself: a fan.
  for (std::size_t i = 1; i + 1 < left.size(); ++i) triangles.push_back({left[0], left[i], left[i + 1]});
  return triangles;
}

}  // namespace lumel
