#include "baker/study/study_maps.h"

#include <algorithm>
#include <cmath>

namespace lumel {

StudyMask validTexels(const std::vector<BakedPage>& pages) {
  constexpr float kLeastValidity = 0.99f;
  StudyMask mask;
  for (const BakedPage& page : pages) {
    std::vector<std::uint8_t>& m = mask.emplace_back();
    for (std::size_t i = 0; i < page.aux.pixels.size(); i += 4)
      m.push_back(page.aux.pixels[i] > 0.0f && page.aux.pixels[i + 1] >= kLeastValidity);
  }
  return mask;
}

StudyMaps mapsOf(const std::vector<BakedPage>& pages, const StudyMask& mask) {
  StudyMaps maps;
  if (!pages.empty()) maps.maps.resize(pages[0].maps.size());
  maps.mapErrors.resize(maps.maps.size());
  for (std::size_t p = 0; p < pages.size(); ++p)
    for (std::size_t i = 0; i < mask[p].size(); ++i) {
      if (!mask[p][i]) continue;
      const auto pixel = [i](const Image& image) {
        return Vec3(image.pixels[3 * i], image.pixels[3 * i + 1], image.pixels[3 * i + 2]);
      };
      maps.flat.push_back(pixel(pages[p].flat));
      for (std::size_t k = 0; k < maps.maps.size(); ++k) {
        maps.maps[k].push_back(pixel(pages[p].maps[k]));
        maps.mapErrors[k].push_back(pages[p].mapErrors.pixels[i * maps.maps.size() + k]);
      }
      maps.standardError.push_back(pages[p].aux.pixels[4 * i + 2]);
    }
  return maps;
}

double meanOf(const std::vector<Vec3>& map) {
  double sum = 0.0;
  for (const Vec3& v : map) sum += static_cast<double>(v.x) + static_cast<double>(v.y) + static_cast<double>(v.z);
  return map.empty() ? 0.0 : sum / (3.0 * static_cast<double>(map.size()));
}

MapDifference differenceOf(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  MapDifference d;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const double e = static_cast<double>(a[i][c]) - static_cast<double>(b[i][c]);
      d.square += e * e;
      d.mean += e;
    }
  const double count = 3.0 * static_cast<double>(std::max<std::size_t>(1, a.size()));
  return {d.square / count, d.mean / count};
}

void WithinInterval::operator+=(const WithinInterval& other) {
  lit += other.lit;
  within += other.within;
  claimed += other.claimed;
}

WithinInterval withinInterval(const std::vector<Vec3>& map, const std::vector<float>& errors,
                              const std::vector<Vec3>& truth, const std::vector<float>& truthErrors, double least) {
  WithinInterval figures;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto error = static_cast<double>(errors[i]);
    if (!std::isfinite(error)) continue;
    figures.claimed += error * error;
    const auto expected = static_cast<double>(luminance(truth[i]));
    if (!(expected > least)) continue;
    ++figures.lit;
    figures.within += std::abs(static_cast<double>(luminance(map[i])) - expected) <=
                      1.96 * std::hypot(error, static_cast<double>(truthErrors[i]));
  }
  return figures;
}

}  // namespace lumel
