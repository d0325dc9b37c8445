// Occlusion of a height field from its exact horizons, azimuth by azimuth (Max 1988, "Horizon mapping"), with the
// integral above the horizon in closed form. For one azimuth and distance the offset is the same for all texels, so a
// step along the slice is two shifted contiguous loads and a constant interpolation.
#pragma once

#include <memory>
#include <span>

#include "scene/base/progress.h"
#include "scene/image.h"
#include "ssbump/occlusion/horizon_kernel.h"
#include "ssbump/occlusion/max_levels.h"

namespace lumel::ssbump {

struct HorizonSettings {
  int azimuths = 0;  // 0 = automaticAzimuths; multiples of 4 are best: no slice then runs along an axis or a diagonal
  int reach = 0;     // texels beyond which nothing occludes; 0 = automaticReach
  SimdLevel simd = bestSimdLevel();
};

/// The distance at which the field's whole height span is less than a slope of 0.01, at most four times the larger side
/// of a tiling map (its highest points have come by before) and no more than the diagonal of one that does not tile.
int automaticReach(const HeightField& field);

/// Enough that the error from azimuths stays below a tenth of that of 300 random rays on bricks and steps: the horizon
/// jumps between two azimuths by as much as the heights do.
int automaticAzimuths(const HeightField& field);

/// Prepared once per field; the field must outlive it.
class Horizon {
 public:
  Horizon(const HeightField& field, const HorizonSettings& settings);

  /// Visibility in 0..1 around every lobe for the texels of a rectangle inside the map: one channel per lobe, 1 where
  /// nothing occludes. A lobe that lies below the base surface altogether gives 1.
  /// Splits over threads by rows; the values depend neither on threads nor on the rectangle.
  /// Advances `progress` by texels; once it is cancelled the rest is left out: ask it.
  Image occlusion(const TexelRect& rect, std::span<const Lobe> lobes, Progress& progress = noProgress()) const;

 private:
  HorizonSettings settings_;
  RowMaxima rows_;
};

}  // namespace lumel::ssbump
