#include "lightmap/atlas/split_triangles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "lightmap/atlas/object_layouts.h"
#include "lightmap/atlas/scene_uvs.h"

namespace lumel {
namespace {

/// Longest edge as a share of a page: a chart may stretch its triangles by a quarter.
constexpr double kLongestShare = 0.75;
constexpr double kMostPages = 1000.0;

using TexelTransforms = std::vector<glm::dmat3>;  // of a mesh: those of the instances with edges that are too long

class PrimitiveSplitter {
 public:
  PrimitiveSplitter(Primitive& primitive, const TexelTransforms& toTexels, double longest)
      : primitive_(primitive), toTexels_(toTexels), longest_(longest) {}

  SplitReport run() {
    SplitReport report;
    std::vector<std::uint32_t> done;
    std::vector<std::uint32_t> left;
    for (std::size_t i = 0; i < primitive_.indices.size(); i += 3) {
      const std::array<std::uint32_t, 3> t = {primitive_.indices[i], primitive_.indices[i + 1],
                                              primitive_.indices[i + 2]};
      const bool isLong = isLongEdge(t[0], t[1]) || isLongEdge(t[1], t[2]) || isLongEdge(t[2], t[0]);
      report.triangles += isLong ? 1 : 0;
      std::vector<std::uint32_t>& list = isLong ? left : done;
      list.insert(list.end(), t.begin(), t.end());
    }
    const std::size_t kept = done.size() / 3;
    while (!left.empty()) {
      std::vector<std::uint32_t> next;
      for (std::size_t i = 0; i < left.size(); i += 3) split({left[i], left[i + 1], left[i + 2]}, next, done);
      left = std::move(next);
    }
    report.pieces = done.size() / 3 - kept;
    primitive_.indices = std::move(done);
    return report;
  }

 private:
  bool isLongEdge(std::uint32_t a, std::uint32_t b) const {
    const Vec3d edge = Vec3d(primitive_.positions[b]) - Vec3d(primitive_.positions[a]);
    return std::any_of(toTexels_.begin(), toTexels_.end(),
                       [&](const glm::dmat3& transform) { return glm::length(transform * edge) > longest_; });
  }

  /// The vertex in the middle of an edge, the same for both of its triangles.
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t key = (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
    const auto [place, isNew] = middles_.try_emplace(key, static_cast<std::uint32_t>(primitive_.positions.size()));
    if (!isNew) return place->second;
    const auto addMean = [a, b](auto& values) {
      if (!values.empty()) values.push_back((values[a] + values[b]) * 0.5f);
    };
    addMean(primitive_.positions);
    addMean(primitive_.colors);
    for (std::vector<Vec2>& uvs : primitive_.uvSets) addMean(uvs);
    const auto unit = [](const Vec3& v, const Vec3& otherwise) {
      const float length = glm::length(v);
      return length > 0.0f ? v / length : otherwise;
    };
    const auto& normals = primitive_.normals;
    if (!normals.empty()) primitive_.normals.push_back(unit(normals[a] + normals[b], normals[a]));
    const auto& tangents = primitive_.tangents;
    if (!tangents.empty())
      primitive_.tangents.push_back(
          Vec4(unit(Vec3(tangents[a]) + Vec3(tangents[b]), Vec3(tangents[a])), tangents[a].w));
    return place->second;
  }

  /// Pieces with edges that are still too long go to `next`, others to `done`.
  void split(std::array<std::uint32_t, 3> t, std::vector<std::uint32_t>& next, std::vector<std::uint32_t>& done) {
    std::array<bool, 3> isLong{};
    for (std::size_t k = 0; k < 3; ++k) isLong[k] = isLongEdge(t[k], t[(k + 1) % 3]);
    const int count = static_cast<int>(std::count(isLong.begin(), isLong.end(), true));
    // Turned so that the first edge is long and, of two long ones, the second as well.
    while (count > 0 && count < 3 && !(isLong[0] && (count == 1 || isLong[1]))) {
      std::rotate(t.begin(), t.begin() + 1, t.end());
      std::rotate(isLong.begin(), isLong.begin() + 1, isLong.end());
    }
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      const bool again = isLongEdge(a, b) || isLongEdge(b, c) || isLongEdge(c, a);
      std::vector<std::uint32_t>& list = again ? next : done;
      list.insert(list.end(), {a, b, c});
    };
    if (count == 0) return add(t[0], t[1], t[2]);
    const std::uint32_t ab = middle(t[0], t[1]);
    if (count == 1) {
      add(t[0], ab, t[2]);
      add(ab, t[1], t[2]);
      return;
    }
    const std::uint32_t bc = middle(t[1], t[2]);
    add(ab, t[1], bc);
    if (count == 2) {
      add(t[0], ab, bc);
      add(t[0], bc, t[2]);
      return;
    }
    const std::uint32_t ca = middle(t[2], t[0]);
    add(t[0], ab, ca);
    add(ca, bc, t[2]);
    add(ab, bc, ca);
  }

  Primitive& primitive_;
  const TexelTransforms& toTexels_;
  const double longest_;
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;  // looked up only
};

}  // namespace

SplitReport splitLongTriangles(Scene& scene, const AtlasOptions& options) {
  SplitReport report;
  const auto density = static_cast<double>(options.texelsPerMeter);
  if (!(density > 0)) return report;
  const double longest = kLongestShare * (options.pageSize - 2 * ((options.padding + 1) / 2) - 1);
  const std::vector<int> receivers = receiversOf(scene);
  double texels = 0;
  std::vector<int> tooLong;
  for (const int i : receivers) {
    const Instance& instance = scene.instances[static_cast<std::size_t>(i)];
    texels += weightedArea(scene, instance) * density * density;
    if (weightedLength(scene, instance) * density > longest) tooLong.push_back(i);
  }
  const double page = static_cast<double>(options.pageSize) * options.pageSize;
  if (tooLong.empty() || !(longest > 1) || !(texels <= kMostPages * page)) return report;
  std::vector<TexelTransforms> transforms(scene.meshes.size());
  for (const SceneUvUse& use : examineSceneUvs(scene, tooLong, options).uses) {
    if (use.used) continue;
    const Instance& instance = scene.instances[static_cast<std::size_t>(use.instance)];
    TexelTransforms& known = transforms[static_cast<std::size_t>(instance.mesh)];
    const glm::dmat3 toTexels =
        glm::dmat3(Mat3(instance.worldFromObject)) * density * static_cast<double>(instance.settings.texelDensityScale);
    if (std::find(known.begin(), known.end(), toTexels) == known.end()) known.push_back(toTexels);
  }
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    if (transforms[m].empty()) continue;
    for (Primitive& primitive : scene.meshes[m].primitives) {
      const SplitReport some = PrimitiveSplitter(primitive, transforms[m], longest).run();
      report.triangles += some.triangles;
      report.pieces += some.pieces;
    }
  }
  return report;
}

}  // namespace lumel
