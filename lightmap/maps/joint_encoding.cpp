// jointEncoding of encoding.h: sampling once for several encodings.
#include <algorithm>

#include "lightmap/maps/encoding.h"
#include "scene/base/check.h"

namespace lumel {
namespace {

/// An encoding that is sampled, with the place of its maps among all.
struct Part {
  std::shared_ptr<const Encoding> encoding;
  std::size_t first = 0;
};

struct Plan {
  std::vector<StoredEncoding> stored;
  std::vector<Part> parts;
  std::size_t maps = 0;
};

/// Whether light is spread over the first maps of `one` as over those of `other`: told by a direction of no symmetry.
bool beginsWith(const Encoding& one, const Encoding& other) {
  const Vec3 direction(0.36f, -0.48f, 0.8f);
  const MapKernels ofOne = one.kernels(direction), ofOther = other.kernels(direction);
  return one.mapCount() >= other.mapCount() &&
         std::equal(ofOther.begin(), ofOther.begin() + static_cast<std::ptrdiff_t>(other.mapCount()), ofOne.begin());
}

const std::shared_ptr<const Encoding>& sampledFor(const std::shared_ptr<const Encoding>& encoding) {
  return encoding->source() ? encoding->source() : encoding;
}

/// An encoding of the flat map alone: it is sampled in any case.
bool isFlat(const Encoding& encoding) { return encoding.mapCount() == 1 && encoding.mapNames().front() == kFlatMap; }

/// What is sampled for the first encoding comes first. A source may serve others that need only its first maps.
Plan planOf(std::vector<std::shared_ptr<const Encoding>> encodings) {
  Plan plan;
  std::vector<std::shared_ptr<const Encoding>> sampled;
  for (const auto& encoding : encodings)
    if (!isFlat(*encoding)) sampled.push_back(sampledFor(encoding));
  const auto servedByOther = [&](std::size_t i) {
    for (std::size_t j = 0; j < sampled.size(); ++j) {
      const bool isLarger = sampled[j]->mapCount() > sampled[i]->mapCount();
      const bool isEarlier = sampled[j]->mapCount() == sampled[i]->mapCount() && j < i;
      if ((isLarger || isEarlier) && beginsWith(*sampled[j], *sampled[i])) return true;
    }
    return false;
  };
  for (std::size_t i = 0; i < sampled.size(); ++i) {
    if (servedByOther(i)) continue;
    plan.parts.push_back({sampled[i], plan.maps});
    plan.maps += sampled[i]->mapCount();
  }
  for (auto& encoding : encodings) {
    std::size_t first = 0;
    if (!isFlat(*encoding))
      first = std::ranges::find_if(plan.parts, [&](const Part& part) {
                return beginsWith(*part.encoding, *sampledFor(encoding));
              })->first;
    plan.stored.push_back({std::move(encoding), first});
  }
  return plan;
}

class JointEncoding : public Encoding {
 public:
  explicit JointEncoding(Plan plan) : Encoding(traitsOf(plan)), plan_(std::move(plan)) {}

  MapKernels kernels(const Vec3& dirTangent) const override {
    MapKernels all{};
    for (const Part& part : plan_.parts) {
      const MapKernels own = part.encoding->kernels(dirTangent);
      std::copy_n(own.begin(), part.encoding->mapCount(), all.begin() + static_cast<std::ptrdiff_t>(part.first));
    }
    return all;
  }
  void laneKernels(const float* x, const float* y, const float* z, KernelLanes& lanes) const override {
    KernelLanes own;
    for (const Part& part : plan_.parts) {
      part.encoding->laneKernels(x, y, z, own);
      for (std::size_t map = 0; map < part.encoding->mapCount(); ++map)
        std::copy_n(own.of[map], kKernelLanes, lanes.of[part.first + map]);
    }
  }
  void finish(std::span<Vec3> maps, const Vec3& flat) const override {
    for (const Part& part : plan_.parts)
      part.encoding->finish(maps.subspan(part.first, part.encoding->mapCount()), flat);
  }
  Vec3 decode(std::span<const Vec3> maps, const Vec3& normalTangent) const override {
    return plan_.parts.front().encoding->decode(maps, normalTangent);
  }
  std::vector<StoredEncoding> stored() const override { return plan_.stored; }
  std::vector<MapGroup> groups() const override {
    std::vector<MapGroup> groups;
    for (const Part& part : plan_.parts)
      groups.push_back({part.first, part.encoding->mapCount(), part.encoding->isSigned()});
    return groups;
  }

 private:
  static Traits traitsOf(const Plan& plan) {
    Traits traits;
    for (const StoredEncoding& stored : plan.stored)
      traits.name += (traits.name.empty() ? "" : "+") + stored.encoding->name();
    for (const Part& part : plan.parts) {
      traits.mapNames.insert(traits.mapNames.end(), part.encoding->mapNames().begin(), part.encoding->mapNames().end());
      traits.isSigned = traits.isSigned || part.encoding->isSigned();
      if (part.encoding->domain() == Domain::Sphere) traits.domain = Domain::Sphere;
    }
    traits.conventions = plan.stored.front().encoding->conventions();
    return traits;
  }

  const Plan plan_;
};

}  // namespace

Expected<std::shared_ptr<const Encoding>> jointEncoding(std::vector<std::shared_ptr<const Encoding>> encodings) {
  LUMEL_CHECK(!encodings.empty());
  if (encodings.size() == 1 && !encodings.front()->source()) return encodings.front();
  Plan plan = planOf(std::move(encodings));
  if (plan.maps > kMostMaps)
    return usageError("these encodings need " + std::to_string(plan.maps) + " sampled maps, and " +
                      std::to_string(kMostMaps) + " are the most; leave one out");
  return std::shared_ptr<const Encoding>(std::make_shared<JointEncoding>(std::move(plan)));
}

}  // namespace lumel
