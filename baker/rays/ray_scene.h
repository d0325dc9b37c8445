// The casting geometry of a scene for rays: Embree's structures, alpha cut-outs, and what lies at a hit.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "baker/rays/materials.h"
#include "baker/rays/ray_start.h"
#include "baker/rays/sample_lanes.h"
#include "scene/base/embree.h"
#include "scene/base/expected.h"
#include "scene/scene.h"

namespace lumel {

/// How a packet is traced. All answer alike but for ties and rounding.
/// Coherent is Embree's flag for rays that run close together, for closest hits alone: with ROBUST and AVX-512,
/// Embree 3.13's rtcOccluded16 never returned for some packets that are coherent in name only (one ray with a direction
/// component of -1e-16 was enough). rtcIntersect16 with the flag returns, but misses what it should hit where
/// components are below 1e-18, whose reciprocals Embree replaces by positive ones; where all are above, 26 million
/// packets of extreme directions gave the same hits as without it.
enum class TraceMode {
  Single,    // one call per ray: the plain way, kept as the yardstick
  Packet,    // 16 rays per call
  Coherent,  // the same, for closest hits of rays that run close together; no component nearer to zero than 1e-12,
             // and no instances that Embree places: in their space a direction may have any
};

/// Holds up to 16 rays that look for their closest hit. Lanes that are not set are not traced.
struct alignas(64) RayPacket {
  RTCRayHit16 rayhit;
  alignas(64) int valid[kLanes];
  std::uint32_t tinted = 0;  // bits of lanes whose rays passed through surfaces that give light a colour
  Vec3Lanes passed;          // of these: the factor on light that comes along the ray

  /// Sets no lane, and the fields that are the same for all rays.
  RayPacket();
  void clear();
  void set(int lane, const Vec3& origin, const Vec3& dir);
  Vec3 direction(int lane) const { return {rayhit.ray.dir_x[lane], rayhit.ray.dir_y[lane], rayhit.ray.dir_z[lane]}; }
  Vec3Lanes directions() const;
  bool hit(int lane) const { return valid[lane] != 0 && rayhit.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID; }
  bool missed(int lane) const { return valid[lane] != 0 && rayhit.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID; }
  /// Returns the factor on light that comes along the ray.
  Vec3 tint(std::size_t lane) const { return (tinted >> lane & 1u) != 0 ? passed[lane] : Vec3(1.0f); }
};

/// Holds up to 16 rays that ask only whether anything lies between their ends.
struct alignas(64) ShadowPacket {
  RTCRay16 ray;
  alignas(64) int valid[kLanes];
  bool any = false;
  std::uint32_t tinted = 0;  // as in RayPacket
  Vec3Lanes passed;

  ShadowPacket();
  void clear();
  /// `length` is in units of |dir|.
  void set(int lane, const Vec3& origin, const Vec3& dir, float length);
  bool visible(int lane) const { return valid[lane] != 0 && ray.tfar[lane] >= 0.0f; }
};

/// One primitive of one casting instance. What every hit reads comes first, in one line of the processor's cache.
struct alignas(64) ScenePart {
  const std::uint32_t* indices = nullptr;  // of the primitive
  const Vec3* positions = nullptr;  // by vertex: in world space where the mesh is flattened, else the primitive's
  const Vec3* normals = nullptr;    // of the primitive; null: it has none
  bool isWorld = false;             // positions are Embree's vertex buffer
  bool doubleSided = false;
  std::optional<Vec3> albedo;  // where it is the same throughout
  const Primitive* primitive = nullptr;
  int instance = 0;
  Mat4 worldFromObject{1.0f};
  Mat3 worldFromNormal{1.0f};      // cofactor matrix times the sign of the determinant: keeps fronts in front
  float frontSign = 1.0f;          // -1 for mirroring instances: triangles wind the other way round in world space
  float translation = 0.0f;        // for offsetPoint
  std::int64_t firstEmitter = -1;  // of its triangles among EmissiveTriangles; -1: it emits nothing
};

/// A surface found by a ray, its normal on the side that the ray came from.
struct HitSurface {
  Vec3 p{0};         // world
  Vec3 ng{0, 0, 1};  // geometric normal
  bool backFace = false;
  int material = 0;
  std::uint32_t part = 0;
  TrianglePoint point;
  std::array<Vec3, 3> corners;  // of the triangle, world
};

/// Holds what a receiver at a hit is made of.
struct HitCorners {
  std::array<Vec3, 3> corners;  // of the triangle, world
  std::array<Vec3, 3> normals;  // of its vertices, as the primitive has them; zero where it has none
  Vec2 weights;                 // of vertices 1 and 2
  Vec3 dir;                     // of the ray
  std::uint32_t part = 0;
};

/// Holds HitCorners by lane, with what is needed of the part.
struct HitCornerLanes {
  LaneFlags active{};
  std::array<Vec3Lanes, 3> corners;
  std::array<Vec3Lanes, 3> normals;
  Vec3Lanes dir;
  alignas(64) float u[kLanes] = {};
  alignas(64) float v[kLanes] = {};
  std::array<Vec3Lanes, 3> worldFromNormal;  // columns
  alignas(64) float frontSign[kLanes] = {};
  alignas(64) float translation[kLanes] = {};
};

/// Turns hits into points that receive light, with the same bits as RayScene::surfaceAt, shadingNormal and rayStart.
/// Lanes that are not active become zeros.
void receiveAt(const HitCornerLanes& hits, Vec3Lanes& p, Vec3Lanes& ng, Vec3Lanes& ns, Vec3Lanes& rayStart);

class RayScene {
 public:
  /// Meshes that are placed more than once are flattened to world space, as those are that are placed once, while the
  /// triangles of all instances are no more than this; else they become Embree instances. Flattening takes 70 bytes a
  /// triangle more and saves a tenth of a bake's time where most of a scene is instances.
  static constexpr std::size_t kMostFlattened = 1'000'000;

  /// Keeps references to `scene` and `materials`. Errors: Failed.
  static Expected<std::unique_ptr<RayScene>> build(const Scene& scene, const Materials& materials,
                                                   std::size_t mostFlattened = kMostFlattened);

  void intersect(RayPacket& rays, TraceMode mode) const;
  /// Precondition: mode is not Coherent.
  void occluded(ShadowPacket& rays, TraceMode mode) const;

  /// Precondition: rays.hit(lane).
  HitSurface surfaceAt(const RayPacket& rays, int lane) const;
  /// Returns the index of the part that was hit. Precondition: rays.hit(lane).
  std::uint32_t partOf(const RayPacket& rays, int lane) const {
    const RTCHit16& hit = rays.rayhit.hit;
    const std::uint32_t instance = hit.instID[0][lane];
    if (instance == RTC_INVALID_GEOMETRY_ID) return partOfGeometry_[hit.geomID[lane]];
    return partOfGeometry_[instance] + hit.geomID[lane];
  }

  /// Collects the input of receiveAt. Precondition: rays.hit(lane).
  void cornersAt(const RayPacket& rays, int lane, HitCorners& hit) const;
  void set(HitCornerLanes& lanes, std::size_t lane, const HitCorners& hit) const;
  TrianglePoint pointAt(const RayPacket& rays, int lane) const {
    const RTCHit16& hit = rays.rayhit.hit;
    return {parts_[partOf(rays, lane)].primitive, hit.primID[lane], {hit.u[lane], hit.v[lane]}};
  }
  /// Prefetches what these and surfaceAt will read of a triangle, first its indices and then its corners. Results do
  /// not change.
  void prefetchIndices(std::uint32_t part, std::uint32_t triangle) const {
    __builtin_prefetch(parts_[part].indices + std::size_t{3} * triangle);
  }
  void prefetchCorners(std::uint32_t part, std::uint32_t triangle) const;

  /// Interpolates the normal and turns it to the side of hit.ng. Returns hit.ng where the mesh has no usable normal.
  Vec3 shadingNormal(const HitSurface& hit) const;
  /// Returns where rays that leave the surface start.
  Vec3 rayStart(const HitSurface& hit) const {
    return offsetPoint(hit.p, hit.ng, hit.corners, parts_[hit.part].translation);
  }

  const std::vector<ScenePart>& parts() const { return parts_; }
  std::vector<ScenePart>& parts() { return parts_; }
  /// Returns primitive `primitive` of the mesh of an instance.
  const Primitive* primitiveOf(int instance, int primitive) const {
    return &scene_->primitive(scene_->instances[static_cast<std::size_t>(instance)].mesh, primitive);
  }
  /// Returns the corners in world space, as wound in the primitive.
  std::array<Vec3, 3> corners(const ScenePart& part, std::uint32_t triangle) const;

  /// Returns, for offsetPoint, the largest coordinate of an instance's translation where Embree places it, and 0 where
  /// its triangles are in world space.
  float translationOf(int instance) const;

  /// Tells whether Embree places any mesh: TraceMode::Coherent is then not allowed.
  bool placesInstances() const {
    return std::any_of(meshScenes_.begin(), meshScenes_.end(), [](const EmbreeScene& s) { return s != nullptr; });
  }

  Vec3 boundsMin() const { return boundsMin_; }
  Vec3 boundsMax() const { return boundsMax_; }
  bool empty() const { return parts_.empty(); }
  /// Benchmarks that call Embree themselves use this.
  RTCScene embreeScene() const { return top_.get(); }
  std::size_t alphaTestedParts() const { return alphaTested_.size(); }
  /// Tells whether any surface gives a colour to light that passes.
  bool tints() const { return tints_; }

 private:
  struct AlphaTested {
    const Materials* materials;
    const Primitive* primitive;
    bool transmits;
  };
  RayScene(const Scene& scene, const Materials& materials) : scene_(&scene), materials_(&materials) {}
  Expected<void> buildGeometry(std::size_t mostFlattened);
  std::uint32_t addParts(int instance);
  EmbreeGeometry triangles(const Primitive& primitive, const Mat4* worldFromObject, const Vec3** vertices);
  Expected<RTCScene> meshScene(int mesh);
  static void alphaFilter(const RTCFilterFunctionNArguments* args);
  void findTints(RayPacket& rays) const;

  const Scene* scene_;
  const Materials* materials_;
  EmbreeDevice device_;
  std::vector<EmbreeScene> meshScenes_;  // per Scene::meshes; null where flattened or unused
  EmbreeScene top_;
  std::vector<ScenePart> parts_;
  std::vector<std::uint32_t> partOfGeometry_;              // per geometry of top_: its part, or an instance's first
  std::vector<std::unique_ptr<AlphaTested>> alphaTested_;  // Embree holds pointers to them
  bool tints_ = false;
  Vec3 boundsMin_{0};
  Vec3 boundsMax_{0};
};

}  // namespace lumel
