// Lightmap UVs that come with the scene (TEXCOORD_1): whether they are valid, and which instances can share a page.
#pragma once

#include <vector>

#include "lightmap/atlas/atlas_options.h"

namespace lumel {

/// One entry per instance of the scene that gets a lightmap; `page` counts the pages that scene UVs need from 0.
struct SceneUvUse {
  int instance = 0;
  bool used = false;
  int page = 0;
  int report = -1;  // into SceneUvs::reports; -1: no TEXCOORD_1
};

struct SceneUvs {
  std::vector<SceneUvUse> uses;   // in the order of `receivers`
  std::vector<UvReport> reports;  // of those whose meshes have a TEXCOORD_1 at all; all of them under UvSource::Scene
  int pageCount = 0;
};

/// Whether this primitive of an instance gets a lightmap.
bool receivesLight(const Scene& scene, const Instance& instance, const Primitive& primitive);

/// Measures TEXCOORD_1 of each receiving instance on a page of pageSize. Overlap is counted at 4 x 4 points per texel,
/// each inside a triangle by the half-open rule, so that triangles that share an edge do not count; charts that only
/// share a border texel (conservative coverage) do not either. Up to 0.1 % of the covered area, or sixteen texels, is
/// taken as rounding of the artist's tool. Valid instances share a page as long as together they stay below the same
/// limit; the first page on which an instance fits is taken, in the order of the scene.
SceneUvs examineSceneUvs(const Scene& scene, const std::vector<int>& receivers, const AtlasOptions& options);

}  // namespace lumel
