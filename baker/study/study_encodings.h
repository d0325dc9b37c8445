// What encodings cost and lose: one scene, baked in each with the same rays, held against irradiance that was summed up
// for many normals from these rays.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "baker/bake/bake_options.h"
#include "lightmap/atlas/atlas.h"
#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/scene.h"

namespace lumel {

struct EncodingStudyOptions {
  AtlasOptions atlas;
  int bounces = kAllBounces;
  Projection projection = Projection::Flat;
  std::uint64_t seed = 1;
  int samples = 256;  // of the gather, the same at every texel
};

/// One encoding. Errors are root mean squares over RGB of covered, valid texels and over normals, relative to that of
/// the truth.
struct EncodingFigures {
  std::string name;         // with a word where there are several: "rnm signed", "sh1 converted" (lumel convert)
  std::size_t maps = 0;     // that readers need, RGB, the flat one too where they read it
  double within30 = 0.0;    // normals within 30 degrees of the texel's, evenly by solid angle
  double within60 = 0.0;    // within 60
  double negative = 0.0;    // light below zero before it is cut, over all light, normals within 60 degrees
  double cpuSeconds = 0.0;  // of a bake in this encoding alone
};

struct EncodingStudy {
  std::size_t texels = 0;
  double meanFlat = 0.0;
  std::vector<EncodingFigures> encodings;
};

/// Errors: those of buildAtlas and bake; Input where the scene is dark.
Expected<EncodingStudy> studyEncodings(const Scene& scene, const EncodingStudyOptions& options, Progress& progress);

/// A table for a README (Markdown).
std::string encodingStudyMarkdown(const EncodingStudy& study, const std::string& scene, int samples);

/// encodings.md and encodings.json, both or neither. Errors: Failed.
Expected<void> writeEncodingStudy(const std::filesystem::path& dir, const EncodingStudy& study,
                                  const std::string& scene, int samples, const nlohmann::ordered_json& settings);

}  // namespace lumel
