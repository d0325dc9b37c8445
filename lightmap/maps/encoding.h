// Light encodings: how the light that reaches a texel is spread over a few maps, and how a reader turns these back into
// the light on a normal. An encoding is an entry in encodings.cpp; nothing outside of this folder knows how many maps
// one has. The flat map (irradiance / pi on the texel's own normal) is kept beside every encoding, as the measure for
// errors and as what surfaces reflect.
//
// Sampling adds up what is linear in light. An encoding that is not (a direction has unit length) is made of sums that
// are, its source's, texel by texel and as the very last step: denoising, seams, dilation and holes know linear maps
// alone.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lightmap/maps/projection.h"
#include "scene/base/expected.h"
#include "scene/base/math.h"

namespace lumel {

/// The most maps that an encoding may have, or that may be sampled for several.
inline constexpr std::size_t kMostMaps = 16;

/// The name of the flat map, as a part of file names and among the maps of an encoding that reads it.
inline constexpr const char* kFlatMap = "flat";

/// The directions from which light counts: those above the surface, or all of them.
enum class Domain { Hemisphere, Sphere };
const char* nameOf(Domain domain);  // "hemisphere", "sphere"

/// The kernels K_i of one direction: one for each map, the rest 0.
using MapKernels = std::array<float, kMostMaps>;

/// The kernels of 16 directions: a row for each map; rows beyond those are left as they are.
inline constexpr std::size_t kKernelLanes = 16;
struct alignas(64) KernelLanes {
  float of[kMostMaps][kKernelLanes];
};

/// Key and text, keys without a prefix. Every encoding states basis, order, decode (a name) and decodeFormula.
using Conventions = std::map<std::string, std::string>;

class Encoding;

/// Maps next to each other that belong together.
struct MapGroup {
  std::size_t first = 0;
  std::size_t count = 0;
  bool isSigned = false;
};

/// One of the encodings that are stored of what is sampled: its own maps, or its source's, begin at `first`.
struct StoredEncoding {
  std::shared_ptr<const Encoding> encoding;
  std::size_t first = 0;
};

/// Sampled maps hold c_i = (1/pi) Integral L(w) K_i(w) dw in tangent space (t, b, n), RGB; so they are irradiance / pi.
class Encoding : public std::enable_shared_from_this<Encoding> {
 public:
  virtual ~Encoding() = default;
  Encoding(const Encoding&) = delete;
  Encoding& operator=(const Encoding&) = delete;

  const std::string& name() const { return traits_.name; }
  /// The maps' names in their order, 1 to kMostMaps of them. They are parts of file names; kFlatMap is the flat map's.
  const std::vector<std::string>& mapNames() const { return traits_.mapNames; }
  std::size_t mapCount() const { return traits_.mapNames.size(); }
  Domain domain() const { return traits_.domain; }
  /// Whether maps may be negative where light is not.
  bool isSigned() const { return traits_.isSigned; }
  const Conventions& conventions() const { return traits_.conventions; }

  /// What is sampled in place of this encoding, for `derive`; null: its own maps are.
  const std::shared_ptr<const Encoding>& source() const { return traits_.source; }

  /// Of the maps that are sampled, its own or its source's. `dirTangent`: unit length, in tangent space.
  virtual MapKernels kernels(const Vec3& dirTangent) const = 0;
  /// The same for 16 directions, coordinate by coordinate; any finite ones, so that lanes may be left unused.
  virtual void laneKernels(const float* x, const float* y, const float* z, KernelLanes& lanes) const;

  /// What becomes of a texel's sampled means, before noise is taken out of them. `flat`: the flat map's mean.
  virtual void finish(std::span<Vec3> maps, const Vec3& flat) const;

  /// Makes a texel's stored maps of what its source has sampled and finished, and of the flat map. Without a source the
  /// sampled maps are those that are stored.
  virtual void derive(std::span<const Vec3> sampled, const Vec3& flat, std::span<Vec3> maps) const;

  /// Irradiance / pi on a unit normal in tangent space, of stored maps. Never negative.
  virtual Vec3 decode(std::span<const Vec3> maps, const Vec3& normalTangent) const = 0;

  /// The encodings that are stored of what this one samples: itself, but for jointEncoding.
  virtual std::vector<StoredEncoding> stored() const;
  /// What of the sampled maps belongs together.
  virtual std::vector<MapGroup> groups() const;

 protected:
  struct Traits {
    std::string name;
    std::vector<std::string> mapNames;
    Domain domain = Domain::Hemisphere;
    bool isSigned = false;
    Conventions conventions;
    std::shared_ptr<const Encoding> source{};
  };
  explicit Encoding(Traits traits) : traits_(std::move(traits)) {}

 private:
  const Traits traits_;
};

/// The three RNM maps. `projection` is how light is spread over them, `decode` how readers weigh them; without one it
/// is the projection's own: linear for signed dots, of which it gives back max(0, N.w) where it sees all three, else
/// squared.
std::shared_ptr<const Encoding> rnmEncoding(Projection projection, RnmDecode decode);
std::shared_ptr<const Encoding> rnmEncoding(Projection projection = Projection::Flat);
/// The flat map as an encoding of its own: the same light on every normal.
std::shared_ptr<const Encoding> flatEncoding();
/// Two bands of spherical harmonics: L0 and the vector (Lx, Ly, Lz), with which irradiance / pi is L0 + N.L. Exact for
/// the first two bands of the clamped cosine (Ramamoorthi and Hanrahan 2001). Projection::Raw leaves them so; with
/// others Lz is flat - L0, so that a flat normal gets the light of the flat map.
std::shared_ptr<const Encoding> sh1Encoding(Projection projection = Projection::Flat);

/// Samples once for several encodings; `encodings` differ in their names, the first is the one that readers get unless
/// they ask for another. A single one without a source is given back as it is. Errors: Usage, where more than kMostMaps
/// maps would have to be sampled.
Expected<std::shared_ptr<const Encoding>> jointEncoding(std::vector<std::shared_ptr<const Encoding>> encodings);

/// Irradiance / pi that readers of the first stored encoding see on a normal, of sampled and finished maps.
Vec3 decodeSampled(const StoredEncoding& stored, std::span<const Vec3> sampled, const Vec3& flat,
                   const Vec3& normalTangent);

/// The encoding of that name, as the conventions of a file state it; those that are missing have their defaults.
/// Errors: Input, naming what is not known.
Expected<std::shared_ptr<const Encoding>> findEncoding(std::string_view name, const Conventions& conventions);

/// What there is, and what it is for, in a line each.
struct EncodingSummary {
  std::string name;
  std::string text;
};
std::vector<EncodingSummary> encodingSummaries();

/// The names of all encodings' maps.
const std::vector<std::string>& knownMapNames();

}  // namespace lumel
