#include "baker/materials.h"

#include <algorithm>

#include "scene/parallel.h"

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

Vec2 uvAt(const TrianglePoint& point, int uvSet) {
  const auto& sets = point.primitive->uvSets;
  const auto set = static_cast<std::size_t>(uvSet);
  if (set >= sets.size() || sets[set].empty()) return Vec2(0.0f);
  return interpolate(point, sets[set]);
}

Materials::Materials(const Scene& scene, bool bounces, std::vector<std::string>& notes) : scene_(&scene) {
  std::vector<char> needed(scene.images.size(), 0);
  const auto need = [&](const TextureRef& ref) {
    if (ref && static_cast<std::size_t>(ref.image) < needed.size()) needed[static_cast<std::size_t>(ref.image)] = 1;
  };
  for (const Instance& instance : scene.instances) {
    if (!instance.settings.casts) continue;
    for (const Primitive& primitive : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
      const Material& m = material(primitive.material);
      if (bounces || m.alphaMode != AlphaMode::Opaque) need(m.baseColorMap);
      if (emits(primitive.material)) need(m.emissionMap);
    }
  }
  srgbByImage_.resize(scene.images.size());
  std::vector<std::string> failures(scene.images.size());
  parallelFor(scene.images.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      if (!needed[i] || scene.images[i].encoded.empty()) continue;
      auto texture = Texture::decode(scene.images[i], ColorSpace::Srgb);
      if (texture)
        srgbByImage_[i] = *std::move(texture);
      else
        failures[i] = texture.error().message;
    }
  });
  for (const std::string& failure : failures)
    if (!failure.empty()) notes.push_back(failure + "; its factor is used alone");
}

const Texture* Materials::colorTexture(int index) const {
  const TextureRef& ref = material(index).baseColorMap;
  if (!ref || static_cast<std::size_t>(ref.image) >= srgbByImage_.size()) return nullptr;
  const auto& texture = srgbByImage_[static_cast<std::size_t>(ref.image)];
  return texture ? &*texture : nullptr;
}

Vec3 Materials::albedo(const TrianglePoint& point) const {
  const Material& m = material(point.primitive->material);
  Vec3 color(m.baseColor);
  if (const Texture* texture = colorTexture(point.primitive->material))
    color *= Vec3(texture->sample(m.baseColorMap, uvAt(point, m.baseColorMap.uvSet)));
  if (!point.primitive->colors.empty()) color *= Vec3(interpolate(point, point.primitive->colors));
  return glm::clamp(color, Vec3(0.0f), Vec3(1.0f));
}

void Materials::prefetchAlbedo(const TrianglePoint& point) const {
  const Material& m = material(point.primitive->material);
  if (const Texture* texture = colorTexture(point.primitive->material))
    texture->prefetch(m.baseColorMap, uvAt(point, m.baseColorMap.uvSet));
}

Vec3 Materials::emission(const TrianglePoint& point) const {
  const Material& m = material(point.primitive->material);
  if (!emits(point.primitive->material)) return Vec3(0.0f);
  Vec3 radiance = glm::max(m.emission, Vec3(0.0f));
  if (m.emissionMap && static_cast<std::size_t>(m.emissionMap.image) < srgbByImage_.size()) {
    if (const auto& texture = srgbByImage_[static_cast<std::size_t>(m.emissionMap.image)])
      radiance *= Vec3(texture->sample(m.emissionMap, uvAt(point, m.emissionMap.uvSet)));
  }
  return radiance;
}

float Materials::alpha(const TrianglePoint& point) const {
  const Material& m = material(point.primitive->material);
  float a = m.baseColor.w;
  if (const Texture* texture = colorTexture(point.primitive->material))
    a *= texture->sampleAlpha(m.baseColorMap, uvAt(point, m.baseColorMap.uvSet));
  if (!point.primitive->colors.empty()) a *= interpolate(point, point.primitive->colors).w;
  return a;
}

float Materials::opacity(const TrianglePoint& point) const {
  const Material& m = material(point.primitive->material);
  return m.alphaMode == AlphaMode::Opaque ? 1.0f : applyAlphaMode(m, alpha(point));
}

bool Materials::needsAlphaTest(const Primitive& primitive) const {
  const Material& m = material(primitive.material);
  if (m.alphaMode == AlphaMode::Opaque) return false;
  const Texture* texture = colorTexture(primitive.material);
  if ((texture && !texture->opaque()) || hasPartialVertexAlpha(primitive)) return true;
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
