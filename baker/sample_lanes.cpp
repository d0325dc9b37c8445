#include "baker/sample_lanes.h"

#include <algorithm>

#include "scene/check.h"

// Integer code in plain loops, compiled for several instruction sets: the same values on each. (Sanitizers do not
// take functions that are chosen when the program is loaded.)
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define LUMEL_FOR_EACH_CPU __attribute__((target_clones("arch=skylake-avx512", "avx2", "default")))
#else
#define LUMEL_FOR_EACH_CPU
#endif

namespace lumel {
namespace {

LUMEL_FOR_EACH_CPU void drawLanes1D(const std::uint32_t* seeds, const std::uint32_t* samples, std::uint32_t pattern,
                                    float* u) {
  for (int lane = 0; lane < kLanes; ++lane) u[lane] = sobol1D(samples[lane], hashCombine(seeds[lane], pattern));
}

LUMEL_FOR_EACH_CPU void drawLanes2D(const std::uint32_t* seeds, const std::uint32_t* samples, std::uint32_t pattern,
                                    float* x, float* y) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const Vec2 u = sobol2D(samples[lane], hashCombine(seeds[lane], pattern));
    x[lane] = u.x;
    y[lane] = u.y;
  }
}

/// Bits of x at even places, of y at odd ones; eight bits each.
std::uint32_t mortonCode(std::uint32_t x, std::uint32_t y) {
  const auto spread = [](std::uint32_t v) {
    v = (v | (v << 4)) & 0x0f0fu;
    v = (v | (v << 2)) & 0x3333u;
    return (v | (v << 1)) & 0x5555u;
  };
  return spread(x) | (spread(y) << 1);
}

}  // namespace

UnitLanes SampleLanes::draw1D(std::uint32_t pattern) const {
  UnitLanes lanes;
  drawLanes1D(seeds_, samples_, pattern, lanes.u);
  return lanes;
}

UnitSquareLanes SampleLanes::draw2D(std::uint32_t pattern) const {
  UnitSquareLanes lanes;
  drawLanes2D(seeds_, samples_, pattern, lanes.x, lanes.y);
  return lanes;
}

void StratumOrder::arrange(SampleLanes lanes, std::uint32_t pattern, std::uint32_t first, std::uint32_t count) {
  LUMEL_CHECK(count <= kBlock);
  first_ = first;
  std::uint32_t side = 1;  // cells on a side: as many cells as samples, or up to four times fewer
  while (4 * side * side <= count) side *= 2;
  const std::uint32_t cellCount = side * side;
  order_.resize(std::size_t{count} * kLanes);
  cells_.resize(std::size_t{count} * kLanes);
  std::vector<std::uint32_t> starts((cellCount + 1) * kLanes, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    lanes.setSampleOfAll(first + i);
    const UnitSquareLanes u = lanes.draw2D(pattern);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const auto scale = static_cast<float>(side);
      const std::uint32_t cell =
          mortonCode(static_cast<std::uint32_t>(u.x[lane] * scale), static_cast<std::uint32_t>(u.y[lane] * scale));
      cells_[i * kLanes + lane] = static_cast<std::uint16_t>(cell);
      ++starts[(cell + 1) * kLanes + lane];
    }
  }
  for (std::size_t i = kLanes; i < starts.size(); ++i) starts[i] += starts[i - kLanes];
  for (std::uint32_t i = 0; i < count; ++i)
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      std::uint32_t& step = starts[cells_[i * kLanes + lane] * std::uint32_t{kLanes} + lane];
      order_[step++ * kLanes + lane] = static_cast<std::uint16_t>(i);
    }
}

}  // namespace lumel
