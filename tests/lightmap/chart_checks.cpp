#include "tests/lightmap/chart_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace lumel {
namespace {

/// Calls visit(x, y) for the points (x + 0.5, y + 0.5) inside the triangle; points on an edge belong to one side.
template <class Visit>
void forEachCentre(const std::array<Vec2d, 3>& p, Visit visit) {
  const double low = std::min({p[0].y, p[1].y, p[2].y});
  const double high = std::max({p[0].y, p[1].y, p[2].y});
  for (int y = static_cast<int>(std::ceil(low - 0.5)); y < std::ceil(high - 0.5); ++y) {
    double left = 1e300, right = -1e300;
    for (std::size_t k = 0; k < 3; ++k) {
      Vec2d a = p[k];
      Vec2d b = p[(k + 1) % 3];
      if (a.y > b.y) std::swap(a, b);
      if (!(a.y <= y + 0.5 && y + 0.5 < b.y)) continue;
      const double x = a.x + (y + 0.5 - a.y) / (b.y - a.y) * (b.x - a.x);
      left = std::min(left, x);
      right = std::max(right, x);
    }
    for (int x = static_cast<int>(std::ceil(left - 0.5)); left < right && x < std::ceil(right - 0.5); ++x) visit(x, y);
  }
}

}  // namespace

AtlasFigures measureAtlas(const Atlas& atlas) {
  constexpr int kPoints = 4;
  AtlasFigures f;
  f.charts = atlas.charts.size();
  std::vector<double> surface(atlas.charts.size(), 0), texels(atlas.charts.size(), 0);
  std::vector<std::vector<std::uint8_t>> hits;
  for (const Page& page : atlas.pages)
    hits.emplace_back(static_cast<std::size_t>(page.width * page.height * kPoints * kPoints), 0);
  std::vector<std::pair<double, double>> stretch;  // value, area
  for (const Surface& s : atlas.surfaces) {
    const Page& page = atlas.pages[static_cast<std::size_t>(s.page)];
    const Vec2d size(page.width, page.height);
    for (const Vec2& uv : s.lightmapUvs) f.outside += !(uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1);
    for (const Vec4& t : s.tangents) f.mirroredTangents += t.w != 1.0f;
    for (std::size_t t = 0; t < s.triangleCount(); ++t) {
      ++f.triangles;
      std::array<Vec2d, 3> uv;
      std::array<Vec3d, 3> p;
      for (std::size_t k = 0; k < 3; ++k) {
        uv[k] = Vec2d(s.lightmapUvs[s.indices[3 * t + k]]) * size;
        p[k] = Vec3d(s.positions[s.indices[3 * t + k]]);
      }
      const Vec2d e1 = uv[1] - uv[0], e2 = uv[2] - uv[0];
      const double area2 = -(e1.x * e2.y - e1.y * e2.x);  // rows run down: positive where not mirrored
      const double longest = std::sqrt(std::max({glm::dot(e1, e1), glm::dot(e2, e2), glm::dot(e2 - e1, e2 - e1)}));
      // A float UV on this page is known to 6e-8 of its side; twice that for a difference, with a margin.
      f.flipped += area2 < -4e-7 * page.width * longest;
      const Vec3d a = p[1] - p[0], b = p[2] - p[0];
      const double world2 = glm::length(glm::cross(a, b));
      surface[s.charts[t]] += world2 / 2;
      texels[s.charts[t]] += std::abs(area2) / 2;
      if (world2 > 0 && area2 > 0) {
        const double x1 = glm::length(a), x2 = glm::dot(a, b) / x1, y2 = world2 / x1;
        const double density = atlas.texelsPerMeter;
        const Vec2d jx = e1 / (x1 * density);
        const Vec2d jy = (e2 / density - jx * x2) / y2;
        const double trace = glm::dot(jx, jx) + glm::dot(jy, jy);
        const double det = std::abs(jx.x * jy.y - jx.y * jy.x);
        const double big = std::sqrt((trace + std::sqrt(std::max(0.0, trace * trace - 4 * det * det))) / 2);
        stretch.push_back({std::max(big, big / det), world2});
      }
      for (Vec2d& q : uv) q *= kPoints;
      forEachCentre(uv, [&](int x, int y) {
        if (x < 0 || y < 0 || x >= page.width * kPoints || y >= page.height * kPoints) return;
        std::uint8_t& hit =
            hits[static_cast<std::size_t>(s.page)][static_cast<std::size_t>(y * page.width * kPoints + x)];
        f.coveredTexels += 1.0 / (kPoints * kPoints);
        if (hit) f.overlapTexels += 1.0 / (kPoints * kPoints);
        hit = 1;
      });
    }
  }
  f.minDensity = 1e300;
  for (std::size_t c = 0; c < surface.size(); ++c) {
    f.surface += surface[c];
    const double density = std::sqrt(texels[c] / surface[c]);
    f.minDensity = std::min(f.minDensity, density);
    f.maxDensity = std::max(f.maxDensity, density);
  }
  std::sort(stretch.begin(), stretch.end());
  double total = 0, sum = 0;
  for (const auto& s : stretch) total += s.second;
  for (const auto& s : stretch) {
    sum += s.second;
    f.worstStretch = s.first;
    if (sum >= 0.99 * total) break;
  }
  return f;
}

Scene sceneOf(std::vector<Vec3> positions, std::vector<std::uint32_t> indices, std::vector<Vec3> normals) {
  Scene scene;
  scene.materials.emplace_back();
  Primitive primitive;
  primitive.name = "mesh 'test' primitive 0";
  if (normals.empty()) {  // flat, as the loader makes them
    for (std::size_t i = 0; i < indices.size(); i += 3) {
      const Vec3d a(positions[indices[i]]), b(positions[indices[i + 1]]), c(positions[indices[i + 2]]);
      const Vec3d n = glm::cross(b - a, c - a);
      const double length = glm::length(n);
      for (std::size_t k = 0; k < 3; ++k) {
        primitive.indices.push_back(static_cast<std::uint32_t>(primitive.positions.size()));
        primitive.positions.push_back(positions[indices[i + k]]);
        primitive.normals.push_back(length > 0 ? Vec3(n / length) : Vec3(0, 0, 1));
      }
    }
  } else {
    primitive.positions = std::move(positions);
    primitive.normals = std::move(normals);
    primitive.indices = std::move(indices);
  }
  scene.meshes.push_back({"test", {std::move(primitive)}});
  Instance instance;
  instance.name = "test";
  scene.instances.push_back(instance);
  return scene;
}

AtlasResult chartsOf(const Scene& scene, float texelsPerMeter, int pageSize) {
  AtlasOptions options;
  options.uvSource = UvSource::Generate;
  options.texelsPerMeter = texelsPerMeter;
  options.pageSize = pageSize;
  Progress progress;
  Expected<AtlasResult> result = buildAtlas(scene, options, progress);
  if (!result) {
    ADD_FAILURE() << result.error().message;
    return {};
  }
  return std::move(*result);
}

Scene terrain(int cells, double side) {
  std::vector<Vec3> positions, normals;
  std::vector<std::uint32_t> indices;
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x) {
      const double u = side * x / cells, v = side * y / cells;
      positions.push_back(
          Vec3(u, v, 3 * std::sin(0.11 * u) * std::cos(0.13 * v) + 0.8 * std::sin(0.43 * u + 1) * std::sin(0.37 * v)));
      const double du =
          0.33 * std::cos(0.11 * u) * std::cos(0.13 * v) + 0.344 * std::cos(0.43 * u + 1) * std::sin(0.37 * v);
      const double dv =
          -0.39 * std::sin(0.11 * u) * std::sin(0.13 * v) + 0.296 * std::sin(0.43 * u + 1) * std::cos(0.37 * v);
      normals.push_back(Vec3(glm::normalize(Vec3d(-du, -dv, 1))));
    }
  const auto at = [cells](int x, int y) { return static_cast<std::uint32_t>(y * (cells + 1) + x); };
  for (int y = 0; y < cells; ++y)
    for (int x = 0; x < cells; ++x)
      for (const std::uint32_t i : {at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y), at(x + 1, y + 1), at(x, y + 1)})
        indices.push_back(i);
  return sceneOf(std::move(positions), std::move(indices), std::move(normals));
}

}  // namespace lumel
