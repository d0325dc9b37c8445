#include "baker/light/environment_light.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "baker/rays/sampling.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

/// 1 - cos of an angle, without cancellation near the zenith, where suns are.
double versine(double angle) {
  const double s = std::sin(0.5 * angle);
  return 2.0 * s * s;
}

/// Returns how many cells stand for so many pixels.
std::size_t cellsFor(int pixels, std::size_t fewest, std::size_t most) {
  const auto n = static_cast<std::size_t>(pixels);
  if (n < fewest) return n * ((fewest + n - 1) / n);
  const std::size_t joined = (n + most - 1) / most;
  return (n + joined - 1) / joined;
}

/// The weights of one cell along one axis: its mean is a weighted sum of pixels, from `first` on, which may lie beyond
/// the image.
struct CellWeights {
  std::int64_t first = 0;
  std::vector<double> weights;
};

/// Integrates the linear interpolant of `pixels` over `cells` equal intervals, weighed by `measure` of the place
/// (0..1) and scaled to add up to one. Simpson's rule from bend to bend: exact to the 3rd order.
template <class Measure>
std::vector<CellWeights> weightsAlong(int pixels, std::size_t cells, Measure measure) {
  std::vector<CellWeights> all(cells);
  const double perCell = static_cast<double>(pixels) / static_cast<double>(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    const double begin = perCell * static_cast<double>(i) - 0.5, end = begin + perCell;
    CellWeights& cell = all[i];
    cell.first = static_cast<std::int64_t>(std::floor(begin));
    cell.weights.assign(static_cast<std::size_t>(std::ceil(end)) - static_cast<std::size_t>(cell.first) + 1, 0.0);
    double sum = 0.0;
    for (std::int64_t left = cell.first; static_cast<double>(left) < end; ++left) {
      const double from = std::max(begin, static_cast<double>(left)), to = std::min(end, static_cast<double>(left + 1));
      for (int k = 0; k < 3; ++k) {
        const double at = from + 0.5 * k * (to - from);
        const double weight = (k == 1 ? 4.0 : 1.0) * (to - from) * measure((at + 0.5) / pixels);
        const auto pixel = static_cast<std::size_t>(left - cell.first);
        cell.weights[pixel] += weight * (1.0 - (at - static_cast<double>(left)));
        cell.weights[pixel + 1] += weight * (at - static_cast<double>(left));
        sum += weight;
      }
    }
    for (double& w : cell.weights) w /= sum;
  }
  return all;
}

std::size_t rowsFor(const Image& image) {
  return cellsFor(image.height, EnvironmentLight::kFewestColumns / 2, EnvironmentLight::kMostColumns / 2);
}

std::size_t columnsFor(const Image& image) {
  return cellsFor(image.width, EnvironmentLight::kFewestColumns, EnvironmentLight::kMostColumns);
}

}  // namespace

std::size_t EnvironmentLight::cellCount(const Image& image) {
  return image.empty() ? 1 : rowsFor(image) * columnsFor(image);
}

EnvironmentLight::EnvironmentLight(const Environment& environment) {
  if (environment.isBlack()) return;
  if (environment.image.empty()) {
    cells_.push_back({environment.strength * environment.color, 0.0f});
    return;
  }
  std::vector<float> luminances = addCells(environment);
  splitOffSun(luminances);
  addSky(luminances);
}

/// Fills cells_ except for the densities. Returns the cells' luminances.
std::vector<float> EnvironmentLight::addCells(const Environment& environment) {
  const Image& image = environment.image;
  const std::size_t rows = rowsFor(image);
  const std::size_t columns = columnsFor(image);
  const double angle = static_cast<double>(environment.rotationDegrees) * (static_cast<double>(kPi) / 180.0);
  grid_ = {static_cast<int>(rows), static_cast<int>(columns), static_cast<float>(std::cos(angle)),
           static_cast<float>(std::sin(angle))};
  constexpr double kHalfTurn = static_cast<double>(kPi);
  for (std::size_t row = 0; row <= rows; ++row)
    versines_.push_back(static_cast<float>(versine(kHalfTurn * static_cast<double>(row) / static_cast<double>(rows))));
  const auto byRow = weightsAlong(image.height, rows, [&](double place) { return std::sin(kHalfTurn * place); });
  const auto byColumn = weightsAlong(image.width, columns, [](double) { return 1.0; });
  cells_.resize(rows * columns);
  std::vector<float> luminances(cells_.size());
  parallelFor(rows, 8, [&](std::size_t first, std::size_t last) {
    std::vector<Vec3d> line(static_cast<std::size_t>(image.width));
    for (std::size_t row = first; row < last; ++row) {
      std::fill(line.begin(), line.end(), Vec3d(0.0));
      for (std::size_t k = 0; k < byRow[row].weights.size(); ++k) {
        const std::int64_t y = byRow[row].first + static_cast<std::int64_t>(k);
        const int clamped = static_cast<int>(std::clamp<std::int64_t>(y, 0, image.height - 1));
        for (int x = 0; x < image.width; ++x)
          line[static_cast<std::size_t>(x)] += byRow[row].weights[k] * Vec3d(image.rgb(x, clamped));
      }
      for (std::size_t column = 0; column < columns; ++column) {
        Vec3d sum(0.0);
        for (std::size_t k = 0; k < byColumn[column].weights.size(); ++k) {
          const std::int64_t x = byColumn[column].first + static_cast<std::int64_t>(k) + image.width;
          sum += byColumn[column].weights[k] * line[static_cast<std::size_t>(x % image.width)];
        }
        const std::size_t cell = row * columns + column;
        cells_[cell].radiance = environment.strength * Vec3(sum);
        luminances[cell] = luminance(cells_[cell].radiance);
      }
    }
  });
  return luminances;
}

float EnvironmentLight::solidAngle(std::size_t cell) const {
  const std::size_t row = cell / static_cast<std::size_t>(grid_.columns);
  const double middle = static_cast<double>(kPi) * (static_cast<double>(row) + 0.5) / grid_.rows;
  const double height = 2.0 * std::sin(middle) * std::sin(0.5 * static_cast<double>(kPi) / grid_.rows);
  return static_cast<float>(2.0 * static_cast<double>(kPi) / grid_.columns * height);
}

/// Moves the bright part's cells from `luminances` to the sun, if they are one.
void EnvironmentLight::splitOffSun(std::vector<float>& luminances) {
  const auto fluxOf = [&](std::size_t cell) {
    return static_cast<double>(luminances[cell]) * static_cast<double>(solidAngle(cell));
  };
  const double sphere = 4.0 * static_cast<double>(kPi);
  double total = 0.0;
  for (std::size_t cell = 0; cell < luminances.size(); ++cell) total += fluxOf(cell);
  const auto threshold = static_cast<float>(static_cast<double>(kSunContrast) * total / sphere);
  std::vector<std::int32_t> bright;
  std::vector<float> fluxes;
  double flux = 0.0;
  double brightSphere = 0.0;
  for (std::size_t cell = 0; cell < luminances.size(); ++cell) {
    if (!(luminances[cell] > threshold)) continue;
    bright.push_back(static_cast<std::int32_t>(cell));
    fluxes.push_back(static_cast<float>(fluxOf(cell)));
    flux += fluxOf(cell);
    brightSphere += static_cast<double>(solidAngle(cell));
  }
  if (!(flux >= kLeastSunShare * total) || brightSphere > kMostSunSphere * sphere) return;
  sun_ = Distribution(fluxes);
  if (sun_.empty()) return;
  sunCells_ = std::move(bright);
  for (std::size_t i = 0; i < sunCells_.size(); ++i) {
    const auto cell = static_cast<std::size_t>(sunCells_[i]);
    luminances[cell] = 0.0f;
    cells_[cell].pdf = sun_.probability(i) / solidAngle(cell);
  }
}

/// Makes the table of the cells that are left.
void EnvironmentLight::addSky(const std::vector<float>& luminances) {
  const auto rows = static_cast<std::size_t>(grid_.rows), columns = static_cast<std::size_t>(grid_.columns);
  columns_ = DistributionRows(luminances, rows);
  std::vector<float> rowWeights(rows);
  for (std::size_t row = 0; row < rows; ++row)
    rowWeights[row] = static_cast<float>(columns_.total(row)) * solidAngle(row * columns);
  rows_ = Distribution(rowWeights);
  if (rows_.empty()) return;
  for (std::size_t cell = 0; cell < cells_.size(); ++cell) {
    const std::size_t row = cell / columns;
    if (!columns_.empty(row) && luminances[cell] > 0.0f)
      cells_[cell].pdf = rows_.probability(row) * columns_.probability(cell % columns, row) / solidAngle(cell);
  }
}

[[gnu::always_inline]] inline std::int32_t EnvironmentLight::cellAt(const Grid& grid, const Vec3& dirWorld) {
  const float x = grid.cosRotation * dirWorld.x - grid.sinRotation * dirWorld.z;
  const float z = grid.cosRotation * dirWorld.z + grid.sinRotation * dirWorld.x;
  const float polar = angleAbove(std::sqrt(x * x + z * z), dirWorld.y);
  const float azimuth = angleAbove(std::abs(z), x);
  const float turn = 0.5f + pick(z < 0.0f, -azimuth, azimuth) * (0.5f * kInvPi);
  const auto rows = static_cast<float>(grid.rows), columns = static_cast<float>(grid.columns);
  const int row = static_cast<int>(within(polar * kInvPi * rows, 0.0f, rows - 1.0f));
  const int column = static_cast<int>(within(turn * columns, 0.0f, columns - 1.0f));
  return row * grid.columns + column;
}

LUMEL_FOR_EACH_CPU void EnvironmentLight::findCells(const Grid& grid, const Vec3Lanes& dirWorld, LaneFlags& cells) {
  const Grid same = grid;
  for (std::size_t lane = 0; lane < kLanes; ++lane) cells[lane] = cellAt(same, dirWorld[lane]);
}

LUMEL_FOR_EACH_CPU void EnvironmentLight::weighAgainst(const float* pdf, const float* gathered, Vec3Lanes& light) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const float share = misWeight(gathered[lane], pdf[lane]);
    light.x[lane] *= share;
    light.y[lane] *= share;
    light.z[lane] *= share;
  }
}

void EnvironmentLight::arriving(const Vec3Lanes& dirWorld, const float* gathered, Vec3Lanes& light) const {
  LaneFlags at{};
  if (cells_.size() > 1) findCells(grid_, dirWorld, at);
  alignas(64) float pdf[kLanes];
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Cell cell = cells_[static_cast<std::size_t>(at[lane])];
    light.set(lane, cell.radiance);
    pdf[lane] = cell.pdf;
  }
  weighAgainst(pdf, gathered, light);
}

Vec3 EnvironmentLight::arriving(const Vec3& dirWorld, float gathered) const {
  const Cell& cell = cellTowards(dirWorld);
  return cell.radiance * misWeight(gathered, cell.pdf);
}

Vec3 EnvironmentLight::radiance(const Vec3& dirWorld) const { return cellTowards(dirWorld).radiance; }

float EnvironmentLight::pdf(const Vec3& dirWorld) const { return shines() ? cellTowards(dirWorld).pdf : 0.0f; }

/// Aims at the chosen places, uniformly by solid angle within the cells: cos of the polar angle is uniform between a
/// cell's borders.
LUMEL_FOR_EACH_CPU void EnvironmentLight::aim(const Grid& grid, const float* versines, const Places& places,
                                              LightSampleLanes& samples) {
  const float cosRotation = grid.cosRotation, sinRotation = grid.sinRotation;
  const float perColumn = 1.0f / static_cast<float>(grid.columns);
  alignas(64) float uppers[kLanes], heights[kLanes];
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const float* border = versines + places.row[lane];
    uppers[lane] = border[0];
    heights[lane] = border[1] - border[0];
  }
#pragma GCC ivdep
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const float depth = uppers[lane] + places.y[lane] * heights[lane];
    const float r2 = depth * (2.0f - depth);
    const float r = std::sqrt(r2 > 0.0f ? r2 : 0.0f);
    const float turn = (static_cast<float>(places.column[lane]) + places.x[lane]) * perColumn;
    // The image's middle is +x, so its left border is half a turn from there.
    const Vec2 around = onUnitCircle(turn);
    const float x = -r * around.x, z = -r * around.y;
    // The sky turns counter-clockwise seen from above, which is from +x towards -z.
    samples.wi.x[lane] = cosRotation * x + sinRotation * z;
    samples.wi.y[lane] = 1.0f - depth;
    samples.wi.z[lane] = cosRotation * z - sinRotation * x;
    samples.distant[lane] = 1;
  }
}

/// Divides radiances by densities, which makes them weights.
LUMEL_FOR_EACH_CPU void EnvironmentLight::weigh(LightSampleLanes& samples) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    samples.weight.x[lane] /= samples.pdf[lane];
    samples.weight.y[lane] /= samples.pdf[lane];
    samples.weight.z[lane] /= samples.pdf[lane];
  }
}

void EnvironmentLight::take(const Places& places, LightSampleLanes& samples) const {
  aim(grid_, versines_.data(), places, samples);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const Cell cell = cells_[static_cast<std::size_t>(places.cell[lane])];
    samples.weight.set(lane, cell.radiance);
    samples.pdf[lane] = cell.pdf;
  }
  weigh(samples);
}

void EnvironmentLight::sampleSun(const UnitSquareLanes& u, LightSampleLanes& samples) const {
  Distribution::Lanes chosen;
  sun_.choose(u.x, chosen);
  Places places;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    places.cell[lane] = sunCells_[static_cast<std::size_t>(chosen.index[lane])];
    places.row[lane] = places.cell[lane] / grid_.columns;
    places.column[lane] = places.cell[lane] % grid_.columns;
    places.x[lane] = chosen.rest[lane];
    places.y[lane] = u.y[lane];
  }
  take(places, samples);
}

EnvironmentLight::Places EnvironmentLight::findSky(const UnitSquareLanes& u) const {
  Distribution::Lanes row, column;
  rows_.choose(u.y, row);
  Places places;
  std::copy(std::begin(row.index), std::end(row.index), places.row.begin());
  columns_.choose(u.x, places.row, column);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    places.column[lane] = column.index[lane];
    places.cell[lane] = places.row[lane] * grid_.columns + places.column[lane];
    __builtin_prefetch(&cells_[static_cast<std::size_t>(places.cell[lane])]);
    places.x[lane] = column.rest[lane];
    places.y[lane] = row.rest[lane];
  }
  return places;
}

}  // namespace lumel
