#include "lightmap/atlas/bake_frame.h"

#include <algorithm>
#include <array>
#include <tuple>

namespace lumel {
namespace {

struct FrameVertex {  // a vertex of one chart, with what its triangles say
  std::uint32_t chart;
  std::array<std::uint32_t, 3> position;  // bitsOf
  Vec2 uv;
  std::uint32_t surface;
  std::uint32_t vertex;
  Vec3d tangentSum{0.0};
  double handedness = 0.0;

  bool operator<(const FrameVertex& o) const {
    return std::tie(chart, position, uv.x, uv.y, surface, vertex) <
           std::tie(o.chart, o.position, o.uv.x, o.uv.y, o.surface, o.vertex);
  }
  /// Whether both are copies of one point of the chart: a thousandth of a texel apart is rounding.
  bool meets(const FrameVertex& o) const {
    constexpr float kSamePlace = 1e-6f;
    return chart == o.chart && position == o.position && std::abs(uv.x - o.uv.x) <= kSamePlace &&
           std::abs(uv.y - o.uv.y) <= kSamePlace;
  }
};

double cornerAngle(Vec3d p, Vec3d a, Vec3d b) {
  return std::atan2(glm::length(glm::cross(a - p, b - p)), glm::dot(a - p, b - p));
}

/// dP/du of a triangle, unit, and the handedness of (dP/du, up in the image, n). Returns how far it can be
/// trusted, 0..1: float UVs are rounded to 6e-8 of the page, so the direction in a triangle thinner than 100 such steps
/// is noise.
double uvTangent(const std::array<Vec3d, 3>& p, const std::array<Vec2d, 3>& uv, Vec3d& t, double& handedness) {
  const Vec2d e1 = uv[1] - uv[0];
  const Vec2d e2 = uv[2] - uv[0];
  const double area = e1.x * e2.y - e1.y * e2.x;
  const Vec3d along = ((p[1] - p[0]) * e2.y - (p[2] - p[0]) * e1.y) * (area < 0 ? -1.0 : 1.0);
  const double length = glm::length(along);
  if (area == 0 || !(length > 0)) return 0.0;
  t = along / length;
  handedness = area < 0 ? 1.0 : -1.0;  // v runs down: counter-clockwise charts have negative area
  constexpr double kTrustedHeight = 6e-6;
  const double longest = std::sqrt(std::max({glm::dot(e1, e1), glm::dot(e2, e2), glm::dot(e2 - e1, e2 - e1)}));
  const double trust = std::min(1.0, std::abs(area) / (longest * kTrustedHeight));
  return trust * trust * trust;
}

void setMaterialFrames(const Primitive& primitive, const Mat4& worldFromObject, Surface& surface) {
  const Mat3 linear(worldFromObject);
  const bool mirrors = glm::determinant(linear) < 0;
  const Mat3 normalMatrix = glm::transpose(glm::inverse(linear));
  for (std::size_t i = 0; i < surface.positions.size(); ++i) {
    const Vec4& source = primitive.tangents[surface.sourceVertex[i]];
    const Frame frame = frameFromTangent(surface.normals[i], Vec4(linear * Vec3(source), 1.0f));
    // A mirroring instance turns the handedness over; so does a normal that was turned to the front.
    const bool turned = glm::dot(normalMatrix * primitive.normals[surface.sourceVertex[i]], surface.normals[i]) < 0;
    surface.tangents[i] = Vec4(frame.t, ((source.w < 0) != mirrors) != turned ? -1.0f : 1.0f);
  }
}

/// The surface's vertices with the sums of dP/du over their triangles.
void addFrameVertices(const Surface& surface, std::uint32_t index, std::vector<FrameVertex>& vertices) {
  const std::size_t base = vertices.size();
  for (std::uint32_t i = 0; i < surface.positions.size(); ++i)
    vertices.push_back({0, bitsOf(surface.positions[i]), surface.lightmapUvs[i], index, i});
  for (std::size_t t = 0; t < surface.triangleCount(); ++t) {
    std::array<Vec3d, 3> p;
    std::array<Vec2d, 3> uv;
    const std::uint32_t* v = &surface.indices[3 * t];
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = surface.positions[v[k]];
      uv[k] = surface.lightmapUvs[v[k]];
      vertices[base + v[k]].chart = surface.charts[t];
    }
    Vec3d tangent;
    double hand = 0;
    const double trust = uvTangent(p, uv, tangent, hand);
    if (trust == 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const double weight = trust * cornerAngle(p[k], p[(k + 1) % 3], p[(k + 2) % 3]);
      vertices[base + v[k]].tangentSum += weight * tangent;
      vertices[base + v[k]].handedness += weight * hand;
    }
  }
}

/// Gives all copies of one point the same tangent.
void setCommonTangent(std::span<const FrameVertex> copies, std::span<Surface> surfaces) {
  Vec3d sum(0.0), normalSum(0.0);
  double hand = 0;
  for (const FrameVertex& copy : copies) {
    sum += copy.tangentSum;
    hand += copy.handedness;
    normalSum += Vec3d(surfaces[copy.surface].normals[copy.vertex]);
  }
  const double normalLength = glm::length(normalSum);
  const Vec3 n =
      normalLength > 1e-6 ? Vec3(normalSum / normalLength) : surfaces[copies[0].surface].normals[copies[0].vertex];
  const double length = glm::length(sum);
  const Vec3 t = frameFromTangent(n, Vec4(length > 0 ? Vec3(sum / length) : Vec3(0.0f), 1.0f)).t;
  for (const FrameVertex& copy : copies)
    surfaces[copy.surface].tangents[copy.vertex] = Vec4(t, hand < 0 ? -1.0f : 1.0f);
}

}  // namespace

bool hasMaterialFrame(const Primitive& primitive) { return !primitive.tangents.empty(); }

void setBakeFrames(const Scene& scene, std::span<Surface> surfaces) {
  std::vector<FrameVertex> vertices;
  for (std::uint32_t s = 0; s < surfaces.size(); ++s) {
    Surface& surface = surfaces[s];
    const Instance& instance = scene.instances[static_cast<std::size_t>(surface.instance)];
    const Primitive& primitive = scene.primitive(instance.mesh, surface.primitive);
    surface.tangents.assign(surface.positions.size(), Vec4(0, 0, 0, 1));
    if (hasMaterialFrame(primitive))
      setMaterialFrames(primitive, instance.worldFromObject, surface);
    else
      addFrameVertices(surface, s, vertices);
  }
  std::sort(vertices.begin(), vertices.end());
  const std::span<const FrameVertex> all(vertices);
  for (std::size_t first = 0, last; first < all.size(); first = last) {
    for (last = first + 1; last < all.size() && all[last].meets(all[first]);) ++last;
    setCommonTangent(all.subspan(first, last - first), surfaces);
  }
}

}  // namespace lumel
