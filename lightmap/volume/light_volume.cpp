#include "lightmap/volume/light_volume.h"

#include <algorithm>
#include <cmath>

namespace lumel {
namespace {

/// A place that lies so much farther off than what is seen in its direction is out of sight, in shares of that
/// distance: nothing less than the first, all beyond the second. Sights are as coarse as kSightSide makes them.
constexpr float kSurelySeen = 1.05f;
constexpr float kSurelyHidden = 1.2f;
/// Points in the plane of a surface still count so much for it: those above it count 1 (DDGI; Majercik et al. 2019).
constexpr float kLeastFacing = 0.05f;

/// Octahedral map of unit directions to [-1, 1]^2.
Vec2 octahedral(const Vec3& d) {
  const Vec2 p = Vec2(d.x, d.y) / (std::abs(d.x) + std::abs(d.y) + std::abs(d.z));
  if (d.z >= 0.0f) return p;
  return {(1.0f - std::abs(p.y)) * std::copysign(1.0f, p.x), (1.0f - std::abs(p.x)) * std::copysign(1.0f, p.y)};
}

/// Number of the sight at (x, y) on the map, which its border folds over.
std::size_t sightAt(int x, int y) {
  if (x < 0 || x >= kSightSide) {
    x = std::clamp(x, 0, kSightSide - 1);
    y = kSightSide - 1 - y;
  }
  if (y < 0 || y >= kSightSide) {
    y = std::clamp(y, 0, kSightSide - 1);
    x = kSightSide - 1 - x;
  }
  return static_cast<std::size_t>(y * kSightSide + x);
}

float nearnessTowards(const VolumePoint& point, const Vec3& direction) {
  const Vec2 at = (octahedral(direction) * 0.5f + 0.5f) * static_cast<float>(kSightSide) - 0.5f;
  const Vec2 whole = glm::floor(at);
  const Vec2 part = at - whole;
  const int x = static_cast<int>(whole.x), y = static_cast<int>(whole.y);
  const auto of = [&](int dx, int dy) { return point.nearness[sightAt(x + dx, y + dy)]; };
  return glm::mix(glm::mix(of(0, 0), of(1, 0), part.x), glm::mix(of(0, 1), of(1, 1), part.x), part.y);
}

float sightOf(const VolumePoint& point, const Vec3& way) {
  const float distance = glm::length(way);
  if (!(distance > 0.0f)) return 1.0f;
  const float times = distance * nearnessTowards(point, way / distance);
  return std::clamp((kSurelyHidden - times) / (kSurelyHidden - kSurelySeen), 0.0f, 1.0f);
}

}  // namespace

std::array<float, kHarmonics> harmonics(const Vec3& d) {
  constexpr float k0 = 0.28209479f;   // 1 / (2 sqrt(pi))
  constexpr float k1 = 0.48860251f;   // sqrt(3 / (4 pi))
  constexpr float k2 = 1.09254843f;   // sqrt(15 / (4 pi))
  constexpr float k20 = 0.31539157f;  // sqrt(5 / (16 pi))
  constexpr float k22 = 0.54627422f;  // sqrt(15 / (16 pi))
  return {k0,
          k1 * d.y,
          k1 * d.z,
          k1 * d.x,
          k2 * d.x * d.y,
          k2 * d.y * d.z,
          k20 * (3.0f * d.z * d.z - 1.0f),
          k2 * d.x * d.z,
          k22 * (d.x * d.x - d.y * d.y)};
}

std::array<float, kCubeFaces> cubeKernels(const Vec3& d) {
  constexpr float kInv = 0.31830989f;
  const Vec3 front = glm::max(d, Vec3(0.0f)) * kInv, back = glm::max(-d, Vec3(0.0f)) * kInv;
  return {front.x, back.x, front.y, back.y, front.z, back.z};
}

Vec3 sightDirection(std::size_t i) {
  const int x = static_cast<int>(i) % kSightSide, y = static_cast<int>(i) / kSightSide;
  const Vec2 p = (Vec2(static_cast<float>(x), static_cast<float>(y)) + 0.5f) * (2.0f / kSightSide) - 1.0f;
  Vec3 d(p.x, p.y, 1.0f - std::abs(p.x) - std::abs(p.y));
  if (d.z < 0.0f) {
    d.x = (1.0f - std::abs(p.y)) * std::copysign(1.0f, p.x);
    d.y = (1.0f - std::abs(p.x)) * std::copysign(1.0f, p.y);
  }
  return glm::normalize(d);
}

Vec3 LightVolume::gridPoint(std::size_t index) const {
  const auto nx = static_cast<std::size_t>(counts[0]), ny = static_cast<std::size_t>(counts[1]);
  const Vec3 at(static_cast<float>(index % nx), static_cast<float>(index / nx % ny),
                static_cast<float>(index / (nx * ny)));
  return origin + at * cell;
}

bool LightVolume::contains(const Vec3& p) const {
  for (int axis = 0; axis < 3; ++axis) {
    const float most = origin[axis] + cell[axis] * static_cast<float>(counts[static_cast<std::size_t>(axis)] - 1);
    if (!(p[axis] >= origin[axis] && p[axis] <= most)) return false;
  }
  return true;
}

double pointCount(const Vec3& least, const Vec3& most, float cell) {
  double count = 1.0;
  for (int axis = 0; axis < 3; ++axis)
    count *= std::ceil(static_cast<double>(most[axis] - least[axis]) / static_cast<double>(cell) - 1e-4) + 1.0;
  return count;
}

LightVolume volumeOf(const Vec3& least, const Vec3& most, float cell) {
  LightVolume volume;
  volume.origin = least;
  std::size_t count = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const float extent = most[axis] - least[axis];
    // A box that cells fill but for rounding takes no further one.
    const int cells = static_cast<int>(std::ceil(extent / cell - 1e-4f));
    volume.counts[static_cast<std::size_t>(axis)] = cells + 1;
    volume.cell[axis] = cells > 0 ? extent / static_cast<float>(cells) : cell;
    count *= static_cast<std::size_t>(cells) + 1;
  }
  volume.points.resize(count);
  return volume;
}

void fillInvalid(LightVolume& volume) {
  std::vector<std::uint8_t> known(volume.points.size());
  for (std::size_t i = 0; i < known.size(); ++i) known[i] = volume.points[i].isValid ? 1 : 0;
  const auto [nx, ny, nz] = volume.counts;
  bool grew = true;
  while (grew) {
    grew = false;
    std::vector<std::uint8_t> next = known;
    for (int z = 0; z < nz; ++z)
      for (int y = 0; y < ny; ++y)
        for (int x = 0; x < nx; ++x) {
          VolumePoint& point = volume.points[volume.indexOf(x, y, z)];
          if (known[volume.indexOf(x, y, z)] != 0) continue;
          VolumePoint sum;
          float count = 0.0f;
          for (int c = std::max(z - 1, 0); c <= std::min(z + 1, nz - 1); ++c)
            for (int b = std::max(y - 1, 0); b <= std::min(y + 1, ny - 1); ++b)
              for (int a = std::max(x - 1, 0); a <= std::min(x + 1, nx - 1); ++a) {
                if (known[volume.indexOf(a, b, c)] == 0) continue;
                const VolumePoint& from = volume.points[volume.indexOf(a, b, c)];
                for (std::size_t k = 0; k < kHarmonics; ++k) sum.harmonics[k] += from.harmonics[k];
                for (std::size_t k = 0; k < kCubeFaces; ++k) sum.cube[k] += from.cube[k];
                count += 1.0f;
              }
          if (count == 0.0f) continue;
          for (std::size_t k = 0; k < kHarmonics; ++k) point.harmonics[k] = sum.harmonics[k] / count;
          for (std::size_t k = 0; k < kCubeFaces; ++k) point.cube[k] = sum.cube[k] / count;
          next[volume.indexOf(x, y, z)] = 1;
          grew = true;
        }
    known = std::move(next);
  }
}

VolumeLookup lookUp(const LightVolume& volume, const Vec3& p, const Vec3& normal, VolumeMask mask) {
  std::array<int, 3> first{};
  Vec3 part(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    const int last = volume.counts[static_cast<std::size_t>(axis)] - 1;
    const float at = std::clamp((p[axis] - volume.origin[axis]) / volume.cell[axis], 0.0f, static_cast<float>(last));
    first[static_cast<std::size_t>(axis)] = std::min(static_cast<int>(at), std::max(last - 1, 0));
    part[axis] = at - static_cast<float>(first[static_cast<std::size_t>(axis)]);
  }
  VolumeLookup lookup;
  std::array<float, 8> plain{};
  float sum = 0.0f;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    std::array<int, 3> at{};
    float weight = 1.0f;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool far = (corner >> axis & 1u) != 0;
      at[axis] = std::min(first[axis] + (far ? 1 : 0), volume.counts[axis] - 1);
      const float share = part[static_cast<int>(axis)];
      weight *= far ? share : 1.0f - share;
    }
    const std::size_t index = volume.indexOf(at[0], at[1], at[2]);
    lookup.points[corner] = index;
    plain[corner] = weight;
    const VolumePoint& point = volume.points[index];
    if (mask == VolumeMask::Sight) {
      const Vec3 from = volume.gridPoint(index) + point.offset;
      weight *= point.isValid ? sightOf(point, p - from) : 0.0f;
      const float distance = glm::length(from - p);
      if (distance > 0.0f && normal != Vec3(0.0f)) {
        const float facing = std::max(0.0f, 0.5f + 0.5f * glm::dot(from - p, normal) / distance);
        weight *= facing * facing + kLeastFacing;
      }
    }
    lookup.weights[corner] = weight;
    sum += weight;
  }
  if (!(sum > 0.0f)) {
    lookup.weights = plain;
    return lookup;
  }
  for (float& weight : lookup.weights) weight /= sum;
  return lookup;
}

Vec3 lightOn(const LightVolume& volume, const VolumeLookup& lookup, const Vec3& normal, VolumeBasis basis) {
  const bool isPlain = normal == Vec3(0.0f);
  // A band's share of irradiance / pi: 1, 2/3, 1/4 (Ramamoorthi and Hanrahan 2001). The constant one alone, taken by
  // Y00 / sqrt(pi), is the mean radiance.
  constexpr std::array<float, kHarmonics> kBand = {1.0f,  2.0f / 3, 2.0f / 3, 2.0f / 3, 0.25f,
                                                   0.25f, 0.25f,    0.25f,    0.25f};
  std::array<float, kHarmonics> y = harmonics(normal);
  const std::size_t terms = isPlain ? 1 : basis == VolumeBasis::Sh1 ? 4 : kHarmonics;
  const Vec3 squared = normal * normal;
  Vec3 light(0.0f);
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const VolumePoint& point = volume.points[lookup.points[corner]];
    Vec3 here(0.0f);
    if (basis == VolumeBasis::Cube && !isPlain) {
      for (int axis = 0; axis < 3; ++axis)
        here += squared[axis] * point.cube[static_cast<std::size_t>(2 * axis + (normal[axis] < 0.0f ? 1 : 0))];
    } else {
      for (std::size_t k = 0; k < terms; ++k) here += point.harmonics[k] * (kBand[k] * y[k]);
    }
    light += lookup.weights[corner] * here;
  }
  return glm::max(light, Vec3(0.0f));
}

const char* nameOf(VolumeBasis basis) {
  return basis == VolumeBasis::Cube ? "cube" : basis == VolumeBasis::Sh1 ? "sh1" : "sh2";
}

}  // namespace lumel
