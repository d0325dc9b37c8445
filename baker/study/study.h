// Error against cost: one scene baked in many ways and held against a long path-traced bake.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "baker/bake/bake.h"
#include "lightmap/atlas/atlas.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/scene.h"

namespace lumel {

struct StudyOptions {
  AtlasOptions atlas;
  int bounces = kAllBounces;
  Projection projection = Projection::Flat;  // of all series but the one over projections
  std::uint64_t seed = 1;
  int mostSamples = 1024;          // of the gather's series, which doubles from kStudyLeastSamples
  int referenceSamples = 0;        // of each half of the reference; 0: as many as half of the budget allows
  double timeBudgetSeconds = 180;  // bakes that would probably end later are left out and named; 0: none
};

inline constexpr int kStudyLeastSamples = 4;

/// Error of maps against the reference, over RGB of covered, valid texels. The reference's own noise is taken off in
/// quadrature.
struct MapError {
  double rmse = 0.0;  // relative to the mean
  double bias = 0.0;  // mean difference, relative to the mean
};

/// One bake.
struct StudyPoint {
  std::string series{};   // "gather", "denoised" (the same bakes), "path", "projection", "density"
  std::string quality{};  // the name of the sample count, where it has one
  Integrator integrator = Integrator::Gather;
  Projection projection = Projection::Flat;
  int samples = 0;
  float texelsPerMeter = 0.0f;  // 0: the scene's own UVs
  std::uint64_t texels = 0;
  std::uint64_t rays = 0;   // all kinds
  double seconds = 0.0;     // wall time of the bake: acceleration structure and sampling
  double cpuSeconds = 0.0;  // the same on all threads
  bool hasMaps = false;     // flat, rnm and withinInterval are known: same texels and projection as the reference
  MapError flat{};
  MapError rnm{};  // the three maps together
  // Share of lit texels within 1.96 standard errors (and the reference's); negative: too few samples tell of none.
  double withinInterval = -1.0;
  double withinRnm = -1.0;  // the same of the three maps together, by their own errors
  double claimed = 0.0;     // root mean square of the flat map's standard errors, relative to the mean
  double residual = -1.0;   // series "projection": RMS of decoded minus true light over normals within 30 degrees
  double seen = -1.0;       // series "density": relative RMSE of bilinear lookups at the reference's texels
};

struct StudyReference {
  int samples = 0;  // of each of its two halves
  double seconds = 0.0;
  double cpuSeconds = 0.0;
  std::uint64_t rays = 0;
  double meanFlat = 0.0;   // over RGB
  double flatError = 0.0;  // relative RMSE that remains, from how its halves differ
  double rnmError = 0.0;
};

struct Study {
  std::size_t texels = 0;
  float texelsPerMeter = 0.0f;
  StudyReference reference;
  std::vector<StudyPoint> points;
  std::vector<std::string> notes;  // what was left out and why
};

/// Bakes and compares. The reference is path traced with seeds that no candidate has; so it shares neither samples nor,
/// with the gather, method with them. Errors: those of buildAtlas and bake; Usage where the budget does not even allow
/// a reference; Input where the scene is dark.
Expected<Study> study(const Scene& scene, const StudyOptions& options, Progress& progress);

}  // namespace lumel
