#include "lightmap/atlas/scene_uvs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lightmap/atlas/uv_points.h"

namespace lumel {
namespace {

constexpr std::size_t kUvSet = 1;
constexpr float kRangeTolerance = 1e-5f;  // of the page: rounding of normalised 16-bit UVs
constexpr double kOverlapShare = 0.001;
constexpr double kAllowedOverlapTexels = 16.0;
constexpr double kLostSurfaceShare = 0.01;  // surface that the UVs leave without area

bool tolerable(double overlapTexels, double coveredTexels) {
  return overlapTexels <= std::max(kAllowedOverlapTexels, kOverlapShare * coveredTexels);
}

bool hasLightmapUvs(const Primitive& primitive) {
  return primitive.uvSets.size() > kUvSet && primitive.uvSets[kUvSet].size() == primitive.positions.size();
}

/// The triangles in texels of a page that TEXCOORD_1 is taken to fill.
using TexelTriangles = std::vector<std::array<Vec2d, 3>>;

TexelTriangles trianglesOf(const Scene& scene, const Instance& instance, int pageSize) {
  TexelTriangles triangles;
  for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
    if (!receivesLight(scene, instance, primitive)) continue;
    const std::vector<Vec2>& uvs = primitive.uvSets[kUvSet];
    for (std::size_t i = 0; i < primitive.indices.size(); i += 3) {
      const Vec2d a(uvs[primitive.indices[i]]), b(uvs[primitive.indices[i + 1]]), c(uvs[primitive.indices[i + 2]]);
      const auto size = static_cast<double>(pageSize);
      if (signedArea(a, b, c) != 0) triangles.push_back({a * size, b * size, c * size});
    }
  }
  return triangles;
}

/// Counts vertices off the page and triangles that lose their area. Returns the share of the surface that is lost.
double checkNumbers(const Scene& scene, const Instance& instance, UvReport& report) {
  double surface = 0, lost = 0;
  for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
    if (!receivesLight(scene, instance, primitive)) continue;
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
      if (signedArea(uv[0], uv[1], uv[2]) != 0 || !(area > 0)) continue;
      ++report.zeroAreaTriangles;
      lost += area;
    }
  }
  return surface > 0 ? lost / surface : 0.0;
}

UvReport examine(const Scene& scene, const Instance& instance, int pageSize) {
  UvReport report;
  report.mesh = instance.name;
  report.present = true;
  for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives)
    if (receivesLight(scene, instance, primitive)) report.present = report.present && hasLightmapUvs(primitive);
  if (!report.present) return report;
  const double lostShare = checkNumbers(scene, instance, report);
  if (report.outOfRangeVertices > 0) return report;
  const TexelTriangles triangles = trianglesOf(scene, instance, pageSize);
  UvPoints points(pageSize, pageSize);
  Vec2d least(pageSize), most(0.0);
  for (const std::array<Vec2d, 3>& uv : triangles) {
    points.forEach(uv, [&](std::size_t i) {
      (points.test(i) ? report.overlapTexels : report.coveredTexels) += UvPoints::kTexelsPerPoint;
      points.set(i);
    });
    for (const Vec2d& q : uv) {
      least = glm::min(least, q);
      most = glm::max(most, q);
    }
  }
  report.extentTexels = triangles.empty() ? 0.0 : std::max(most.x - least.x, most.y - least.y);
  report.valid = !triangles.empty() && !report.isTooNarrow() && lostShare <= kLostSurfaceShare &&
                 tolerable(report.overlapTexels, report.coveredTexels);
  return report;
}

/// The first page, up to number `most`, on which the triangles lie on no others; they are marked there. -1: none.
int takePage(const TexelTriangles& triangles, double coveredTexels, int most, int pageSize,
             std::vector<UvPoints>& pages) {
  for (int page = 0; page <= most; ++page) {
    if (static_cast<std::size_t>(page) == pages.size()) pages.emplace_back(pageSize, pageSize);
    UvPoints& points = pages[static_cast<std::size_t>(page)];
    double taken = 0;
    for (const auto& uv : triangles)
      points.forEach(uv, [&](std::size_t i) { taken += points.test(i) ? UvPoints::kTexelsPerPoint : 0.0; });
    if (!tolerable(taken, coveredTexels)) continue;
    for (const auto& uv : triangles) points.forEach(uv, [&points](std::size_t i) { points.set(i); });
    return page;
  }
  return -1;
}

}  // namespace

bool receivesLight(const Scene& scene, const Instance& instance, const Primitive& primitive) {
  if (!instance.settings.receives || primitive.indices.empty()) return false;
  const Material& material = scene.materials[static_cast<std::size_t>(primitive.material)];
  const bool invisible = material.alphaMode == AlphaMode::Blend && !(material.baseColor.w > 0);
  return !material.unlit && !invisible;
}

std::vector<int> receiversOf(const Scene& scene) {
  std::vector<int> receivers;
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    const auto& primitives = scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives;
    if (std::any_of(primitives.begin(), primitives.end(),
                    [&](const Primitive& p) { return receivesLight(scene, instance, p); }))
      receivers.push_back(static_cast<int>(i));
  }
  return receivers;
}

SceneUvs examineSceneUvs(const Scene& scene, const std::vector<int>& receivers, const AtlasOptions& options) {
  SceneUvs result;
  for (const int index : receivers) result.uses.push_back({index, false, 0, -1});
  if (options.uvSource == UvSource::Generate) return result;
  constexpr int kUnknown = -2, kNone = -1;
  std::vector<int> reportOfMesh(scene.meshes.size(), kUnknown);
  for (SceneUvUse& use : result.uses) {
    const Instance& instance = scene.instances[static_cast<std::size_t>(use.instance)];
    int& known = reportOfMesh[static_cast<std::size_t>(instance.mesh)];
    if (known == kUnknown) {
      known = kNone;
      UvReport report = examine(scene, instance, options.pageSize);
      if (report.present || options.uvSource == UvSource::Scene) {
        known = static_cast<int>(result.reports.size());
        result.reports.push_back(std::move(report));
      }
    }
    use.report = known;
    if (known == kNone) continue;
    UvReport& report = result.reports[static_cast<std::size_t>(known)];
    ++report.instances;
    use.used = report.valid || (report.present && options.uvSource == UvSource::AsGiven);
  }
  result.perObject = options.uvSource == UvSource::Object;
  if (result.perObject) return result;
  std::vector<UvPoints> pages;
  for (SceneUvUse& use : result.uses) {
    if (!use.used) continue;
    const Instance& instance = scene.instances[static_cast<std::size_t>(use.instance)];
    use.page =
        takePage(trianglesOf(scene, instance, options.pageSize),
                 result.reports[static_cast<std::size_t>(use.report)].coveredTexels,
                 options.uvSource == UvSource::Auto ? 0 : std::numeric_limits<int>::max(), options.pageSize, pages);
    if (use.page >= 0) continue;
    result.perObject = true;
    return result;
  }
  result.pageCount = static_cast<int>(pages.size());
  return result;
}

std::string describeUvChoice(const SceneUvs& uvs, UvSource source) {
  std::size_t used = 0;
  for (const SceneUvUse& use : uvs.uses) used += use.used ? 1u : 0u;
  const auto objects = [](std::size_t n) { return std::to_string(n) + (n == 1 ? " object" : " objects"); };
  const std::size_t others = uvs.uses.size() - used;
  const std::string rest = others > 0 ? "; charts are generated for " + objects(others) : "";
  if (used == 0) return "charts are generated for " + objects(others);
  if (!uvs.perObject)
    return "TEXCOORD_1 of " + objects(used) + " is the place on " +
           (uvs.pageCount == 1 ? "one page" : std::to_string(uvs.pageCount) + " pages") + rest;
  return "TEXCOORD_1 of " + objects(used) + " is " + (used == 1 ? "its" : "each object's") +
         " own and gets a rectangle for each" +
         (source == UvSource::Auto ? ", since the UVs of different objects overlap (--uv scene: pages as given)" : "") +
         rest;
}

}  // namespace lumel
