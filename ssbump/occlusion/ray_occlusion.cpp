#include "ssbump/occlusion/ray_occlusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "scene/base/parallel.h"
#include "ssbump/occlusion/horizon.h"

namespace lumel::ssbump {
namespace {

constexpr std::size_t kPacket = 16;

// Rays start this far above their texel, and overlap by it where they re-enter a tile on its other side. It tilts a
// horizon by about a thousandth; at 4096 texels it is still twice the spacing of float coordinates.
constexpr float kOffsetTexels = 1e-3f;

/// Sixteen rays: in tile coordinates, x right, y down the image, z up; carried around the torus until each is decided.
class Packet {
 public:
  Packet(const HeightField& field, RTCScene scene, bool coherent, float reach)
      : field_(field), scene_(scene), reach_(reach) {
    rtcInitIntersectContext(&context_);
    context_.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }

  void set(std::size_t lane, float x, float y, float z, const Vec3& dirTangent) {
    rays_.org_x[lane] = x;
    rays_.org_y[lane] = y;
    rays_.org_z[lane] = z + offset();
    rays_.dir_x[lane] = dirTangent.x;
    rays_.dir_y[lane] = -dirTangent.y;
    rays_.dir_z[lane] = dirTangent.z;
    rays_.tnear[lane] = 0;
    rays_.mask[lane] = ~0u;
    rays_.flags[lane] = 0;
    // Beyond the reach, or above everything, nothing can block it any more.
    const float flat = std::hypot(dirTangent.x, dirTangent.y);
    const float atReach = flat > 1e-6f ? reach_ / flat : 1e30f;
    const float atTop = dirTangent.z > 1e-6f ? (field_.highest - z) / dirTangent.z + offset() : 1e30f;
    end_[lane] = std::min(atReach, atTop);
    valid_[lane] = -1;
  }
  void disable(std::size_t lane) { valid_[lane] = 0; }

  /// Bit i set where ray i is blocked.
  std::uint32_t trace() {
    std::uint32_t blocked = 0;
    for (bool any = true; any;) {
      std::array<float, kPacket> leaves{};
      for (std::size_t i = 0; i < kPacket; ++i) {
        if (!valid_[i]) continue;
        leaves[i] = field_.wrap ? leavesTile(i) : end_[i];
        rays_.tfar[i] = std::min(end_[i], leaves[i] + offset());
      }
      rtcOccluded16(valid_.data(), scene_, &context_, &rays_);
      any = false;
      for (std::size_t i = 0; i < kPacket; ++i) {
        if (!valid_[i]) continue;
        if (rays_.tfar[i] < 0)
          blocked |= 1u << i, valid_[i] = 0;
        else if (leaves[i] >= end_[i])
          valid_[i] = 0;
        else
          reenter(i, leaves[i]), any = true;
      }
    }
    return blocked;
  }

 private:
  float offset() const {
    return kOffsetTexels * std::max(1.0f, static_cast<float>(std::max(field_.width, field_.height)) / 2048);
  }

  float leavesTile(std::size_t i) const {
    const auto axis = [&](float origin, float direction, int size) {
      if (std::abs(direction) < 1e-12f) return 1e30f;
      return ((direction > 0 ? static_cast<float>(size) : 0.0f) - origin) / direction;
    };
    return std::min(axis(rays_.org_x[i], rays_.dir_x[i], field_.width),
                    axis(rays_.org_y[i], rays_.dir_y[i], field_.height));
  }

  /// The ray goes on from where it left, on the other side: its origin moves by a whole tile, its parameter does not.
  void reenter(std::size_t i, float leaves) {
    const auto shift = [&](float& origin, float direction, int size) {
      const auto s = static_cast<float>(size);
      const float at = origin + direction * leaves;
      if (direction > 0 && at >= s - 0.5f * offset())
        origin -= s;
      else if (direction < 0 && at <= 0.5f * offset())
        origin += s;
    };
    shift(rays_.org_x[i], rays_.dir_x[i], field_.width);
    shift(rays_.org_y[i], rays_.dir_y[i], field_.height);
    rays_.tnear[i] = std::max(0.0f, leaves - offset());
  }

  const HeightField& field_;
  RTCScene scene_;
  float reach_;
  RTCIntersectContext context_{};
  alignas(64) RTCRay16 rays_{};
  alignas(64) std::array<int, kPacket> valid_{};
  std::array<float, kPacket> end_{};
};

}  // namespace

Expected<RayOcclusion> RayOcclusion::build(const HeightField& field, const RaySettings& settings,
                                           const Progress& progress) {
  RayOcclusion self(field, settings);
  if (self.settings_.reach <= 0) self.settings_.reach = automaticReach(field);
  auto device = newEmbreeDevice();
  if (!device) return device.error();
  self.device_ = std::move(*device);
  self.scene_ = newEmbreeScene(self.device_.get());

  // A tiling map has one more column and row: its neighbours' first.
  const int columns = field.width + (field.wrap ? 1 : 0), rows = field.height + (field.wrap ? 1 : 0);
  EmbreeGeometry geometry(rtcNewGeometry(self.device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
  const auto vertexCount = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const auto cellCount = static_cast<std::size_t>(columns - 1) * static_cast<std::size_t>(rows - 1);
  auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0,
                                                                RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertexCount));
  auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), 2 * cellCount));
  if (cellCount > 0 && (!positions || !indices))
    return failure("height field of " + std::to_string(field.width) + "x" + std::to_string(field.height) +
                   ": not enough memory for rays");
  if (cellCount > 0) {
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x) {
        *positions++ = static_cast<float>(x);
        *positions++ = static_cast<float>(y);
        *positions++ = field.at(x, y);
      }
    const auto stride = static_cast<std::uint32_t>(columns);
    for (std::uint32_t y = 0; y + 1 < static_cast<std::uint32_t>(rows); ++y)
      for (std::uint32_t x = 0; x + 1 < stride; ++x) {
        const std::uint32_t corner = y * stride + x;
        for (std::uint32_t v : {corner, corner + stride + 1, corner + 1, corner, corner + stride, corner + stride + 1})
          *indices++ = v;
      }
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(self.scene_.get(), geometry.get());
  }
  auto committed = commitScene(self.device_.get(), self.scene_.get(), "height field", progress);
  if (!committed) return committed.error();
  return self;
}

Image RayOcclusion::occlusion(const TexelRect& rect, std::span<const Lobe> lobes, Progress& progress) const {
  Image out(rect.width, rect.height, static_cast<int>(lobes.size()));
  std::vector<std::pair<int, int>> texels;
  texels.reserve(static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height));
  for (int y = 0; y < rect.height; ++y)
    for (int x = 0; x < rect.width; ++x) texels.emplace_back(rect.x + x, rect.y + y);
  out.pixels = occlusionAt(texels, lobes, progress);
  return out;
}

std::vector<float> RayOcclusion::occlusionAt(std::span<const std::pair<int, int>> texels, std::span<const Lobe> lobes,
                                             Progress& progress) const {
  const HemisphereSamples samples(settings_.sampling, settings_.count, settings_.seed);
  const std::size_t channels = lobes.size();
  std::vector<float> out(texels.size() * channels);
  parallelFor((texels.size() + kPacket - 1) / kPacket, 16, [&](std::size_t first, std::size_t last) {
    Packet packet(*field_, scene_.get(), settings_.sampling == RaySampling::Stratified,
                  static_cast<float>(settings_.reach));
    std::vector<double> seen(kPacket * channels), all(kPacket * channels);
    for (std::size_t p = first; p < last; ++p) {
      std::fill(seen.begin(), seen.end(), 0.0);
      std::fill(all.begin(), all.end(), 0.0);
      const std::size_t lanes = std::min(kPacket, texels.size() - p * kPacket);
      std::array<Vec3, kPacket> directions;
      for (int s = 0; s < settings_.count; ++s) {
        if (progress.cancelled()) return;
        for (std::size_t i = 0; i < kPacket; ++i) {
          packet.disable(i);
          if (i >= lanes) continue;
          const auto [x, y] = texels[p * kPacket + i];
          const auto key =
              static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(field_->width) + static_cast<std::uint64_t>(x);
          directions[i] = samples.direction(key, s);
          packet.set(i, static_cast<float>(x), static_cast<float>(y), field_->at(x, y), directions[i]);
        }
        const std::uint32_t blocked = packet.trace();
        for (std::size_t i = 0; i < lanes; ++i)
          for (std::size_t c = 0; c < channels; ++c) {
            const double w = static_cast<double>(lobeWeight(lobes[c], directions[i]));
            all[i * channels + c] += w;
            if (!(blocked >> i & 1)) seen[i * channels + c] += w;
          }
      }
      for (std::size_t i = 0; i < lanes * channels; ++i)
        out[p * kPacket * channels + i] = all[i] > 0 ? static_cast<float>(seen[i] / all[i]) : 1.0f;
      progress.advance(lanes);
    }
  });
  return out;
}

}  // namespace lumel::ssbump
