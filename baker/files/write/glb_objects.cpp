#include "baker/files/write/glb_objects.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lumel {
namespace {

std::size_t toSize(int i) { return static_cast<std::size_t>(i); }

Vec3 unitOr(const Vec3d& v, const Vec3& otherwise) {
  const double length = glm::length(v);
  return length > 0.0 && std::isfinite(length) ? Vec3(v / length) : otherwise;
}

std::vector<std::uint32_t> countUp(std::size_t count) {
  std::vector<std::uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0u);
  return numbers;
}

/// A primitive that gets no lightmap, as it came.
GlbPart asItCame(const Primitive& primitive, int index) {
  GlbPart part;
  part.primitive = index;
  part.positions = primitive.positions;
  part.normals = primitive.normals;
  part.tangents = primitive.tangents;
  part.sourceVertex = countUp(primitive.positions.size());
  part.indices = primitive.indices;
  return part;
}

void turnTriangles(std::vector<std::uint32_t>& indices) {
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) std::swap(indices[i + 1], indices[i + 2]);
}

/// Moves such a part to the world, like the surfaces.
void moveToWorld(const Mat4& worldFromObject, GlbPart& part) {
  const Mat3 linear(worldFromObject);
  const bool mirrors = glm::determinant(linear) < 0.0f;
  const Mat3 normalMatrix = cofactorMatrix(linear) * (mirrors ? -1.0f : 1.0f);
  for (Vec3& p : part.positions) p = Vec3(worldFromObject * Vec4(p, 1.0f));
  for (Vec3& n : part.normals) n = unitOr(Vec3d(normalMatrix * n), Vec3(0, 1, 0));
  for (Vec4& t : part.tangents) t = Vec4(unitOr(Vec3d(linear * Vec3(t)), Vec3(1, 0, 0)), mirrors ? -t.w : t.w);
  if (mirrors) turnTriangles(part.indices);
}

template <class T>
void reorder(const std::vector<std::uint32_t>& order, std::vector<T>& values) {
  if (values.empty()) return;
  std::vector<T> moved;
  moved.reserve(values.size());
  for (const std::uint32_t v : order) moved.push_back(values[v]);
  values = std::move(moved);
}

/// Puts vertices in the order of the source, whatever order the triangles met them in.
void sortVertices(GlbPart& part) {
  std::vector<std::uint32_t> order = countUp(part.sourceVertex.size());
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return part.sourceVertex[a] < part.sourceVertex[b]; });
  std::vector<std::uint32_t> place(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) place[order[i]] = i;
  for (std::uint32_t& index : part.indices) index = place[index];
  reorder(order, part.positions);
  reorder(order, part.normals);
  reorder(order, part.tangents);
  reorder(order, part.lightmapUvs);
  reorder(order, part.sourceVertex);
}

GlbPart inObject(const Surface& surface, const Primitive& source, const Instance& instance, bool ownUvs) {
  const glm::dmat3 linear{Mat3(instance.worldFromObject)};
  const glm::dmat3 objectFromWorld = glm::inverse(linear);
  const glm::dmat3 normalFromWorld = glm::transpose(linear);
  const bool mirrors = glm::determinant(linear) < 0.0;
  GlbPart part;
  part.primitive = surface.primitive;
  part.page = surface.page;
  part.sourceVertex = surface.sourceVertex;
  part.indices = surface.indices;
  if (mirrors) turnTriangles(part.indices);
  for (std::size_t i = 0; i < surface.positions.size(); ++i) {
    const std::uint32_t v = surface.sourceVertex[i];
    part.positions.push_back(source.positions[v]);
    // The source's own normal where it is the one that was baked with, on either side; exact then.
    constexpr float kSameNormal = 1e-4f;
    const Vec3 baked = unitOr(normalFromWorld * Vec3d(surface.normals[i]), source.normals[v]);
    const Vec3 given = source.normals[v] * (glm::dot(baked, source.normals[v]) < 0.0f ? -1.0f : 1.0f);
    part.normals.push_back(glm::length(baked - given) <= kSameNormal ? given : baked);
    const Vec4& t = surface.tangents[i];
    part.tangents.push_back(Vec4(unitOr(objectFromWorld * Vec3d(Vec3(t)), Vec3(1, 0, 0)), mirrors ? -t.w : t.w));
    part.lightmapUvs.push_back(ownUvs ? source.uvSets[1][v] : surface.lightmapUvs[i]);
  }
  sortVertices(part);
  return part;
}

/// Primitives of the mesh that none of the surfaces shows.
std::vector<int> withoutLightmap(const Mesh& mesh, std::span<const Surface> surfaces) {
  std::vector<bool> lit(mesh.primitives.size(), false);
  for (const Surface& surface : surfaces) lit[toSize(surface.primitive)] = true;
  std::vector<int> others;
  for (std::size_t k = 0; k < mesh.primitives.size(); ++k)
    if (!lit[k] && !mesh.primitives[k].indices.empty()) others.push_back(static_cast<int>(k));
  return others;
}

bool same(const GlbPart& a, const GlbPart& b) {
  if (a.primitive != b.primitive || (a.page < 0) != (b.page < 0) || a.sourceVertex != b.sourceVertex ||
      a.indices != b.indices || a.tangents.size() != b.tangents.size())
    return false;
  constexpr float kSameFrame = 1e-3f;  // 0.06 degrees: no consumer can tell
  for (std::size_t i = 0; i < a.tangents.size(); ++i)
    if (!(glm::length(a.tangents[i] - b.tangents[i]) <= kSameFrame)) return false;
  for (std::size_t i = 0; i < a.normals.size(); ++i)
    if (!(glm::length(a.normals[i] - b.normals[i]) <= kSameFrame)) return false;
  return true;
}

}  // namespace

bool isNodeTransform(const Mat4& worldFromObject) {
  constexpr double kTolerance = 1e-5;  // of the axes' lengths: transforms are products of float matrices
  for (int i = 0; i < 3; ++i) {
    const Vec3d a(worldFromObject[i]), b(worldFromObject[(i + 1) % 3]);
    if (!(std::abs(glm::dot(a, b)) <= kTolerance * glm::length(a) * glm::length(b))) return false;
  }
  return true;
}

std::vector<GlbPart> partsInWorld(const Scene& scene, const Instance& instance, std::span<const Surface> surfaces) {
  const Mesh& mesh = scene.meshes[toSize(instance.mesh)];
  std::vector<GlbPart> parts;
  for (const Surface& s : surfaces)
    if (!s.indices.empty())
      parts.push_back(
          {s.primitive, s.page, s.positions, s.normals, s.tangents, s.lightmapUvs, s.sourceVertex, s.indices});
  for (const int k : withoutLightmap(mesh, surfaces)) {
    parts.push_back(asItCame(mesh.primitives[toSize(k)], k));
    moveToWorld(instance.worldFromObject, parts.back());
  }
  return parts;
}

std::vector<GlbPart> partsInObject(const Scene& scene, const Instance& instance, std::span<const Surface> surfaces,
                                   bool ownUvs) {
  const Mesh& mesh = scene.meshes[toSize(instance.mesh)];
  std::vector<GlbPart> parts;
  for (const Surface& s : surfaces)
    if (!s.indices.empty()) parts.push_back(inObject(s, mesh.primitives[toSize(s.primitive)], instance, ownUvs));
  for (const int k : withoutLightmap(mesh, surfaces)) parts.push_back(asItCame(mesh.primitives[toSize(k)], k));
  return parts;
}

bool sameButForPages(std::span<const GlbPart> a, std::span<const GlbPart> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

}  // namespace lumel
