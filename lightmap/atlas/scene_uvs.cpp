#include "lightmap/atlas/scene_uvs.h"

#include <algorithm>
#include <cmath>

#include "lightmap/atlas/uv_points.h"

namespace lumel {
namespace {

constexpr std::size_t kUvSet = 1;
constexpr float kRangeTolerance = 1e-5f;  // of the page: rounding of normalised 16-bit UVs
constexpr double kOverlapShare = 0.001;
constexpr double kAllowedOverlapTexels = 16.0;
constexpr double kLostSurfaceShare = 0.01;  // surface that the UVs leave without area

struct Examination {
  UvReport report;
  std::vector<std::array<Vec2d, 3>> triangles;  // texels
};

bool tolerable(double overlapTexels, double coveredTexels) {
  return overlapTexels <= std::max(kAllowedOverlapTexels, kOverlapShare * coveredTexels);
}

Examination examine(const Scene& scene, const Instance& instance, int pageSize) {
  Examination result;
  UvReport& report = result.report;
  report.mesh = instance.name;
  report.present = true;
  double surface = 0, lost = 0;
  for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
    if (!receivesLight(scene, instance, primitive) || primitive.indices.empty()) continue;
    if (primitive.uvSets.size() <= kUvSet || primitive.uvSets[kUvSet].size() != primitive.positions.size()) {
      report.present = false;
      return result;
    }
    const std::vector<Vec2>& uvs = primitive.uvSets[kUvSet];
    for (const Vec2& uv : uvs)
      if (!(uv.x >= -kRangeTolerance && uv.x <= 1 + kRangeTolerance && uv.y >= -kRangeTolerance &&
            uv.y <= 1 + kRangeTolerance))
        ++report.outOfRangeVertices;  // NaN too
    for (std::size_t t = 0; t < primitive.triangleCount(); ++t) {
      std::array<Vec2d, 3> uv;
      std::array<Vec3d, 3> p;
      for (std::size_t k = 0; k < 3; ++k) {
        uv[k] = uvs[primitive.indices[3 * t + k]];
        p[k] = Vec3d(instance.worldFromObject * Vec4(primitive.positions[primitive.indices[3 * t + k]], 1.0f));
      }
      const double area = triangleArea(p[0], p[1], p[2]);
      surface += area;
      if (signedArea(uv[0], uv[1], uv[2]) != 0) {
        for (Vec2d& q : uv) q *= static_cast<double>(pageSize);
        result.triangles.push_back(uv);
      } else if (area > 0) {
        ++report.zeroAreaTriangles;
        lost += area;
      }
    }
  }
  if (report.outOfRangeVertices > 0) return result;
  UvPoints points(pageSize, pageSize);
  for (const std::array<Vec2d, 3>& uv : result.triangles)
    points.forEach(uv, [&](std::size_t i) {
      if (points.test(i))
        report.overlapTexels += UvPoints::kTexelsPerPoint;
      else
        report.coveredTexels += UvPoints::kTexelsPerPoint;
      points.set(i);
    });
  Vec2d least(pageSize), most(0.0);
  for (const std::array<Vec2d, 3>& uv : result.triangles)
    for (const Vec2d& q : uv) {
      least = glm::min(least, q);
      most = glm::max(most, q);
    }
  report.extentTexels = result.triangles.empty() ? 0.0 : std::max(most.x - least.x, most.y - least.y);
  report.valid = !result.triangles.empty() && !report.isTooNarrow() && lost <= kLostSurfaceShare * surface &&
                 tolerable(report.overlapTexels, report.coveredTexels);
  return result;
}

}  // namespace

bool receivesLight(const Scene& scene, const Instance& instance, const Primitive& primitive) {
  if (!instance.settings.receives || primitive.indices.empty()) return false;
  const Material& material = scene.materials[static_cast<std::size_t>(primitive.material)];
  const bool invisible = material.alphaMode == AlphaMode::Blend && !(material.baseColor.w > 0);
  return !material.unlit && !invisible;
}

SceneUvs examineSceneUvs(const Scene& scene, const std::vector<int>& receivers, const AtlasOptions& options) {
  SceneUvs result;
  std::vector<UvPoints> pages;
  for (const int index : receivers) {
    const Instance& instance = scene.instances[static_cast<std::size_t>(index)];
    SceneUvUse use{index, false, 0, -1};
    if (options.uvSource != UvSource::Generate) {
      Examination examined = examine(scene, instance, options.pageSize);
      if (examined.report.present || options.uvSource == UvSource::Scene) {
        use.report = static_cast<int>(result.reports.size());
        result.reports.push_back(examined.report);
      }
      if (examined.report.valid || (examined.report.present && options.uvSource == UvSource::AsGiven)) {
        use.used = true;
        for (;; ++use.page) {
          if (static_cast<std::size_t>(use.page) == pages.size())
            pages.emplace_back(options.pageSize, options.pageSize);
          UvPoints& page = pages[static_cast<std::size_t>(use.page)];
          double taken = 0;
          for (const auto& uv : examined.triangles)
            page.forEach(uv, [&](std::size_t i) { taken += page.test(i) ? UvPoints::kTexelsPerPoint : 0.0; });
          if (!tolerable(std::max(0.0, taken), examined.report.coveredTexels)) continue;
          for (const auto& uv : examined.triangles) page.forEach(uv, [&page](std::size_t i) { page.set(i); });
          break;
        }
      }
    }
    result.uses.push_back(use);
  }
  result.pageCount = static_cast<int>(pages.size());
  return result;
}

}  // namespace lumel
