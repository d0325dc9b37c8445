// The audit of a bake: silent where the maps are right, whatever its seed; loud where they are not, naming the object.
#include "baker/audit/audit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "baker/bake/bake.h"
#include "baker/light/lit_scene.h"
#include "scene/base/parallel.h"
#include "tests/baker/test_scene.h"

namespace lumel {
namespace {

using namespace testing_scene;

/// A room with a lamp and a doorway into a second one, which is lit through it alone and much darker.
TestScene twoRooms() {
  TestScene test;
  test.integrator = Integrator::Gather;
  const int white = test.addMaterial(Vec3(0.7f));
  const int lamp = test.addMaterial(Vec3(0.0f), Vec3(20.0f));
  test.scene.materials[static_cast<std::size_t>(lamp)].doubleSided = true;
  const RectangleOptions wall{.material = white, .texels = 24};
  test.addRectangle({0, 0, 3}, {8, 0, 0}, {0, 0, -3}, wall);     // floor of both
  test.addRectangle({0, 2.5f, 0}, {8, 0, 0}, {0, 0, 3}, wall);   // ceiling of both
  test.addRectangle({0, 0, 0}, {8, 0, 0}, {0, 2.5f, 0}, wall);   // back
  test.addRectangle({8, 0, 3}, {-8, 0, 0}, {0, 2.5f, 0}, wall);  // front
  test.addRectangle({0, 0, 3}, {0, 0, -3}, {0, 2.5f, 0}, wall);  // far left
  test.addRectangle({8, 0, 0}, {0, 0, 3}, {0, 2.5f, 0}, wall);   // far right
  test.addRectangle({4, 0, 1}, {0, 0, 2}, {0, 2.5f, 0}, wall);   // between them, seen from the left
  test.addRectangle({4, 0, 3}, {0, 0, -2}, {0, 2.5f, 0}, wall);  // and from the right
  test.addRectangle({1, 2.4f, 1}, {1, 0, 0}, {0, 0, 1}, {.material = lamp, .texels = 0});
  return test;
}

struct Audited {
  TestScene test = twoRooms();
  std::vector<PageTexels> texels = findTexels(test.atlas);
  std::unique_ptr<LitScene> lit = *LitScene::build(test.scene, true);
  BakeResult baked = test.bake({.samples = 256});
  std::vector<std::string> names;

  Audited() {
    for (std::size_t i = 0; i < test.scene.instances.size(); ++i) names.push_back("wall " + std::to_string(i));
  }
  /// `rays`: 0 for as many as a bake of this size takes.
  AuditReport run(std::uint64_t seed, std::uint64_t rays = 0) {
    BakeOptions options;
    options.seed = seed;
    if (rays == 0) {
      auditBake(*lit, test.atlas, texels, options, names, baked);
      return *baked.audit;
    }
    std::vector<const Image*> flat, aux;
    for (const BakedPage& page : baked.pages) {
      flat.push_back(&page.flat);
      aux.push_back(&page.aux);
    }
    return audit(lit->transport(), test.atlas, texels, flat, aux, names,
                 {.rays = rays, .bounces = kAllBounces, .seed = seed});
  }
};

TEST(Audit, IsSilentWhereTheMapsAreRight) {
  Audited audited;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const AuditReport report = audited.run(seed);
    EXPECT_EQ(report.worst(), 0.0) << seed;
    // The ratio of all agrees within its own interval; 4 sigma, as twelve are looked at.
    EXPECT_NEAR(report.all.ratio, 1.0, 4.0 * report.all.standardError + 0.005) << seed;
    EXPECT_LT(report.all.standardError, 0.02);
    EXPECT_GE(report.decades.size(), 1u);
  }
}

TEST(Audit, NamesTheObjectThatIsWrong) {
  Audited audited;
  // 15% too bright, on the right-hand side of the wall between the rooms alone.
  for (float& value : audited.baked.pages[7].flat.pixels) value *= 1.15f;
  const AuditReport report = audited.run(1, 6'000'000);
  ASSERT_FALSE(report.objects.empty());
  EXPECT_EQ(report.objects[0].name, "wall 7");
  EXPECT_TRUE(report.objects[0].wrong);
  EXPECT_NEAR(report.objects[0].ratio, 1.15, 4.0 * report.objects[0].standardError);
  EXPECT_EQ(report.objects[0].page, 7u);
  for (std::size_t i = 1; i < report.objects.size(); ++i)
    EXPECT_FALSE(report.objects[i].wrong) << report.objects[i].name;
}

TEST(Audit, FindsLightWherePathsFindNone) {
  Audited audited;
  // A room behind a wall that no light reaches, and a map that shines there.
  audited.test = twoRooms();
  const int page = audited.test.addRectangle({20, 0, 0}, {1, 0, 0}, {0, 1, 0}, {.texels = 24});
  audited.texels = findTexels(audited.test.atlas);
  audited.lit = *LitScene::build(audited.test.scene, true);
  audited.baked = audited.test.bake({.samples = 64});
  audited.names.emplace_back("outside");
  EXPECT_EQ(audited.run(1).worst(), 0.0);
  for (float& value : audited.baked.pages[static_cast<std::size_t>(page)].flat.pixels) value = 0.01f;
  EXPECT_TRUE(std::isinf(audited.run(1).worst()));
}

TEST(Audit, IsTheSameForAnyNumberOfThreads) {
  Audited audited;
  const AuditReport first = audited.run(3);
  const AuditReport again = audited.run(3);
  EXPECT_EQ(first.all.ratio, again.all.ratio);
  EXPECT_EQ(first.rays, again.rays);
  const ThreadLimit one(1);
  const AuditReport alone = audited.run(3);
  EXPECT_EQ(first.all.ratio, alone.all.ratio);
  EXPECT_EQ(first.rays, alone.rays);
}

TEST(Audit, OfNothingJudgesNothing) {
  TestScene test;
  const auto lit = *LitScene::build(test.scene, true);
  BakeResult baked;
  auditBake(*lit, test.atlas, {}, {}, {}, baked);
  EXPECT_FALSE(baked.audit->judged());
  EXPECT_EQ(baked.audit->worst(), 0.0);
}

}  // namespace
}  // namespace lumel
