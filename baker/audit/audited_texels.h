// Path tracing of the texels that an audit drew.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "baker/audit/audit.h"
#include "baker/audit/audit_draws.h"
#include "baker/path/path_integrator.h"
#include "lightmap/maps/encoding.h"

namespace lumel {

class AuditTracer {
 public:
  /// Paths of each draw: few, so that many texels are seen; a power of two, so that they cover texel and hemisphere
  /// evenly.
  static constexpr int kPathsPerDraw = 16;

  /// Keeps references to its arguments.
  AuditTracer(const LightTransport& transport, const Atlas& atlas, const std::vector<PageTexels>& texels,
              std::span<const Image* const> flat, std::span<const Image* const> aux, const AuditPopulation& population,
              const AuditOptions& options);

  /// Finds map, paths and position of every draw. The result depends on the draws alone.
  void trace(std::span<AuditDraw> draws);

  /// So far, of all kinds.
  std::uint64_t rays() const { return rays_; }
  /// Another one with every call.
  std::uint64_t nextSeed() { return options_.seed + 0x9e3779b97f4a7c15u * ++seeds_; }

 private:
  struct Counts {
    std::uint64_t rays = 0;
  };
  void traceWave(std::span<AuditDraw* const> wave, Counts& counts) const;
  /// Whether no point of a texel is inside of something.
  bool liesInTheOpen(const TexelFootprint& footprint, std::uint32_t seed, Counts& counts) const;
  bool isInside(const SurfacePoint& point, std::uint32_t seed, Counts& counts) const;

  const LightTransport& transport_;
  const Atlas& atlas_;
  const std::vector<PageTexels>& texels_;
  std::span<const Image* const> flat_;
  std::span<const Image* const> aux_;
  const AuditPopulation& population_;
  AuditOptions options_;
  std::shared_ptr<const Encoding> encoding_ = flatEncoding();  // nothing but the flat map is looked at
  std::uint64_t rays_ = 0;
  std::uint64_t seeds_ = 0;
};

}  // namespace lumel
