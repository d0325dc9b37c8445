// scene.glb: written from plain data and read back by the loader.
#include "baker/files/write/glb_writer.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "scene/ies/ies_file.h"
#include "scene/images/image_io.h"
#include "scene/load/load_scene.h"
#include "tests/scratch.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;

constexpr float kHalfRoot = 0.70710678f;

/// One triangle in the plane z = 0 with two UV sets and colours, drawn twice: as it is with a lightmap, and mirrored
/// in x without one.
struct Fixture {
  Scene scene;
  Atlas atlas;

  Fixture() {
    Primitive p;
    p.name = "mesh 'Leaf' primitive 0";
    p.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    p.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
    p.tangents = {{1, 0, 0, 1}, {1, 0, 0, 1}, {1, 0, 0, 1}};
    p.uvSets = {{{0, 0}, {2, 0}, {0, 2}}, {{0.1f, 0.2f}, {0.3f, 0.4f}, {0.5f, 0.6f}}};
    p.colors = {{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}};
    p.indices = {0, 1, 2};
    scene.meshes = {{"Leaf", {p}}};
    scene.materials.resize(1);
    scene.instances.resize(2);
    scene.instances[0].name = "Left";
    scene.instances[1].name = "Right";
    scene.instances[1].worldFromObject[0][0] = -2.0f;
    scene.instances[1].worldFromObject[3] = Vec4(0, 5, 0, 1);
    scene.instances[1].settings.receives = false;

    Surface s;
    s.positions = p.positions;
    s.normals = p.normals;
    s.tangents = {{0, 1, 0, -1}, {0, 1, 0, -1}, {0, 1, 0, -1}};
    s.lightmapUvs = {{0.25f, 0.25f}, {0.75f, 0.25f}, {0.25f, 0.75f}};
    s.sourceVertex = {0, 1, 2};
    s.indices = {0, 1, 2};
    s.page = 3;
    atlas.surfaces = {s};
  }

  std::string encoded(SceneForm form) const {
    const auto pieces = encodeGlb(scene, atlas, form);
    EXPECT_TRUE(pieces);
    std::string glb;
    if (pieces)
      for (const auto& piece : *pieces) glb.append(piece.begin(), piece.end());
    return glb;
  }

  Scene roundTrip(SceneForm form = SceneForm::Instances) const {
    const std::string glb = encoded(form);
    const fs::path dir = scratch();
    std::ofstream(dir / "scene.glb", std::ios::binary).write(glb.data(), static_cast<std::streamsize>(glb.size()));
    auto loaded = loadScene(dir / "scene.glb");
    EXPECT_TRUE(loaded) << (loaded ? "" : loaded.error().message);
    return loaded ? std::move(*loaded) : Scene();
  }
};

TEST(GlbWriter, SurfacesKeepFramePageAndSourceAttributes) {
  const Fixture fixture;
  const Scene scene = fixture.roundTrip();
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(scene.instances[0].name, "Left");
  const Primitive& p = scene.primitive(scene.instances[0].mesh, 0);
  EXPECT_EQ(scene.instances[0].lightmapPageOf(p), 3);
  EXPECT_EQ(scene.instances[0].lightmap.scale, Vec2(1));
  EXPECT_EQ(scene.instances[0].lightmap.offset, Vec2(0));
  EXPECT_EQ(p.positions, fixture.atlas.surfaces[0].positions);
  EXPECT_EQ(p.tangents, fixture.atlas.surfaces[0].tangents);
  ASSERT_GE(p.uvSets.size(), 2u);
  EXPECT_EQ(p.uvSets[0], fixture.scene.meshes[0].primitives[0].uvSets[0]);
  EXPECT_EQ(p.uvSets[1], fixture.atlas.surfaces[0].lightmapUvs);
  EXPECT_EQ(p.colors[1], Vec4(0, 1, 0, 1));
}

/// As the atlas has it for an instance under a transform: in the world, of either handedness.
Surface movedBy(const Surface& surface, const Mat4& worldFromObject) {
  Surface s = surface;
  const Mat3 linear(worldFromObject);
  const bool mirrors = glm::determinant(linear) < 0;
  for (Vec3& p : s.positions) p = Vec3(worldFromObject * Vec4(p, 1));
  for (Vec3& n : s.normals) n = glm::normalize(glm::inverse(glm::transpose(linear)) * n);
  for (Vec4& t : s.tangents) t = Vec4(glm::normalize(linear * Vec3(t)), mirrors ? -t.w : t.w);
  if (mirrors) std::swap(s.indices[1], s.indices[2]);
  return s;
}

TEST(GlbWriter, InstancesWithUvsOfTheirOwnShareAMeshUnderTheirTransforms) {
  Fixture fixture;
  fixture.scene.instances[1].settings.receives = true;
  fixture.scene.instances.push_back(fixture.scene.instances[0]);
  fixture.scene.instances[2].worldFromObject =
      Mat4(Vec4(0, 3, 0, 0), Vec4(-3, 0, 0, 0), Vec4(0, 0, 3, 0), Vec4(1, 2, 3, 1));
  fixture.scene.instances[2].settings.texelDensityScale = 2.0f;
  fixture.atlas.places = {{3, {0.5f, 0.25f}, {0.1f, 0.2f}}, {1, {0.25f, 0.25f}, {0, 0}}, {0, {0.5f, 0.5f}, {0.5f, 0}}};
  for (int i = 1; i < 3; ++i) {
    const Mat4& m = fixture.scene.instances[static_cast<std::size_t>(i)].worldFromObject;
    fixture.atlas.surfaces.push_back(movedBy(fixture.atlas.surfaces[0], m));
    fixture.atlas.surfaces.back().instance = i;
    fixture.atlas.surfaces.back().page = fixture.atlas.places[static_cast<std::size_t>(i)].page;
  }
  const Scene scene = fixture.roundTrip();
  ASSERT_EQ(scene.instances.size(), 3u);
  EXPECT_EQ(scene.meshes.size(), 1u) << "mirrored and turned ones too";
  const Primitive& source = fixture.scene.meshes[0].primitives[0];
  for (std::size_t i = 0; i < 3; ++i) {
    const Instance& instance = scene.instances[i];
    const Primitive& p = scene.primitive(instance.mesh, 0);
    EXPECT_EQ(instance.worldFromObject, fixture.scene.instances[i].worldFromObject);
    EXPECT_EQ(instance.lightmapPageOf(p), fixture.atlas.places[i].page);
    EXPECT_EQ(instance.lightmap.scale, fixture.atlas.places[i].scale);
    EXPECT_EQ(instance.lightmap.offset, fixture.atlas.places[i].offset);
    EXPECT_EQ(p.positions, source.positions);
    EXPECT_EQ(p.normals, source.normals);
    EXPECT_EQ(p.uvSets.at(1), source.uvSets[1]);
    EXPECT_EQ(p.indices, source.indices);
    EXPECT_EQ(p.tangents[0], Vec4(0, 1, 0, -1));
  }
  EXPECT_EQ(scene.instances[2].settings.texelDensityScale, 2.0f);
}

TEST(GlbWriter, PagesStandAtPrimitivesWhereTheyDiffer) {
  Fixture fixture;
  fixture.scene.instances.resize(1);
  fixture.scene.meshes[0].primitives.push_back(fixture.scene.meshes[0].primitives[0]);
  const Scene some = fixture.roundTrip();  // the second primitive has no lightmap
  EXPECT_EQ(some.instances[0].lightmapPageOf(some.primitive(0, 0)), 3);
  EXPECT_EQ(some.instances[0].lightmapPageOf(some.primitive(0, 1)), -1);
  fixture.atlas.surfaces.push_back(fixture.atlas.surfaces[0]);
  fixture.atlas.surfaces[1].primitive = 1;
  fixture.atlas.surfaces[1].page = 4;
  const Scene both = fixture.roundTrip();
  EXPECT_EQ(both.instances[0].lightmapPageOf(both.primitive(0, 0)), 3);
  EXPECT_EQ(both.instances[0].lightmapPageOf(both.primitive(0, 1)), 4);
}

TEST(GlbWriter, ANodeThatShearsIsWrittenInTheWorld) {
  Fixture fixture;
  fixture.scene.instances[1].worldFromObject[1] = Vec4(1, 1, 0, 0);
  const Scene scene = fixture.roundTrip();
  EXPECT_EQ(scene.instances[1].worldFromObject, Mat4(1.0f));
  EXPECT_EQ(scene.primitive(scene.instances[1].mesh, 0).positions[2], Vec3(1, 6, 0));
}

TEST(GlbWriter, FlattenedPrimitivesSayTheirPage) {
  const Scene scene = Fixture().roundTrip(SceneForm::Flattened);
  EXPECT_EQ(scene.primitive(scene.instances[0].mesh, 0).lightmapPage, 3);
  EXPECT_EQ(scene.instances[0].lightmap.page, -1);
}

TEST(GlbWriter, PrimitivesWithoutLightmapMoveToTheWorld) {
  const Scene scene = Fixture().roundTrip(SceneForm::Flattened);
  ASSERT_EQ(scene.instances.size(), 2u);
  const Instance& right = scene.instances[1];
  EXPECT_FALSE(right.settings.receives);
  const Primitive& p = scene.primitive(right.mesh, 0);
  EXPECT_EQ(right.lightmapPageOf(p), -1);
  EXPECT_EQ(right.worldFromObject, Mat4(1.0f));
  EXPECT_EQ(p.positions[1], Vec3(-2, 5, 0));
  // The front is still on +z after the mirroring.
  const auto& i = p.indices;
  const Vec3 front = glm::cross(p.positions[i[1]] - p.positions[i[0]], p.positions[i[2]] - p.positions[i[0]]);
  EXPECT_GT(front.z, 0.0f);
  EXPECT_EQ(p.normals[0], Vec3(0, 0, 1));
  // w * cross(n, t) is still +y, where the object's bitangent points.
  EXPECT_EQ(p.tangents[0].w * glm::cross(p.normals[0], Vec3(p.tangents[0])), Vec3(0, 1, 0));
}

TEST(GlbWriter, MaterialsSurvive) {
  Fixture fixture;
  Image pixels(2, 2, 3, 0.5f);
  auto png = encodePng(pixels);
  ASSERT_TRUE(png);
  fixture.scene.images = {{"dots", "image/png", *png}, {"gone", "image/png", {}}};
  Material& m = fixture.scene.materials[0];
  m.name = "Leaf";
  m.baseColor = {0.5f, 0.25f, 0.125f, 0.75f};
  m.baseColorMap.image = 0;
  m.baseColorMap.uvSet = 1;
  m.baseColorMap.wrapU = Wrap::Mirror;
  m.baseColorMap.wrapV = Wrap::Clamp;
  // A quarter turn, scales 2 and 3, an offset: columns scaleU * (cos, -sin), scaleV * (sin, cos).
  m.baseColorMap.uvMatrix = Mat3(Vec3(0, -2, 0), Vec3(3, 0, 0), Vec3(0.25f, 0.5f, 1));
  m.normalMap.image = 0;
  m.normalMap.nearest = true;
  m.normalScale = 0.5f;
  m.emission = {4, 2, 1};
  m.emissionMap.image = 1;  // its file was missing
  m.alphaMode = AlphaMode::Mask;
  m.alphaCutoff = 0.25f;
  m.doubleSided = true;
  m.metallic = 0.5f;
  m.roughness = 0.25f;
  const Scene scene = fixture.roundTrip();
  const Primitive& p = scene.primitive(0, 0);
  const Material& read = scene.materials[static_cast<std::size_t>(p.material)];
  EXPECT_EQ(read.name, "Leaf");
  EXPECT_EQ(read.baseColor, m.baseColor);
  // The material reads set 1 of the source, which made room for the lightmap.
  EXPECT_EQ(read.baseColorMap.uvSet, 2);
  ASSERT_EQ(p.uvSets.size(), 3u);
  EXPECT_EQ(p.uvSets[2], fixture.scene.meshes[0].primitives[0].uvSets[1]);
  EXPECT_EQ(read.baseColorMap.wrapU, Wrap::Mirror);
  EXPECT_EQ(read.baseColorMap.wrapV, Wrap::Clamp);
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r)
      EXPECT_NEAR(read.baseColorMap.uvMatrix[c][r], m.baseColorMap.uvMatrix[c][r], 1e-6f) << c << r;
  EXPECT_EQ(scene.images[static_cast<std::size_t>(read.normalMap.image)].encoded, *png);
  EXPECT_TRUE(read.normalMap.nearest);
  EXPECT_EQ(read.normalScale, 0.5f);
  EXPECT_EQ(read.emission, m.emission);
  EXPECT_FALSE(read.emissionMap);
  EXPECT_EQ(read.alphaMode, AlphaMode::Mask);
  EXPECT_EQ(read.alphaCutoff, 0.25f);
  EXPECT_TRUE(read.doubleSided);
  EXPECT_EQ(read.metallic, 0.5f);
  EXPECT_EQ(read.roughness, 0.25f);
}

TEST(GlbWriter, LightsAndCamerasSurvive) {
  Fixture fixture;
  Light sun{.name = "Sun",
            .type = LightType::Directional,
            .color = {1, 0.5f, 0.25f},
            .intensity = 3.0f,
            .direction = {0, -1, 0}};
  Light spot{.name = "Spot",
             .type = LightType::Spot,
             .intensity = 20.0f,
             .position = {1, 2, 3},
             .direction = {kHalfRoot, 0, kHalfRoot},
             .range = 7.0f,
             .innerConeAngle = 0.25f,
             .outerConeAngle = 0.5f};
  fixture.scene.lights = {sun, spot};
  Camera camera;
  camera.name = "Eye";
  camera.worldFromCamera[3] = Vec4(4, 5, 6, 1);
  camera.yFov = 1.0f;
  camera.aspect = 1.5f;
  fixture.scene.cameras = {camera};
  const Scene scene = fixture.roundTrip();
  ASSERT_EQ(scene.lights.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const Light& a = fixture.scene.lights[i];
    const Light& b = scene.lights[i];
    EXPECT_EQ(b.name, a.name);
    EXPECT_EQ(b.type, a.type);
    EXPECT_EQ(b.color, a.color);
    EXPECT_EQ(b.intensity, a.intensity);
    EXPECT_NEAR(glm::length(b.direction - a.direction), 0.0f, 1e-6f);
    EXPECT_NEAR(glm::length(b.position - a.position), 0.0f, 1e-6f);
  }
  EXPECT_EQ(scene.lights[1].range, 7.0f);
  EXPECT_EQ(scene.lights[1].innerConeAngle, 0.25f);
  EXPECT_EQ(scene.lights[1].outerConeAngle, 0.5f);
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.cameras[0].worldFromCamera, camera.worldFromCamera);
  EXPECT_EQ(scene.cameras[0].yFov, 1.0f);
  EXPECT_EQ(scene.cameras[0].aspect, 1.5f);
}

TEST(GlbWriter, LampsThatGltfDoesNotHaveSurvive) {
  Fixture fixture;
  Light panel{.name = "Panel",
              .type = LightType::Rectangle,
              .color = {1, 0.5f, 0.25f},
              .intensity = 3.0f,
              .position = {1, 2, 3},
              .direction = {0, -1, 0},
              .right = {0, 0, 1},
              .up = {1, 0, 0}};
  panel.size = {2.0f, 0.5f};
  Light soft{.name = "Soft", .type = LightType::Point, .intensity = 20.0f};
  soft.radius = 0.25f;
  soft.mode = LightMode::Indirect;
  soft.hasShadowMask = true;
  Light sphere = soft;
  sphere.name = "Sphere";
  sphere.type = LightType::Sphere;
  sphere.profile = std::make_shared<const LightProfile>(
      *parseIes("TILT=NONE\n1 1 1 2 1 1 2 0 0 0 1 1 1\n0 90\n0\n4 2\n"));
  Light sun{.name = "Sun", .type = LightType::Directional};
  sun.halfAngle = 0.0046f;
  fixture.scene.lights = {panel, soft, sphere, sun};
  const Scene scene = fixture.roundTrip();
  ASSERT_EQ(scene.lights.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const Light& a = fixture.scene.lights[i];
    const Light& b = scene.lights[i];
    EXPECT_EQ(b.name, a.name);
    EXPECT_EQ(b.type, a.type);
    EXPECT_EQ(b.color, a.color);
    EXPECT_NEAR(b.intensity, a.intensity, 1e-5f * a.intensity);
    EXPECT_EQ(b.mode, a.mode);
    EXPECT_EQ(b.hasShadowMask, a.hasShadowMask);
    EXPECT_NEAR(b.radius, a.radius, 1e-6f);
    EXPECT_NEAR(b.halfAngle, a.halfAngle, 1e-7f);
    EXPECT_NEAR(glm::length(b.size - a.size), 0.0f, 1e-6f);
    EXPECT_NEAR(glm::length(b.direction - a.direction), 0.0f, 1e-6f);
  }
  EXPECT_NEAR(glm::length(scene.lights[0].right - panel.right), 0.0f, 1e-6f);
  EXPECT_NEAR(glm::length(scene.lights[0].up - panel.up), 0.0f, 1e-6f);
  ASSERT_TRUE(scene.lights[2].profile);
  EXPECT_EQ(scene.lights[2].profile->text, sphere.profile->text);
}

TEST(GlbWriter, ContainerFollowsTheSpecification) {
  const std::string glb = Fixture().encoded(SceneForm::Instances);
  ASSERT_GT(glb.size(), 20u);
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, glb.data() + at, 4);
    return static_cast<std::size_t>(value);
  };
  EXPECT_EQ(word(0), 0x46546C67u);
  EXPECT_EQ(word(4), 2u);
  EXPECT_EQ(word(8), glb.size());
  const std::size_t jsonSize = word(12);
  EXPECT_EQ(jsonSize % 4, 0u);
  EXPECT_EQ(word(16), 0x4E4F534Au);
  const auto json =
      nlohmann::json::parse(glb.begin() + 20, glb.begin() + 20 + static_cast<std::ptrdiff_t>(jsonSize), nullptr, false);
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(word(20 + jsonSize) % 4, 0u);
  for (const auto& view : json["bufferViews"]) EXPECT_EQ(view["byteOffset"].get<int>() % 4, 0);
  for (const auto& mesh : json["meshes"])
    for (const auto& primitive : mesh["primitives"]) {
      const auto& position = json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
      EXPECT_EQ(position["min"].size(), 3u);
      EXPECT_EQ(position["max"].size(), 3u);
      // TEXCOORD numbers follow each other from 0.
      const bool gap =
          primitive["attributes"].contains("TEXCOORD_1") && !primitive["attributes"].contains("TEXCOORD_0");
      EXPECT_FALSE(gap);
    }
}

TEST(GlbWriter, EmptySceneIsAValidFile) {
  Fixture fixture;
  fixture.scene.instances.clear();
  fixture.scene.meshes.clear();
  fixture.atlas.surfaces.clear();
  EXPECT_TRUE(fixture.roundTrip().instances.empty());
}

}  // namespace
}  // namespace lumel
