// The named points on the curve of error against samples.
#pragma once

#include <array>

namespace lumel {

/// Samples per texel of the gather. What error they give: README, from `lumel study`.
enum class Quality { Draft, Preview, Production };
inline constexpr std::array<int, 3> kQualitySamples = {16, 64, 256};
inline constexpr std::array<const char*, 3> kQualityNames = {"draft", "preview", "production"};

inline int samplesOf(Quality quality) { return kQualitySamples[static_cast<std::size_t>(quality)]; }

/// Name of a quality with so many samples; "" where there is none.
inline const char* qualityOf(int samples) {
  for (std::size_t i = 0; i < kQualitySamples.size(); ++i)
    if (kQualitySamples[i] == samples) return kQualityNames[i];
  return "";
}

}  // namespace lumel
