#include "baker/light/near_lights.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumel {

NearLight::NearLight(std::size_t light, const Vec3& position, float reach, const TexelFootprint& footprint)
    : light_(light), position_(position), perReach2_(1.0 / (static_cast<double>(reach) * static_cast<double>(reach))) {
  for (std::size_t i = 0; i < footprint.pieces().size(); ++i) {
    const TexelFootprint::Piece& piece = footprint.pieces()[i];
    const std::array<Vec2, 3>& c = piece.barycentric;
    addTriangle(footprint, i, c, piece.isSquare ? 0.5 * piece.area : piece.area);
    if (piece.isSquare) addTriangle(footprint, i, {c[1] + c[2] - c[0], c[2], c[1]}, 0.5 * piece.area);
  }
}

/// Divides a triangle at the light's foot, so that no part fills nearly a hemisphere, where spherical triangles
/// degenerate. `texels` is its area on the page.
void NearLight::addTriangle(const TexelFootprint& footprint, std::size_t piece, const std::array<Vec2, 3>& barycentric,
                            double texels) {
  std::array<Vec3d, 3> corners;
  for (std::size_t i = 0; i < 3; ++i) corners[i] = Vec3d(footprint.at(piece, barycentric[i]).position) - position_;
  const Vec3d e1 = corners[1] - corners[0], e2 = corners[2] - corners[0];
  const Vec3d cross = glm::cross(e1, e2);
  const double doubleArea = glm::length(cross);
  if (!(doubleArea > 0.0)) return;
  Vec3d normal = cross / doubleArea;
  if (glm::dot(normal, Vec3d(footprint.at(piece, barycentric[0]).geometricNormal)) < 0.0) normal = -normal;
  const double height = -glm::dot(corners[0], normal);
  if (!(height > 0.0)) return;
  const Vec3d foot = -height * normal;
  const auto add = [&](const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    Fan fan{.seen = {glm::normalize(a), glm::normalize(b), glm::normalize(c)}};
    fan.solidAngle = fan.seen.solidAngle();
    if (!(fan.solidAngle > 0.0)) return;
    fan.before = total_;
    fan.weight = texels / (footprint.area() * 0.5 * doubleArea);
    fan.normal = normal;
    fan.height = height;
    fan.corner = corners[0];
    fan.e1 = e1;
    fan.e2 = e2;
    fan.barycentric = barycentric;
    fan.piece = piece;
    total_ += fan.weight * fan.solidAngle;
    fans_.push_back(fan);
  };
  bool inside = true;
  const double side = glm::dot(cross, normal) < 0.0 ? -1.0 : 1.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d& from = corners[i];
    const Vec3d& to = corners[(i + 1) % 3];
    inside = inside && side * glm::dot(glm::cross(to - from, foot - from), normal) > 0.0;
  }
  if (!inside) return add(corners[0], corners[1], corners[2]);
  for (std::size_t i = 0; i < 3; ++i) add(foot, corners[i], corners[(i + 1) % 3]);
}

NearLight::Sample NearLight::sample(Vec2 u) const {
  const double target = static_cast<double>(u.x) * total_;
  const auto next = std::upper_bound(fans_.begin() + 1, fans_.end(), target,
                                     [](double value, const Fan& fan) { return value < fan.before; });
  const Fan& fan = *(next - 1);
  const double part = fan.weight * fan.solidAngle;
  const auto rest = static_cast<float>(std::clamp((target - fan.before) / part, 0.0, 1.0));
  const Vec3d towards = fan.seen.sample({rest, u.y}, fan.solidAngle, fan.seen.volume());
  const double cosTheta = -glm::dot(towards, fan.normal);
  if (!(cosTheta > 0.0)) return {};
  const double distance = fan.height / cosTheta;
  const Vec3d fromCorner = distance * towards - fan.corner;
  const Vec3d cross = glm::cross(fan.e1, fan.e2);
  const double perCross2 = 1.0 / glm::dot(cross, cross);
  const double w1 = std::clamp(glm::dot(glm::cross(fromCorner, fan.e2), cross) * perCross2, 0.0, 1.0);
  const double w2 = std::clamp(glm::dot(glm::cross(fan.e1, fromCorner), cross) * perCross2, 0.0, 1.0 - w1);
  const std::array<Vec2, 3>& c = fan.barycentric;
  Sample sample{fan.piece, c[0] + static_cast<float>(w1) * (c[1] - c[0]) + static_cast<float>(w2) * (c[2] - c[0])};
  sample.perIntensity = static_cast<float>(total_ * std::max(0.0, 1.0 - distance * distance * perReach2_) / cosTheta);
  return sample;
}

namespace {

std::vector<std::size_t> lightsAround(const PunctualLights& lights, const Vec3& least, const Vec3& most, float& reach) {
  const float diameter = glm::length(most - least);
  reach = 2.0f * diameter;
  return lights.around(0.5f * (least + most), 0.5f * diameter + reach);
}

}  // namespace

bool isAnyLightNear(const PunctualLights& lights, const Vec3& least, const Vec3& most) {
  float reach = 0.0f;
  return !lightsAround(lights, least, most, reach).empty();
}

NearLights nearLightsOf(const PunctualLights& lights, const TexelFootprint& footprint) {
  NearLights near;
  if (lights.size() == lights.directional() || footprint.pieces().empty()) return near;
  Vec3 least(std::numeric_limits<float>::max()), most(std::numeric_limits<float>::lowest());
  for (std::size_t i = 0; i < footprint.pieces().size(); ++i) {
    const std::array<Vec2, 3>& c = footprint.pieces()[i].barycentric;
    for (const Vec2& corner : {c[0], c[1], c[2], footprint.pieces()[i].isSquare ? c[1] + c[2] - c[0] : c[0]}) {
      const Vec3 p = footprint.at(i, corner).position;
      least = glm::min(least, p);
      most = glm::max(most, p);
    }
  }
  float reach = 0.0f;
  const std::vector<std::size_t> around = lightsAround(lights, least, most, reach);
  if (around.empty() || !(reach > 0.0f)) return near;
  near.perReach2 = 1.0f / (reach * reach);
  for (const std::size_t light : around) {
    if (!lights.isSmall(light, reach)) continue;
    if (NearLight one(light, lights.source(light).position, reach, footprint); one.sees()) near.lights.push_back(one);
  }
  return near;
}

NearSample sampleNear(const LightTransport& transport, const Atlas& atlas, const TexelFootprint& footprint,
                      const NearLight& near, Vec2 u, Vec2 onLight) {
  const NearLight::Sample chosen = near.sample(u);
  NearSample sample;
  if (!(chosen.perIntensity > 0.0f)) return sample;
  const SurfacePoint point = footprint.at(chosen.piece, chosen.barycentric);
  const PunctualLights::Source& source = transport.punctual.source(near.light());
  sample.receiver = receiverAt(transport.rays, atlas, point);
  sample.frame = point.frame;
  Vec3 facing;
  transport.punctual.sampleAt(near.light(), point.position, onLight, sample.wi, sample.target, facing);
  const Vec3 toLight = source.position - point.position;
  const bool above = source.shape < 0 || glm::dot(toLight, sample.receiver.ng) > 0.0f;
  const bool sees = sample.receiver.isOpenTowards(sample.wi) && glm::dot(sample.wi, sample.receiver.ns) > 0.0f;
  if (above && sees) sample.light = facing * glm::dot(toLight, toLight) * chosen.perIntensity;
  return sample;
}

}  // namespace lumel
