#include "scene/triangles/sky_dome.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <string>

namespace lumel {
namespace {

/// A dome may end a little above the lowest floor, and its facets cut corners.
constexpr float kRoundness = 0.1f;
/// Fewer corners than a coarse half sphere has tell of no roundness: those of any box lie on a sphere.
constexpr std::size_t kLeastRoundCorners = 20;

struct Bounds {
  Vec3 least{std::numeric_limits<float>::max()};
  Vec3 most{-std::numeric_limits<float>::max()};

  void add(const Vec3& p) {
    least = glm::min(least, p);
    most = glm::max(most, p);
  }
  bool empty() const { return least.x > most.x; }
  /// Encloses `inner` from the sides and above.
  bool encloses(const Bounds& inner) const {
    return least.x < inner.least.x && least.z < inner.least.z && most.x > inner.most.x && most.z > inner.most.z &&
           most.y > inner.most.y;
  }
};

template <class Visit>
void forEachVertex(const Scene& scene, const Instance& instance, const Visit& visit) {
  for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives)
    for (const Vec3& position : primitive.positions) visit(Vec3(instance.worldFromObject * Vec4(position, 1.0f)));
}

bool isRound(const Scene& scene, const Instance& instance, const Bounds& bounds) {
  const float radius = 0.25f * (bounds.most.x - bounds.least.x + bounds.most.z - bounds.least.z);
  Vec3 centre = 0.5f * (bounds.least + bounds.most);
  centre.y = bounds.most.y - radius;  // of a whole sphere as of its upper part
  std::size_t vertices = 0;
  bool round = true;
  forEachVertex(scene, instance, [&](const Vec3& p) {
    ++vertices;
    round = round && std::abs(glm::length(p - centre) - radius) <= kRoundness * radius;
  });
  return round && vertices >= kLeastRoundCorners;
}

bool namesSky(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name.find("sky") != std::string::npos;
}

}  // namespace

std::vector<int> findSkyDomes(const Scene& scene) {
  std::vector<Bounds> bounds(scene.instances.size());
  for (std::size_t i = 0; i < scene.instances.size(); ++i)
    forEachVertex(scene, scene.instances[i], [&](const Vec3& p) { bounds[i].add(p); });
  std::vector<int> domes;
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (!instance.settings.casts || bounds[i].empty()) continue;
    bool unlit = true, shines = false;
    for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
      const Material& material = scene.materials[static_cast<std::size_t>(primitive.material)];
      unlit = unlit && material.unlit;
      shines = shines || (material.emission != Vec3(0.0f) && !material.unlit);
    }
    if (shines || !(unlit || namesSky(instance.name) || isRound(scene, instance, bounds[i]))) continue;
    Bounds rest;
    for (std::size_t k = 0; k < bounds.size(); ++k) {
      // A dome of clouds may lie inside of one of sky.
      if (k == i || bounds[k].empty() || bounds[k].encloses(bounds[i])) continue;
      rest.add(bounds[k].least);
      rest.add(bounds[k].most);
    }
    if (!rest.empty() && bounds[i].encloses(rest)) domes.push_back(static_cast<int>(i));
  }
  return domes;
}

}  // namespace lumel
