// Speed of packing, texel finding, footprints, projection, denoising and dilation. Figures mean something on an idle
// machine only.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "lightmap/maps/denoise.h"
#include "lightmap/maps/dilate.h"
#include "lightmap/maps/projection.h"
#include "lightmap/pack/pack.h"
#include "lightmap/texels/texels.h"
#include "scene/base/parallel.h"

namespace lumel {
namespace {

PackShape rectangle(Vec2 at, Vec2 size) {
  const Vec2 b = at + Vec2(size.x, 0), c = at + size, d = at + Vec2(0, size.y);
  return {{{at, b, c}, {at, c, d}}, 0, true};
}

/// What levels are made of: few walls, many strips and fragments, some of them L-shaped. Areas fall off as a power of
/// the rank (in Sponza half of the area is in 13 of 6,000 charts). Scaled to the area asked for, in texels.
std::vector<PackShape> levelCharts(std::size_t count, double area) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::vector<PackShape> shapes;
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double chartArea = std::pow(static_cast<double>(i) + 3.0, -1.3);
    const float aspect = std::exp(2.0f * uniform(random) - 1.0f);
    const auto side = static_cast<float>(std::sqrt(chartArea));
    const Vec2 size(side * aspect, side / aspect);
    PackShape shape = rectangle(Vec2(0), size * Vec2(1, 0.5f));
    const PackShape leg = rectangle(size * Vec2(0, 0.5f), size * Vec2(i % 3 == 0 ? 0.4f : 1.0f, 0.5f));
    shape.triangles.insert(shape.triangles.end(), leg.triangles.begin(), leg.triangles.end());
    shapes.push_back(std::move(shape));
    sum += chartArea;
  }
  const auto scale = static_cast<float>(std::sqrt(area / sum));
  for (PackShape& shape : shapes)
    for (auto& triangle : shape.triangles)
      for (Vec2& p : triangle) p *= scale;
  return shapes;
}

/// A page of squares of `cell` texels, two triangles each, with a gap of two texels.
Atlas gridAtlas(int side, int cell) {
  Atlas atlas;
  atlas.pages = {{side, side}};
  atlas.charts.resize(1);
  Surface& s = atlas.surfaces.emplace_back();
  for (int y = 1; y + cell < side; y += cell + 2)
    for (int x = 1; x + cell < side; x += cell + 2) {
      const auto first = static_cast<std::uint32_t>(s.positions.size());
      for (int k = 0; k < 4; ++k) {
        const Vec2 p(static_cast<float>(x + (k % 2) * cell) + 0.2f, static_cast<float>(y + (k / 2) * cell) + 0.1f);
        s.positions.push_back(Vec3(p, 0));
        s.normals.push_back(Vec3(0, 0, 1));
        s.tangents.push_back(Vec4(1, 0, 0, 1));
        s.lightmapUvs.push_back(p / static_cast<float>(side));
      }
      for (const std::uint32_t k : {0u, 1u, 3u, 0u, 3u, 2u}) s.indices.push_back(first + k);
    }
  s.sourceTriangle.resize(s.triangleCount());
  s.charts.resize(s.triangleCount());
  return atlas;
}

void BM_PackPages(benchmark::State& state) {
  const auto shapes = levelCharts(static_cast<std::size_t>(state.range(0)), 1.5e6);
  Progress silent;
  for (auto _ : state) benchmark::DoNotOptimize(packCharts(shapes, {.pageSize = 1024, .padding = 2}, silent));
}
BENCHMARK(BM_PackPages)->Arg(100)->Arg(1000)->Arg(10000)->Arg(30000)->Unit(benchmark::kMillisecond)->UseRealTime();

/// One step of the search for a density: percent of the page as area, which fits or fails.
void BM_PackOnePage(benchmark::State& state) {
  const auto shapes = levelCharts(5000, static_cast<double>(state.range(0)) / 100 * 1024 * 1024);
  Progress silent;
  double placed = 0;
  for (auto _ : state) {
    const auto result =
        packCharts(shapes, {.pageSize = 1024, .maxPages = 1, .padding = 2, .shrinkLast = false}, silent);
    placed = result && result->placements[0].page >= 0 ? 1 : 0;
  }
  state.counters["fits"] = placed;
}
BENCHMARK(BM_PackOnePage)->Arg(40)->Arg(65)->Arg(90)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_FindTexels(benchmark::State& state) {
  const Atlas atlas = gridAtlas(1024, static_cast<int>(state.range(0)));
  std::size_t texels = 0;
  for (auto _ : state) texels = findTexels(atlas)[0].size();
  state.counters["texels"] = static_cast<double>(texels);
  state.counters["triangles"] = static_cast<double>(atlas.surfaces[0].triangleCount());
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(texels));
}
BENCHMARK(BM_FindTexels)->Arg(2)->Arg(30)->Arg(500)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Clipping alone (0 samples) and with points.
void BM_Footprints(benchmark::State& state) {
  const Atlas atlas = gridAtlas(256, 30);
  const PageTexels page = findTexels(atlas)[0];
  TexelFootprint footprint;
  for (auto _ : state)
    for (std::size_t i = 0; i < page.size(); ++i) {
      benchmark::DoNotOptimize(footprint.clip(atlas, page, i));
      for (int k = 0; k < state.range(0); ++k)
        benchmark::DoNotOptimize(footprint.sample(Vec2(0.1f * static_cast<float>(k), 0.6f)));
    }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(page.size()));
}
BENCHMARK(BM_Footprints)->Arg(0)->Arg(8)->Unit(benchmark::kMillisecond);

void BM_Kernels(benchmark::State& state) {
  const RnmKernels kernels(static_cast<Projection>(state.range(0)));
  std::vector<Vec3> directions;
  for (int i = 0; i < 4096; ++i) {
    const float z = (static_cast<float>(i) + 0.5f) / 4096, phi = 2.399963f * static_cast<float>(i);
    directions.push_back(Vec3(std::sqrt(1 - z * z) * Vec2(std::cos(phi), std::sin(phi)), z));
  }
  for (auto _ : state)
    for (const Vec3& w : directions) benchmark::DoNotOptimize(kernels(w));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(directions.size()));
}
BENCHMARK(BM_Kernels)->Arg(static_cast<int>(Projection::Raw))->Arg(static_cast<int>(Projection::Fit));

void BM_Dilate(benchmark::State& state) {
  const int side = 1024;
  TexelMask mask{side, side, std::vector<std::uint8_t>(std::size_t{side} * side, 0)};
  for (std::size_t i = 0; i < mask.known.size(); ++i) mask.known[i] = i % side % 32 < 24 && i / side % 32 < 24;
  for (auto _ : state) {
    Image image(side, side, 3, 0.5f);
    TexelMask known = mask;
    dilate(image, known, static_cast<int>(state.range(0)));
    benchmark::DoNotOptimize(image.pixels.data());
  }
}
BENCHMARK(BM_Dilate)->Arg(4)->Unit(benchmark::kMillisecond)->UseRealTime();

/// A page of 1024 x 1024, nine tenths of it in charts of 96 x 96, under noise: as a preview leaves it.
void BM_Denoise(benchmark::State& state) {
  const int side = 1024;
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  std::mt19937 random(3);
  std::normal_distribution<float> noise(1.0f, 0.05f);
  Image map(side, side, 3);
  for (float& v : map.pixels) v = noise(random);
  std::vector<std::uint32_t> charts(std::size_t{side} * side, 0);
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const std::size_t x = i % side, y = i / side;
    if (x % 101 < 96 && y % 101 < 96) charts[i] = static_cast<std::uint32_t>(1 + x / 101 + y / 101 * 11);
  }
  const std::vector<CoarseNormal> normals(charts.size(), CoarseNormal{0, 0, 127});
  constexpr std::size_t kMaps = 4;
  for (auto _ : state) {
    Image flat = map;
    std::array<Image, 3> rnm = {map, map, map};
    std::vector<float> errors(kMaps * charts.size(), 0.05f);
    std::array<ErrorPlane, kMaps> planes;
    for (std::size_t i = 0; i < kMaps; ++i) planes[i] = {errors.data() + i, kMaps};
    denoise(flat, rnm, charts, normals, planes);
    benchmark::DoNotOptimize(flat.pixels.data());
  }
}
BENCHMARK(BM_Denoise)->Arg(1)->Arg(2)->Arg(4)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace lumel
