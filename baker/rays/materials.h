// What light transport needs of materials: albedo, emission and alpha at a point of a triangle. Textures are decoded
// only where they shade, emit or cut out.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scene/images/texture.h"
#include "scene/scene.h"

namespace lumel {

/// A point of a primitive, given by the barycentric weights of the triangle's vertices 1 and 2.
struct TrianglePoint {
  const Primitive* primitive = nullptr;
  std::uint32_t triangle = 0;
  Vec2 barycentric{0, 0};
};

class Materials {
 public:
  /// Decodes the textures of the materials that casting instances use. `bounces` false: nothing is shaded, base
  /// colour maps are needed for alpha and transmission alone. A colour map that cannot be decoded counts as
  /// kMissingColor, an emission map as black; `notes` then gains a line.
  Materials(const Scene& scene, bool bounces, std::vector<std::string>& notes);

  const Material& material(int index) const { return scene_->materials[static_cast<std::size_t>(index)]; }

  /// Returns the share of light that is reflected, 0..1: base colour times texture times vertex colour. Of a surface
  /// that transmits it is the share of what opacity() holds: base colour c, transmission t and opacity 1 - t max(c)
  /// make it c (1 - t) / (1 - t max(c)).
  Vec3 albedo(const TrianglePoint& point) const { return albedo(findAlbedo(point)); }
  /// albedo() in two steps, so that memory can be asked early for what the second step reads.
  struct AlbedoLookup {
    Vec3 factor{0};
    float transmission = 0.0f;
    const Texture* texture = nullptr;
    Texture::Footprint at{};

    void prefetch() const {
      if (texture != nullptr) texture->prefetch(at);
    }
  };
  AlbedoLookup findAlbedo(const TrianglePoint& point) const {
    return findAlbedo(point, albedoTexture(point.primitive->material, 0.0f));
  }
  static Vec3 albedo(const AlbedoLookup& lookup);
  /// `texture` is albedoTexture() of the point's material.
  AlbedoLookup findAlbedo(const TrianglePoint& point, const Texture* texture) const;
  /// Returns the base colour map's level that holds means over roughly `uvWidth` on a side, or null where there is no
  /// map.
  const Texture* albedoTexture(int material, float uvWidth) const;
  /// Returns the side of a square in the texture that has `share` of the area of the point's triangle.
  float albedoWidth(const TrianglePoint& point, float share) const;
  /// Tells whether albedo() is the same on all of the primitive.
  bool hasOneAlbedo(const Primitive& primitive) const {
    return primitive.colors.empty() && colorTexture(primitive.material) == nullptr;
  }
  /// Returns the radiance in nits that is sent out from the front (and from the back where doubleSided). Alpha is not
  /// applied.
  Vec3 emission(const TrianglePoint& point) const;
  /// Returns the texture that emission() is multiplied by; null: there is none.
  const Texture* emissionTexture(int material) const;
  /// Returns the share of rays that the surface stops, 0..1: 0 or 1 for MASK (the cut-off applied), alpha for BLEND; of
  /// a surface that transmits, 1 less the greatest channel of transmittance().
  float opacity(const TrianglePoint& point) const;
  /// Returns the light that goes straight on, by colour: with a the opacity by alpha, base colour c and transmission t,
  /// 1 - a + a t c. BLEND passes light untinted, as the format composites; transmission tints it.
  Vec3 transmittance(const TrianglePoint& point) const;
  /// Tells whether light takes a colour on its way through the primitive.
  bool transmits(const Primitive& primitive) const { return material(primitive.material).transmission > 0.0f; }

  /// An unlit material shows its base colour, which is not light: it emits nothing.
  bool emits(int index) const {
    return material(index).emission != Vec3(0.0f) && !material(index).unlit &&
           !isUndecodable(material(index).emissionMap);
  }
  /// Tells whether opacity varies over the primitive or is partial, so that rays must ask for it.
  bool needsAlphaTest(const Primitive& primitive) const;
  /// Tells whether no ray can ever hit the primitive.
  bool invisible(const Primitive& primitive) const;

 private:
  bool isUndecodable(const TextureRef& ref) const {
    return ref && static_cast<std::size_t>(ref.image) < undecodable_.size() &&
           undecodable_[static_cast<std::size_t>(ref.image)] != 0;
  }
  float opacityByAlpha(const TrianglePoint& point) const;
  const TexturePyramid* colorTexture(int material) const;
  float alpha(const TrianglePoint& point) const;

  const Scene* scene_;
  std::vector<std::optional<TexturePyramid>> srgbByImage_;  // per Scene::images
  std::vector<char> undecodable_;                           // per Scene::images: needed and without pixels
};

/// Interpolates texture coordinates. Returns (0, 0) where the primitive lacks the set.
Vec2 uvAt(const TrianglePoint& point, int uvSet);

}  // namespace lumel
