// Preloaded into a program (LD_PRELOAD), says at its end how much of the CPU time of all its threads was spent in calls
// of Embree, callbacks of cut-outs and the building of scenes included.
#include <dlfcn.h>
#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <limits>

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Of the whole program.
double cpuSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// What reading the clock takes: a call reads it twice, of which one falls into its own time.
double secondsPerReading() {
  double least = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 100; ++run) {
    constexpr int kReadings = 1000;
    const Clock::time_point start = Clock::now();
    for (int i = 0; i + 1 < kReadings; ++i) Clock::now();
    least = std::min(least, secondsSince(start) / kReadings);
  }
  return least;
}

struct alignas(64) Tally {
  double seconds = 0.0;
  std::uint64_t calls = 0;
};

/// Of each thread, in places that outlive it.
struct Report {
  static constexpr std::size_t kMostThreads = 1024;
  Tally tallies[kMostThreads];
  std::atomic<std::size_t> threads{0};
  std::atomic<double> building{0.0};
  double reading = secondsPerReading();

  Tally& ofThread() {
    thread_local Tally& mine = tallies[std::min(threads++, kMostThreads - 1)];
    return mine;
  }
  ~Report() {
    Tally all;
    for (const Tally& tally : tallies) {
      all.seconds += tally.seconds;
      all.calls += tally.calls;
    }
    if (all.calls == 0) return;
    const double readings = reading * static_cast<double>(all.calls);
    const double embree = all.seconds - readings + building;
    const double cpu = cpuSeconds() - 2.0 * readings;
    std::fprintf(stderr, "Embree: %.1f of %.1f CPU s, %.1f%% (%.2f s of it building; %.1f million calls)\n", embree,
                 cpu, 100.0 * embree / cpu, building.load(), 1e-6 * static_cast<double>(all.calls));
  }
};
Report report;

/// The function that this library stands before.
template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

template <class Call>
void timed(Call call) {
  Tally& tally = report.ofThread();
  const Clock::time_point start = Clock::now();
  call();
  tally.seconds += secondsSince(start);
  ++tally.calls;
}

}  // namespace

extern "C" {

void rtcIntersect16(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit16* rays) {
  static auto* const embree = next<decltype(rtcIntersect16)>("rtcIntersect16");
  timed([&] { embree(valid, scene, context, rays); });
}

void rtcOccluded16(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRay16* rays) {
  static auto* const embree = next<decltype(rtcOccluded16)>("rtcOccluded16");
  timed([&] { embree(valid, scene, context, rays); });
}

/// Works on all threads, while nothing else does.
void rtcCommitScene(RTCScene scene) {
  static auto* const embree = next<decltype(rtcCommitScene)>("rtcCommitScene");
  const double before = cpuSeconds();
  embree(scene);
  report.building = report.building + cpuSeconds() - before;
}
}
