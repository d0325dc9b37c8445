#include "scene/triangles/triangles.h"

#include <algorithm>
#include <array>
#include <utility>

#include "scene/triangles/tangents.h"
#include "scene/triangles/vertex_splitter.h"

namespace lumel {
namespace {

// Edges and cross product are computed in double, where collinear float positions give at most some 1e-16 of the
// longest edge squared; the thinnest real slivers of float positions lie above 1e-9.
constexpr double kDegenerateArea = 1e-10;

Vec3d at(const Primitive& p, std::size_t corner) { return Vec3d(p.positions[p.indices[corner]]); }

/// Twice the area, along the normal.
Vec3d areaVector(const Primitive& p, std::size_t triangle) {
  const Vec3d a = at(p, 3 * triangle);
  return glm::cross(at(p, 3 * triangle + 1) - a, at(p, 3 * triangle + 2) - a);
}

bool isDegenerate(const Primitive& p, std::size_t triangle) {
  const auto* i = &p.indices[3 * triangle];
  if (i[0] == i[1] || i[1] == i[2] || i[2] == i[0]) return true;
  const Vec3d a = at(p, 3 * triangle), b = at(p, 3 * triangle + 1), c = at(p, 3 * triangle + 2);
  const double longest2 = std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
  return !(glm::length(areaVector(p, triangle)) > kDegenerateArea * longest2);
}

template <class T>
void gather(std::vector<T>& values, std::span<const std::uint32_t> source) {
  if (values.empty()) return;
  std::vector<T> gathered(source.size());
  for (std::size_t i = 0; i < source.size(); ++i) gathered[i] = values[source[i]];
  values = std::move(gathered);
}

/// Drops triangles with a repeated index, or whose area is nothing beside the square of their longest edge (a
/// relative criterion: a tiny triangle stays). Positions must be finite. Returns how many went.
std::size_t dropDegenerateTriangles(Primitive& primitive) {
  std::size_t kept = 0;
  const std::size_t count = primitive.triangleCount();
  for (std::size_t t = 0; t < count; ++t) {
    if (isDegenerate(primitive, t)) continue;
    if (kept != t) std::copy_n(&primitive.indices[3 * t], 3, &primitive.indices[3 * kept]);
    ++kept;
  }
  primitive.indices.resize(3 * kept);
  return count - kept;
}

/// Flat normals as glTF 2.0 asks for where a mesh has none: each triangle gets its own, vertices are split where
/// their triangles differ. Needs a primitive without degenerate triangles; drops any tangents.
void makeFlatNormals(Primitive& primitive) {
  VertexSplitter<Vec3> splitter(primitive.positions.size(), primitive.indices.size());
  for (std::size_t t = 0; t < primitive.triangleCount(); ++t) {
    const Vec3 normal(glm::normalize(areaVector(primitive, t)));
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& index = primitive.indices[3 * t + k];
      index = splitter.vertexFor(index, normal);
    }
  }
  primitive.normals.clear();
  primitive.tangents.clear();
  gatherVertices(primitive, splitter.sources());
  primitive.normals = splitter.takeValues();
}

/// Makes normals unit length; those that are zero or not finite become the area-weighted mean of their triangles'.
/// Returns how many were replaced.
std::size_t repairNormals(Primitive& primitive) {
  std::vector<std::uint32_t> bad;
  for (std::size_t v = 0; v < primitive.normals.size(); ++v) {
    Vec3& n = primitive.normals[v];
    const double length2 = glm::dot(Vec3d(n), Vec3d(n));
    if (!isFinite(n) || !(length2 > 0))
      bad.push_back(static_cast<std::uint32_t>(v));
    else if (std::abs(length2 - 1) > 1e-6)
      n = Vec3(Vec3d(n) / std::sqrt(length2));
  }
  if (bad.empty()) return 0;
  std::vector<Vec3d> sums(primitive.normals.size(), Vec3d(0));
  for (std::size_t t = 0; t < primitive.triangleCount(); ++t)
    for (std::size_t k = 0; k < 3; ++k) sums[primitive.indices[3 * t + k]] += areaVector(primitive, t);
  for (const std::uint32_t v : bad) {
    const double length = glm::length(sums[v]);
    primitive.normals[v] = length > 0 ? Vec3(sums[v] / length) : Vec3(0, 1, 0);
  }
  return bad.size();
}

/// The same for tangents: unit xyz, w = +-1; a useless one becomes any direction perpendicular to the normal.
std::size_t repairTangents(Primitive& primitive) {
  std::size_t bad = 0;
  for (std::size_t v = 0; v < primitive.tangents.size(); ++v) {
    Vec4& t = primitive.tangents[v];
    const float w = t.w < 0 ? -1.0f : 1.0f;
    const double length = glm::length(Vec3d(t));
    const bool useful = isFinite(Vec3(t)) && length > 0;
    if (!useful) ++bad;
    t = Vec4(useful ? Vec3(Vec3d(t) / length) : frameAround(primitive.normals[v]).t, w);
  }
  return bad;
}

}  // namespace

void gatherVertices(Primitive& primitive, std::span<const std::uint32_t> source) {
  gather(primitive.positions, source);
  gather(primitive.normals, source);
  gather(primitive.tangents, source);
  for (auto& set : primitive.uvSets) gather(set, source);
  gather(primitive.colors, source);
}

void dropUnusedVertices(Primitive& primitive) {
  constexpr std::uint32_t kUnused = 0xFFFFFFFFu;
  std::vector<std::uint32_t> renumbered(primitive.positions.size(), kUnused);
  for (const std::uint32_t i : primitive.indices) renumbered[i] = 0;
  std::vector<std::uint32_t> source;
  for (std::size_t v = 0; v < renumbered.size(); ++v)
    if (renumbered[v] != kUnused) {
      renumbered[v] = static_cast<std::uint32_t>(source.size());
      source.push_back(static_cast<std::uint32_t>(v));
    }
  if (source.size() == primitive.positions.size()) return;
  for (std::uint32_t& i : primitive.indices) i = renumbered[i];
  gatherVertices(primitive, source);
}

void finishPrimitive(Primitive& primitive, const Material& material, LoadReport& report) {
  const auto warn = [&](std::size_t count, const std::string& what) {
    if (count != 0) report.warnings.push_back(primitive.name + ": " + std::to_string(count) + " " + what);
  };
  report.degenerateTriangles += dropDegenerateTriangles(primitive);
  dropUnusedVertices(primitive);
  if (primitive.indices.empty()) return;
  if (primitive.normals.empty()) makeFlatNormals(primitive);
  warn(repairNormals(primitive), "normals are zero or not finite; made from the triangles instead");
  warn(repairTangents(primitive), "tangents are zero or not finite; made perpendicular to the normal instead");
  for (auto& set : primitive.uvSets) {
    std::size_t bad = 0;
    for (Vec2& uv : set)
      if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) {
        uv = Vec2(0);
        ++bad;
      }
    warn(bad, "texture coordinates are not finite; read as 0");
  }
  const bool bumped = static_cast<bool>(material.ssbumpMap);
  const TextureRef& map = bumped ? material.ssbumpMap : material.normalMap;
  if (!map || !primitive.tangents.empty()) return;
  const auto set = static_cast<std::size_t>(map.uvSet);
  if (set >= primitive.uvSets.size() || primitive.uvSets[set].empty()) {
    report.warnings.push_back(primitive.name + ": has no TEXCOORD_" + std::to_string(set) + ", which the " +
                              (bumped ? "ssbump" : "normal") + " map of material '" + material.name + "' reads");
    return;
  }
  makeTangents(primitive, set, map.uvMatrix);
}

std::vector<std::uint32_t> weldPositions(const std::vector<Vec3>& positions) {
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> keys(positions.size());
  for (std::uint32_t i = 0; i < keys.size(); ++i) keys[i] = {bitsOf(positions[i]), i};
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> first(positions.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const bool same = i > 0 && keys[i].first == keys[i - 1].first;
    first[keys[i].second] = same ? first[keys[i - 1].second] : keys[i].second;
  }
  return first;
}

}  // namespace lumel
