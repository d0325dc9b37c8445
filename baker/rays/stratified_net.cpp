#include "baker/rays/stratified_net.h"

namespace lumel {
namespace {

/// Interleaved bits: x in the even places, y in the odd ones.
inline std::uint32_t mortonCode(std::uint32_t x, std::uint32_t y) {
  const auto spread = [](std::uint32_t v) {
    v = (v | (v << 4)) & 0x0f0fu;
    v = (v | (v << 2)) & 0x3333u;
    return (v | (v << 1)) & 0x5555u;
  };
  return spread(x) | (spread(y) << 1);
}

struct RawNet {
  std::array<std::uint32_t, kMostNetPoints> reversedIndex;
  std::array<float, kMostNetPoints> x;
  std::array<float, kMostNetPoints> y;
  std::array<std::uint32_t, kMostNetPoints> cell;
};

LUMEL_FOR_EACH_CPU void drawNet(std::uint32_t seed, std::uint32_t count, int bitsX, int bitsY, RawNet& net) {
  const auto cellsX = static_cast<float>(1 << bitsX);
  const auto cellsY = static_cast<float>(1 << bitsY);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec2 u = sobol2DOfReversed(net.reversedIndex[i], seed);
    net.x[i] = u.x;
    net.y[i] = u.y;
    net.cell[i] = mortonCode(static_cast<std::uint32_t>(static_cast<int>(u.x * cellsX)),
                             static_cast<std::uint32_t>(static_cast<int>(u.y * cellsY)));
  }
}

}  // namespace

NetCell netCell(std::uint32_t cell) {
  const auto even = [](std::uint32_t v) {
    v &= 0x55555555u;
    v = (v | (v >> 1)) & 0x33333333u;
    v = (v | (v >> 2)) & 0x0f0f0f0fu;
    return (v | (v >> 4)) & 0x00ff00ffu;
  };
  return {even(cell), even(cell >> 1)};
}

void NetLanes::fill(const std::array<TexelSampler, kLanes>& samplers, const std::array<bool, kLanes>& active,
                    const NetRange& net, std::uint32_t pattern) {
  net_ = net;
  RawNet raw;
  for (std::uint32_t i = 0; i < net.count(); ++i) raw.reversedIndex[i] = reverseBits(net.first + i);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (!active[lane]) {
      for (std::size_t at = lane; at < std::size_t{net.count()} * kLanes; at += kLanes) {
        x_[at] = y_[at] = 0.0f;
        offset_[at] = 0;
      }
      continue;
    }
    drawNet(samplers[lane].seedOf(pattern), net.count(), (net.log2Count + 1) / 2, net.log2Count / 2, raw);
    for (std::uint32_t i = 0; i < net.count(); ++i) {
      const std::size_t at = std::size_t{raw.cell[i]} * kLanes + lane;
      x_[at] = raw.x[i];
      y_[at] = raw.y[i];
      offset_[at] = static_cast<std::uint16_t>(i);
    }
  }
}

}  // namespace lumel
