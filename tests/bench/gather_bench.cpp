// The gather against a naive loop over the same rays, and where its time goes. One thread.
//   lumel_bench_gather                                everything
//   lumel_bench_gather --benchmark_filter=speedup     the ratios, naive and gather taken in turns
//   lumel_bench_gather --benchmark_filter=smoke       the smoke pass of ctest
// Counters: ns per ray in all (gather_ns, naive_ns), inside Embree (trace_ns, naive_trace_ns) and outside of it. The
// gather goes on from hits that are near or on uneven texels, where the naive loop ends: went_on is the share of its
// rays that do; they count as rays, and their tracing as Embree's.
#include <benchmark/benchmark.h>

#include <x86intrin.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <optional>

#include "baker/gather/waves/gather_wave.h"
#include "baker/gather/waves/warm_wave.h"
#include "tests/bench/gather_scenes.h"

namespace lumel {
namespace {

using namespace bench_scenes;

constexpr std::uint32_t kPoints = WavePoints::kMost;

constexpr std::array<std::uint8_t, kLanes> kOpen{};

enum Place : int { Rooms, Foliage };

/// When packets are traced coherently; bakes ask the pilot.
enum Coherent : int { kNever, kAlways, kByPilot };

std::optional<TraceMode> modeOf(std::int64_t coherent) {
  if (coherent == kByPilot) return {};
  return coherent == kAlways ? TraceMode::Coherent : TraceMode::Packet;
}

/// A scene ready to gather in, its cache filled with arbitrary light.
struct Fixture {
  explicit Fixture(int place)
      : grid(place == Rooms ? furnishedRooms() : foliage()),
        transport(grid),
        light(transport.light()),
        map(*transport.rays, grid.atlas, transport.texels),
        waves(transport.texels),
        scene{.transport = light,
              .encoding = *encoding,
              .atlas = grid.atlas,
              .texels = transport.texels,
              .map = map,
              .waves = waves} {
    scene.levels = {.count = 1, .base = 0, .endless = true};
    scene.lastDepth = 64;
    for (std::size_t t = 0; t < map.size(); ++t) {
      reflected.emplace_back(0.1f + unitFloat(hashBits(static_cast<std::uint32_t>(t))));
      cache.push_back(packColor(reflected.back()));
    }
    const PageTexels& page = transport.texels[0];
    pixels.assign(static_cast<std::size_t>(page.width) * static_cast<std::size_t>(page.height), kNoTexel);
    for (std::size_t t = 0; t < page.size(); ++t)
      pixels[pixelOf(page.coords[t].x, page.coords[t].y)] = static_cast<std::uint32_t>(t);
    findUneven();
  }
  /// As the warm-up of a bake does.
  void findUneven() {
    const PageTexels& page = transport.texels[0];
    std::vector<std::uint8_t> uneven(page.size());
    std::array<CacheLink, std::size_t{kLanes} * kWarmRays> links;
    for (std::size_t first = 0; first < page.size(); first += kLanes) {
      const std::size_t count = std::min<std::size_t>(kLanes, page.size() - first);
      GatheredWave counts;
      const auto warm = WarmWave(scene, 0, first, count).warmUp(std::span(links).first(count * kWarmRays), counts);
      for (std::size_t i = 0; i < count; ++i) uneven[first + i] = warm[i].isUneven() ? 1 : 0;
    }
    map.setUneven(uneven);
  }
  std::size_t pixelOf(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(transport.texels[0].width) +
           static_cast<std::size_t>(x);
  }

  GridScene grid;
  Transport transport;
  LightTransport light;
  std::shared_ptr<const Encoding> encoding = rnmEncoding();
  TexelMap map;
  Waves waves;
  GatherScene scene;
  std::vector<PackedColor> cache;
  std::vector<Vec3> reflected;        // the same for the naive loop
  std::vector<std::uint32_t> pixels;  // the naive loop's own way from a pixel to its texel
};

const Fixture& fixture(int place) {
  static std::map<int, std::unique_ptr<Fixture>> made;
  auto& f = made[place];
  if (!f) f = std::make_unique<Fixture>(place);
  return *f;
}

/// First texels of waves, spread evenly over the page.
std::vector<std::size_t> spreadWaves(const Fixture& f, std::size_t count) {
  const std::size_t waves = f.transport.texels[0].size() / kLanes;
  std::vector<std::size_t> firsts;
  for (std::size_t i = 0; i < count; ++i) firsts.push_back(i * waves / count * kLanes);
  return firsts;
}

/// Time inside Embree's calls: all of them that this program makes go through the wrappers below (linked with --wrap).
/// Off, a wrapper is a jump; on, it reads the time stamp counter twice.
struct EmbreeClock {
  bool on = false;
  std::uint64_t ticks = 0;
  std::uint64_t calls = 0;
};
EmbreeClock embreeClock;

template <class Call>
void timed(Call call) {
  if (!embreeClock.on) return call();
  const std::uint64_t start = __rdtsc();
  call();
  embreeClock.ticks += __rdtsc() - start;
  ++embreeClock.calls;
}

double nsPerTick() {
  static const double ns = [] {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const std::uint64_t first = __rdtsc();
    while (Clock::now() - start < std::chrono::milliseconds(50)) {
    }
    return std::chrono::duration<double, std::nano>(Clock::now() - start).count() /
           static_cast<double>(__rdtsc() - first);
  }();
  return ns;
}

/// Of an empty call: what the clock sees of it, and what it takes in all.
struct ClockCost {
  double seenTicks = 0.0;
  double ticks = 0.0;
};
const ClockCost& clockCost() {
  static const ClockCost cost = [] {
    constexpr int kCalls = 1'000'000;
    embreeClock = {.on = true};
    const std::uint64_t first = __rdtsc();
    for (int i = 0; i < kCalls; ++i) timed([] { benchmark::ClobberMemory(); });
    const auto all = static_cast<double>(__rdtsc() - first);
    const auto seen = static_cast<double>(embreeClock.ticks);
    embreeClock = {};
    return ClockCost{seen / kCalls, all / kCalls};
  }();
  return cost;
}

template <class Work>
double nsOf(Work work) {
  const std::uint64_t first = __rdtsc();
  work();
  return static_cast<double>(__rdtsc() - first) * nsPerTick();
}

/// Nanoseconds, the clock's own taken off.
struct Split {
  double embree = 0.0;
  double outside = 0.0;
};

template <class Work>
Split splitOf(Work work) {
  const ClockCost& cost = clockCost();
  embreeClock = {.on = true};
  const std::uint64_t first = __rdtsc();
  work();
  const auto all = static_cast<double>(__rdtsc() - first);
  const auto ticks = static_cast<double>(embreeClock.ticks);
  const auto calls = static_cast<double>(embreeClock.calls);
  embreeClock = {};
  return {(ticks - calls * cost.seenTicks) * nsPerTick(),
          (all - ticks - calls * (cost.ticks - cost.seenTicks)) * nsPerTick()};
}

struct Maps {
  Vec3d flat{0};
  std::array<Vec3d, kMostMaps> encoded{};
};

struct NaiveRay {
  RTCRayHit ray;
  Vec3 local;
  float pdf;
};

/// The rays of one texel as one would write them down; visit(ray) for each.
template <class Visit>
void forEachNaiveRay(const Fixture& f, std::size_t texel, std::uint32_t samples, Visit visit) {
  const PageTexels& page = f.transport.texels[0];
  TexelFootprint footprint;
  if (!(footprint.clip(f.grid.atlas, page, texel) > 0)) return;
  const TexelSampler sampler(f.scene.seed, 0, page.coords[texel].x, page.coords[texel].y);
  std::array<SurfacePoint, kPoints> points;
  std::array<Vec3, kPoints> starts;
  for (std::uint32_t i = 0; i < kPoints; ++i) {
    points[i] = footprint.sample(sampler.get2D(i, kFootprint));
    const Surface& surface = f.grid.atlas.surfaces[points[i].triangle.surface];
    const std::uint32_t* v = &surface.indices[std::size_t{3} * points[i].triangle.triangle];
    starts[i] = offsetPoint(points[i].position, points[i].geometricNormal,
                            {surface.positions[v[0]], surface.positions[v[1]], surface.positions[v[2]]}, 0.0f);
  }
  for (std::uint32_t s = 0; s < samples; ++s) {
    const SurfacePoint& point = points[s % kPoints];
    NaiveRay made;
    made.local = sampleGatherHemisphere(sampler.get2D(s, kDirection));
    made.pdf = gatherHemispherePdf(made.local.z);
    const Vec3 dir = point.frame.fromLocal(made.local);
    if (!(glm::dot(dir, point.geometricNormal) > 0)) continue;
    const Vec3& start = starts[s % kPoints];
    made.ray.ray = {start.x, start.y, start.z, 0.0f, dir.x, dir.y, dir.z, 0.0f, std::numeric_limits<float>::infinity(),
                    ~0u,     0,       0};
    made.ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    made.ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    visit(made);
  }
}

Maps gatherNaively(const Fixture& f, std::size_t texel, std::uint32_t samples) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCScene embree = f.transport.rays->embreeScene();
  const Page& page = f.grid.atlas.pages[0];
  Maps maps;
  forEachNaiveRay(f, texel, samples, [&](NaiveRay& made) {
    rtcIntersect1(embree, &context, &made.ray);
    const RTCHit& hit = made.ray.hit;
    if (hit.geomID == RTC_INVALID_GEOMETRY_ID) return;
    const Vec3 dir(made.ray.ray.dir_x, made.ray.ray.dir_y, made.ray.ray.dir_z);
    if (glm::dot(dir, Vec3(hit.Ng_x, hit.Ng_y, hit.Ng_z)) > 0) return;
    const Surface& surface = f.grid.atlas.surfaces[hit.geomID];
    const std::uint32_t* v = &surface.indices[std::size_t{3} * hit.primID];
    const Vec2 uv = (1 - hit.u - hit.v) * surface.lightmapUvs[v[0]] + hit.u * surface.lightmapUvs[v[1]] +
                    hit.v * surface.lightmapUvs[v[2]];
    const int x = std::min(static_cast<int>(uv.x * static_cast<float>(page.width)), page.width - 1);
    const int y = std::min(static_cast<int>(uv.y * static_cast<float>(page.height)), page.height - 1);
    const std::uint32_t found = f.pixels[f.pixelOf(x, y)];
    if (found == kNoTexel) return;
    const Vec3 light = f.reflected[found] * (kInvPi / made.pdf);
    const MapKernels k = f.encoding->kernels(made.local);
    maps.flat += Vec3d(light * made.local.z);
    for (std::size_t i = 0; i < f.encoding->mapCount(); ++i) maps.encoded[i] += Vec3d(light * k[i]);
  });
  return maps;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// What each wave took, round by round.
class WaveTimes {
 public:
  explicit WaveTimes(std::size_t waves) : ns_(waves) {}
  void add(std::size_t wave, double ns) { ns_[wave].push_back(ns); }
  /// Of all waves, the median of each: whoever else used the processor at times does not count.
  double sum() const {
    double all = 0.0;
    for (const std::vector<double>& rounds : ns_) all += median(rounds);
    return all;
  }

 private:
  std::vector<std::vector<double>> ns_;
};

/// Naive loop and gather in turns over the same waves: all waves by the one, then all by the other, so that neither
/// finds in the caches what the other has just read.
void compare(benchmark::State& state, int place, std::uint32_t samples, std::optional<TraceMode> mode,
             std::size_t waves, int rounds) {
  const Fixture& f = fixture(place);
  GatherScene scene = f.scene;
  scene.gatherMode = mode;
  _mm_setcsr(_mm_getcsr() | 0x8040u);  // as bakes do
  const std::vector<std::size_t> firsts = spreadWaves(f, waves);
  double naiveSum = 0, gatherSum = 0, rays = 0;
  const auto gatherWaveNaively = [&](std::size_t first) {
    for (std::size_t t = first; t < first + kLanes; ++t) naiveSum += gatherNaively(f, t, samples).flat.x;
  };
  const auto gatherWave = [&](std::size_t first) {
    GatheredWave done;
    GatherWave(scene, 0, first, kLanes).gather(0, samples, f.cache, kOpen, {}, {}, done);
    for (const GatheredTexel& texel : done.texels) gatherSum += texel.flat.x;
    rays += static_cast<double>(done.rays);
  };
  WaveTimes naive(waves), naiveEmbree(waves), naiveOutside(waves), gather(waves), embree(waves), outside(waves);
  const auto measure = [&](auto work, WaveTimes& whole, WaveTimes& inEmbree, WaveTimes& rest) {
    for (std::size_t w = 0; w < waves; ++w) whole.add(w, nsOf([&] { work(firsts[w]); }));
    for (std::size_t w = 0; w < waves; ++w) {
      const Split split = splitOf([&] { work(firsts[w]); });
      inEmbree.add(w, split.embree);
      rest.add(w, split.outside);
    }
  };
  for (auto _ : state)
    for (int round = 0; round < rounds; ++round) {
      measure(gatherWaveNaively, naive, naiveEmbree, naiveOutside);
      measure(gatherWave, gather, embree, outside);
    }
  const double raysOnce = rays / (2.0 * rounds);
  for (const auto& [name, times] : {std::pair("naive_ns", &naive), std::pair("naive_trace_ns", &naiveEmbree),
                                    std::pair("naive_outside_ns", &naiveOutside), std::pair("gather_ns", &gather),
                                    std::pair("trace_ns", &embree), std::pair("outside_ns", &outside)})
    state.counters[name] = times->sum() / raysOnce;
  state.counters["speedup"] = naive.sum() / gather.sum();
  state.counters["went_on"] = 1.0 - static_cast<double>(waves * kLanes * samples) / raysOnce;
  state.counters["agreement"] = gatherSum / naiveSum;
  state.counters["clock_ns"] = clockCost().ticks * nsPerTick();
  state.counters["triangles"] = static_cast<double>(f.grid.triangles());
}

void speedup(benchmark::State& state) {
  compare(state, static_cast<int>(state.range(0)), static_cast<std::uint32_t>(state.range(1)), modeOf(state.range(2)),
          64, 5);
}
BENCHMARK(speedup)
    ->ArgNames({"foliage", "rays", "coherent"})
    ->ArgsProduct({{Rooms, Foliage}, {64, 256, 1024}, {kNever, kAlways, kByPilot}})
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

/// The gather alone, for a profiler.
void gather(benchmark::State& state) {
  const Fixture& f = fixture(static_cast<int>(state.range(0)));
  _mm_setcsr(_mm_getcsr() | 0x8040u);
  const std::vector<std::size_t> firsts = spreadWaves(f, 256);
  std::int64_t rays = 0;
  for (auto _ : state)
    for (const std::size_t first : firsts) {
      GatherWave wave(f.scene, 0, first, kLanes);
      GatheredWave done;
      wave.gather(0, static_cast<std::uint32_t>(state.range(1)), f.cache, kOpen, {}, {}, done);
      rays += static_cast<std::int64_t>(done.rays);
    }
  state.SetItemsProcessed(rays);
}
BENCHMARK(gather)
    ->ArgNames({"foliage", "rays"})
    ->ArgsProduct({{Rooms, Foliage}, {16, 64, 256}})
    ->Unit(benchmark::kMillisecond);

void smoke(benchmark::State& state) { compare(state, Rooms, 16, modeOf(state.range(0)), 2, 1); }
BENCHMARK(smoke)
    ->ArgName("coherent")
    ->Arg(kNever)
    ->Arg(kAlways)
    ->Arg(kByPilot)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lumel

// What the linker puts in the place of Embree's calls.
extern "C" {
void __real_rtcIntersect1(RTCScene, RTCIntersectContext*, RTCRayHit*);
void __real_rtcIntersect16(const int*, RTCScene, RTCIntersectContext*, RTCRayHit16*);
void __real_rtcOccluded16(const int*, RTCScene, RTCIntersectContext*, RTCRay16*);

void __wrap_rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* ray) {
  lumel::timed([&] { __real_rtcIntersect1(scene, context, ray); });
}
void __wrap_rtcIntersect16(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit16* rays) {
  lumel::timed([&] { __real_rtcIntersect16(valid, scene, context, rays); });
}
void __wrap_rtcOccluded16(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRay16* rays) {
  lumel::timed([&] { __real_rtcOccluded16(valid, scene, context, rays); });
}
}

BENCHMARK_MAIN();
