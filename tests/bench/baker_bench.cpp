// Speed of the baker's parts: rays, shading, sums, projection, files. Figures mean something on an idle machine only.
// The gather's kernel has a bench of its own.
#include <benchmark/benchmark.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <unistd.h>

#include "baker/bake/bake.h"
#include "baker/bake/finish.h"
#include "baker/light/direct_light.h"
#include "baker/path/texel_sums.h"
#include "baker/rays/sample_lanes.h"
#include "lightmap/maps/projection.h"
#include "scene/base/parallel.h"
#include "scene/images/image_io.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

/// A hall of boxes: `side` x `side` of them on a floor under a ceiling with a lamp, a point light and a sky.
TestScene hall(int side) {
  TestScene test;
  const int wall = test.addMaterial(Vec3(0.7f));
  const int lamp = test.addMaterial(Vec3(0.0f), Vec3(8.0f));
  const auto size = static_cast<float>(2 * side);
  test.addRectangle({0, 0, size}, {size, 0, 0}, {0, 0, -size}, {.material = wall, .texels = 128});
  test.addRectangle({0, 4, 0}, {size, 0, 0}, {0, 0, size}, {.material = wall, .texels = 8});
  test.addRectangle({size / 3, 3.9f, size / 3}, {1, 0, 0}, {0, 0, 1}, {.material = lamp, .texels = 0});
  for (int i = 0; i < side * side; ++i) {
    const float x = static_cast<float>(i % side) * 2 + 0.5f, z = static_cast<float>(i / side) * 2 + 0.5f;
    const float h = 0.5f + static_cast<float>((i * 7) % 5) * 0.3f;
    const RectangleOptions box{.material = wall, .texels = 0};
    test.addRectangle({x, 0, z + 1}, {1, 0, 0}, {0, h, 0}, box);
    test.addRectangle({x + 1, 0, z}, {-1, 0, 0}, {0, h, 0}, box);
    test.addRectangle({x + 1, 0, z + 1}, {0, 0, -1}, {0, h, 0}, box);
    test.addRectangle({x, 0, z}, {0, 0, 1}, {0, h, 0}, box);
    test.addRectangle({x, h, z + 1}, {1, 0, 0}, {0, 0, -1}, box);
  }
  test.scene.environment.color = Vec3(0.3f);
  Light point;
  point.type = LightType::Point;
  point.position = {size / 2, 3, size / 2};
  point.intensity = 20.0f;
  test.scene.lights = {point};
  return test;
}

/// A scene with everything that rays need.
struct Ready {
  TestScene test;
  std::vector<std::string> notes;
  Materials materials;
  std::unique_ptr<RayScene> rays;
  PunctualLights punctual;
  EmissiveTriangles emissive;
  EnvironmentLight environment;

  explicit Ready(int side)
      : test(hall(side)),
        materials(test.scene, true, notes),
        rays(std::move(*RayScene::build(test.scene, materials))),
        punctual(test.scene.lights),
        emissive(*rays, materials),
        environment(test.scene.environment) {}
  LightTransport transport() const { return {*rays, materials, punctual, emissive, environment}; }
};

const Ready& ready() {
  static const Ready scene(24);
  return scene;
}

/// 16 neighbouring points of the floor; `wave` numbers them.
Receiver floorPoint(int wave, int lane) {
  const float x = 0.02f + 0.36f * static_cast<float>(wave % 128) + 0.09f * static_cast<float>(lane % 4);
  const float z = 0.02f + 0.36f * static_cast<float>(wave / 128 % 128) + 0.09f * static_cast<float>(lane / 4);
  const Vec3 p(x, 1e-4f, z);
  return {p, {0, 1, 0}, {0, 1, 0}, p};
}

void fillPacket(RayPacket& rays, int wave, std::uint32_t sample) {
  rays.clear();
  for (int lane = 0; lane < kLanes; ++lane) {
    const TexelSampler sampler(1, 0, static_cast<std::uint32_t>(wave), static_cast<std::uint32_t>(lane));
    const Vec3 local = sampleGatherHemisphere(sampler.get2D(sample, 0));
    rays.set(lane, floorPoint(wave, lane).rayStart, {local.x, local.z, local.y});
  }
}

void BM_RayGeneration(benchmark::State& state) {
  SampleLanes samples;
  for (int lane = 0; lane < kLanes; ++lane)
    samples.setTexel(lane, TexelSampler(1, 0, static_cast<std::uint32_t>(lane), 7));
  RayPacket rays;
  std::uint32_t sample = 0;
  for (auto _ : state) {
    samples.setSampleOfAll(sample++);
    const UnitSquareLanes u = samples.draw2D(0);
    rays.clear();
    for (int lane = 0; lane < kLanes; ++lane) {
      const Vec3 local = sampleGatherHemisphere(u[lane]);
      rays.set(lane, Vec3(0.0f), {local.x, local.z, local.y});
    }
    benchmark::DoNotOptimize(rays);
  }
  state.SetItemsProcessed(state.iterations() * kLanes);
}
BENCHMARK(BM_RayGeneration);

/// Closest hits from texels, neighbours in one packet. Argument: TraceMode.
void BM_ClosestHits(benchmark::State& state) {
  std::vector<RayPacket> packets(512);
  for (std::size_t i = 0; i < packets.size(); ++i) fillPacket(packets[i], static_cast<int>(i), 3);
  const auto mode = static_cast<TraceMode>(state.range(0));
  state.SetLabel(mode == TraceMode::Single ? "single rays" : "packets");
  const RayScene& scene = *ready().rays;
  std::size_t next = 0;
  for (auto _ : state) {
    RayPacket rays = packets[next++ % packets.size()];
    scene.intersect(rays, mode);
    benchmark::DoNotOptimize(rays);
  }
  state.SetItemsProcessed(state.iterations() * kLanes);
}
BENCHMARK(BM_ClosestHits)->Arg(static_cast<int>(TraceMode::Single))->Arg(static_cast<int>(TraceMode::Packet));

/// Shadow rays from texels to the point light. Argument: TraceMode.
void BM_ShadowRays(benchmark::State& state) {
  const auto mode = static_cast<TraceMode>(state.range(0));
  state.SetLabel(mode == TraceMode::Single ? "single rays" : "packets");
  const Vec3 light = ready().test.scene.lights[0].position;
  int wave = 0;
  for (auto _ : state) {
    ShadowPacket shadows;
    for (int lane = 0; lane < kLanes; ++lane) {
      const Receiver r = floorPoint(wave, lane);
      shadows.set(lane, r.rayStart, light - r.rayStart, 1.0f);
    }
    ++wave;
    ready().rays->occluded(shadows, mode);
    benchmark::DoNotOptimize(shadows);
  }
  state.SetItemsProcessed(state.iterations() * kLanes);
}
BENCHMARK(BM_ShadowRays)->Arg(static_cast<int>(TraceMode::Single))->Arg(static_cast<int>(TraceMode::Packet));

/// From a hit to its surface, albedo and shading normal.
void BM_ShadeHits(benchmark::State& state) {
  std::vector<RayPacket> packets(64);
  for (std::size_t i = 0; i < packets.size(); ++i) {
    fillPacket(packets[i], static_cast<int>(i), 5);
    ready().rays->intersect(packets[i], TraceMode::Packet);
  }
  std::size_t next = 0;
  std::int64_t hits = 0;
  for (auto _ : state) {
    const RayPacket& rays = packets[next++ % packets.size()];
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!rays.hit(lane)) continue;
      const HitSurface hit = ready().rays->surfaceAt(rays, lane);
      benchmark::DoNotOptimize(ready().materials.albedo(hit.point));
      benchmark::DoNotOptimize(ready().rays->shadingNormal(hit));
      ++hits;
    }
  }
  state.SetItemsProcessed(hits);
}
BENCHMARK(BM_ShadeHits);

/// Light samples with their shadow rays, all kinds of light.
void BM_DirectLight(benchmark::State& state) {
  const LightTransport transport = ready().transport();
  LightLanes lanes;
  SampleLanes samples;
  lanes.active.fill(true);
  int wave = 0;
  std::uint64_t rays = 0;
  for (auto _ : state) {
    for (int lane = 0; lane < kLanes; ++lane) {
      lanes.receivers[static_cast<std::size_t>(lane)] = floorPoint(wave, lane);
      samples.setTexel(lane, TexelSampler(1, 0, static_cast<std::uint32_t>(wave), static_cast<std::uint32_t>(lane)));
    }
    ++wave;
    rays += directLight(transport, lanes, samples, 0, TraceMode::Packet, kGatherDensity,
                        [](int, const Vec3&, const Vec3& light) { benchmark::DoNotOptimize(light); });
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(rays));
}
BENCHMARK(BM_DirectLight);

/// The way down a tree of lights. Arguments: lights; points with a normal, or open to all sides.
void BM_LightTree(benchmark::State& state) {
  const auto count = static_cast<int>(state.range(0));
  const bool hasNormal = state.range(1) != 0;
  const int side = static_cast<int>(std::ceil(std::sqrt(static_cast<float>(count))));
  std::vector<LightBounds> lights;
  for (int i = 0; i < count; ++i) {
    const Vec3 p = Vec3(i % side, 0, i / side) * (48.0f / static_cast<float>(side)) + Vec3(0, 3.6f, 0);
    lights.push_back({.min = p, .max = p + Vec3(0.05f, 0, 0.05f), .axis = {0, -1, 0}, .power = 1.0f});
  }
  const LightTree tree(lights);
  Vec3Lanes p, n;
  LaneFlags active;
  active.fill(1);
  alignas(64) float u[kLanes];
  int wave = 0;
  for (auto _ : state) {
    const std::uint32_t key = hashBits(static_cast<std::uint32_t>(wave));
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Receiver point = floorPoint(wave, static_cast<int>(lane));
      p.set(lane, point.p);
      n.set(lane, hasNormal ? point.ns : Vec3(0.0f));
      u[lane] = unitFloat(hashCombine(key, static_cast<std::uint32_t>(lane)));
    }
    ++wave;
    LightTree::Descent descent;
    tree.descend(p, hasNormal ? &n : nullptr, active, u, descent);
    benchmark::DoNotOptimize(descent);
  }
  state.SetItemsProcessed(state.iterations() * kLanes);
}
BENCHMARK(BM_LightTree)->ArgsProduct({{1000, 100000}, {0, 1}});

/// One sample into the sums of a texel, with its projection.
void BM_Accumulate(benchmark::State& state) {
  const RnmKernels kernels(Projection::Flat);
  std::vector<Vec3> directions;
  for (std::uint32_t i = 0; i < 1024; ++i)
    directions.push_back(sampleGatherHemisphere(TexelSampler(1, 0, 0, 0).get2D(i, 0)));
  TexelSums sums;
  std::uint32_t i = 0;
  for (auto _ : state) {
    const Vec3& w = directions[i++ % directions.size()];
    const Vec3 k = kernels(w);
    const Vec3 light(0.3f, 0.2f, 0.1f);
    sums.add({light * w.z, {light * k.x, light * k.y, light * k.z}}, 3, static_cast<int>(i % TexelSums::kBatches));
  }
  benchmark::DoNotOptimize(sums);
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_Accumulate);

/// What becomes of a texel's sums. Argument: Projection.
void BM_FinishTexel(benchmark::State& state) {
  const auto projection = static_cast<Projection>(state.range(0));
  std::array<Vec3, 3> rnm = {Vec3(0.4f, 0.3f, 0.2f), Vec3(0.2f), Vec3(0.3f)};
  for (auto _ : state) {
    benchmark::DoNotOptimize(rnm);
    benchmark::DoNotOptimize(finishTexel(projection, rnm, Vec3(0.31f, 0.29f, 0.3f)));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_FinishTexel)->DenseRange(0, 2);

/// A page's last steps. Argument: 1 with denoising.
void BM_Finish(benchmark::State& state) {
  static const TestScene test = hall(4);
  static const auto texels = findTexels(test.atlas);
  static const BakeResult baked = test.tryBake({.samples = 16}).operator*();
  for (auto _ : state) {
    std::vector<BakedPage> pages = baked.pages;
    finishPages(pages, test.atlas, texels, {.denoise = state.range(0) != 0, .rings = 2});
    benchmark::DoNotOptimize(pages.data());
  }
  std::int64_t count = 0;
  for (const PageTexels& page : texels) count += static_cast<std::int64_t>(page.size());
  state.SetItemsProcessed(state.iterations() * count);
}
BENCHMARK(BM_Finish)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Whole bakes of the hall's floor. Arguments: integrator, samples.
void BM_Bake(benchmark::State& state) {
  TestScene test = hall(12);
  test.integrator = static_cast<Integrator>(state.range(0));
  state.SetLabel(test.integrator == Integrator::Gather ? "gather" : "path");
  std::uint64_t rays = 0;
  for (auto _ : state) {
    const auto result = test.tryBake({.samples = static_cast<int>(state.range(1))});
    rays += result->stats.rays + result->stats.shadowRays;
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(rays));
}
BENCHMARK(BM_Bake)
    ->Args({static_cast<int>(Integrator::Gather), 64})
    ->Args({static_cast<int>(Integrator::Path), 16})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// A page of noisy light as an EXR file. Arguments: side, 1 for half floats.
void BM_WriteExr(benchmark::State& state) {
  const int side = static_cast<int>(state.range(0));
  Image image(side, side, 3);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const auto noise = static_cast<float>(hashBits(static_cast<std::uint32_t>(i)) & 0xffffu) / 65536.0f;
    image.pixels[i] = 0.5f + 0.3f * std::sin(static_cast<float>(i) * 1e-4f) + 0.02f * noise;
  }
  const auto file = std::filesystem::temp_directory_path() / ("lumel-bench-" + std::to_string(getpid()) + ".exr");
  WriteImageOptions options;
  options.format = state.range(1) != 0 ? PixelFormat::Half : PixelFormat::Float;
  for (auto _ : state)
    if (!writeImage(file, image, options)) state.SkipWithError("cannot write");
  std::error_code ec;
  state.counters["MiB"] = static_cast<double>(std::filesystem::file_size(file, ec)) / (1024.0 * 1024.0);
  std::filesystem::remove(file, ec);
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(image.pixels.size() * sizeof(float)));
}
BENCHMARK(BM_WriteExr)->Args({256, 0})->Args({1024, 0})->Args({1024, 1})->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace lumel
