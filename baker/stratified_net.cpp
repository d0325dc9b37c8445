#include "baker/stratified_net.h"

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
  std::array<float, kMostNetPoints> x;
  std::array<float, kMostNetPoints> y;
  std::array<std::uint32_t, kMostNetPoints> cell;
};

// Integer work and exact conversions, so that every version of it gives the same bits.
#if defined(__x86_64__) && defined(__ELF__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
__attribute__((target_clones("avx512f", "avx2", "default")))
#endif
void drawNet(std::uint32_t seed, std::uint32_t first, std::uint32_t count, int bitsX, int bitsY, RawNet& net) {
  const auto cellsX = static_cast<float>(1 << bitsX);
  const auto cellsY = static_cast<float>(1 << bitsY);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec2 u = sobol2D(first + i, seed);
    net.x[i] = u.x;
    net.y[i] = u.y;
    net.cell[i] = mortonCode(static_cast<std::uint32_t>(static_cast<int>(u.x * cellsX)),
                             static_cast<std::uint32_t>(static_cast<int>(u.y * cellsY)));
  }
}

}  // namespace

void NetByCell::fill(const TexelSampler& sampler, const NetRange& net, std::uint32_t pattern) {
  RawNet raw;
  drawNet(sampler.seedOf(pattern), net.first, net.count(), (net.log2Count + 1) / 2, net.log2Count / 2, raw);
  for (std::uint32_t i = 0; i < net.count(); ++i) {
    points[raw.cell[i]] = {raw.x[i], raw.y[i]};
    samples[raw.cell[i]] = net.first + i;
  }
}

}  // namespace lumel
