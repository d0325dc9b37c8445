// The triangles of a baked scene as a still sees them: what a ray meets, and the textures and lightmaps there.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "baker/files/read/baked_scene.h"
#include "scene/base/embree.h"
#include "scene/base/expected.h"
#include "scene/images/texture.h"
#include "ssbump/maps/weights.h"

namespace lumel {

/// One primitive of one instance, in world space.
struct PictureShape {
  const Primitive* primitive = nullptr;
  const Material* material = nullptr;
  int number = 0;
  bool mirrored = false;
  LightmapPlace lightmap;  // its page is -1 where the primitive has none
  std::vector<Vec3> positions;
  Mat3 normalMatrix{1.0f};
  Mat3 linear{1.0f};
  ssbump::Encoding ssbumpEncoding;
  std::vector<int> charts;  // of each triangle; charts are told apart by their vertices, which they do not share
};

/// A point on a shape: which triangle and where in it.
struct PictureHit {
  const PictureShape* shape = nullptr;
  std::uint32_t triangle = 0;
  std::array<std::uint32_t, 3> vertices{};
  Vec3 weights{0, 0, 0};
  float width = 0.0f;  // of the part of the surface that the ray stands for, in metres; 0: a point
};

/// What lets a ray pass.
enum class Passes {
  Nothing,
  CutOuts,          // rays of light: a one-sided surface blocks them from both sides, as in the bake
  CutOutsAndBacks,  // rays of the eye: backs of one-sided surfaces are culled
};

/// The scene, its decoded textures and Embree's tree. Everything but make() may be called by many threads at once.
class PictureScene {
 public:
  /// `baked` must outlive the result. A texture that cannot be decoded is left out and named in warnings().
  /// Errors: Failed (Embree).
  static Expected<std::unique_ptr<PictureScene>> make(const BakedScene& baked);

  const BakedScene& baked() const { return *baked_; }
  const std::vector<std::string>& warnings() const { return warnings_; }
  Vec3 least() const { return least_; }  // corners of the bounding box
  Vec3 most() const { return most_; }

  /// The first thing on a ray between two distances.
  RTCRayHit trace(const Vec3& origin, const Vec3& direction, float tnear, float tfar, Passes passes) const;
  /// Whether nothing lies between two points; what is cut out does not count, blended surfaces do.
  bool sees(const Vec3& from, const Vec3& to) const;
  PictureHit hitAt(unsigned geometry, unsigned triangle, float u, float v) const;

  /// Normal of the triangle's front, not of unit length.
  Vec3 facing(const PictureHit& hit) const;
  bool showsBack(const PictureHit& hit, const Vec3& direction) const { return glm::dot(facing(hit), direction) > 0.0f; }

  Vec3 positionAt(const PictureHit& hit) const;
  Vec2 uvAt(const PictureHit& hit, int set) const;
  Vec4 baseColor(const PictureHit& hit) const;
  Vec3 emission(const PictureHit& hit) const;
  float occlusion(const PictureHit& hit) const;     // of the occlusion map; 1 without one
  Vec3 ssbump(const PictureHit& hit) const;         // squared weights, right-handed; 1/3 each without a map
  Vec3 tangentNormal(const PictureHit& hit) const;  // of the normal map, else of the ssbump map, else (0, 0, 1)
  Frame frame(const PictureHit& hit) const;         // of the tangent space, in the world
  /// Units of a UV set on a metre: the mean of a surface's two directions.
  float uvScaleAt(const PictureHit& hit, int set) const;

 private:
  explicit PictureScene(const BakedScene& baked) : baked_(&baked) {}
  void collectShapes();
  void decodeTextures();
  Expected<void> buildRays();
  Vec4 sample(const TextureRef& ref, ColorSpace space, const PictureHit& hit, const Vec4& otherwise) const;
  static void filter(const RTCFilterFunctionNArguments* arguments);

  const BakedScene* baked_;
  std::vector<PictureShape> shapes_;  // by Embree's geometry number
  std::map<std::pair<int, ColorSpace>, TexturePyramid> textures_;
  std::vector<std::string> warnings_;
  Vec3 least_{0, 0, 0};
  Vec3 most_{0, 0, 0};
  EmbreeDevice device_;
  EmbreeScene rays_;
};

}  // namespace lumel
