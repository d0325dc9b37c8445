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
  width_ = static_cast<std::size_t>(image.width);
  height_ = static_cast<std::size_t>(image.height);
  const float angle = environment.rotationDegrees * (kPi / 180.0f);
  cosRotation_ = std::cos(angle);
  sinRotation_ = std::sin(angle);
  std::vector<float> luminances(width_ * height_);
  parallelFor(height_, 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t y = first; y < last; ++y)
      for (std::size_t x = 0; x < width_; ++x)
        luminances[y * width_ + x] = meanLuminance(image, static_cast<int>(x), static_cast<int>(y));
  });
  splitOffSun(luminances);
  std::vector<float> rowWeights(height_);
  columns_.resize(height_);
  parallelFor(height_, 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t y = first; y < last; ++y) {
      columns_[y] = Distribution(std::span(luminances).subspan(y * width_, width_));
      rowWeights[y] = static_cast<float>(columns_[y].total()) * cellSolidAngle(y, height_, width_);
    }
  });
  rows_ = Distribution(rowWeights);
}

/// Moves the bright part's cells from `luminances` to the sun, if they are one.
void EnvironmentLight::splitOffSun(std::vector<float>& luminances) {
  const auto fluxOf = [&](std::size_t cell) {
    return static_cast<double>(luminances[cell]) * static_cast<double>(cellSolidAngle(cell / width_, height_, width_));
  };
  const double sphere = 4.0 * static_cast<double>(kPi);
  double total = 0.0;
  for (std::size_t cell = 0; cell < luminances.size(); ++cell) total += fluxOf(cell);
  const auto threshold = static_cast<float>(static_cast<double>(kSunContrast) * total / sphere);
  std::vector<std::size_t> bright;
  std::vector<float> fluxes;
  double flux = 0.0;
  double solidAngle = 0.0;
  for (std::size_t cell = 0; cell < luminances.size(); ++cell) {
    if (!(luminances[cell] > threshold)) continue;
    bright.push_back(cell);
    fluxes.push_back(static_cast<float>(fluxOf(cell)));
    flux += fluxOf(cell);
    solidAngle += static_cast<double>(cellSolidAngle(cell / width_, height_, width_));
  }
  if (!(flux >= kLeastSunShare * total) || solidAngle > kMostSunSphere * sphere) return;
  sun_ = Distribution(fluxes);
  if (sun_.empty()) return;
  sunCells_ = std::move(bright);
  for (const std::size_t cell : sunCells_) luminances[cell] = 0.0f;
}

Vec3 EnvironmentLight::radiance(const Vec3& dirWorld) const { return environmentRadiance(*environment_, dirWorld); }

LightSample EnvironmentLight::sampleSun(Vec2 u) const {
  const std::size_t chosen = sun_.choose(u.x);
  return sampleCell({sunCells_[chosen] / width_, sunCells_[chosen] % width_}, {sun_.rest(u.x, chosen), u.y},
                    sun_.probability(chosen));
}

LightSample EnvironmentLight::sampleSky(Vec2 u) const {
  const std::size_t row = rows_.choose(u.y);
  const Distribution& columns = columns_[row];
  const std::size_t column = columns.choose(u.x);
  return sampleCell({row, column}, {columns.rest(u.x, column), rows_.rest(u.y, row)},
                    rows_.probability(row) * columns.probability(column));
}

/// Uniform by solid angle within the cell: cos of the polar angle is uniform between the cell's borders.
LightSample EnvironmentLight::sampleCell(const Cell& cell, Vec2 within, float probability) const {
  const float upper = versine(cell.row, height_);
  const float depth = upper + within.y * (versine(cell.row + 1, height_) - upper);
  const float r = std::sqrt(std::max(0.0f, depth * (2.0f - depth)));
  const float turn = (static_cast<float>(cell.column) + within.x) / static_cast<float>(width_);
  const float azimuth = 2.0f * kPi * (turn - 0.5f);
  const float x = r * std::cos(azimuth);
  const float z = r * std::sin(azimuth);
  LightSample sample;
  sample.distant = true;
  // The sky turns counter-clockwise seen from above, which is from +x towards -z.
  sample.wi = {cosRotation_ * x + sinRotation_ * z, 1.0f - depth, cosRotation_ * z - sinRotation_ * x};
  sample.pdf = probability / cellSolidAngle(cell.row, height_, width_);
  sample.weight = radiance(sample.wi) / sample.pdf;
  return sample;
}

EnvironmentLight::Cell EnvironmentLight::cellAt(const Vec3& dirWorld) const {
  const float x = cosRotation_ * dirWorld.x - sinRotation_ * dirWorld.z;
  const float z = cosRotation_ * dirWorld.z + sinRotation_ * dirWorld.x;
  const float polar = std::atan2(std::sqrt(x * x + z * z), dirWorld.y);
  const auto rows = static_cast<float>(height_);
  const auto columns = static_cast<float>(width_);
  const float turn = 0.5f + std::atan2(z, x) * (0.5f * kInvPi);
  return {static_cast<std::size_t>(std::clamp(polar * kInvPi * rows, 0.0f, rows - 1.0f)),
          static_cast<std::size_t>(std::clamp(turn * columns, 0.0f, columns - 1.0f))};
}

float EnvironmentLight::pdf(const Vec3& dirWorld) const {
  if (!sampled()) return 0.0f;
  const Cell cell = cellAt(dirWorld);
  const float solidAngle = cellSolidAngle(cell.row, height_, width_);
  if (sunSampled()) {
    const auto found = std::lower_bound(sunCells_.begin(), sunCells_.end(), numberOf(cell));
    if (found != sunCells_.end() && *found == numberOf(cell))
      return sun_.probability(static_cast<std::size_t>(found - sunCells_.begin())) / solidAngle;
  }
  if (!skySampled() || columns_[cell.row].empty()) return 0.0f;
  return rows_.probability(cell.row) * columns_[cell.row].probability(cell.column) / solidAngle;
}

}  // namespace lumel
