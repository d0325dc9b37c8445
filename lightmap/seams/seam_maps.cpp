#include "lightmap/seams/seam_maps.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "lightmap/maps/rnm_basis.h"
#include "lightmap/seams/lookup.h"

namespace lumel {

namespace {

/// One colour of a texel's maps as a scalar and a vector in the bake frame.
struct Directional {
  double scalar = 0.0;
  Vec3 vector{0};
};

Directional fromMaps(std::span<const float> maps) {
  if (maps.size() == 1) return {static_cast<double>(maps[0]), Vec3(0)};
  if (maps.size() == 4) return {static_cast<double>(maps[0]), Vec3(maps[1], maps[2], maps[3])};
  Directional light;
  for (std::size_t i = 0; i < 3; ++i) {
    light.scalar += static_cast<double>(maps[i]) / 3.0;
    light.vector += maps[i] * Vec3(kRnmBasis[i].x, kRnmBasis[i].y, 0.0f);
  }
  return light;
}

void toMaps(const Directional& light, bool isSigned, std::span<float> maps) {
  const double scalar = std::max(light.scalar, 0.0);
  maps[0] = static_cast<float>(scalar);
  if (maps.size() == 4)
    for (int axis = 0; axis < 3; ++axis) maps[static_cast<std::size_t>(axis) + 1] = light.vector[axis];
  if (maps.size() != 3) return;
  std::array<double, 3> values{};
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    // The basis is orthonormal, and the mean is the part along the normal over sqrt(3).
    const float along = light.vector.x * kRnmBasis[i].x + light.vector.y * kRnmBasis[i].y;
    values[i] = scalar + static_cast<double>(along);
    if (!isSigned) values[i] = std::max(values[i], 0.0);
    sum += values[i];
  }
  for (std::size_t i = 0; i < 3; ++i)
    maps[i] = static_cast<float>(sum > 0.0 ? values[i] * (3.0 * scalar / sum) : scalar);
}

constexpr std::size_t kMostMendable = 4;

}  // namespace

SeamLight readLight(const SeamPage& page, std::uint32_t texel, const Frame& frame) {
  SeamLight light;
  const std::size_t pixel = std::size_t{3} * texel;
  for (std::size_t c = 0; c < 3; ++c) {
    light.values[c] = static_cast<double>(page.flat->pixels[pixel + c]);
    std::array<float, kMostMendable> maps{};
    for (std::size_t i = 0; i < page.maps.size(); ++i) maps[i] = page.maps[i].pixels[pixel + c];
    const Directional directional = fromMaps(std::span(maps).first(page.maps.size()));
    const Vec3 world = frame.fromLocal(directional.vector);
    light.values[3 + c] = directional.scalar;
    for (int axis = 0; axis < 3; ++axis)
      light.values[6 + 3 * c + static_cast<std::size_t>(axis)] = static_cast<double>(world[axis]);
  }
  return light;
}

void writeLight(const SeamLight& light, const Frame& frame, std::uint32_t texel, SeamPage& page) {
  const std::size_t pixel = std::size_t{3} * texel;
  for (std::size_t c = 0; c < 3; ++c) {
    page.flat->pixels[pixel + c] = static_cast<float>(std::max(light.values[c], 0.0));
    const Vec3 world(light.values[6 + 3 * c], light.values[7 + 3 * c], light.values[8 + 3 * c]);
    std::array<float, kMostMendable> maps{};
    toMaps({light.values[3 + c], frame.toLocal(world)}, page.isSigned, std::span(maps).first(page.maps.size()));
    for (std::size_t i = 0; i < page.maps.size(); ++i) page.maps[i].pixels[pixel + c] = maps[i];
  }
}

PartialLight readPart(const SeamPage& page, const Lookup& lookup, const Frame& frame, bool alsoBeyond) {
  PartialLight read;
  for (std::size_t k = 0; k < 4; ++k) {
    const TexelState state = page.states[lookup.texels[k]];
    if (state != TexelState::Known && !(alsoBeyond && state == TexelState::Beyond)) continue;
    read.light.add(readLight(page, lookup.texels[k], frame), static_cast<double>(lookup.weights[k]));
    read.share += lookup.weights[k];
  }
  if (read.share > 0.0f)
    for (double& value : read.light.values) value /= static_cast<double>(read.share);
  return read;
}

std::vector<BeyondTexel> texelsBeyond(const Seams& seams, std::span<const SeamPage> pages) {
  std::vector<BeyondTexel> beyond;
  for (const SeamPoint& point : seams.points)
    for (std::uint32_t side = 0; side < 2; ++side) {
      const SeamSide& own = seams.pairs[point.pair].sides[side];
      const SeamPage& page = pages[own.page];
      const Lookup lookup = lookupAt(own.at({static_cast<double>(point.metres), 0.0}), page);
      for (std::size_t k = 0; k < 4; ++k)
        if (lookup.weights[k] > kLeastTap && page.states[lookup.texels[k]] == TexelState::Empty) {
          const BeyondTexel texel{own.page, lookup.texels[k], point.pair, side};
          if (beyond.empty() || !(beyond.back() == texel)) beyond.push_back(texel);
        }
    }
  std::sort(beyond.begin(), beyond.end(), [](const BeyondTexel& a, const BeyondTexel& b) {
    return std::tie(a.page, a.texel, a.pair, a.side) < std::tie(b.page, b.texel, b.pair, b.side);
  });
  beyond.erase(std::unique(beyond.begin(), beyond.end()), beyond.end());
  return beyond;
}

namespace {

/// The mean of the texels around one that are not empty.
SeamLight lightAround(const SeamPage& page, std::uint32_t texel, const Frame& frame) {
  const int width = page.flat->width, height = page.flat->height;
  const int x = static_cast<int>(texel) % width, y = static_cast<int>(texel) / width;
  SeamLight sum;
  double count = 0.0;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height - 1); ++v)
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width - 1); ++u) {
      const auto other = static_cast<std::uint32_t>(v * width + u);
      if (page.states[other] == TexelState::Empty) continue;
      sum.add(readLight(page, other, frame), 1.0);
      count += 1.0;
    }
  for (double& value : sum.values) value /= std::max(count, 1.0);
  return sum;
}

/// Fills what is still empty of `beyond`. A texel's entries stand together.
void fillBeyond(const Seams& seams, std::span<const BeyondTexel> beyond, bool fromBeyond, std::span<SeamPage> pages) {
  std::vector<BeyondTexel> filled;
  for (std::size_t i = 0, end = 0; i < beyond.size(); i = end) {
    PartialLight sum;
    SeamPage& page = pages[beyond[i].page];
    for (; end < beyond.size() && beyond[end].page == beyond[i].page && beyond[end].texel == beyond[i].texel; ++end) {
      const SeamSide& other = seams.pairs[beyond[end].pair].sides[1 - beyond[end].side];
      const SeamPage& otherPage = pages[other.page];
      const Lookup lookup = lookupAt(placeAcross(seams, beyond[end], page.flat->width), otherPage);
      const PartialLight read = readPart(otherPage, lookup, other.frame, fromBeyond);
      sum.light.add(read.light, static_cast<double>(read.share));
      sum.share += read.share;
    }
    if (page.states[beyond[i].texel] != TexelState::Empty || !(sum.share > kLeastTap)) continue;
    for (double& value : sum.light.values) value /= static_cast<double>(sum.share);
    writeLight(sum.light, seams.pairs[beyond[i].pair].sides[beyond[i].side].frame, beyond[i].texel, page);
    filled.push_back(beyond[i]);
  }
  for (const BeyondTexel& texel : filled) pages[texel.page].states[texel.texel] = TexelState::Beyond;
}

}  // namespace

void continueLight(const Seams& seams, std::span<const BeyondTexel> beyond, std::span<SeamPage> pages) {
  fillBeyond(seams, beyond, false, pages);
  fillBeyond(seams, beyond, true, pages);
  for (const BeyondTexel& texel : beyond) {
    SeamPage& page = pages[texel.page];
    if (page.states[texel.texel] != TexelState::Empty) continue;
    const Frame& frame = seams.pairs[texel.pair].sides[texel.side].frame;
    writeLight(lightAround(page, texel.texel, frame), frame, texel.texel, page);
    page.states[texel.texel] = TexelState::Beyond;
  }
}

}  // namespace lumel
