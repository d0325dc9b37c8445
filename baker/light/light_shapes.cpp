#include "baker/light/light_shapes.h"

#include <algorithm>
#include <cmath>

#include "baker/light/spherical_rectangle.h"
#include "baker/rays/sampling.h"

namespace lumel {
namespace {

/// A spot's cone counts as this many radians wider, for rounding.
constexpr float kConeSlack = 0.02f;
/// Points this close to a panel's plane, as a share of its radius, see none of it.
constexpr double kLeastHeight = 1e-6;

bool isRound(LightType type) {
  return type == LightType::Point || type == LightType::Spot || type == LightType::Sphere;
}

/// cos(max(0, a - b)) of two angles in [0, pi] given by cosine and sine.
float cosLessened(float cosA, float cosB, float sinB) {
  if (cosA > cosB) return 1.0f;
  return cosA * cosB + std::sqrt(std::max(0.0f, 1.0f - cosA * cosA)) * sinB;
}

}  // namespace

bool LightShape::isOne(const Light& light) {
  if (light.type == LightType::Directional) return light.halfAngle > 0.0f;
  return isPanel(light.type) || light.type == LightType::Sphere || light.radius > 0.0f || light.profile != nullptr;
}

LightShape::LightShape(const Light& light) : light_(light), power_(light.color * light.intensity) {
  onAxis_ = luminance(power_);
  switch (light.type) {
    case LightType::Rectangle:
      boundRadius_ = 0.5f * glm::length(light.size);
      onAxis_ *= light.size.x * light.size.y;
      break;
    case LightType::Disc:
      boundRadius_ = light.radius;
      onAxis_ *= kPi * light.radius * light.radius;
      break;
    case LightType::Spot:
      cosOuter_ = std::cos(light.outerConeAngle);
      perCone_ = 1.0f / std::max(0.001f, std::cos(light.innerConeAngle) - cosOuter_);
      [[fallthrough]];
    default:
      boundRadius_ = light.radius;
  }
  if (light.range > 0.0f) perRange2_ = 1.0f / (light.range * light.range);
}

float LightShape::factor(const Vec3& wi, float distance2) const {
  const float share = distance2 * perRange2_;
  float left = std::clamp(1.0f - share * share, 0.0f, 1.0f);
  const float forward = -glm::dot(light_.direction, wi);
  if (light_.type == LightType::Spot) {
    const float cone = std::clamp((forward - cosOuter_) * perCone_, 0.0f, 1.0f);
    left *= cone * cone;
  }
  if (light_.profile && left > 0.0f)
    left *= light_.profile->share(-glm::dot(light_.right, wi), -glm::dot(light_.up, wi), forward);
  return left;
}

LightShape::Sample LightShape::sample(const Vec3& p, const Vec2& u) const {
  switch (light_.type) {
    case LightType::Directional:
      return sampleSun(u);
    case LightType::Rectangle:
      return sampleRectangle(p, u, light_.size);
    case LightType::Disc:
      return sampleDisc(p, u);
    default:
      return sampleSphere(p, u);
  }
}

LightShape::Sample LightShape::sampleSun(const Vec2& u) const {
  const float r = std::sqrt(u.x) * std::sin(light_.halfAngle);
  const Vec2 around = onUnitCircle(u.y);
  const float z = std::sqrt(std::max(0.0f, 1.0f - r * r));
  return {frameAround(-light_.direction).fromLocal({r * around.x, r * around.y, z}), power_ / z, light_.position};
}

LightShape::Sample LightShape::sampleSphere(const Vec3& p, const Vec2& u) const {
  const Vec3 toCentre = light_.position - p;
  const float distance2 = glm::dot(toCentre, toCentre), radius2 = light_.radius * light_.radius;
  if (!(distance2 > 0.0f) && !(radius2 > 0.0f)) return {};
  Sample sample;
  float weight = 0.0f;  // for an intensity of one candela, which is a radiance of 1 / (pi r^2)
  if (distance2 > radius2) {
    const float distance = std::sqrt(distance2), sin2 = radius2 / distance2;
    const float most = sin2 / (1.0f + std::sqrt(1.0f - sin2));  // 1 - cos s
    const float offAxis = u.x * most, cosine = 1.0f - offAxis;
    const float sine2 = offAxis * (2.0f - offAxis);
    const float sine = std::sqrt(sine2);
    const Vec2 around = onUnitCircle(u.y);
    sample.wi = frameAround(toCentre / distance).fromLocal({sine * around.x, sine * around.y, cosine});
    const float reach = distance * cosine - std::sqrt(std::max(0.0f, radius2 - distance2 * sine2));
    sample.target = p + sample.wi * reach;
    weight = 2.0f / ((1.0f + std::sqrt(1.0f - sin2)) * distance2);
  } else {
    sample.wi = directionFromZ(1.0f - 2.0f * u.x, u.y);
    const float along = glm::dot(toCentre, sample.wi);
    sample.target = p + sample.wi * (along + std::sqrt(std::max(0.0f, along * along + radius2 - distance2)));
    weight = 4.0f / radius2;
  }
  sample.weight = power_ * (weight * factor(sample.wi, distance2));
  return sample;
}

LightShape::Sample LightShape::towardsPanel(const Vec3& p, const Vec3& x, double perDensity, bool byArea) const {
  const Vec3 to = x - p;
  const float distance2 = glm::dot(to, to);
  if (!(distance2 > 0.0f)) return {};
  Sample sample{to / std::sqrt(distance2), Vec3(0.0f), x};
  const float cosine = -glm::dot(sample.wi, light_.direction);
  if (!(cosine > 0.0f)) return {};
  sample.weight = power_ * (static_cast<float>(perDensity) * (byArea ? cosine / distance2 : 1.0f));
  // The shadow ray ends before what the panel may lie on.
  const float size = std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z), boundRadius_});
  sample.target += light_.direction * (4e-6f * size + 1e-4f * boundRadius_);
  return sample;
}

LightShape::Sample LightShape::sampleRectangle(const Vec3& p, const Vec2& u, const Vec2& size) const {
  const Vec3d toCentre = Vec3d(light_.position) - Vec3d(p);
  const double height = -glm::dot(toCentre, Vec3d(light_.direction));
  if (!(height > kLeastHeight * static_cast<double>(boundRadius_))) return {};
  const double distance2 = glm::dot(toCentre, toCentre);
  const double area = static_cast<double>(size.x) * static_cast<double>(size.y);
  const Vec3d corner = Vec3d(light_.position) - 0.5 * static_cast<double>(size.x) * Vec3d(light_.right) -
                       0.5 * static_cast<double>(size.y) * Vec3d(light_.up);
  const double far2 = static_cast<double>(boundRadius_) * static_cast<double>(boundRadius_);
  if (distance2 > 4.0 * far2 && area * height < kFewSteradians * distance2 * std::sqrt(distance2)) {
    const Vec3 x = Vec3(corner) + u.x * size.x * light_.right + u.y * size.y * light_.up;
    return towardsPanel(p, x, area, true);
  }
  const SphericalRectangle seen(Vec3d(p), corner, Vec3d(light_.right), Vec3d(light_.up), Vec2d(size));
  if (!(seen.solidAngle() > 0.0)) return {};
  return towardsPanel(p, Vec3(seen.sample(Vec2d(u))), seen.solidAngle(), false);
}

LightShape::Sample LightShape::sampleDisc(const Vec3& p, const Vec2& u) const {
  const Vec3 toCentre = light_.position - p;
  const float height = -glm::dot(toCentre, light_.direction);
  if (!(height > static_cast<float>(kLeastHeight) * light_.radius)) return {};
  const float aside = std::sqrt(std::max(0.0f, glm::dot(toCentre, toCentre) - height * height));
  const float beyond = std::max(0.0f, aside - light_.radius);
  if (height * height + beyond * beyond > light_.radius * light_.radius) {
    const float r = light_.radius * std::sqrt(u.x);
    const Vec2 around = onUnitCircle(u.y);
    const Vec3 x = light_.position + r * around.x * light_.right + r * around.y * light_.up;
    return towardsPanel(p, x, static_cast<double>(kPi * light_.radius * light_.radius), true);
  }
  Sample sample = sampleRectangle(p, u, Vec2(2.0f * light_.radius));
  const Vec3 fromCentre = sample.target - light_.position;
  const float x = glm::dot(fromCentre, light_.right), y = glm::dot(fromCentre, light_.up);
  return x * x + y * y <= light_.radius * light_.radius ? sample : Sample{};
}

float LightShape::importance(const Vec3& p, const Vec3& n) const {
  const bool anySide = n == Vec3(0.0f);
  if (light_.type == LightType::Directional) {
    const float sine = std::sin(light_.halfAngle), cosine = std::cos(light_.halfAngle);
    const float cosTheta = -glm::dot(light_.direction, n);
    if (!anySide && !(cosTheta > -sine)) return 0.0f;
    return onAxis_ * (anySide ? 1.0f : 1.0f + 2.0f * std::max(0.0f, cosLessened(cosTheta, cosine, sine)));
  }
  const Vec3 toCentre = light_.position - p;
  const float distance2 = glm::dot(toCentre, toCentre), radius2 = boundRadius_ * boundRadius_;
  if (isPanel(light_.type) && !(-glm::dot(toCentre, light_.direction) > 0.0f)) return 0.0f;
  const float share = distance2 * perRange2_;
  const float window = std::clamp(1.0f - share * share, 0.0f, 1.0f);
  if (!(distance2 > radius2)) return radius2 > 0.0f ? 3.0f * onAxis_ * window / radius2 : 0.0f;
  const Vec3 wi = toCentre / std::sqrt(distance2);
  // A little wider than the sphere about it looks, for rounding.
  const float sine = std::min(1.0f, std::sqrt(radius2 / distance2) + 1e-4f);
  const float cosine = std::sqrt(std::max(0.0f, 1.0f - sine * sine));
  const float bySide = anySide ? 1.0f : cosLessened(glm::dot(wi, n), cosine, sine);
  if (!(bySide > 0.0f)) return 0.0f;
  float emitted = window;
  const float forward = cosLessened(-glm::dot(light_.direction, wi), cosine, sine);
  if (isPanel(light_.type)) emitted *= std::max(forward, 0.0f);
  if (light_.type == LightType::Spot) {
    const float cone = std::clamp((forward - cosOuter_) * perCone_, 0.0f, 1.0f);
    emitted *= cone * cone;
  }
  if (light_.profile && radius2 == 0.0f)
    emitted *=
        light_.profile->share(-glm::dot(light_.right, wi), -glm::dot(light_.up, wi), -glm::dot(light_.direction, wi));
  return onAxis_ * emitted / distance2 * (1.0f + 2.0f * bySide);
}

LightBounds LightShape::bounds() const {
  Vec3 half(boundRadius_);
  if (light_.type == LightType::Rectangle)
    half = 0.5f * (glm::abs(light_.right) * light_.size.x + glm::abs(light_.up) * light_.size.y);
  if (light_.type == LightType::Disc)
    half = light_.radius * glm::sqrt(glm::max(1.0f - light_.direction * light_.direction, Vec3(0.0f)));
  LightBounds bounds{.min = light_.position - half, .max = light_.position + half, .cosSpread = -1.0f, .cosEmit = 0.0f};
  bounds.power = onAxis_;
  if (light_.range > 0.0f) bounds.reach = light_.range;
  if (isRound(light_.type) && light_.type != LightType::Spot) return bounds;
  bounds.axis = light_.direction;
  bounds.cosSpread = light_.type == LightType::Spot ? std::cos(light_.outerConeAngle) : 1.0f;
  bounds.cosEmit = light_.type == LightType::Spot ? std::cos(kConeSlack) : 0.0f;
  return bounds;
}

}  // namespace lumel
