// A bake that is stopped in one process and goes on in another.
#pragma once

#include <filesystem>
#include <fstream>
#include <vector>

#include "baker/bake/gather_session.h"
#include "baker/light/lit_scene.h"
#include "tests/baker/test_scene.h"

namespace lumel::testing_scene {

/// 130 samples: passes of 8, 8, 16, 32, 64 and 2.
inline BakeOptions resumedOptions() { return {.samples = 130, .seed = 7}; }

/// A room, ready to be baked with a session.
struct SessionRoom {
  TestScene test = busyRoom();
  std::vector<PageTexels> texels = findTexels(test.atlas);
  std::unique_ptr<LitScene> lit;

  SessionRoom() {
    if (auto built = LitScene::build(test.scene, true)) lit = *std::move(built);
  }
  Expected<BakeResult> bake(const BakeOptions& options, GatherSession& session) const {
    return lumel::bake(*lit, test.atlas, texels, options, noProgress(), &session);
  }
  std::uint64_t key(const BakeOptions& options) const { return sessionKey(*lit, test.atlas, texels, options); }
};

inline std::vector<const Image*> imagesOf(const BakedPage& page) {
  std::vector<const Image*> images = {&page.flat, &page.aux, &page.mapErrors};
  for (const Image& map : page.maps) images.push_back(&map);
  return images;
}

/// Writes the images' floats and the numbers of rays.
inline void writeResult(const BakeResult& result, const std::filesystem::path& path) {
  std::ofstream out(path, std::ios::binary);
  for (const BakedPage& page : result.pages)
    for (const Image* image : imagesOf(page))
      out.write(reinterpret_cast<const char*>(image->pixels.data()),
                static_cast<std::streamsize>(image->pixels.size() * sizeof(float)));
  out << result.stats.rays << ' ' << result.stats.shadowRays << ' ' << result.stats.nonFiniteSamples << '\n';
}

}  // namespace lumel::testing_scene
