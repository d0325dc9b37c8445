#include "baker/bake/finish.h"

#include <gtest/gtest.h>

namespace lumel {
namespace {

/// A page of 6 x 1 texels: chart 0 on texels 0..2 (the last of them invalid), chart 1 on texel 4 (invalid).
struct Fixture {
  Atlas atlas;
  std::vector<PageTexels> texels{1};
  std::vector<BakedPage> pages{1};

  Fixture() {
    atlas.surfaces.resize(1);
    atlas.surfaces[0].charts = {0, 1};
    PageTexels& t = texels[0];
    t.width = 6;
    t.height = 1;
    BakedPage& page = pages[0];
    page.maps.assign(3, Image(6, 1, 3));
    page.flat = Image(6, 1, 3);
    page.aux = Image(6, 1, 4);
    page.mapErrors = Image(6, 1, 3);
    for (const auto& [x, triangle, light, validity] : {std::tuple(0, 0u, 1.0f, 1.0f), std::tuple(1, 0u, 3.0f, 0.6f),
                                                       std::tuple(2, 0u, 0.0f, 0.4f), std::tuple(4, 1u, 0.25f, 0.0f)}) {
      t.coords.push_back({static_cast<std::uint16_t>(x), 0});
      t.firstTriangle.push_back(static_cast<std::uint32_t>(t.triangles.size()));
      t.triangles.push_back({0, triangle});
      for (Image& map : page.maps) map.setRgb(x, 0, Vec3(light));
      page.flat.setRgb(x, 0, Vec3(light));
      page.aux.at(x, 0)[0] = 1.0f;
      page.aux.at(x, 0)[1] = validity;
      page.aux.at(x, 0)[2] = 0.1f * light;
      for (int map = 0; map < 3; ++map) page.mapErrors.at(x, 0)[map] = 0.2f * light;
    }
    t.firstTriangle.push_back(static_cast<std::uint32_t>(t.triangles.size()));
  }
};

TEST(Finish, InvalidTexelsTakeTheLightOfTheirChart) {
  Fixture f;
  Image auxBefore = f.pages[0].aux;
  finishPages(f.pages, f.atlas, f.texels, {});
  for (const Image* map : {&f.pages[0].maps[0], &f.pages[0].maps[2], &f.pages[0].flat}) {
    EXPECT_EQ(map->rgb(0, 0).x, 1.0f);
    EXPECT_EQ(map->rgb(1, 0).x, 3.0f);
    EXPECT_EQ(map->rgb(2, 0).x, 3.0f);   // from texel 1, the nearest valid one of its chart
    EXPECT_EQ(map->rgb(3, 0).x, 0.0f);   // nobody's: no border without dilation
    EXPECT_EQ(map->rgb(4, 0).x, 0.25f);  // its chart knows nothing better
  }
  // Errors go with the light; what else is known stays.
  EXPECT_EQ(f.pages[0].mapErrors.at(2, 0)[1], 0.2f * 3.0f);
  auxBefore.at(2, 0)[2] = 0.1f * 3.0f;
  EXPECT_EQ(f.pages[0].aux.pixels, auxBefore.pixels);
}

TEST(Finish, HalfsCutWhatIsBeyondThemAndSaySo) {
  Fixture f;
  BakeResult result;
  result.pages = f.pages;
  result.pages[0].flat.setRgb(0, 0, Vec3(1e6f, 65504.0f, 1.0f));
  result.pages[0].maps[1].setRgb(1, 0, Vec3(-7e4f, 0.0f, 0.0f));
  cutToHalf(result);
  EXPECT_EQ(result.pages[0].flat.rgb(0, 0), Vec3(65504.0f, 65504.0f, 1.0f));
  EXPECT_EQ(result.pages[0].maps[1].rgb(1, 0), Vec3(-65504.0f, 0.0f, 0.0f));
  ASSERT_EQ(result.stats.notes.size(), 1u);
  EXPECT_EQ(result.stats.notes[0],
            "2 values are beyond 65504, the most that --half holds, and are cut to it; the greatest was 1e+06");
  cutToHalf(result);
  EXPECT_EQ(result.stats.notes.size(), 1u);
}

TEST(Finish, DilationGrowsBeyondWhatIsCovered) {
  Fixture f;
  finishPages(f.pages, f.atlas, f.texels, {.rings = 1});
  EXPECT_EQ(f.pages[0].flat.rgb(3, 0).x, (3.0f + 0.25f) / 2);
  EXPECT_EQ(f.pages[0].flat.rgb(5, 0).x, 0.25f);
  EXPECT_EQ(f.pages[0].mapErrors.at(5, 0)[2], 0.2f * 0.25f);
  EXPECT_EQ(f.pages[0].aux.at(5, 0)[0], 0.0f);
}

}  // namespace
}  // namespace lumel
