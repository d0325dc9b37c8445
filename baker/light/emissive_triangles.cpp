#include "baker/light/emissive_triangles.h"

#include <algorithm>
#include <array>

#include "baker/rays/sampling.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// A grid of so many points on a side finds the mean opacity of a triangle that is cut out ...
constexpr int kOpacityGrid = 8;
/// ... which counts as no less than this: what lies between the points may be opaque.
constexpr float kLeastOpacity = 1.0f / 64;
/// Emitters that divided triangles become, in all, shared in proportion to their light; and the most of one.
constexpr double kBoxes = 8192.0;
constexpr double kMostBoxes = 128.0;
/// A hit this far beyond the border of a part, in barycentric weights of the part, still belongs to it.
constexpr float kBeyondBorder = 1e-3f;
constexpr Vec3 kLuminance(0.2126f, 0.7152f, 0.0722f);

/// Returns the mean over a triangle of a function of its points, by a triangular grid.
template <class Value>
double gridMean(const Primitive& primitive, std::uint32_t triangle, Value value) {
  double sum = 0.0;
  for (int i = 0; i < kOpacityGrid; ++i)
    for (int j = 0; j < kOpacityGrid; ++j)
      sum += static_cast<double>(value(
          TrianglePoint{&primitive, triangle, sampleTriangle((Vec2(i, j) + 0.5f) / static_cast<float>(kOpacityGrid))}));
  return sum / (kOpacityGrid * kOpacityGrid);
}

[[gnu::always_inline]] inline bool bySolidAngle(float solidAngle) {
  return (solidAngle > EmissiveTriangles::kLeastSolidAngle) & (solidAngle < EmissiveTriangles::kMostSolidAngle);
}

/// Returns a cosine, or length, for the side of a triangle that p looks at: 0 from behind, unless the triangle shines
/// there too (back = 1; else 0).
[[gnu::always_inline]] inline float facing(float front, float back) {
  const float behind = -back * front;
  return front > behind ? front : behind;
}

/// Returns the volume that the solid angle of the corners as a point sees them is made of (sampling.h); 0 from the side
/// that does not shine. `a` is the first corner.
[[gnu::always_inline]] inline float volumeOf(const Vec3& a, const Vec3& ng, float doubleArea, float back) {
  return facing(-glm::dot(a, ng), back) * doubleArea;
}

/// Returns mean luminance times solid angle to half a percent: atan(x) is x / (1 + 0.28 x^2) within 0.005 for |x| <= 1.
[[gnu::always_inline]] inline float importanceOf(const Vec3& a, const Vec3& e1, const Vec3& e2, float seen,
                                                 float luminance) {
  const float below = belowSolidAngle<Vec3, float>(a, a + e1, a + e2);
  const float steep = std::abs(below);
  const float volume = pick(seen > 0.0f, seen, 0.0f);
  const bool isSmall = volume < steep;
  const float most = pick(isSmall, steep, volume);
  const float least = pick(isSmall, volume, steep);
  const float small = most * least / pick(most > 0.0f, most * most + 0.28f * (least * least), 1.0f);
  const float acute = pick(isSmall, small, 0.5f * kPi - small);
  const float half = pick(below < 0.0f, kPi - acute, acute);
  return pick(volume > 0.0f, 2.0f * half * luminance, 0.0f);
}

}  // namespace

/// Holds what sampling needs of the emitters that the lanes chose.
struct alignas(64) EmissiveTriangles::Chosen {
  // These members are laid out as an emitter begins.
  Vec3Lanes corner;
  float doubleArea[kLanes] = {};
  Vec3Lanes e1;
  float luminance[kLanes] = {};
  Vec3Lanes e2;
  float back[kLanes] = {};
  Vec3Lanes ng;
  float offsetMeters[kLanes] = {};
  Vec3Lanes radiance;

  float probability[kLanes] = {};  // 0: nothing was chosen
  std::uint32_t triangle[kLanes] = {};
  // The point on each.
  float x[kLanes];
  float y[kLanes];
};

EmissiveTriangles::EmissiveTriangles(RayScene& rays, const Materials& materials)
    : rays_(&rays), materials_(&materials) {
  std::vector<Emitter> whole;
  for (std::uint32_t p = 0; p < rays.parts().size(); ++p) {
    ScenePart& part = rays.parts()[p];
    if (!materials.emits(part.primitive->material)) continue;
    part.firstEmitter = static_cast<std::int64_t>(whole.size());
    for (std::uint32_t t = 0; t < part.primitive->triangleCount(); ++t) whole.push_back({.part = p, .triangle = t});
  }
  if (whole.empty()) return;
  const Fields fields = fieldsOf(rays);
  parallelFor(whole.size(), 64, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      describe(whole[i], fields[static_cast<std::size_t>(rays.parts()[whole[i].part].primitive->material)].get());
  });
  divide(whole, fields);
  findWide();
  all_ = choiceAmong(Emitters::All);
  if (hasWide_) withoutWide_ = choiceAmong(Emitters::WithoutWide);
  uniform_ = std::all_of(triangles_.begin(), triangles_.end(), [](const Emitter& e) { return e.uniform; });
}

/// Finds the range of luminances that holds most of the area that shines.
void EmissiveTriangles::findWide() {
  const auto brightness = [&](std::uint32_t i) { return triangles_[i].luminance * triangles_[i].shining.contrast; };
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < triangles_.size(); ++i)
    if (brightness(i) > 0.0f && std::isfinite(brightness(i))) order.push_back(i);
  std::ranges::sort(order, {}, brightness);
  double area = 0.0, most = 0.0;
  std::size_t dimmest = 0, first = 0, end = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    area += static_cast<double>(triangles_[order[i]].doubleArea);
    for (; brightness(order[dimmest]) * kWideRange < brightness(order[i]); ++dimmest)
      area -= static_cast<double>(triangles_[order[dimmest]].doubleArea);
    if (!(area > most)) continue;
    most = area;
    first = dimmest;
    end = i + 1;
  }
  hasWide_ = end - first >= kFewestWide;
  for (std::size_t i = first; i < end && hasWide_; ++i) triangles_[order[i]].isWide = true;
}

EmissiveTriangles::Choice EmissiveTriangles::choiceAmong(Emitters among) const {
  std::vector<LightBounds> bounds(triangles_.size());
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Emitter& emitter = triangles_[i];
    const Vec3 second = emitter.corner + emitter.e1;
    const Vec3 third = emitter.corner + emitter.e2;
    bounds[i].min = glm::min(emitter.corner, glm::min(second, third));
    bounds[i].max = glm::max(emitter.corner, glm::max(second, third));
    bounds[i].axis = emitter.ng;
    bounds[i].cosSpread = emitter.back > 0.0f ? -1.0f : 1.0f;
    const bool isLeftOut = among == Emitters::WithoutWide && emitter.isWide;
    bounds[i].power = isLeftOut ? 0.0f : 0.5f * emitter.doubleArea * emitter.luminance;
  }
  Choice choice{LightTree(bounds), {}};
  for (const std::uint32_t triangle : choice.tree.onlyLeaf()) choice.few.push_back(triangles_[triangle]);
  return choice;
}

EmissiveTriangles::Fields EmissiveTriangles::fieldsOf(const RayScene& rays) const {
  Fields fields;
  for (const ScenePart& part : rays.parts()) {
    const auto index = static_cast<std::size_t>(part.primitive->material);
    if (fields.size() <= index) fields.resize(index + 1);
    const Texture* texture = part.firstEmitter < 0 ? nullptr : materials_->emissionTexture(part.primitive->material);
    if (texture == nullptr || fields[index]) continue;
    const Material& material = materials_->material(part.primitive->material);
    fields[index] = std::make_unique<EmissionField>(*texture, material.emissionMap,
                                                    kLuminance * glm::max(material.emission, Vec3(0.0f)));
  }
  return fields;
}

void EmissiveTriangles::describe(Emitter& emitter, const EmissionField* field) const {
  const ScenePart& part = rays_->parts()[emitter.part];
  const Primitive& primitive = *part.primitive;
  const Material& material = materials_->material(primitive.material);
  const std::array<Vec3, 3> corners = rays_->corners(part, emitter.triangle);
  emitter.corner = corners[0];
  emitter.e1 = corners[1] - corners[0];
  emitter.e2 = corners[2] - corners[0];
  const Vec3 cross = glm::cross(emitter.e1, emitter.e2);
  emitter.doubleArea = glm::length(cross);
  emitter.ng = glm::normalize(cross) * part.frontSign;
  emitter.offsetMeters = offsetDistance(corners, part.translation);
  emitter.back = material.doubleSided ? 1.0f : 0.0f;
  const bool cutOut = materials_->needsAlphaTest(primitive);
  emitter.uniform = field == nullptr && !cutOut;
  emitter.radiance = materials_->emission({&primitive, emitter.triangle, Vec2(1.0f / 3)});
  emitter.luminance = luminance(emitter.radiance);
  if (field != nullptr) emitter.luminance = static_cast<float>(meanOnTexture(emitter, *field));
  if (cutOut) {
    const double opacity =
        gridMean(primitive, emitter.triangle, [&](const TrianglePoint& p) { return materials_->opacity(p); });
    emitter.luminance *= std::max(static_cast<float>(opacity), kLeastOpacity);
  }
  emitter.shining.luminance = emitter.luminance;
}

std::optional<TexturedTriangle> EmissiveTriangles::onTexture(const Emitter& emitter, const EmissionField* field) const {
  if (field == nullptr) return {};
  const Primitive& primitive = *rays_->parts()[emitter.part].primitive;
  const int uvSet = materials_->material(primitive.material).emissionMap.uvSet;
  const auto at = [&](const Vec2& weights) {
    return field->pointOf(uvAt({&primitive, emitter.triangle, weights}, uvSet));
  };
  return TexturedTriangle(*field, {at({0, 0}), at({1, 0}), at({0, 1})}, emitter.e1, emitter.e2);
}

/// Returns the mean luminance over a triangle: exact where the triangle has an area in the texture. Where it is a line
/// or a point there, a grid of points finds it, and never as nothing where anything on the line shines.
double EmissiveTriangles::meanOnTexture(const Emitter& emitter, const EmissionField& field) const {
  const TexturedTriangle triangle = *onTexture(emitter, &field);
  if (!triangle.isLine()) return triangle.mean();
  if (!triangle.shines()) return 0.0;
  const double mean = gridMean(*rays_->parts()[emitter.part].primitive, emitter.triangle,
                               [&](const TrianglePoint& p) { return luminance(materials_->emission(p)); });
  const double brightest = static_cast<double>(
      luminance(glm::max(materials_->material(rays_->parts()[emitter.part].primitive->material).emission, Vec3(0.0f))));
  return std::max(mean, brightest / (kOpacityGrid * kOpacityGrid));
}

std::vector<ShiningPart> EmissiveTriangles::partsOf(const Emitter& emitter, const EmissionField* field,
                                                    std::size_t mostBoxes) const {
  if (!(emitter.luminance > 0.0f)) return {};
  const std::optional<TexturedTriangle> triangle = onTexture(emitter, field);
  if (!triangle || triangle->isLine()) return {emitter.shining};
  const bool cutOut = materials_->needsAlphaTest(*rays_->parts()[emitter.part].primitive);
  const double mean = cutOut ? triangle->mean() : static_cast<double>(emitter.luminance);
  std::vector<ShiningPart> parts = triangle->parts(mostBoxes, mean);
  // Cut-outs take the same share of every part.
  const float opacity = cutOut ? static_cast<float>(static_cast<double>(emitter.luminance) / mean) : 1.0f;
  for (ShiningPart& part : parts) part.luminance *= opacity;
  return parts.empty() ? std::vector<ShiningPart>{emitter.shining} : parts;
}

/// Makes emitters of whole triangles, in their order.
void EmissiveTriangles::divide(const std::vector<Emitter>& whole, const Fields& fields) {
  const auto lightOf = [](const Emitter& e) {
    return static_cast<double>(e.doubleArea) * static_cast<double>(e.luminance);
  };
  double total = 0.0;
  for (const Emitter& emitter : whole) total += std::isfinite(lightOf(emitter)) ? lightOf(emitter) : 0.0;
  std::vector<std::vector<ShiningPart>> parts(whole.size());
  parallelFor(whole.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const double share = total > 0.0 ? lightOf(whole[i]) / total : 0.0;
      parts[i] =
          partsOf(whole[i], fields[static_cast<std::size_t>(rays_->parts()[whole[i].part].primitive->material)].get(),
                  static_cast<std::size_t>(std::clamp(kBoxes * share, 1.0, kMostBoxes)));
    }
  });
  for (std::size_t i = 0; i < whole.size(); ++i) {
    firstOf_.push_back(static_cast<std::uint32_t>(triangles_.size()));
    const Vec3 e1 = whole[i].e1, e2 = whole[i].e2;
    for (const ShiningPart& part : parts[i]) {
      Emitter emitter = whole[i];
      const Vec2 d1 = part.corners[1] - part.corners[0], d2 = part.corners[2] - part.corners[0];
      emitter.corner = whole[i].corner + part.corners[0].x * e1 + part.corners[0].y * e2;
      emitter.e1 = d1.x * e1 + d1.y * e2;
      emitter.e2 = d2.x * e1 + d2.y * e2;
      emitter.doubleArea = whole[i].doubleArea * std::abs(d1.x * d2.y - d1.y * d2.x);
      emitter.luminance = part.luminance;
      emitter.shining = part;
      triangles_.push_back(emitter);
    }
  }
  firstOf_.push_back(static_cast<std::uint32_t>(triangles_.size()));
}

Vec3 EmissiveTriangles::radianceAt(const Emitter& emitter, Vec2 barycentric) const {
  if (emitter.uniform) return emitter.radiance;
  const std::array<Vec2, 3>& c = emitter.shining.corners;
  const TrianglePoint point{rays_->parts()[emitter.part].primitive, emitter.triangle,
                            c[0] + barycentric.x * (c[1] - c[0]) + barycentric.y * (c[2] - c[0])};
  return materials_->emission(point) * materials_->opacity(point);
}

std::uint32_t EmissiveTriangles::emitterAt(std::size_t triangle, const Vec2& barycentric) const {
  std::uint32_t best = kNone;
  float deepest = -kBeyondBorder;
  for (std::uint32_t i = firstOf_[triangle]; i < firstOf_[triangle + 1]; ++i) {
    const std::array<Vec2, 3>& c = triangles_[i].shining.corners;
    const Vec2 d1 = c[1] - c[0], d2 = c[2] - c[0], p = barycentric - c[0];
    const float perTwiceArea = 1.0f / (d1.x * d2.y - d1.y * d2.x);
    const float w1 = (p.x * d2.y - p.y * d2.x) * perTwiceArea, w2 = (d1.x * p.y - d1.y * p.x) * perTwiceArea;
    const float depth = std::min({w1, w2, 1.0f - w1 - w2});
    if (!(depth > deepest)) continue;
    deepest = depth;
    best = i;
  }
  return best;
}

/// Returns the emitter that a ray hit, or kNone.
std::uint32_t EmissiveTriangles::emitterAt(const HitSurface& hit) const {
  const std::int64_t first = rays_->parts()[hit.part].firstEmitter;
  if (first < 0) return kNone;
  return emitterAt(static_cast<std::size_t>(first) + hit.point.triangle, hit.point.barycentric);
}

bool EmissiveTriangles::isWide(const HitSurface& hit) const {
  const std::uint32_t light = emitterAt(hit);
  return light != kNone && triangles_[light].isWide;
}

float EmissiveTriangles::importance(std::uint32_t triangle, const Vec3& p) const {
  const Emitter& e = triangles_[triangle];
  const Vec3 a = e.corner - p;
  return importanceOf(a, e.e1, e.e2, volumeOf(a, e.ng, e.doubleArea, e.back), e.luminance);
}

/// Chooses among few emitters by importance, as LightTree::chooseInLeaf does.
LUMEL_FOR_EACH_CPU void EmissiveTriangles::chooseAmongFew(std::span<const Emitter> few, const Vec3Lanes& p,
                                                          const UnitLanes& u, Chosen& chosen) {
  alignas(64) float each[LightTree::kLeaf][kLanes];
  alignas(64) float total[kLanes] = {};
  for (std::size_t k = 0; k < few.size(); ++k) {
    const Emitter e = few[k];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Vec3 a = e.corner - p[lane];
      each[k][lane] = importanceOf(a, e.e1, e.e2, volumeOf(a, e.ng, e.doubleArea, e.back), e.luminance);
      total[lane] += each[k][lane];
    }
  }
  alignas(64) float before[kLanes] = {};
  alignas(64) float taken[kLanes] = {};
  for (std::size_t k = 0; k < few.size(); ++k) {
    const Emitter e = few[k];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      // The last one that is possible, until the target is passed.
      const bool takes = (each[k][lane] > 0.0f) & !((taken[lane] > 0.0f) & (u.u[lane] * total[lane] < before[lane]));
      before[lane] += each[k][lane];
      taken[lane] = pick(takes, each[k][lane], taken[lane]);
      chosen.triangle[lane] = takes ? static_cast<std::uint32_t>(k) : chosen.triangle[lane];
      chosen.corner.x[lane] = pick(takes, e.corner.x, chosen.corner.x[lane]);
      chosen.corner.y[lane] = pick(takes, e.corner.y, chosen.corner.y[lane]);
      chosen.corner.z[lane] = pick(takes, e.corner.z, chosen.corner.z[lane]);
      chosen.e1.x[lane] = pick(takes, e.e1.x, chosen.e1.x[lane]);
      chosen.e1.y[lane] = pick(takes, e.e1.y, chosen.e1.y[lane]);
      chosen.e1.z[lane] = pick(takes, e.e1.z, chosen.e1.z[lane]);
      chosen.e2.x[lane] = pick(takes, e.e2.x, chosen.e2.x[lane]);
      chosen.e2.y[lane] = pick(takes, e.e2.y, chosen.e2.y[lane]);
      chosen.e2.z[lane] = pick(takes, e.e2.z, chosen.e2.z[lane]);
      chosen.ng.x[lane] = pick(takes, e.ng.x, chosen.ng.x[lane]);
      chosen.ng.y[lane] = pick(takes, e.ng.y, chosen.ng.y[lane]);
      chosen.ng.z[lane] = pick(takes, e.ng.z, chosen.ng.z[lane]);
      chosen.radiance.x[lane] = pick(takes, e.radiance.x, chosen.radiance.x[lane]);
      chosen.radiance.y[lane] = pick(takes, e.radiance.y, chosen.radiance.y[lane]);
      chosen.radiance.z[lane] = pick(takes, e.radiance.z, chosen.radiance.z[lane]);
      chosen.doubleArea[lane] = pick(takes, e.doubleArea, chosen.doubleArea[lane]);
      chosen.offsetMeters[lane] = pick(takes, e.offsetMeters, chosen.offsetMeters[lane]);
      chosen.back[lane] = pick(takes, e.back, chosen.back[lane]);
    }
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    chosen.probability[lane] = taken[lane] / pick(total[lane] > 0.0f, total[lane], 1.0f);
}

/// Chooses among the emitters of each lane's leaf.
LUMEL_FOR_EACH_CPU void EmissiveTriangles::chooseInLeaves(const Emitter* triangles,
                                                          const std::array<LaneFlags, LightTree::kLeaf>& lights,
                                                          const LightTree::Descent& descent, const Vec3Lanes& p,
                                                          Chosen& chosen) {
  LaneFlags at;
  alignas(64) float each[LightTree::kLeaf][kLanes];
  alignas(64) float total[kLanes] = {};
  for (std::size_t k = 0; k < LightTree::kLeaf; ++k) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) at[lane] = lights[k][lane] < 0 ? 0 : lights[k][lane];
    turnRecords(triangles, at, &chosen);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Vec3 a = chosen.corner[lane] - p[lane];
      const float seen = volumeOf(a, chosen.ng[lane], chosen.doubleArea[lane], chosen.back[lane]);
      const float importance = importanceOf(a, chosen.e1[lane], chosen.e2[lane], seen, chosen.luminance[lane]);
      each[k][lane] = pick(lights[k][lane] >= 0, importance, 0.0f);
      total[lane] += each[k][lane];
    }
  }
  alignas(64) float before[kLanes] = {};
  alignas(64) float taken[kLanes] = {};
  at.fill(0);
  for (std::size_t k = 0; k < LightTree::kLeaf; ++k)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const float target = static_cast<float>(descent.rest[lane]) * total[lane];
      const bool takes = (each[k][lane] > 0.0f) & !((taken[lane] > 0.0f) & (target < before[lane]));
      before[lane] += each[k][lane];
      taken[lane] = pick(takes, each[k][lane], taken[lane]);
      at[lane] = takes ? lights[k][lane] : at[lane];
    }
  turnRecords(triangles, at, &chosen);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const float share = taken[lane] / pick(total[lane] > 0.0f, total[lane], 1.0f);
    chosen.probability[lane] = descent.probability[lane] * share;
    chosen.triangle[lane] = static_cast<std::uint32_t>(at[lane]);
  }
}

/// Draws points on the chosen triangles, and finds what they send to p.
LUMEL_FOR_EACH_CPU void EmissiveTriangles::samplePoints(const Vec3Lanes& p, const UnitSquareLanes& u, Chosen& chosen,
                                                        LightSampleLanes& samples) {
#pragma GCC ivdep
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Vec3 e1 = chosen.e1[lane], e2 = chosen.e2[lane];
    const float back = chosen.back[lane];
    const Vec3 a = chosen.corner[lane] - p[lane];
    const Vec3 b = a + e1, c = a + e2;
    const float volume = volumeOf(a, chosen.ng[lane], chosen.doubleArea[lane], back);
    // (That of a triangle seen from its edge is 0 or a full sphere: neither is sampled so, or shines.)
    const float solidAngle = 2.0f * angleAbove(volume, belowSolidAngle<Vec3, float>(a, b, c));
    const bool round = bySolidAngle(solidAngle);

    const float perA = 1.0f / glm::length(a), perB = 1.0f / glm::length(b), perC = 1.0f / glm::length(c);
    const SphericalTriangleOf<float> sphere{a * perA, b * perB, c * perC};
    const Vec3 towards = sphere.sample({u.x[lane], u.y[lane]}, solidAngle, volume * perA * perB * perC);
    // The direction meets the triangle at (first, second) (Moeller and Trumbore 1997).
    const Vec3 across = glm::cross(towards, e2);
    const float below = glm::dot(e1, across);
    const float perBelow = 1.0f / pick(below != 0.0f, below, 1.0f);
    const float first = within(-glm::dot(a, across) * perBelow, 0.0f, 1.0f);
    const float second = within(-glm::dot(towards, glm::cross(a, e1)) * perBelow, 0.0f, 1.0f - first);

    const Vec2 flat = sampleTriangle({u.x[lane], u.y[lane]});
    const float x = pick(round, pick(below != 0.0f, first, 1.0f / 3), flat.x);
    const float y = pick(round, pick(below != 0.0f, second, 1.0f / 3), flat.y);
    chosen.x[lane] = x;
    chosen.y[lane] = y;

    const Vec3 toLight = a + x * e1 + y * e2;
    const float distance2 = glm::dot(toLight, toLight);
    const float perDistance = 1.0f / std::sqrt(pick(distance2 > 0.0f, distance2, 1.0f));
    const Vec3 wi = toLight * perDistance;
    const float cosFront = -glm::dot(wi, chosen.ng[lane]);
    const float side = pick(cosFront < 0.0f, 1.0f - 2.0f * back, 1.0f);
    const float cosLight = facing(cosFront, back);
    const float choice = chosen.probability[lane];
    const bool shines = (distance2 > 0.0f) & (cosLight > 0.0f) & (choice > 0.0f);
    const float density = pick(round, 1.0f / solidAngle, 2.0f * distance2 / (chosen.doubleArea[lane] * cosLight));
    const float pdf = pick(shines, choice * density, 0.0f);
    const float perPdf = pick(shines, 1.0f / pdf, 0.0f);
    const float away = side * chosen.offsetMeters[lane];
    samples.pdf[lane] = pdf;
    samples.distant[lane] = 0;
    samples.wi.x[lane] = wi.x;
    samples.wi.y[lane] = wi.y;
    samples.wi.z[lane] = wi.z;
    samples.weight.x[lane] = chosen.radiance.x[lane] * perPdf;
    samples.weight.y[lane] = chosen.radiance.y[lane] * perPdf;
    samples.weight.z[lane] = chosen.radiance.z[lane] * perPdf;
    samples.target.x[lane] = chosen.corner.x[lane] + x * e1.x + y * e2.x + away * chosen.ng.x[lane];
    samples.target.y[lane] = chosen.corner.y[lane] + x * e1.y + y * e2.y + away * chosen.ng.y[lane];
    samples.target.z[lane] = chosen.corner.z[lane] + x * e1.z + y * e2.z + away * chosen.ng.z[lane];
  }
}

void EmissiveTriangles::sample(const Vec3Lanes& p, const LaneFlags& active, const UnitLanes& uTriangle,
                               const UnitSquareLanes& uPoint, LightSampleLanes& samples, Emitters among) const {
  Chosen chosen;
  const auto& [tree, few] = choiceOf(among);
  if (!few.empty()) {
    chooseAmongFew(few, p, uTriangle, chosen);
  } else {
    LightTree::Descent descent;
    tree.descend(p, nullptr, active, uTriangle.u, descent);
    std::array<LaneFlags, LightTree::kLeaf> lights;
    tree.lightsOf(descent, lights);
    chooseInLeaves(triangles_.data(), lights, descent, p, chosen);
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      chosen.radiance.set(lane, triangles_[chosen.triangle[lane]].radiance);
  }
  samplePoints(p, uPoint, chosen, samples);
  if (uniform_) return;
  const std::vector<Emitter>& from = few.empty() ? triangles_ : few;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Emitter& emitter = from[chosen.triangle[lane]];
    if (!emitter.uniform && samples.pdf[lane] > 0.0f)
      samples.weight.set(lane, radianceAt(emitter, {chosen.x[lane], chosen.y[lane]}) / samples.pdf[lane]);
  }
}

float EmissiveTriangles::pdf(const HitSurface& hit, const Vec3& origin, Emitters among) const {
  const std::uint32_t light = emitterAt(hit);
  if (light == kNone) return 0.0f;
  const float probability = choiceOf(among).tree.probability(
      {origin}, light, [&](std::uint32_t triangle) { return importance(triangle, origin); });
  if (!(probability > 0.0f)) return 0.0f;
  const Emitter& emitter = triangles_[light];
  const Vec3 a = emitter.corner - origin;
  const float angle =
      triangleSolidAngle(a, a + emitter.e1, a + emitter.e2, volumeOf(a, emitter.ng, emitter.doubleArea, emitter.back));
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
