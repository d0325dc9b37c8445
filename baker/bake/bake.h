// The main job: irradiance at every texel of an atlas, as the maps of an encoding.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "baker/audit/audit.h"
#include "baker/bake/bake_options.h"
#include "lightmap/seams/seam_maps.h"
#include "lightmap/seams/seams.h"
#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"
#include "lightmap/volume/light_volume.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/image.h"
#include "scene/scene.h"

namespace lumel {

/// One atlas page. All images have the page's size; texels without coverage are 0 everywhere.
struct BakedPage {
  std::vector<Image> maps;  // RGB: those that BakeOptions::encoding samples, in their order; see encodePages
  Image flat;               // RGB: irradiance / pi
  // Channels of aux, in order: coverage (area share 0..1), validity (share of gather rays that met no back of a
  // single-sided surface), stderr (standard error of the flat map's luminance; NaN: not known), samples (those taken of
  // this texel: fewer where its error has settled, or where it is inside of something).
  Image aux;
  Image mapErrors;  // a channel for each map that is sampled: standard error of its luminance; NaN: not known
};

/// Mean standard error of a map's luminance over covered, valid texels of which it is known.
struct MapErrorFigure {
  std::string map;
  double mean = 0.0;
};

/// Cost and error figures of a bake, written to bake.json.
struct BakeStats {
  std::uint64_t texels = 0;
  std::uint64_t rays = 0;        // closest-hit
  std::uint64_t shadowRays = 0;  // occlusion
  double seconds = 0.0;
  std::uint64_t cutPaths = 0;        // paths that were ended by force, named in `notes` (kMostLosslessHits)
  std::size_t nonFiniteSamples = 0;  // counted and left out of the sums, named in `notes`; never silently zeroed
  double meanFlat = 0.0;             // mean luminance over covered, valid texels
  std::vector<MapErrorFigure>
      errors;                       // of the flat map and the others, as the pages have them; none of too few samples
  double projectionResidual = 0.0;  // RMS difference between decoded and true irradiance / pi over sample normals
                                    // within 30 degrees, relative to meanFlat
  SeamFigures seams;                // known after finishPages alone
  std::vector<std::string> notes;
};

/// The map whose error is the greatest. Precondition: there is one.
inline const MapErrorFigure& worstOf(std::span<const MapErrorFigure> errors) {
  return *std::ranges::max_element(errors, {}, &MapErrorFigure::mean);
}

struct BakeResult {
  std::vector<BakedPage> pages;
  Seams seams;  // for finishPages; none where the options say so
  BakeStats stats;
  std::optional<AuditReport> audit;  // auditBake
  std::vector<Image> shadowMasks;    // RGBA, by page: bakeShadowMasks; empty: not asked for
  std::vector<LightVolume> volumes;  // bakeVolumes
};

class LitScene;
struct GatherSession;

/// Finds the light at every covered texel. The result depends on scene, atlas and options alone, bit for bit, never on
/// the number of threads. Errors: Failed (Embree, memory), Interrupted.
Expected<BakeResult> bake(const Scene& scene, const Atlas& atlas, const std::vector<PageTexels>& texels,
                          const BakeOptions& options, Progress& progress);

/// The same for a scene that is used more than once. Precondition: it has albedo, or no bounces are asked for.
/// `session`: with Integrator::Gather, lets the bake be stopped and gone on with; null: neither. Errors: Interrupted;
/// Input, where the session's state is of another bake.
Expected<BakeResult> bake(const LitScene& scene, const Atlas& atlas, const std::vector<PageTexels>& texels,
                          const BakeOptions& options, Progress& progress, GatherSession* session = nullptr);

/// The errors that the pages state, the flat map's first; empty where none is known.
std::vector<MapErrorFigure> statedErrors(std::span<const BakedPage> pages, const Encoding& encoding);

/// Tells the states of one bake from those of others (readState): a hash of options, texels and surfaces.
std::uint64_t sessionKey(const LitScene& scene, const Atlas& atlas, const std::vector<PageTexels>& texels,
                         const BakeOptions& options);

/// Path tracing for an audit takes this share of the rays of the bake, which is about a twentieth of its time, and at
/// least kAuditRays, below which hardly anything can be told.
inline constexpr double kAuditShare = 0.02;
inline constexpr std::uint64_t kAuditRays = 400'000;

/// Judges the finished pages of `result` by path tracing (audit.h), and keeps the report in it. `objectNames`: of the
/// scene's instances.
void auditBake(const LitScene& scene, const Atlas& atlas, const std::vector<PageTexels>& texels,
               const BakeOptions& options, std::span<const std::string> objectNames, BakeResult& result);

}  // namespace lumel
