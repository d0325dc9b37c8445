#include "lightmap/atlas/assemble.h"

#include <algorithm>
#include <bit>
#include <unordered_set>

#include "lightmap/atlas/bake_frame.h"

namespace lumel {
namespace {

class SurfaceBuilder {
 public:
  SurfaceBuilder(const SurfaceBuilder&) = delete;  // vertices_ points to it
  SurfaceBuilder(const Scene& scene, int instance, int primitive, int page)
      : source_(scene.primitive(scene.instances[static_cast<std::size_t>(instance)].mesh, primitive)),
        worldFromObject_(scene.instances[static_cast<std::size_t>(instance)].worldFromObject),
        normalMatrix_(glm::transpose(glm::inverse(Mat3(worldFromObject_)))),
        mirrors_(glm::determinant(Mat3(worldFromObject_)) < 0) {
    surface_.instance = instance;
    surface_.primitive = primitive;
    surface_.page = page;
  }

  void add(const PlacedTriangle& placed) {
    const std::array<std::size_t, 3> order = {0, mirrors_ ? 2u : 1u, mirrors_ ? 1u : 2u};
    std::array<std::uint32_t, 3> source;
    std::array<Vec3, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      source[k] = source_.indices[3 * placed.triangle + order[k]];
      p[k] = Vec3(worldFromObject_ * Vec4(source_.positions[source[k]], 1.0f));
    }
    const Vec3d geometric = glm::cross(Vec3d(p[1]) - Vec3d(p[0]), Vec3d(p[2]) - Vec3d(p[0]));
    bool back = true;
    for (const std::uint32_t v : source) back = back && glm::dot(Vec3d(normal(v)), geometric) < 0;
    for (std::size_t k = 0; k < 3; ++k)
      surface_.indices.push_back(vertex(source[k], p[k], placed.uvs[order[k]], placed.chart, back, Vec3(geometric)));
    surface_.sourceTriangle.push_back(placed.triangle);
    surface_.charts.push_back(placed.chart);
  }

  Surface take() {
    const auto fit = [](auto&... arrays) { (arrays.shrink_to_fit(), ...); };
    fit(surface_.positions, surface_.normals, surface_.lightmapUvs, surface_.sourceVertex, surface_.indices,
        surface_.sourceTriangle, surface_.charts);
    return std::move(surface_);
  }

 private:
  Vec3 normal(std::uint32_t source) const { return normalMatrix_ * source_.normals[source]; }

  /// What tells copies of a source's vertex apart. `back`: a copy with its normal turned to the front.
  struct Copy {
    std::uint32_t chart;
    bool back;
    bool operator==(const Copy&) const = default;
  };

  std::size_t hash(std::uint32_t vertex) const noexcept {
    const Vec2 uv = surface_.lightmapUvs[vertex];
    const Copy copy = copies_[vertex];
    std::uint64_t h = (std::uint64_t{std::bit_cast<std::uint32_t>(uv.x)} << 32) | std::bit_cast<std::uint32_t>(uv.y);
    h *= 0x9e3779b97f4a7c15u;
    h ^= (h >> 29) + ((std::uint64_t{surface_.sourceVertex[vertex]} << 32) | copy.chart);
    h = (h ^ static_cast<std::uint64_t>(copy.back)) * 0xbf58476d1ce4e5b9u;
    return h ^ (h >> 32);
  }
  bool isSame(std::uint32_t a, std::uint32_t b) const noexcept {
    const Vec2 uvA = surface_.lightmapUvs[a], uvB = surface_.lightmapUvs[b];
    return surface_.sourceVertex[a] == surface_.sourceVertex[b] && copies_[a] == copies_[b] &&
           std::bit_cast<std::uint64_t>(uvA) == std::bit_cast<std::uint64_t>(uvB);
  }

  std::uint32_t vertex(std::uint32_t source, const Vec3& position, Vec2 uv, std::uint32_t chart, bool back,
                       const Vec3& geometric) {
    const auto added = static_cast<std::uint32_t>(surface_.positions.size());
    surface_.lightmapUvs.push_back(uv);
    surface_.sourceVertex.push_back(source);
    copies_.push_back({chart, back});
    const auto [place, isNew] = vertices_.insert(added);
    if (!isNew) {
      surface_.lightmapUvs.pop_back();
      surface_.sourceVertex.pop_back();
      copies_.pop_back();
      return *place;
    }
    Vec3 n = normal(source) * (back ? -1.0f : 1.0f);
    if (!(glm::dot(n, n) > 0) || !isFinite(n)) n = geometric;
    // Through double: normals of tiny or huge instances may leave float's range when squared.
    const Vec3d unit = glm::normalize(Vec3d(n));
    surface_.positions.push_back(position);
    surface_.normals.push_back(isFinite(Vec3(unit)) ? Vec3(unit) : Vec3(0, 0, 1));
    return added;
  }

  struct Hash {
    const SurfaceBuilder& builder;
    std::size_t operator()(std::uint32_t vertex) const noexcept { return builder.hash(vertex); }
  };
  struct Same {
    const SurfaceBuilder& builder;
    bool operator()(std::uint32_t a, std::uint32_t b) const noexcept { return builder.isSame(a, b); }
  };

  const Primitive& source_;
  Mat4 worldFromObject_;
  Mat3 normalMatrix_;
  bool mirrors_;
  Surface surface_;
  std::vector<Copy> copies_;  // of surface_'s vertices
  // The same vertices, by what they are: numbers alone, since keys beside them would be the peak of a large scene.
  std::unordered_set<std::uint32_t, Hash, Same> vertices_{0, Hash{*this}, Same{*this}};
};

}  // namespace

std::vector<Surface> makeSurfaces(const Scene& scene, int instance, std::span<const PlacedTriangle> triangles) {
  std::vector<Surface> surfaces;
  for (std::size_t first = 0, last; first < triangles.size(); first = last) {
    const int primitive = triangles[first].primitive;
    std::vector<int> pages;
    for (last = first; last < triangles.size() && triangles[last].primitive == primitive; ++last)
      pages.push_back(triangles[last].page);
    std::sort(pages.begin(), pages.end());
    pages.erase(std::unique(pages.begin(), pages.end()), pages.end());
    for (const int page : pages) {
      SurfaceBuilder builder(scene, instance, primitive, page);
      for (std::size_t i = first; i < last; ++i)
        if (triangles[i].page == page) builder.add(triangles[i]);
      surfaces.push_back(builder.take());
    }
  }
  setBakeFrames(scene, surfaces);
  return surfaces;
}

}  // namespace lumel
