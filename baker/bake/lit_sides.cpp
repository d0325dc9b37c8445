#include "baker/bake/lit_sides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "baker/bake/bake.h"
#include "baker/light/lit_scene.h"
#include "baker/rays/materials.h"
#include "baker/rays/ray_scene.h"
#include "baker/rays/sampling.h"
#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"
#include "scene/base/sobol.h"
#include "scene/base/union_find.h"
#include "scene/triangles/triangles.h"

namespace lumel {
namespace {

/// A front is in the dark if it has less than this share of its back's light: rooms by candlelight are not. Light leaks
/// into solids that are not quite closed; there it is enough to be darker, for patches wound against the lit ones
/// around them.
constexpr double kDark = 1e-6;
constexpr double kDarkAgainstOthers = 0.5;
/// First for all fronts; then, where they got less than that share of the mean, for both sides. Light has to find its
/// way through doors, not to be converged.
constexpr int kFirstSamples = 16;
constexpr int kSureSamples = 512;
constexpr int kBounces = 8;
/// Places of a mesh that are looked at.
constexpr int kMostPlaces = 8;

/// One double-sided primitive and its patches.
struct TwoSided {
  int mesh = 0;
  int primitive = 0;
  std::uint32_t firstPatch = 0;  // patches are counted over all primitives
  std::uint32_t patchCount = 0;
  std::vector<std::uint32_t> patchOf;                 // per triangle
  std::vector<std::array<std::uint32_t, 2>> opposed;  // patches that share an edge and are wound unlike
};

/// Fills in all that counts patches, from found.firstPatch on.
void findPatches(const Primitive& primitive, TwoSided& found) {
  struct Edge {
    std::uint32_t low, high;
    std::uint32_t triangle;
    bool rising;
  };
  const std::vector<std::uint32_t> welded = weldPositions(primitive.positions);
  std::vector<Edge> edges;
  edges.reserve(primitive.indices.size());
  for (std::uint32_t t = 0; t < primitive.triangleCount(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = welded[primitive.indices[std::size_t{3} * t + k]];
      const std::uint32_t b = welded[primitive.indices[std::size_t{3} * t + (k + 1) % 3]];
      edges.push_back({std::min(a, b), std::max(a, b), t, a < b});
    }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  // Borders between two triangles alone: where more meet, nothing follows from how they are wound.
  const auto forEachBorder = [&](auto&& visit) {
    for (std::size_t i = 0, end = 0; i < edges.size(); i = end) {
      while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) ++end;
      if (end - i == 2) visit(edges[i].triangle, edges[i + 1].triangle, edges[i].rising != edges[i + 1].rising);
    }
  };
  std::vector<std::uint32_t> groups(primitive.triangleCount());
  std::iota(groups.begin(), groups.end(), 0u);
  forEachBorder([&](std::uint32_t a, std::uint32_t b, bool alike) {
    if (alike) unite(groups, a, b);
  });
  found.patchOf.resize(primitive.triangleCount());
  for (std::uint32_t t = 0; t < found.patchOf.size(); ++t) {
    const std::uint32_t group = findRoot(groups, t);  // named after its first triangle
    found.patchOf[t] = group == t ? found.firstPatch + found.patchCount++ : found.patchOf[group];
  }
  forEachBorder([&](std::uint32_t a, std::uint32_t b, bool alike) {
    if (!alike) found.opposed.push_back({found.patchOf[a], found.patchOf[b]});
  });
}

std::vector<TwoSided> findTwoSided(const Scene& scene) {
  std::vector<TwoSided> found;
  std::uint32_t patches = 0;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m)
    for (std::size_t p = 0; p < scene.meshes[m].primitives.size(); ++p) {
      const Primitive& primitive = scene.meshes[m].primitives[p];
      const Material& material = scene.materials[static_cast<std::size_t>(primitive.material)];
      if (!material.doubleSided || material.unlit || material.alphaMode != AlphaMode::Opaque) continue;
      TwoSided twoSided{static_cast<int>(m), static_cast<int>(p), patches, 0, {}, {}};
      findPatches(primitive, twoSided);
      patches += twoSided.patchCount;
      found.push_back(std::move(twoSided));
    }
  return found;
}

/// What is to be measured: sides of patches, 2 * patch for its front and 2 * patch + 1 for its back.
using Sides = std::vector<bool>;

/// An atlas on which every side that is asked for has one texel for each place of its mesh. Its triangles lie there one
/// upon another, each as large as it is.
class SideAtlas {
 public:
  SideAtlas(const Scene& scene, const std::vector<TwoSided>& primitives, const Sides& asked) {
    std::vector<int> places(scene.meshes.size(), 0);
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
      const Instance& instance = scene.instances[i];
      if (!instance.settings.receives) continue;
      if (++places[static_cast<std::size_t>(instance.mesh)] > kMostPlaces) continue;
      for (const TwoSided& primitive : primitives) {
        if (primitive.mesh != instance.mesh) continue;
        for (const std::uint32_t back : {0u, 1u}) add(scene, static_cast<int>(i), primitive, asked, back);
      }
    }
    layOut();
  }

  /// Per side: the sum of its texels' light.
  Expected<std::vector<double>> light(const LitScene& scene, const Sides& asked, int samples,
                                      Progress& progress) const {
    std::vector<double> sums(asked.size(), 0.0);
    if (texels_.empty()) return sums;
    const BakeOptions options{
        .integrator = Integrator::Path, .samples = samples, .bounces = kBounces, .encoding = flatEncoding()};
    const auto baked = bake(scene, atlas_, findTexels(atlas_), options, progress);
    if (!baked) return baked.error();
    const Image& flat = baked->pages[0].flat;
    for (std::size_t i = 0; i < texels_.size(); ++i) {
      const float* pixel = flat.at(static_cast<int>(i) % flat.width, static_cast<int>(i) / flat.width);
      sums[texels_[i].side] += static_cast<double>(luminance({pixel[0], pixel[1], pixel[2]}));
    }
    return sums;
  }

 private:
  struct Texel {
    std::uint32_t side = 0;
    float largest = 0.0f;  // twice the area of its largest triangle
  };
  struct Placed {
    std::uint32_t texel = 0;
    float twiceArea = 0.0f;
  };

  void add(const Scene& scene, int instance, const TwoSided& twoSided, const Sides& asked, std::uint32_t back) {
    const Mat4& worldFromObject = scene.instances[static_cast<std::size_t>(instance)].worldFromObject;
    const bool mirrors = glm::determinant(Mat3(worldFromObject)) < 0.0f;
    const Primitive& primitive = scene.primitive(twoSided.mesh, twoSided.primitive);
    Surface surface;
    surface.instance = instance;
    surface.primitive = twoSided.primitive;
    constexpr std::uint32_t kNone = ~0u;
    std::vector<std::uint32_t> texelOf(twoSided.patchCount, kNone);
    for (std::uint32_t t = 0; t < primitive.triangleCount(); ++t) {
      const std::uint32_t side = 2 * twoSided.patchOf[t] + back;
      if (!asked[side]) continue;
      std::array<Vec3, 3> corners;
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] = Vec3(worldFromObject * Vec4(primitive.positions[primitive.indices[std::size_t{3} * t + k]], 1.0f));
      if (mirrors != (back == 1)) std::swap(corners[1], corners[2]);
      const Vec3 cross = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
      const float twiceArea = glm::length(cross);
      if (!(twiceArea > 0.0f)) continue;
      std::uint32_t& texel = texelOf[twoSided.patchOf[t] - twoSided.firstPatch];
      if (texel == kNone) {
        texel = static_cast<std::uint32_t>(texels_.size());
        texels_.push_back({side, 0.0f});
      }
      texels_[texel].largest = std::max(texels_[texel].largest, twiceArea);
      triangles_.push_back({texel, twiceArea});
      const Frame frame = frameAround(cross / twiceArea);
      for (const Vec3& corner : corners) {
        surface.indices.push_back(static_cast<std::uint32_t>(surface.positions.size()));
        surface.positions.push_back(corner);
      }
      surface.normals.insert(surface.normals.end(), 3, frame.n);
      surface.tangents.insert(surface.tangents.end(), 3, Vec4(frame.t, 1.0f));
      surface.sourceVertex.insert(surface.sourceVertex.end(), 3, 0);
      surface.sourceTriangle.push_back(t);
      surface.charts.push_back(0);
    }
    if (!surface.indices.empty()) atlas_.surfaces.push_back(std::move(surface));
  }

  void layOut() {
    const auto width =
        static_cast<std::uint32_t>(std::max(1.0, std::ceil(std::sqrt(static_cast<double>(texels_.size())))));
    atlas_.pages.push_back({static_cast<int>(width), static_cast<int>(width)});
    atlas_.charts.emplace_back();
    std::size_t next = 0;
    for (Surface& surface : atlas_.surfaces)
      for (std::size_t t = 0; t < surface.triangleCount(); ++t) {
        const Placed& placed = triangles_[next++];
        const float leg = 0.9f * std::sqrt(placed.twiceArea / texels_[placed.texel].largest);
        const Vec2 corner = Vec2(placed.texel % width, placed.texel / width) + Vec2(0.05f);
        for (const Vec2& at : {corner, corner + Vec2(leg, 0.0f), corner + Vec2(0.0f, leg)})
          surface.lightmapUvs.push_back(at / static_cast<float>(width));
      }
  }

  Atlas atlas_;
  std::vector<Texel> texels_;      // row by row
  std::vector<Placed> triangles_;  // of all surfaces, in order
};

/// Tells for each patch whether its front faces something right behind it while its back is open: a sign on a wall that
/// is wound towards the wall. Nobody sees such a front, however much light finds its way between.
class HiddenFronts {
 public:
  HiddenFronts(const Scene& scene, const RayScene& rays) : scene_(scene), rays_(rays) {}

  void find(const TwoSided& twoSided, std::vector<bool>& hidden) const {
    std::vector<std::vector<std::uint32_t>> triangles(twoSided.patchCount);
    for (std::uint32_t t = 0; t < twoSided.patchOf.size(); ++t)
      triangles[twoSided.patchOf[t] - twoSided.firstPatch].push_back(t);
    const auto place = std::find_if(scene_.instances.begin(), scene_.instances.end(), [&](const Instance& instance) {
      return instance.settings.receives && instance.mesh == twoSided.mesh;
    });
    if (place == scene_.instances.end()) return;
    for (std::uint32_t i = 0; i < twoSided.patchCount; ++i) {
      const double front = nearShare(*place, twoSided, triangles[i], 1.0f);
      if (front >= kHiddenShare && nearShare(*place, twoSided, triangles[i], -1.0f) <= kOpenShare)
        hidden[twoSided.firstPatch + i] = true;
    }
  }

 private:
  /// The share of cosine-distributed rays from a side of a patch that end before a person's head would have room.
  double nearShare(const Instance& instance, const TwoSided& twoSided, const std::vector<std::uint32_t>& triangles,
                   float side) const {
    const Primitive& primitive = scene_.primitive(twoSided.mesh, twoSided.primitive);
    const float turned = glm::determinant(Mat3(instance.worldFromObject)) < 0.0f ? -side : side;
    std::size_t rays = 0, nears = 0;
    for (std::uint32_t packet = 0; packet < kPackets; ++packet) {
      RayPacket sent;
      for (int lane = 0; lane < kLanes; ++lane) {
        const std::uint32_t n = packet * kLanes + static_cast<std::uint32_t>(lane);
        const std::uint32_t* corner = primitive.indices.data() + std::size_t{3} * triangles[n % triangles.size()];
        std::array<Vec3, 3> at;
        for (std::size_t k = 0; k < 3; ++k)
          at[k] = Vec3(instance.worldFromObject * Vec4(primitive.positions[corner[k]], 1.0f));
        const Vec3 cross = turned * glm::cross(at[1] - at[0], at[2] - at[0]);
        if (!(glm::length(cross) > 0.0f)) continue;
        const Vec3 normal = glm::normalize(cross);
        const std::uint32_t seed = hashCombine(twoSided.firstPatch, n);
        const Vec2 b = sampleTriangle({unitFloat(seed), unitFloat(hashCombine(seed, 1))});
        const Vec3 dir = frameAround(normal).fromLocal(
            sampleCosineHemisphere({unitFloat(hashCombine(seed, 2)), unitFloat(hashCombine(seed, 3))}));
        const Vec3 p = at[0] + b.x * (at[1] - at[0]) + b.y * (at[2] - at[0]);
        sent.set(lane,
                 offsetPoint(p, normal, at, rays_.translationOf(static_cast<int>(&instance - scene_.instances.data()))),
                 dir);
      }
      rays_.intersect(sent, TraceMode::Packet);
      for (int lane = 0; lane < kLanes; ++lane) {
        rays += sent.valid[lane] != 0 ? 1 : 0;
        nears += sent.hit(lane) && sent.rayhit.ray.tfar[lane] < kNobodyLooks ? 1 : 0;
      }
    }
    return rays == 0 ? 0.0 : static_cast<double>(nears) / static_cast<double>(rays);
  }

  static constexpr std::uint32_t kPackets = 16;
  /// Metres in which there is no room for a head and eyes; a sign this far from its wall sends five of six rays into
  /// it.
  static constexpr float kNobodyLooks = 0.5f;
  static constexpr double kHiddenShare = 0.6;
  static constexpr double kOpenShare = 0.3;
  const Scene& scene_;
  const RayScene& rays_;
};

/// Turns the triangles of dark patches; their vertices become their own. Returns how many they are.
std::size_t turn(Primitive& primitive, const std::vector<std::uint32_t>& patchOf, const std::vector<bool>& dark) {
  std::size_t turned = 0;
  const auto vertices = static_cast<std::uint32_t>(primitive.positions.size());
  std::vector<std::uint32_t> source(vertices);
  std::iota(source.begin(), source.end(), 0u);
  std::vector<std::uint32_t> copyOf(vertices, 0);  // 0: none, since copies come after the first vertex
  for (std::size_t t = 0; t < primitive.triangleCount(); ++t) {
    if (!dark[patchOf[t]]) continue;
    ++turned;
    std::uint32_t* corner = primitive.indices.data() + 3 * t;
    for (int k = 0; k < 3; ++k) {
      std::uint32_t& copy = copyOf[corner[k]];
      if (copy == 0) {
        copy = static_cast<std::uint32_t>(source.size());
        source.push_back(corner[k]);
      }
      corner[k] = copy;
    }
    std::swap(corner[1], corner[2]);
  }
  if (turned == 0) return 0;
  gatherVertices(primitive, source);
  for (std::size_t v = vertices; v < source.size(); ++v) {
    if (!primitive.normals.empty()) primitive.normals[v] *= -1.0f;
    // All of the frame is reversed, as the specification reverses the normal that a normal map gave: the bitangent,
    // w * cross(n, t), too.
    if (!primitive.tangents.empty()) primitive.tangents[v] *= -1.0f;
  }
  dropUnusedVertices(primitive);
  return turned;
}

double area(const Primitive& primitive, std::size_t triangle) {
  const std::uint32_t* corner = primitive.indices.data() + 3 * triangle;
  const Vec3& p = primitive.positions[corner[0]];
  return 0.5 * static_cast<double>(
                   glm::length(glm::cross(primitive.positions[corner[1]] - p, primitive.positions[corner[2]] - p)));
}

/// The patches that are wound against those around them: of a set joined by `opposed`, the ones on the side whose
/// fronts have less light in all.
std::vector<bool> findOdd(const Scene& scene, const std::vector<TwoSided>& primitives,
                          const std::vector<double>& light) {
  const std::size_t patches = light.size() / 2;
  std::vector<std::vector<std::uint32_t>> opposed(patches);
  std::vector<double> flux(patches, 0.0);
  for (const TwoSided& p : primitives) {
    const Primitive& primitive = scene.primitive(p.mesh, p.primitive);
    for (std::size_t t = 0; t < p.patchOf.size(); ++t)
      flux[p.patchOf[t]] += area(primitive, t) * light[2 * std::size_t{p.patchOf[t]}];
    for (const auto& [a, b] : p.opposed) {
      opposed[a].push_back(b);
      opposed[b].push_back(a);
    }
  }
  std::vector<bool> odd(patches, false);
  std::vector<int> wound(patches, 0);  // 1 or -1; 0: not visited
  std::vector<std::uint32_t> set;
  for (std::uint32_t seed = 0; seed < patches; ++seed) {
    if (wound[seed] != 0) continue;
    wound[seed] = 1;
    set.assign(1, seed);
    double balance = 0.0;
    for (std::size_t i = 0; i < set.size(); ++i) {
      balance += wound[set[i]] * flux[set[i]];
      for (const std::uint32_t next : opposed[set[i]])
        if (wound[next] == 0) {
          wound[next] = -wound[set[i]];
          set.push_back(next);
        }
    }
    for (const std::uint32_t patch : set) odd[patch] = wound[patch] * balance < 0.0;
  }
  return odd;
}

/// Says nothing of bakes that the user did not ask for, but lets them be stopped.
class Unseen : public Progress {
 public:
  explicit Unseen(const Progress& shown) : shown_(shown) {}
  bool cancelled() const override { return shown_.cancelled(); }

 private:
  const Progress& shown_;
};

}  // namespace

Expected<std::size_t> turnToLight(Scene& scene, const Progress& progress) {
  const std::vector<TwoSided> primitives = findTwoSided(scene);
  if (primitives.empty()) return std::size_t{0};
  const std::size_t patches = std::size_t{primitives.back().firstPatch} + primitives.back().patchCount;
  Unseen unseen(progress);
  auto lit = LitScene::build(scene, kBounces != 0);
  if (!lit) return lit.error();
  const auto measure = [&](const Sides& asked, int samples) {
    return SideAtlas(scene, primitives, asked).light(**lit, asked, samples, unseen);
  };
  Sides asked(2 * patches);
  for (std::size_t i = 0; i < patches; ++i) asked[2 * i] = true;
  auto light = measure(asked, kFirstSamples);
  if (!light) return light.error();
  const double mean = std::accumulate(light->begin(), light->end(), 0.0) / static_cast<double>(patches);
  const std::vector<bool> odd = findOdd(scene, primitives, *light);
  for (std::size_t i = 0; i < patches; ++i)
    asked[2 * i] = asked[2 * i + 1] = (*light)[2 * i] <= (odd[i] ? kDarkAgainstOthers : kDark) * mean;
  light = measure(asked, kSureSamples);
  if (!light) return light.error();
  lit->reset();  // it refers to the triangles that are turned now

  std::vector<bool> dark(patches);
  for (std::size_t i = 0; i < patches; ++i)
    dark[i] = (*light)[2 * i] < (odd[i] ? kDarkAgainstOthers : kDark) * (*light)[2 * i + 1];
  std::vector<std::string> notes;
  const Materials materials(scene, false, notes);
  const auto rays = RayScene::build(scene, materials);
  if (!rays) return rays.error();
  const HiddenFronts fronts(scene, **rays);
  for (const TwoSided& p : primitives) fronts.find(p, dark);

  std::size_t turned = 0;
  for (const TwoSided& p : primitives)
    turned += turn(scene.meshes[static_cast<std::size_t>(p.mesh)].primitives[static_cast<std::size_t>(p.primitive)],
                   p.patchOf, dark);
  return turned;
}

}  // namespace lumel
