#include "baker/audit/audited_texels.h"

#include <algorithm>
#include <cmath>

#include "baker/path/texel_sums.h"
#include "baker/rays/flush_denormals.h"
#include "baker/rays/sampling.h"
#include "scene/base/parallel.h"
#include "scene/base/sobol.h"

namespace lumel {
namespace {

/// Rays of which every one must meet a back for their point to be inside: beneath a cover that hides nine tenths of the
/// sky one point in a thousand is taken to be.
constexpr int kInsideRays = 64;

std::size_t pixelOf(const Image& image, TexelCoord at) {
  return (static_cast<std::size_t>(at.y) * static_cast<std::size_t>(image.width) + at.x) *
         static_cast<std::size_t>(image.channels);
}

}  // namespace

AuditTracer::AuditTracer(const LightTransport& transport, const Atlas& atlas, const std::vector<PageTexels>& texels,
                         std::span<const Image* const> flat, std::span<const Image* const> aux,
                         const AuditPopulation& population, const AuditOptions& options)
    : transport_(transport),
      atlas_(atlas),
      texels_(texels),
      flat_(flat),
      aux_(aux),
      population_(population),
      options_(options) {}

void AuditTracer::trace(std::span<AuditDraw> draws) {
  // Texels of a page that lie near each other share a wave, so that their rays find the same things.
  std::vector<AuditDraw*> order;
  for (AuditDraw& draw : draws) order.push_back(&draw);
  std::ranges::stable_sort(order, {}, [](const AuditDraw* draw) { return draw->texel; });
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < order.size();) {
    starts.push_back(i);
    const std::uint32_t page = population_.pageOf(order[i]->texel);
    std::size_t end = i + 1;
    while (end < order.size() && end - i < kLanes && population_.pageOf(order[end]->texel) == page) ++end;
    i = end;
  }
  starts.push_back(order.size());
  std::vector<Counts> counts(starts.size() - 1);
  parallelFor(counts.size(), 1, [&](std::size_t first, std::size_t last) {
    const FlushDenormals flush;
    for (std::size_t w = first; w < last; ++w)
      traceWave(std::span(order).subspan(starts[w], starts[w + 1] - starts[w]), counts[w]);
  });
  for (const Counts& c : counts) rays_ += c.rays;
}

void AuditTracer::traceWave(std::span<AuditDraw* const> wave, Counts& counts) const {
  const std::uint32_t pageIndex = population_.pageOf(wave.front()->texel);
  const PageTexels& page = texels_[pageIndex];
  std::array<std::uint32_t, kLanes> texels{};
  std::array<std::uint32_t, kLanes> seeds{};
  for (std::size_t i = 0; i < wave.size(); ++i) {
    texels[i] = static_cast<std::uint32_t>(population_.indexOnPage(wave[i]->texel));
    seeds[i] = wave[i]->seed;
  }
  const PathIntegrator integrator(transport_, *encoding_, atlas_,
                                  {.samples = kPathsPerDraw,
                                   .bounces = options_.bounces,
                                   .indirectOnly = options_.indirectOnly,
                                   .seed = options_.seed});
  const WaveResult traced = integrator.traceTexels(pageIndex, page, std::span(texels).first(wave.size()),
                                                   std::span(seeds).first(wave.size()));
  counts.rays += traced.rays + traced.shadowRays;
  for (std::size_t i = 0; i < wave.size(); ++i) {
    AuditDraw& draw = *wave[i];
    const TexelCoord at = page.coords[texels[i]];
    const float* rgb = flat_[pageIndex]->pixels.data() + pixelOf(*flat_[pageIndex], at);
    const float validity = aux_[pageIndex]->pixels[pixelOf(*aux_[pageIndex], at) + 1];
    TexelFootprint footprint;
    footprint.clip(atlas_, page, texels[i]);
    draw.position = footprint.centroid().position;
    draw.map = static_cast<double>(luminance(Vec3(rgb[0], rgb[1], rgb[2])));
    draw.paths = static_cast<double>(luminance(traced.texels[i].sums.mean().flat));
    if (validity < kLeastValidity || (validity < 1.0f && !liesInTheOpen(footprint, draw.seed, counts)))
      draw.weight = 0.0;
  }
}

bool AuditTracer::liesInTheOpen(const TexelFootprint& footprint, std::uint32_t seed, Counts& counts) const {
  for (std::uint32_t i = 0; i < kPathsPerDraw; ++i)
    if (isInside(footprint.sample(sobol2D(i, seed)), hashCombine(seed, i), counts)) return false;
  return true;
}

bool AuditTracer::isInside(const SurfacePoint& point, std::uint32_t seed, Counts& counts) const {
  const Surface& surface = atlas_.surfaces[point.triangle.surface];
  std::array<Vec3, 3> corners;
  for (std::size_t i = 0; i < 3; ++i)
    corners[i] = surface.positions[surface.indices[std::size_t{3} * point.triangle.triangle + i]];
  const Vec3 start =
      offsetPoint(point.position, point.geometricNormal, corners, transport_.rays.translationOf(surface.instance));
  const Frame frame = frameAround(point.geometricNormal);
  for (int first = 0; first < kInsideRays; first += kLanes) {
    RayPacket packet;
    for (int lane = 0; lane < kLanes; ++lane)
      packet.set(lane, start,
                 frame.fromLocal(sampleCosineHemisphere(sobol2D(static_cast<std::uint32_t>(first + lane), seed))));
    transport_.rays.intersect(packet, TraceMode::Packet);
    counts.rays += kLanes;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!packet.hit(lane)) return false;
      const HitSurface hit = transport_.rays.surfaceAt(packet, lane);
      if (!hit.backFace || transport_.materials.material(hit.material).doubleSided) return false;
    }
  }
  return true;
}

}  // namespace lumel
