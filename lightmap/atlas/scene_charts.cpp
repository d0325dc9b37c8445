#include "lightmap/atlas/scene_charts.h"

#include <algorithm>
#include <array>
#include <compare>
#include <numeric>
#include <utility>

#include "lightmap/atlas/bake_frame.h"
#include "lightmap/atlas/scene_uvs.h"
#include "scene/base/union_find.h"

namespace lumel {
namespace {

struct UvVertex {
  std::pair<std::array<std::uint32_t, 3>, std::array<std::uint32_t, 2>> key;  // position, uv
  std::uint32_t index;                                                        // over all primitives
  auto operator<=>(const UvVertex&) const = default;
};

struct ChartFigures {
  double surface = 0, texels = 0;
  bool crossesFrame = false;
};

/// Vertices of all primitives, in order, with what the charts need of them.
struct Vertices {
  std::vector<UvVertex> vertices;
  std::vector<Vec4> frames;
  std::vector<std::uint32_t> base;  // first vertex of each primitive
};

Vertices gather(const Mesh& mesh) {
  Vertices all;
  for (const Primitive& primitive : mesh.primitives) {
    all.base.push_back(static_cast<std::uint32_t>(all.vertices.size()));
    const bool hasUvs = primitive.uvSets.size() > 1 && primitive.uvSets[1].size() == primitive.positions.size();
    for (std::size_t i = 0; i < primitive.positions.size(); ++i) {
      const Vec2 uv = hasUvs ? primitive.uvSets[1][i] : Vec2(0.0f);
      all.vertices.push_back(
          {{bitsOf(primitive.positions[i]), bitsOf(uv)}, static_cast<std::uint32_t>(all.vertices.size())});
      all.frames.push_back(hasMaterialFrame(primitive) ? primitive.tangents[i] : Vec4(0.0f));
    }
  }
  return all;
}

bool sameFrame(const Vec4& a, const Vec4& b) {
  if ((a.w == 0) != (b.w == 0)) return false;
  return a.w == 0 || (a.w * b.w > 0 && glm::dot(Vec3(a), Vec3(b)) >= kSameFrameCos);
}

}  // namespace

std::vector<PlacedTriangle> placeSceneUvs(const Scene& scene, int instanceIndex, const LightmapPlace& place,
                                          const Vec2d& pageSize, Atlas& atlas, UvReport& report) {
  const Instance& instance = scene.instances[static_cast<std::size_t>(instanceIndex)];
  const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
  Vertices all = gather(mesh);
  std::vector<std::uint32_t> parent(all.vertices.size());
  std::iota(parent.begin(), parent.end(), 0u);
  std::vector<bool> breaks(all.vertices.size(), false);
  std::sort(all.vertices.begin(), all.vertices.end());
  for (std::size_t i = 1; i < all.vertices.size(); ++i) {
    const std::uint32_t a = all.vertices[i - 1].index;
    const std::uint32_t b = all.vertices[i].index;
    if (all.vertices[i - 1].key != all.vertices[i].key) continue;
    unite(parent, a, b);
    if (!sameFrame(all.frames[a], all.frames[b])) breaks[a] = breaks[b] = true;
  }

  std::vector<PlacedTriangle> placed;
  std::vector<std::uint32_t> roots;  // a vertex of the chart, per placed triangle
  for (std::size_t p = 0; p < mesh.primitives.size(); ++p) {
    const Primitive& primitive = mesh.primitives[p];
    if (!receivesLight(scene, instance, primitive)) continue;
    for (std::uint32_t t = 0; t < primitive.triangleCount(); ++t) {
      const std::uint32_t* v = &primitive.indices[3 * t];
      const std::vector<Vec2>& uvs = primitive.uvSets[1];
      for (std::size_t k = 1; k < 3; ++k) unite(parent, all.base[p] + v[0], all.base[p] + v[k]);
      placed.push_back({static_cast<int>(p),
                        t,
                        place.page,
                        0,
                        {place.apply(uvs[v[0]]), place.apply(uvs[v[1]]), place.apply(uvs[v[2]])}});
      roots.push_back(all.base[p] + v[0]);
    }
  }

  std::vector<std::int64_t> chartOfRoot(all.vertices.size(), -1);
  std::vector<ChartFigures> figures;
  const std::size_t firstChart = atlas.charts.size();
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const std::uint32_t root = findRoot(parent, roots[i]);
    if (chartOfRoot[root] < 0) {
      chartOfRoot[root] = static_cast<std::int64_t>(figures.size());
      figures.emplace_back();
    }
    PlacedTriangle& triangle = placed[i];
    triangle.chart = static_cast<std::uint32_t>(firstChart + static_cast<std::size_t>(chartOfRoot[root]));
    ChartFigures& chart = figures[static_cast<std::size_t>(chartOfRoot[root])];
    const Primitive& primitive = mesh.primitives[static_cast<std::size_t>(triangle.primitive)];
    std::array<Vec3d, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = primitive.indices[3 * triangle.triangle + k];
      p[k] = Vec3d(instance.worldFromObject * Vec4(primitive.positions[v], 1.0f));
      chart.crossesFrame = chart.crossesFrame || breaks[all.base[static_cast<std::size_t>(triangle.primitive)] + v];
    }
    chart.surface += triangleArea(p[0], p[1], p[2]);
    chart.texels += triangleArea(Vec2d(triangle.uvs[0]), triangle.uvs[1], triangle.uvs[2]) * pageSize.x * pageSize.y;
  }
  for (const ChartFigures& chart : figures) {
    atlas.charts.push_back(
        {-1, chart.surface > 0 ? static_cast<float>(std::sqrt(chart.texels / chart.surface)) : 0.0f});
    if (chart.crossesFrame) report.frameCrossingTexels += static_cast<std::size_t>(std::ceil(chart.texels));
  }
  return placed;
}

}  // namespace lumel
