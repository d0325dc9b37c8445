// Texels of a wave with punctual lights close to them.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "baker/gather/waves/gather_sink.h"
#include "baker/gather/waves/wave_texels.h"
#include "baker/light/near_lights.h"

namespace lumel {

/// Samples the peaks of lights that lie close to texels, which light samples at the texels' points leave out
/// (NearLight).
class NearTexels {
 public:
  /// Finds them among a wave's texels. Most waves have none: a footprint is clipped again only where a light is near.
  explicit NearTexels(const WaveTexels& wave);

  /// Returns points as receivers whose lights in reach are taken as two.
  ReceiverLanes receivers(const PointLanes& points) const;
  /// Adds one sample of each such light for every gather ray of a net.
  void gather(const WaveTexels& wave, const NetRange& net, GatherSink& sink) const;

 private:
  struct Texel {
    std::size_t lane = 0;
    TexelFootprint footprint{};
    std::vector<NearLight> lights{};
  };
  static void addSample(const WaveTexels& wave, const Texel& texel, std::size_t light, std::uint32_t sample,
                        GatherSink& sink);

  std::vector<Texel> texels_;
  alignas(64) std::array<float, kLanes> perReach2_{};
};

}  // namespace lumel
