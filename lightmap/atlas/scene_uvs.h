// Lightmap UVs that come with the scene (TEXCOORD_1): whether they are valid, and which instances can share a page.
#pragma once

#include <string>
#include <vector>

#include "lightmap/atlas/atlas_options.h"

namespace lumel {

/// One entry per instance of the scene that gets a lightmap.
struct SceneUvUse {
  int instance = 0;
  bool used = false;
  int page = 0;     // counts the pages that scene UVs need from 0, where they are places on pages
  int report = -1;  // into SceneUvs::reports; -1: no TEXCOORD_1
};

struct SceneUvs {
  std::vector<SceneUvUse> uses;   // in the order of `receivers`
  std::vector<UvReport> reports;  // of meshes that have a TEXCOORD_1 at all; of all of them under UvSource::Scene
  bool perObject = false;         // UVs are each object's own and want a rectangle for each; else places on pages
  int pageCount = 0;              // that UVs need as places on pages
};

/// Whether this primitive of an instance gets a lightmap.
bool receivesLight(const Scene& scene, const Instance& instance, const Primitive& primitive);

/// Measures TEXCOORD_1 of each mesh on a page of pageSize. Overlap is counted at 4 x 4 points per texel, each inside a
/// triangle by the half-open rule, so that triangles that share an edge do not count; charts that only share a border
/// texel (conservative coverage) do not either. Up to 0.1 % of the covered area, or sixteen texels, is taken as
/// rounding of the artist's tool. As places on pages, valid instances share a page as long as together they stay below
/// the same limit; the first page on which an instance fits is taken, in the order of the scene. Under UvSource::Auto
/// UVs are each object's own as soon as one page does not hold all of them.
SceneUvs examineSceneUvs(const Scene& scene, const std::vector<int>& receivers, const AtlasOptions& options);

/// One line that says what the UVs are taken for, of how many objects.
std::string describeUvChoice(const SceneUvs& uvs, UvSource source);

/// Instances that get a lightmap: those with a primitive that does.
std::vector<int> receiversOf(const Scene& scene);

}  // namespace lumel
