#include "baker/commands/image_figures.h"

#include <algorithm>
#include <array>
#include <limits>

namespace lumel {
namespace {

struct Sums {
  double a = 0.0, b = 0.0, bSquared = 0.0, differenceSquared = 0.0, maximum = 0.0;
  std::size_t count = 0, skipped = 0;

  void add(double x, double y) {
    if (!std::isfinite(x) || !std::isfinite(y)) {
      ++skipped;
      return;
    }
    ++count;
    a += x;
    b += y;
    bSquared += y * y;
    differenceSquared += (x - y) * (x - y);
    maximum = std::max(maximum, std::abs(x - y));
  }

  DifferenceFigures figures() const {
    DifferenceFigures f;
    f.count = count;
    f.skipped = skipped;
    if (count == 0) return f;
    const double n = static_cast<double>(count);
    f.rmse = std::sqrt(differenceSquared / n);
    f.relativeRmse = bSquared > 0.0            ? std::sqrt(differenceSquared / bSquared)
                     : differenceSquared > 0.0 ? HUGE_VAL
                                               : 0.0;
    f.maximum = maximum;
    f.meanA = a / n;
    f.meanB = b / n;
    return f;
  }
};

/// A ramp of rising lightness for t in 0..1.
Vec3 heatColor(double t) {
  static const std::array<Vec3, 6> kRamp = {Vec3(0.0f, 0.0f, 0.02f),   Vec3(0.26f, 0.04f, 0.41f),
                                            Vec3(0.58f, 0.15f, 0.40f), Vec3(0.87f, 0.32f, 0.23f),
                                            Vec3(0.99f, 0.65f, 0.04f), Vec3(1.0f, 1.0f, 0.9f)};
  const float x = static_cast<float>(std::clamp(t, 0.0, 1.0)) * static_cast<float>(kRamp.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(x), kRamp.size() - 2);
  return glm::mix(kRamp[i], kRamp[i + 1], x - static_cast<float>(i));
}

}  // namespace

std::vector<ChannelFigures> channelFigures(const Image& image) {
  std::vector<ChannelFigures> figures;
  for (int c = 0; c < image.channels; ++c) {
    ChannelFigures f;
    f.least = std::numeric_limits<float>::max();
    f.most = std::numeric_limits<float>::lowest();
    double sum = 0.0;
    std::size_t finite = 0;
    for (std::size_t i = static_cast<std::size_t>(c); i < image.pixels.size();
         i += static_cast<std::size_t>(image.channels)) {
      const float v = image.pixels[i];
      if (std::isnan(v)) {
        ++f.notANumber;
      } else if (std::isinf(v)) {
        ++f.infinite;
      } else {
        f.least = std::min(f.least, v);
        f.most = std::max(f.most, v);
        sum += static_cast<double>(v);
        ++finite;
      }
    }
    if (finite == 0) f.least = f.most = 0.0f;
    f.mean = finite > 0 ? sum / static_cast<double>(finite) : 0.0;
    figures.push_back(f);
  }
  return figures;
}

ImageDifference compareImages(const Image& a, const Image& b, const PixelMask& mask) {
  std::vector<Sums> sums(static_cast<std::size_t>(a.channels));
  Sums all;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      if (!mask(x, y)) continue;
      for (std::size_t c = 0; c < sums.size(); ++c) {
        const double va = static_cast<double>(a.at(x, y)[c]);
        const double vb = static_cast<double>(b.at(x, y)[c]);
        sums[c].add(va, vb);
        all.add(va, vb);
      }
    }
  ImageDifference difference;
  for (const Sums& s : sums) difference.channels.push_back(s.figures());
  difference.all = all.figures();
  return difference;
}

Image heatMap(const Image& a, const Image& b, const PixelMask& mask, double full) {
  Image out(a.width, a.height, 3);
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      if (!mask(x, y)) {
        out.setRgb(x, y, Vec3(0.12f, 0.15f, 0.2f));
        continue;
      }
      double sum = 0.0;
      for (int c = 0; c < a.channels; ++c)
        sum += std::abs(static_cast<double>(a.at(x, y)[c]) - static_cast<double>(b.at(x, y)[c]));
      const double t = full > 0.0 ? sum / a.channels / full : 0.0;
      out.setRgb(x, y, std::isnan(t) ? Vec3(0, 1, 0) : heatColor(t));
    }
  return out;
}

}  // namespace lumel
