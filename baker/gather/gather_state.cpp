#include "baker/gather/gather_state.h"

#include <algorithm>
#include <cstring>
#include <istream>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace lumel {
namespace {

/// Calibrated: 93 to 97% of texels lie within 1.96 standard errors.
constexpr double kGatherCredit = 0.5;

constexpr std::string_view kMagic = "lumel gather state\n";
/// Grows with every change of what is written.
constexpr std::uint32_t kVersion = 5;
constexpr std::size_t kBlock = std::size_t{1} << 20;

/// FNV-1a (Fowler, Noll, Vo) over words of eight bytes, the last filled up with zeros.
class Checksum {
 public:
  void add(const void* data, std::size_t bytes) {
    const char* at = static_cast<const char*>(data);
    for (; bytes > 0;) {
      std::uint64_t word = 0;
      const std::size_t part = std::min(bytes, sizeof word);
      std::memcpy(&word, at, part);
      hash_ = (hash_ ^ word) * 0x100000001b3ull;
      hash_ ^= hash_ >> 32;
      at += part;
      bytes -= part;
    }
  }
  template <class T>
  void addAll(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    add(values.data(), values.size() * sizeof(T));
  }
  template <class T>
  void addOne(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    add(&value, sizeof value);
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ull;
};

/// Calls visit(member) for all that a state file holds, in its order.
template <class State, class Visit>
void visitMembers(State& s, Visit visit) {
  visit(s.samples);
  visit(s.openEnd);
  visit(s.isWarm);
  visit(s.seconds);
  visit(s.passBegan);
  visit(s.secondsPerSample);
  visit(s.waves);
  visit(s.spreads);
  visit(s.errors.ofWaves);
  visit(s.errors.squares);
  visit(s.errors.sums);
  visit(s.errors.mapSums);
  visit(s.errors.credit);
  visit(s.errors.rate);
  visit(s.sums.flat);
  auto mapCount = static_cast<std::uint32_t>(s.sums.maps.size());
  visit(mapCount);
  // A count that is damaged is found out by the checksum, and until then asks for little.
  if constexpr (!std::is_const_v<State>) s.sums.maps.resize(std::min<std::size_t>(mapCount, kMostMaps));
  for (auto& map : s.sums.maps) visit(map);
  visit(s.levelSums);
  visit(s.probes);
  visit(s.backFaces);
  visit(s.samplesOf);
  visit(s.coverage);
  visit(s.covers);
  visit(s.buried);
  visit(s.reflectance);
  visit(s.radiance);
  visit(s.uneven);
  visit(s.places);
  visit(s.direct);
  visit(s.seen);
  visit(s.rays);
  visit(s.shadowRays);
  visit(s.nonFinite);
  visit(s.closedNonFinite);
}

class Writer {
 public:
  explicit Writer(std::ostream& out) : out_(out) {}
  template <class T>
  void operator()(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    put(&value, sizeof value);
  }
  template <class T>
  void operator()(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    (*this)(static_cast<std::uint64_t>(values.size()));
    put(values.data(), values.size() * sizeof(T));
  }
  std::uint64_t checksum() const { return sum_.value(); }

 private:
  void put(const void* data, std::size_t bytes) {
    sum_.add(data, bytes);
    out_.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
  }
  std::ostream& out_;
  Checksum sum_;
};

/// After a read that fails, all others do nothing.
class Reader {
 public:
  explicit Reader(std::istream& in) : in_(in) {}
  template <class T>
  void operator()(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    get(&value, sizeof value);
  }
  /// By blocks, so that a count that is wrong does not ask for memory that the file has no use for.
  template <class T>
  void operator()(std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    constexpr std::size_t kMost = kBlock / sizeof(T) / 8 * 8;  // whole words of the checksum
    std::uint64_t left = 0;
    (*this)(left);
    values.clear();
    const auto take = [&](std::size_t count) {
      const std::size_t before = values.size();
      values.resize(before + count);
      get(values.data() + before, count * sizeof(T));
      left -= count;
    };
    while (left > 0 && in_) take(static_cast<std::size_t>(std::min<std::uint64_t>(left, kMost)));
  }
  std::uint64_t checksum() const { return sum_.value(); }

 private:
  void get(void* data, std::size_t bytes) {
    in_.read(static_cast<char*>(data), static_cast<std::streamsize>(bytes));
    if (in_) sum_.add(data, bytes);
  }
  std::istream& in_;
  Checksum sum_;
};

}  // namespace

void TexelLight::resize(std::size_t count, std::size_t mapCount) {
  flat.resize(count);
  maps.resize(mapCount);
  for (std::vector<Vec3>& map : maps) map.resize(count);
}

GatherState::GatherState(const GatherScene& scene) : waves(scene.waves.size()), errors(scene.waves, kGatherCredit) {
  const std::size_t count = scene.map.size();
  backFaces.resize(count);
  samplesOf.resize(count);
  covers.resize(count);
  buried.resize(count);
  places.resize(count);
  if (scene.levels.count == 0) return;
  reflectance.resize(count);
  if (!scene.levels.endless) radiance.resize(count * scene.stored());  // else it is what the warm-up ends with
  if (!scene.leavesLightOut()) return;
  direct.resize(count);
  seen.resize(count);
}

void GatherState::makeSums(const GatherScene& scene) {
  const std::size_t count = scene.map.size();
  sums.resize(count, scene.encoding.mapCount());
  errors.mapSums.resize(count * scene.encoding.mapCount());
  coverage.resize(count);
  if (!scene.levels.endless) levelSums.resize(count * scene.stored());
  probes.resize(scene.waves.probes());
  if (!scene.strategies.empty()) spreads.resize(scene.waves.size() * (scene.strategies.size() + 1));
}

void GatherState::dropCache() {
  reflectance = std::vector<PackedColor>();  // `= {}` would keep the memory
  radiance = std::vector<PackedColor>();
  uneven = std::vector<std::uint8_t>();
  levelSums = std::vector<Vec3>();
  direct = std::vector<Vec3>();
  seen = std::vector<Vec3>();
  spreads = std::vector<LightSpread>();
}

bool GatherState::fits(const GatherScene& scene) const {
  const std::size_t count = scene.map.size();
  const std::size_t cached = scene.levels.count > 0 ? count : 0;
  const std::size_t shining = scene.leavesLightOut() ? cached : 0;
  const std::size_t summed = isWarm ? count : 0;
  const auto has = [](const auto& values, std::size_t wanted) { return values.size() == wanted; };
  bool fit = has(waves, scene.waves.size()) && has(errors.ofWaves, scene.waves.size()) && has(errors.squares, count) &&
             has(errors.sums, count) && has(backFaces, count) && has(samplesOf, count) && has(covers, count) &&
             has(buried, count) && has(places, count) && has(reflectance, cached) && has(direct, shining) &&
             has(seen, shining) && has(sums.flat, summed) && has(coverage, summed) &&
             has(probes, isWarm ? scene.waves.probes() : 0) && has(uneven, isWarm ? cached : 0);
  fit = fit && has(sums.maps, isWarm ? scene.encoding.mapCount() : 0);
  fit = fit && has(errors.mapSums, summed * scene.encoding.mapCount());
  for (const std::vector<Vec3>& map : sums.maps) fit = fit && has(map, summed);
  const std::size_t sources = scene.strategies.empty() ? 0 : scene.strategies.size() + 1;
  return fit && has(levelSums, scene.levels.endless ? 0 : summed * scene.stored()) &&
         has(spreads, isWarm ? scene.waves.size() * sources : 0) &&
         (has(radiance, cached * scene.stored()) || (!isWarm && radiance.empty())) &&
         closedNonFinite <= nonFinite.size();
}

std::uint64_t GatherState::samplesTaken(const GatherScene& scene) const {
  std::uint64_t taken = 0;
  for (std::size_t w = 0; w < waves.size(); ++w)
    taken += std::uint64_t{scene.waves[w].count} * std::max(samples, waves[w].samples);
  return taken;
}

std::span<LightSpread> GatherState::spreadsOf(const GatherScene& scene, std::size_t wave) {
  if (spreads.empty()) return {};
  const std::size_t sources = scene.strategies.size() + 1;
  return std::span(spreads).subspan(wave * sources, sources);
}

float GatherState::errorOf(const Waves& all, std::size_t wave, std::size_t i) const {
  return errors.standardError(all, wave, i, places);
}

std::uint64_t gatherKey(const GatherScene& scene, const GatherOptions& options) {
  Checksum key;
  key.addOne(options.samples);
  key.addOne(options.maxSamples);
  key.addOne(options.bounces);
  key.addOne(static_cast<int>(options.indirectOnly));
  key.addOne(options.seed);
  key.addOne(options.targetError);
  key.addOne(static_cast<int>(options.adaptive));
  key.addOne(options.timeBudgetSeconds);
  key.add(scene.encoding.name().data(), scene.encoding.name().size());
  key.addOne(scene.encoding.kernels(Vec3(0.0f, 0.6f, 0.8f)));
  key.addOne(scene.strategies.size());
  for (const PageTexels& page : scene.texels) {
    key.addOne(page.width);
    key.addOne(page.height);
    key.addAll(page.coords);
  }
  for (const Surface& surface : scene.atlas.surfaces) {
    key.addAll(surface.positions);
    key.addAll(surface.normals);
    key.addAll(surface.tangents);
    key.addAll(surface.lightmapUvs);
    key.addAll(surface.indices);
  }
  return key.value();
}

Expected<void> writeState(const GatherState& state, std::uint64_t key, std::ostream& out) {
  out.write(kMagic.data(), static_cast<std::streamsize>(kMagic.size()));
  Writer writer(out);
  writer(kVersion);
  writer(key);
  visitMembers(state, [&](const auto& member) { writer(member); });
  const std::uint64_t checksum = writer.checksum();
  out.write(reinterpret_cast<const char*>(&checksum), sizeof checksum);
  out.flush();
  if (!out) return failure("the state of the bake cannot be written; is there space left?");
  return {};
}

Expected<GatherState> readState(std::istream& in, std::uint64_t key) {
  std::string magic(kMagic.size(), '\0');
  in.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  if (!in || magic != kMagic) return inputError("this is no state of a bake; bake from the beginning");
  Reader reader(in);
  std::uint32_t version = 0;
  std::uint64_t keyHere = 0;
  reader(version);
  reader(keyHere);
  if (in && version != kVersion)
    return inputError("the state is of version " + std::to_string(version) + ", this program reads " +
                      std::to_string(kVersion) + "; bake from the beginning");
  if (in && keyHere != key)
    return inputError("the state is of another bake: its options, layout or surfaces differ; bake from the beginning");
  GatherState state;
  visitMembers(state, [&](auto& member) { reader(member); });
  const std::uint64_t checksum = reader.checksum();
  std::uint64_t written = 0;
  in.read(reinterpret_cast<char*>(&written), sizeof written);
  if (!in) return inputError("the state ends too early; bake from the beginning");
  if (written != checksum) return inputError("the state is damaged (its checksum is wrong); bake from the beginning");
  return state;
}

}  // namespace lumel
