#include "baker/gather/space_points.h"

#include <algorithm>

#include "baker/gather/waves/gather_tracer.h"
#include "baker/gather/waves/light_effort.h"
#include "baker/gather/waves/wave_texels.h"
#include "baker/light/direct_light.h"
#include "baker/rays/flush_denormals.h"
#include "baker/rays/sampling.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

constexpr float kSphere = 4.0f * kPi;
/// Takes the place of a page in sampler seeds, so that points have patterns of their own.
constexpr std::uint32_t kSpacePage = 0xffffffffu;

/// Sums what rays and light samples of a wave of points find.
struct SpaceSink {
  const SurfaceCache& surfaces;
  bool indirectOnly = false;
  std::array<std::array<Vec3d, kHarmonics>, kLanes> sums{};
  std::array<std::array<Vec3d, kCubeFaces>, kLanes> cubes{};
  std::array<std::uint32_t, kLanes> backs{};

  void add(std::size_t lane, const Vec3& direction, const Vec3& light) {
    if (!isFinite(light)) return;
    const std::array<float, kHarmonics> y = harmonics(direction);
    for (std::size_t k = 0; k < y.size(); ++k) sums[lane][k] += Vec3d(light * y[k]);
    const std::array<float, kCubeFaces> faces = cubeKernels(direction);
    for (std::size_t k = 0; k < faces.size(); ++k) cubes[lane][k] += Vec3d(light * faces[k]);
  }
  // What GatherTracer asks of a sink; Flight::dirTangent is in world space here.
  void light(const Flight& flight, const Vec3& radiance, int depth) {
    if (indirectOnly && depth == 0) return;
    add(flight.lane, flight.dirTangent, flight.beta * radiance);
  }
  void texel(const Flight& flight, std::uint32_t texel) {
    const int level = surfaces.levels.read(surfaces.bounces, flight.depth);
    if (level < 0) return;
    const std::size_t row = std::size_t{texel} * static_cast<std::size_t>(surfaces.levels.count);
    add(flight.lane, flight.dirTangent,
        flight.beta * unpackColor(surfaces.radiance[row + static_cast<std::size_t>(level)]));
  }
  void prefetch(std::uint32_t) const {}
  void backFace(const Flight& flight) { ++backs[flight.lane]; }
};

/// Up to kLanes points.
void gatherWave(const LightTransport& transport, const SurfaceCache& surfaces, std::span<const Vec3> points,
                std::uint32_t firstPoint, const SpaceOptions& options, std::span<SpaceLight> found) {
  SpaceSink sink{surfaces, options.indirectOnly};
  GatherTracer tracer(transport, surfaces.map, surfaces.reflectance, surfaces.lastDepth,
                      punctualChoice(transport.punctual, {}, {}), sink);
  LaneFlags active{};
  Vec3Lanes p, none;
  SampleLanes samples;
  std::array<TexelSampler, kLanes> samplers;
  for (std::size_t lane = 0; lane < points.size(); ++lane) {
    active[lane] = 1;
    p.set(lane, points[lane]);
    samplers[lane] = TexelSampler(options.seed, kSpacePage, firstPoint + static_cast<std::uint32_t>(lane), 0);
    samples.setTexel(static_cast<int>(lane), samplers[lane]);
  }
  const ReceiverLanes receivers{active, p, none, none, p, true};
  const LightTransport straight = transport.atTexels();
  RayPacket packet;
  TexelMap::Lookup lookup;
  const auto count = static_cast<std::uint32_t>(std::max(1, options.samples));
  for (std::uint32_t s = 0; s < count; ++s) {
    samples.setSampleOfAll(s);
    if (!options.indirectOnly)
      directLight(
          straight, receivers, samples, 0, TraceMode::Packet, kSphereDensity,
          [&](int lane, const Vec3& wi, const Vec3& light) { sink.add(static_cast<std::size_t>(lane), wi, light); });
    const UnitSquareLanes u = samples.draw2D(kDirection);
    packet.clear();
    for (std::size_t lane = 0; lane < points.size(); ++lane)
      packet.set(static_cast<int>(lane), points[lane], directionFromZ(1.0f - 2.0f * u.x[lane], u.y[lane]));
    transport.rays.intersect(packet, TraceMode::Packet);
    surfaces.map.findAll(packet, lookup);
    tracer.arriveAll(packet, lookup, [&](int lane) -> Flight {
      const auto l = static_cast<std::size_t>(lane);
      return {.lane = static_cast<std::uint32_t>(lane),
              .sample = s,
              .key = samplers[l].seedOf(kHits),
              .dirTangent = packet.direction(lane),
              .beta = Vec3(kSphere),
              .origin = points[l],
              .pdf = 1.0f / kSphere};
    });
    tracer.advance();
  }
  tracer.finish();
  for (std::size_t lane = 0; lane < points.size(); ++lane) {
    for (std::size_t k = 0; k < kHarmonics; ++k)
      found[lane].sh[k] = Vec3(sink.sums[lane][k] / static_cast<double>(count));
    for (std::size_t k = 0; k < kCubeFaces; ++k)
      found[lane].cube[k] = Vec3(sink.cubes[lane][k] / static_cast<double>(count));
    found[lane].backFaces = static_cast<float>(sink.backs[lane]) / static_cast<float>(count);
  }
}

}  // namespace

Expected<std::vector<SpaceLight>> gatherInSpace(const LightTransport& transport, const SurfaceCache& surfaces,
                                                std::span<const Vec3> points, const SpaceOptions& options,
                                                Progress& progress) {
  std::vector<SpaceLight> found(points.size());
  progress.begin("points", points.size());
  parallelFor(points.size(), kLanes, [&](std::size_t first, std::size_t last) {
    const FlushDenormals flush;
    if (progress.cancelled()) return;
    gatherWave(transport, surfaces, points.subspan(first, last - first), static_cast<std::uint32_t>(first), options,
               std::span(found).subspan(first, last - first));
    progress.advance(last - first);
  });
  progress.end();
  if (progress.cancelled()) return interrupted();
  return found;
}

}  // namespace lumel
