// Parameterization: which surfaces get a lightmap, their charts and their places on atlas pages.
#pragma once

#include "lightmap/atlas/atlas_options.h"
#include "lightmap/surface.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"

namespace lumel {

struct AtlasResult {
  Atlas atlas;
  AtlasReport report;
};

/// Unwraps and packs every receiving instance (ObjectSettings::receives, material not unlit, not fully transparent).
/// Instances whose scene UVs are used get pages of pageSize before all others, with their UVs as given: instances that
/// do not overlap share a page (a set unwrapped onto one atlas stays together), others get pages of their own.
/// A chart may run over several primitives of an instance: it then lies in several surfaces.
/// Deterministic: the same scene and options give the same atlas for any thread count.
/// Errors: Usage (page too small for the density asked), Input (UvSource::Scene with invalid UVs), Interrupted.
Expected<AtlasResult> buildAtlas(const Scene& scene, const AtlasOptions& options, Progress& progress);

}  // namespace lumel
