#include "lightmap/atlas/layout_memory.h"

#include <bit>
#include <string_view>
#include <unordered_map>

#include "scene/base/parallel.h"

namespace lumel {
namespace {

std::uint64_t mixed(std::uint64_t h, std::uint64_t value) {
  h = (h ^ value) * 0x9e3779b97f4a7c15u;
  h = (h ^ (h >> 29)) * 0xbf58476d1ce4e5b9u;
  return h ^ (h >> 32);
}

std::uint64_t hashOf(std::string_view text) {
  std::uint64_t h = text.size();
  for (const char c : text) h = mixed(h, static_cast<unsigned char>(c));
  return h;
}

std::uint64_t hashOf(const Primitive& primitive, std::uint32_t triangle) {
  std::uint64_t h = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& p = primitive.positions[primitive.indices[3 * triangle + k]];
    for (int axis = 0; axis < 3; ++axis) h = mixed(h, std::bit_cast<std::uint32_t>(p[axis]));
  }
  return h;
}

}  // namespace

std::vector<std::uint64_t> chartKeys(const Scene& scene, const ObjectLayouts& objects) {
  std::vector<std::vector<std::uint64_t>> keys(objects.uses.size());
  parallelFor(objects.uses.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t u = first; u < last; ++u) {
      const LayoutUse& use = objects.uses[u];
      const ObjectLayout& layout = objects.layouts[use.layout];
      const Instance& instance = scene.instances[static_cast<std::size_t>(use.instance)];
      const std::vector<Primitive>& primitives = scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives;
      const std::uint64_t name = hashOf(instance.name);
      for (const UnwrappedChart& chart : layout.unwrapped.charts) {
        std::uint64_t sum = 0;  // whatever the order of triangles
        for (const std::uint32_t t : chart.triangles) {
          const SourceTriangle source = layout.source[t];
          sum += hashOf(primitives[static_cast<std::size_t>(source.primitive)], source.triangle);
        }
        // A rectangle must not take the place of a chart of the same triangles, which may be turned.
        const std::uint64_t kind = layout.own ? ~std::uint64_t{0} : 0;
        keys[u].push_back(mixed(mixed(name, chart.triangles.size()), sum ^ kind));
      }
    }
  });
  std::vector<std::uint64_t> all;
  for (const auto& some : keys) all.insert(all.end(), some.begin(), some.end());
  return all;
}

std::vector<std::optional<KeptPlace>> recall(const RememberedLayout& layout, std::span<const std::uint64_t> keys) {
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> known;  // looked up only
  for (std::size_t i = layout.charts.size(); i-- > 0;) known[layout.charts[i].key].push_back(i);
  std::vector<std::optional<KeptPlace>> places(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const auto found = known.find(keys[i]);
    if (found == known.end() || found->second.empty()) continue;
    places[i] = layout.charts[found->second.back()].place;
    found->second.pop_back();
  }
  return places;
}

}  // namespace lumel
