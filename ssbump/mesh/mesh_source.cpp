#include "ssbump/mesh/mesh_source.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/base/embree.h"
#include "scene/base/parallel.h"
#include "ssbump/mesh/low_poly.h"

namespace lumel::ssbump {
namespace {

constexpr std::size_t kPacket = 16;

/// The high-poly mesh in Embree, on its own or repeated over the plane of a flat tile.
struct Target {
  FlatMesh mesh;
  EmbreeDevice device;
  EmbreeScene single;    // the mesh once
  EmbreeScene repeated;  // null: the mesh does not repeat

  RTCScene scene() const { return repeated ? repeated.get() : single.get(); }
};

EmbreeGeometry triangleGeometry(RTCDevice device, const FlatMesh& mesh) {
  EmbreeGeometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  auto* positions = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size()));
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles()));
  if (!positions || !indices) return {};
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (int c = 0; c < 3; ++c) positions[i * 3 + static_cast<std::size_t>(c)] = mesh.positions[i][c];
    indices[i] = static_cast<std::uint32_t>(i);
  }
  rtcCommitGeometry(geometry.get());
  return geometry;
}

Expected<Target> buildTarget(FlatMesh mesh, Vec2 period, const Progress& progress) {
  Target target;
  target.mesh = std::move(mesh);
  auto device = newEmbreeDevice();
  if (!device) return device.error();
  target.device = std::move(*device);
  target.single = newEmbreeScene(target.device.get());
  const EmbreeGeometry geometry = triangleGeometry(target.device.get(), target.mesh);
  if (!geometry)
    return failure("high-poly mesh: not enough memory for " + std::to_string(target.mesh.triangles()) + " triangles");
  rtcAttachGeometry(target.single.get(), geometry.get());
  if (auto done = commitScene(target.device.get(), target.single.get(), "high-poly mesh", progress); !done)
    return done.error();
  if (period.x <= 0) return target;

  // Enough repeats that what lies beyond rises less than a slope of 0.02, and at most four on either side.
  const float rise = target.mesh.highest.y - target.mesh.lowest.y;
  const int around = std::clamp(static_cast<int>(std::ceil(rise / (0.02f * std::min(period.x, period.y)))), 1, 4);
  target.repeated = newEmbreeScene(target.device.get());
  for (int j = -around; j <= around; ++j)
    for (int i = -around; i <= around; ++i) {
      EmbreeGeometry instance(rtcNewGeometry(target.device.get(), RTC_GEOMETRY_TYPE_INSTANCE));
      rtcSetGeometryInstancedScene(instance.get(), target.single.get());
      const std::array<float, 12> transform{
          1, 0, 0, 0, 1, 0, 0, 0, 1, static_cast<float>(i) * period.x, 0, static_cast<float>(j) * period.y};
      rtcSetGeometryTransform(instance.get(), 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform.data());
      rtcCommitGeometry(instance.get());
      rtcAttachGeometry(target.repeated.get(), instance.get());
    }
  if (auto done = commitScene(target.device.get(), target.repeated.get(), "repeated high-poly mesh", progress); !done)
    return done.error();
  return target;
}

/// Texels of a flat tile: a plane above the mesh, looking down.
std::vector<SurfaceTexel> tileTexels(const MeshSettings& s, Vec2 centre, Vec2 size, float y) {
  std::vector<SurfaceTexel> texels;
  for (int row = 0; row < s.height; ++row)
    for (int column = 0; column < s.width; ++column) {
      const float u = (static_cast<float>(column) + 0.5f) / static_cast<float>(s.width) - 0.5f;
      const float v = (static_cast<float>(row) + 0.5f) / static_cast<float>(s.height) - 0.5f;
      texels.push_back(
          {true, Vec3(centre.x + u * size.x, y, centre.y + v * size.y), Frame{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}});
    }
  return texels;
}

struct Found {
  bool hit = false;
  Vec3 p{0}, shadingNormal{0}, geometricNormal{0};
};

Found projectFrom(const Target& target, const Vec3& origin, const Vec3& direction, float length) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit ray{};
  ray.ray = {origin.x, origin.y, origin.z, 0, direction.x, direction.y, direction.z, 0, length, ~0u, 0, 0};
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(target.scene(), &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const std::size_t c = static_cast<std::size_t>(ray.hit.primID) * 3;
  const float u = ray.hit.u, v = ray.hit.v;
  const FlatMesh& m = target.mesh;
  Found found{true, {}, {}, {}};
  found.p = (1 - u - v) * m.positions[c] + u * m.positions[c + 1] + v * m.positions[c + 2];
  // A repeat lies whole periods away in x and z, across the ray, which runs along y there.
  if (target.repeated) found.p = Vec3(origin.x, found.p.y, origin.z);
  const Vec3 face = glm::cross(m.positions[c + 1] - m.positions[c], m.positions[c + 2] - m.positions[c]);
  found.geometricNormal = glm::normalize(glm::dot(face, direction) > 0 ? -face : face);
  const Vec3 smooth = (1 - u - v) * m.normals[c] + u * m.normals[c + 1] + v * m.normals[c + 2];
  found.shadingNormal = glm::length(smooth) > 1e-6f ? glm::normalize(smooth) : found.geometricNormal;
  if (glm::dot(found.shadingNormal, found.geometricNormal) < 0) found.shadingNormal = -found.shadingNormal;
  return found;
}

/// The mesh's outermost surface along the texel's normal, from `front` above to `back` below. A ray that slips between
/// a mesh's border and its own repeat, or past a border that it should meet, is moved by a hundred-thousandth of the
/// mesh.
Found project(const Target& target, const SurfaceTexel& texel, float front, float back) {
  const Vec3 origin = texel.p + texel.frame.n * front;
  const float nudge = 1e-5f * target.mesh.diagonal();
  for (const auto& [dt, db] : {std::pair{0.0f, 0.0f}, {1.0f, 1.0f}, {-1.0f, -1.0f}, {1.0f, -1.0f}, {-1.0f, 1.0f}}) {
    const Found found =
        projectFrom(target, origin + nudge * (dt * texel.frame.t + db * texel.frame.b), -texel.frame.n, front + back);
    if (found.hit) return found;
  }
  return {};
}

/// Gathers one texel: rays in packets of sixteen from one point.
void gatherTexel(const Target& target, const SurfaceTexel& texel, const Found& found, const HemisphereSamples& samples,
                 int count, std::uint64_t key, std::span<const Lobe> lobes, const Progress& progress,
                 std::span<float> out) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  const float magnitude =
      std::max({std::abs(found.p.x), std::abs(found.p.y), std::abs(found.p.z), 1e-3f * target.mesh.diagonal()});
  const Vec3 origin = found.p + found.geometricNormal * (magnitude * 4e-6f);
  std::vector<double> seen(lobes.size()), all(lobes.size());
  for (int s = 0; s < count && !progress.cancelled(); s += static_cast<int>(kPacket)) {
    alignas(64) RTCRay16 rays{};
    alignas(64) std::array<int, kPacket> valid{};
    std::array<Vec3, kPacket> local;
    for (std::size_t i = 0; i < kPacket && s + static_cast<int>(i) < count; ++i) {
      local[i] = samples.direction(key, s + static_cast<int>(i));
      const Vec3 w = texel.frame.fromLocal(local[i]);
      valid[i] = -1;
      rays.org_x[i] = origin.x, rays.org_y[i] = origin.y, rays.org_z[i] = origin.z;
      rays.dir_x[i] = w.x, rays.dir_y[i] = w.y, rays.dir_z[i] = w.z;
      rays.tfar[i] = std::numeric_limits<float>::infinity();
      rays.mask[i] = ~0u;
    }
    rtcOccluded16(valid.data(), target.scene(), &context, &rays);
    for (std::size_t i = 0; i < kPacket; ++i)
      for (std::size_t c = 0; valid[i] && c < lobes.size(); ++c) {
        const double w = static_cast<double>(lobeWeight(lobes[c], local[i]));
        all[c] += w;
        if (rays.tfar[i] >= 0) seen[c] += w;
      }
  }
  for (std::size_t c = 0; c < lobes.size(); ++c) out[c] = all[c] > 0 ? static_cast<float>(seen[c] / all[c]) : 1.0f;
}

/// Grows covered texels outwards, so that filtering at a chart's edge finds its own values.
void dilate(MeshTexels& texels, int rounds) {
  const int w = texels.coverage.width, h = texels.coverage.height;
  for (int round = 0; round < rounds; ++round) {
    const Image before = texels.coverage;
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        if (*before.at(x, y) > 0) continue;
        constexpr std::array<std::pair<int, int>, 4> kNeighbours{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
        for (const auto& [dx, dy] : kNeighbours) {
          const int nx = x + dx, ny = y + dy;
          if (nx < 0 || ny < 0 || nx >= w || ny >= h || *before.at(nx, ny) <= 0) continue;
          std::copy_n(texels.normals.at(nx, ny), 3, texels.normals.at(x, y));
          std::copy_n(texels.occlusion.at(nx, ny), texels.occlusion.channels, texels.occlusion.at(x, y));
          *texels.coverage.at(x, y) = 0.5f;
          break;
        }
      }
  }
}

}  // namespace

Expected<MeshTexels> gatherMesh(const Scene& high, const Scene* low, const MeshSettings& s, std::span<const Lobe> lobes,
                                Progress& progress) {
  auto flat = flatten(high, -1, "high-poly mesh");
  if (!flat) return flat.error();
  std::vector<SurfaceTexel> surface;
  Vec2 period(0);
  float front = 0, back = 0;
  if (low) {
    auto lowFlat = flatten(*low, s.uvSet, "low-poly mesh");
    if (!lowFlat) return lowFlat.error();
    surface = rasterizeCharts(*lowFlat, s.width, s.height);
    front = back = s.cage > 0 ? s.cage : 0.05f * lowFlat->diagonal();
  } else {
    const Vec3 extent = flat->highest - flat->lowest;
    const Vec3 middle = 0.5f * (flat->highest + flat->lowest);
    const bool given = s.tileWidth > 0 && s.tileHeight > 0;
    const Vec2 size = given ? Vec2(s.tileWidth, s.tileHeight) : Vec2(extent.x, extent.z);
    if (!(size.x > 0 && size.y > 0)) return inputError("high-poly mesh: no extent in x and z; give --tile-size");
    surface = tileTexels(s, given ? Vec2(0) : Vec2(middle.x, middle.z), size, flat->lowest.y);
    front = extent.y * 1.01f + 1e-3f * std::max(size.x, size.y);
    back = 1e-3f * std::max(size.x, size.y);
    if (s.wrap) period = size;
  }
  auto target = buildTarget(std::move(*flat), period, progress);
  if (!target) return target.error();

  MeshTexels out{Image(s.width, s.height, 3), Image(s.width, s.height, static_cast<int>(lobes.size()), 1.0f),
                 Image(s.width, s.height, 1)};
  const HemisphereSamples samples(s.rays.sampling, s.rays.count, s.rays.seed);
  progress.begin("ssbump", surface.size());
  parallelFor(surface.size(), 16, [&](std::size_t first, std::size_t last) {
    if (progress.cancelled()) return;
    for (std::size_t i = first; i < last; ++i) {
      Vec3 normal(0, 0, 1);
      if (surface[i].covered) {
        out.coverage.pixels[i] = 1;
        const Found found = project(*target, surface[i], front, back);
        if (found.hit) {
          normal = surface[i].frame.toLocal(found.shadingNormal);
          normal.z = std::max(normal.z, 1e-3f);
          normal = glm::normalize(normal);
          gatherTexel(*target, surface[i], found, samples, s.rays.count, i, lobes, progress,
                      {&out.occlusion.pixels[i * lobes.size()], lobes.size()});
        }
      }
      std::copy_n(&normal.x, 3, &out.normals.pixels[i * 3]);
    }
    progress.advance(last - first);
  });
  progress.end();
  if (progress.cancelled()) return interrupted();
  dilate(out, low ? s.dilate : 0);
  return out;
}

}  // namespace lumel::ssbump
