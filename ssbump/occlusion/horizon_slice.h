// This file says where the horizon of one azimuth is looked for: single edges of the surface nearby, maxima over
// windows farther away.
#pragma once

#include <span>
#include <vector>

#include "ssbump/occlusion/horizon_kernel.h"
#include "ssbump/occlusion/max_levels.h"

namespace lumel::ssbump {

/// Steps that look at single edges end here, in texels.
int nearReach();

/// Distances along the dominant axis from begin to twice that, in steps of one window.
struct Octave {
  int begin = 0;
  WindowGrid grid;
};

/// Outwards to `reach` texels. Cells are texels in the first and double with the distance, up to `mostCell`.
std::vector<Octave> octavesTo(int reach, int mostCell);

struct FarStep {
  int x = 0, y = 0;  // of the entry, from the cell's first texel
  float inverseDistance = 0;
};

struct Slice {
  Along along = Along::X;  // the axis that the azimuth is nearer to
  std::vector<NearStep> near;
  std::vector<std::vector<FarStep>> far;  // per octave
  std::vector<LobeSlice> lobes;
};

/// `rowStride`: of the heights that the near steps' offsets are for.
Slice makeSlice(double phi, int reach, std::span<const Octave> octaves, std::span<const Lobe> lobes,
                std::ptrdiff_t rowStride);

}  // namespace lumel::ssbump
