// Triangles that shine, as next-event estimation sees them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "baker/light/light_sample.h"
#include "baker/light/light_tree.h"
#include "baker/light/shining_parts.h"
#include "baker/rays/lanes.h"
#include "baker/rays/materials.h"
#include "baker/rays/ray_scene.h"
#include "baker/rays/sample_lanes.h"

namespace lumel {

/// The emitters that light samples look for. What they do not look for has density 0, and counts fully where a ray
/// meets it.
enum class Emitters : std::uint32_t { All, WithoutWide };

/// Samples all triangles of casting instances with an emissive material as one area light.
class EmissiveTriangles {
 public:
  EmissiveTriangles() = default;
  /// Finds them and sets ScenePart::firstEmitter. A triangle whose texture varies is divided into its shining parts
  /// (TexturedTriangle), which are emitters of their own; what shines nowhere is none. Whether anything shines at all
  /// is thus decided exactly: empty().
  EmissiveTriangles(RayScene& rays, const Materials& materials);

  bool empty() const { return all_.tree.empty(); }
  /// Tells whether there is anything to look for.
  bool samples(Emitters among) const { return !choiceOf(among).tree.empty(); }
  /// Tells whether some emitters belong to the wide ones: very many of about the same radiance, such as the surfaces of
  /// a level that all shine a little. Where they fill much of what a place sees, rays find them as well as light
  /// samples do, and cost less.
  bool hasWide() const { return hasWide_; }
  /// Tells whether a hit is on one of these.
  bool isWide(const HitSurface& hit) const;
  /// Returns the number of triangles with an emissive material, dark ones included.
  std::size_t size() const { return firstOf_.empty() ? 0 : firstOf_.size() - 1; }

  /// Density: over triangles by what they can bring to p unshadowed, estimated for groups of them (LightTree) and for
  /// the few of a group by mean emitted luminance times solid angle; within a triangle
  /// uniform by solid angle where that is not small, else by area. Emission from the front alone unless the material
  /// is doubleSided, times opacity.
  /// Lanes that are not `active` get a weight of zero.
  void sample(const Vec3Lanes& p, const LaneFlags& active, const UnitLanes& uTriangle, const UnitSquareLanes& uPoint,
              LightSampleLanes& samples, Emitters among = Emitters::All) const;

  /// Returns the density per solid angle with which sample() from `origin` takes the point that a ray hit. Triangles
  /// that are never chosen have zero.
  float pdf(const HitSurface& hit, const Vec3& origin, Emitters among = Emitters::All) const;

  /// Triangles that look smaller, in steradians, are sampled by area, which is quicker and nearly the same; and so are
  /// those that fill nearly a hemisphere, where spherical triangles degenerate.
  static constexpr float kLeastSolidAngle = 0.03f;
  static constexpr float kMostSolidAngle = 6.2f;
  /// So many emitters at least are wide: a choice among fewer costs less than they might.
  static constexpr std::size_t kFewestWide = 256;
  /// And the brightest is so many times as bright as the dimmest: one that fills little of what a place sees would make
  /// the light of many others noisy.
  static constexpr float kWideRange = 8.0f;

 private:
  /// A triangle as sampling reads it. It begins with a row of 16 floats, to be turned into lanes.
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
    bool isWide = false;
    std::uint32_t part = 0;
    std::uint32_t triangle = 0;
    ShiningPart shining{};  // of the triangle
  };
  /// Emission textures as fields, by material; null: it has none.
  using Fields = std::vector<std::unique_ptr<EmissionField>>;
  Fields fieldsOf(const RayScene& rays) const;
  /// Fills all but what is left of a whole triangle when it is divided; `shining` becomes the whole triangle.
  void describe(Emitter& emitter, const EmissionField* field) const;
  std::optional<TexturedTriangle> onTexture(const Emitter& emitter, const EmissionField* field) const;
  double meanOnTexture(const Emitter& emitter, const EmissionField& field) const;
  std::vector<ShiningPart> partsOf(const Emitter& emitter, const EmissionField* field, std::size_t mostBoxes) const;
  void divide(const std::vector<Emitter>& whole, const Fields& fields);
  Vec3 radianceAt(const Emitter& emitter, Vec2 barycentric) const;
  /// Returns the emitter that a point of a triangle belongs to, or kNone.
  std::uint32_t emitterAt(std::size_t triangle, const Vec2& barycentric) const;
  std::uint32_t emitterAt(const HitSurface& hit) const;
  void findWide();
  /// Holds the emitters that the lanes chose, and the probability of each choice.
  struct Chosen;
  static void chooseAmongFew(std::span<const Emitter> few, const Vec3Lanes& p, const UnitLanes& u, Chosen& chosen);
  static void chooseInLeaves(const Emitter* triangles, const std::array<LaneFlags, LightTree::kLeaf>& lights,
                             const LightTree::Descent& descent, const Vec3Lanes& p, Chosen& chosen);
  static void samplePoints(const Vec3Lanes& p, const UnitSquareLanes& u, Chosen& chosen, LightSampleLanes& samples);
  /// A choice among some of the emitters.
  struct Choice {
    LightTree tree;
    std::vector<Emitter> few;  // all that can be chosen, where one leaf of the tree holds them
  };
  Choice choiceAmong(Emitters among) const;
  const Choice& choiceOf(Emitters among) const {
    return among == Emitters::WithoutWide && hasWide_ ? withoutWide_ : all_;
  }
  /// Returns what the choice within a leaf is in proportion to.
  float importance(std::uint32_t triangle, const Vec3& p) const;

  const RayScene* rays_ = nullptr;
  const Materials* materials_ = nullptr;
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<Emitter> triangles_;      // emitters: triangles or parts of them
  std::vector<std::uint32_t> firstOf_;  // by triangle: its first emitter; one more entry ends the last
  Choice all_, withoutWide_;
  bool hasWide_ = false;
  bool uniform_ = true;  // all are
};

/// Returns the radiance that leaves a surface found by a ray towards the ray's origin.
Vec3 emittedTowardsRay(const Materials& materials, const HitSurface& hit);

}  // namespace lumel
