// What a parameterization is asked for, and what it reports.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "lightmap/atlas/layout_memory.h"

namespace lumel {

enum class UvSource {
  Auto,      // per mesh: a valid TEXCOORD_1 is used, else charts are generated; Object where objects' UVs overlap
  Scene,     // TEXCOORD_1 is a place on a page: an invalid or missing one is an Input error with figures
  Object,    // TEXCOORD_1 is each object's own: a valid one gets a rectangle per instance, else charts are generated
  Generate,  // charts are always generated
  AsGiven,   // TEXCOORD_1 wherever there is one, valid or not: to be examined, not to be baked
};

struct AtlasOptions {
  UvSource uvSource = UvSource::Auto;
  float texelsPerMeter = 0.0f;  // 0: the density that fills one page of pageSize, but no more than the mean density
                                // of those of the scene's own lightmaps that are used
  int pageSize = 1024;          // texels on a side; a multiple of 4
  int padding = 2;              // texels between charts, at least, and to the page's border half of it
  float maxStretch = 1.25f;     // a chart is split where its largest singular value (relative to uniform) exceeds this
  int blockAlign = 0;           // no block of so many texels a side holds two charts (4 for block compression); 0 = off
  // An earlier layout: generated charts that did not change stay where they were, at its density. Not used if density
  // (where given), page size, padding, blocks or stretch differ from it.
  std::shared_ptr<const RememberedLayout> layout = {};
};

/// What a scene-supplied TEXCOORD_1 was found to be. Valid means: present, finite, in 0..1, and no texel covered twice.
struct UvReport {
  std::string mesh;           // name of the first instance of the mesh
  std::size_t instances = 0;  // that have it
  bool present = false;
  bool valid = false;
  std::size_t outOfRangeVertices = 0;
  std::size_t zeroAreaTriangles = 0;
  double overlapTexels = 0.0;  // texel area covered more than once, in texels of the page
  double coveredTexels = 0.0;
  double extentTexels = 0.0;            // longer side of the box around all UVs, where these are in range
  std::size_t frameCrossingTexels = 0;  // texels in charts that cross a break of the material's tangent frame

  /// UVs narrower than this on a page, in texels, hold one value for the whole object at best.
  static constexpr double kLeastExtentTexels = 0.1;
  /// Tells whether the UVs have area, but as good as none on the page.
  bool isTooNarrow() const { return extentTexels > 0.0 && extentTexels < kLeastExtentTexels; }
};

/// Figures of the parameterization for logs, bake.json and `lumel info`.
struct AtlasReport {
  std::vector<UvReport> sceneUvs;  // one per mesh that has a TEXCOORD_1
  std::vector<std::string> warnings;
  std::string uvChoice;               // one line: what the scene's UVs were taken for
  std::size_t objectsWithOwnUvs = 0;  // that got a rectangle for their own UVs
  std::size_t generatedCharts = 0;
  std::size_t keptCharts = 0;  // of rectangles and generated charts: where they were in AtlasOptions::layout
  double keptShare = 0.0;      // of their surface
  std::size_t nonManifoldEdges = 0;
  std::size_t degenerateTriangles = 0;  // without area: they are in no chart and get no texels
  double chartSeconds = 0.0;
  double packSeconds = 0.0;
};

}  // namespace lumel
