// How many rays indirect light takes to a given error: the gather against path tracing with the same sampler.
//   lumel_bench_gather --benchmark_filter=indirect/door:0     Cornell box
//   lumel_bench_gather --benchmark_filter=indirect/door:1     two rooms joined by a door; errors in the room without lamp
// Indirect light is a bake less its direct light with the same samples, so that the noise of the direct light cancels.
// All rays of the whole bake count: warm-up, gather, paths, shadows. Errors are relative: RMSE over texels by their mean.
// Truth: two path-traced references A and B that are independent of each other and of the candidate X, so that
// mean((X - A)(X - B)) is X's mean squared error whatever the noise of A and B.
#include <benchmark/benchmark.h>

#include <cmath>
#include <utility>
#include <vector>

#include "baker/bake.h"
#include "scene/check.h"
#include "tests/bench/gather_scenes.h"

namespace lumel {
namespace {

using namespace bench_scenes;

struct Indirect {
  std::vector<double> light;  // luminance, per texel that counts
  double raysPerTexel = 0;    // over all texels
};

class Study {
 public:
  explicit Study(bool door) : made_(door ? twoRooms() : cornellBox()), door_(door), texels_(findTexels(made_.atlas)) {
    validity_ = run({.samples = 64, .bounces = 0, .seed = 5}).pages[0].aux;
  }

  Indirect measure(Integrator integrator, int samples, std::uint64_t seed) const {
    BakeOptions options{.samples = samples, .bounces = kAllBounces, .seed = seed};
    options.integrator = integrator;
    const BakeResult all = run(options);
    options.bounces = 0;
    const BakeResult direct = run(options);
    Indirect found;
    for (const TexelCoord at : texels_[0].coords)
      if (counts(at))
        found.light.push_back(static_cast<double>(luminance(all.pages[0].flat.rgb(at.x, at.y))) -
                              static_cast<double>(luminance(direct.pages[0].flat.rgb(at.x, at.y))));
    found.raysPerTexel =
        static_cast<double>(all.stats.rays + all.stats.shadowRays) / static_cast<double>(texels_[0].size());
    return found;
  }

 private:
  BakeResult run(const BakeOptions& options) const {
    Progress silent;
    auto result = bake(made_.scene, made_.atlas, texels_, options, silent);
    LUMEL_CHECK(bool(result));
    return *std::move(result);
  }
  /// Texels inside of things hold nothing of use, and at their edge path tracing counts what lies inside; with a door,
  /// texels of the room without lamp count.
  bool counts(TexelCoord at) const {
    if (validity_.at(at.x, at.y)[1] < 0.99f) return false;
    if (!door_) return true;
    for (std::size_t i = 0; i < texels_[0].size(); ++i)
      if (texels_[0].coords[i].x == at.x && texels_[0].coords[i].y == at.y) {
        const TriangleRef ref = texels_[0].trianglesOf(i)[0];
        const Surface& surface = made_.atlas.surfaces[ref.surface];
        return surface.positions[surface.indices[std::size_t{3} * ref.triangle]].x >= 4.2f &&
               surface.positions[surface.indices[std::size_t{3} * ref.triangle + 1]].x >= 4.2f;
      }
    return false;
  }

  GridScene made_;
  bool door_;
  std::vector<PageTexels> texels_;
  Image validity_;
};

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

struct Point {
  double rays = 0;
  double error = 0;
};

/// Rays for an error: between measured points by their power law, beyond the last one by the square root.
double raysFor(double error, const std::vector<Point>& curve) {
  for (std::size_t i = 1; i < curve.size(); ++i) {
    if (curve[i].error > error) continue;
    const double slope = std::log(curve[i].error / curve[i - 1].error) / std::log(curve[i].rays / curve[i - 1].rays);
    return curve[i - 1].rays * std::pow(error / curve[i - 1].error, 1 / slope);
  }
  const Point& last = curve.back();
  return last.rays * std::pow(last.error / error, 2);
}

void indirect(benchmark::State& state) {
  const bool door = state.range(0) != 0;
  for (auto _ : state) {
    const Study study(door);
    const int referenceSamples = static_cast<int>(state.range(1));
    const Indirect a = study.measure(Integrator::Path, referenceSamples, 101);
    const Indirect b = study.measure(Integrator::Path, referenceSamples, 202);
    const double truth = 0.5 * (mean(a.light) + mean(b.light));
    double noise = 0;
    for (std::size_t i = 0; i < a.light.size(); ++i) noise += std::pow(a.light[i] - b.light[i], 2) / 4;
    state.counters["reference_error"] = std::sqrt(noise / static_cast<double>(a.light.size())) / truth;
    const auto errorOf = [&](const Indirect& x) {
      double sum = 0;
      for (std::size_t i = 0; i < x.light.size(); ++i) sum += (x.light[i] - a.light[i]) * (x.light[i] - b.light[i]);
      return std::sqrt(std::max(0.0, sum / static_cast<double>(x.light.size()))) / truth;
    };
    std::vector<Point> path, gather;
    for (const int samples : {64, 256}) {
      const Indirect found = study.measure(Integrator::Path, samples, 7);
      path.push_back({found.raysPerTexel, errorOf(found)});
    }
    for (const int samples : {16, 32, 64, 128, 256, 512}) {
      const Indirect found = study.measure(Integrator::Gather, samples, 7);
      gather.push_back({found.raysPerTexel, errorOf(found)});
      state.counters["gather" + std::to_string(samples) + "_error"] = gather.back().error;
      state.counters["bias" + std::to_string(samples)] = mean(found.light) / truth - 1;
    }
    state.counters["path256_error"] = path.back().error;
    state.counters["path_rays_2pct"] = raysFor(0.02, path);
    state.counters["gather_rays_2pct"] = raysFor(0.02, gather);
    state.counters["fewer"] = raysFor(0.02, path) / raysFor(0.02, gather);
  }
}
BENCHMARK(indirect)
    ->ArgNames({"door", "reference"})
    ->Args({0, 2048})
    ->Args({1, 4096})
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace lumel
