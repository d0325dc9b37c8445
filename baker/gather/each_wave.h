// The parallel loop over waves.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "baker/gather/gather_state.h"
#include "baker/gather/waves/gather_sink.h"
#include "baker/rays/flush_denormals.h"
#include "scene/base/parallel.h"
#include "scene/base/progress.h"

namespace lumel {

/// Calls body(wave index, GatheredWave&) for the waves [first, end), from several threads; what they count is added to
/// the state in their order. Errors: Interrupted; the state then counts the waves that were worked on.
template <class Body>
Expected<void> forEachWave(std::size_t first, std::size_t end, GatherState& state, Progress& progress, Body body) {
  struct Counts {
    std::uint64_t rays = 0;
    std::uint64_t shadowRays = 0;
    std::vector<NonFiniteSample> nonFinite;
  };
  std::vector<Counts> counts(end - first);
  parallelFor(counts.size(), 1, [&](std::size_t from, std::size_t to) {
    const FlushDenormals flush;
    for (std::size_t i = from; i < to && !progress.cancelled(); ++i) {
      GatheredWave done;
      body(first + i, done);
      counts[i] = {done.rays, done.shadowRays, std::move(done.nonFinite)};
    }
  });
  for (std::size_t i = 0; i < counts.size(); ++i) {
    state.rays += counts[i].rays;
    state.shadowRays += counts[i].shadowRays;
    for (const NonFiniteSample& sample : counts[i].nonFinite)
      state.nonFinite.push_back({static_cast<std::uint32_t>(first + i), sample});
  }
  if (progress.cancelled()) return interrupted();
  return {};
}

}  // namespace lumel
