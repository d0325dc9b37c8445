#include "baker/bake/light_volumes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "baker/gather/space_points.h"
#include "baker/rays/flush_denormals.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// A point is inside of something where it sees more backs than this share of its directions (as Majercik et al. 2019
/// have it): what stands in the open sees fewer, past the rims of covers without an underside.
constexpr float kMostBacks = 0.25f;
/// Points move by less than this share of a cell, and keep this share of it away from surfaces.
constexpr float kMostMove = 0.45f;
constexpr float kLeastDistance = 0.1f;

/// What a point sees in sightDirection(0), (1), ...
struct Sights {
  std::array<float, kSights> distances{};  // infinite: nothing
  std::array<bool, kSights> isBack{};

  float backs() const { return static_cast<float>(std::ranges::count(isBack, true)) / kSights; }
};

Sights look(const LightTransport& transport, const Vec3& p) {
  Sights sights;
  RayPacket packet;
  for (std::size_t first = 0; first < kSights; first += kLanes) {
    packet.clear();
    for (int lane = 0; lane < kLanes; ++lane)
      packet.set(lane, p, sightDirection(first + static_cast<std::size_t>(lane)));
    transport.rays.intersect(packet, TraceMode::Packet);
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::size_t i = first + static_cast<std::size_t>(lane);
      sights.distances[i] = std::numeric_limits<float>::infinity();
      if (!packet.hit(lane)) continue;
      const HitSurface hit = transport.rays.surfaceAt(packet, lane);
      sights.distances[i] = packet.rayhit.ray.tfar[lane];
      sights.isBack[i] = hit.backFace && !transport.materials.material(hit.material).doubleSided;
    }
  }
  return sights;
}

/// The way out of a solid by the nearest back, or away from the nearest front that is too close; 0: to stay.
Vec3 wayOut(const Sights& sights, float distance) {
  const bool isInside = sights.backs() > kMostBacks;
  std::size_t nearest = kSights;
  for (std::size_t i = 0; i < kSights; ++i)
    if (sights.isBack[i] == isInside && (nearest == kSights || sights.distances[i] < sights.distances[nearest]))
      nearest = i;
  if (nearest == kSights) return Vec3(0.0f);
  const float d = sights.distances[nearest];
  if (isInside) return sightDirection(nearest) * (d + distance);
  return d < distance ? sightDirection(nearest) * (d - distance) : Vec3(0.0f);
}

/// Settles where light is gathered for a point, whether it can be, and what is seen from there.
void placePoint(const LightTransport& transport, const Vec3& at, const Vec3& cell, VolumePoint& point) {
  const float width = std::min({cell.x, cell.y, cell.z});
  Sights sights = look(transport, at);
  const bool isInside = sights.backs() > kMostBacks;
  const Vec3 way = wayOut(sights, kLeastDistance * width);
  const Vec3 shares = glm::abs(way) / cell;
  if (way != Vec3(0.0f) && std::max({shares.x, shares.y, shares.z}) <= kMostMove) {
    const Sights moved = look(transport, at + way);
    const bool isFreer = std::ranges::min(moved.distances) > std::ranges::min(sights.distances);
    if (moved.backs() <= kMostBacks && (isInside || isFreer)) {
      point.offset = way;
      sights = moved;
    }
  }
  point.isValid = sights.backs() <= kMostBacks;
  for (std::size_t i = 0; i < kSights; ++i) point.nearness[i] = 1.0f / std::max(sights.distances[i], 1e-6f * width);
}

Expected<void> bakeVolume(const LightTransport& transport, const SurfaceCache& surfaces, LightVolume& volume,
                          const VolumeOptions& options, Progress& progress) {
  const std::size_t count = volume.points.size();
  parallelFor(count, 16, [&](std::size_t first, std::size_t last) {
    const FlushDenormals flush;
    for (std::size_t i = first; i < last && !progress.cancelled(); ++i)
      placePoint(transport, volume.gridPoint(i), volume.cell, volume.points[i]);
  });
  std::vector<std::size_t> valid;
  std::vector<Vec3> places;
  for (std::size_t i = 0; i < count; ++i) {
    if (!volume.points[i].isValid) continue;
    valid.push_back(i);
    places.push_back(volume.gridPoint(i) + volume.points[i].offset);
  }
  const auto light =
      gatherInSpace(transport, surfaces, places,
                    {.samples = options.samples, .seed = options.seed, .indirectOnly = options.indirectOnly}, progress);
  if (!light) return light.error();
  for (std::size_t i = 0; i < valid.size(); ++i) {
    volume.points[valid[i]].harmonics = (*light)[i].sh;
    volume.points[valid[i]].cube = (*light)[i].cube;
  }
  fillInvalid(volume);
  return {};
}

}  // namespace

Expected<void> bakeVolumes(const LightTransport& transport, const SurfaceCache& surfaces,
                           std::span<LightVolume> volumes, const VolumeOptions& options, Progress& progress) {
  for (LightVolume& volume : volumes)
    if (auto done = bakeVolume(transport, surfaces, volume, options, progress); !done) return done;
  return {};
}

}  // namespace lumel
