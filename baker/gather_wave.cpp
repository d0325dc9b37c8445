#include "baker/gather_wave.h"

#include <algorithm>
#include <cmath>

namespace lumel {
namespace {

/// Sample patterns of a texel; those of light samples come first.
constexpr std::uint32_t kFootprint = kLightPatterns;
constexpr std::uint32_t kDirection = kLightPatterns + 1;
constexpr std::uint32_t kWarmDirection = kLightPatterns + 2;
constexpr std::uint32_t kHits = kLightPatterns + 3;
constexpr std::uint32_t kWarmHits = kLightPatterns + 4;

/// Collects the start of the cache.
struct WarmSink {
  std::array<WarmTexel, kLanes>& texels;
  std::span<CacheLink> links;

  void light(const Flight& flight, const Vec3& radiance, int depth) {
    WarmTexel& texel = texels[flight.lane];
    const Vec3 light = flight.beta * radiance;
    if (!isFinite(light)) return;
    (depth == 0 ? texel.seen : texel.relit) += light;
  }
  void texel(const Flight& flight, std::uint32_t texel) {
    links[flight.lane * GatherWave::kWarmRays + flight.sample] = {texel, packWeight(flight.beta)};
  }
  void backFace(const Flight& flight) { ++texels[flight.lane].backFaces; }
};

/// Adds light to the maps and to the levels of the cache.
struct GatherSink {
  const GatherScene& scene;
  std::span<const Vec3> cache;
  GatheredWave& result;
  std::uint32_t page;
  std::span<const TexelCoord> coords;
  std::array<bool, kLanes> probed{};

  bool accept(std::uint32_t lane, std::uint32_t sample, const Vec3& light) {
    if (isFinite(light)) return true;
    result.nonFinite.push_back({page, coords[lane], sample});
    return false;
  }
  void addToMaps(std::uint32_t lane, const Vec3& dirTangent, const Vec3& light) {
    GatheredTexel& texel = result.texels[lane];
    const Vec3 kernels = scene.kernels(dirTangent);
    texel.flat += Vec3d(light * std::max(0.0f, dirTangent.z));
    for (int i = 0; i < 3; ++i) texel.rnm[static_cast<std::size_t>(i)] += Vec3d(light * kernels[i]);
    if (probed[lane])
      for (std::size_t i = 0; i < kProbeNormals; ++i)
        texel.probes[i] += Vec3d(light * std::max(0.0f, glm::dot(dirTangent, probeNormals()[i])));
  }
  /// Light of `depth` bounces, for the maps and for every level that holds so many.
  void add(std::uint32_t lane, std::uint32_t sample, const Vec3& dirTangent, const Vec3& light, int depth) {
    if (!accept(lane, sample, light)) return;
    addToMaps(lane, dirTangent, light);
    if (scene.levels.endless) return;
    const Vec3d flat(light * std::max(0.0f, dirTangent.z));
    for (int level = std::max(0, depth - scene.levels.base); level < scene.levels.count; ++level)
      result.texels[lane].levels[static_cast<std::size_t>(level)] += flat;
  }
  void light(const Flight& flight, const Vec3& radiance, int depth) {
    add(flight.lane, flight.sample, flight.dirTangent, flight.beta * radiance, depth);
  }
  void texel(const Flight& flight, std::uint32_t texel) {
    const CacheLevels& levels = scene.levels;
    const Vec3* reflected = cache.data() + std::size_t{texel} * static_cast<std::size_t>(levels.count);
    if (const int level = levels.read(scene.bounces, flight.depth); level >= 0) {
      const Vec3 light = flight.beta * reflected[level];
      if (!accept(flight.lane, flight.sample, light)) return;
      addToMaps(flight.lane, flight.dirTangent, light);
    }
    if (levels.endless) return;
    const Vec3 weight = flight.beta * std::max(0.0f, flight.dirTangent.z);
    for (int level = 0; level < levels.count; ++level)
      if (const int source = levels.read(levels.base + level, flight.depth); source >= 0)
        result.texels[flight.lane].levels[static_cast<std::size_t>(level)] += Vec3d(weight * reflected[source]);
  }
  void backFace(const Flight& flight) { ++result.texels[flight.lane].backFaces; }
};

}  // namespace

std::uint32_t packWeight(const Vec3& weight) {
  std::uint32_t packed = 0;
  for (int i = 0; i < 3; ++i)
    packed |= static_cast<std::uint32_t>(std::lround(std::clamp(weight[i], 0.0f, 1.0f) * 1023.0f)) << (10 * i);
  return packed;
}

Vec3 unpackWeight(std::uint32_t packed) {
  return Vec3(packed & 1023u, (packed >> 10) & 1023u, (packed >> 20) & 1023u) / 1023.0f;
}

GatherWave::GatherWave(const GatherScene& scene, std::uint32_t page, std::size_t first, std::size_t count)
    : scene_(scene), page_(page), first_(first), count_(count) {
  const PageTexels& texels = scene.texels[page];
  for (std::size_t lane = 0; lane < count; ++lane) {
    const TexelCoord at = texels.coords[first + lane];
    areas_[lane] = footprints_[lane].clip(scene.atlas, texels, first + lane);
    samplers_[lane] = TexelSampler(scene.seed, page, at.x, at.y);
    keys_[lane] = samplers_[lane].seed();
  }
}

void GatherWave::drawPoints(std::uint32_t first, std::uint32_t count) {
  pointMask_ = count - 1;
  for (std::size_t lane = 0; lane < count_; ++lane) {
    if (!(areas_[lane] > 0)) continue;
    for (std::uint32_t i = 0; i < count; ++i) {
      const SurfacePoint point = footprints_[lane].sample(samplers_[lane].get2D(first + i, kFootprint));
      const Surface& surface = scene_.atlas.surfaces[point.triangle.surface];
      const std::uint32_t* corner = surface.indices.data() + std::size_t{3} * point.triangle.triangle;
      const std::array<Vec3, 3> corners = {surface.positions[corner[0]], surface.positions[corner[1]],
                                           surface.positions[corner[2]]};
      const Vec3 rayStart = offsetPoint(point.position, point.geometricNormal, corners,
                                        scene_.transport.rays.translationOf(surface.instance));
      points_[lane][i] = {{point.position, point.geometricNormal, point.frame.n, rayStart}, point.frame};
      surfacePoints_[lane][i] = point;
    }
  }
}

Vec3 GatherWave::reflectanceOf(const SurfacePoint& point, float& opacity) const {
  const Surface& surface = scene_.atlas.surfaces[point.triangle.surface];
  const Primitive* primitive = scene_.transport.rays.primitiveOf(surface.instance, surface.primitive);
  // The source triangle may be wound the other way round.
  const std::uint32_t source = surface.sourceTriangle[point.triangle.triangle];
  TrianglePoint at{primitive, source, Vec2(0.0f)};
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t vertex =
        surface.indices[std::size_t{3} * point.triangle.triangle + static_cast<std::size_t>(k)];
    for (int i = 1; i < 3; ++i)
      if (primitive->indices[std::size_t{3} * source + static_cast<std::size_t>(i)] == surface.sourceVertex[vertex])
        at.barycentric[i - 1] = point.barycentric[k];
  }
  opacity = scene_.transport.materials.opacity(at);
  return scene_.transport.materials.albedo(at);
}

std::array<WarmTexel, kLanes> GatherWave::warmUp(std::span<CacheLink> links, GatheredWave& counts) {
  std::array<WarmTexel, kLanes> texels;
  drawPoints(0, kWarmLights);
  LightLanes lanes;
  SampleLanes samples;
  for (std::size_t lane = 0; lane < count_; ++lane) {
    lanes.active[lane] = areas_[lane] > 0;
    samples.setTexel(static_cast<int>(lane), samplers_[lane]);
    if (!lanes.active[lane]) continue;
    Vec3 sum(0.0f);
    float opacities = 0.0f;
    for (std::uint32_t i = 0; i < kWarmLights; ++i) {
      float opacity = 0.0f;
      const Vec3 albedo = reflectanceOf(surfacePoints_[lane][i], opacity);
      sum += albedo * opacity;
      opacities += opacity;
    }
    if (opacities > 0.0f) texels[lane].reflectance = sum / opacities;
  }
  for (std::uint32_t s = 0; s < kWarmLights; ++s) {
    for (std::size_t lane = 0; lane < count_; ++lane)
      if (lanes.active[lane]) lanes.receivers[lane] = pointOf(lane, s).receiver;
    samples.setSampleOfAll(s);
    counts.shadowRays += directLight(
        scene_.transport, lanes, samples, 0, scene_.gatherMode,
        [](float cosTheta) { return gatherHemispherePdf(cosTheta); },
        [&](int lane, const Vec3& wi, const Vec3& light) {
          const auto l = static_cast<std::size_t>(lane);
          const Vec3 flat = light * (glm::dot(wi, lanes.receivers[l].ns) * kInvPi);
          if (isFinite(flat)) texels[l].direct += flat / static_cast<float>(kWarmLights);
        });
  }
  WarmSink sink{texels, links};
  GatherTracer tracer(scene_.transport, scene_.map, scene_.lastDepth, sink);
  for (std::uint32_t s = 0; s < kWarmRays; ++s) {
    tracer.clear();
    for (std::size_t lane = 0; lane < count_; ++lane) {
      if (!lanes.active[lane]) continue;
      const Point& point = pointOf(lane, s);
      // By the cosine every ray counts alike, so that no texel passes on more than it receives.
      const Vec3 local = sampleCosineHemisphere(samplers_[lane].get2D(s, kWarmDirection));
      const Vec3 dirWorld = point.frame.fromLocal(local);
      if (!(glm::dot(dirWorld, point.receiver.ng) > 0.0f)) continue;
      tracer.set(static_cast<int>(lane),
                 {.lane = static_cast<std::uint32_t>(lane),
                  .sample = s,
                  .key = hashCombine(keys_[lane], kWarmHits),
                  .dirTangent = local,
                  .beta = Vec3(1.0f),
                  .origin = point.receiver.p,
                  .pdf = gatherHemispherePdf(local.z)},
                 point.receiver.rayStart, dirWorld);
    }
    tracer.trace(TraceMode::Packet);
  }
  tracer.finish();
  counts.rays += tracer.rays();
  counts.shadowRays += tracer.shadowRays();
  for (WarmTexel& texel : texels) {
    texel.seen /= static_cast<float>(kWarmRays);
    texel.relit /= static_cast<float>(kWarmRays);
  }
  return texels;
}

GatheredWave GatherWave::gather(std::uint32_t first, std::uint32_t end, std::span<const Vec3> cache) {
  GatheredWave result;
  for (std::uint32_t sample = first; sample < end;) {
    const NetRange net = netAt(sample, end);
    gatherNet(net, cache, result);
    sample += net.count();
  }
  return result;
}

void GatherWave::gatherNet(const NetRange& net, std::span<const Vec3> cache, GatheredWave& result) {
  drawPoints(net.first, std::min(kMostPoints, net.count()));
  const PageTexels& page = scene_.texels[page_];
  GatherSink sink{scene_, cache, result, page_, std::span(page.coords).subspan(first_, count_)};
  LightLanes lanes;
  SampleLanes samples;
  std::array<NetByCell, kLanes> nets;
  for (std::size_t lane = 0; lane < count_; ++lane) {
    sink.probed[lane] = (first_ + lane) % PathIntegrator::kProbeStride == 0;
    lanes.active[lane] = areas_[lane] > 0;
    samples.setTexel(static_cast<int>(lane), samplers_[lane]);
    if (lanes.active[lane]) nets[lane].fill(samplers_[lane], net, kDirection);
  }

  for (std::uint32_t s = net.first; s < net.first + net.count(); ++s) {
    for (std::size_t lane = 0; lane < count_; ++lane)
      if (lanes.active[lane]) lanes.receivers[lane] = pointOf(lane, s).receiver;
    samples.setSampleOfAll(s);
    result.shadowRays += directLight(
        scene_.transport, lanes, samples, 0, scene_.gatherMode,
        [](float cosTheta) { return gatherHemispherePdf(cosTheta); },
        [&](int lane, const Vec3& wi, const Vec3& light) {
          const auto l = static_cast<std::uint32_t>(lane);
          sink.add(l, s, pointOf(l, s).frame.toLocal(wi), light * kInvPi, 0);
        });
  }

  GatherTracer tracer(scene_.transport, scene_.map, scene_.lastDepth, sink);
  for (std::uint32_t cell = 0; cell < net.count(); ++cell) {
    tracer.clear();
    for (std::size_t lane = 0; lane < count_; ++lane) {
      if (!lanes.active[lane]) continue;
      const std::uint32_t sample = nets[lane].samples[cell];
      const Point& point = pointOf(lane, sample);
      const Vec3 local = sampleGatherHemisphere(nets[lane].points[cell]);
      const Vec3 dirWorld = point.frame.fromLocal(local);
      // A bent shading normal gathers from below the surface too, where nothing arrives.
      if (!(glm::dot(dirWorld, point.receiver.ng) > 0.0f)) continue;
      const float pdf = gatherHemispherePdf(local.z);
      tracer.set(static_cast<int>(lane),
                 {.lane = static_cast<std::uint32_t>(lane),
                  .sample = sample,
                  .key = hashCombine(keys_[lane], kHits),
                  .dirTangent = local,
                  .beta = Vec3(kInvPi / pdf),
                  .origin = point.receiver.p,
                  .pdf = pdf},
                 point.receiver.rayStart, dirWorld);
    }
    tracer.trace(scene_.gatherMode);
  }
  tracer.finish();
  result.rays += tracer.rays();
  result.shadowRays += tracer.shadowRays();
}

}  // namespace lumel
