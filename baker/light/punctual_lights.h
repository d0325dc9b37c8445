// The lamps of a scene (Light) as next-event estimation sees them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baker/light/learnt_choice.h"
#include "baker/light/light_sample.h"
#include "baker/light/light_shapes.h"
#include "baker/light/light_tree.h"
#include "baker/rays/lanes.h"
#include "baker/rays/sample_lanes.h"
#include "scene/scene.h"

namespace lumel {

class PunctualLights {
 public:
  PunctualLights() = default;
  /// Lights that can send nothing are dropped. Directional lights come first. `ofMode` says of a mode whether its
  /// lights count; null: all do.
  explicit PunctualLights(const std::vector<Light>& lights, bool (*ofMode)(LightMode) = nullptr);

  bool empty() const { return lights_.empty(); }
  std::size_t size() const { return lights_.size(); }
  std::size_t directional() const { return directional_; }
  /// Tells whether some are more than points (LightShape). Then what samples takes `points`, uniform in the unit square
  /// and independent of u; else they may be null.
  bool hasShapes() const { return !shapes_.empty(); }

  /// Density over lights: in proportion to what arrives unshadowed from each above the surface, up to a cosine
  /// ((1 + 2 cosTheta) / 3, so that the tilted basis vectors' weights stay bounded). Beyond kLocalLights a tree
  /// (LightTree) estimates that for groups of lights.
  void sample(const ReceiverLanes& at, const UnitLanes& u, LightSampleLanes& samples,
              const UnitSquareLanes* points = nullptr) const {
    choose(0, at, u, points, samples);
  }
  /// Lights that a LearntChoice tells apart: each by itself where there are at most kLocalLights; else each directional
  /// one, and all others as one group.
  std::size_t groups() const { return tree_.empty() ? lights_.size() : directional_ + 1; }
  /// Samples as above, but chooses the group as `learnt` says. `chosen` becomes the group of each lane's light.
  void sample(const ReceiverLanes& at, const UnitLanes& u, const LearntChoice& learnt, LightSampleLanes& samples,
              LaneFlags& chosen, const UnitSquareLanes* points = nullptr) const;
  /// Samples as above, without the directional lights.
  void sampleNear(const ReceiverLanes& at, const UnitLanes& u, LightSampleLanes& samples,
                  const UnitSquareLanes* points = nullptr) const {
    choose(directional_, at, u, points, samples);
  }
  /// Samples light `index` without a choice.
  void sampleOne(std::size_t index, const ReceiverLanes& at, LightSampleLanes& samples,
                 const UnitSquareLanes* points = nullptr) const;
  /// Samples what reaches p of a light with a place: `facing` becomes radiance over density, or the irradiance on a
  /// facing surface, from the unit direction wi; `target` is the end of the shadow ray.
  void sampleAt(std::size_t index, const Vec3& p, const Vec2& u, Vec3& wi, Vec3& target, Vec3& facing) const;
  /// Tells whether a light may be taken as two within `reach` (NearLight): it is small against that.
  bool isSmall(std::size_t index, float reach) const {
    const int shape = lights_[index].shape;
    return shape < 0 || shapes_[static_cast<std::size_t>(shape)].boundRadius() < reach;
  }

  /// Returns the lights with a place within `distance` of p, in their order.
  std::vector<std::size_t> around(const Vec3& p, float distance) const;

  static constexpr std::size_t kLocalLights = 32;

  /// A light as sampling reads it. What shines all around has a cone that holds every direction.
  struct Source {
    explicit Source(const Light& light);
    /// Returns facingIrradiance of the light.
    Vec3 facing(const Vec3& p, Vec3& wi) const;

    bool distant = false;
    Vec3 power{0};  // colour times candela or lux
    Vec3 position{0};
    Vec3 direction{0};
    float perRange2 = 0.0f;
    float cosOuter = -2.0f;
    float perCone = 1.0f;
    int shape = -1;  // into shapes_; -1: a point, which the members above say all of
  };
  const Source& source(std::size_t index) const { return lights_[index]; }

 private:
  /// Holds the lights that the lanes chose, and the probability of each choice.
  struct Chosen;
  void choose(std::size_t first, const ReceiverLanes& at, const UnitLanes& u, const UnitSquareLanes* points,
              LightSampleLanes& samples) const;
  void chooseWithTree(std::size_t first, const ReceiverLanes& at, const UnitLanes& u, const LearntChoice* learnt,
                      Chosen& chosen) const;
  std::size_t chooseGroup(std::span<const float> unshadowed, const LearntChoice* learnt, float& u,
                          float& probability) const;
  void sampleChosen(Chosen& chosen, const ReceiverLanes& at, const UnitSquareLanes* points,
                    LightSampleLanes& samples) const;
  /// Samples the shape in place of its lane's point light.
  void sampleShape(const LightShape& shape, std::size_t lane, float probability, const ReceiverLanes& at,
                   const UnitSquareLanes& points, LightSampleLanes& samples) const;
  void chooseAmongFew(std::span<const Source> few, const ReceiverLanes& at, const UnitLanes& u, Chosen& chosen) const;
  static void sampleChosen(const Chosen& chosen, const Vec3Lanes& p, LightSampleLanes& samples);
  float importance(std::size_t light, const Vec3& p, const Vec3& n) const;

  std::vector<Source> lights_;
  std::size_t directional_ = 0;
  std::vector<std::uint32_t> byX_;  // lights with a place, by their x
  std::vector<LightShape> shapes_;
  LightTree tree_;  // over lights_, only with more than kLocalLights that are not directional
};

/// Returns the irradiance that a punctual light brings to a surface at p that faces it: colour * candela / d^2 with the
/// range window and the cone, or colour * lux. `wi` becomes the direction towards it.
Vec3 facingIrradiance(const Light& light, const Vec3& p, Vec3& wi);

}  // namespace lumel
