// All that a gather knows between two waves, as plain data: it can be written at any time when no wave is being worked
// on, in the middle of a pass too, and gathering goes on from what was read with the same result, bit for bit.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <span>
#include <vector>

#include "baker/gather/doubling_error.h"
#include "baker/gather/waves/gather_scene.h"
#include "baker/gather/waves/light_effort.h"
#include "baker/gather/waves/packed_color.h"
#include "baker/rays/non_finite.h"
#include "lightmap/maps/projection_probe.h"
#include "scene/base/expected.h"

namespace lumel {

struct GatherOptions {
  int samples = 1;     // per texel; with a time budget the most, with a target error the least
  int maxSamples = 1;  // with a target error: the most
  int bounces = -1;    // indirect bounces; negative: all that matter
  bool indirectOnly = false;
  std::uint64_t seed = 1;
  float targetError = 0.0f;        // relative standard error at which a wave of texels is done; 0: none
  bool adaptive = false;           // without a target: a wave is done where more samples would not be seen
  double timeBudgetSeconds = 0.0;  // no pass is begun that would probably end later; 0: none
};

/// Light of all texels, numbered through as in TexelMap: a vector for each map, so that each can be freed once its
/// image is made.
struct TexelLight {
  std::vector<Vec3> flat;
  std::vector<std::vector<Vec3>> maps;  // of the encoding

  void resize(std::size_t count, std::size_t mapCount);
};

/// Whether a texel that sees backs lies inside of something. In the open they count as what they are, surfaces.
enum class Cover : std::uint8_t { Unknown, Inside, Open };

struct GatherState {
  struct OfWave {
    std::uint32_t samples = 0;         // it has taken [0, samples) of each of its texels
    std::uint32_t done = 0;            // 1: as good as its goal
    Emitters sampled = Emitters::All;  // what its light samples look for, from the warm-up on
    // For the flat map and the others: sum over texels of the square of how far their means moved in the last pass.
    std::array<float, 1 + kMostMaps> moved{};
  };
  struct NonFiniteOfWave {
    std::uint32_t wave = 0;
    NonFiniteSample sample;
  };

  std::uint32_t samples = 0;      // of the passes that are closed
  std::uint32_t openEnd = 0;      // where the samples of the open pass end; 0: none is open
  std::uint32_t isWarm = 0;       // 1: the warm-up is over
  double seconds = 0.0;           // spent so far
  double passBegan = 0.0;         // seconds when the open pass began
  double secondsPerSample = 0.0;  // of the last pass that was closed

  std::vector<OfWave> waves;
  std::vector<LightSpread> spreads;  // per wave: of each of GatherScene::strategies, and of the gather rays
  DoublingError errors;

  // Sums over all samples so far, per texel:
  TexelLight sums;
  std::vector<Vec3> levelSums;                          // levels.count per texel, unless endless
  std::vector<std::array<Vec3, kProbeNormals>> probes;  // of Waves::probes
  std::vector<std::uint32_t> backFaces;                 // rays that met backs
  std::vector<std::uint32_t> samplesOf;
  std::vector<float> coverage;
  std::vector<Cover> covers;         // of texels most of whose rays met backs
  std::vector<std::uint8_t> buried;  // 1: nothing more is gathered for the texel

  // The cache, per texel:
  std::vector<PackedColor> reflectance;
  std::vector<PackedColor> radiance;  // that the texel reflects: levels.count each
  std::vector<std::uint8_t> uneven;   // WarmTexel::isUneven
  // Mean luminance of the flat map in the place that lights the texel: what it sees, where it has light of its own, and
  // what is seen from where its light comes from by bounces. What is bright or dark, and how much an error matters, is
  // told by it alone: places that share no light are judged apart. Of a bake of no bounces: of the waves around. 0: the
  // warm-up found no light.
  std::vector<float> places;
  // With GatherScene::leavesLightOut alone: light from light samples that the maps leave out; with indirectOnly sums of
  // what the rays of all passes saw shine.
  std::vector<Vec3> direct;
  std::vector<Vec3> seen;

  std::uint64_t rays = 0;
  std::uint64_t shadowRays = 0;
  std::vector<NonFiniteOfWave> nonFinite;  // of closed passes, and behind them of the open one in any order
  std::uint64_t closedNonFinite = 0;       // how many of them are of closed passes

  /// A gather that has not begun.
  explicit GatherState(const GatherScene& scene);
  GatherState() = default;
  /// Makes room for what the passes sum up: after the warm-up, whose links are gone by then.
  void makeSums(const GatherScene& scene);
  /// Frees what only further passes need.
  void dropCache();
  /// Whether all vectors are as long as the scene needs them.
  bool fits(const GatherScene& scene) const;
  std::uint64_t samplesTaken(const GatherScene& scene) const;

  std::span<LightSpread> spreadsOf(const GatherScene& scene, std::size_t wave);
  /// Samples of a texel, at least 1.
  float weightOf(std::size_t texel) const { return static_cast<float>(std::max(1u, samplesOf[texel])); }
  /// Irradiance / pi of the flat map.
  Vec3 meanLight(std::size_t texel) const { return sums.flat[texel] / weightOf(texel); }
  /// Standard error of the flat map's luminance at texel `i` of a wave.
  float errorOf(const Waves& waves, std::size_t wave, std::size_t i) const;
};

/// Tells one gather from others: a hash of its options, texels and surfaces, for readState. What else a scene holds is
/// for the caller to compare.
std::uint64_t gatherKey(const GatherScene& scene, const GatherOptions& options);

/// Writes a state: a version, the key, all members and a checksum, in the byte order of this machine. Errors: Failed
/// (the stream does not take it).
Expected<void> writeState(const GatherState& state, std::uint64_t key, std::ostream& out);

/// Reads what writeState wrote. Errors: Input, if it is no state, of another version, of another gather (its key
/// differs), cut off or damaged. A count that is wrong asks for no more memory than twice what the stream holds.
Expected<GatherState> readState(std::istream& in, std::uint64_t key);

}  // namespace lumel
