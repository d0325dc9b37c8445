#include "baker/rays/sample_lanes.h"

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

LUMEL_FOR_EACH_CPU void seedLanes(const std::uint32_t* keys, const std::uint32_t* depths, std::uint32_t* seeds) {
#pragma GCC ivdep
  for (int lane = 0; lane < kLanes; ++lane) seeds[lane] = TexelSampler(keys[lane], depths[lane], 0u, 0u).seed();
}

}  // namespace

void SampleLanes::setTexels(const std::uint32_t* keys, const std::uint32_t* depths) { seedLanes(keys, depths, seeds_); }

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

}  // namespace lumel
