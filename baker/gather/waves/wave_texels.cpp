#include "baker/gather/waves/wave_texels.h"

namespace lumel {

WaveTexels::WaveTexels(const GatherScene& ofScene, std::uint32_t ofPage, std::size_t firstTexel, std::size_t texelCount)
    : scene(ofScene),
      page(ofPage),
      first(firstTexel),
      count(texelCount),
      points(scene.transport.rays, scene.atlas, scene.texels[page], first, count) {
  for (std::size_t lane = 0; lane < count; ++lane) {
    const TexelCoord at = scene.texels[page].coords[first + lane];
    samplers[lane] = TexelSampler(scene.seed, page, at.x, at.y);
    covered[lane] = points.covered(lane);
    lightSamples.setTexel(static_cast<int>(lane), samplers[lane]);
  }
  const std::size_t start = scene.map.firstOfPage(page) + first;
  for (const DividedTexel& texel : scene.dividedAmong(start, count))
    if (const std::size_t lane = texel.texel - start; covered[lane])
      points.keepTo(lane, texel.points, samplers[lane].seedOf(kFootprint));
}

Flight WaveTexels::flightOf(std::size_t lane, std::uint32_t sample, const PointLanes& from,
                            const AimedRays& rays) const {
  return {.lane = static_cast<std::uint32_t>(lane),
          .sample = sample,
          .key = samplers[lane].seedOf(kHits),
          .dirTangent = rays.dirTangent[lane],
          .beta = rays.weight[lane] * rays.packet.tint(lane),
          .origin = from.p[lane],
          .pdf = rays.pdf[lane]};
}

}  // namespace lumel
