// The layout of an atlas as the next bake of an edited scene needs it: which chart was where.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lightmap/atlas/object_layouts.h"
#include "lightmap/pack/pack.h"

namespace lumel {

/// A chart of an earlier bake. `key` stands for the object's name and the chart's triangles in the object's own space:
/// an object may move, turn or be joined by others, and its charts stay what they are.
struct RememberedChart {
  std::uint64_t key = 0;
  KeptPlace place;  // page: counted from the first with generated charts
};

/// The generated part of an earlier atlas.
struct RememberedLayout {
  double chartDensity = 0.0;  // texels per metre that charts were made for
  double scale = 1.0;         // and were scaled by
  int pageSize = 0;
  int padding = 0;
  int blockAlign = 0;
  float maxStretch = 0.0f;
  std::vector<RememberedChart> charts;
};

/// Key of every chart, in the order of objects.uses and their layouts' charts. Parallel.
std::vector<std::uint64_t> chartKeys(const Scene& scene, const ObjectLayouts& objects);

/// The place of each chart that was remembered; equal charts get theirs in the order of both lists.
std::vector<std::optional<KeptPlace>> recall(const RememberedLayout& layout, std::span<const std::uint64_t> keys);

}  // namespace lumel
