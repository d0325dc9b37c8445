// Light sources as next-event estimation sees them: punctual lights and emissive triangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baker/light/light_tree.h"
#include "baker/rays/lanes.h"
#include "baker/rays/materials.h"
#include "baker/rays/ray_scene.h"
#include "baker/rays/sample_lanes.h"
#include "scene/scene.h"

namespace lumel {

/// One light sample as seen from a point, before visibility.
struct LightSample {
  Vec3 wi{0, 0, 1};  // unit, towards the light
  Vec3 weight{0};    // radiance over the density of choosing this direction; for punctual lights irradiance on a facing
                     // surface over the probability of choosing the light. Zero: nothing arrives
  float pdf = 0.0f;  // density per solid angle; 0 for punctual lights, which no ray can hit
  bool distant = false;
  Vec3 target{0};  // end of the shadow ray, already off the light's own surface; unless distant
};

/// One light sample of every lane.
struct alignas(64) LightSampleLanes {
  Vec3Lanes wi, weight, target;
  float pdf[kLanes];
  int distant[kLanes];

  void set(std::size_t lane, const LightSample& sample) {
    wi.set(lane, sample.wi);
    weight.set(lane, sample.weight);
    target.set(lane, sample.target);
    pdf[lane] = sample.pdf;
    distant[lane] = sample.distant ? 1 : 0;
  }
};

/// The points of a wave that receive light, both normals on the side that it is gathered on; a view.
struct ReceiverLanes {
  const LaneFlags& active;
  const Vec3Lanes& p;
  const Vec3Lanes& ng;
  const Vec3Lanes& ns;
  const Vec3Lanes& rayStart;
};

/// Point, spot and directional lights (KHR_lights_punctual).
class PunctualLights {
 public:
  PunctualLights() = default;
  /// Lights that can send nothing are dropped. Directional lights come first.
  explicit PunctualLights(const std::vector<Light>& lights);

  bool empty() const { return lights_.empty(); }
  std::size_t size() const { return lights_.size(); }
  std::size_t directional() const { return directional_; }

  /// Density over lights: in proportion to what arrives unshadowed from each above the surface, up to a cosine
  /// ((1 + 2 cosTheta) / 3, so that the tilted basis vectors' weights stay bounded). Beyond kLocalLights a tree
  /// (LightTree) estimates that for groups of lights.
  LightSample sample(const Vec3& p, const Vec3& n, float u) const { return choose(0, p, n, u); }
  void sample(const ReceiverLanes& at, const UnitLanes& u, LightSampleLanes& samples) const {
    choose(0, at, u, samples);
  }
  /// The same, without the directional lights.
  LightSample sampleNear(const Vec3& p, const Vec3& n, float u) const { return choose(directional_, p, n, u); }
  void sampleNear(const ReceiverLanes& at, const UnitLanes& u, LightSampleLanes& samples) const {
    choose(directional_, at, u, samples);
  }
  /// What light `index` brings, without a choice.
  LightSample sampleOne(std::size_t index, const Vec3& p) const;
  void sampleOne(std::size_t index, const Vec3Lanes& p, LightSampleLanes& samples) const;

  static constexpr std::size_t kLocalLights = 32;

  /// A light, ready to be asked. What shines all around has a cone that holds every direction.
  struct Source {
    explicit Source(const Light& light);
    /// facingIrradiance.
    Vec3 facing(const Vec3& p, Vec3& wi) const;

    bool distant = false;
    Vec3 power{0};  // colour times candela or lux
    Vec3 position{0};
    Vec3 direction{0};
    float perRange2 = 0.0f;
    float cosOuter = -2.0f;
    float perCone = 1.0f;
  };

 private:
  LightSample choose(std::size_t first, const Vec3& p, const Vec3& n, float u) const;
  void choose(std::size_t first, const ReceiverLanes& at, const UnitLanes& u, LightSampleLanes& samples) const;
  LightTree::Choice chooseOne(std::size_t first, const Vec3& p, const Vec3& n, float u) const;
  LightTree::Choice chooseAmong(std::size_t first, std::size_t end, float treeImportance, const Vec3& p, const Vec3& n,
                                float u) const;
  /// The lights that the lanes chose, and with which probability.
  struct Chosen;
  static void chooseAmongFew(std::span<const Source> few, const ReceiverLanes& at, const UnitLanes& u, Chosen& chosen);
  static void sampleChosen(const Chosen& chosen, const Vec3Lanes& p, LightSampleLanes& samples);
  float importance(std::size_t light, const Vec3& p, const Vec3& n) const;

  std::vector<Source> lights_;
  std::size_t directional_ = 0;
  LightTree tree_;  // over lights_, only with more than kLocalLights that are not directional
};

/// Irradiance that a punctual light brings to a surface at p that faces it: colour * candela / d^2 with the range
/// window and the cone, or colour * lux. `wi` becomes the direction towards it.
Vec3 facingIrradiance(const Light& light, const Vec3& p, Vec3& wi);

/// All triangles of casting instances with an emissive material, as one area light.
class EmissiveTriangles {
 public:
  EmissiveTriangles() = default;
  /// Finds them and sets ScenePart::firstEmitter.
  EmissiveTriangles(RayScene& rays, const Materials& materials);

  bool empty() const { return tree_.empty(); }
  std::size_t size() const { return triangles_.size(); }

  /// Density: over triangles by what they can bring to p unshadowed, estimated for groups of them (LightTree) and for
  /// the few of a group by mean emitted luminance (roughly, over the texture) times solid angle; within a triangle
  /// uniform by solid angle where that is not small, else by area. Emission from the front alone unless the material
  /// is doubleSided, times opacity.
  LightSample sample(const Vec3& p, float uTriangle, Vec2 uPoint) const;
  /// The same for all lanes that are `active`; the others' weight is zero.
  void sample(const Vec3Lanes& p, const LaneFlags& active, const UnitLanes& uTriangle, const UnitSquareLanes& uPoint,
              LightSampleLanes& samples) const;

  /// The density per solid angle with which sample() from `origin` takes the point that a ray hit. Zero for triangles
  /// that are never chosen.
  float pdf(const HitSurface& hit, const Vec3& origin) const;

  /// Triangles that look smaller, in steradians, are sampled by area, which is quicker and nearly the same; and so are
  /// those that fill nearly a hemisphere, where spherical triangles degenerate.
  static constexpr float kLeastSolidAngle = 0.03f;
  static constexpr float kMostSolidAngle = 6.2f;

 private:
  /// Begins with a row of 16 floats, to be turned into lanes.
  struct alignas(64) Emitter {
    Vec3 corner{0};  // world
    float doubleArea = 0.0f;
    Vec3 e1{0};              // to the other corners
    float luminance = 0.0f;  // mean of what it sends out
    Vec3 e2{0};
    float back = 0.0f;          // 1: it shines from behind too
    Vec3 ng{0};                 // unit, front
    float offsetMeters = 0.0f;  // of the ends of shadow rays
    Vec3 radiance{0};
    bool uniform = false;  // it sends out `radiance` everywhere
    std::uint32_t part = 0;
    std::uint32_t triangle = 0;
  };
  /// Fills all from the part and the triangle.
  void describe(Emitter& emitter) const;
  Vec3 radianceAt(const Emitter& emitter, Vec2 barycentric) const;
  /// The emitters that the lanes chose, and with which probability.
  struct Chosen;
  static void chooseAmongFew(std::span<const Emitter> few, const Vec3Lanes& p, const UnitLanes& u, Chosen& chosen);
  static void chooseInLeaves(const Emitter* triangles, const std::array<LaneFlags, LightTree::kLeaf>& lights,
                             const LightTree::Descent& descent, const Vec3Lanes& p, Chosen& chosen);
  static void samplePoints(const Vec3Lanes& p, const UnitSquareLanes& u, Chosen& chosen, LightSampleLanes& samples);
  /// For the choice.
  float importance(std::uint32_t triangle, const Vec3& p) const;

  const RayScene* rays_ = nullptr;
  const Materials* materials_ = nullptr;
  std::vector<Emitter> triangles_;
  LightTree tree_;
  std::vector<Emitter> few_;  // all that can be chosen, where one leaf of the tree holds them
  bool uniform_ = true;       // all are
};

/// Radiance that leaves a surface found by a ray towards the ray's origin.
Vec3 emittedTowardsRay(const Materials& materials, const HitSurface& hit);

}  // namespace lumel
