// What a bake of light is asked for.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "lightmap/maps/encoding.h"

namespace lumel {

enum class Integrator {
  Gather,  // progressive final gather: clean at few samples, with a small bias (README)
  Path,    // path tracing: unbiased, the reference
};

/// As many indirect bounces as matter.
inline constexpr int kAllBounces = -1;

struct BakeOptions {
  Integrator integrator = Integrator::Gather;
  // Gather rays per texel, any count >= 1; with a target error the least, with a time budget or `adaptive` the most.
  int samples = 256;
  // Gather alone: no more samples, after 32, where the error of the worst map is too small to be seen beside that of
  // texels that take all.
  bool adaptive = true;
  int bounces = kAllBounces;  // indirect bounces; 0 = direct light only
  // Gather alone: sampling goes on until the relative standard error of the worst map is so small at 95% of the texels
  // around, or `maxSamples` are taken; texels darker than a tenth of the place that lights them are judged as if they
  // were so bright. 0: off.
  float targetError = 0.0f;
  int maxSamples = 16384;
  // Gather alone: no pass is begun that would end later than this; 0: none. The only option whose result depends on
  // the machine.
  float timeBudgetSeconds = 0.0f;
  bool indirectOnly = false;  // without what arrives straight from lights, shining surfaces and the sky
  // Find where lookups from both sides of charts' borders shall agree. Exact for tiles; on levels with few texels a
  // chart it moves partly covered ones too far.
  bool seams = false;
  std::uint64_t seed = 1;
  std::shared_ptr<const Encoding> encoding = rnmEncoding();  // jointEncoding for several
};

/// Names as they stand in files and messages.
inline const char* nameOf(Integrator integrator) { return integrator == Integrator::Gather ? "gather" : "path"; }
inline std::string describeBounces(int bounces) { return bounces == kAllBounces ? "all" : std::to_string(bounces); }

}  // namespace lumel
