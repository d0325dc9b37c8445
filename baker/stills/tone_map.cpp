#include "baker/stills/tone_map.h"

#include <algorithm>
#include <vector>

#include "scene/images/image_io.h"

namespace lumel {
namespace {

/// Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
float acesFit(float x) { return std::clamp((x * (2.51f * x + 0.03f)) / (x * (2.43f * x + 0.59f) + 0.14f), 0.0f, 1.0f); }

}  // namespace

float autoExposure(const Image& radiance, const Image& lit) {
  constexpr double kMiddleGrey = 0.16;
  // The brightest part (all but the top two percent) stays within what the curve still separates.
  constexpr double kHighlight = 2.5;
  constexpr double kHighlightShare = 0.98;
  std::vector<float> values;
  for (int y = 0; y < radiance.height; ++y)
    for (int x = 0; x < radiance.width; ++x)
      if (lit.at(x, y)[0] > 0.5f && luminance(radiance.rgb(x, y)) > 0.0f)
        values.push_back(luminance(radiance.rgb(x, y)));
  if (values.empty()) return 0.0f;
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return static_cast<double>(values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))]);
  };
  // Shadows near black say nothing of the exposure: they count as a thousandth of the highlights.
  const double floor = at(kHighlightShare) * 1e-3;
  double logSum = 0.0;
  for (float v : values) logSum += std::log(std::max(static_cast<double>(v), floor));
  const double mean = std::exp(logSum / static_cast<double>(values.size()));
  return static_cast<float>(std::log2(std::min(kMiddleGrey / mean, kHighlight / at(kHighlightShare))));
}

Image toneMap(const Image& radiance, float exposure, ToneMap curve) {
  Image out(radiance.width, radiance.height, radiance.channels);
  const float scale = std::exp2(exposure);
  for (std::size_t i = 0; i < radiance.pixels.size(); ++i) {
    const float value = std::max(0.0f, radiance.pixels[i] * scale);
    out.pixels[i] = linearToSrgb(curve == ToneMap::Aces ? acesFit(value) : std::min(value, 1.0f));
  }
  return out;
}

}  // namespace lumel
