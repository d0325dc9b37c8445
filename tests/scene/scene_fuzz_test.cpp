// Replays thousands of damaged files through the loaders: bytes changed, runs cut out or doubled, the end cut off,
// numbers in the JSON replaced by absurd ones. The damage is the same on every run.
#include <gtest/gtest.h>

#include <string>

#include "tests/scene/gltf_builder.h"
#include "tests/scene/gltf_samples.h"
#include "tests/scene/scene_fuzz.h"

namespace lumel {
namespace {

/// SplitMix64: a fixed sequence for a seed.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15ull;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
  std::size_t below(std::size_t n) { return n == 0 ? 0 : next() % n; }

 private:
  std::uint64_t state_;
};

std::vector<std::uint8_t> damaged(std::vector<std::uint8_t> bytes, Random& random) {
  for (std::size_t times = 1 + random.below(4); times > 0 && !bytes.empty(); --times) {
    const std::size_t at = random.below(bytes.size());
    const std::size_t run = 1 + random.below(std::min<std::size_t>(16, bytes.size() - at));
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    switch (random.below(6)) {
      case 0:
        *begin = static_cast<std::uint8_t>(random.next());
        break;
      case 1:
        *begin ^= static_cast<std::uint8_t>(1u << random.below(8));
        break;
      case 2:
        bytes.resize(at);
        break;
      case 3:
        bytes.erase(begin, begin + static_cast<std::ptrdiff_t>(run));
        break;
      case 4:
        bytes.insert(begin, run, static_cast<std::uint8_t>("0123456789-.e\"[]{},/ \n"[random.below(22)]));
        break;
      default:
        std::fill_n(begin, run, random.below(2) == 0 ? std::uint8_t{0xFF} : std::uint8_t{0});
    }
  }
  return bytes;
}

/// Replaces one value somewhere in the JSON (mostly a leaf) by one of the wrong kind or size.
void damageJson(nlohmann::json& json, Random& random) {
  using Json = nlohmann::json;
  static const Json kValues =
      Json::parse(R"([-1, 0, 1, 2, 3, 255, 65535, 2147483647, 4294967295, 4611686018427387904, 1.5,
                                             1e300, "x", null, [], {}, true, -2147483648, 5121, 5125])");
  Json* at = &json;
  while (at->is_structured() && !at->empty() && (at == &json || random.below(20) != 0)) {
    auto it = at->begin();
    std::advance(it, static_cast<std::ptrdiff_t>(random.below(at->size())));
    at = &*it;
  }
  *at = kValues[random.below(kValues.size())];
}

TEST(GltfFuzz, DamagedFilesGiveAnErrorOrAScene) {
  Random random(1);
  std::size_t loaded = 0, runs = 0;
  for (const auto& [name, sample] : gltfSamples()) {
    SCOPED_TRACE(name);
    const auto bytes = sample.glb();
    ASSERT_TRUE(fuzzLoadGltf(bytes)) << name;  // undamaged, it loads
    for (int i = 0; i < 700; ++i, ++runs) loaded += fuzzLoadGltf(damaged(bytes, random)) ? 1 : 0;
    for (int i = 0; i < 700; ++i, ++runs) {
      GltfBuilder changed = sample;
      changed.bin = damaged(changed.bin, random);
      loaded += fuzzLoadGltf(changed.glb()) ? 1 : 0;
    }
    for (int i = 0; i < 1400; ++i, ++runs) {
      GltfBuilder changed = sample;
      for (std::size_t times = 1 + random.below(3); times > 0; --times) damageJson(changed.json, random);
      if (!changed.json.is_object() || (changed.json.contains("buffers") && !changed.json["buffers"].is_array()))
        continue;
      loaded += fuzzLoadGltf(changed.glb()) ? 1 : 0;
    }
  }
  std::printf("%zu of %zu damaged files still load\n", loaded, runs);
  EXPECT_GT(loaded, runs / 50);  // the damage is not so great that nothing but the first check is reached
  EXPECT_LT(loaded, runs);
}

TEST(ObjFuzz, DamagedFilesGiveAnErrorOrAScene) {
  Random random(2);
  const std::string text =
      "mtllib none.mtl\no a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 2 1\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\n"
      "s 1\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4/1/1\ns off\ng b c\nf 1 2 5\nf -1 -2 -3 -4 -5\nl 1 2 3\np 1\n";
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  ASSERT_TRUE(fuzzLoadObj(bytes));
  std::size_t loaded = 0;
  for (int i = 0; i < 4000; ++i) loaded += fuzzLoadObj(damaged(bytes, random)) ? 1 : 0;
  std::printf("%zu of 4000 damaged files still load\n", loaded);
  EXPECT_GT(loaded, 100u);
  EXPECT_LT(loaded, 4000u);
}

}  // namespace
}  // namespace lumel
