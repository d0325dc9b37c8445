#include "baker/bake/shadow_masks.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>

#include "baker/gather/waves/waves.h"
#include "baker/light/direct_light.h"
#include "baker/light/lit_scene.h"
#include "baker/path/texel_sums.h"
#include "baker/rays/flush_denormals.h"
#include "baker/rays/texel_parts.h"
#include "lightmap/maps/dilate.h"
#include "scene/base/check.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// Keeps the patterns apart from those of the bake.
constexpr std::uint64_t kMaskSeed = 0x6d61736bull << 32;
constexpr std::uint32_t kMaskFootprint = 0x1000u;
constexpr std::uint32_t kPatternsPerLight = 16;

/// The lamp by itself, of unit brightness to all sides.
PunctualLights aloneOf(const Light& light) {
  Light alone = light;
  alone.color = Vec3(1.0f);
  alone.intensity = 1.0f;
  alone.range = 0.0f;
  alone.profile = nullptr;
  if (alone.type == LightType::Spot) alone.type = LightType::Point;
  return PunctualLights({alone});
}

/// What the texels of a wave see.
struct WaveMask {
  std::array<std::array<double, kLanes>, kMostShadowMasks> open{}, visible{};
};

/// The texels of a wave as receivers: one point of each at a time.
class MaskWave {
 public:
  MaskWave(const LightTransport& transport, const Atlas& atlas, const PageTexels& page, const Wave& wave,
           std::uint64_t seed)
      : transport_(transport), atlas_(atlas), parts_(transport.rays, transport.materials, atlas, page) {
    std::array<std::uint32_t, kLanes> texels;
    std::iota(texels.begin(), texels.end(), wave.first);
    for (std::size_t lane = 0; lane < wave.count; ++lane) {
      const TexelCoord at = page.coords[texels[lane]];
      covered_[lane] = footprints_[lane].clip(atlas, page, texels[lane]) > 0.0;
      samplers_[lane] = TexelSampler(seed ^ kMaskSeed, wave.page, at.x, at.y);
      samples_.setTexel(static_cast<int>(lane), samplers_[lane]);
    }
    forEachLane(parts_.suspects(std::span(texels).first(wave.count)),
                [&](std::size_t lane) { part_[lane] = parts_.find(texels[lane]); });
  }

  void addSample(std::uint32_t sample, const std::vector<LightTransport>& lamps, WaveMask& mask) {
    LaneFlags active{};
    Vec3Lanes p, ng, ns, rayStart, lift;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (!covered_[lane]) continue;
      const SurfacePoint point = footprints_[lane].sample(samplers_[lane].get2D(sample, kMaskFootprint));
      const SurfaceSpot spot{point.position, point.geometricNormal};
      // Of a divided texel the part that its light stands for.
      if (part_[lane] && parts_.members(*part_[lane], {&spot, 1}) == 0) continue;
      const Receiver receiver = receiverAt(transport_.rays, atlas_, point);
      active[lane] = 1;
      p.set(lane, receiver.p);
      ng.set(lane, receiver.ng);
      ns.set(lane, receiver.ns);
      rayStart.set(lane, receiver.rayStart);
      lift.set(lane, receiver.lift);
    }
    samples_.setSampleOfAll(sample);
    const ReceiverLanes receivers{active, p, ng, ns, rayStart, false, nullptr, &lift};
    SampledLight sampled;
    for (std::size_t k = 0; k < lamps.size(); ++k) {
      const auto pattern = static_cast<std::uint32_t>(k) * kPatternsPerLight;
      if (takeLight(lamps[k], {LightStrategy::OnePunctual}, receivers, samples_, pattern, kGatherDensity, sampled) == 0)
        continue;
      std::array<float, kLanes> weight{};
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        if (sampled.shadows.valid[lane] != 0) weight[lane] = glm::dot(sampled.wi[lane], ns[lane]);
      const std::array<float, kLanes> open = times(weight, sampled.light);
      sampled.trace(transport_.rays, TraceMode::Packet);
      const std::array<float, kLanes> left = times(weight, sampled.light);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        mask.open[k][lane] += static_cast<double>(open[lane]);
        if (weight[lane] > 0.0f && sampled.found(lane)) mask.visible[k][lane] += static_cast<double>(left[lane]);
      }
    }
  }

 private:
  static std::array<float, kLanes> times(const std::array<float, kLanes>& weight, const Vec3Lanes& light) {
    std::array<float, kLanes> product{};
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (weight[lane] > 0.0f) product[lane] = weight[lane] * luminance(light[lane]);
    return product;
  }

  const LightTransport& transport_;
  const Atlas& atlas_;
  TexelParts parts_;
  std::array<TexelFootprint, kLanes> footprints_;
  std::array<std::optional<TexelPart>, kLanes> part_;
  std::array<bool, kLanes> covered_{};
  std::array<TexelSampler, kLanes> samplers_;
  SampleLanes samples_;
};

/// Gives texels inside of things the values of valid ones, and grows the maps.
void finishMask(Image& mask, const Image& aux, const Atlas& atlas, const PageTexels& texels, int rings) {
  const std::size_t count = aux.pixels.size() / 4;
  TexelMask valid{aux.width, aux.height, std::vector<std::uint8_t>(count, 0)};
  TexelMask covered = valid;
  std::vector<std::uint8_t> holes(count, 0);
  std::vector<std::uint32_t> chartIds(count, 0);
  for (std::size_t texel = 0; texel < texels.size(); ++texel) {
    const TexelCoord at = texels.coords[texel];
    const float* pixel = aux.at(at.x, at.y);
    if (!(pixel[0] > 0.0f)) continue;
    const std::size_t i = static_cast<std::size_t>(at.y) * static_cast<std::size_t>(aux.width) + at.x;
    covered.known[i] = 1;
    (pixel[1] < kLeastValidity ? holes[i] : valid.known[i]) = 1;
    const TriangleRef triangle = texels.trianglesOf(texel).front();
    chartIds[i] = atlas.surfaces[triangle.surface].charts[triangle.triangle] + 1;
  }
  fillHoles(mask, valid, chartIds, holes);
  if (rings > 0) dilate(mask, covered, rings);
}

}  // namespace

std::vector<std::size_t> lightsWithMask(const std::vector<Light>& lights) {
  std::vector<std::size_t> marked;
  for (std::size_t i = 0; i < lights.size(); ++i)
    if (lights[i].hasShadowMask) marked.push_back(i);
  return marked;
}

Expected<std::vector<Image>> bakeShadowMasks(const LitScene& scene, const std::vector<Light>& lights,
                                             const Atlas& atlas, const std::vector<PageTexels>& texels,
                                             const std::vector<BakedPage>& pages, const ShadowMaskOptions& options,
                                             Progress& progress) {
  const std::vector<std::size_t> marked = lightsWithMask(lights);
  LUMEL_CHECK(marked.size() <= kMostShadowMasks);
  const LightTransport& transport = scene.transport();
  std::vector<PunctualLights> alone;
  for (const std::size_t light : marked) alone.push_back(aloneOf(lights[light]));
  std::vector<LightTransport> lamps;
  for (const PunctualLights& light : alone) lamps.push_back(transport.with(light));
  std::vector<Image> masks;
  for (const BakedPage& page : pages) masks.emplace_back(page.aux.width, page.aux.height, 4);
  const Waves waves(texels);
  progress.begin("shadow masks", waves.texels());
  parallelFor(waves.size(), 1, [&](std::size_t first, std::size_t last) {
    const FlushDenormals flush;
    for (std::size_t w = first; w < last && !progress.cancelled(); ++w) {
      const PageTexels& page = texels[waves[w].page];
      MaskWave wave(transport, atlas, page, waves[w], options.seed);
      WaveMask mask;
      for (int s = 0; s < options.samples; ++s) wave.addSample(static_cast<std::uint32_t>(s), lamps, mask);
      for (std::size_t lane = 0; lane < waves[w].count; ++lane) {
        const TexelCoord at = page.coords[waves[w].first + lane];
        float* pixel = masks[waves[w].page].at(at.x, at.y);
        for (std::size_t k = 0; k < lamps.size(); ++k)
          if (mask.open[k][lane] > 0.0)
            pixel[k] = static_cast<float>(std::min(1.0, mask.visible[k][lane] / mask.open[k][lane]));
      }
      progress.advance(waves[w].count);
    }
  });
  progress.end();
  if (progress.cancelled()) return interrupted();
  for (std::size_t p = 0; p < pages.size(); ++p) finishMask(masks[p], pages[p].aux, atlas, texels[p], options.rings);
  return masks;
}

}  // namespace lumel
