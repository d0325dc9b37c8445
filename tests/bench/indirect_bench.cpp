// How many rays indirect light takes to a given error: the gather against path tracing with the same sampler.
//   lumel_bench_gather --benchmark_filter=indirect/cornell    7.5 thousand texels
//   lumel_bench_gather --benchmark_filter=indirect/rooms      two rooms joined by a door
//   lumel_bench_gather --benchmark_filter=indirect/dark_room  the same, errors in the room without lamp
// Indirect light alone is baked (BakeOptions::indirectOnly). All rays count that it takes: the gather's direct map and
// warm-up, gather rays, paths, shadows. Errors are of luminance, relative: RMSE over texels by their mean.
// Each is measured with kSeeds seeds, and their mean squared errors are averaged.
// Truth: two path-traced references A and B that are independent of each other and of the candidate X, so that
// mean((X - A)(X - B)) is X's mean squared error whatever the noise of A and B.
#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <vector>

#include "baker/bake/bake.h"
#include "baker/bake/finish.h"
#include "scene/base/check.h"
#include "tests/bench/gather_scenes.h"

namespace lumel {
namespace {

using namespace bench_scenes;

struct Indirect {
  std::vector<double> light;  // luminance, per texel that counts
  double raysPerTexel = 0;    // over all texels
};

constexpr int kSeeds = 3;

enum class Where { Cornell, EmptyBox, Rooms, DarkRoom };

GridScene sceneOf(Where where) {
  if (where == Where::Rooms || where == Where::DarkRoom) return twoRooms();
  return cornellBox(where == Where::EmptyBox);
}

class Study {
 public:
  explicit Study(Where where) : made_(sceneOf(where)), texels_(findTexels(made_.atlas)) {
    const Image validity = run({.samples = 64, .bounces = 0, .seed = 5}).pages[0].aux;
    // Texels inside of things hold nothing of use, and at their edge path tracing counts what lies inside.
    for (std::size_t i = 0; i < texels_[0].size(); ++i)
      if (const TexelCoord at = texels_[0].coords[i];
          validity.at(at.x, at.y)[1] >= 0.99f && (where != Where::DarkRoom || isDark(i)))
        counting_.push_back(at);
  }

  Indirect measure(Integrator integrator, int samples, std::uint64_t seed, bool denoise = false,
                   float targetError = 0.0f) const {
    BakeOptions options{.samples = samples, .bounces = kAllBounces, .indirectOnly = true, .seed = seed};
    options.integrator = integrator;
    options.targetError = targetError;
    BakeResult baked = run(options);
    if (denoise) finishPages(baked.pages, made_.atlas, texels_, {.denoise = true, .rings = 0});
    Indirect found;
    for (const TexelCoord at : counting_)
      found.light.push_back(static_cast<double>(luminance(baked.pages[0].flat.rgb(at.x, at.y))));
    found.raysPerTexel =
        static_cast<double>(baked.stats.rays + baked.stats.shadowRays) / static_cast<double>(texels_[0].size());
    return found;
  }

 private:
  BakeResult run(const BakeOptions& options) const {
    Progress silent;
    auto result = bake(made_.scene, made_.atlas, texels_, options, silent);
    LUMEL_CHECK(bool(result));
    return *std::move(result);
  }
  bool isDark(std::size_t texel) const {
    const TriangleRef ref = texels_[0].trianglesOf(texel)[0];
    const Surface& surface = made_.atlas.surfaces[ref.surface];
    const std::uint32_t* corner = surface.indices.data() + std::size_t{3} * ref.triangle;
    return surface.positions[corner[0]].x >= 4.2f && surface.positions[corner[1]].x >= 4.2f;
  }

  GridScene made_;
  std::vector<PageTexels> texels_;
  std::vector<TexelCoord> counting_;
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

void indirect(benchmark::State& state, Where where, int referenceSamples) {
  for (auto _ : state) {
    const Study study(where);
    const Indirect a = study.measure(Integrator::Path, referenceSamples, 101);
    const Indirect b = study.measure(Integrator::Path, referenceSamples, 202);
    const double truth = 0.5 * (mean(a.light) + mean(b.light));
    double noise = 0;
    for (std::size_t i = 0; i < a.light.size(); ++i) noise += std::pow(a.light[i] - b.light[i], 2) / 4;
    state.counters["reference_error"] = std::sqrt(noise / static_cast<double>(a.light.size())) / truth;
    const auto judge = [&](const std::string& label, auto measure) {
      double sum = 0, light = 0, rays = 0;
      for (std::uint64_t seed = 7; seed < 7 + kSeeds; ++seed) {
        const Indirect x = measure(seed);
        for (std::size_t i = 0; i < x.light.size(); ++i) sum += (x.light[i] - a.light[i]) * (x.light[i] - b.light[i]);
        light += mean(x.light) / kSeeds;
        rays += x.raysPerTexel / kSeeds;
      }
      const double error = std::sqrt(std::max(0.0, sum / static_cast<double>(kSeeds * a.light.size()))) / truth;
      state.counters[label + "_error"] = error;
      state.counters[label + "_rays"] = rays;
      state.counters[label + "_bias"] = light / truth - 1;
      return Point{rays, error};
    };
    const auto curveOf = [&](Integrator integrator, const char* name, std::initializer_list<int> counts,
                             bool denoise = false) {
      std::vector<Point> curve;
      for (const int samples : counts)
        curve.push_back(judge(name + std::to_string(samples),
                              [&](std::uint64_t seed) { return study.measure(integrator, samples, seed, denoise); }));
      return curve;
    };
    const std::vector<Point> path = curveOf(Integrator::Path, "path", {64, 256, 1024, 2048});
    const std::vector<Point> gather = curveOf(Integrator::Gather, "gather", {16, 32, 64, 128, 256, 512, 1024});
    // What a bake hands out, and paths treated the same way.
    const std::vector<Point> denoised = curveOf(Integrator::Gather, "denoised", {16, 32, 64, 128, 256}, true);
    const std::vector<Point> denoisedPath = curveOf(Integrator::Path, "denoised_path", {16, 32, 64, 128, 256}, true);
    // Rays where they are needed: more samples where texels are still far from the target.
    std::vector<Point> targeted;
    for (const int permille : {80, 40, 30, 20, 15})
      targeted.push_back(judge("target" + std::to_string(permille), [&](std::uint64_t seed) {
        return study.measure(Integrator::Gather, 32, seed, false, 0.001f * static_cast<float>(permille));
      }));
    for (const int percent : {5, 2}) {
      const std::string label = std::to_string(percent) + "pct";
      state.counters["path_rays_" + label] = raysFor(0.01 * percent, path);
      state.counters["gather_rays_" + label] = raysFor(0.01 * percent, gather);
      state.counters["denoised_rays_" + label] = raysFor(0.01 * percent, denoised);
      state.counters["denoised_path_rays_" + label] = raysFor(0.01 * percent, denoisedPath);
      state.counters["targeted_rays_" + label] = raysFor(0.01 * percent, targeted);
      state.counters["fewer_" + label] = raysFor(0.01 * percent, path) / raysFor(0.01 * percent, gather);
    }
  }
}
BENCHMARK_CAPTURE(indirect, cornell, Where::Cornell, 4096)->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(indirect, empty_box, Where::EmptyBox, 4096)->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(indirect, rooms, Where::Rooms, 4096)->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(indirect, dark_room, Where::DarkRoom, 8192)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace lumel
