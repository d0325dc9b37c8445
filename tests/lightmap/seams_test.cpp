// Seams between tiles whose light is known, and pairs of edges on small meshes.
#include "lightmap/seams/seams.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lightmap/atlas/atlas.h"
#include "lightmap/maps/rnm_basis.h"
#include "lightmap/seams/seam_maps.h"
#include "tests/lightmap/test_shapes.h"

namespace lumel {
namespace {

const BlockedCrossings kOpen = [](std::span<const SeamCrossing>, std::span<std::uint8_t>) {};
const BlockedCrossings kWalled = [](std::span<const SeamCrossing>, std::span<std::uint8_t> blocked) {
  std::fill(blocked.begin(), blocked.end(), std::uint8_t{1});
};

constexpr int kSize = 16;  // texels on a side of each tile's page

/// Tiles, each on the middle of a page of its own with empty texels around, and their maps.
struct Tiles {
  Atlas atlas;
  std::vector<std::array<Image, 4>> maps;  // flat and RNM
  std::vector<std::vector<float>> errors;
  std::vector<std::vector<float>> coverages;

  /// The rectangle corner, corner + right, corner + right + up, with `columns` x `rows` texels from `first` on.
  void add(const Vec3& corner, const Vec3& right, const Vec3& up, int columns, int rows, Vec2 first = Vec2(4)) {
    Surface surface;
    surface.page = static_cast<int>(atlas.pages.size());
    surface.instance = surface.page;
    surface.positions = {corner, corner + right, corner + right + up, corner + up};
    surface.normals.assign(4, glm::normalize(glm::cross(right, up)));
    surface.tangents.assign(4, Vec4(glm::normalize(right), 1.0f));
    const Vec2 low = first / float{kSize};
    const Vec2 high = (first + Vec2(columns, rows)) / float{kSize};
    surface.lightmapUvs = {{low.x, high.y}, {high.x, high.y}, {high.x, low.y}, {low.x, low.y}};
    surface.sourceVertex = {0, 1, 2, 3};
    surface.indices = {0, 1, 2, 0, 2, 3};
    surface.sourceTriangle = {0, 1};
    surface.charts.assign(2, static_cast<std::uint32_t>(atlas.charts.size()));
    atlas.charts.push_back({.surface = surface.page, .texelsPerMeter = 1.0f});
    atlas.pages.push_back({kSize, kSize});
    atlas.surfaces.push_back(surface);
    const Image black(kSize, kSize, 3);
    maps.push_back({black, black, black, black});
    errors.emplace_back(kSize * kSize, 0.0f);
    coverages.emplace_back(kSize * kSize, 0.0f);
  }

  /// Texels whose middle is on the tile get light(p), their RNM maps a directional part `along` of it in the world.
  template <class Light>
  void shine(std::size_t tile, const Light& light, const Vec3& along = Vec3(0), float error = 0.0f) {
    const Surface& s = atlas.surfaces[tile];
    const Vec2 low = s.lightmapUvs[3] * float{kSize}, high = s.lightmapUvs[1] * float{kSize};
    const Frame frame = frameFromTangent(s.normals[0], s.tangents[0]);
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const Vec2 share = (Vec2(x, y) + 0.5f - low) / (high - low);
        if (!(share.x > 0 && share.x < 1 && share.y > 0 && share.y < 1)) continue;
        const Vec3 p =
            s.positions[3] + share.x * (s.positions[1] - s.positions[0]) + share.y * (s.positions[0] - s.positions[3]);
        const float flat = light(p);
        maps[tile][0].setRgb(x, y, Vec3(flat));
        for (std::size_t i = 0; i < 3; ++i) {
          const Vec3 basis = frame.fromLocal(Vec3(kRnmBasis[i].x, kRnmBasis[i].y, 0.0f));
          maps[tile][i + 1].setRgb(x, y, Vec3(flat * (1.0f + glm::dot(along, basis))));
        }
        errors[tile][static_cast<std::size_t>(y * kSize + x)] = error;
        coverages[tile][static_cast<std::size_t>(y * kSize + x)] = 1.0f;
      }
  }

  std::vector<SeamPage> pages() {
    std::vector<SeamPage> all;
    for (std::size_t i = 0; i < maps.size(); ++i) {
      SeamPage page;
      page.flat = &maps[i][0];
      page.maps = std::span(maps[i]).subspan(1);
      for (const float covered : coverages[i])
        page.states.push_back(covered > 0.0f ? TexelState::Known : TexelState::Empty);
      page.errors = errors[i];
      page.coverages = coverages[i];
      all.push_back(page);
    }
    return all;
  }

  SeamFigures mend(const BlockedCrossings& blocked = kOpen) {
    const Seams seams = findSeams(atlas, blocked);
    std::vector<SeamPage> all = pages();
    const std::vector<BeyondTexel> beyond = texelsBeyond(seams, all);
    continueLight(seams, beyond, all);
    return mendSeams(seams, beyond, all);
  }

  /// A bilinear lookup at a point of the tile, as an engine makes it.
  float read(std::size_t tile, std::size_t map, const Vec3& p) const {
    const Surface& s = atlas.surfaces[tile];
    const Vec3 right = s.positions[1] - s.positions[0], up = s.positions[3] - s.positions[0];
    const float u = glm::dot(p - s.positions[0], right) / glm::dot(right, right);
    const float v = glm::dot(p - s.positions[0], up) / glm::dot(up, up);
    const Vec2 uv =
        s.lightmapUvs[0] + u * (s.lightmapUvs[1] - s.lightmapUvs[0]) + v * (s.lightmapUvs[3] - s.lightmapUvs[0]);
    const Vec2 at = uv * float{kSize} - 0.5f;
    const int x = static_cast<int>(std::floor(at.x)), y = static_cast<int>(std::floor(at.y));
    const float fx = at.x - static_cast<float>(x), fy = at.y - static_cast<float>(y);
    const auto texel = [&](int i, int k) { return maps[tile][map].rgb(i, k).x; };
    return (texel(x, y) * (1 - fx) + texel(x + 1, y) * fx) * (1 - fy) +
           (texel(x, y + 1) * (1 - fx) + texel(x + 1, y + 1) * fx) * fy;
  }
};

/// Two tiles of 8 x 8 m side by side at x = 8.
Tiles twoTiles() {
  Tiles tiles;
  tiles.add({0, 0, 0}, {8, 0, 0}, {0, 8, 0}, 8, 8);
  tiles.add({8, 0, 0}, {8, 0, 0}, {0, 8, 0}, 8, 8);
  return tiles;
}

// Rounding of texels to float, through the solve: a few units in the last place of light up to 4.
constexpr float kRounding = 2e-5f;

TEST(Seams, ASlopeGoesOnFromTileToTile) {
  Tiles tiles = twoTiles();
  const auto light = [](const Vec3& p) { return 1.0f + 0.2f * p.x + 0.05f * p.y; };
  for (const std::size_t tile : {0u, 1u}) tiles.shine(tile, light);
  const SeamFigures figures = tiles.mend();
  EXPECT_NEAR(figures.texels, 8.0, 1e-6);
  // Each side alone ends in its border texels' light: a step of one texel's slope, 0.2 of about 2.8.
  EXPECT_NEAR(figures.before.rms, 0.2 / 2.8, 0.005);
  EXPECT_LT(figures.after.most, kRounding);
  for (float y = 0.75f; y < 7.5f; y += 0.5f)
    for (const std::size_t tile : {0u, 1u})
      EXPECT_NEAR(tiles.read(tile, 0, {8, y, 0}), light({8, y, 0}), kRounding) << tile << " at " << y;
}

TEST(Seams, CoarseAndFineTilesMeetAndTurnedOnesToo) {
  Tiles tiles;
  const auto light = [](const Vec3& p) { return 1.0f + 0.1f * p.x + 0.05f * p.y; };
  tiles.add({0, 0, 0}, {8, 0, 0}, {0, 8, 0}, 8, 8);
  tiles.add({16, 0, 0}, {0, 8, 0}, {-8, 0, 0}, 4, 4, Vec2(5, 3));  // its image is turned by a quarter, half as dense
  for (const std::size_t tile : {0u, 1u}) tiles.shine(tile, light, {0.2f, 0.3f, 0});
  const SeamFigures figures = tiles.mend();
  // The two grids see the slope alike but for where tiles end: there a twentieth of a step of 4% may be left.
  EXPECT_LT(figures.after.most, 0.002);
  // The directional part agrees in world space: sum of map_i B_i along x and y, relative to the mean.
  for (float y = 2.0f; y < 6.5f; y += 1.0f)
    for (const std::size_t tile : {0u, 1u}) {
      const Frame frame =
          frameFromTangent(tiles.atlas.surfaces[tile].normals[0], tiles.atlas.surfaces[tile].tangents[0]);
      Vec3 sum(0);
      float mean = 0.0f;
      for (std::size_t i = 0; i < 3; ++i) {
        const float map = tiles.read(tile, i + 1, {8, y, 0});
        sum += map * frame.fromLocal(Vec3(kRnmBasis[i].x, kRnmBasis[i].y, 0.0f));
        mean += map / 3.0f;
      }
      EXPECT_NEAR(sum.x / mean, 0.2f, 1e-3f) << tile << " at " << y;
      EXPECT_NEAR(sum.y / mean, 0.3f, 1e-3f) << tile << " at " << y;
      EXPECT_NEAR(mean, tiles.read(tile, 0, {8, y, 0}), 1e-4f) << tile << " at " << y;
    }
}

TEST(Seams, AStepIsSharedByStatedErrors) {
  for (const float errorOfFirst : {0.02f, 0.002f}) {
    Tiles tiles = twoTiles();
    tiles.shine(
        0, [](const Vec3&) { return 1.0f; }, Vec3(0), errorOfFirst);
    tiles.shine(
        1, [](const Vec3&) { return 1.02f; }, Vec3(0), 0.02f);
    const SeamFigures figures = tiles.mend();
    EXPECT_NEAR(figures.before.rms, 0.02 / 1.01, 1e-4);
    EXPECT_LT(figures.after.most, 0.002);  // a tenth of the step
    const float a = tiles.read(0, 0, {8, 4, 0});
    EXPECT_GT(a, 1.0f);
    EXPECT_LT(a, 1.02f);
    // Away from the seam nothing changes.
    EXPECT_EQ(tiles.maps[0][0].rgb(7, 7).x, 1.0f);
    // A tenth of the error means that the other side comes all the way.
    const float change = tiles.maps[0][0].rgb(11, 8).x - 1.0f;
    if (errorOfFirst < 0.01f)
      EXPECT_LT(change, 0.002f);
    else
      EXPECT_NEAR(change, 1.02f - tiles.maps[1][0].rgb(4, 8).x, 5e-4f);
  }
}

TEST(Seams, NothingIsJoinedThroughAWall) {
  Tiles tiles = twoTiles();
  tiles.shine(0, [](const Vec3&) { return 0.9f; });
  tiles.shine(1, [](const Vec3&) { return 1.0f; });
  const auto before = tiles.maps;
  const SeamFigures figures = tiles.mend(kWalled);
  EXPECT_EQ(figures.points, 0u);
  for (std::size_t tile = 0; tile < 2; ++tile)
    for (std::size_t map = 0; map < 4; ++map) EXPECT_EQ(tiles.maps[tile][map].pixels, before[tile][map].pixels);
}

TEST(Seams, AnEdgeOfLightStaysAnEdge) {
  Tiles tiles = twoTiles();
  tiles.shine(0, [](const Vec3&) { return 0.1f; });
  tiles.shine(1, [](const Vec3&) { return 1.0f; });
  EXPECT_EQ(tiles.mend().points, 0u);  // ten times the light: something stands there that no ray has met
}

TEST(Seams, LightIsNeverNegative) {
  Tiles tiles = twoTiles();
  const auto light = [](const Vec3& p) { return std::max(0.0f, 0.3f * (std::abs(p.x - 7.0f) - 0.6f)); };
  for (const std::size_t tile : {0u, 1u}) tiles.shine(tile, light, {1.2f, 0.3f, 0}, 0.1f);
  tiles.mend();
  for (const auto& maps : tiles.maps)
    for (const Image& map : maps)
      for (const float value : map.pixels) EXPECT_GE(value, 0.0f);
}

TEST(Seams, CrossingsPassOverTheEdge) {
  Tiles tiles = twoTiles();
  std::vector<SeamCrossing> crossings;
  findSeams(tiles.atlas, [&](std::span<const SeamCrossing> all, std::span<std::uint8_t>) {
    crossings.assign(all.begin(), all.end());
  });
  ASSERT_EQ(crossings.size(), 16u);
  for (const SeamCrossing& c : crossings) {
    EXPECT_LT(std::min(c.from.x, c.to.x), 8.0f);
    EXPECT_GT(std::max(c.from.x, c.to.x), 8.0f);
    EXPECT_NEAR(c.from.z, 0.05f, 1e-6f);  // a tenth of half a texel of 1 m
    EXPECT_EQ(c.from.y, c.to.y);
  }
}

TEST(SeamPairs, ALongEdgeMeetsTheShortOnesAlongIt) {
  Tiles tiles;
  tiles.add({0, 0, 0}, {8, 0, 0}, {0, 8, 0}, 8, 8);
  tiles.add({8, 0, 0}, {3, 0, 0}, {0, 3, 0}, 3, 3);
  tiles.add({8, 3, 0}, {3, 0, 0}, {0, 5, 0}, 3, 5);
  const Seams seams = findSeams(tiles.atlas, kOpen);
  ASSERT_EQ(seams.pairs.size(), 3u);  // the two short ones meet each other, too
  double total = 0.0;
  for (const SeamPair& pair : seams.pairs) total += pair.length;
  EXPECT_NEAR(total, 3 + 5 + 3, 1e-5);
  const auto light = [](const Vec3& p) { return 1.0f + 0.2f * p.x + 0.05f * p.y; };
  for (const std::size_t tile : {0u, 1u, 2u}) tiles.shine(tile, light);
  EXPECT_LT(tiles.mend().after.most, 1e-3);  // the corner where three tiles meet is no crossing of four
}

TEST(SeamPairs, OnlySurfacesThatGoOnArePaired) {
  const auto pairs = [](const Vec3& right, const Vec3& up, const Vec3& corner) {
    Tiles tiles;
    tiles.add({0, 0, 0}, {8, 0, 0}, {0, 8, 0}, 8, 8);
    tiles.add(corner, right, up, 8, 8);
    return findSeams(tiles.atlas, kOpen).pairs.size();
  };
  EXPECT_EQ(pairs({8, 0, 0}, {0, 8, 0}, {8, 0, 0}), 1u);
  EXPECT_EQ(pairs({0, 8, 0}, {8, 0, 0}, {8, 0, 0}), 0u);     // seen from the back
  EXPECT_EQ(pairs({-8, 0, 0}, {0, -8, 0}, {8, 8, 0}), 0u);   // the same place once more
  EXPECT_EQ(pairs({0, 0, 8}, {0, 8, 0}, {8, 0, 0}), 0u);     // around a corner
  EXPECT_EQ(pairs({8, 0, 1.4f}, {0, 8, 0}, {8, 0, 0}), 0u);  // bent by 10 degrees
  EXPECT_EQ(pairs({8, 0, 0.2f}, {0, 8, 0}, {8, 0, 0}), 1u);  // by 1.4
  EXPECT_EQ(pairs({8, 0, 0}, {0, 8, 0}, {8.2f, 0, 0}), 0u);  // a gap of a fifth of a texel
  EXPECT_EQ(pairs({8, 0, 0}, {0, 8, 0}, {8.02f, 0, 0}), 1u);
  EXPECT_EQ(pairs({8, 0, 0}, {0, 8, 0}, {8, 8, 0}), 0u);  // corners that touch
}

TEST(SeamPairs, ACylinderIsPairedAtItsCut) {
  constexpr int kSides = 32;
  Shape pipe = grid(kSides, 1, true, false,
                    [](double u, double v) { return Vec3(std::cos(kTau * u), std::sin(kTau * u), 3.0 * v); });
  smoothNormals(pipe);
  Progress silent;
  const auto atlas = buildAtlas(pipe.scene(), {.texelsPerMeter = 20.0f}, silent);
  ASSERT_TRUE(atlas);
  const Seams seams = findSeams(atlas->atlas, kOpen);
  double total = 0.0;
  for (const SeamPair& pair : seams.pairs) total += pair.length;
  EXPECT_NEAR(total, 3.0, 1e-4);
}

TEST(SeamPairs, DegenerateInputIsLeftAlone) {
  Tiles tiles = twoTiles();
  const std::size_t right = findSeams(tiles.atlas, kOpen).pairs.size();
  tiles.add({8, 0, 0}, {0, 0, 0}, {0, 8, 0}, 8, 8);              // no area in space
  tiles.add({8, 0, 0}, {8, 0, 0}, {0, 8, 0}, 0, 8);              // nor on the page
  tiles.add({8, 0, 0}, {std::nanf(""), 0, 0}, {0, 8, 0}, 8, 8);  // not a number
  EXPECT_EQ(findSeams(tiles.atlas, kOpen).pairs.size(), right);
  EXPECT_TRUE(findSeams(Atlas{}, kOpen).pairs.empty());
  Tiles far;
  far.add({1e6f, 0, 0}, {8, 0, 0}, {0, 8, 0}, 8, 8);
  far.add({1e6f + 8, 0, 0}, {8, 0, 0}, {0, 8, 0}, 8, 8);
  EXPECT_EQ(findSeams(far.atlas, kOpen).pairs.size(), 1u);
}

}  // namespace
}  // namespace lumel
