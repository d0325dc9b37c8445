#include "ssbump/maps/mip.h"

#include <algorithm>
#include <cmath>

#include "scene/base/math.h"
#include "scene/base/parallel.h"

namespace lumel::ssbump {
namespace {

/// The input texels and weights behind one output texel along one axis.
struct Taps {
  int first = 0;
  std::vector<float> weights;
};

double besselI0(double x) {
  double term = 1, sum = 1;
  for (int k = 1; k < 32; ++k) sum += term *= (x / (2 * k)) * (x / (2 * k));
  return sum;
}

double kaiserSinc(double x) {
  constexpr double kLobes = 3, kAlpha = 4;
  if (std::abs(x) >= kLobes) return 0;
  const double window = besselI0(kAlpha * std::sqrt(1 - x * x / (kLobes * kLobes))) / besselI0(kAlpha);
  const double sinc = std::abs(x) < 1e-9 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
  return window * sinc;
}

std::vector<Taps> makeTaps(int in, int out, MipFilter filter) {
  std::vector<Taps> all(static_cast<std::size_t>(out));
  const double scale = static_cast<double>(in) / out;
  for (int i = 0; i < out; ++i) {
    Taps& taps = all[static_cast<std::size_t>(i)];
    const double centre = (i + 0.5) * scale;
    const double half = filter == MipFilter::Box || scale == 1 ? scale / 2 : 3 * scale;
    taps.first = static_cast<int>(std::floor(centre - half + 1e-9));
    const int last = static_cast<int>(std::ceil(centre + half - 1e-9));
    double sum = 0;
    for (int j = taps.first; j < last; ++j) {
      const double covered = std::min(j + 1.0, centre + half) - std::max<double>(j, centre - half);
      const double w = filter == MipFilter::Box || scale == 1 ? covered : kaiserSinc((j + 0.5 - centre) / scale);
      taps.weights.push_back(static_cast<float>(w));
      sum += w;
    }
    for (float& w : taps.weights) w = static_cast<float>(static_cast<double>(w) / sum);
  }
  return all;
}

int edge(int i, int size, bool wrap) { return wrap ? wrapIndex(i, size) : std::clamp(i, 0, size - 1); }

}  // namespace

Image halve(const Image& image, MipFilter filter, bool wrap, const Progress& progress) {
  Image out(std::max(1, image.width / 2), std::max(1, image.height / 2), image.channels);
  const std::vector<Taps> across = makeTaps(image.width, out.width, filter);
  const std::vector<Taps> down = makeTaps(image.height, out.height, filter);
  const auto channels = static_cast<std::size_t>(image.channels);
  parallelFor(static_cast<std::size_t>(out.height), 8, [&](std::size_t first, std::size_t last) {
    const std::size_t rowLength = static_cast<std::size_t>(image.width) * channels;
    std::vector<float> column(rowLength);
    for (std::size_t y = first; y < last && !progress.cancelled(); ++y) {
      std::fill(column.begin(), column.end(), 0.0f);
      for (std::size_t k = 0; k < down[y].weights.size(); ++k) {
        const float* in = image.at(0, edge(down[y].first + static_cast<int>(k), image.height, wrap));
        for (std::size_t i = 0; i < rowLength; ++i) column[i] += down[y].weights[k] * in[i];
      }
      for (int x = 0; x < out.width; ++x) {
        const Taps& taps = across[static_cast<std::size_t>(x)];
        float* o = out.at(x, static_cast<int>(y));
        for (std::size_t c = 0; c < channels; ++c) {
          float sum = 0;
          for (std::size_t k = 0; k < taps.weights.size(); ++k)
            sum +=
                taps.weights[k] *
                column[static_cast<std::size_t>(edge(taps.first + static_cast<int>(k), image.width, wrap)) * channels +
                       c];
          o[c] = filter == MipFilter::Kaiser ? std::clamp(sum, 0.0f, 1.0f) : sum;
        }
      }
    }
  });
  return out;
}

std::vector<Image> mipLevels(const Image& image, MipFilter filter, bool wrap, const Progress& progress) {
  std::vector<Image> levels;
  const Image* last = &image;
  while ((last->width > 1 || last->height > 1) && !progress.cancelled()) {
    levels.push_back(halve(*last, filter, wrap, progress));
    last = &levels.back();
  }
  return levels;
}

}  // namespace lumel::ssbump
