// Figures of one image and of the difference between two.
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include "scene/base/expected.h"
#include "scene/image.h"

namespace lumel {

/// Over the finite values of one channel; NaN and infinities are counted apart.
struct ChannelFigures {
  float least = 0.0f;
  float most = 0.0f;
  double mean = 0.0;
  std::size_t notANumber = 0;
  std::size_t infinite = 0;
};

std::vector<ChannelFigures> channelFigures(const Image& image);

/// How far `a` is from the reference `b`.
struct DifferenceFigures {
  double rmse = 0.0;
  double relativeRmse = 0.0;  // rmse / root mean square of b; 0 where both are black, infinite where b alone is
  double maximum = 0.0;       // largest |a - b|
  double meanA = 0.0;
  double meanB = 0.0;
  std::size_t count = 0;    // values compared
  std::size_t skipped = 0;  // values left out: not finite in a or b

  double meanRatio() const { return meanB != 0.0 ? meanA / meanB : meanA == 0.0 ? 1.0 : HUGE_VAL; }
};

/// Says which pixels count.
using PixelMask = std::function<bool(int x, int y)>;

struct ImageDifference {
  std::vector<DifferenceFigures> channels;
  DifferenceFigures all;
};

/// Precondition: the same size and number of channels.
ImageDifference compareImages(const Image& a, const Image& b, const PixelMask& mask);

/// |a - b| averaged over the channels as a colour from black over violet and orange to white, `full` being white;
/// masked pixels are dark blue-grey, values that are not finite green. RGB, encoded for the screen.
Image heatMap(const Image& a, const Image& b, const PixelMask& mask, double full);

}  // namespace lumel
