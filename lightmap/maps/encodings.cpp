// The table of encodings, and what all of them share.
#include <algorithm>

#include "lightmap/maps/encoding_entries.h"
#include "scene/base/check.h"

namespace lumel {
namespace {

class FlatEncoding : public Encoding {
 public:
  FlatEncoding()
      : Encoding({.name = "flat",
                  .mapNames = {kFlatMap},
                  .conventions = {{"basis", "the texel's normal"},
                                  {"order", "one map"},
                                  {"decode", "flat"},
                                  {"decodeFormula", "L = map"}}}) {}

  MapKernels kernels(const Vec3& dirTangent) const override { return {std::max(0.0f, dirTangent.z)}; }
  void derive(std::span<const Vec3>, const Vec3& flat, std::span<Vec3> maps) const override { maps[0] = flat; }
  Vec3 decode(std::span<const Vec3> maps, const Vec3&) const override { return maps[0]; }
};

struct Entry {
  const char* name;
  const char* summary;  // for the help of the command line
  Expected<std::shared_ptr<const Encoding>> (*make)(const Conventions& conventions);
};
Expected<std::shared_ptr<const Encoding>> statedFlatEncoding(const Conventions&) { return flatEncoding(); }

constexpr std::array<Entry, 7> kEntries = {{
    {"rnm", "3 maps, for normal maps and ssbump maps as in the literature", statedRnmEncoding},
    {"flat", "1 map, the same light on every normal: surfaces without normal maps", statedFlatEncoding},
    {"sh1", "4 signed maps, spherical harmonics L0 and L1: what most engines read", statedSh1Encoding},
    {"h4", "4 signed maps, the H-basis: for their size the closest on normals that lean far", statedHBasisEncoding},
    {"zh3", "5 signed maps, sh1 and a zonal second band: the closest of all", statedZh3Encoding},
    {"ahd", "3 maps, ambient light and one light with its direction: crisp under sun and lamps", statedAhdEncoding},
    {"dominant", "1 map beside the flat one, a direction: cheapest, as Unity's directional mode reads it",
     statedDominantEncoding},
}};

}  // namespace

const char* nameOf(Domain domain) { return domain == Domain::Hemisphere ? "hemisphere" : "sphere"; }

void Encoding::laneKernels(const float* x, const float* y, const float* z, KernelLanes& lanes) const {
  for (std::size_t lane = 0; lane < kKernelLanes; ++lane) {
    const MapKernels k = kernels(Vec3(x[lane], y[lane], z[lane]));
    for (std::size_t map = 0; map < mapCount(); ++map) lanes.of[map][lane] = k[map];
  }
}

void Encoding::finish(std::span<Vec3>, const Vec3&) const {}

void Encoding::derive(std::span<const Vec3> sampled, const Vec3&, std::span<Vec3> maps) const {
  std::copy_n(sampled.begin(), maps.size(), maps.begin());
}

std::vector<StoredEncoding> Encoding::stored() const { return {{shared_from_this(), 0}}; }

std::vector<MapGroup> Encoding::groups() const { return {{0, mapCount(), isSigned()}}; }

Vec3 decodeSampled(const StoredEncoding& stored, std::span<const Vec3> sampled, const Vec3& flat,
                   const Vec3& normalTangent) {
  std::array<Vec3, kMostMaps> values;
  const auto maps = std::span(values).first(stored.encoding->mapCount());
  stored.encoding->derive(sampled.subspan(stored.first), flat, maps);
  return stored.encoding->decode(maps, normalTangent);
}

std::shared_ptr<const Encoding> flatEncoding() { return std::make_shared<FlatEncoding>(); }

std::string statedOr(const Conventions& conventions, const char* key, const char* usual) {
  const auto found = conventions.find(key);
  return found == conventions.end() ? usual : found->second;
}

Projection statedExactness(const Conventions& conventions) {
  const bool isRaw = statedOr(conventions, "projection", nameOf(Projection::Flat)) == nameOf(Projection::Raw);
  return isRaw ? Projection::Raw : Projection::Flat;
}

Expected<std::shared_ptr<const Encoding>> findEncoding(std::string_view name, const Conventions& conventions) {
  std::string known;
  for (const Entry& entry : kEntries) {
    if (entry.name == name) return entry.make(conventions);
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  return inputError("'" + std::string(name) + "' is not an encoding that this version knows (" + known + ")");
}

std::vector<EncodingSummary> encodingSummaries() {
  std::vector<EncodingSummary> summaries;
  for (const Entry& entry : kEntries) summaries.push_back({entry.name, entry.summary});
  return summaries;
}

const std::vector<std::string>& knownMapNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Entry& entry : kEntries) {
      const auto encoding = entry.make({});
      LUMEL_CHECK(encoding && (*encoding)->mapCount() <= kMostMaps);
      for (const std::string& name : (*encoding)->mapNames())
        if (std::find(all.begin(), all.end(), name) == all.end()) all.push_back(name);
    }
    return all;
  }();
  return names;
}

}  // namespace lumel
