#include "baker/lights.h"

#include <algorithm>
#include <array>

#include "baker/sampling.h"
#include "scene/parallel.h"

namespace lumel {
namespace {

/// Points on a side of the triangular grid that a texture's emission is averaged over.
constexpr int kEmissionGrid = 8;

float maxComponent(const Vec3& v) { return std::max({v.x, v.y, v.z}); }

float spotAttenuation(const Light& light, const Vec3& fromLight) {
  const float cosOuter = std::cos(light.outerConeAngle);
  const float scale = 1.0f / std::max(0.001f, std::cos(light.innerConeAngle) - cosOuter);
  const float cone = std::clamp((glm::dot(light.direction, fromLight) - cosOuter) * scale, 0.0f, 1.0f);
  return cone * cone;
}

/// Flux, to weigh lights against each other.
float power(const Light& light, float extent) {
  const float strength = luminance(light.color) * light.intensity;
  switch (light.type) {
    case LightType::Directional:
      return strength * kPi * extent * extent;
    case LightType::Spot:
      return strength * 2.0f * kPi * (1.0f - std::cos(light.outerConeAngle));
    case LightType::Point:
      return strength * 4.0f * kPi;
  }
  return 0.0f;
}

/// Mean luminance over a triangle of what it sends out where it is not cut out.
float meanEmission(const Materials& materials, const Primitive& primitive, std::uint32_t triangle) {
  const Material& material = materials.material(primitive.material);
  const bool varies = material.emissionMap || materials.needsAlphaTest(primitive);
  const int n = varies ? kEmissionGrid : 1;
  double sum = 0.0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vec2 u = (Vec2(i, j) + 0.5f) / static_cast<float>(n);
      const TrianglePoint point{&primitive, triangle, sampleTriangle(u)};
      sum += static_cast<double>(luminance(materials.emission(point)) * materials.opacity(point));
    }
  return static_cast<float>(sum / (n * n));
}

}  // namespace

Vec3 facingIrradiance(const Light& light, const Vec3& p, Vec3& wi) {
  if (light.type == LightType::Directional) {
    wi = -light.direction;
    return light.color * light.intensity;
  }
  const Vec3 toLight = light.position - p;
  const float distance2 = glm::dot(toLight, toLight);
  if (!(distance2 > 0.0f)) return Vec3(0.0f);
  wi = toLight / std::sqrt(distance2);
  float attenuation = 1.0f / distance2;
  if (light.range > 0.0f) {
    const float share = distance2 / (light.range * light.range);
    attenuation *= std::clamp(1.0f - share * share, 0.0f, 1.0f);
  }
  if (light.type == LightType::Spot) attenuation *= spotAttenuation(light, -wi);
  return light.color * (light.intensity * attenuation);
}

PunctualLights::PunctualLights(const std::vector<Light>& lights, float extent) {
  for (const Light& light : lights)
    if (light.intensity > 0.0f && maxComponent(light.color) > 0.0f) lights_.push_back(light);
  if (lights_.size() <= kLocalLights) return;
  std::vector<float> powers;
  powers.reserve(lights_.size());
  for (const Light& light : lights_) powers.push_back(power(light, extent));
  byPower_ = Distribution(powers);
}

LightSample PunctualLights::sampleOne(std::size_t index, const Vec3& p) const {
  LightSample sample;
  sample.weight = facingIrradiance(lights_[index], p, sample.wi);
  sample.distant = lights_[index].type == LightType::Directional;
  sample.target = lights_[index].position;
  return sample;
}

LightSample PunctualLights::sample(const Vec3& p, const Vec3& n, float u) const {
  LightSample sample;
  std::size_t chosen = 0;
  float probability = 1.0f;
  if (!byPower_.empty()) {
    chosen = byPower_.choose(u);
    probability = byPower_.probability(chosen);
    sample.weight = facingIrradiance(lights_[chosen], p, sample.wi) / probability;
  } else {
    std::array<float, kLocalLights> importance;
    float total = 0.0f;
    for (std::size_t i = 0; i < lights_.size(); ++i) {
      Vec3 wi(0.0f);
      const float facing = luminance(facingIrradiance(lights_[i], p, wi));
      const float cosTheta = glm::dot(wi, n);
      importance[i] = cosTheta > 0.0f ? facing * (1.0f + 2.0f * cosTheta) : 0.0f;
      total += importance[i];
    }
    if (!(total > 0.0f)) return sample;
    float before = 0.0f;
    const float threshold = u * total;
    std::size_t last = 0;
    for (chosen = 0; chosen < lights_.size(); ++chosen) {
      if (importance[chosen] > 0.0f) last = chosen;
      before += importance[chosen];
      if (threshold < before) break;
    }
    if (chosen == lights_.size()) chosen = last;
    probability = importance[chosen] / total;
    sample.weight = facingIrradiance(lights_[chosen], p, sample.wi) / probability;
  }
  sample.distant = lights_[chosen].type == LightType::Directional;
  sample.target = lights_[chosen].position;
  return sample;
}

EmissiveTriangles::EmissiveTriangles(RayScene& rays, const Materials& materials)
    : rays_(&rays), materials_(&materials) {
  for (std::uint32_t p = 0; p < rays.parts().size(); ++p) {
    ScenePart& part = rays.parts()[p];
    if (!materials.emits(part.primitive->material)) continue;
    part.firstEmitter = static_cast<std::int64_t>(triangles_.size());
    for (std::uint32_t t = 0; t < part.primitive->triangleCount(); ++t)
      triangles_.push_back({.part = p, .triangle = t});
  }
  std::vector<float> powers(triangles_.size());
  std::vector<float> areas(triangles_.size());
  parallelFor(triangles_.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      areas[i] = describe(triangles_[i]);
      const Primitive& primitive = *rays.parts()[triangles_[i].part].primitive;
      const float sides = triangles_[i].doubleSided ? 2.0f : 1.0f;
      powers[i] = sides * areas[i] * meanEmission(materials, primitive, triangles_[i].triangle);
    }
  });
  choice_ = Distribution(powers);
  if (choice_.empty()) return;
  for (std::size_t i = 0; i < triangles_.size(); ++i)
    if (choice_.probability(i) > 0.0f) triangles_[i].densityByArea = choice_.probability(i) / areas[i];
}

float EmissiveTriangles::describe(Emitter& emitter) const {
  const ScenePart& part = rays_->parts()[emitter.part];
  const Material& material = materials_->material(part.primitive->material);
  const std::array<Vec3, 3> corners = rays_->corners(part, emitter.triangle);
  emitter.corner = corners[0];
  emitter.e1 = corners[1] - corners[0];
  emitter.e2 = corners[2] - corners[0];
  const Vec3 cross = glm::cross(emitter.e1, emitter.e2);
  emitter.ng = glm::normalize(cross) * part.frontSign;
  emitter.offsetMeters = offsetDistance(corners, part.translation);
  emitter.doubleSided = material.doubleSided;
  emitter.uniform = !material.emissionMap && !materials_->needsAlphaTest(*part.primitive);
  emitter.radiance = materials_->emission({part.primitive, emitter.triangle, Vec2(1.0f / 3)});
  return 0.5f * glm::length(cross);
}

Vec3 EmissiveTriangles::radianceAt(const Emitter& emitter, Vec2 barycentric) const {
  if (emitter.uniform) return emitter.radiance;
  const TrianglePoint point{rays_->parts()[emitter.part].primitive, emitter.triangle, barycentric};
  return materials_->emission(point) * materials_->opacity(point);
}

LightSample EmissiveTriangles::sample(const Vec3& p, float uTriangle, Vec2 uPoint) const {
  LightSample sample;
  const Emitter& emitter = triangles_[choice_.choose(uTriangle)];
  const Vec2 b = sampleTriangle(uPoint);
  const Vec3 q = emitter.corner + b.x * emitter.e1 + b.y * emitter.e2;
  const Vec3 toLight = q - p;
  const float distance2 = glm::dot(toLight, toLight);
  if (!(distance2 > 0.0f)) return sample;
  sample.wi = toLight / std::sqrt(distance2);
  float cosLight = -glm::dot(sample.wi, emitter.ng);
  Vec3 ng = emitter.ng;
  if (cosLight < 0.0f && emitter.doubleSided) {
    ng = -ng;
    cosLight = -cosLight;
  }
  if (!(cosLight > 0.0f)) return sample;
  sample.pdf = emitter.densityByArea * distance2 / cosLight;
  sample.weight = radianceAt(emitter, b) / sample.pdf;
  sample.target = q + ng * emitter.offsetMeters;
  return sample;
}

float EmissiveTriangles::pdf(const HitSurface& hit, const Vec3& origin) const {
  const std::int64_t first = rays_->parts()[hit.part].firstEmitter;
  if (first < 0) return 0.0f;
  const Emitter& emitter = triangles_[static_cast<std::size_t>(first) + hit.point.triangle];
  const Vec3 toLight = hit.p - origin;
  const float distance2 = glm::dot(toLight, toLight);
  const float cosLight = std::abs(glm::dot(toLight, hit.ng)) / std::sqrt(distance2);
  return emitter.densityByArea * distance2 / cosLight;
}

Vec3 emittedTowardsRay(const Materials& materials, const HitSurface& hit) {
  if (!materials.emits(hit.material)) return Vec3(0.0f);
  if (hit.backFace && !materials.material(hit.material).doubleSided) return Vec3(0.0f);
  return materials.emission(hit.point);
}

}  // namespace lumel
