#include "baker/light/punctual_lights.h"

#include <algorithm>
#include <array>

#include "baker/rays/sampling.h"
#include "scene/base/check.h"

namespace lumel {
namespace {

/// A spot's cone counts as this many radians wider, for rounding.
constexpr float kConeSlack = 0.02f;

bool sends(const Light& light) {
  return light.intensity > 0.0f && std::max({light.color.x, light.color.y, light.color.z}) > 0.0f;
}

/// Bounds a light with a position.
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

/// Returns irradiance per power: one over the square of the distance, with the range's window and the cone; 0 at the
/// light itself.
[[gnu::always_inline]] inline float attenuation(const Vec3& p, const Vec3& position, const Vec3& direction,
                                                float perRange2, float cosOuter, float perCone, Vec3& wi) {
  const Vec3 toLight = position - p;
  const float distance2 = glm::dot(toLight, toLight);
  const bool apart = distance2 > 0.0f;
  const float perDistance = 1.0f / std::sqrt(pick(apart, distance2, 1.0f));
  wi = toLight * perDistance;
  const float share = distance2 * perRange2;
  const float window = within(1.0f - share * share, 0.0f, 1.0f);
  const float cone = within((-glm::dot(direction, wi) - cosOuter) * perCone, 0.0f, 1.0f);
  return pick(apart, window * (cone * cone) * (perDistance * perDistance), 0.0f);
}

[[gnu::always_inline]] inline Vec3 facingNearby(const PunctualLights::Source& light, const Vec3& p, Vec3& wi) {
  return light.power *
         attenuation(p, light.position, light.direction, light.perRange2, light.cosOuter, light.perCone, wi);
}

/// Returns what the choice among lights is in proportion to. A normal of zero leaves the side open.
[[gnu::always_inline]] inline float importanceOf(const Vec3& facing, const Vec3& wi, const Vec3& n) {
  const float cosTheta = glm::dot(wi, n);
  const bool anySide = (n.x == 0.0f) & (n.y == 0.0f) & (n.z == 0.0f);
  return pick((cosTheta > 0.0f) | anySide, luminance(facing) * (1.0f + 2.0f * cosTheta), 0.0f);
}

/// Samples one source with a position for all lanes.
LUMEL_FOR_EACH_CPU void sampleNearby(const PunctualLights::Source& light, const Vec3Lanes& p,
                                     LightSampleLanes& samples) {
  const PunctualLights::Source from = light;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    Vec3 wi;
    const Vec3 facing = facingNearby(from, p[lane], wi);
    samples.wi.x[lane] = wi.x;
    samples.wi.y[lane] = wi.y;
    samples.wi.z[lane] = wi.z;
    samples.weight.x[lane] = facing.x;
    samples.weight.y[lane] = facing.y;
    samples.weight.z[lane] = facing.z;
    samples.target.x[lane] = from.position.x;
    samples.target.y[lane] = from.position.y;
    samples.target.z[lane] = from.position.z;
    samples.pdf[lane] = 0.0f;
    samples.distant[lane] = 0;
  }
}

}  // namespace

PunctualLights::Source::Source(const Light& light)
    : distant(light.type == LightType::Directional),
      power(light.color * light.intensity),
      position(light.position),
      direction(light.direction) {
  if (light.range > 0.0f) perRange2 = 1.0f / (light.range * light.range);
  if (light.type != LightType::Spot) return;
  cosOuter = std::cos(light.outerConeAngle);
  perCone = 1.0f / std::max(0.001f, std::cos(light.innerConeAngle) - cosOuter);
}

Vec3 PunctualLights::Source::facing(const Vec3& p, Vec3& wi) const {
  if (!distant) return facingNearby(*this, p, wi);
  wi = -direction;
  return power;
}

Vec3 facingIrradiance(const Light& light, const Vec3& p, Vec3& wi) {
  return PunctualLights::Source(light).facing(p, wi);
}

PunctualLights::PunctualLights(const std::vector<Light>& lights, bool (*ofMode)(LightMode)) {
  std::vector<const Light*> kept;
  for (const bool directional : {true, false}) {
    for (const Light& light : lights) {
      if (!sends(light) || (light.type == LightType::Directional) != directional) continue;
      if (ofMode != nullptr && !ofMode(light.mode)) continue;
      kept.push_back(&light);
      lights_.emplace_back(light);
      if (!LightShape::isOne(light)) continue;
      lights_.back().shape = static_cast<int>(shapes_.size());
      shapes_.emplace_back(light);
    }
    if (directional) directional_ = lights_.size();
  }
  for (std::size_t i = directional_; i < lights_.size(); ++i) byX_.push_back(static_cast<std::uint32_t>(i));
  std::ranges::stable_sort(byX_, {}, [&](std::uint32_t light) { return lights_[light].position.x; });
  if (lights_.size() - directional_ <= kLocalLights) return;
  std::vector<LightBounds> bounds(lights_.size());  // those of directional lights stay without power
  for (std::size_t i = directional_; i < lights_.size(); ++i) {
    const int shape = lights_[i].shape;
    bounds[i] = shape < 0 ? boundsOf(*kept[i]) : shapes_[static_cast<std::size_t>(shape)].bounds();
  }
  tree_ = LightTree(bounds);
}

/// Leaves the bounded one of the two lights that a light within reach is taken as (NearLight).
static void boundNearLight(const ReceiverLanes& at, LightSampleLanes& samples) {
  if (at.perReach2 == nullptr) return;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (samples.distant[lane] || !(at.perReach2[lane] > 0.0f)) continue;
    const Vec3 toLight = samples.target[lane] - at.p[lane];
    samples.weight.set(lane, samples.weight[lane] * std::min(1.0f, glm::dot(toLight, toLight) * at.perReach2[lane]));
  }
}

void PunctualLights::sampleShape(const LightShape& shape, std::size_t lane, float probability, const ReceiverLanes& at,
                                 const UnitSquareLanes& points, LightSampleLanes& samples) const {
  const Vec3 p = at.p[lane];
  LightShape::Sample sample = shape.sample(p, points[static_cast<int>(lane)]);
  if (at.perReach2 != nullptr && at.perReach2[lane] > 0.0f && samples.distant[lane] == 0 &&
      shape.boundRadius() * shape.boundRadius() * at.perReach2[lane] < 1.0f) {
    const Vec3 toLight = shape.position() - p;
    if (glm::dot(toLight, at.ng[lane]) > 0.0f)
      sample.weight *= std::min(1.0f, glm::dot(toLight, toLight) * at.perReach2[lane]);
  }
  samples.wi.set(lane, sample.wi);
  samples.weight.set(lane, sample.weight / probability);
  samples.target.set(lane, sample.target);
}

void PunctualLights::sampleAt(std::size_t index, const Vec3& p, const Vec2& u, Vec3& wi, Vec3& target,
                              Vec3& facing) const {
  const Source& light = lights_[index];
  if (light.shape < 0) {
    facing = light.facing(p, wi);
    target = light.position;
    return;
  }
  const LightShape::Sample sample = shapes_[static_cast<std::size_t>(light.shape)].sample(p, u);
  wi = sample.wi;
  target = sample.target;
  facing = sample.weight;
}

void PunctualLights::sampleOne(std::size_t index, const ReceiverLanes& at, LightSampleLanes& samples,
                               const UnitSquareLanes* points) const {
  const Source& light = lights_[index];
  if (light.shape >= 0) {
    LUMEL_CHECK(points != nullptr);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      samples.pdf[lane] = 0.0f;
      samples.distant[lane] = light.distant ? 1 : 0;
      sampleShape(shapes_[static_cast<std::size_t>(light.shape)], lane, 1.0f, at, *points, samples);
    }
    return;
  }
  if (!light.distant) {
    sampleNearby(light, at.p, samples);
    return boundNearLight(at, samples);
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    samples.wi.set(lane, -light.direction);
    samples.weight.set(lane, light.power);
    samples.target.set(lane, light.position);
    samples.pdf[lane] = 0.0f;
    samples.distant[lane] = 1;
  }
}

float PunctualLights::importance(std::size_t light, const Vec3& p, const Vec3& n) const {
  if (const int shape = lights_[light].shape; shape >= 0)
    return shapes_[static_cast<std::size_t>(shape)].importance(p, n);
  Vec3 wi;
  const Vec3 facing = lights_[light].facing(p, wi);
  return importanceOf(facing, wi, n);
}

/// Holds what sampling needs of the chosen lights.
struct alignas(64) PunctualLights::Chosen {
  Vec3Lanes power, position, direction;
  float perRange2[kLanes];
  float cosOuter[kLanes];
  float perCone[kLanes];
  int distant[kLanes];
  int light[kLanes] = {};
  float probability[kLanes] = {};  // 0: nothing was chosen

  void set(std::size_t lane, const Source& source) {
    power.set(lane, source.power);
    position.set(lane, source.position);
    direction.set(lane, source.direction);
    perRange2[lane] = source.perRange2;
    cosOuter[lane] = source.cosOuter;
    perCone[lane] = source.perCone;
    distant[lane] = source.distant ? 1 : 0;
  }
};

/// Chooses among at most kLocalLights lights, lane by lane in vector code.
LUMEL_FOR_EACH_CPU void PunctualLights::chooseAmongFew(std::span<const Source> few, const ReceiverLanes& at,
                                                       const UnitLanes& u, Chosen& chosen) const {
  alignas(64) float each[kLocalLights][kLanes];
  alignas(64) float total[kLanes] = {};
  for (std::size_t k = 0; k < few.size(); ++k) {
    const Source light = few[k];
    if (light.shape >= 0) {
      const LightShape& shape = shapes_[static_cast<std::size_t>(light.shape)];
      for (std::size_t lane = 0; lane < kLanes; ++lane) each[k][lane] = shape.importance(at.p[lane], at.ns[lane]);
    } else if (light.distant) {
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        each[k][lane] = importanceOf(light.power, -light.direction, at.ns[lane]);
    } else {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        Vec3 wi;
        const Vec3 facing = facingNearby(light, at.p[lane], wi);
        each[k][lane] = importanceOf(facing, wi, at.ns[lane]);
      }
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) total[lane] += each[k][lane];
  }
  alignas(64) float before[kLanes] = {};
  alignas(64) float taken[kLanes] = {};
  for (std::size_t k = 0; k < few.size(); ++k) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      // The last one that is possible, until the target is passed.
      const bool takes = (each[k][lane] > 0.0f) & !((taken[lane] > 0.0f) & (u.u[lane] * total[lane] < before[lane]));
      before[lane] += each[k][lane];
      taken[lane] = pick(takes, each[k][lane], taken[lane]);
      chosen.light[lane] = takes ? static_cast<int>(k) : chosen.light[lane];
    }
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    chosen.probability[lane] = taken[lane] / pick(total[lane] > 0.0f, total[lane], 1.0f);
}

LUMEL_FOR_EACH_CPU void PunctualLights::sampleChosen(const Chosen& chosen, const Vec3Lanes& p,
                                                     LightSampleLanes& samples) {
#pragma GCC ivdep
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    Vec3 wi;
    const Vec3 power = chosen.power[lane], direction = chosen.direction[lane];
    const float nearby = attenuation(p[lane], chosen.position[lane], direction, chosen.perRange2[lane],
                                     chosen.cosOuter[lane], chosen.perCone[lane], wi);
    const bool distant = chosen.distant[lane] != 0;
    const bool any = chosen.probability[lane] > 0.0f;
    const float probability = pick(any, chosen.probability[lane], 1.0f);
    const float arriving = pick(any, pick(distant, 1.0f, nearby), 0.0f);
    samples.wi.x[lane] = pick(distant, -direction.x, wi.x);
    samples.wi.y[lane] = pick(distant, -direction.y, wi.y);
    samples.wi.z[lane] = pick(distant, -direction.z, wi.z);
    samples.weight.x[lane] = power.x * arriving / probability;
    samples.weight.y[lane] = power.y * arriving / probability;
    samples.weight.z[lane] = power.z * arriving / probability;
    samples.target.x[lane] = chosen.position.x[lane];
    samples.target.y[lane] = chosen.position.y[lane];
    samples.target.z[lane] = chosen.position.z[lane];
    samples.pdf[lane] = 0.0f;
    samples.distant[lane] = chosen.distant[lane];
  }
}

void PunctualLights::choose(std::size_t first, const ReceiverLanes& at, const UnitLanes& u,
                            const UnitSquareLanes* points, LightSampleLanes& samples) const {
  Chosen chosen;
  if (tree_.empty() && lights_.size() - first <= kLocalLights) {
    chooseAmongFew(std::span(lights_).subspan(first), at, u, chosen);
    for (int& light : chosen.light) light += static_cast<int>(first);
  } else {
    chooseWithTree(first, at, u, nullptr, chosen);
  }
  sampleChosen(chosen, at, points, samples);
}

void PunctualLights::sample(const ReceiverLanes& at, const UnitLanes& u, const LearntChoice& learnt,
                            LightSampleLanes& samples, LaneFlags& chosenGroup, const UnitSquareLanes* points) const {
  Chosen chosen;
  chooseWithTree(0, at, u, &learnt, chosen);
  const int last = static_cast<int>(groups()) - 1;
  for (std::size_t lane = 0; lane < kLanes; ++lane) chosenGroup[lane] = std::min(chosen.light[lane], last);
  sampleChosen(chosen, at, points, samples);
}

void PunctualLights::sampleChosen(Chosen& chosen, const ReceiverLanes& at, const UnitSquareLanes* points,
                                  LightSampleLanes& samples) const {
  static const Source none{Light{}};
  for (std::size_t lane = 0; lane < kLanes; ++lane)  // where nothing was chosen, the number may be of no light
    chosen.set(lane, chosen.probability[lane] > 0.0f ? lights_[static_cast<std::size_t>(chosen.light[lane])] : none);
  sampleChosen(chosen, at.p, samples);
  boundNearLight(at, samples);
  if (shapes_.empty()) return;
  LUMEL_CHECK(points != nullptr);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (!(chosen.probability[lane] > 0.0f)) continue;
    const int shape = lights_[static_cast<std::size_t>(chosen.light[lane])].shape;
    if (shape >= 0)
      sampleShape(shapes_[static_cast<std::size_t>(shape)], lane, chosen.probability[lane], at, *points, samples);
  }
}

std::vector<std::size_t> PunctualLights::around(const Vec3& p, float distance) const {
  std::vector<std::size_t> found;
  const auto xOf = [&](std::uint32_t light) { return lights_[light].position.x; };
  auto light = std::ranges::lower_bound(byX_, p.x - distance, {}, xOf);
  for (; light != byX_.end() && xOf(*light) <= p.x + distance; ++light) {
    const Vec3 to = lights_[*light].position - p;
    if (glm::dot(to, to) <= distance * distance) found.push_back(*light);
  }
  std::ranges::sort(found);
  return found;
}

/// Chooses among groups by what each would bring, and as LearntChoice says if it is given. Returns the group, or their
/// number where none brings anything. `u` becomes what is left of it within the group.
std::size_t PunctualLights::chooseGroup(std::span<const float> unshadowed, const LearntChoice* learnt, float& u,
                                        float& probability) const {
  float whole = 0.0f, total = 0.0f, asked = 0.0f, possible = 0.0f;
  for (std::size_t g = 0; g < unshadowed.size(); ++g) {
    whole += unshadowed[g];
    asked += unshadowed[g] * (learnt ? learnt->evenShare(g) : 0.0f);
    total += unshadowed[g] * (learnt ? learnt->factor(g) : 1.0f);
    possible += unshadowed[g] > 0.0f ? 1.0f : 0.0f;
  }
  const float even = total > 0.0f ? asked / whole : 1.0f;
  const float perTotal = total > 0.0f ? (1.0f - even) / total : 0.0f;
  const float each = possible > 0.0f ? even / possible : 0.0f;
  float before = 0.0f, here = 0.0f;
  std::size_t chosen = unshadowed.size();
  for (std::size_t g = 0; g < unshadowed.size() && !(chosen < unshadowed.size() && u < before + here); ++g) {
    if (!(unshadowed[g] > 0.0f)) continue;
    const float share = unshadowed[g] * (learnt ? learnt->factor(g) : 1.0f) * perTotal + each;
    if (!(share > 0.0f)) continue;
    chosen = g;
    before += here;
    here = share;
  }
  probability = here;
  if (here > 0.0f) u = std::clamp((u - before) / here, 0.0f, 0x1.fffffep-1f);
  return chosen;
}

/// Chooses among any number of lights: those that the tree does not hold are asked one by one, and the tree counts as
/// one more.
void PunctualLights::chooseWithTree(std::size_t first, const ReceiverLanes& at, const UnitLanes& u,
                                    const LearntChoice* learnt, Chosen& chosen) const {
  const std::size_t end = tree_.empty() ? lights_.size() : directional_;
  LaneFlags toTree = at.active;
  UnitLanes uTree = u;
  std::array<float, kLanes> treeShare;
  treeShare.fill(1.0f);
  std::vector<float> unshadowed(end - first + (tree_.empty() ? 0 : 1));
  for (std::size_t lane = 0; lane < kLanes && first < end; ++lane) {
    if (!at.active[lane]) continue;
    const Vec3 p = at.p[lane], n = at.ns[lane];
    for (std::size_t i = first; i < end; ++i) unshadowed[i - first] = importance(i, p, n);
    if (!tree_.empty()) unshadowed.back() = tree_.importance({p, n});
    float probability = 0.0f;
    const std::size_t group = chooseGroup(unshadowed, learnt, uTree.u[lane], probability);
    treeShare[lane] = probability;
    toTree[lane] = group == end - first && probability > 0.0f ? 1 : 0;
    if (group >= end - first) continue;
    chosen.light[lane] = static_cast<int>(first + group);
    chosen.probability[lane] = probability;
  }
  if (tree_.empty()) return;
  LightTree::Descent descent;
  tree_.descend(at.p, &at.ns, toTree, uTree.u, descent);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (!toTree[lane]) continue;
    const Vec3 p = at.p[lane], n = at.ns[lane];
    const LightTree::Choice choice =
        tree_.chooseInLeaf(descent, lane, [&](std::uint32_t light) { return importance(light, p, n); });
    chosen.light[lane] = static_cast<int>(choice.light);
    chosen.probability[lane] = choice.probability * treeShare[lane];
  }
}

}  // namespace lumel
