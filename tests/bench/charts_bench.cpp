// Speed and memory of charts, from the scene to flattened charts. Figures mean something on an idle machine only.
#include <benchmark/benchmark.h>

#include <cmath>
#include <fstream>
#include <random>
#include <string>

#include "tests/lightmap/chart_checks.h"
#include "tests/lightmap/test_shapes.h"

namespace lumel {
namespace {

/// A figure of /proc/self/status in bytes; 0 where the system does not tell.
double processMemory(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind(field + ":", 0) == 0) return 1024 * std::stod(line.substr(field.size() + 1));
  return 0;
}

/// Times the making of charts; the counter `bytes` is the peak over what the scene takes, packing included.
void makeCharts(benchmark::State& state, const Scene& scene, float texelsPerMeter) {
  AtlasOptions options;
  options.uvSource = UvSource::Generate;
  options.texelsPerMeter = texelsPerMeter;
  options.pageSize = 1024;
  double triangles = 0;
  for (const Instance& instance : scene.instances)
    for (const Primitive& p : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives)
      triangles += static_cast<double>(p.triangleCount());
  for (auto _ : state) {
    std::ofstream("/proc/self/clear_refs") << "5";  // forgets the peak so far
    const double before = processMemory("VmRSS");
    Progress silent;
    const Expected<AtlasResult> result = buildAtlas(scene, options, silent);
    if (!result) {
      state.SkipWithError(result.error().message.c_str());
      return;
    }
    state.SetIterationTime(result->report.chartSeconds);
    state.counters["charts"] = static_cast<double>(result->report.generatedCharts);
    state.counters["bytes/triangle"] = (processMemory("VmHWM") - before) / triangles;
  }
  state.counters["triangles"] = triangles;
}

/// One smooth connected surface of 2 * cells^2 triangles, 800 x 800 texels.
void BM_ChartsTerrain(benchmark::State& state) { makeCharts(state, terrain(static_cast<int>(state.range(0)), 100), 8); }
BENCHMARK(BM_ChartsTerrain)->Arg(95)->Arg(271)->Unit(benchmark::kMillisecond)->UseManualTime();
void BM_ChartsLargeTerrain(benchmark::State& state) { BM_ChartsTerrain(state); }
BENCHMARK(BM_ChartsLargeTerrain)
    ->Arg(500)
    ->Arg(775)
    ->Arg(1000)
    ->Unit(benchmark::kMillisecond)
    ->UseManualTime()
    ->Iterations(1);

/// A closed band that unrolls whole: 4 * sides^2 triangles.
void BM_ChartsPipe(benchmark::State& state) {
  const auto sides = static_cast<int>(state.range(0));
  Shape pipe = grid(sides, 2 * sides, true, false,
                    [](double u, double v) { return Vec3(10 * std::cos(kTau * u), 10 * std::sin(kTau * u), 50 * v); });
  smoothNormals(pipe);
  makeCharts(state, pipe.scene(), 10);
}
BENCHMARK(BM_ChartsPipe)->Arg(32)->Arg(200)->Unit(benchmark::kMillisecond)->UseManualTime();

/// A room of five walls with boxes of many sizes on its floor: as a Cornell box has two.
void BM_ChartsBoxes(benchmark::State& state) {
  Scene scene = box(Vec3(20, 20, 20), Vec3(0)).scene();  // turned inside out
  scene.meshes[0].primitives[0].indices.resize(30);      // the front is open
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  for (int i = 1; i <= state.range(0); ++i) {
    const Vec3 at(18 * uniform(random), 18 * uniform(random), 0);
    const Vec3 size(0.2f + uniform(random), 0.2f + uniform(random), 0.2f + 3 * uniform(random));
    const Scene other = shadedFlat(box(at, at + size)).scene();
    scene.meshes.push_back(other.meshes[0]);
    scene.instances.push_back(other.instances[0]);
    scene.instances.back().mesh = i;
    scene.instances.back().name = "box " + std::to_string(i);
  }
  makeCharts(state, scene, 20);
}
BENCHMARK(BM_ChartsBoxes)->Arg(2)->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond)->UseManualTime();

}  // namespace
}  // namespace lumel
