#include "baker/lights.h"

#include <algorithm>
#include <array>

#include "baker/sampling.h"
#include "scene/parallel.h"

namespace lumel {
namespace {

/// Points on a side of the triangular grid that a texture's emission is averaged over.
constexpr int kEmissionGrid = 8;

/// Radians that a spot's cone is taken for wider, for rounding.
constexpr float kConeSlack = 0.02f;

float maxComponent(const Vec3& v) { return std::max({v.x, v.y, v.z}); }

float spotAttenuation(const Light& light, const Vec3& fromLight) {
  const float cosOuter = std::cos(light.outerConeAngle);
  const float scale = 1.0f / std::max(0.001f, std::cos(light.innerConeAngle) - cosOuter);
  const float cone = std::clamp((glm::dot(light.direction, fromLight) - cosOuter) * scale, 0.0f, 1.0f);
  return cone * cone;
}

/// Of a light with a position.
LightBounds boundsOf(const Light& light) {
  LightBounds bounds{.min = light.position, .max = light.position, .cosSpread = -1.0f, .cosEmit = 0.0f};
  bounds.power = luminance(light.color) * light.intensity;
  if (light.range > 0.0f) bounds.reach = light.range;
  if (light.type == LightType::Spot) {
    // All directions inside of its cone count alike, and those outside not at all.
    bounds.axis = light.direction;
    bounds.cosSpread = std::cos(light.outerConeAngle);
    bounds.cosEmit = std::cos(kConeSlack);
  }
  return bounds;
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

PunctualLights::PunctualLights(const std::vector<Light>& lights) {
  for (const bool directional : {true, false}) {
    for (const Light& light : lights)
      if (light.intensity > 0.0f && maxComponent(light.color) > 0.0f &&
          (light.type == LightType::Directional) == directional)
        lights_.push_back(light);
    if (directional) directional_ = lights_.size();
  }
  if (lights_.size() - directional_ <= kLocalLights) return;
  std::vector<LightBounds> bounds(lights_.size());  // those of directional lights stay without power
  for (std::size_t i = directional_; i < lights_.size(); ++i) bounds[i] = boundsOf(lights_[i]);
  tree_ = LightTree(bounds);
}

LightSample PunctualLights::sampleOne(std::size_t index, const Vec3& p) const {
  LightSample sample;
  sample.weight = facingIrradiance(lights_[index], p, sample.wi);
  sample.distant = lights_[index].type == LightType::Directional;
  sample.target = lights_[index].position;
  return sample;
}

float PunctualLights::importance(std::size_t light, const Vec3& p, const Vec3& n) const {
  Vec3 wi(0.0f);
  const float facing = luminance(facingIrradiance(lights_[light], p, wi));
  const float cosTheta = glm::dot(wi, n);
  return cosTheta > 0.0f ? facing * (1.0f + 2.0f * cosTheta) : 0.0f;
}

LightSample PunctualLights::choose(std::size_t first, const Vec3& p, const Vec3& n, float u) const {
  if (tree_.empty()) return chooseAmong(first, lights_.size(), 0.0f, p, n, u);
  if (first == directional_) return chooseAmong(first, first, 1.0f, p, n, u);
  return chooseAmong(first, directional_, tree_.importance({p, n}), p, n, u);
}

/// Among lights [first, end) and, if it has any importance, the tree.
LightSample PunctualLights::chooseAmong(std::size_t first, std::size_t end, float treeImportance, const Vec3& p,
                                        const Vec3& n, float u) const {
  std::array<float, kLocalLights> few;
  std::vector<float> many;  // more directional lights than that are possible, if unlikely
  if (end - first > few.size()) many.resize(end - first);
  float* const importances = many.empty() ? few.data() : many.data();
  float total = treeImportance;
  for (std::size_t i = first; i < end; ++i) total += importances[i - first] = importance(i, p, n);
  if (!(total > 0.0f)) return {};
  const float threshold = u * total;
  float before = 0.0f;
  std::size_t chosen = end;
  for (std::size_t i = first; i < end; ++i) {
    if (!(importances[i - first] > 0.0f)) continue;
    chosen = i;
    before += importances[i - first];
    if (threshold < before) break;
  }
  float probability = 0.0f;
  if (chosen < end && (threshold < before || !(treeImportance > 0.0f))) {
    probability = importances[chosen - first] / total;
  } else {
    const float rest = std::clamp((threshold - before) / treeImportance, 0.0f, 0x1.fffffep-1f);
    const LightTree::Choice choice =
        tree_.choose({p, n}, rest, [&](std::uint32_t light) { return importance(light, p, n); });
    chosen = choice.light;
    probability = choice.probability * (treeImportance / total);
  }
  if (!(probability > 0.0f)) return {};
  LightSample sample = sampleOne(chosen, p);
  sample.weight /= probability;
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
  std::vector<LightBounds> bounds(triangles_.size());
  parallelFor(triangles_.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      Emitter& emitter = triangles_[i];
      describe(emitter);
      const Vec3 second = emitter.corner + emitter.e1;
      const Vec3 third = emitter.corner + emitter.e2;
      bounds[i].min = glm::min(emitter.corner, glm::min(second, third));
      bounds[i].max = glm::max(emitter.corner, glm::max(second, third));
      bounds[i].axis = emitter.ng;
      bounds[i].cosSpread = emitter.doubleSided ? -1.0f : 1.0f;
      bounds[i].power = 0.5f * emitter.doubleArea * emitter.luminance;
    }
  });
  tree_ = LightTree(bounds);
}

void EmissiveTriangles::describe(Emitter& emitter) const {
  const ScenePart& part = rays_->parts()[emitter.part];
  const Material& material = materials_->material(part.primitive->material);
  const std::array<Vec3, 3> corners = rays_->corners(part, emitter.triangle);
  emitter.corner = corners[0];
  emitter.e1 = corners[1] - corners[0];
  emitter.e2 = corners[2] - corners[0];
  const Vec3 cross = glm::cross(emitter.e1, emitter.e2);
  emitter.doubleArea = glm::length(cross);
  emitter.ng = glm::normalize(cross) * part.frontSign;
  emitter.offsetMeters = offsetDistance(corners, part.translation);
  emitter.doubleSided = material.doubleSided;
  emitter.uniform = !material.emissionMap && !materials_->needsAlphaTest(*part.primitive);
  emitter.radiance = materials_->emission({part.primitive, emitter.triangle, Vec2(1.0f / 3)});
  emitter.luminance = meanEmission(*materials_, *part.primitive, emitter.triangle);
}

Vec3 EmissiveTriangles::radianceAt(const Emitter& emitter, Vec2 barycentric) const {
  if (emitter.uniform) return emitter.radiance;
  const TrianglePoint point{rays_->parts()[emitter.part].primitive, emitter.triangle, barycentric};
  return materials_->emission(point) * materials_->opacity(point);
}

EmissiveTriangles::View EmissiveTriangles::viewOf(const Emitter& emitter, const Vec3& p) {
  const Vec3 a = emitter.corner - p;
  const float height = -glm::dot(a, emitter.ng);
  const bool dark = height < 0.0f && !emitter.doubleSided;
  return {a, a + emitter.e1, a + emitter.e2, dark ? 0.0f : std::abs(height) * emitter.doubleArea};
}

float EmissiveTriangles::solidAngle(const Emitter& emitter, const Vec3& p) {
  const View view = viewOf(emitter, p);
  return triangleSolidAngle(view.a, view.b, view.c, view.volume);
}

float EmissiveTriangles::importance(std::uint32_t triangle, const Vec3& p) const {
  const View view = viewOf(triangles_[triangle], p);
  if (!(view.volume > 0.0f)) return 0.0f;
  const float below = belowSolidAngle<Vec3, float>(view.a, view.b, view.c);
  // atan(x) is x / (1 + 0.28 x^2) within 0.005 for |x| <= 1.
  const float steep = std::abs(below);
  float half = view.volume < steep
                   ? view.volume * steep / (steep * steep + 0.28f * view.volume * view.volume)
                   : 0.5f * kPi - view.volume * steep / (view.volume * view.volume + 0.28f * steep * steep);
  if (below < 0.0f) half = kPi - half;
  return 2.0f * half * triangles_[triangle].luminance;
}

/// Barycentrics of the point that u chooses.
Vec2 EmissiveTriangles::samplePoint(const Emitter& emitter, const Vec3& p, float solidAngle, Vec2 u) {
  if (!bySolidAngle(solidAngle)) return sampleTriangle(u);
  const Vec3d a(emitter.corner - p);
  const Vec3d e1(emitter.e1);
  const Vec3d e2(emitter.e2);
  const SphericalTriangle sphere{glm::normalize(a), glm::normalize(a + e1), glm::normalize(a + e2)};
  const Vec3d wi = sphere.sample(u, static_cast<double>(solidAngle));
  // Where the direction meets the triangle (Moeller and Trumbore 1997).
  const Vec3d across = glm::cross(wi, e2);
  const double below = glm::dot(e1, across);
  if (below == 0.0) return Vec2(1.0f / 3);
  const double first = std::clamp(-glm::dot(a, across) / below, 0.0, 1.0);
  const double second = std::clamp(-glm::dot(wi, glm::cross(a, e1)) / below, 0.0, 1.0 - first);
  return {static_cast<float>(first), static_cast<float>(second)};
}

LightSample EmissiveTriangles::sample(const Vec3& p, float uTriangle, Vec2 uPoint) const {
  LightSample sample;
  const LightTree::Choice choice =
      tree_.choose({p}, uTriangle, [&](std::uint32_t triangle) { return importance(triangle, p); });
  if (!(choice.probability > 0.0f)) return sample;
  const Emitter& emitter = triangles_[choice.light];
  const float angle = solidAngle(emitter, p);
  const Vec2 b = samplePoint(emitter, p, angle, uPoint);
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
  sample.pdf =
      choice.probability * (bySolidAngle(angle) ? 1.0f / angle : 2.0f * distance2 / (emitter.doubleArea * cosLight));
  sample.weight = radianceAt(emitter, b) / sample.pdf;
  sample.target = q + ng * emitter.offsetMeters;
  return sample;
}

float EmissiveTriangles::pdf(const HitSurface& hit, const Vec3& origin) const {
  const std::int64_t first = rays_->parts()[hit.part].firstEmitter;
  if (first < 0) return 0.0f;
  const auto light = static_cast<std::uint32_t>(first) + hit.point.triangle;
  const float probability =
      tree_.probability({origin}, light, [&](std::uint32_t triangle) { return importance(triangle, origin); });
  if (!(probability > 0.0f)) return 0.0f;
  const Emitter& emitter = triangles_[light];
  const float angle = solidAngle(emitter, origin);
  if (bySolidAngle(angle)) return probability / angle;
  const Vec3 toLight = hit.p - origin;
  const float distance2 = glm::dot(toLight, toLight);
  const float cosLight = std::abs(glm::dot(toLight, hit.ng)) / std::sqrt(distance2);
  return 2.0f * probability * distance2 / (emitter.doubleArea * cosLight);
}

Vec3 emittedTowardsRay(const Materials& materials, const HitSurface& hit) {
  if (!materials.emits(hit.material)) return Vec3(0.0f);
  if (hit.backFace && !materials.material(hit.material).doubleSided) return Vec3(0.0f);
  return materials.emission(hit.point);
}

}  // namespace lumel
