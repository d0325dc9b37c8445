#include "lightmap/atlas/object_layouts.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "lightmap/atlas/bake_frame.h"
#include "lightmap/atlas/scene_uvs.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

using Mat3d = glm::dmat3;

double densityOf(const Instance& instance, double texelsPerMeter) {
  return texelsPerMeter * static_cast<double>(instance.settings.texelDensityScale);
}

/// What decides a flattening besides the mesh: how the transform deforms (A^T A up to scale) and whether it mirrors.
struct Shape {
  int mesh = 0;
  bool mirrors = false;
  std::array<double, 6> gram{};  // divided by its trace
  double scale = 0.0;            // texels per object unit, root mean square over directions
};

Shape shapeOf(const Instance& instance, double texelsPerMeter) {
  const Mat3d linear(Mat3(instance.worldFromObject));
  const Mat3d gram = glm::transpose(linear) * linear;
  const double trace = gram[0][0] + gram[1][1] + gram[2][2];
  Shape shape{
      instance.mesh, glm::determinant(linear) < 0, {}, std::sqrt(trace / 3) * densityOf(instance, texelsPerMeter)};
  if (trace > 0)
    shape.gram = {gram[0][0] / trace, gram[1][1] / trace, gram[2][2] / trace,
                  gram[1][0] / trace, gram[2][0] / trace, gram[2][1] / trace};
  return shape;
}

bool sameShape(const Shape& a, const Shape& b) {
  constexpr double kTolerance = 1e-4;  // stretch of 0.01 % between two instances: float transforms are not exact
  constexpr double kScaleRange = 0.5;  // thresholds in texels still mean much the same
  if (a.mesh != b.mesh || a.mirrors != b.mirrors || !(b.scale >= kScaleRange * a.scale)) return false;
  for (std::size_t i = 0; i < 6; ++i)
    if (!(std::abs(a.gram[i] - b.gram[i]) <= kTolerance)) return false;
  return true;
}

/// `v` made a unit vector, through double: transforms of tiny or huge instances leave float's range when squared.
Vec3 unitOr(const Vec3& v, const Vec3& otherwise) {
  const Vec3d d(v);
  const double length = glm::length(d);
  return length > 0 && std::isfinite(length) ? Vec3(d / length) : otherwise;
}

/// Calls body(a, b, c) with the corners, turned and scaled as in the world, of the triangles that get a lightmap.
template <class Body>
void forEachReceiving(const Scene& scene, const Instance& instance, Body body) {
  const Mat3d linear(Mat3(instance.worldFromObject));
  for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
    if (!receivesLight(scene, instance, primitive)) continue;
    const auto corner = [&](std::size_t i) { return linear * Vec3d(primitive.positions[primitive.indices[i]]); };
    for (std::size_t i = 0; i < primitive.indices.size(); i += 3) body(corner(i), corner(i + 1), corner(i + 2));
  }
}

TriangleSources receivingTriangles(const Scene& scene, const Instance& instance) {
  TriangleSources source;
  const std::vector<Primitive>& primitives = scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives;
  for (std::size_t p = 0; p < primitives.size(); ++p)
    if (receivesLight(scene, instance, primitives[p])) source.add(static_cast<int>(p), primitives[p].triangleCount());
  return source;
}

/// The instance's triangles that get a lightmap, in texels, counter-clockwise from the front in the world.
TriangleSoup makeSoup(const Scene& scene, const Instance& instance, double texelsPerMeter) {
  TriangleSoup soup;
  soup.points.toTexels = Mat3d(Mat3(instance.worldFromObject)) * densityOf(instance, texelsPerMeter);
  const bool mirrors = glm::determinant(soup.points.toTexels) < 0;
  const Mat3 objectFromWorld = glm::inverse(Mat3(instance.worldFromObject));
  const std::vector<Primitive>& primitives = scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives;
  for (const Primitive& primitive : primitives) {
    if (!receivesLight(scene, instance, primitive)) continue;
    std::vector<Vec3>& positions = soup.points.positions;
    const auto base = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), primitive.positions.begin(), primitive.positions.end());
    for (const Vec3& n : primitive.normals) soup.normals.push_back(unitOr(n * objectFromWorld, n));
    soup.frames.resize(positions.size(), Vec4(0.0f));
    if (hasMaterialFrame(primitive))  // as they will be baked: at right angles to the normal
      for (std::size_t i = 0; i < primitive.positions.size(); ++i)
        soup.frames[base + i] = Vec4(frameFromTangent(primitive.normals[i], primitive.tangents[i]).t,
                                     primitive.tangents[i].w < 0 ? -1.0f : 1.0f);
    for (std::uint32_t t = 0; t < primitive.triangleCount(); ++t)
      for (const std::uint32_t k : {0u, mirrors ? 2u : 1u, mirrors ? 1u : 2u})
        soup.indices.push_back(base + primitive.indices[3 * t + k]);
  }
  return soup;
}

}  // namespace

double weightedArea(const Scene& scene, const Instance& instance) {
  double sum = 0;
  forEachReceiving(scene, instance,
                   [&sum](const Vec3d& a, const Vec3d& b, const Vec3d& c) { sum += triangleArea(a, b, c); });
  const double scale = instance.settings.texelDensityScale;
  return sum * scale * scale;
}

double weightedLength(const Scene& scene, const Instance& instance) {
  double squared = 0;
  forEachReceiving(scene, instance, [&squared](const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    for (const Vec3d& edge : {b - a, c - b, a - c}) squared = std::max(squared, glm::dot(edge, edge));
  });
  return std::sqrt(squared) * static_cast<double>(instance.settings.texelDensityScale);
}

ObjectLayouts layOutObjects(const Scene& scene, const std::vector<int>& instances, const std::vector<bool>& ownUvs,
                            double texelsPerMeter, const UnwrapOptions& options, Progress& progress) {
  ObjectLayouts result;
  std::vector<Shape> shapes;
  for (const int i : instances) shapes.push_back(shapeOf(scene.instances[static_cast<std::size_t>(i)], texelsPerMeter));
  std::vector<std::size_t> order(instances.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  // The largest of a mesh's instances leads: a flattening is only ever scaled down, so its charts fit a page.
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return shapes[a].mesh != shapes[b].mesh ? shapes[a].mesh < shapes[b].mesh : shapes[a].scale > shapes[b].scale;
  });
  std::vector<std::size_t> leaders;
  result.uses.resize(instances.size());
  std::size_t firstOfMesh = 0;
  for (const std::size_t i : order) {
    if (!leaders.empty() && shapes[leaders.back()].mesh != shapes[i].mesh) firstOfMesh = leaders.size();
    std::size_t layout = firstOfMesh;
    while (layout < leaders.size() && !sameShape(shapes[leaders[layout]], shapes[i])) ++layout;
    if (layout == leaders.size()) leaders.push_back(i);
    const double leading = shapes[leaders[layout]].scale;
    result.uses[i] = {instances[i], layout, leading > 0 ? shapes[i].scale / leading : 1.0};
  }

  result.layouts.resize(leaders.size());
  parallelFor(leaders.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last && !progress.cancelled(); ++i) {
      ObjectLayout& layout = result.layouts[i];
      const Instance& instance = scene.instances[static_cast<std::size_t>(instances[leaders[i]])];
      layout.source = receivingTriangles(scene, instance);
      if (ownUvs[static_cast<std::size_t>(instance.mesh)]) {
        layout.own = measureOwnUvs(scene, instance, texelsPerMeter);
        layout.unwrapped = boxChart(*layout.own, layout.source.size());
      } else {
        layout.unwrapped = unwrap(makeSoup(scene, instance, texelsPerMeter), options);
      }
      progress.advance(layout.source.size());
    }
  });
  return result;
}

}  // namespace lumel
