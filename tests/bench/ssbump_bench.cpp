// The goals of ssbump, measured: horizons against random rays, error and time, scaling in texels, azimuths and threads.
// Errors are absolute RMSE of the three visibilities against 16384 stratified rays at 1024 texels.
//   lumel_bench_ssbump                          everything
//   lumel_bench_ssbump --benchmark_filter=smoke the smoke pass of ctest
#include <benchmark/benchmark.h>

#include <time.h>

#include <map>
#include <numeric>

#include "scene/base/parallel.h"
#include "ssbump/occlusion/horizon.h"
#include "ssbump/occlusion/ray_occlusion.h"
#include "tests/ssbump/fields.h"

namespace lumel::ssbump {
namespace {

enum Field : int { Fractal, Brick, Step };
constexpr int kSide = 512, kTruthRays = 16384;

const HeightField& field(int kind, int amplitude, int side = kSide) {
  static std::map<std::tuple<int, int, int>, HeightField> made;
  auto& f = made[{kind, amplitude, side}];
  const auto a = static_cast<float>(amplitude);
  if (f.texels.empty())
    f = kind == Fractal ? fields::fractal(side, side, a)
        : kind == Brick ? fields::bricks(side, side, a)
                        : fields::steps(side, side, a);
  return f;
}

using Texels = std::vector<std::pair<int, int>>;

Texels probes(int side, int every) {
  Texels texels;
  for (int y = 0; y < side; y += every)
    for (int x = 0; x < side; x += every) {
      const auto jitter = [&](std::uint32_t k) {
        return static_cast<int>(fields::hashUnit(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), k) *
                                static_cast<float>(every));
      };
      texels.emplace_back(x + jitter(1), y + jitter(2));
    }
  return texels;
}

const std::vector<float>& truth(int kind, int amplitude) {
  static std::map<std::pair<int, int>, std::vector<float>> known;
  auto& t = known[{kind, amplitude}];
  if (!t.empty()) return t;
  auto rays =
      RayOcclusion::build(field(kind, amplitude),
                          {.count = kTruthRays, .sampling = RaySampling::Stratified, .seed = 99, .reach = 4 * kSide});
  t = rays->occlusionAt(probes(kSide, 16), rnmLobes());
  return t;
}

double rmse(const std::vector<float>& values, const std::vector<float>& reference) {
  double sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    sum += std::pow(static_cast<double>(values[i]) - static_cast<double>(reference[i]), 2);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double mean(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

void describe(benchmark::State& state, int kind, int amplitude) {
  state.SetLabel(std::string(kind == Fractal ? "fractal"
                             : kind == Brick ? "brick"
                                             : "step") +
                 " amplitude " + std::to_string(amplitude));
}

/// 512x512, one thread: time of the whole map and its error. Arguments: field, amplitude, azimuths.
void horizons(benchmark::State& state) {
  const int kind = static_cast<int>(state.range(0)), amplitude = static_cast<int>(state.range(1));
  const HeightField& f = field(kind, amplitude);
  const std::vector<float>& reference = truth(kind, amplitude);
  const ThreadLimit one(1);
  const auto lobes = rnmLobes();
  Image o;
  for (auto _ : state)
    o = Horizon(f, {.azimuths = static_cast<int>(state.range(2))}).occlusion({0, 0, kSide, kSide}, lobes);
  std::vector<float> at;
  for (const auto& [x, y] : probes(kSide, 16)) at.insert(at.end(), o.at(x, y), o.at(x, y) + 3);
  state.counters["rmse"] = rmse(at, reference);
  state.counters["mean"] = mean(reference);
  describe(state, kind, amplitude);
}

/// 512x512, one thread, 300 rays per texel; every 16th row of the map (its time times 16 is that of the whole), the
/// error at the same texels as above. Arguments: field, amplitude, sampling.
void rays300(benchmark::State& state) {
  const int kind = static_cast<int>(state.range(0)), amplitude = static_cast<int>(state.range(1));
  const std::vector<float>& reference = truth(kind, amplitude);
  const ThreadLimit one(1);
  const auto lobes = rnmLobes();
  auto rays = RayOcclusion::build(field(kind, amplitude),
                                  {.count = 300, .sampling = static_cast<RaySampling>(state.range(2)), .seed = 5});
  Texels rows;
  for (int y = 7; y < kSide; y += 16)
    for (int x = 0; x < kSide; ++x) rows.emplace_back(x, y);
  for (auto _ : state) {
    auto o = rays->occlusionAt(rows, lobes);
    benchmark::DoNotOptimize(o.data());
  }
  state.counters["rays/s"] =
      benchmark::Counter(static_cast<double>(rows.size()) * 300, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["texel_share"] = 1.0 / 16;
  state.counters["rmse"] = rmse(rays->occlusionAt(probes(kSide, 16), lobes), reference);
  describe(state, kind, amplitude);
}

/// The headline, interleaved in one run: median of rounds of horizons (default azimuths, whole map) and of 300 random
/// rays (one row in 16, times 16).
void speedup(benchmark::State& state) {
  const int kind = static_cast<int>(state.range(0)), amplitude = static_cast<int>(state.range(1));
  const HeightField& f = field(kind, amplitude);
  const std::vector<float>& reference = truth(kind, amplitude);
  const ThreadLimit one(1);
  const auto lobes = rnmLobes();
  auto rays = RayOcclusion::build(f, {.count = 300, .sampling = RaySampling::Random, .seed = 5});
  Texels rows;
  for (int y = 7; y < kSide; y += 16)
    for (int x = 0; x < kSide; ++x) rows.emplace_back(x, y);
  std::vector<double> ratios;
  double horizonSeconds = 0, raySeconds = 0;
  Image o;
  // Processor time of this thread, which does all the work: other programs do not count.
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  };
  for (auto _ : state) {
    const double t0 = now();
    o = Horizon(f, {}).occlusion({0, 0, kSide, kSide}, lobes);
    const double t1 = now();
    auto r = rays->occlusionAt(rows, lobes);
    benchmark::DoNotOptimize(r.data());
    const double t2 = now();
    horizonSeconds = t1 - t0;
    raySeconds = 16 * (t2 - t1);
    ratios.push_back(raySeconds / horizonSeconds);
  }
  std::sort(ratios.begin(), ratios.end());
  std::vector<float> at;
  for (const auto& [x, y] : probes(kSide, 16)) at.insert(at.end(), o.at(x, y), o.at(x, y) + 3);
  const double rayRmse = rmse(rays->occlusionAt(probes(kSide, 16), lobes), reference),
               horizonRmse = rmse(at, reference);
  state.counters["s_horizon"] = horizonSeconds;
  state.counters["s_rays"] = raySeconds;
  state.counters["times_faster"] = ratios[ratios.size() / 2];
  state.counters["times_faster_min"] = ratios.front();
  state.counters["times_faster_max"] = ratios.back();
  state.counters["rmse_rays"] = rayRmse;
  state.counters["rmse_horizon"] = horizonRmse;
  state.counters["times_less_rmse"] = rayRmse / horizonRmse;
  describe(state, kind, amplitude);
}

/// Time against texels and threads. Arguments: side, threads, azimuths.
void scaling(benchmark::State& state) {
  const int side = static_cast<int>(state.range(0));
  const HeightField& f = field(Fractal, 24, side);
  const ThreadLimit limit(static_cast<int>(state.range(1)));
  const auto lobes = rnmLobes();
  for (auto _ : state) {
    const Horizon horizon(f, {.azimuths = static_cast<int>(state.range(2))});
    for (int y = 0; y < side; y += 1024)
      for (int x = 0; x < side; x += 2048) {
        Image o = horizon.occlusion({x, y, std::min(2048, side - x), std::min(1024, side - y)}, lobes);
        benchmark::DoNotOptimize(o.pixels.data());
      }
  }
  state.counters["texels/s"] =
      benchmark::Counter(static_cast<double>(side) * side, benchmark::Counter::kIsIterationInvariantRate);
}

void smoke(benchmark::State& state) {
  const HeightField f = fields::fractal(64, 64, 10);
  const auto lobes = rnmLobes();
  for (auto _ : state) {
    Image o = Horizon(f, {}).occlusion({0, 0, 64, 64}, lobes);
    benchmark::DoNotOptimize(o.pixels.data());
    auto rays = RayOcclusion::build(f, {.count = 16});
    auto r = rays->occlusion({0, 0, 64, 4}, lobes);
    benchmark::DoNotOptimize(r.pixels.data());
  }
}

BENCHMARK(smoke)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(speedup)->ArgsProduct({{Fractal, Brick, Step}, {8, 24, 64}})->Iterations(5)->Unit(benchmark::kMillisecond);
BENCHMARK(horizons)
    ->ArgsProduct({{Fractal, Brick, Step}, {8, 24, 64}, {8, 16, 32, 48, 64}})
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(rays300)
    ->ArgsProduct({{Fractal, Brick, Step},
                   {8, 24, 64},
                   {static_cast<int>(RaySampling::Random), static_cast<int>(RaySampling::Stratified)}})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(scaling)
    ->ArgsProduct({{1024}, {1}, {8, 16, 32, 64}})
    ->ArgsProduct({{512, 1024, 2048, 4096}, {1, 2, 4}, {64}})
    ->Iterations(2)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lumel::ssbump

BENCHMARK_MAIN();
