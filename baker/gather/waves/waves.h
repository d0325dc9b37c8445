// The texels of an atlas in waves: up to 16 neighbouring texels of a page that are worked on in step.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "baker/rays/lanes.h"
#include "lightmap/maps/projection_probe.h"
#include "lightmap/texels/texels.h"

namespace lumel {

/// Up to kLanes consecutive texels of a page.
struct Wave {
  std::uint32_t page = 0;
  std::uint32_t first = 0;  // texel of the page
  std::uint32_t count = 0;
  std::uint32_t start = 0;  // the first texel among those of all pages
};

/// All waves, page by page in the order of PageTexels. Texels of all pages are numbered through in the same order, as
/// in TexelMap.
class Waves {
 public:
  explicit Waves(const std::vector<PageTexels>& pages);

  std::size_t size() const { return waves_.size(); }
  const Wave& operator[](std::size_t wave) const { return waves_[wave]; }
  std::vector<Wave>::const_iterator begin() const { return waves_.begin(); }
  std::vector<Wave>::const_iterator end() const { return waves_.end(); }
  std::size_t texels() const { return texels_; }
  /// The wave of a page's texel.
  std::size_t waveOf(std::size_t page, std::size_t index) const { return firstWave_[page] + index / kLanes; }

  static constexpr std::uint32_t kNone = 0xffffffffu;
  /// A wave lies in the 4 x 4 tile of its middle texel: the wave itself is in the middle, around it are those in the
  /// eight tiles around; kNone where there is none.
  const std::array<std::uint32_t, 9>& around(std::size_t wave) const { return around_[wave]; }

  /// Every kProbeStride-th texel of a page is probed; probes are numbered through as well.
  std::size_t probes() const { return probes_; }
  std::size_t probeOf(std::size_t page, std::size_t index) const { return firstProbe_[page] + index / kProbeStride; }

 private:
  void addPage(std::uint32_t number, const PageTexels& page);

  std::vector<Wave> waves_;
  std::vector<std::array<std::uint32_t, 9>> around_;
  std::vector<std::size_t> firstWave_;   // per page
  std::vector<std::size_t> firstProbe_;  // per page
  std::size_t texels_ = 0;
  std::size_t probes_ = 0;
};

}  // namespace lumel
