#include "baker/environment_light.h"

#include <algorithm>

#include "scene/environment.h"
#include "scene/parallel.h"

namespace lumel {
namespace {

/// 1 - cos of the polar angle (from +y) of a row's upper border, without cancellation near the zenith, where suns are.
float versine(std::size_t row, std::size_t rows) {
  const float s = std::sin(0.5f * kPi * static_cast<float>(row) / static_cast<float>(rows));
  return 2.0f * s * s;
}

float cellSolidAngle(std::size_t row, std::size_t rows, std::size_t columns) {
  const float middle = kPi * (static_cast<float>(row) + 0.5f) / static_cast<float>(rows);
  const float versineStep = 2.0f * std::sin(middle) * std::sin(0.5f * kPi / static_cast<float>(rows));
  return 2.0f * kPi / static_cast<float>(columns) * versineStep;
}

/// Mean over pixel (x, y) of the bilinear interpolant of the image's luminance: weights 1/8, 3/4, 1/8 on each axis.
/// What a neighbour bleeds into a dark pixel counts, so no part of the sky that shines has a density of zero.
float meanLuminance(const Image& image, int x, int y) {
  constexpr float kWeights[3] = {0.125f, 0.75f, 0.125f};
  float sum = 0.0f;
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i) {
      const int column = (x + i + image.width) % image.width;
      const int row = std::clamp(y + j, 0, image.height - 1);
      sum += kWeights[i + 1] * kWeights[j + 1] * luminance(image.rgb(column, row));
    }
  return sum;
}

}  // namespace

EnvironmentLight::EnvironmentLight(const Environment& environment) {
  if (environment.isBlack()) return;
  environment_ = &environment;
  if (environment.image.empty()) return;
  const Image& image = environment.image;
  const auto rows = static_cast<std::size_t>(image.height);
  std::vector<float> rowWeights(rows);
  const auto columns = static_cast<std::size_t>(image.width);
  columns_.resize(rows);
  parallelFor(rows, 16, [&](std::size_t first, std::size_t last) {
    std::vector<float> weights(columns);
    for (std::size_t y = first; y < last; ++y) {
      for (std::size_t x = 0; x < columns; ++x)
        weights[x] = meanLuminance(image, static_cast<int>(x), static_cast<int>(y));
      columns_[y] = Distribution(weights);
      rowWeights[y] = static_cast<float>(columns_[y].total()) * cellSolidAngle(y, rows, columns);
    }
  });
  rows_ = Distribution(rowWeights);
  const float angle = environment.rotationDegrees * (kPi / 180.0f);
  cosRotation_ = std::cos(angle);
  sinRotation_ = std::sin(angle);
}

Vec3 EnvironmentLight::radiance(const Vec3& dirWorld) const { return environmentRadiance(*environment_, dirWorld); }

LightSample EnvironmentLight::sample(Vec2 u) const {
  const std::size_t row = rows_.choose(u.y);
  const Distribution& columns = columns_[row];
  const std::size_t column = columns.choose(u.x);
  // Uniform by solid angle within the cell: cos of the polar angle is uniform between the cell's borders.
  const float upper = versine(row, rows_.size());
  const float depth = upper + rows_.rest(u.y, row) * (versine(row + 1, rows_.size()) - upper);
  const float r = std::sqrt(std::max(0.0f, depth * (2.0f - depth)));
  const float turn = (static_cast<float>(column) + columns.rest(u.x, column)) / static_cast<float>(columns.size());
  const float azimuth = 2.0f * kPi * (turn - 0.5f);
  const float x = r * std::cos(azimuth);
  const float z = r * std::sin(azimuth);
  LightSample sample;
  sample.distant = true;
  // The sky turns counter-clockwise seen from above, which is from +x towards -z.
  sample.wi = {cosRotation_ * x + sinRotation_ * z, 1.0f - depth, cosRotation_ * z - sinRotation_ * x};
  sample.pdf = rows_.probability(row) * columns.probability(column) / cellSolidAngle(row, rows_.size(), columns.size());
  sample.weight = radiance(sample.wi) / sample.pdf;
  return sample;
}

float EnvironmentLight::pdf(const Vec3& dirWorld) const {
  if (!sampled()) return 0.0f;
  const float x = cosRotation_ * dirWorld.x - sinRotation_ * dirWorld.z;
  const float z = cosRotation_ * dirWorld.z + sinRotation_ * dirWorld.x;
  const float polar = std::atan2(std::sqrt(x * x + z * z), dirWorld.y);
  const auto rows = static_cast<float>(rows_.size());
  const auto row = static_cast<std::size_t>(std::clamp(polar * kInvPi * rows, 0.0f, rows - 1.0f));
  const Distribution& columns = columns_[row];
  if (columns.empty()) return 0.0f;
  const auto width = static_cast<float>(columns.size());
  const float turn = 0.5f + std::atan2(z, x) * (0.5f * kInvPi);
  const auto column = static_cast<std::size_t>(std::clamp(turn * width, 0.0f, width - 1.0f));
  return rows_.probability(row) * columns.probability(column) / cellSolidAngle(row, rows_.size(), columns.size());
}

}  // namespace lumel
