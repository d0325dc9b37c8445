#include "scene/triangles/tangents.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cfloat>
#include <cmath>
#include <tuple>
#include <unordered_map>

#include "scene/base/check.h"
#include "scene/triangles/triangles.h"
#include "scene/triangles/vertex_splitter.h"

namespace lumel {
namespace {

constexpr std::int32_t kNone = -1;

struct VertexKey {
  Vec3 position;
  Vec3 normal;
  Vec2 uv;
  bool operator==(const VertexKey&) const = default;
};

struct VertexKeyHash {
  std::size_t operator()(const VertexKey& key) const {
    std::uint64_t hash = 0x9E3779B97F4A7C15ull;
    for (const float f : {key.position.x, key.position.y, key.position.z, key.normal.x, key.normal.y, key.normal.z,
                          key.uv.x, key.uv.y}) {
      hash ^= std::bit_cast<std::uint32_t>(f);
      hash *= 0xD6E8FEB86659FD93ull;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

/// What the UV mapping says of one triangle: its tangent direction and its winding in the image.
struct Triangle {
  std::array<std::uint32_t, 3> v{};                            // welded vertices
  std::array<std::int32_t, 3> neighbour{kNone, kNone, kNone};  // across the edge from corner k to k + 1
  std::array<std::int32_t, 3> group{kNone, kNone, kNone};      // per corner
  Vec3 tangent{0};                                             // along growing u; unit, or zero
  bool sameWinding = false;                                    // the triangle's front shows the image unmirrored
  bool flexible = true;                                        // no usable tangent of its own: may join any group
};

struct Group {
  Vec3 sum{0};
  bool sameWinding = false;
};

class TangentBuilder {
 public:
  TangentBuilder(std::span<const Vec3> positions, std::span<const Vec3> normals, std::span<const Vec2> uvs,
                 std::span<const std::uint32_t> indices)
      : positions_(positions), normals_(normals), uvs_(uvs), indices_(indices), triangles_(indices.size() / 3) {}

  std::vector<Vec4> run() {
    weld();
    for (std::size_t t = 0; t < triangles_.size(); ++t) derive(t);
    connect();
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        if (!triangles_[t].flexible && triangles_[t].group[k] == kNone) grow(t, k);
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) accumulate(t, k);
    return collect();
  }

 private:
  Vec3 position(std::size_t t, std::size_t k) const { return positions_[indices_[3 * t + k]]; }
  const Vec3& normal(std::size_t t, std::size_t k) const { return normals_[indices_[3 * t + k]]; }

  void weld();
  void derive(std::size_t t);
  void connect();
  void grow(std::size_t t, std::size_t k);
  void accumulate(std::size_t t, std::size_t k);
  std::vector<Vec4> collect() const;

  std::span<const Vec3> positions_;
  std::span<const Vec3> normals_;
  std::span<const Vec2> uvs_;
  std::span<const std::uint32_t> indices_;
  std::vector<Triangle> triangles_;
  std::vector<Group> groups_;
};

Vec3 unitOrZero(const Vec3& v) {
  const float length = glm::length(v);
  return length > FLT_MIN && length <= FLT_MAX ? v / length : Vec3(0);
}

void TangentBuilder::weld() {
  std::unordered_map<VertexKey, std::uint32_t, VertexKeyHash> ids;
  ids.reserve(positions_.size());
  std::vector<std::uint32_t> welded(positions_.size());
  for (std::size_t v = 0; v < positions_.size(); ++v) {
    // + 0 makes -0 and 0 one value, as a comparison of floats does.
    const VertexKey key{positions_[v] + 0.0f, normals_[v] + 0.0f, uvs_[v] + 0.0f};
    welded[v] = ids.try_emplace(key, static_cast<std::uint32_t>(v)).first->second;
  }
  for (std::size_t c = 0; c < indices_.size() / 3 * 3; ++c) triangles_[c / 3].v[c % 3] = welded[indices_[c]];
}

/// First-order derivative of position by u (thesis, section 4.1), from the triangle's edges in space and image.
void TangentBuilder::derive(std::size_t t) {
  Triangle& triangle = triangles_[t];
  const Vec2 uv0 = uvs_[indices_[3 * t]], uv1 = uvs_[indices_[3 * t + 1]], uv2 = uvs_[indices_[3 * t + 2]];
  // v is turned to run up the image, where green points.
  const Vec2 e1(uv1.x - uv0.x, uv0.y - uv1.y), e2(uv2.x - uv0.x, uv0.y - uv2.y);
  const Vec3 d1 = position(t, 1) - position(t, 0), d2 = position(t, 2) - position(t, 0);
  const float area = e1.x * e2.y - e1.y * e2.x;
  triangle.sameWinding = area > 0;
  if (!(std::abs(area) > FLT_MIN)) return;
  const Vec3 dPdu = unitOrZero(e2.y * d1 - e1.y * d2) * (area > 0 ? 1.0f : -1.0f);
  const Vec3 dPdv = unitOrZero(e1.x * d2 - e2.x * d1);
  triangle.tangent = dPdu;
  triangle.flexible = dPdu == Vec3(0) || dPdv == Vec3(0);
}

void TangentBuilder::connect() {
  struct Edge {
    std::uint32_t low, high;
    std::uint32_t triangle, corner;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * triangles_.size());
  for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto a = triangles_[t].v[k], b = triangles_[t].v[(k + 1) % 3];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b), t, k});
    }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.triangle, a.corner) < std::tie(b.low, b.high, b.triangle, b.corner);
  });
  const auto link = [&](const Edge& e) -> std::int32_t& { return triangles_[e.triangle].neighbour[e.corner]; };
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (link(edges[i]) != kNone) continue;
    for (std::size_t j = i + 1; j < edges.size() && edges[j].low == edges[i].low && edges[j].high == edges[i].high;
         ++j) {
      const bool opposite =
          triangles_[edges[i].triangle].v[edges[i].corner] != triangles_[edges[j].triangle].v[edges[j].corner];
      if (!opposite || link(edges[j]) != kNone) continue;
      link(edges[i]) = static_cast<std::int32_t>(edges[j].triangle);
      link(edges[j]) = static_cast<std::int32_t>(edges[i].triangle);
      break;
    }
  }
}

/// A group: the corners of one vertex whose triangles can be walked edge by edge without the winding changing.
void TangentBuilder::grow(std::size_t t, std::size_t k) {
  const auto group = static_cast<std::int32_t>(groups_.size());
  groups_.push_back({Vec3(0), triangles_[t].sameWinding});
  const std::uint32_t vertex = triangles_[t].v[k];
  std::vector<std::size_t> pending{t};
  while (!pending.empty()) {
    Triangle& triangle = triangles_[pending.back()];
    pending.pop_back();
    const auto corner =
        static_cast<std::size_t>(std::find(triangle.v.begin(), triangle.v.end(), vertex) - triangle.v.begin());
    if (corner == 3 || triangle.group[corner] != kNone) continue;
    // A triangle without a direction of its own takes the winding of the first group that reaches it.
    if (triangle.flexible && triangle.group == std::array<std::int32_t, 3>{kNone, kNone, kNone})
      triangle.sameWinding = groups_.back().sameWinding;
    if (triangle.sameWinding != groups_.back().sameWinding) continue;
    triangle.group[corner] = group;
    for (const std::int32_t next : {triangle.neighbour[(corner + 2) % 3], triangle.neighbour[corner]})
      if (next != kNone) pending.push_back(static_cast<std::size_t>(next));
  }
}

/// Adds a corner's direction to its group, weighted by the angle at the corner, all seen in the plane of the normal
/// (thesis, section 4.2).
void TangentBuilder::accumulate(std::size_t t, std::size_t k) {
  const Triangle& triangle = triangles_[t];
  if (triangle.flexible || triangle.group[k] == kNone) return;
  const Vec3& n = normal(t, k);
  const auto inPlane = [&](const Vec3& v) { return unitOrZero(v - n * glm::dot(n, v)); };
  const Vec3 toPrevious = inPlane(position(t, (k + 2) % 3) - position(t, k));
  const Vec3 toNext = inPlane(position(t, (k + 1) % 3) - position(t, k));
  const float angle = std::acos(std::clamp(glm::dot(toPrevious, toNext), -1.0f, 1.0f));
  groups_[static_cast<std::size_t>(triangle.group[k])].sum += angle * inPlane(triangle.tangent);
}

std::vector<Vec4> TangentBuilder::collect() const {
  std::vector<Vec4> tangents(indices_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t id = triangles_[t].group[k];
      const Vec3& n = normal(t, k);
      Vec4& tangent = tangents[3 * t + k];
      tangent = Vec4(frameAround(n).t, 1.0f);
      if (id == kNone) continue;
      const Group& group = groups_[static_cast<std::size_t>(id)];
      tangent.w = group.sameWinding ? 1.0f : -1.0f;
      // Directions that cancel out leave each triangle its own.
      const Vec3 own = triangles_[t].tangent - n * glm::dot(n, triangles_[t].tangent);
      const Vec3 mean = glm::length(group.sum) > 1e-6f ? unitOrZero(group.sum) : unitOrZero(own);
      if (mean != Vec3(0)) tangent = Vec4(mean, tangent.w);
    }
  return tangents;
}

}  // namespace

std::vector<Vec4> cornerTangents(std::span<const Vec3> positions, std::span<const Vec3> normals,
                                 std::span<const Vec2> uvs, std::span<const std::uint32_t> indices) {
  LUMEL_CHECK(positions.size() == normals.size() && positions.size() == uvs.size() && indices.size() % 3 == 0);
  return TangentBuilder(positions, normals, uvs, indices).run();
}

void makeTangents(Primitive& primitive, std::size_t uvSet, const Mat3& uvMatrix) {
  std::vector<Vec2> uvs = primitive.uvSets[uvSet];
  if (uvMatrix != Mat3(1.0f))
    for (Vec2& uv : uvs) uv = Vec2(uvMatrix * Vec3(uv, 1.0f));
  const auto corners = cornerTangents(primitive.positions, primitive.normals, uvs, primitive.indices);
  VertexSplitter<Vec4> splitter(primitive.positions.size(), primitive.indices.size());
  for (std::size_t c = 0; c < corners.size(); ++c)
    primitive.indices[c] = splitter.vertexFor(primitive.indices[c], corners[c]);
  primitive.tangents.clear();
  gatherVertices(primitive, splitter.sources());
  primitive.tangents = splitter.takeValues();
}

}  // namespace lumel
