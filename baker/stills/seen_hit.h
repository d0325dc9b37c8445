// A point of the picture's scene as shadings see it.
#pragma once

#include <optional>

#include "baker/stills/picture_scene.h"
#include "baker/stills/shading.h"

namespace lumel {

class SeenHit : public SeenPoint {
 public:
  /// `direction`: of the ray that found it. `lamps`: of the picture.
  SeenHit(const PictureScene& scene, const PictureHit& hit, const Vec4& baseColor, const Vec3& direction,
          std::span<const Light> lamps);

  bool isUnlit() const override { return hit_.shape->material->unlit; }
  Vec3 albedo() const override { return Vec3(baseColor_); }
  Vec3 emission() const override { return scene_.emission(hit_); }
  float occlusion() const override;
  bool hasSsbump() const override { return static_cast<bool>(hit_.shape->material->ssbumpMap); }
  Vec3 ssbump() const override { return scene_.ssbump(hit_); }
  Vec3 tangentNormal() const override { return scene_.tangentNormal(hit_); }
  Frame frame() const override { return scene_.frame(hit_); }
  Vec3 eye() const override { return -direction_; }

  bool hasRnm() const override;
  Vec3 map(std::size_t index) const override;
  Vec3 flat() const override;
  Vec3 decoded(const Vec3& normalTangent) const override;
  std::span<const LampLight> lamps() const override;
  Vec3 sky(const Vec3& direction) const override;

  float aux(std::string_view channel) const override;
  float density() const override;
  int page() const override { return hit_.shape->lightmap.page; }
  int chart() const override { return hit_.shape->charts[hit_.triangle]; }
  Vec2 texel() const override;

 private:
  Vec2 lightmapUv() const { return hit_.shape->lightmap.apply(scene_.uvAt(hit_, 1)); }
  Vec3 lookup(const Image& image) const;
  Vec3 around(const Vec3& normal) const;

  const PictureScene& scene_;
  const PictureHit& hit_;
  const Vec4 baseColor_;
  const Vec3 direction_;
  const std::span<const Light> lampsOfPicture_;
  mutable std::optional<std::vector<LampLight>> lamps_;
};

}  // namespace lumel
