// A bake judged by a method that shares none of its shortcuts: texels drawn at random are path traced and compared with
// the finished maps. Noise is what a stated error knows; this finds what it does not know, a light that is wrong.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "baker/light/light_transport.h"
#include "lightmap/surface.h"
#include "lightmap/texels/texels.h"
#include "scene/image.h"

namespace lumel {

struct AuditOptions {
  std::uint64_t rays = 0;  // of all kinds, about; a stratum that is suspected is looked at again and costs more
  int bounces = 0;         // as baked; the longest path where all were
  bool indirectOnly = false;
  std::uint64_t seed = 1;
};

/// Texels that are judged together: all, those of a decade of brightness, or those of an object.
struct AuditStratum {
  std::string name;
  std::size_t texels = 0;
  std::size_t drawn = 0;       // texels that were path traced, each as often as it was drawn
  double ratio = 1.0;          // mean of the map over the mean of path tracing; infinite where paths find no light
  double standardError = 0.0;  // of the ratio
  bool wrong = false;          // off by more than kAuditTolerance for certain
  // The drawn texel that speaks most for that.
  std::uint32_t page = 0;
  TexelCoord texel;
  Vec3 position{0};

  /// The smallest error of the light that could have been found.
  double detectable() const;
};

/// Errors of the mean light that are smaller than this are not reported.
inline constexpr double kAuditTolerance = 0.02;

struct AuditReport {
  AuditStratum all;
  std::vector<AuditStratum> decades;  // from the darkest up; decades with few draws are joined with their neighbours
  std::vector<AuditStratum> objects;  // those with enough draws to be judged, worst first
  std::size_t objectsNotJudged = 0;
  std::uint64_t rays = 0;  // of all kinds

  bool judged() const { return all.drawn > 0; }
  /// Largest |ratio - 1| of a stratum that is wrong for certain; 0 where none is.
  double worst() const;
};

/// Compares `flat`, one finished map per page, with path tracing. A texel is drawn with a probability that is the mean
/// of three: even over all texels, even over decades of the charts' brightness, and even over objects, so that neither
/// dark rooms nor small things are missed (Hansen and Hurwitz 1943). A stratum's ratio of means has the variance of its
/// weighed residuals. What is off by more than kAuditTolerance and three standard errors is drawn from again, four
/// times as often and with other paths, and is called wrong if these say so too. Texels that
/// are hidden (validity below one half) are not judged, and neither are those with a point inside of something, by rays
/// of the audit's own: each of that point's rays meets the back of a single-sided surface. `objectNames`: by instance.
/// Deterministic for any number of threads.
AuditReport audit(const LightTransport& transport, const Atlas& atlas, const std::vector<PageTexels>& texels,
                  std::span<const Image* const> flat, std::span<const Image* const> aux,
                  std::span<const std::string> objectNames, const AuditOptions& options);

}  // namespace lumel
