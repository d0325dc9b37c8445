#include "tests/scene/scene_fuzz.h"

#include <cmath>

#include "scene/base/check.h"
#include "scene/gltf/gltf_loader.h"
#include "scene/obj/obj_loader.h"

namespace lumel {
namespace {

bool check(const Expected<Scene>& scene) {
  if (!scene) {
    LUMEL_CHECK(!scene.error().message.empty() && scene.error().message.find('\n') == std::string::npos);
    return false;
  }
  LUMEL_CHECK(!scene->materials.empty());
  for (const Instance& i : scene->instances) LUMEL_CHECK(static_cast<std::size_t>(i.mesh) < scene->meshes.size());
  for (const Mesh& mesh : scene->meshes)
    for (const Primitive& p : mesh.primitives) {
      const std::size_t n = p.positions.size();
      LUMEL_CHECK(p.normals.size() == n && (p.tangents.empty() || p.tangents.size() == n));
      LUMEL_CHECK(static_cast<std::size_t>(p.material) < scene->materials.size());
      for (const auto i : p.indices) LUMEL_CHECK(i < n);
      for (const auto& set : p.uvSets) LUMEL_CHECK(set.empty() || set.size() == n);
      for (std::size_t v = 0; v < n; ++v) LUMEL_CHECK(isFinite(p.positions[v]) && isFinite(p.normals[v]));
    }
  return true;
}

}  // namespace

bool fuzzLoadGltf(std::span<const std::uint8_t> bytes) {
  return check(loadGltf({bytes.begin(), bytes.end()}, "fuzz.glb", "/nonexistent", {}));
}

bool fuzzLoadObj(std::span<const std::uint8_t> bytes) {
  return check(loadObj({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, "fuzz.obj", "/nonexistent", {}));
}

}  // namespace lumel

#ifdef LUMEL_LIBFUZZER
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lumel::LUMEL_LIBFUZZER({data, size});  // -DLUMEL_LIBFUZZER=fuzzLoadGltf
  return 0;
}
#endif
