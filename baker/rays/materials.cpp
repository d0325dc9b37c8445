#include "baker/rays/materials.h"

#include <algorithm>
#include <cmath>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

template <class T>
T interpolate(const TrianglePoint& point, const std::vector<T>& values) {
  const std::uint32_t* corner = point.primitive->indices.data() + std::size_t{3} * point.triangle;
  const Vec2 b = point.barycentric;
  return (1.0f - b.x - b.y) * values[corner[0]] + b.x * values[corner[1]] + b.y * values[corner[2]];
}

bool hasPartialVertexAlpha(const Primitive& primitive) {
  return std::any_of(primitive.colors.begin(), primitive.colors.end(), [](const Vec4& c) { return c.w != 1.0f; });
}

float applyAlphaMode(const Material& material, float alpha) {
  switch (material.alphaMode) {
    case AlphaMode::Opaque:
      return 1.0f;
    case AlphaMode::Mask:
      return alpha < material.alphaCutoff ? 0.0f : 1.0f;
    case AlphaMode::Blend:
      return std::clamp(alpha, 0.0f, 1.0f);
  }
  return 1.0f;
}

}  // namespace

/// Returns the area in texture space of the triangle that a point lies on.
static float uvAreaOf(const TrianglePoint& point, int uvSet) {
  const auto cornerAt = [&](Vec2 barycentric) { return uvAt({point.primitive, point.triangle, barycentric}, uvSet); };
  const Vec2 first = cornerAt({0, 0}), e1 = cornerAt({1, 0}) - first, e2 = cornerAt({0, 1}) - first;
  return 0.5f * std::abs(e1.x * e2.y - e1.y * e2.x);
}

Vec2 uvAt(const TrianglePoint& point, int uvSet) {
  const auto& sets = point.primitive->uvSets;
  const auto set = static_cast<std::size_t>(uvSet);
  if (set >= sets.size() || sets[set].empty()) return Vec2(0.0f);
  return interpolate(point, sets[set]);
}

Materials::Materials(const Scene& scene, bool bounces, std::vector<std::string>& notes) : scene_(&scene) {
  std::vector<char> needed(scene.images.size(), 0);
  std::vector<char> averaged(scene.images.size(), 0);
  const auto need = [&](const TextureRef& ref, bool mean) {
    if (!ref || static_cast<std::size_t>(ref.image) >= needed.size()) return;
    needed[static_cast<std::size_t>(ref.image)] = 1;
    if (mean) averaged[static_cast<std::size_t>(ref.image)] = 1;
  };
  for (const Instance& instance : scene.instances) {
    if (!instance.settings.casts) continue;
    for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
      const Material& m = material(primitive.material);
      const bool opaque = m.alphaMode == AlphaMode::Opaque;
      if (bounces || !opaque || m.transmission > 0.0f) need(m.baseColorMap, opaque);
      if (emits(primitive.material)) need(m.emissionMap, false);
    }
  }
  srgbByImage_.resize(scene.images.size());
  std::vector<std::string> failures(scene.images.size());
  std::vector<char> undecodable(scene.images.size(), 0);
  parallelFor(scene.images.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      if (!needed[i]) continue;
      if (scene.images[i].encoded.empty()) {
        undecodable[i] = 1;
        continue;
      }
      auto texture = Texture::decode(scene.images[i], ColorSpace::Srgb);
      if (texture)
        srgbByImage_[i].emplace(*std::move(texture), averaged[i] != 0);
      else
        failures[i] = texture.error().message;
      undecodable[i] = srgbByImage_[i] ? 0 : 1;
    }
  });
  for (const std::string& failure : failures)
    if (!failure.empty()) notes.push_back(failure + "; colour counts as grey, emission as black");
  undecodable_ = std::move(undecodable);
}

const TexturePyramid* Materials::colorTexture(int index) const {
  const TextureRef& ref = material(index).baseColorMap;
  if (!ref || static_cast<std::size_t>(ref.image) >= srgbByImage_.size()) return nullptr;
  const auto& texture = srgbByImage_[static_cast<std::size_t>(ref.image)];
  return texture ? &*texture : nullptr;
}

float Materials::albedoWidth(const TrianglePoint& point, float share) const {
  return std::sqrt(share * uvAreaOf(point, material(point.primitive->material).baseColorMap.uvSet));
}

const Texture* Materials::albedoTexture(int index, float uvWidth) const {
  const TexturePyramid* textures = colorTexture(index);
  if (textures == nullptr) return nullptr;
  return uvWidth > 0.0f ? &textures->level(material(index).baseColorMap, uvWidth) : &textures->finest();
}

Materials::AlbedoLookup Materials::findAlbedo(const TrianglePoint& point, const Texture* texture) const {
  const Material& m = material(point.primitive->material);
  AlbedoLookup lookup{Vec3(m.baseColor), m.transmission, texture};
  if (isUndecodable(m.baseColorMap)) lookup.factor *= kMissingColor;
  if (texture != nullptr) lookup.at = texture->footprint(m.baseColorMap, uvAt(point, m.baseColorMap.uvSet));
  if (!point.primitive->colors.empty()) lookup.factor *= Vec3(interpolate(point, point.primitive->colors));
  return lookup;
}

/// Returns the base colour at a point, each channel 0..1.
static Vec3 colorOf(const Materials::AlbedoLookup& lookup) {
  const Vec3 color =
      lookup.texture != nullptr ? lookup.factor * Vec3(lookup.texture->sample(lookup.at)) : lookup.factor;
  return glm::clamp(color, Vec3(0.0f), Vec3(1.0f));
}

const Texture* Materials::emissionTexture(int index) const {
  const TextureRef& ref = material(index).emissionMap;
  if (!ref || static_cast<std::size_t>(ref.image) >= srgbByImage_.size()) return nullptr;
  const auto& texture = srgbByImage_[static_cast<std::size_t>(ref.image)];
  return texture ? &texture->finest() : nullptr;
}

Vec3 Materials::albedo(const AlbedoLookup& lookup) {
  const Vec3 color = colorOf(lookup);
  if (lookup.transmission == 0.0f) return color;
  const float held = 1.0f - lookup.transmission * std::max({color.x, color.y, color.z});
  return held > 0.0f ? color * ((1.0f - lookup.transmission) / held) : Vec3(0.0f);
}

Vec3 Materials::emission(const TrianglePoint& point) const {
  const Material& m = material(point.primitive->material);
  if (!emits(point.primitive->material)) return Vec3(0.0f);
  Vec3 radiance = glm::max(m.emission, Vec3(0.0f));
  if (const Texture* texture = emissionTexture(point.primitive->material))
    radiance *= Vec3(texture->sample(m.emissionMap, uvAt(point, m.emissionMap.uvSet)));
  return radiance;
}

float Materials::alpha(const TrianglePoint& point) const {
  const Material& m = material(point.primitive->material);
  float a = m.baseColor.w;
  if (const TexturePyramid* textures = colorTexture(point.primitive->material))
    a *= textures->finest().sampleAlpha(m.baseColorMap, uvAt(point, m.baseColorMap.uvSet));
  if (!point.primitive->colors.empty()) a *= interpolate(point, point.primitive->colors).w;
  return a;
}

float Materials::opacityByAlpha(const TrianglePoint& point) const {
  const Material& m = material(point.primitive->material);
  return m.alphaMode == AlphaMode::Opaque ? 1.0f : applyAlphaMode(m, alpha(point));
}

float Materials::opacity(const TrianglePoint& point) const {
  if (!transmits(*point.primitive)) return opacityByAlpha(point);
  const Vec3 passing = transmittance(point);
  return 1.0f - std::max({passing.x, passing.y, passing.z});
}

Vec3 Materials::transmittance(const TrianglePoint& point) const {
  const float held = opacityByAlpha(point);
  const float transmission = material(point.primitive->material).transmission;
  return Vec3(1.0f - held) + held * transmission * colorOf(findAlbedo(point));
}

bool Materials::needsAlphaTest(const Primitive& primitive) const {
  const Material& m = material(primitive.material);
  if (m.transmission > 0.0f) return true;
  if (m.alphaMode == AlphaMode::Opaque) return false;
  const TexturePyramid* textures = colorTexture(primitive.material);
  if ((textures && !textures->finest().opaque()) || hasPartialVertexAlpha(primitive)) return true;
  const float whole = applyAlphaMode(m, m.baseColor.w);
  return whole > 0.0f && whole < 1.0f;
}

bool Materials::invisible(const Primitive& primitive) const {
  const Material& m = material(primitive.material);
  if (primitive.indices.empty()) return true;
  if (m.alphaMode == AlphaMode::Opaque || needsAlphaTest(primitive)) return false;
  return applyAlphaMode(m, m.baseColor.w) == 0.0f;
}

}  // namespace lumel
