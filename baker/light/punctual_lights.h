// Point, spot and directional lights (KHR_lights_punctual) as next-event estimation sees them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baker/light/learnt_choice.h"
#include "baker/light/light_sample.h"
#include "baker/light/light_tree.h"
#include "baker/rays/lanes.h"
#include "baker/rays/sample_lanes.h"
#include "scene/scene.h"

namespace lumel {

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
  void sample(const ReceiverLanes& at, const UnitLanes& u, LightSampleLanes& samples) const {
    choose(0, at, u, samples);
  }
  /// Lights that a LearntChoice tells apart: each by itself where there are at most kLocalLights; else each directional
  /// one, and all others as one group.
  std::size_t groups() const { return tree_.empty() ? lights_.size() : directional_ + 1; }
  /// Samples as above, but chooses the group as `learnt` says. `chosen` becomes the group of each lane's light.
  void sample(const ReceiverLanes& at, const UnitLanes& u, const LearntChoice& learnt, LightSampleLanes& samples,
              LaneFlags& chosen) const;
  /// Samples as above, without the directional lights.
  void sampleNear(const ReceiverLanes& at, const UnitLanes& u, LightSampleLanes& samples) const {
    choose(directional_, at, u, samples);
  }
  /// Samples light `index` without a choice.
  void sampleOne(std::size_t index, const ReceiverLanes& at, LightSampleLanes& samples) const;

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
  };
  const Source& source(std::size_t index) const { return lights_[index]; }

 private:
  /// Holds the lights that the lanes chose, and the probability of each choice.
  struct Chosen;
  void choose(std::size_t first, const ReceiverLanes& at, const UnitLanes& u, LightSampleLanes& samples) const;
  void chooseWithTree(std::size_t first, const ReceiverLanes& at, const UnitLanes& u, const LearntChoice* learnt,
                      Chosen& chosen) const;
  std::size_t chooseGroup(std::span<const float> unshadowed, const LearntChoice* learnt, float& u,
                          float& probability) const;
  void sampleChosen(Chosen& chosen, const ReceiverLanes& at, LightSampleLanes& samples) const;
  static void chooseAmongFew(std::span<const Source> few, const ReceiverLanes& at, const UnitLanes& u, Chosen& chosen);
  static void sampleChosen(const Chosen& chosen, const Vec3Lanes& p, LightSampleLanes& samples);
  float importance(std::size_t light, const Vec3& p, const Vec3& n) const;

  std::vector<Source> lights_;
  std::size_t directional_ = 0;
  std::vector<std::uint32_t> byX_;  // lights with a place, by their x
  LightTree tree_;                  // over lights_, only with more than kLocalLights that are not directional
};

/// Returns the irradiance that a punctual light brings to a surface at p that faces it: colour * candela / d^2 with the
/// range window and the cone, or colour * lux. `wi` becomes the direction towards it.
Vec3 facingIrradiance(const Light& light, const Vec3& p, Vec3& wi);

}  // namespace lumel
